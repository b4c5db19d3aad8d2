//! Lowers a checked program to IR.
//!
//! Conditions are computed without branches, and one that only switches a few bits becomes plain
//! bit operations. OP is kept in a value of the IR and stored in the image where control leaves the
//! straight line and something can read it there. Status flags are computed only if something can
//! read them (`liveness`). A call stores its number in the image, so that a module can be suspended
//! inside subroutines too.

mod arith;
mod condition;
mod flow;
mod liveness;
mod memory;

use plcc_abi::nct::{context, layout::region};
use plcc_ir::chunk::DEFAULT_LIMIT;
use plcc_ir::{
    Address, BinaryOp, ChunkBuilder, InstBuilder, IntCond, Module, Place, RegionId, Statement,
    Type, UnaryOp, Value,
};

use crate::common::{BrokenInvariant, LowerError, OrMissing, ReturnStack};
use crate::nct::{
    ast::{Op, Program, Stmt, Word},
    layout::{Layout, SCRATCH, WAITING},
    lower::liveness::{LiveSet, liveness},
};

type Result<T = ()> = std::result::Result<T, BrokenInvariant>;

/// Lowers a program. Its tasks are the modules that it has, in their order.
///
/// # Errors
/// If the program is too long, or it or its layout is inconsistent.
pub(super) fn lower(program: &Program, layout: &Layout) -> std::result::Result<Code, LowerError> {
    lower_with(program, layout, DEFAULT_LIMIT)
}

/// Lowers a program; a function gets at most about `limit` instructions or blocks. This is for
/// tests.
pub(super) fn lower_with(
    program: &Program,
    layout: &Layout,
    limit: usize,
) -> std::result::Result<Code, LowerError> {
    let builder = ChunkBuilder::new(layout.size, layout.regions.clone()).with_limit(limit);
    let find = |name: &str| builder.region(name).or_missing(|| format!("region `{name}`"));
    let [flag_bytes, _] = region::FLAG;
    let regions = Regions {
        context: find(region::CONTEXT)?,
        scratch: find(SCRATCH)?,
        waiting: find(WAITING)?,
        flag_bytes: find(flag_bytes)?,
    };
    let mut lowerer = Lowerer {
        program,
        layout,
        liveness: liveness(program),
        limit,
        regions,
        places: vec![None; program.stmts.len() + 1],
        labels: vec![],
        sites: vec![],
        jumps: vec![],
        emptied: vec![],
        stubs: vec![],
        timeout: None,
        too_deep: None,
        op: None,
        dirty: false,
        return_stack: None,
        builder,
    };
    lowerer.program()?;
    match lowerer.builder.statement_over_budget() {
        Some(statement) => Err(LowerError::TooLong(statement)),
        None => {
            let return_stack = lowerer.return_stack;
            Ok(Code { module: lowerer.builder.finish(), return_stack })
        }
    }
}

/// The code of a program.
pub(super) struct Code {
    pub(super) module: Module,
    /// Where subroutines find out where to return to, if there are any.
    pub(super) return_stack: Option<ReturnStack>,
}

/// The regions that are addressed by themselves rather than through a [`Layout`]'s offsets.
struct Regions {
    context: RegionId,
    scratch: RegionId,
    waiting: RegionId,
    flag_bytes: RegionId,
}

