//! Lowers expressions and conditions. Their operations stand in postfix order, so each takes its
//! operands from a stack and puts its result there. Functions (SIN, ABS and so on) are lowered here
//! too, operators in [`emit`].

use plcc_abi::HostFn;
use plcc_abi::pmac::Kind;
use plcc_ir::{BinaryOp, UnaryOp};

use super::Lowerer;
use super::emit::{self, Operand};
use super::range_analysis::Bounds;
use crate::common::InternalError;
use crate::pmac::ast::{Expr, Func, Op};

impl Lowerer<'_> {
    /// The value of an expression, or the truth value of a condition.
    pub(crate) fn value(&mut self, expr: Expr) -> Result<Operand, InternalError> {
        let download = self.download;
        let mut stack = std::mem::take(&mut self.stack);
        stack.clear();
        let mut last = None;
        let prefer_short = self.has_specialised_code || self.has_integer_code;
        for op in download.ops(expr) {
            let mut pop = || stack.pop().ok_or_else(super::lacks_operand);
            let value = match *op {
                Op::Const(value) => Operand::Const(value),
                Op::Var(kind, number) => self.read(kind, u32::from(number))?,
                Op::Indirect(kind) => {
                    let number = pop()?;
                    self.read_indirect(kind, number)?
                }
                Op::Neg => emit::negate(self.builder.ins(), pop()?),
                Op::Bin(bin) => {
                    let right = pop()?;
                    let left = pop()?;
                    emit::binary(self.builder.ins(), bin, left, right, prefer_short)?
                }
                Op::Cmp(cmp) => {
                    let right = pop()?;
                    let left = pop()?;
                    emit::compare(self.builder.ins(), cmp, left, right)
                }
                Op::Call(func) => {
                    let x = pop()?;
                    self.call(func, x, last == Some(&Op::Call(Func::Abs)))?
                }
                Op::Both | Op::Either => {
                    let b = self.builder.ins();
                    let right = pop()?.truth(b);
                    let left = pop()?.truth(b);
                    let op = match op {
                        Op::Both => BinaryOp::And,
                        _ => BinaryOp::Or,
                    };
                    Operand::Value(b.binary(op, left, right), Bounds::Truth)
                }
            };
            stack.push(value);
            last = Some(op);
        }
        let value = stack.pop().ok_or_else(super::lacks_operand);
        self.stack = stack;
        value
    }

    /// The value of a function of `x`; `magnitude` says that `x` is the result of ABS.
    fn call(&mut self, func: Func, x: Operand, magnitude: bool) -> Result<Operand, InternalError> {
        if let (Operand::Const(value), Func::Sqrt | Func::Ln | Func::Exp | Func::Abs | Func::Int) =
            (x, func)
        {
            return Ok(Operand::Const(crate::pmac::analyse::eval::function(
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
            let b = self.builder.ins();
            let x = x.float(b);
            let value = emit::host_value(b, function, &[x, radians])?;
            return Ok(Operand::Value(value, Bounds::FUNCTION));
        }
        let simple = match func {
            Func::Atan2 => {
                let cosine = self.read(Kind::Q, 0)?;
                let radians = self.radians();
                let b = self.builder.ins();
                let (x, cosine) = (x.float(b), cosine.float(b));
                let value = emit::host_value(b, HostFn::PmacAtan2, &[x, cosine, radians])?;
                return Ok(Operand::Value(value, Bounds::FUNCTION));
            }
            Func::Abs => return Ok(self.abs(x)),
            Func::Int if x.bounds().is_int() => return Ok(x),
            Func::Int => UnaryOp::Ffloor,
            Func::Sqrt => UnaryOp::Fsqrt,
            _ => {
                let function = if func == Func::Ln { HostFn::PmacLn } else { HostFn::PmacExp };
                let b = self.builder.ins();
                let x = x.float(b);
                let value = emit::host_value(b, function, &[x])?;
                return Ok(Operand::Value(value, Bounds::FUNCTION));
            }
        };
        let (most, nan, minus_zero) = x.bounds().real();
        let b = self.builder.ins();
        let x = x.float(b);
        let value = b.unary(simple, x);
        if func == Func::Sqrt && magnitude && !nan && !minus_zero && most <= f64::MAX {
            let most = most.max(1.0);
            let bounds = Bounds::Real { most, nan: false, minus_zero: false };
            return Ok(Operand::Value(value, bounds));
        }
        // The magnitude of both is at most that of the argument, except that INT of a negative
        // number and SQRT of one below 1 may be greater by less than 1.
        let most = if most < f64::MAX { most + 1.0 } else { most };
        let nan = nan || func == Func::Sqrt;
        let unrestricted = Operand::Value(value, Bounds::Real { most, nan, minus_zero: true });
        Ok(Operand::Value(unrestricted.stored(b), Bounds::FINITE))
    }

    fn abs(&mut self, x: Operand) -> Operand {
        let b = self.builder.ins();
        match (x, x.bounds()) {
            (Operand::Value(value, _), Bounds::Int(low, high)) => {
                let bounds = Bounds::magnitude(low, high);
                let value = b.sextend_or_trunc(emit::integer_type(bounds), value);
                let negative = b.unary(UnaryOp::Neg, value);
                Operand::Value(b.binary(BinaryOp::Smax, value, negative), bounds)
            }
            (_, bounds) => {
                let (most, nan, _) = bounds.real();
                let value = x.float(b);
                let value = b.unary(UnaryOp::Fabs, value);
                let unrestricted =
                    Operand::Value(value, Bounds::Real { most, nan, minus_zero: false });
                Operand::Value(
                    unrestricted.stored(b),
                    Bounds::Real { most: most.min(f64::MAX), nan: false, minus_zero: false },
                )
            }
        }
    }
}
