//! Lowers expressions and conditions. Their operations are in postfix order, so each takes its
//! operands from a stack and puts its result there. Functions (SIN, ABS and so on) are lowered here
//! too, operators in [`emit`].

use plcc_abi::HostFn;
use plcc_abi::Region;
use plcc_abi::pmac::{Assumption, Kind, View};
use plcc_diag::SourceMap;
use plcc_ir::{Address, BinaryOp, ChunkBuilder, InstBuilder, Type, UnaryOp};

use super::Lowerer;
use super::emit::{self, Operand};
use crate::common::{BrokenInvariant, ExpressionCode};
use crate::pmac::analyse::assumptions;
use crate::pmac::analyse::load::Loaded;
use crate::pmac::ast::{Download, Expr, Func, Op};

/// Lowers an expression to a module that leaves its value, a double, behind the process image; of a condition it leaves whether it
/// holds, an `i32`. Q-variables are those of coordinate system 1, M-variables are as they are defined after load.
///
/// # Errors
/// If an operator lacks an operand, or a variable is not defined.
pub(crate) fn lower_expression(
    download: &Download,
    loaded: &Loaded,
    ops: Vec<Op>,
    condition: bool,
) -> Result<ExpressionCode, BrokenInvariant> {
    let layout = loaded.layout;
    let expr = Expr { start: 0, len: ops.len() as u32 };
    let view = View { image: &loaded.image, layout: &layout, sparse: &loaded.sparse };
    let mut defined: Vec<Assumption> = vec![];
    for op in &ops {
        if let Op::Var(Kind::M, number) = *op {
            let number = u32::from(number) & (layout.count - 1);
            let definition = Some(view.definition(number));
            defined.push(Assumption { number, definition });
        }
    }
    let download = Download { ops, ..download.clone() };
    let result = layout.size.next_multiple_of(8);
    let mut regions = layout.regions();
    regions.push(Region { name: "result".to_owned(), offset: result, size: 8, bits: false });
    let builder = ChunkBuilder::new(result + 8, regions);
    let region = builder.region("result");
    let region = region.ok_or_else(|| BrokenInvariant::new("the image has no region `result`"))?;
    let sources = SourceMap::new();
    let places_of_m = assumptions::places(&layout, &defined);
    let mut lowerer = Lowerer::new(&download, loaded, &sources, builder, places_of_m)?;
    lowerer.specialised = true;
    let start = lowerer.builder.place();
    lowerer.builder.bind(start);
    lowerer.builder.task("expression", start);
    let value = lowerer.value(expr)?;
    let b = lowerer.builder.func();
    let (value, ty) = match condition {
        true => {
            let truth = value.truth(b);
            (b.zextend_or_trunc(Type::I32, truth), Type::I32)
        }
        false => (value.stored(b), Type::F64),
    };
    b.store(Address::fixed(region, 0), value);
    lowerer.builder.ret();
    Ok(ExpressionCode { module: lowerer.builder.finish(), result, ty })
}

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