/// Lowers one program.
struct Lowerer<'a> {
    program: &'a Program,
    layout: &'a Layout,
    /// The live set before each statement.
    liveness: Vec<LiveSet>,
    /// At how many instructions or blocks a function ends.
    limit: usize,
    regions: Regions,
    /// The place before each statement that something leads to.
    places: Vec<Option<Place>>,
    /// The labels to which indirect jumps and calls can lead, with the indices of their statements.
    labels: Vec<(u16, usize)>,
    /// The indices of the statements that call, in the source's order. The index in this list is
    /// the call's number.
    sites: Vec<usize>,
    /// The indices of the statements that jump back, or may do so, in the source's order.
    jumps: Vec<usize>,
    /// For each place that safepoints lead to the place of the code for fuel that is used up.
    emptied: Vec<(Place, Place)>,
    /// The code that indirect jumps and calls share.
    stubs: Vec<flow::Stub>,
    /// The place of the trap for a module that takes too long.
    timeout: Option<Place>,
    /// The place of the trap for indirect calls that nest too deep.
    too_deep: Option<Place>,
    /// Register OP, if the current block has it in a value.
    op: Option<Value>,
    /// Whether `op` has changed and is not stored in the image yet.
    dirty: bool,
    /// Where subroutines find out where to return to, if there are any.
    return_stack: Option<ReturnStack>,
    builder: ChunkBuilder,
}

