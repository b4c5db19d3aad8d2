//! Speculation that the variables of a statement hold integers.
//!
//! ```text
//!          load the assumed variables, check that each holds an integer of 32 bits
//!            │ all do                                    │ one does not
//!   specialised code: integer arithmetic        general code: the control's floating point
//!            └─────────────────────┬─────────────────────┘
//!                              next statement
//! ```
//!
//! The statement is emitted once for each, from the same expression: what differs is what is known
//! of the variables' values.

use plcc_ir::{BinaryOp, FloatCond, Type, Value};

use super::Lowerer;
use super::analysis::{self, Name};
use super::emit::{self, Operand};
use super::range_analysis::Bounds;
use super::variables::bounds_of;
use crate::common::InternalError;
use crate::pmac::ast::Expr;

impl Lowerer<'_> {
    /// The truth value of a condition; `integer` if L-variables' integers compute it.
    pub(super) fn condition(&mut self, expr: Expr, integer: bool) -> Result<Value, InternalError> {
        if integer {
            return self.condition_integer(expr);
        }
        if let Some(assumed) = self.assumed_integers(expr)
            && let Some(truth) = self.speculate(&assumed, |this| {
                let value = this.value(expr)?;
                Ok(Some(value.truth(this.builder.ins())))
            })?
        {
            return Ok(truth);
        }
        let value = self.value(expr)?;
        Ok(value.truth(self.builder.ins()))
    }

    /// The variables that an expression is speculated to find integers in; `None` where that does
    /// not pay.
    pub(super) fn assumed_integers(&self, expr: Expr) -> Option<Vec<Name>> {
        if self.beside_specialised {
            return None;
        }
        let bounds = |(kind, number)| bounds_of(self.download, &self.places_of_m, kind, number);
        let found = analysis::analyse(self.download.ops(expr), bounds);
        (found.gains && found.forced.is_none()).then_some(found.assumed)
    }

    /// Emits specialised code for integers in all assumed variables and general code for other
    /// values, behind a guard that checks which of the two holds. `emit` is called for each; a
    /// truth value that it gives comes out of both.
    pub(super) fn speculate(
        &mut self,
        assumed: &[Name],
        mut emit: impl FnMut(&mut Self) -> Result<Option<Value>, InternalError>,
    ) -> Result<Option<Value>, InternalError> {
        let mut any = None;
        let (mut integers, mut doubles) = (Vec::new(), Vec::new());
        for &name in assumed {
            let value = self.read(name.0, u32::from(name.1))?;
            let b = self.builder.ins();
            let value = value.float(b);
            // Variables hold no NaN.
            let (narrow, other) = emit::integrality_check(b, value, FloatCond::OrderedNe);
            any = Some(match any {
                Some(others) => b.binary(BinaryOp::Or, others, other),
                None => other,
            });
            integers.push((name, Operand::Value(narrow, analysis::ASSUMED)));
            doubles.push((name, Operand::Value(value, Bounds::FINITE)));
        }
        let any = any.ok_or_else(|| InternalError::new("no variable is speculated on"))?;
        let b = self.builder.ins();
        let (integer, float, join) = (b.create_block(), b.create_block(), b.create_block());
        b.brif(any, float, integer);
        let mut result = None;
        for (block, loaded) in [(integer, integers), (float, doubles)] {
            self.builder.ins().switch_to(block);
            self.guarded = loaded;
            self.beside_integers = block == float;
            let value = emit(self)?;
            self.beside_integers = false;
            self.guarded.clear();
            let b = self.builder.ins();
            if value.is_some() && result.is_none() {
                result = Some(b.block_param(join, Type::I1));
            }
            b.jump(join, value.as_slice());
        }
        self.builder.ins().switch_to(join);
        Ok(result)
    }
}
