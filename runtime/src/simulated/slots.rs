//! The variables that the simulator has found, each with where it is read and how it was written last.

use std::ops::Range;
use std::sync::Arc;

use plcc_abi::DialectVariable;
use plcc_abi::nct::{LINE_BYTES, NctName};
use plcc_abi::place::{Direction, Number, Place, Type};
use plcc_simulator::{Access, Handle, Use};
use serde::{Deserialize, Serialize};

use super::bits::Bits;
use crate::executive::Executive;
use crate::names::Names;
use crate::value::Value;
use crate::variable::{Purpose, Setting, VariableKey};

/// Where the value of a variable is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Source {
    /// In the process image.
    Image(Place),
    /// In the process image: eight bytes, a bit each.
    EightBytes(u32),
    /// Outside of it, where nobody but the simulator and rows sets it: the value that was set last.
    LastSet,
    /// The executive is asked.
    Executive,
}

#[derive(Clone, Debug)]
struct Slot {
    variable: VariableKey,
    source: Source,
    bits: Option<Bits>,
    is_output_line: bool,
    /// The value that was set last, if that is known.
    last: Option<i64>,
    /// Whether a row has set it in this tick.
    by_row: bool,
    /// The value that is written in the place of every other, of a feedback that is broken.
    stuck: Option<i64>,
}

/// All of them.
#[derive(Debug)]
pub(super) struct Slots {
    names: Arc<dyn Names>,
    slots: Vec<Slot>,
    /// Whether a row has set any of them in this tick.
    any_row: bool,
    /// How often anything but a write of the simulator has changed what is known of them.
    revision: u64,
}

/// What a checkpoint holds of them.
#[derive(Serialize, Deserialize)]
pub(super) struct Remembered {
    /// For each that has no place in the image the value that was set last.
    last: Vec<Option<i64>>,
    by_row: Vec<bool>,
}

/// The variables, with the executive that has them.
pub(super) struct Bound<'a> {
    pub(super) slots: &'a mut Slots,
    pub(super) executive: &'a mut (dyn Executive + Send),
}

impl Slots {
    pub(super) fn new(names: Arc<dyn Names>) -> Self {
        Self { names, slots: vec![], any_row: false, revision: 0 }
    }

    fn get(&self, Handle(number): Handle) -> Option<&Slot> {
        self.slots.get(number as usize)
    }

    /// A variable that was found, with its bits where they are known.
    pub(super) fn found(&self, handle: Handle) -> Option<(VariableKey, Option<Bits>)> {
        self.get(handle).map(|slot| (slot.variable, slot.bits))
    }

    /// A row is about to set a variable: in this tick the simulator does not write what it sets.
    pub(super) fn row(&mut self, variable: VariableKey, value: Setting, names: &dyn Names) {
        let bits = Bits::of(variable, names);
        let number = value.integer();
        self.revision += 1;
        for slot in &mut self.slots {
            let overlap = slot.bits.zip(bits).filter(|(own, other)| own.overlap(*other));
            if slot.variable != variable && overlap.is_none() {
                continue;
            }
            (slot.by_row, self.any_row) = (true, true);
            slot.last = overlap.and_then(|(own, other)| other.part_of(number, own));
        }
    }

    /// The name of a variable that was found.
    pub(super) fn name(&self, handle: Handle) -> String {
        self.get(handle).map_or_else(String::new, |slot| self.names.canonical(slot.variable))
    }

    /// What is written to a variable from now on, whatever the simulator writes.
    pub(super) fn stick(&mut self, Handle(number): Handle, value: i64) {
        if let Some(slot) = self.slots.get_mut(number as usize) {
            slot.stuck = Some(value);
        }
        self.revision += 1;
    }

    /// The step of the tick is done.
    pub(super) fn end_tick(&mut self) {
        if std::mem::take(&mut self.any_row) {
            self.slots.iter_mut().for_each(|slot| slot.by_row = false);
            // In the next tick what the row has set is written over.
            self.revision += 1;
        }
    }

    /// What a checkpoint holds.
    pub(super) fn remembered(&self) -> Remembered {
        let last = |slot: &Slot| slot.last.filter(|_| slot.source == Source::LastSet);
        Remembered {
            last: self.slots.iter().map(last).collect(),
            by_row: self.slots.iter().map(|slot| slot.by_row).collect(),
        }
    }

    /// Whether what a checkpoint holds fits.
    pub(super) fn fits(&self, remembered: &Remembered) -> bool {
        let count = self.slots.len();
        remembered.last.len() == count && remembered.by_row.len() == count
    }

    /// Goes on with what a checkpoint holds.
    pub(super) fn remember(&mut self, remembered: Remembered) {
        let Remembered { last, by_row } = remembered;
        for (slot, (last, by_row)) in self.slots.iter_mut().zip(last.into_iter().zip(by_row)) {
            (slot.last, slot.by_row) = (last, by_row);
            self.any_row |= by_row;
        }
        self.revision += 1;
    }

    /// Takes what rows have set outside the image over from another program's variables.
    pub(super) fn take_over(&mut self, old: &Self) {
        for slot in &mut self.slots {
            // What lies outside the image has the same name in every program of the control.
            let same = old.slots.iter().find(|was| was.variable == slot.variable);
            slot.last = same.and_then(|was| was.last).filter(|_| slot.source == Source::LastSet);
        }
        self.revision += 1;
    }