impl Lowerer<'_> {
    fn program(&mut self) -> Result {
        self.builder.add_file(self.program.name.clone(), self.program.text.clone());
        self.find_places();
        self.trap_sites()?;
        self.entries();
        let mut at = 0;
        while at < self.program.stmts.len() {
            if self.builder.statement_over_budget().is_some() {
                return Ok(());
            }
            at = self.lower_statement(at).map_err(|error| {
                let line = self.program.lines.get(at).copied().unwrap_or(1);
                error.or_at(&self.program.name, line)
            })?;
        }
        self.go_on_at(at);
        self.leave(LiveSet::ALL);
        self.builder.ret();
        self.shared_code();
        Ok(())
    }

    /// Begins the code of a statement. Another function may begin here.
    fn begin(&mut self, at: usize) -> Result {
        let span = self.statement_at(at)?.span;
        let (start, end) = (span.start, span.end);
        let line = self.program.lines.get(at).copied();
        let line = line.or_missing(|| format!("the line of statement {at}"))?;
        let func = self.builder.func();
        if func.length() >= self.limit || func.func().block_count() >= self.limit {
            self.leave(self.live_at(at));
            self.op = None;
        }
        self.builder.statement(Statement { file: 0, line, start, end });
        Ok(())
    }

    /// The statement with the index `at`.
    fn statement_at(&self, at: usize) -> Result<&Stmt> {
        self.program.stmts.get(at).or_missing(|| format!("statement {at}"))
    }

    /// The live set before the statement with the index `at`.
    fn live_at(&self, at: usize) -> LiveSet {
        self.liveness.get(at).copied().unwrap_or(LiveSet::ALL)
    }

    /// Binds the place before a statement, if something leads to it.
    fn go_on_at(&mut self, at: usize) {
        if let Some(place) = self.places.get(at).copied().flatten() {
            self.leave(self.live_at(at));
            self.bind(place);
        }
    }

    /// Binds a place. After it register OP is in the image.
    fn bind(&mut self, place: Place) {
        self.builder.bind(place);
        self.op = None;
        self.dirty = false;
    }

    /// Stores OP in the image before control leaves the block, if it is in `live`, the set of what
    /// can be read there.
    fn leave(&mut self, live: LiveSet) {
        if let (true, Some(op)) = (self.dirty, self.op)
            && live.has(LiveSet::OP)
        {
            let at = Address::fixed(self.regions.context, context::OP);
            self.builder.func().store(at, op);
        }
        self.dirty = false;
    }

    /// Register OP, an i16.
    fn op(&mut self) -> Value {
        if let Some(op) = self.op {
            return op;
        }
        let at = Address::fixed(self.regions.context, context::OP);
        let op = self.builder.func().load(Type::I16, at);
        self.op = Some(op);
        op
    }

    /// Sets register OP.
    fn set_op(&mut self, value: Value) {
        self.op = Some(value);
        self.dirty = true;
    }

    /// The place before a statement, to which a branch can lead.
    fn place(&mut self, at: usize) -> Place {
        let at = at.min(self.program.stmts.len());
        match self.places.get(at).copied().flatten() {
            Some(place) => place,
            None => {
                let place = self.builder.place();
                if let Some(slot) = self.places.get_mut(at) {
                    *slot = Some(place);
                }
                place
            }
        }
    }

    /// Lowers the statement with the index `at`. Returns the index of the one to lower next.
    fn lower_statement(&mut self, at: usize) -> Result<usize> {
        self.go_on_at(at);
        let stmt = *self.statement_at(at)?;
        let after = self.live_at(at + 1);
        if !matches!(stmt.op, Op::EndIf | Op::Label(_) | Op::Text) {
            self.begin(at)?;
        }
        match stmt.op {
            Op::Set(bit) | Op::Clear(bit) => {
                let on = matches!(stmt.op, Op::Set(_));
                let value = self.builder.func().constant(Type::I1, on.into());
                self.store_bit(bit, value)?;
            }
            Op::Count { counter, up } => self.count(counter, up)?,
            Op::Load(operand) => self.load(operand)?,
            Op::Store { negate, place: variable } => self.store(negate, variable)?,
            Op::Arith { op, operand } => self.arith(op, operand, after)?,
            Op::Update { op, negate, place: variable } => {
                self.update(op, negate, variable, after)?
            }
            Op::Shift { left, by } => {
                let op = self.op();
                let how = if left { BinaryOp::Shl } else { BinaryOp::Lshr };
                let value = self.builder.func().binary_imm(how, op, by.into());
                self.set_op(value);
            }
            Op::Bin => self.bin(after)?,
            Op::Bcd => self.bcd(after)?,
            Op::Push(slot) => {
                let op = self.op();
                let at = Address::fixed(self.regions.scratch, u32::from(slot) * 2);
                self.builder.func().store(at, op);
            }
            Op::Apply { op, slot } => {
                let with = self.op();
                let at = Address::fixed(self.regions.scratch, u32::from(slot) * 2);
                let kept = self.builder.func().load(Type::I16, at);
                self.combine(op, kept, with, None, after)?;
            }
            Op::If { first, count, otherwise } => {
                return self.conditional(at, first, count, otherwise as usize);
            }
            Op::Else { end } => {
                self.leave(self.live_at(end as usize + 1));
                let place = self.place(end as usize + 1);
                self.builder.jump(place);
            }
            Op::Goto(label) => self.goto(at, label)?,
            Op::GotoIndirect(word) => self.jump_indirect(at, word, false)?,
            Op::Call(label) => self.call(at, label)?,
            Op::CallIndirect(word) => self.jump_indirect(at, word, true)?,
            Op::Return => self.ret(),
            Op::End(_) => {
                self.leave(LiveSet::ALL);
                self.builder.ret();
            }
            Op::Area { op, area } => {
                let with = self.op();
                let func = self.builder.func();
                let with = func.zextend_or_trunc(Type::I32, with);
                let area = func.constant(Type::I32, area.into());
                func.host_call(op.host_function(), &[area, with]);
            }
            Op::EndIf | Op::Label(_) | Op::Text | Op::Bad { .. } => {}
        }
        Ok(at + 1)
    }

    fn count(&mut self, counter: u8, up: bool) -> Result {
        let at = self.register(Word::Q(counter))?;
        let old = self.builder.func().load(Type::I16, at);
        let value = self.builder.func().binary_imm(BinaryOp::Add, old, if up { 1 } else { -1 });
        self.builder.func().store(at, value);
        Ok(())
    }

    fn not(&mut self, value: Value) -> Value {
        self.builder.func().unary(UnaryOp::Not, value)
    }

    fn both(&mut self, a: Value, b: Value) -> Value {
        self.builder.func().binary(BinaryOp::And, a, b)
    }

    fn is_zero(&mut self, value: Value) -> Value {
        self.builder.func().icmp_imm(IntCond::Eq, value, 0)
    }

    /// `new` if the guard holds or there is none, otherwise `old`.
    fn guarded(&mut self, guard: Option<Value>, new: Value, old: Value) -> Value {
        match guard {
            Some(guard) => self.builder.func().select(guard, new, old),
            None => new,
        }
    }
}
