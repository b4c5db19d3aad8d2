//! Online change of a PMAC download. All PMACs of a kind have the same memory, so all of it is taken
//! over: P, Q and I, the definitions of the M-variables, every word.
//!
//! The on-line commands of the new download are not executed again. Only what it sets up differently is
//! taken from it: definitions of M-variables and values of I-variables that differ between the two
//! downloads as they are after load. A PLC keeps whether it is enabled, disabled or paused. It goes
//! on in its WHILE only if its own statements are the same in both downloads; else it begins at its top.

use std::sync::Arc;

use plcc_abi::image::{read_f64, read_u64, write_f64};
use plcc_abi::natural_cmp;
use plcc_abi::pmac::{Definition, Definitions, Field, Layout, PmacName, PmacTables, Run};

use super::PmacExecutive;
use super::host::next_revision;
use super::state::{Plcs, Status};
use crate::online_change::{Comparison, Plan, Row};

/// How the state of one download becomes that of another one.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct PmacTransfer {
    /// The codes of definitions that the new download makes differently.
    definitions: Vec<(u32, u64)>,
    /// The values of I-variables that it sets differently: offset and value.
    settings: Vec<(u32, f64)>,
    /// Bit n is set where PLC n has the same statements in both, so that it goes on where it was suspended.
    same_plcs: u32,
    /// The same of the PLCCs.
    same_plccs: u32,
}

/// The image of a download after load.
fn after_load(tables: &PmacTables, layout: &Layout) -> Vec<u8> {
    let mut image = vec![0; layout.size as usize];
    Run::unpack(&tables.initial, &mut image);
    image
}

/// A definition as a program writes it.
fn text(definition: Definition) -> String {
    let place = PmacName::Memory(definition).to_string();
    match definition {
        Definition::X { field, .. } | Definition::Y { field, .. } => {
            let Field { offset, width, format } = field;
            format!("{place},{offset},{width},{format:?}")
        }
        Definition::Tw { address } => format!("TW:${address:X}"),
        _ => place,
    }
}

/// Compares two downloads.
///
/// # Errors
/// When they are for different controllers.
pub(super) fn compare(was: &PmacTables, is: &PmacTables) -> Result<Comparison, String> {
    if was.controller != is.controller {
        return Err("it is for another controller (PMAC or Turbo PMAC)".into());
    }
    let layout = Layout::new(is.controller);
    let (before, after) = (after_load(was, &layout), after_load(is, &layout));
    let mut rows = vec![];
    let (mut definitions, mut settings) = (vec![], vec![]);
    for number in 0..layout.count {
        let code = |image: &[u8]| read_u64(image, layout.definition_offset(number));
        let shown = |image: &[u8]| match Definition::decode(code(image)) {
            // Its value is not part of it.
            Definition::Star => "*".to_owned(),
            definition => text(definition),
        };
        let (old, new) = (shown(&before), shown(&after));
        if old != new {
            definitions.push((number, code(&after)));
            rows.extend(Row::of(&format!("M{number}"), Some(old), Some(new)));
        }
        let offset = layout.i_offset(number);
        let (old, new) = (read_f64(&before, offset), read_f64(&after, offset));
        if old != new {
            settings.push((offset, new));
            let shown = |value: f64| Some(crate::value::number(value));
            rows.extend(
                Row::of(&format!("I{number}"), shown(old), shown(new))
                    .map(|row| Row { needs_accept: false, ..row }),
            );
        }
    }
    for compiled in [false, true] {
        for number in 0..32 {
            let find = |tables: &PmacTables| {
                let same = |plc: &&plcc_abi::pmac::Program| {
                    plc.number == number && plc.compiled == compiled
                };
                tables.programs.iter().find(same).map(|_| "program".to_owned())
            };
            let name = format!("PLC{}{number}", if compiled { "C" } else { "" });
            let (old, new) = (find(was), find(is));
            let gone = new.is_none();
            rows.extend(Row::of(&name, old, new).map(|row| Row { needs_accept: gone, ..row }));
        }
    }
    rows.sort_by(|a, b| natural_cmp(&a.name, &b.name));
    let [same_plcs, same_plccs] = [false, true].map(|compiled| {
        let same = |plc: &&plcc_abi::pmac::Program| {
            let is_same = |other: &plcc_abi::pmac::Program| {
                (other.number, other.compiled, other.fingerprint)
                    == (plc.number, plc.compiled, plc.fingerprint)
            };
            plc.compiled == compiled && was.programs.iter().any(is_same)
        };
        let numbers =
            is.programs.iter().filter(same).filter_map(|plc| 1u32.checked_shl(plc.number));
        numbers.fold(0, |set, bit| set | bit)
    });
    let kept = is.named.iter().filter(|name| was.named.contains(name)).count();
    Ok(Comparison {
        kept,
        rows,
        plan: Plan::new(PmacTransfer { definitions, settings, same_plcs, same_plccs }),
    })
}