    fn slot(&self, variable: VariableKey, wanted: Use) -> Slot {
        let names = &*self.names;
        let properties = names.properties(variable);
        let is_outside = |name: NctName| match name {
            NctName::I { byte, .. } => usize::from(byte) >= LINE_BYTES,
            _ => false,
        };
        let source = match variable.0 {
            // The image has the input flags as they were latched last, not as they are set.
            DialectVariable::Nct(name) if is_outside(name) => Source::LastSet,
            DialectVariable::Nct(NctName::I { bit: None, .. } | NctName::P { bit: None, .. }) => {
                Source::LastSet
            }
            DialectVariable::Pmac(_) => Source::Executive,
            _ => {
                let lines = properties.line.filter(|_| properties.direction == Direction::Input);
                let output = properties
                    .line
                    .filter(|_| wanted == Use::Lines && properties.direction == Direction::Output);
                match (output.or(lines).or(properties.value), wanted) {
                    (Some(place), Use::Byte) if place.ty == Type::Logical => {
                        Source::EightBytes(place.offset)
                    }
                    (Some(place), Use::Byte) => {
                        Source::Image(Place::bits(place.offset, Type::Bits, 0, 8))
                    }
                    (Some(place), _) => Source::Image(place),
                    (None, _) => Source::Executive,
                }
            }
        };
        Slot {
            variable,
            source,
            bits: Bits::of(variable, names),
            is_output_line: properties.direction == Direction::Output,
            last: None,
            by_row: false,
            stuck: None,
        }
    }
}

fn integer(number: Number) -> i64 {
    match number {
        Number::Int(value) => value,
        Number::Float(value) => value as i64,
    }
}

impl Access for Bound<'_> {
    fn find(&mut self, name: &str, wanted: Use) -> Result<Handle, String> {
        let purpose = match wanted {
            Use::Write | Use::Row => Purpose::Stimulus,
            Use::Read | Use::Lines | Use::Byte => Purpose::Watch,
        };
        let names = &*self.slots.names;
        let variable = names.find(name, purpose).map_err(|why| why.to_string())?;
        if names.properties(variable).elements.is_some() {
            return Err(format!("`{name}` is an array; name an element"));
        }
        let slot = self.slots.slot(variable, wanted);
        self.slots.slots.push(slot);
        Ok(Handle(self.slots.slots.len() as u32 - 1))
    }

    fn holds(&self, variable: Handle, number: i64) -> bool {
        let Some(slot) = self.slots.get(variable) else { return false };
        let names = &*self.slots.names;
        let range = match slot.source {
            Source::Image(place) => place.range(),
            _ => None,
        };
        let fits = names.parse(slot.variable, &number.to_string()).is_ok();
        fits && range.is_none_or(|range| range.contains(&number))
    }

    fn overlap(&self, a: Handle, b: Handle) -> bool {
        let (Some(a), Some(b)) = (self.slots.get(a), self.slots.get(b)) else { return false };
        let shared = a.bits.zip(b.bits).is_some_and(|(a, b)| a.overlap(b));
        a.variable == b.variable || shared
    }

    fn is_output_line(&self, variable: Handle) -> bool {
        self.slots.get(variable).is_some_and(|slot| slot.is_output_line)
    }

    #[inline]
    fn read(&self, variable: Handle) -> i64 {
        let Some(slot) = self.slots.get(variable) else { return 0 };
        match slot.source {
            Source::Image(place) => place.read(self.executive.image()).map_or(0, integer),
            Source::EightBytes(offset) => {
                let bytes = self.executive.image().get(offset as usize..);
                let bytes = bytes.and_then(|bytes| bytes.first_chunk::<8>());
                // Gathers the lowest bit of each byte.
                let spread = bytes.map_or(0, |bytes| u64::from_le_bytes(*bytes));
                (spread.wrapping_mul(0x0102_0408_1020_4080) >> 56) as i64
            }
            Source::LastSet => slot.last.unwrap_or(0),
            Source::Executive => match self.executive.read(slot.variable) {
                Value::Int(value) => value,
                Value::Float(value) => value as i64,
                Value::Array(_) => 0,
            },
        }
    }

    #[inline]
    fn write(&mut self, variable: Handle, value: i64) -> bool {
        let Handle(number) = variable;
        let Some(slot) = self.slots.slots.get_mut(number as usize).filter(|slot| !slot.by_row)
        else {
            return false;
        };
        let value = slot.stuck.unwrap_or(value);
        let is_there = match slot.source {
            Source::Image(place) => place.read(self.executive.image()).map(integer) == Some(value),
            Source::LastSet => slot.last == Some(value),
            Source::EightBytes(_) | Source::Executive => false,
        };
        if !is_there {
            slot.last = Some(value);
            self.executive.write(slot.variable, Setting::Int(value));
        }
        is_there
    }

    fn range(&self, variables: &[Handle]) -> Option<Range<usize>> {
        let range = |handle: &Handle| {
            let (offset, length) = match self.slots.get(*handle)?.source {
                Source::Image(place) => (place.offset, place.length()),
                Source::EightBytes(offset) => (offset, 8),
                Source::LastSet | Source::Executive => return None,
            };
            Some(offset as usize..offset as usize + length)
        };
        let ranges: Option<Vec<Range<usize>>> = variables.iter().map(range).collect();
        ranges?.into_iter().reduce(|all, one| all.start.min(one.start)..all.end.max(one.end))
    }

    fn image(&self) -> &[u8] {
        self.executive.image()
    }

    fn row(&mut self, variable: Handle, value: i64) {
        let Some(slot) = self.slots.get(variable) else { return };
        let variable = slot.variable;
        let names = Arc::clone(&self.slots.names);
        self.slots.row(variable, Setting::Int(value), &*names);
        self.executive.write(variable, Setting::Int(value));
    }

    fn revision(&self) -> u64 {
        self.slots.revision
    }
}
