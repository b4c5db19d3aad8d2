//! Statements, with what an assignment does at once: reset-only variables, timers and flip-flops (PMI 2.2.4.5, 3.1.9, 3.1.10).

use plcc_abi::pmi::{TimerKind, Type as PmiType};
use plcc_iec::{Expression, Item, Level, Step};

use super::Own;
use super::expression::Indices;
use super::variables::Variables;
use crate::common::CommentsInOrder;
use crate::pmi::ast::{Action, Checked, Meaning, Op, Ops, SymbolId, Target};

/// The most indices that a statement computes.
pub(super) fn most_indices(checked: &Checked) -> usize {
    let in_ops =
        |ops: &Ops| checked.ops(ops).iter().filter(|op| matches!(op, Op::Element(_))).count();
    let in_step = |action: &Action| match action {
        Action::Assign { target: Target::Element(_, index), value } => {
            in_ops(index) + in_ops(value) + 1
        }
        Action::Assign { value, .. } => in_ops(value),
        Action::If { condition, .. } => in_ops(condition),
        Action::Jump { .. } => 0,
    };
    checked.steps.iter().map(|step| in_step(&step.action)).max().unwrap_or(0)
}

/// The statements as items of a flow.
pub(super) fn items(
    checked: &Checked,
    variables: &Variables<'_>,
    own: &Own,
    comments: &mut CommentsInOrder,
) -> Vec<Item> {
    let mut item = |step: &crate::pmi::ast::Step| {
        let (front, behind) = match step.action.is_statement() {
            true => comments.of_statement(step.span, step.line),
            false => Default::default(),
        };
        let mut indices = Indices::new(variables, own, step.line);
        let step = match &step.action {
            Action::Assign { target, value } => {
                Step::Do(assign(checked, variables, own, &mut indices, target, value))
            }
            Action::If { condition, otherwise } => {
                let condition = indices.value(checked.ops(condition)).truth();
                Step::Branch { before: indices.lines, condition, otherwise: *otherwise as usize }
            }
            Action::Jump { to, is_goto } => Step::Jump { to: *to as usize, ends_body: !is_goto },
        };
        Item { comments: front, behind, step }
    };
    checked.steps.iter().map(&mut item).collect()
}

fn assign(
    checked: &Checked,
    variables: &Variables<'_>,
    own: &Own,
    indices: &mut Indices<'_>,
    target: &Target,
    value: &Ops,
) -> Vec<String> {
    let (id, place) = match target {
        Target::Scalar(id) => (*id, variables.name(*id).to_owned()),
        Target::At(id, index) => (*id, format!("{}[{index}]", variables.name(*id))),
        Target::Element(id, index) => {
            let index = indices.value(checked.ops(index));
            (*id, indices.element(*id, index).into_text())
        }
    };
    let Some(symbol) = checked.symbol(id) else { return vec![] };
    let mut value = indices.value(checked.ops(value)).in_type(symbol.ty);
    if symbol.meaning == Meaning::ResetOnly {
        let old = Expression::name(place.clone());
        value = match symbol.ty {
            PmiType::Logical => old.infix("AND", Level::And, value),
            PmiType::Integer => old.call_with("INTEGER_AND(", value),
            PmiType::Long => old.call_with("LONG_AND(", value),
        };
    }
    let mut lines = std::mem::take(&mut indices.lines);
    lines.push(format!("{place} := {};", value.into_text()));
    match symbol.meaning {
        Meaning::TimerControl(index) => lines.extend(timer(checked, variables, own, index)),
        Meaning::Clock(index) => lines.extend(flipflop(checked, variables, own, index, true)),
        Meaning::Pin(index) => lines.extend(flipflop(checked, variables, own, index, false)),
        _ => {}
    }
    lines
}

/// PMI 3.1.9.2 and 3.1.9.3: what the control contact does at once.
fn timer(checked: &Checked, variables: &Variables<'_>, own: &Own, index: u32) -> Vec<String> {
    let timer = checked.timers.get(index as usize).zip(own.counters.get(index as usize));
    let Some((timer, count)) = timer else { return vec![] };
    let (control, delayed) = (variables.name(timer.control), variables.name(timer.delayed));
    let (not, at_once, starts) = match timer.kind {
        TimerKind::E => ("NOT ", "FALSE", format!("{count} = -1")),
        TimerKind::D => ("", "TRUE", format!("({count} = -1) AND {delayed}")),
    };
    vec![
        format!("IF {not}{control} THEN"),
        format!("  {delayed} := {at_once};"),
        format!("  {count} := -1;"),
        format!("ELSIF {starts} THEN"),
        format!("  {count} := {};", timer.preset),
        "END_IF;".into(),
    ]
}

/// PMI 3.1.10.1: what an assignment to a pin does at once. The clear wins over the preset, and that over the clock.
fn flipflop(
    checked: &Checked,
    variables: &Variables<'_>,
    own: &Own,
    index: u32,
    clocked: bool,
) -> Vec<String> {
    let flipflop = checked.flipflops.get(index as usize).zip(own.clocks.get(index as usize));
    let Some((pins, before)) = flipflop else { return vec![] };
    let name = |id: SymbolId| variables.name(id);
    let (q, clock) = (name(pins.q), name(pins.clock));
    let mut lines = vec![
        format!("IF {} THEN", name(pins.clear)),
        format!("  {q} := FALSE;"),
        format!("ELSIF {} THEN", name(pins.preset)),
        format!("  {q} := TRUE;"),
    ];
    if clocked {
        lines.push(format!("ELSIF {clock} AND NOT {before} THEN"));
        lines.push(format!("  {q} := {};", name(pins.d)));
    }
    lines.push("END_IF;".into());
    if clocked {
        lines.push(format!("{before} := {clock};"));
    }
    lines
}
