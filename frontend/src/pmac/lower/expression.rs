//! Lowers expressions and conditions. Their operations are in postfix order, so each takes its
//! operands from a stack and puts its result there. Functions (SIN, ABS and so on) are lowered here
//! too, operators in [`emit`].

use plcc_abi::HostFn;
use plcc_abi::pmac::Kind;
use plcc_ir::{BinaryOp, InstBuilder, UnaryOp};

use super::Lowerer;
use super::emit::{self, Operand};
use crate::common::BrokenInvariant;
use crate::pmac::ast::{Expr, Func, Op};

impl Lowerer<'_> {
    /// The value of an expression, or the truth value of a condition.
    pub(crate) fn value(&mut self, expr: Expr) -> Result<Operand, BrokenInvariant> {
        let download = self.download;
        let mut stack = std::mem::take(&mut self.stack);
        stack.clear();
        for op in download.ops(expr) {
            let mut pop = || stack.pop().ok_or_else(super::lacks_operand);
            let value = match *op {
                Op::Const(value) => Operand::Const(value),
                Op::Var(kind, number) => self.read(kind, u32::from(number))?,
                Op::Indirect(kind) => {
                    let number = pop()?;
                    self.read_indirect(kind, number)?
                }
                Op::Neg => emit::negate(self.builder.func(), pop()?),
                Op::Bin(bin) => {
                    let right = pop()?;
                    let left = pop()?;
                    emit::binary(self.builder.func(), bin, left, right)?
                }
                Op::Cmp(cmp) => {
                    let right = pop()?;
                    let left = pop()?;
                    emit::compare(self.builder.func(), cmp, left, right)
                }
                Op::Call(func) => {
                    let x = pop()?;
                    self.call(func, x)?
                }
                Op::Both | Op::Either => {
                    let b = self.builder.func();
                    let right = pop()?.truth(b);
                    let left = pop()?.truth(b);
                    let op = match op {
                        Op::Both => BinaryOp::And,
                        _ => BinaryOp::Or,
                    };
                    Operand::Truth(b.binary(op, left, right))
                }
            };
            stack.push(value);
        }
        let value = stack.pop().ok_or_else(super::lacks_operand);
        self.stack = stack;
        value
    }

    /// The value of a function of `x`.
    fn call(&mut self, func: Func, x: Operand) -> Result<Operand, BrokenInvariant> {
        if let (Operand::Const(value), Func::Sqrt | Func::Ln | Func::Exp | Func::Abs | Func::Int) =
            (x, func)
        {
            return Ok(Operand::Const(plcc_abi::pmac::expression::function(
                func, value, 0.0, false,
            )));
        }
        let trigonometric = match func {
            Func::Sin => Some(HostFn::PmacSin),
            Func::Cos => Some(HostFn::PmacCos),
            Func::Tan => Some(HostFn::PmacTan),
            Func::Asin => Some(HostFn::PmacAsin),
            Func::Acos => Some(HostFn::PmacAcos),
            Func::Atan => Some(HostFn::PmacAtan),
            _ => None,
        };
        if let Some(function) = trigonometric {
            let radians = self.radians();
            let b = self.builder.func();
            let x = x.float(b);
            let value = emit::host_value(b, function, &[x, radians])?;
            return Ok(Operand::Double(value));
        }
        let simple = match func {
            Func::Atan2 => {
                let cosine = self.read(Kind::Q, 0)?;
                let radians = self.radians();
                let b = self.builder.func();
                let (x, cosine) = (x.float(b), cosine.float(b));
                let value = emit::host_value(b, HostFn::PmacAtan2, &[x, cosine, radians])?;
                return Ok(Operand::Double(value));
            }
            Func::Abs => UnaryOp::Fabs,
            Func::Int => UnaryOp::Ffloor,
            Func::Sqrt => UnaryOp::Fsqrt,
            _ => {
                let function = if func == Func::Ln { HostFn::PmacLn } else { HostFn::PmacExp };
                let b = self.builder.func();
                let x = x.float(b);
                let value = emit::host_value(b, function, &[x])?;
                return Ok(Operand::Double(value));
            }
        };
        let b = self.builder.func();
        let x = x.float(b);
        let value = Operand::Double(b.unary(simple, x));
        Ok(Operand::Double(value.stored(b)))
    }
}
