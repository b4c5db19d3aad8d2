//! Constants: `value-out-of-range` and `constant-condition`.

use plcc_abi::pmi::arithmetic;
use plcc_diag::Diagnostic;

use crate::pmi::ast::{Action, Binary, Checked, Meaning, Op, Ops, SymbolId, Target};

/// The ranges that the manual gives for executive variables, both ends included (PMI 3.2.2.1 to
/// 3.2.2.3, 3.3.7, 3.4).
const RANGES: [(&str, i32, i32); 12] = [
    ("@AUACK", -1, 1),
    ("@AUMOD", 0, 4),
    ("@AUREQ", 0, 6),
    ("@AXIS", 0, 5),
    ("@AXRRQ", 0, 6),
    ("@FRO", 0, 150),
    ("@JGINC", 0, 9),
    ("@MODRQ", 0, 2),
    ("@NGRP", 0, 4),
    ("@PGMSE", 0, 2),
    ("@SPDAC", -32_767, 32_767),
    ("@SSO", 0, 150),
];

/// Finds constants outside the range of the executive variable to which they are assigned, or with
/// which they are compared for equality.
pub(super) fn out_of_range(checked: &Checked, found: &mut Vec<Diagnostic>) {
    for step in &checked.steps {
        let finding = match &step.action {
            Action::Assign { target, value } => {
                let (Target::Scalar(id) | Target::At(id, _) | Target::Element(id, _)) = target;
                let constant = constant(checked, checked.ops(value));
                let outside = constant.and_then(|value| outside(checked, *id, value));
                outside.or_else(|| compared(checked, value))
            }
            Action::If { condition, .. } => compared(checked, condition),
            Action::Jump { .. } => None,
        };
        if let Some(message) = finding {
            found.push(
                Diagnostic::warning("PMI-W10", step.span, message)
                    .help("`plcc explain` has the meaning of each executive variable"),
            );
        }
    }
}

/// What is wrong if a value is outside the range of a variable.
fn outside(checked: &Checked, id: SymbolId, value: i32) -> Option<String> {
    let symbol = checked.symbol(id)?;
    let (name, low, high) = RANGES.into_iter().find(|(name, ..)| *name == symbol.name)?;
    (!(low..=high).contains(&value))
        .then(|| format!("{value} is outside the range of {name}, which is {low} to {high}"))
}

/// What is wrong with the first comparison for equality of an executive variable with a constant that
/// it can't have.
fn compared(checked: &Checked, ops: &Ops) -> Option<String> {
    checked.ops(ops).array_windows().find_map(|[a, b, op]| {
        if !matches!(op, Op::Binary(Binary::Eq | Binary::Ne)) {
            return None;
        }
        let (id, value) = match (*a, *b) {
            (Op::Load(id) | Op::LoadAt(id, _), other) => (id, constant(checked, &[other])?),
            (other, Op::Load(id) | Op::LoadAt(id, _)) => (id, constant(checked, &[other])?),
            _ => return None,
        };
        outside(checked, id, value)
    })
}

/// Finds conditions of IF and ELSEIF that are always true or always false.
pub(super) fn constant_conditions(checked: &Checked, found: &mut Vec<Diagnostic>) {
    for step in &checked.steps {
        let Action::If { condition, .. } = &step.action else { continue };
        if let Some(value) = constant(checked, checked.ops(condition)) {
            let which = if value == 0 { "false" } else { "true" };
            let message = format!("this condition is always {which}");
            found.push(
                Diagnostic::warning("PMI-W11", step.span, message)
                    .help("compare a variable, or take the IF out"),
            );
        }
    }
}

/// The value of an expression that consists of constants; `None` if it reads a variable.
fn constant(checked: &Checked, ops: &[Op]) -> Option<i32> {
    let element = |id: SymbolId, index: usize| match &checked.symbol(id)?.meaning {
        Meaning::Constant(values) => values.get(index).copied(),
        _ => None,
    };
    let mut stack: Vec<i32> = Vec::new();
    for op in ops {
        let value = match *op {
            Op::Const(value) => value,
            Op::Load(id) => element(id, 0)?,
            Op::LoadAt(id, index) => element(id, index as usize)?,
            Op::Element(_) => return None,
            Op::Neg { long } => arithmetic::negate(stack.pop()?, long),
            Op::Not => i32::from(stack.pop()? == 0),
            Op::Binary(op) => {
                let right = stack.pop()?;
                arithmetic::binary(op, stack.pop()?, right)
            }
        };
        stack.push(value);
    }
    stack.pop()
}
