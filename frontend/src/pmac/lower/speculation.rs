//! Speculation on integers: computes a statement in integers while its variables hold integers.
//!
//! ```text
//!          load the assumed variables, check that each holds an integer of 32 bits
//!            │ all do                                    │ one does not
//!   specialised code: integer arithmetic        general code: the control's floating point
//!            └─────────────────────┬─────────────────────┘
//!                              next statement
//! ```
//!
//! Both come from the same expression, which is lowered twice. Only what is known of the variables'
//! values differs.

use plcc_ir::{BinaryOp, FloatCond, Type, Value};

use super::Lowerer;
use super::analysis::{self, Name};
use super::emit::{self, Operand};
use super::range_analysis::Bounds;
use super::variables::bounds_of;
use crate::common::InternalError;
use crate::pmac::ast::Expr;

impl Lowerer<'_> {
    /// The truth value of a condition; `integer` says that it is one of L-variables, which is
    /// computed in 24 bits.
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

    /// The variables of an expression that are assumed to hold integers; `None` where speculation
    /// does not make it faster.
    pub(super) fn assumed_integers(&self, expr: Expr) -> Option<Vec<Name>> {
        if self.has_specialised_code {
            return None;
        }
        let bounds = |(kind, number)| bounds_of(self.download, &self.places_of_m, kind, number);
        let found = analysis::analyse(self.download.ops(expr), bounds);
        (found.gains && found.forced.is_none()).then_some(found.assumed)
    }

    /// Emits specialised code for integers in all assumed variables, general code for other values,
    /// and the guard that chooses between them. `emit` is called once for each of the two. If it
    /// gives a truth value, the result is that of the code that runs.
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
        // Nearly all numbers of real programs are integers, so the general code is cold.
        b.brif(any, float, integer);
        let mut result = None;
        for (block, loaded) in [(integer, integers), (float, doubles)] {
            self.builder.ins().switch_to(block);
            self.guarded = loaded;
            self.has_integer_code = block == float;
            let before = self.builder.ins().set_cold(block == float);
            let value = emit(self)?;
            self.has_integer_code = false;
            self.guarded.clear();
            let b = self.builder.ins();
            b.set_cold(before);
            if value.is_some() && result.is_none() {
                result = Some(b.block_param(join, Type::I1));
            }
            b.jump(join, value.as_slice());
        }
        self.builder.ins().switch_to(join);
        Ok(result)
    }
}
