//! Resolves the names of a checked program to places in the image, before the first scan.

use plcc_abi::pmi::Type;

use crate::pmi::{
    ast::{Action, Checked, Meaning, Op, Ops, SymbolId, Target},
    layout::{Layout, Location},
};

use super::{
    Step,
    effect::{Effect, FlipFlop, Timer},
    row::{Array, Row, Rows},
};

/// The number of an effect that stands for none.
pub(super) const NO_EFFECT: u32 = u32::MAX;

/// Makes steps, and collects their rows and effects.
pub(super) struct Resolver<'a> {
    checked: &'a Checked,
    layout: &'a Layout,
    pub(super) rows: Rows,
    pub(super) effects: Vec<Effect>,
}

impl<'a> Resolver<'a> {
    pub(super) fn new(checked: &'a Checked, layout: &'a Layout) -> Self {
        Self { checked, layout, rows: Rows::default(), effects: vec![] }
    }

    /// Resolves a step.
    pub(super) fn step(&mut self, action: &Action) -> Step {
        match action {
            Action::Assign { target, value } => self.assign(target, value),
            Action::If { condition, otherwise } => {
                Step::If { condition: self.row(condition), otherwise: *otherwise }
            }
            Action::Jump { to, .. } => Step::Jump(*to),
        }
    }

    fn assign(&mut self, target: &Target, value: &Ops) -> Step {
        let (id, index) = match target {
            Target::Scalar(id) => (*id, 0),
            Target::At(id, index) => (*id, *index),
            Target::Element(id, index) => {
                let index = self.row(index);
                let value = self.row(value);
                let effect = self.effect(*id);
                return Step::AssignElement {
                    array: array(self.checked, self.layout, *id),
                    index,
                    value,
                    effect,
                };
            }
        };
        let location = location(self.checked, self.layout, id, index);
        let value = self.row(value);
        match (self.effect(id), location) {
            (NO_EFFECT, Location { offset, ty: Type::Logical }) => Step::Logical { offset, value },
            (effect, _) => Step::Assign { location, value, effect },
        }
    }

    /// Resolves an expression.
    fn row(&mut self, ops: &Ops) -> Row {
        let (checked, layout) = (self.checked, self.layout);
        let scalar = |op: &Op| match *op {
            Op::LoadAt(id, index) => location(checked, layout, id, index),
            Op::Load(id) | Op::Element(id) => location(checked, layout, id, 0),
            Op::Const(_) | Op::Neg { .. } | Op::Not | Op::Binary(_) => {
                Location { offset: u32::MAX, ty: Type::Logical }
            }
        };
        let elements = |op: &Op| match *op {
            Op::Element(id) => array(checked, layout, id),
            Op::Const(_)
            | Op::Load(_)
            | Op::LoadAt(..)
            | Op::Neg { .. }
            | Op::Not
            | Op::Binary(_) => Array { first: scalar(op), elements: 0 },
        };
        self.rows.add(checked.ops(ops), scalar, elements)
    }

    /// Adds what an assignment to the variable does apart from storing a value, and returns its number.
    fn effect(&mut self, id: SymbolId) -> u32 {
        let effect = match self.checked.symbol(id).map(|symbol| &symbol.meaning) {
            Some(Meaning::ResetOnly) => Some(Effect::Reset),
            Some(Meaning::TimerControl(index)) => self.timer(*index).map(Effect::Timer),
            Some(Meaning::Clock(index)) => self.flipflop(*index).map(Effect::Clock),
            Some(Meaning::Pin(index)) => self.flipflop(*index).map(Effect::Pin),
            _ => None,
        };
        let Some(effect) = effect else { return NO_EFFECT };
        self.effects.push(effect);
        self.effects.len() as u32 - 1
    }

    fn timer(&self, index: u32) -> Option<Timer> {
        let timer = self.checked.timers.get(index as usize)?;
        Some(Timer {
            kind: timer.kind,
            delayed: offset(self.layout, timer.delayed),
            counter: *self.layout.counters.get(index as usize)?,
            preset: timer.preset,
        })
    }

    fn flipflop(&self, index: u32) -> Option<FlipFlop> {
        let pins = self.checked.flipflops.get(index as usize)?;
        Some(FlipFlop {
            q: offset(self.layout, pins.q),
            d: offset(self.layout, pins.d),
            clock: offset(self.layout, pins.clock),
            preset: offset(self.layout, pins.preset),
            clear: offset(self.layout, pins.clear),
            last_clock: *self.layout.last_clocks.get(index as usize)?,
        })
    }
}

/// A symbol's offset in the image. A checked program has only symbols that the layout knows; any
/// other would lie outside every image, where reads give 0 and writes do nothing.
fn offset(layout: &Layout, id: SymbolId) -> u32 {
    layout.offset(id).unwrap_or(u32::MAX)
}

fn location(checked: &Checked, layout: &Layout, id: SymbolId, index: u32) -> Location {
    let ty = checked.symbol(id).map_or(Type::Logical, |symbol| symbol.ty);
    Location { offset: offset(layout, id).saturating_add(index * ty.size()), ty }
}

fn array(checked: &Checked, layout: &Layout, id: SymbolId) -> Array {
    let elements = checked.symbol(id).and_then(|symbol| symbol.elements).unwrap_or(1);
    Array { first: location(checked, layout, id, 0), elements }
}
