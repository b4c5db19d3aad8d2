//! `number-in-logical`: names that nobody has declared, which are LOGICAL, used as if they held a number.

use std::collections::HashSet;

use plcc_abi::pmi::Type;
use plcc_diag::{Diagnostic, Span};

use crate::pmi::ast::{Action, Binary, Checked, Meaning, Op, SymbolId, Target};

/// What the value of an expression is, as far as this lint asks.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Value {
    /// True or false, or a constant that is 0 or 1.
    Truth,
    /// A number. With its value where it is constant.
    Number(Option<i32>),
    /// A LOGICAL that nobody has declared.
    Undeclared(SymbolId),
}

/// Finds numbers that are assigned to undeclared names, and undeclared names that are compared with a number other
/// than 0 and 1. An undeclared name is a LOGICAL (PMI 2.3.3), which keeps of a number only whether it is 0. Whether a
/// variable is 0 may be all that is asked; so a number that is not constant is told of only if the name is compared with a
/// number somewhere.
pub(super) fn numbers_in_logicals(checked: &Checked, found: &mut Vec<Diagnostic>) {
    let undeclared = undeclared(checked);
    let is_undeclared = |id: SymbolId| undeclared.get(id.0 as usize).copied().unwrap_or(false);
    let name = |id: SymbolId| checked.symbol(id).map_or("", |symbol| symbol.name.as_str());
    let mut compared = vec![false; checked.symbols.len()];
    let mut assigned: Vec<(SymbolId, Span)> = vec![];
    let mut told = HashSet::new();
    let mut finding = |id: SymbolId, span: Span, message: String| {
        if !told.insert(id) {
            return;
        }
        let finding = Diagnostic::warning("PMI-W13", span, message)
            .help(format!("declare it: $INTEGER and a line {}", name(id)));
        let first = checked.symbol(id).and_then(|symbol| symbol.declared);
        found.push(match first.filter(|first| !(span.start..span.end).contains(&first.start)) {
            Some(first) => finding.label(first, "this assignment makes it a LOGICAL"),
            None => finding,
        });
    };
    let mut stack: Vec<Value> = vec![];
    for step in &checked.steps {
        let ops = match &step.action {
            Action::Assign { value, .. } => value,
            Action::If { condition, .. } => condition,
            Action::Jump { .. } => continue,
        };
        stack.clear();
        for op in checked.ops(ops) {
            let value = match *op {
                Op::Const(0 | 1) => Value::Truth,
                Op::Const(value) => Value::Number(Some(value)),
                Op::Load(id) if is_undeclared(id) => Value::Undeclared(id),
                Op::Load(id) | Op::LoadAt(id, _) => of_symbol(checked, id),
                Op::Element(id) => {
                    stack.pop();
                    of_symbol(checked, id)
                }
                Op::Neg { .. } => match stack.pop() {
                    Some(Value::Number(Some(value))) => Value::Number(Some(value.wrapping_neg())),
                    _ => Value::Number(None),
                },
                Op::Not => {
                    stack.pop();
                    Value::Truth
                }
                Op::Binary(op) => {
                    let (right, left) = (stack.pop(), stack.pop());
                    let pair = (left, right);
                    if let (Some(Value::Undeclared(id)), Some(Value::Number(_)))
                    | (Some(Value::Number(_)), Some(Value::Undeclared(id))) = pair
                        && is_comparison(op)
                        && let Some(slot) = compared.get_mut(id.0 as usize)
                    {
                        *slot = true;
                    }
                    if let (Some(Value::Undeclared(id)), Some(Value::Number(Some(value))))
                    | (Some(Value::Number(Some(value))), Some(Value::Undeclared(id))) = pair
                        && is_comparison(op)
                    {
                        let name = name(id);
                        let message = format!(
                            "{name} is never {value}: nobody has declared it, so it is a LOGICAL, which is 0 or 1"
                        );
                        finding(id, step.span, message);
                    }
                    match op {
                        Binary::And | Binary::Or => Value::Truth,
                        op if is_comparison(op) => Value::Truth,
                        _ => Value::Number(None),
                    }
                }
            };
            stack.push(value);
        }
        if let Action::Assign { target: Target::Scalar(id), .. } = step.action
            && is_undeclared(id)
            && let Some(Value::Number(value)) = stack.pop()
        {
            match value {
                Some(value) => {
                    let name = name(id);
                    let message = format!(
                        "{value} becomes 1 in {name}: nobody has declared it, so it is a LOGICAL"
                    );
                    finding(id, step.span, message);
                }
                None => assigned.push((id, step.span)),
            }
        }
    }
    for (id, span) in assigned {
        if compared.get(id.0 as usize) == Some(&true) {
            let message = format!(
                "every number but 0 becomes 1 in {}: nobody has declared it, so it is a LOGICAL",
                name(id)
            );
            finding(id, span, message);
        }
    }
}

fn is_comparison(op: Binary) -> bool {
    match op {
        Binary::Eq | Binary::Ne | Binary::Lt | Binary::Le | Binary::Gt | Binary::Ge => true,
        Binary::Add { .. }
        | Binary::Sub { .. }
        | Binary::Mul { .. }
        | Binary::Div
        | Binary::Rem
        | Binary::And
        | Binary::Or => false,
    }
}

fn of_symbol(checked: &Checked, id: SymbolId) -> Value {
    match checked.symbol(id) {
        Some(symbol) if symbol.ty != Type::Logical => match &symbol.meaning {
            Meaning::Constant(values) if symbol.elements.is_none() => match values.first() {
                Some(0 | 1) => Value::Truth,
                value => Value::Number(value.copied()),
            },
            _ => Value::Number(None),
        },
        _ => Value::Truth,
    }
}

/// For each symbol whether no directive declares it: then its declaration is its first assignment.
fn undeclared(checked: &Checked) -> Vec<bool> {
    let mut undeclared = vec![false; checked.symbols.len()];
    for step in &checked.steps {
        let Action::Assign { target: Target::Scalar(id), .. } = &step.action else { continue };
        let Some(symbol) = checked.symbol(*id) else { continue };
        let is_here = |at: Span| {
            at.file == step.span.file && at.start >= step.span.start && at.end <= step.span.end
        };
        let is_plain = symbol.ty == Type::Logical && matches!(symbol.meaning, Meaning::Variable);
        if is_plain
            && !symbol.executive
            && symbol.declared.is_some_and(is_here)
            && let Some(slot) = undeclared.get_mut(id.0 as usize)
        {
            *slot = true;
        }
    }
    undeclared
}
