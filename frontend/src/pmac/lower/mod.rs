//! Lowers a checked download to IR: one task for each PLC and PLCC, one for the text of each
//! COMMAND, and one for each motion program ([`motion`]).
//!
//! PLCs are lowered twice, which is a kind of speculation: specialised code accesses M-variables at
//! the places that the assumed definitions give, general code looks before each statement whether the
//! variables that it names still have these definitions, and has the host execute it if not ([`general`]). The
//! guard that decides which of the two runs is a word of the image that is not 0 once a definition
//! differs from the assumed one. It is checked at the entry of the task, at every WHILE at which a
//! suspended scan goes on, and after every statement that may change a definition. From there
//! control goes to the code that fits.
//!
//! All arithmetic is lowered as the control's floating point, but for statements of L-variables
//! ([`integer`]). Passes over IR make integer arithmetic of it where that gives the same.

pub(crate) mod emit;
mod expression;
mod field;
mod general;
mod integer;
mod motion;
mod variables;

use plcc_abi::HostFn;
use plcc_abi::pmac::layout::exec;
use plcc_abi::pmac::{DirectAccess, Field, Layout, Range};
use plcc_diag::{FileId, SourceMap};
use plcc_ir::{Address, ChunkBuilder, InstBuilder, Module, Place, Statement, Type, Value};

use self::emit::Operand;
use crate::common::{BrokenInvariant, LowerError};
use crate::pmac::analyse::assumptions;
use crate::pmac::analyse::load::Loaded;
use crate::pmac::ast::{Download, Expr, PlcSet, Stmt, StmtKind, Target};
use crate::pmac::host_statements;
use crate::pmac::tasks::{TaskKind, resume_points, tasks};

pub(crate) use self::expression::lower_expression;
use self::variables::Regions;

/// The number of instructions after which a new function begins.
const CHUNK: usize = 3000;
/// The same where much of the function works on single bits. Most of these instructions go away when bits become
/// bytes (the pass `byte-bits`), which are unpacked and packed once in each function, so that few long ones are
/// better than many short ones. Other code takes more time and memory to compile in long functions, and gains nothing.
const BIT_CHUNK: usize = 24_000;
/// A function works much on single bits if it reads or writes one in at least that many instructions.
const INSTRUCTIONS_PER_BIT: usize = 16;

/// How often the current function reads or writes a single bit of a word.
#[derive(Default)]
pub(crate) struct SingleBits {
    /// The function's number.
    function: usize,
    count: usize,
}

impl SingleBits {
    /// Counts a field that the function at the builder's end reads or writes.
    pub(crate) fn add(&mut self, builder: &ChunkBuilder, field: Field) {
        if self.function != builder.function_number() {
            *self = Self { function: builder.function_number(), count: 0 };
        }
        self.count += usize::from(field.width == 1);
    }

    /// Whether the function at the builder's end works much on single bits.
    fn are_many(&self, builder: &ChunkBuilder) -> bool {
        self.function == builder.function_number()
            && self.count * INSTRUCTIONS_PER_BIT >= builder.function_length()
    }
}

/// Whether a task's statements choose a coordinate system by ADDRESS. Texts of COMMAND always
/// count: they address the coordinate system of the PLC that gives the command.
fn has_address_statements(kind: TaskKind, code: &[Stmt]) -> bool {
    matches!(kind, TaskKind::Command(_) | TaskKind::Motion(_))
        || code.iter().any(|stmt| match stmt.kind {
            StmtKind::Address(_, system) => system.is_some(),
            StmtKind::AddressBy(_, system) => system.len > 0,
            _ => false,
        })
}

