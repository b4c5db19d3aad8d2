//! Operations on doubles about whose operands a few literals decide.

use plcc_abi::pmac::pure_functions;
use plcc_ir::{BinaryOp, ConvertOp, Inst, InstData, Type, UnaryOp, Value, eval};

use super::Builder;
use super::instruction::State;
use crate::logic::Lit;

/// A number of a type, with copies of its sign in front.
fn signed(ty: Type, bits: u64) -> i64 {
    if ty == Type::I1 { bits as i64 } else { ty.wrap(bits as i64) }
}

impl State<'_, '_> {
    /// The result of such an operation; `None` for others.
    pub(super) fn by_table(&self, builder: &mut Builder, inst: Inst) -> Option<Vec<Lit>> {
        let func = self.func;
        let mut operation = |args: &[Value], width: u32, result: &dyn Fn(&[u64]) -> Option<u64>| {
            let bits: Vec<Vec<Lit>> = args.iter().map(|&value| self.bits(value)).collect();
            let operands: Vec<&[Lit]> = bits.iter().map(Vec::as_slice).collect();
            let Builder { graph, tables, .. } = &mut *builder;
            tables.operation(graph, &operands, width as usize, result)
        };
        let first = |x: &[u64]| x.first().copied();
        match *func.inst(inst) {
            InstData::Unary {
                op:
                    op @ (UnaryOp::Ffloor
                    | UnaryOp::Fceil
                    | UnaryOp::Ftrunc
                    | UnaryOp::Ffinite
                    | UnaryOp::Fsqrt),
                arg,
            } => {
                operation(
                    &[arg],
                    64,
                    &|x| Some(eval::unary(op, Type::F64, first(x)? as i64) as u64),
                )
            }
            InstData::Binary {
                op: op @ (BinaryOp::Fadd | BinaryOp::Fsub | BinaryOp::Fmul | BinaryOp::Fdiv),
                args,
            } => operation(&args, 64, &|x| {
                let &[a, b] = x else { return None };
                Some(eval::binary(op, Type::F64, a as i64, b as i64) as u64)
            }),
            InstData::Fcmp { cond, args } => operation(&args, 1, &|x| {
                let &[a, b] = x else { return None };
                Some(eval::fcmp(cond, a as i64, b as i64).into())
            }),
            InstData::Convert {
                op:
                    op @ (ConvertOp::IntToFloat
                    | ConvertOp::FloatToInt
                    | ConvertOp::IsInteger
                    | ConvertOp::IsIntegerOrNan),
                to,
                arg,
            } => {
                let ty = func.ty(arg);
                operation(&[arg], to.bits(), &|x| {
                    Some(eval::convert(op, ty, to, signed(ty, first(x)?)) as u64)
                })
            }
            InstData::HostCall { function, .. } if function.is_pure() => {
                let mut args = vec![];
                func.inst(inst).for_each_arg(|value| args.push(value));
                let width = func.result(inst).map_or(0, |value| func.ty(value).bits());
                operation(&args, width, &|x| {
                    let mut args = [0; 4];
                    args.iter_mut().zip(x).for_each(|(slot, &value)| *slot = value);
                    pure_functions::call(function, args)
                })
            }
            _ => None,
        }
    }
}
