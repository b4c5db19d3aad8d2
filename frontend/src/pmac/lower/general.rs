//! Statements of general code beside specialised code.
//!
//! General code runs while the definition of at least one M-variable is not the assumed one. Most
//! statements name none of these variables, so each is lowered as in specialised code, after a check of
//! the variables that it names:
//!
//! ```text
//!   v0: i32 = load differing_definitions:1     (M1)         one of the bytes 1 and 2 is not 0:
//!   v1: i32 = load differing_definitions:2     (M2)           hostcall pmac_statement(17)
//!   v2: i32 = or v0, v1
//!   v3: i8 = trunc v2                                       both are 0:
//!   v4: i1 = icmp.ne v3, 0                                    M1=M2 at the assumed places
//!   brif v4, block2, block1
//! ```
//!
//! Four bytes are loaded of which one counts, since machines combine words with memory and not bytes.
//! So the code is little longer than that of specialised code, and fast. Where code for the assumed places would
//! call the host, too, for an operator or a conversion, the host executes the statement in any case, without a
//! check: that takes one call, and less code.

use plcc_abi::HostFn;
use plcc_abi::pmac::{DirectAccess, Kind};
use plcc_ir::chunk::MAX_INSTRUCTIONS;
use plcc_ir::{Address, BinaryOp, InstBuilder, IntCond, Place, Type, Value};

use super::emit;
use super::{Lowerer, StatementPlaces};
use crate::common::BrokenInvariant;
use crate::pmac::analyse::assumptions::for_each_named_m;
use crate::pmac::ast::{Bin, Download, Expr, Func, Op, Stmt, StmtKind, Target};

/// A statement that names more M-variables than this is not lowered as specialised code.
const MAX_CHECKED: usize = 12;

/// In programs that have more instructions than this, statements are left to the host alone, which is slower,
/// so that general code does not use up what a program may have.
const LONG_PROGRAM: usize = MAX_INSTRUCTIONS / 2;

