//! Constants: `value-out-of-range` and `constant-condition`.

use plcc_abi::pmi::{Format, Lines, Type, arithmetic};
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

/// Finds constants outside the range of the executive variable or group of lines to which they are assigned, or with
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
        if let Some((message, help)) = finding {
            found.push(Diagnostic::warning("PMI-W10", step.span, message).help(help));
        }
    }
}

/// What is wrong if a value is outside the range of a variable, and what to do.
fn outside(checked: &Checked, id: SymbolId, value: i32) -> Option<(String, &'static str)> {
    let symbol = checked.symbol(id)?;
    let (low, high, help) = match symbol.meaning {
        Meaning::Input(lines) | Meaning::Output(lines) if symbol.ty != Type::Logical => {
            let (low, high) = range_of_lines(lines);
            (low, high, "its directive says how many lines it has, and how they are read")
        }
        _ => {
            let (_, low, high) = RANGES.into_iter().find(|(name, ..)| *name == symbol.name)?;
            (low, high, "`plcc explain` has the meaning of each executive variable")
        }
    };
    let name = &symbol.name;
    let message = || format!("{value} is outside the range of {name}, which is {low} to {high}");
    (!(low..=high).contains(&value)).then(|| (message(), help))
}

/// The lowest and the highest value that lines can have (PMI 2.3.2).
fn range_of_lines(lines: Lines) -> (i32, i32) {
    let count = u32::from(lines.count).clamp(1, 31);
    match lines.format {
        Format::Bit | Format::Binary => (0, ((1_i64 << count) - 1) as i32),
        Format::TwosComplement => (-(1 << (count - 1)), (1 << (count - 1)) - 1),
        Format::Bcd => {
            // The highest digit may have fewer than four lines.
            let highest = (1 << (count % 4)) - 1;
            (0, (0..count / 4).fold(highest, |value, _| value.saturating_mul(10).saturating_add(9)))
        }
    }
}

/// What is wrong with the first comparison for equality of a variable with a constant that it can't have.
fn compared(checked: &Checked, ops: &Ops) -> Option<(String, &'static str)> {
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
