//! Checked download to IR.
//!
//! There are two kinds of speculation, each with specialised and general code side by side:
//!
//! - *On definitions of M-variables*, for a PLC as a whole. Specialised code accesses M-variables
//!   where the definitions that it was compiled for say they are; general code accesses them
//!   through the host. The guard is a word of the image that says whether definitions have been
//!   moved. It is checked at the entry, at every WHILE at which a scan may go on, and behind every
//!   statement that may move a definition; control goes over to the other code there.
//! - *On variables that hold integers*, for one statement (`speculate`). The guard is an
//!   integrality check of the variables' values. The [analysis] finds the statements for which it
//!   pays.

mod analysis;
pub(crate) mod emit;
pub(crate) mod explain;
mod expression;
mod field;
mod integer;
pub(crate) mod range_analysis;
mod speculation;
mod variables;

use plcc_abi::HostFn;
use plcc_abi::pmac::layout::exec;
use plcc_abi::pmac::{Assumption, Direct, Layout, Range};
use plcc_diag::{FileId, SourceMap};
use plcc_ir::{Address, ChunkBuilder, Module, Place, Statement, Type};

use self::analysis::Name;
use self::emit::Operand;
use crate::common::InternalError;
use crate::pmac::analyse::assumptions;
use crate::pmac::analyse::load::Loaded;
use crate::pmac::ast::{Download, Expr, PlcSet, Stmt, StmtKind, Target};
use crate::pmac::tasks::{TaskKind, tasks};

use self::variables::Regions;

/// The number of instructions after which a function is cut. It is more than for the other
/// languages, since a third of them are in code that seldom runs.
const CHUNK: usize = 3000;

/// Whether a task's statements address a coordinate system, or its context is set from outside.
fn addresses(kind: TaskKind, code: &[Stmt]) -> bool {
    matches!(kind, TaskKind::Command(_))
        || code.iter().any(|stmt| match stmt.kind {
            StmtKind::Address(_, system) => system.is_some(),
            StmtKind::AddressBy(_, system) => system.len > 0,
            _ => false,
        })
}

/// Lowers a download, with the definitions of `assumed` built in.
///
/// A task's resume points are its WHILE statements, whatever is built in, so that a task may be
/// suspended in one module and go on in another of the same download.
///
/// # Errors
/// Where the download is not what reading and analysing promise: a defect of plcc.
pub(crate) fn lower(
    download: &Download,
    loaded: &Loaded,
    sources: &SourceMap,
    assumed: &[Assumption],
) -> Result<Module, InternalError> {
    let layout = loaded.layout;
    let builder = ChunkBuilder::new(layout.size, layout.regions()).with_limit(CHUNK);
    let region = |name: &str| {
        let region = builder.region(name);
        region.ok_or_else(|| InternalError::new(format!("the image has no region `{name}`")))
    };
    let regions = Regions {
        p: region("p")?,
        q: region("q")?,
        i: region("i")?,
        mdef: region("mdef")?,
        words: region("words")?,
        exec: region("exec")?,
    };
    let mut lowerer = Lowerer {
        download,
        layout,
        builder,
        regions,
        sources,
        ranges: &loaded.ranges,
        places_of_m: assumptions::places(&layout, assumed),
        task_count: 0,
        context: 0,
        addresses: false,
        specialised: false,
        beside_specialised: false,
        beside_integers: false,
        may_move_definitions: false,
        stack: Vec::new(),
        guarded: Vec::new(),
    };
    for id in (0..sources.len() as u32).map(FileId) {
        lowerer.builder.add_file(sources.path(id), sources.text(id));
    }
    for (kind, code) in tasks(download, loaded) {
        lowerer.task(kind, code)?;
    }
    Ok(lowerer.builder.finish())
}

pub(crate) struct Lowerer<'a> {
    pub(crate) download: &'a Download,
    pub(crate) layout: Layout,
    pub(crate) builder: ChunkBuilder,
    pub(crate) regions: Regions,
    sources: &'a SourceMap,
    pub(crate) ranges: &'a [(u32, Range)],
    /// Where M-variables are by the definitions built in.
    pub(crate) places_of_m: Vec<Option<Direct>>,
    /// How many tasks there are so far.
    task_count: usize,
    /// Of the current task: its context, and whether it addresses coordinate systems.
    pub(crate) context: u32,
    pub(crate) addresses: bool,
    /// The current code is specialised: definitions of M-variables are those that it assumes.
    pub(crate) specialised: bool,
    /// The current code is general code that has specialised code beside it, so it seldom runs.
    beside_specialised: bool,
    /// The current code is that of a statement with an integer guard, for other values than
    /// integers.
    beside_integers: bool,
    /// The current statement may have moved a definition.
    pub(crate) may_move_definitions: bool,
    pub(crate) stack: Vec<Operand>,
    /// Values of variables that the current statement's guard has loaded.
    pub(crate) guarded: Vec<(Name, Operand)>,
}