impl Lowerer<'_> {
    /// Lowers a statement of general code beside specialised code; `index` is its place in the task.
    pub(super) fn general_statement(
        &mut self,
        index: usize,
        stmt: &Stmt,
        version: &StatementPlaces,
        resumes: &[Option<Place>],
    ) -> Result<(), BrokenInvariant> {
        let checked = self.assumed_variables(stmt);
        if checked.is_empty() || checked.len() > MAX_CHECKED {
            return self.statement(stmt, version, resumes);
        }
        let number = self.host_statements.get(index).copied().flatten();
        let is_long = self.builder.instruction_count() > LONG_PROGRAM;
        if let Some(number) = number.filter(|_| is_long || self.needs_host(stmt)) {
            return self.host_statement(stmt, number, version);
        }
        let [as_assumed, differing, next] = [(); 3].map(|()| self.builder.place());
        let differs = self.definitions_differ(&checked);
        self.builder.brif(differs, differing, as_assumed);
        self.builder.bind(as_assumed);
        self.specialised = true;
        let lowered = self.statement(stmt, version, resumes);
        self.specialised = false;
        lowered?;
        self.builder.jump(next);
        self.builder.bind(differing);
        self.builder.func().set_cold(true);
        let lowered = match number {
            Some(number) => self.host_statement(stmt, number, version),
            None => self.statement(stmt, version, resumes),
        };
        lowered?;
        self.builder.jump(next);
        self.builder.func().set_cold(false);
        self.builder.bind(next);
        Ok(())
    }

    /// Whether code for the assumed places of M-variables would call the host in an assignment or a
    /// condition: for a bit operator or `%` of a number that may not be an integer, for a function, or to make
    /// an integer of a number.
    fn needs_host(&self, stmt: &Stmt) -> bool {
        let Some(value) = Download::computed(&stmt.kind) else { return false };
        let Some(is_integer) = self.is_integer_without_host(value) else { return true };
        let StmtKind::Assign(Target::Var(kind, number), _) = stmt.kind else { return false };
        match kind {
            Kind::P | Kind::Q => false,
            Kind::I => {
                self.ranges.binary_search_by_key(&u32::from(number), |range| range.0).is_ok()
            }
            Kind::M => !is_integer || !self.is_integer_variable(u32::from(number)),
            Kind::L => true,
        }
    }

    /// Whether an expression is an integer whatever its variables hold; `None` if code for it calls the host.
    fn is_integer_without_host(&self, value: Expr) -> Option<bool> {
        let mut integers = vec![];
        for op in self.download.ops(value) {
            let integer = match *op {
                Op::Const(value) => value.fract() == 0.0,
                Op::Var(Kind::M, number) => {
                    let number = u32::from(number) & (self.layout.count - 1);
                    self.places_of_m.get(number as usize).copied().flatten()?;
                    self.is_integer_variable(number)
                }
                Op::Var(kind, _) => kind == Kind::L,
                Op::Indirect(kind) => {
                    let index = integers.pop()?;
                    (index && kind != Kind::M).then_some(false)?
                }
                Op::Neg | Op::Call(Func::Abs | Func::Int) => integers.pop()?,
                Op::Call(Func::Sqrt) => integers.pop().map(|_| false)?,
                Op::Call(_) => return None,
                Op::Bin(bin) => {
                    let (right, left) = (integers.pop()?, integers.pop()?);
                    match bin {
                        Bin::Add | Bin::Sub | Bin::Mul => left && right,
                        Bin::Div => false,
                        Bin::Mod | Bin::And | Bin::Or | Bin::Xor => {
                            (left && right).then_some(true)?
                        }
                    }
                }
                Op::Cmp(_) | Op::Both | Op::Either => {
                    integers.pop()?;
                    integers.pop()?;
                    true
                }
            };
            integers.push(integer);
        }
        integers.pop()
    }

    /// Whether an M-variable holds integers at its assumed place.
    fn is_integer_variable(&self, number: u32) -> bool {
        let place = self.places_of_m.get((number & (self.layout.count - 1)) as usize);
        matches!(place, Some(Some(DirectAccess::Word(..) | DirectAccess::Star)))
    }

    /// The numbers of the M-variables that a statement names and whose definitions are assumed, by
    /// rising number.
    fn assumed_variables(&self, stmt: &Stmt) -> Vec<u32> {
        let mut numbers = vec![];
        for_each_named_m(self.download, std::slice::from_ref(stmt), &mut |number| {
            let number = u32::from(number) & (self.layout.count - 1);
            if self.places_of_m.get(number as usize).is_some_and(Option::is_some) {
                numbers.push(number);
            }
        });
        numbers.sort_unstable();
        numbers.dedup();
        numbers
    }

    /// Whether the definition of one of these M-variables differs from the assumed one, an `i1`.
    fn definitions_differ(&mut self, numbers: &[u32]) -> Value {
        let region = self.regions.differing_definitions;
        let end = self.layout.count;
        let b = self.builder.func();
        let mut any = None;
        for &number in numbers {
            let at = Address::fixed(region, number);
            let differs = if number + Type::I32.bytes() <= end {
                b.load(Type::I32, at)
            } else {
                let byte = b.load(Type::I8, at);
                b.zextend_or_trunc(Type::I32, byte)
            };
            any = Some(any.map_or(differs, |any| b.binary(BinaryOp::Or, any, differs)));
        }
        let any = any.unwrap_or_else(|| b.constant(Type::I32, 0));
        let any = b.zextend_or_trunc(Type::I8, any);
        b.icmp_imm(IntCond::Ne, any, 0)
    }

    /// Has the host execute a statement, by its number among those that it can execute.
    fn host_statement(
        &mut self,
        stmt: &Stmt,
        number: u32,
        version: &StatementPlaces,
    ) -> Result<(), BrokenInvariant> {
        let b = self.builder.func();
        let number = b.constant(Type::I32, i64::from(number));
        let holds = emit::host_value(b, HostFn::PmacStatement, &[number])?;
        if let StmtKind::If(_, target) | StmtKind::While(_, target) = stmt.kind {
            let holds = b.icmp_imm(IntCond::Ne, holds, 0);
            let next = self.builder.place();
            self.builder.brif(holds, next, version.place(target as usize)?);
            self.builder.bind(next);
        }
        Ok(())
    }
}
