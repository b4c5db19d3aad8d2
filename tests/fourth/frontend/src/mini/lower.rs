//! A checked program to IR.

use plcc_abi::mini::Kind;
use plcc_diag::FileId;
use plcc_ir::{Address, BinaryOp, ChunkBuilder, InstBuilder, IntCond, Place, Statement, Type, Value};

use super::ast::{Action, Op, Operand, Term};
use super::{BITS, NUMBERS, Program};
use crate::common::{BrokenInvariant, LowerError, Lowered, OrMissing};

pub(super) fn lower(program: &Program) -> Result<Lowered, LowerError> {
    let code = &program.code;
    let (regions, size) = code.regions();
    let mut lowerer = Lowerer { program, builder: ChunkBuilder::new(size, regions) };
    lowerer.program()?;
    let builder = lowerer.builder;
    if let Some(statement) = builder.statement_over_budget() {
        return Err(LowerError::TooLong(statement));
    }
    let module = builder.finish();
    let program = program.tables(module.tasks.clone());
    Ok(Lowered { program, module, return_stack: None })
}

struct Lowerer<'a> {
    program: &'a Program,
    builder: ChunkBuilder,
}

impl Lowerer<'_> {
    fn program(&mut self) -> Result<(), BrokenInvariant> {
        let Program { code, sources } = self.program;
        for file in (0..sources.len() as u32).map(FileId) {
            self.builder.add_file(sources.path(file), sources.text(file));
        }
        let start = self.builder.place();
        self.builder.bind(start);
        self.builder.task("scan", start);
        // The places behind conditions, by the index of their END.
        let mut ends: Vec<(usize, Place)> = vec![];
        for (index, step) in code.steps.iter().enumerate() {
            let (file, span) = (step.span.file.0, step.span);
            self.builder.statement(Statement {
                file,
                line: step.line,
                start: span.start,
                end: span.end,
            });
            match &step.action {
                Action::Assign { to, value } => {
                    let value = self.value(value)?;
                    let (kind, at) = self.address(*to)?;
                    let value = match kind {
                        Kind::Number => value,
                        Kind::Input | Kind::Output => {
                            self.builder.func().icmp_imm(IntCond::Ne, value, 0)
                        }
                    };
                    self.builder.func().store(at, value);
                }
                Action::If { condition, otherwise } => {
                    let value = self.value(condition)?;
                    let holds = self.builder.func().icmp_imm(IntCond::Ne, value, 0);
                    let (then, end) = (self.builder.place(), self.builder.place());
                    self.builder.brif(holds, then, end);
                    self.builder.bind(then);
                    ends.push((*otherwise, end));
                }
                Action::End => {
                    if let Some((_, end)) = ends.pop_if(|(at, _)| *at == index) {
                        self.builder.bind(end);
                    }
                }
            }
            if self.builder.statement_over_budget().is_some() {
                break;
            }
        }
        while let Some((_, end)) = ends.pop() {
            self.builder.bind(end);
        }
        self.builder.ret();
        Ok(())
    }

    /// What a variable is, and its address.
    fn address(&self, index: usize) -> Result<(Kind, Address), BrokenInvariant> {
        let symbol = self.program.code.symbol(index).or_missing(|| "a variable")?;
        let (regions, _) = self.program.code.regions();
        let name = if symbol.kind == Kind::Number { NUMBERS } else { BITS };
        let first = regions.iter().find(|region| region.name == name).map_or(0, |one| one.offset);
        let region = self.builder.region(name).or_missing(|| "a region")?;
        Ok((symbol.kind, Address::fixed(region, symbol.offset - first)))
    }

    /// An expression, as an `i32`.
    fn value(&mut self, terms: &[Term]) -> Result<Value, BrokenInvariant> {
        let mut before = self.builder.func().constant(Type::I32, 0);
        for term in terms {
            let mut value = match term.operand {
                Operand::Number(number) => self.builder.func().constant(Type::I32, number.into()),
                Operand::Variable(index) => {
                    let (kind, at) = self.address(index)?;
                    let func = self.builder.func();
                    match kind {
                        Kind::Number => func.load(Type::I32, at),
                        Kind::Input | Kind::Output => {
                            let bit = func.load(Type::I1, at);
                            func.zextend_or_trunc(Type::I32, bit)
                        }
                    }
                }
            };
            let func = self.builder.func();
            if term.not {
                let is_zero = func.icmp_imm(IntCond::Eq, value, 0);
                value = func.zextend_or_trunc(Type::I32, is_zero);
            }
            before = match term.op {
                Op::Add => func.binary(BinaryOp::Add, before, value),
                Op::Subtract => func.binary(BinaryOp::Sub, before, value),
                Op::And | Op::Or => {
                    let a = func.icmp_imm(IntCond::Ne, before, 0);
                    let b = func.icmp_imm(IntCond::Ne, value, 0);
                    let op = if term.op == Op::And { BinaryOp::And } else { BinaryOp::Or };
                    let bit = func.binary(op, a, b);
                    func.zextend_or_trunc(Type::I32, bit)
                }
            };
        }
        Ok(before)
    }
}