/// Lowers a download. A task's resume points are its WHILE statements, in their order.
///
/// # Errors
/// If the download is too long, or breaks a rule that the parser and the analyses promise to keep.
/// The latter is a defect of plcc, not of the program.
pub(crate) fn lower(
    download: &Download,
    loaded: &Loaded,
    sources: &SourceMap,
) -> Result<Module, LowerError> {
    let layout = loaded.layout;
    let builder = ChunkBuilder::new(layout.size, layout.regions()).with_limit(CHUNK);
    let places_of_m = assumptions::places(&layout, &loaded.assumed);
    let mut lowerer = Lowerer::new(download, loaded, sources, builder, places_of_m)?;
    for id in (0..sources.len() as u32).map(FileId) {
        lowerer.builder.add_file(sources.path(id), sources.text(id));
    }
    for (kind, code) in tasks(download, loaded) {
        lowerer.task(kind, code)?;
        if let Some(statement) = lowerer.builder.statement_over_budget() {
            return Err(LowerError::TooLong(statement));
        }
    }
    Ok(lowerer.builder.finish())
}

/// A download on its way to IR: what is known of it, the module so far, and the state of the task
/// and statement that are being lowered.
pub(crate) struct Lowerer<'a> {
    pub(crate) download: &'a Download,
    pub(crate) layout: Layout,
    pub(crate) builder: ChunkBuilder,
    pub(crate) regions: Regions,
    sources: &'a SourceMap,
    /// The values that I-variables take, by rising number, for those whose range is limited.
    pub(crate) ranges: &'a [(u32, Range)],
    /// For each M-variable its place by the assumed definition; `None` if nothing is assumed of it.
    pub(crate) places_of_m: Vec<Option<DirectAccess>>,
    /// How many tasks there are so far.
    task_count: usize,
    /// The number of the current task's context, which holds the coordinate system that the task
    /// addresses.
    pub(crate) context: u32,
    /// Whether the current task may choose a coordinate system; if not, it is always the first.
    pub(crate) has_address_statements: bool,
    /// Whether the current code is specialised for the assumed definitions of M-variables.
    pub(crate) specialised: bool,
    /// Whether the current code is general code of a task that has specialised code too. It seldom
    /// runs, so it is kept short.
    has_specialised_code: bool,
    /// Whether what has been emitted of the current statement may change a definition.
    pub(crate) may_change_definitions: bool,
    /// Whether the current task is a motion program.
    is_motion: bool,
    /// How often the current function works on single bits.
    pub(crate) single_bits: SingleBits,
    /// For each statement of the current task its number among those that the host executes.
    host_statements: Vec<Option<u32>>,
    /// The number of the first such statement of the next task.
    next_host_statement: u32,
    /// The operands of the current expression; kept here so that its memory is used again.
    pub(crate) stack: Vec<Operand>,
}

/// The branch targets in one version (specialised or general) of a task: one for each statement and
/// one for the end.
struct StatementPlaces {
    places: Vec<Place>,
}

impl StatementPlaces {
    /// The place of the statement with this index, from 0, or of the end.
    fn place(&self, index: usize) -> Result<Place, BrokenInvariant> {
        let place = self.places.get(index).copied();
        place.ok_or_else(|| BrokenInvariant::new(format!("there is no statement {index}")))
    }
}

/// The error for an expression whose operators take more operands than there are.
pub(crate) fn lacks_operand() -> BrokenInvariant {
    BrokenInvariant::new("an expression lacks an operand")
}

impl<'a> Lowerer<'a> {
    /// A lowerer that writes to a builder. `places_of_m` are the places of M-variables.
    fn new(
        download: &'a Download,
        loaded: &'a Loaded,
        sources: &'a SourceMap,
        mut builder: ChunkBuilder,
        places_of_m: Vec<Option<DirectAccess>>,
    ) -> Result<Self, BrokenInvariant> {
        let regions = Regions::of(&builder)?;
        for region in [regions.p, regions.q, regions.i] {
            builder.finite_region(region);
        }
        builder.word_region(regions.words);
        Ok(Lowerer {
            download,
            layout: loaded.layout,
            builder,
            regions,
            sources,
            ranges: &loaded.ranges,
            places_of_m,
            task_count: 0,
            context: 0,
            has_address_statements: false,
            specialised: false,
            has_specialised_code: false,
            may_change_definitions: false,
            is_motion: false,
            single_bits: SingleBits::default(),
            host_statements: Vec::new(),
            next_host_statement: 0,
            stack: Vec::new(),
        })
    }
}