/// The places of one of the two versions: one for each statement, one for the end.
struct Version {
    places: Vec<Place>,
}

impl Version {
    /// The place of the statement at an index, or that of the end.
    fn place(&self, index: usize) -> Result<Place, InternalError> {
        let place = self.places.get(index).copied();
        place.ok_or_else(|| InternalError::new(format!("there is no statement {index}")))
    }
}

/// The error of an expression whose operators want more operands than there are.
pub(crate) fn lacks_operand() -> InternalError {
    InternalError::new("an expression lacks an operand")
}

impl Lowerer<'_> {
    fn task(&mut self, kind: TaskKind, code: &[Stmt]) -> Result<(), InternalError> {
        self.context = kind.context();
        self.addresses = addresses(kind, code);
        let entry = self.builder.place();
        self.builder.bind(entry);
        self.builder.task(kind.name(), entry);
        let versions = [(); 2]
            .map(|()| Version { places: (0..=code.len()).map(|_| self.builder.place()).collect() });
        // A suspended loop goes on at a place of its own, which chooses the version.
        let resumes: Vec<Option<Place>> = code
            .iter()
            .map(|stmt| matches!(stmt.kind, StmtKind::While(..)).then(|| self.builder.place()))
            .collect();
        // Their labels come before any that depend on what is built in.
        let points: Vec<Place> = resumes.iter().copied().flatten().collect();
        self.builder.resume_points(self.task_count, &points);
        self.task_count += 1;
        let [specialised, general] = &versions;
        let both = !matches!(kind, TaskKind::Command(_)) && self.relies_on_definitions(code);
        if both {
            self.choose(0, specialised, general)?;
            self.version(code, specialised, Some(general), &resumes)?;
        }
        self.version(code, general, None, &resumes)?;
        for (index, resume) in resumes.iter().enumerate() {
            let Some(resume) = resume else { continue };
            self.builder.bind(*resume);
            if both {
                self.choose(index, specialised, general)?;
            } else {
                self.builder.jump(general.place(index)?);
            }
        }
        Ok(())
    }

    /// On to a statement of the version that fits.
    fn choose(
        &mut self,
        index: usize,
        specialised: &Version,
        general: &Version,
    ) -> Result<(), InternalError> {
        let (specialised, general) = (specialised.place(index)?, general.place(index)?);
        let unmoved = self.unmoved();
        self.builder.brif(unmoved, specialised, general);
        Ok(())
    }

    fn version(
        &mut self,
        code: &[Stmt],
        version: &Version,
        other: Option<&Version>,
        resumes: &[Option<Place>],
    ) -> Result<(), InternalError> {
        self.specialised = other.is_some();
        // Specialised code, if there is some, can come over at any statement.
        let entered = !self.specialised && self.relies_on_definitions(code);
        self.beside_specialised = entered;
        let targets = targets(code);
        for (index, stmt) in code.iter().enumerate() {
            let bind = index == 0 || entered || targets.get(index).copied().unwrap_or(false);
            if bind {
                self.builder.bind(version.place(index)?);
            }
            self.begin_statement(stmt);
            self.may_move_definitions = false;
            let lowered = self.statement(stmt, version, resumes);
            lowered.map_err(|error| self.placed(error, stmt))?;
            if self.may_move_definitions
                && let Some(other) = other
            {
                let elsewhere = other.place(index + 1)?;
                let unmoved = self.unmoved();
                let next = self.builder.place();
                self.builder.brif(unmoved, next, elsewhere);
                self.builder.bind(next);
            }
        }
        self.builder.bind(version.place(code.len())?);
        self.builder.ret();
        Ok(())
    }

    /// An internal error with the place of the statement that it comes of.
    fn placed(&self, error: InternalError, stmt: &Stmt) -> InternalError {
        let (span, _) = self.download.origins.place(stmt.at);
        let (line, _) = self.sources.line_col(span.file, span.start);
        InternalError::at(error.message, self.sources.path(span.file), line)
    }

    /// What comes belongs to a statement of the source.
    fn begin_statement(&mut self, stmt: &Stmt) {
        let (span, _) = self.download.origins.place(stmt.at);
        let (line, _) = self.sources.line_col(span.file, span.start);
        let (start, end) = (span.start, span.end);
        self.builder.statement(Statement { file: span.file.0, line, start, end });
    }

    fn statement(
        &mut self,
        stmt: &Stmt,
        version: &Version,
        resumes: &[Option<Place>],
    ) -> Result<(), InternalError> {
        match stmt.kind {
            StmtKind::Assign(target, expr) if stmt.integer => self.assign_integer(target, expr)?,
            StmtKind::Assign(target, expr) => {
                let index = match target {
                    Target::Indirect(_, index) => Some(self.value(index)?),
                    _ => None,
                };
                match self.assumed_integers(expr) {
                    Some(assumed) => {
                        self.speculate(&assumed, |this| {
                            let value = this.value(expr)?;
                            this.assign(target, value, index)?;
                            Ok(None)
                        })?;
                    }
                    None => {
                        let value = self.value(expr)?;
                        self.assign(target, value, index)?;
                    }
                }
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
                    resume.ok_or_else(|| InternalError::new("an ENDWHILE has no WHILE"))?;
                self.builder.suspend(resume);
            }
            StmtKind::Plc(op, plcs) => self.plc(op as i64, plcs),
            StmtKind::Address(_, Some(system)) => {
                let at = Address::fixed(self.regions.exec, exec::q_base(self.context));
                let base = self.layout.q_base_of(u32::from(system));
                let b = self.builder.ins();
                let base = b.iconst(Type::I32, i64::from(base));
                b.store(at, base);
            }
            StmtKind::Address(_, None) => {}
            StmtKind::AddressBy(_, system) if system.len > 0 => self.address_by(system)?,
            StmtKind::AddressBy(..) => {}
            StmtKind::Text(index, value) => {
                let value = value.map_or(Ok(Operand::Const(0.0)), |expr| self.value(expr))?;
                let b = self.builder.ins();
                let value = value.stored(b);
                let index = b.iconst(Type::I32, i64::from(index));
                b.host_call(HostFn::PmacEvent, &[index, value]);
            }
            StmtKind::Define(index) => {
                let b = self.builder.ins();
                let index = b.iconst(Type::I32, i64::from(index));
                b.host_call(HostFn::PmacDefine, &[index]);
            }
            StmtKind::Word(space, address, expr) => {
                let value = self.value(expr)?;
                let word = value.bits(self.builder.ins())?;
                self.write_far_word(space, address, word);
            }
            StmtKind::Save => {
                self.builder.ins().host_call(HostFn::PmacSave, &[]);
            }
        }
        Ok(())
    }

    /// Addresses the coordinate system whose number a variable holds; one that is none changes
    /// nothing.
    fn address_by(&mut self, system: Expr) -> Result<(), InternalError> {
        use plcc_ir::{BinaryOp, FloatCond, IntCond};
        let at = Address::fixed(self.regions.exec, exec::q_base(self.context));
        let block = self.layout.q_base_of(2);
        let systems = self.layout.systems();
        let number = self.value(system)?;
        let b = self.builder.ins();
        let (known, above) = if number.bounds().is_int() {
            let number = number.bits(b)?;
            let above = b.binary_imm(BinaryOp::Sub, number, 1);
            (b.icmp_imm(IntCond::Ule, above, i64::from(systems) - 1), above)
        } else {
            // The low bits of a large number may be those of a coordinate system's.
            let value = number.float(b);
            let (first, end) = (b.fconst(0.5), b.fconst(f64::from(systems) + 0.5));
            let not_below = b.fcmp(FloatCond::Ge, value, first);
            let not_above = b.fcmp(FloatCond::Lt, value, end);
            let known = b.binary(BinaryOp::And, not_below, not_above);
            let number = Operand::Value(value, number.bounds()).bits(b)?;
            (known, b.binary_imm(BinaryOp::Sub, number, 1))
        };
        let base = b.binary_imm(BinaryOp::Mul, above, i64::from(block));
        let base = b.sextend_or_trunc(Type::I32, base);
        let old = b.load(Type::I32, at);
        let base = b.select(known, base, old);
        b.store(at, base);
        Ok(())
    }

    /// Calls the host for each row of neighbours.
    fn plc(&mut self, op: i64, plcs: PlcSet) {
        for (first, last) in neighbours(plcs.bits) {
            let b = self.builder.ins();
            let args = [op, i64::from(plcs.compiled), i64::from(first), i64::from(last)]
                .map(|arg| b.iconst(Type::I32, arg));
            b.host_call(HostFn::PmacPlc, &args);
        }
    }
}

/// Which statements are branched to.
fn targets(code: &[Stmt]) -> Vec<bool> {
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

/// First and last of each row of neighbouring bits.
fn neighbours(set: u32) -> impl Iterator<Item = (u32, u32)> {
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
    use super::neighbours;

    #[test]
    fn neighbours_go_together() {
        assert_eq!(neighbours(0b1011_0111).collect::<Vec<_>>(), [(0, 2), (4, 5), (7, 7)]);
        assert_eq!(neighbours(u32::MAX).collect::<Vec<_>>(), [(0, 31)]);
        assert_eq!(neighbours(0).count(), 0);
    }
}
