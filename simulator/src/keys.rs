//! Keys: rows `KEY.NAME` of a stimulus (cnc-side 1.16, 2.18, 3.26).

use plcc_abi::Dialect;

use crate::access::{Access, Handle, Use, Variable};
use crate::nct::panel;
use crate::pmi::Window;
use crate::setup::Setup;

/// A key of the machine.
#[derive(Clone, Debug)]
pub struct Key {
    /// Its name in capitals, without `KEY.`.
    pub name: String,
    pub(crate) action: Action,
    /// The flags of which one must be 1 for the key to count; without any it always does.
    pub(crate) selected: Vec<Variable>,
    /// Their names.
    pub(crate) selections: &'static [&'static str],
}

/// What a key does.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Action {
    /// It is a row on a variable.
    Row(Handle),
    /// It holds a device where it is.
    Jam(usize),
    /// It enters a block (NCT).
    Enter(u32),
    /// A drive fails (NCT): the kind by its place among SERVO, ENCODER and FEEDBACK, and the axis from 1.
    Fail(usize, u8),
    /// It answers the message 3549 (NCT).
    Answer,
    /// It touches a button of a window (PMI).
    Touch(Window, usize),
}

/// The push-buttons of a PMI operator panel, from @CP100 on (PMI 6.2).
const PANEL: [&str; 16] = [
    "AXIS SELECT",
    "CONT JOG",
    "INCR JOG",
    "JOG +",
    "JOG -",
    "HOME",
    "ZERO SET",
    "OPTIONAL STOP",
    "BLOCK DELETE",
    "AUTO",
    "SINGLE BLOCK",
    "MANUAL",
    "CYCLE START",
    "STATION ACTIVE",
    "CONTROL RESET",
    "MACHINE ON",
];

/// Collects keys; the first one of a name counts.
struct Keys(Vec<Key>);

impl Keys {
    fn add(&mut self, name: String, action: Action) {
        self.add_selected(name, action, vec![], &[]);
    }

    fn add_selected(
        &mut self,
        name: String,
        action: Action,
        selected: Vec<Variable>,
        selections: &'static [&'static str],
    ) {
        if self.0.iter().all(|key| key.name != name) {
            self.0.push(Key { name, action, selected, selections });
        }
    }

    /// A key that is a row on a variable, if the program has it.
    fn row(&mut self, access: &mut dyn Access, name: impl Into<String>, variable: &str) {
        if let Ok(handle) = access.find(variable, Use::Row) {
            self.add(name.into(), Action::Row(handle));
        }
    }
}

/// The keys of a run, those of the machine first. `devices` are the names of the devices. What is wrong with those of the
/// machine is told, with the line.
pub(crate) fn keys(
    setup: &Setup,
    devices: &[String],
    access: &mut dyn Access,
    wrong: &mut Vec<String>,
) -> Vec<Key> {
    let mut keys = Keys(vec![]);
    for (name, variable) in &setup.table.keys {
        match access.find(variable.value.trim(), Use::Row) {
            Ok(handle) => keys.add(name.value.clone(), Action::Row(handle)),
            Err(why) => {
                wrong.push(format!("line {}: {why}", variable.line));
                // The keys behind it keep their numbers.
                keys.add(name.value.clone(), Action::Answer);
            }
        }
    }
    for (at, name) in devices.iter().enumerate() {
        keys.add(format!("JAM {name}"), Action::Jam(at));
    }
    match setup.rules.dialect {
        Dialect::Pmi => pmi(&mut keys, access),
        Dialect::Nct => nct(&mut keys, setup, access),
        _ => {}
    }
    keys.0
}

fn pmi(keys: &mut Keys, access: &mut dyn Access) {
    for (number, name) in PANEL.into_iter().enumerate() {
        let variable = format!("@CP{}", 100 + number);
        keys.row(access, name, &variable);
        keys.row(access, format!("CP{number}"), &variable);
        keys.row(access, format!("CP{}", 100 + number), &variable);
        for panel in [100, 200] {
            let name = format!("4P{}", panel + number);
            keys.row(access, name.clone(), &format!("@{name}"));
        }
    }
    keys.row(access, "ESTOP", "@ESTPB");
    for button in 0..12 {
        keys.add(format!("OP{button}"), Action::Touch(Window::Operator, button));
        keys.add(format!("MP{button}"), Action::Touch(Window::Extended, button));
    }
}

fn nct(keys: &mut Keys, setup: &Setup, access: &mut dyn Access) {
    for (name, flag, selections) in panel() {
        let Ok(handle) = access.find(&flag, Use::Row) else { continue };
        let find = |name: &&str| Variable::find(access, name, Use::Read);
        let selected = selections.iter().map(find).collect();
        keys.add_selected(name, Action::Row(handle), selected, selections);
    }
    for block in &setup.entries {
        keys.add(format!("BLOCK {}", block.line), Action::Enter(block.line.saturating_sub(1)));
    }
    for answer in ["Y", "N"] {
        keys.add(answer.into(), Action::Answer);
    }
    for (kind, name) in ["SERVO", "ENCODER", "FEEDBACK"].into_iter().enumerate() {
        for axis in 1..=8 {
            keys.add(format!("{name} {axis}"), Action::Fail(kind, axis));
        }
    }
}