impl Lowerer<'_> {
    /// Lowers a task: its specialised version if it names an M-variable whose definition is
    /// assumed, its general version, and for each WHILE the place at which a suspended scan goes
    /// on.
    fn task(&mut self, kind: TaskKind, code: &[Stmt]) -> Result<(), BrokenInvariant> {
        self.context = kind.context();
        self.has_address_statements = has_address_statements(kind, code);
        let next = &mut self.next_host_statement;
        self.host_statements = host_statements::numbers(self.download, kind, code, next);
        let entry = self.builder.place();
        self.builder.bind(entry);
        self.builder.task(kind.name(), entry);
        let versions = [(); 2].map(|()| StatementPlaces {
            places: (0..=code.len()).map(|_| self.builder.place()).collect(),
        });
        // A suspended scan goes on at a place of its own, where the guard is checked.
        let mut resumes: Vec<Option<Place>> = vec![None; code.len() + 1];
        for index in resume_points(self.download, kind, code) {
            if let Some(slot) = resumes.get_mut(index as usize) {
                *slot = Some(self.builder.place());
            }
        }
        let points: Vec<Place> = resumes.iter().copied().flatten().collect();
        self.builder.resume_points(self.task_count, &points);
        self.task_count += 1;
        let [specialised, general] = &versions;
        let both = matches!(kind, TaskKind::Plc { .. }) && self.assumes_definitions(code);
        self.is_motion = matches!(kind, TaskKind::Motion(_));
        if both {
            self.branch_to_fitting_version(0, specialised, general)?;
            self.lower_version(code, specialised, Some(general), &resumes)?;
        } else {
            self.lower_version(code, general, None, &resumes)?;
        }
        for (index, resume) in resumes.iter().enumerate() {
            let Some(resume) = resume else { continue };
            self.builder.bind(*resume);
            if both {
                self.branch_to_fitting_version(index, specialised, general)?;
            } else {
                self.builder.jump(general.place(index)?);
            }
        }
        if both {
            // The general version seldom runs, and saves registers over its calls of the host.
            self.builder.begin_function();
            self.lower_version(code, general, None, &resumes)?;
            self.builder.func().set_optimize_for_size(false);
            self.builder.begin_function();
        }
        Ok(())
    }

    /// Branches to a statement: in the specialised version if the assumed definitions hold, else in
    /// the general one.
    fn branch_to_fitting_version(
        &mut self,
        index: usize,
        specialised: &StatementPlaces,
        general: &StatementPlaces,
    ) -> Result<(), BrokenInvariant> {
        let (specialised, general) = (specialised.place(index)?, general.place(index)?);
        let as_assumed = self.definitions_are_as_assumed();
        self.builder.brif(as_assumed, specialised, general);
        Ok(())
    }

    /// Lowers one version of a task's statements. `other` is the general version, to which
    /// specialised code goes when a definition changes; it is `None` when the general version
    /// itself is lowered.
    fn lower_version(
        &mut self,
        code: &[Stmt],
        version: &StatementPlaces,
        other: Option<&StatementPlaces>,
        resumes: &[Option<Place>],
    ) -> Result<(), BrokenInvariant> {
        self.specialised = other.is_some();
        // If there is specialised code, it may go over to any statement of the general code.
        let entered = !self.specialised && !self.is_motion && self.assumes_definitions(code);
        self.has_specialised_code = entered;
        let targets = branch_targets(code);
        for (index, stmt) in code.iter().enumerate() {
            let bind = index == 0
                || entered
                || self.is_motion
                || targets.get(index).copied().unwrap_or(false);
            if bind {
                self.builder.bind(version.place(index)?);
            }
            if self.builder.statement_over_budget().is_some() {
                return Ok(());
            }
            self.begin_statement(stmt);
            self.may_change_definitions = false;
            let lowered = match entered {
                _ if self.is_motion => self.motion(index, stmt, version, resumes),
                true => self.general_statement(index, stmt, version, resumes),
                false => self.statement(stmt, version, resumes),
            };
            lowered.map_err(|error| self.with_place(error, stmt))?;
            if self.may_change_definitions
                && let Some(other) = other
            {
                let elsewhere = other.place(index + 1)?;
                let as_assumed = self.definitions_are_as_assumed();
                let next = self.builder.place();
                self.builder.brif(as_assumed, next, elsewhere);
                self.builder.bind(next);
            }
        }
        self.builder.bind(version.place(code.len())?);
        self.builder.ret();
        Ok(())
    }

    /// An internal error with the place of the statement that was being lowered.
    fn with_place(&self, error: BrokenInvariant, stmt: &Stmt) -> BrokenInvariant {
        let (span, _) = self.download.origins.place(stmt.at);
        let line = self.sources.line(span.file, span.start);
        BrokenInvariant::at(error.message, self.sources.path(span.file), line)
    }

    /// Says that the instructions that follow belong to this statement.
    fn begin_statement(&mut self, stmt: &Stmt) {
        let (span, _) = self.download.origins.place(stmt.at);
        let line = self.sources.line(span.file, span.start);
        let (start, end) = (span.start, span.end);
        let works_on_bits = self.single_bits.are_many(&self.builder);
        // General code beside specialised code calls the host and seldom runs.
        let long = works_on_bits && !self.has_specialised_code;
        self.builder.set_limit(if long { BIT_CHUNK } else { CHUNK });
        self.builder.statement(Statement { file: span.file.0, line, start, end });
        self.builder.func().set_optimize_for_size(self.has_specialised_code);
    }

    /// The truth value of a condition, an `i1`; `integer` says that it is one of L-variables, which
    /// is computed in 24 bits.
    fn condition(&mut self, expr: Expr, integer: bool) -> Result<Value, BrokenInvariant> {
        if integer {
            return self.condition_integer(expr);
        }
        let value = self.value(expr)?;
        Ok(value.truth(self.builder.func()))
    }

    fn statement(
        &mut self,
        stmt: &Stmt,
        version: &StatementPlaces,
        resumes: &[Option<Place>],
    ) -> Result<(), BrokenInvariant> {
        match stmt.kind {
            StmtKind::Assign(target, expr) if stmt.integer => self.assign_integer(target, expr)?,
            StmtKind::Assign(target, expr) => {
                let index = match target {
                    Target::Indirect(_, index) => Some(self.value(index)?),
                    _ => None,
                };
                let value = self.value(expr)?;
                self.assign(target, value, index)?;
            }
            StmtKind::If(expr, target) | StmtKind::While(expr, target) => {
                let truth = self.condition(expr, stmt.integer)?;
                let next = self.builder.place();
                self.builder.brif(truth, next, version.place(target as usize)?);
                self.builder.bind(next);
            }
            StmtKind::Jump(target) => self.builder.jump(version.place(target as usize)?),
            StmtKind::EndWhile(head) => {
                let resume = resumes.get(head as usize).copied().flatten();
                let resume =
                    resume.ok_or_else(|| BrokenInvariant::new("an ENDWHILE has no WHILE"))?;
                self.builder.suspend(resume);
            }
            StmtKind::Plc(op, plcs) => self.plc(op as i64, plcs),
            StmtKind::Address(motor, system) => {
                if let Some(motor) = motor {
                    self.address_motor_by_number(motor.into());
                }
                let Some(system) = system else { return Ok(()) };
                let at = Address::fixed(self.regions.exec, exec::q_base(self.context));
                let base = self.layout.q_base_of(u32::from(system));
                let b = self.builder.func();
                let base = b.constant(Type::I32, i64::from(base));
                b.store(at, base);
            }
            StmtKind::AddressBy(motor, system) => {
                if motor.len > 0 {
                    let motor = self.value(motor)?;
                    self.address_motor(motor);
                }
                if system.len > 0 {
                    self.address_by(system)?;
                }
            }
            StmtKind::Motion(..) | StmtKind::Loop(..) => {
                return Err(BrokenInvariant::new("a PLC has a statement of motion"));
            }
            StmtKind::Text(index, value) => {
                let value = value.map_or(Ok(Operand::Const(0.0)), |expr| self.value(expr))?;
                let b = self.builder.func();
                let value = value.stored(b);
                let index = b.constant(Type::I32, i64::from(index));
                b.host_call(HostFn::PmacEvent, &[index, value]);
            }
            StmtKind::Define(index) => {
                let b = self.builder.func();
                let index = b.constant(Type::I32, i64::from(index));
                b.host_call(HostFn::PmacDefine, &[index]);
            }
            StmtKind::Word(space, address, expr) => {
                let value = self.value(expr)?;
                let word = value.bits(self.builder.func())?;
                self.write_sparse_word(space, address, word);
            }
            StmtKind::Save => {
                self.builder.func().host_call(HostFn::PmacSave, &[]);
            }
        }
        Ok(())
    }

    /// Addresses the coordinate system whose number a variable holds; one that is none changes
    /// nothing.
    fn address_by(&mut self, system: Expr) -> Result<(), BrokenInvariant> {
        use plcc_ir::{BinaryOp, FloatCond};
        let at = Address::fixed(self.regions.exec, exec::q_base(self.context));
        let block = self.layout.q_base_of(2);
        let systems = self.layout.systems();
        let number = self.value(system)?;
        let b = self.builder.func();
        // The low bits of a large number may be those of a coordinate system's.
        let value = number.float(b);
        let (first, end) = (b.fconst(0.5), b.fconst(f64::from(systems) + 0.5));
        let not_below = b.fcmp(FloatCond::Ge, value, first);
        let not_above = b.fcmp(FloatCond::Lt, value, end);
        let known = b.binary(BinaryOp::And, not_below, not_above);
        let number = Operand::Double(value).bits(b)?;
        let above = b.binary_imm(BinaryOp::Sub, number, 1);
        let base = b.binary_imm(BinaryOp::Mul, above, i64::from(block));
        let old = b.load(Type::I32, at);
        let base = b.select(known, base, old);
        b.store(at, base);
        Ok(())
    }

    /// ENABLE, DISABLE and their kind: calls the host once for each run of consecutive PLC numbers.
    fn plc(&mut self, op: i64, plcs: PlcSet) {
        for (first, last) in runs_of_ones(plcs.bits) {
            let b = self.builder.func();
            let args = [op, i64::from(plcs.compiled), i64::from(first), i64::from(last)]
                .map(|arg| b.constant(Type::I32, arg));
            b.host_call(HostFn::PmacPlc, &args);
        }
    }
}