impl PmacExecutive {
    /// Takes the state of another download's executive over.
    pub(super) fn take_over_from(&mut self, old: &mut Self, plan: &PmacTransfer) {
        let layout = self.host.layout;
        let contexts = layout.q_base..layout.size;
        for range in
            [layout.p..layout.mdef, layout.thumbwheels..layout.differing_definitions, contexts]
        {
            let range = range.start as usize..range.end as usize;
            if let (Some(to), Some(from)) =
                (self.image.get_mut(range.clone()), old.image.get(range))
            {
                to.copy_from_slice(from);
            }
        }
        let mut definitions = Definitions::new(&mut self.image, &layout);
        for number in 0..layout.count {
            let code = read_u64(&old.image, layout.definition_offset(number));
            definitions.set_code(number, code);
        }
        for &(number, code) in &plan.definitions {
            definitions.set_code(number, code);
        }
        for &(offset, value) in &plan.settings {
            write_f64(&mut self.image, offset, value);
        }
        let (state, was) = (&mut self.host.state, &mut old.host.state);
        state.tick = was.tick;
        state.until_interrupt = was.until_interrupt;
        state.last_plc = was.last_plc;
        state.plcs.take_over(&was.plcs, plan.same_plcs);
        state.plccs.take_over(&was.plccs, plan.same_plccs);
        // Commands belong to their program. Between two ticks none waits, unless there are no
        // background steps.
        state.queue.clear();
        std::mem::swap(&mut state.sparse, &mut was.sparse);
        std::mem::swap(&mut state.saved, &mut was.saved);
        // They hold the words that they held before, also those of variables that the program has moved.
        std::mem::swap(&mut state.forces, &mut was.forces);
        if let (Some(own), Some(was)) = (&mut state.motion, &mut was.motion) {
            own.take_over(was, &old.host.tables.motion, &self.host.tables.motion);
        }
        // The new program's control has told of its power-up, which is not to be told.
        self.host.events.clear();
        self.host.events.append(&mut old.host.events);
        // What the former download has saved stays its own until this one saves, so that the next
        // start carries it over as this one's text asks.
        state.saved.origin.get_or_insert_with(|| Arc::clone(&old.host.origin));
        self.host.saved_revision = next_revision();
        std::mem::swap(&mut self.watchdog, &mut old.watchdog);
    }
}

impl Plcs {
    /// Takes over which PLCs run, and where they are, from the PLCs of another download. PLCs that it
    /// lacks stay as they are after load. In `same` bit n is set where PLC n has the same statements.
    fn take_over(&mut self, old: &Self, same: u32) {
        for (number, was) in (0..).zip(old.all()) {
            let Some(plc) = self.get_mut(number) else { return };
            if plc.status == Status::Absent || was.status == Status::Absent {
                continue;
            }
            plc.status = was.status;
            let is_same = same.checked_shr(number).unwrap_or(0) & 1 != 0;
            plc.restart = was.restart || !is_same;
            plc.resume = was.resume.filter(|_| is_same);
            self.update_enabled_bit(number);
        }
    }
}