/// For each statement, and for the end, whether a branch leads to it.
fn branch_targets(code: &[Stmt]) -> Vec<bool> {
    let mut targets = vec![false; code.len() + 1];
    let mut mark = |index: u32| {
        if let Some(slot) = targets.get_mut(index as usize) {
            *slot = true;
        }
    };
    for (index, stmt) in (0u32..).zip(code) {
        match stmt.kind {
            StmtKind::If(_, target) | StmtKind::Jump(target) => mark(target),
            StmtKind::While(_, target) => {
                mark(target);
                mark(index);
            }
            _ => {}
        }
    }
    targets
}

/// The runs of bits of `set` that are 1 without a gap: for each the numbers of its first and its
/// last bit.
fn runs_of_ones(set: u32) -> impl Iterator<Item = (u32, u32)> {
    let mut at = 0;
    std::iter::from_fn(move || {
        let rest = u64::from(set) >> at;
        if rest == 0 {
            return None;
        }
        let first = at + rest.trailing_zeros();
        let length = (u64::from(set) >> first).trailing_ones();
        at = first + length;
        Some((first, at - 1))
    })
}

#[cfg(test)]
mod tests {
    use super::runs_of_ones;

    #[test]
    fn consecutive_ones_are_joined_to_runs() {
        assert_eq!(runs_of_ones(0b1011_0111).collect::<Vec<_>>(), [(0, 2), (4, 5), (7, 7)]);
        assert_eq!(runs_of_ones(u32::MAX).collect::<Vec<_>>(), [(0, 31)]);
        assert_eq!(runs_of_ones(0).count(), 0);
    }
}
