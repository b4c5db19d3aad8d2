//! What there is to be seen of a simulated machine: axes, small machines, keys and programs that run. It holds what never
//! changes in a run, and the names of the variables that say the rest, so that a display needs to know neither the control nor
//! the simulator.

use plcc_abi::Dialect;
use plcc_abi::machine::simulator::{DeviceEntry, DeviceKind, Located, TurretCode};

use crate::access::Handle;
use crate::keys::{Action, Key};
use crate::length::ticks;
use crate::setup::{Axis, Setup};
use crate::simulator::Simulator;

/// All of it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Equipment {
    /// The axes or motors.
    pub axes: Vec<MachineAxis>,
    /// The small machines.
    pub devices: Vec<MachineDevice>,
    /// The keys.
    pub keys: Vec<MachineKey>,
    /// The part program, or the motion programs of coordinate systems.
    pub programs: Vec<MachineProgram>,
    /// Ways in a plane.
    pub paths: Vec<MachinePath>,
}

impl Equipment {
    /// Whether there is nothing to be seen, as where no machine is simulated.
    pub fn is_empty(&self) -> bool {
        self.axes.is_empty() && self.devices.is_empty() && self.programs.is_empty()
    }
}

/// A number that variables hold: one variable, or two words, the lower one first.
#[derive(Clone, Debug, PartialEq)]
pub struct Reading {
    /// The variables.
    pub names: Vec<String>,
    /// How many of the variables' counts are a unit.
    pub scale: f64,
}

impl Reading {
    /// The number in one variable.
    pub fn of(name: impl Into<String>) -> Self {
        Self { names: vec![name.into()], scale: 1.0 }
    }

    /// The number, from the values of its variables; `None` where one is not known.
    pub fn value(&self, value: impl Fn(&str) -> Option<f64>) -> Option<f64> {
        let counts = match self.names.as_slice() {
            [one] => value(one)?,
            [low, high] => {
                let (low, high) = (value(low)? as i64 as u16, value(high)? as i64 as i16);
                f64::from(i32::from(high) * 65_536 + i32::from(low))
            }
            _ => return None,
        };
        Some(counts / self.scale)
    }
}

/// An axis, or a motor.
#[derive(Clone, Debug, PartialEq)]
pub struct MachineAxis {
    /// `X`, `#1`.
    pub name: String,
    /// The unit of its lengths.
    pub unit: &'static str,
    /// Where it is.
    pub actual: Reading,
    /// Where it is to be.
    pub commanded: Option<Reading>,
    /// The difference between the two.
    pub error: Option<Reading>,
    /// The ends of its travel.
    pub travel: Option<(f64, f64)>,
    /// A variable that is 0 where the axis is not in use.
    pub active: Option<String>,
}

/// What a small machine is, with what is to be known to draw it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MachineKind {
    /// A contactor: 0 or 1.
    Relay,
    /// A cylinder: 0 to 1000.
    Cylinder,
    /// A turret: an angle.
    Turret {
        /// How many stations it has.
        stations: u32,
        /// How far it is from one to the next.
        step: u64,
    },
    /// A pump: 0 to 1000.
    Pump {
        /// The pressure in percent at which its switch closes.
        on: u32,
        /// That at which it opens.
        off: u32,
    },
    /// A switch at an axis.
    Switch,
}

impl MachineKind {
    /// What it is called in the table.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Relay => "relay",
            Self::Cylinder => "cylinder",
            Self::Turret { .. } => "turret",
            Self::Pump { .. } => "pump",
            Self::Switch => "switch",
        }
    }
}

/// A small machine.
#[derive(Clone, Debug, PartialEq)]
pub struct MachineDevice {
    /// Its name in capitals.
    pub name: String,
    /// The variable that says where it is.
    pub at: String,
    /// What it is.
    pub kind: MachineKind,
    /// Its lines, each with the key of the table that names it.
    pub lines: Vec<(&'static str, String)>,
    /// The key that holds it where it is.
    pub jam: String,
}

/// A key.
#[derive(Clone, Debug, PartialEq)]
pub struct MachineKey {
    /// Its name in capitals, as a stimulus has it after `KEY.`.
    pub name: String,
    /// The variable that it sets.
    pub sets: Option<String>,
    /// The flags of which one must be 1 for the key to count; without any it always does.
    pub selections: &'static [&'static str],
}

/// A program that makes axes move.
#[derive(Clone, Debug, PartialEq)]
pub struct MachineProgram {
    /// What it is called: `part program`, `&1`.
    pub name: String,
    /// The variable that has the line which is carried out; below 0 an entered block.
    pub line: String,
    /// The variable that has the number of the program.
    pub number: Option<String>,
    /// The variable that has the time base in percent.
    pub base: Option<String>,
    /// Its lines. Empty where they are a part of the program that is monitored.
    pub text: Vec<String>,
    /// The blocks that can be entered.
    pub entries: Vec<String>,
}

/// A way in a plane.
#[derive(Clone, Debug, PartialEq)]
pub struct MachinePath {
    /// What it is called.
    pub name: String,
    /// The two variables, that from left to right first.
    pub axes: [String; 2],
}

/// What a simulator shows. `name_of` gives the name of a variable.
pub(crate) fn equipment(
    simulator: &Simulator,
    setup: &Setup,
    name_of: &dyn Fn(Handle) -> String,
) -> Equipment {
    let dialect = setup.rules.dialect;
    let has_control = matches!(dialect, Dialect::Pmi | Dialect::Nct);
    let axes = setup.axes.iter().enumerate().filter(|_| has_control);
    let axes = axes.map(|(at, axis)| machine_axis(setup, at, axis));
    let devices = setup.table.devices.iter().map(|entry| device(entry, simulator.tick_ns()));
    let mut seen = vec![];
    let mut keys = vec![];
    for key in simulator.keys() {
        // A variable has one key: the others are other names of the same.
        let sets = sets(key, name_of);
        let fails_elsewhere =
            matches!(key.action, Action::Fail(_, axis) if usize::from(axis) > setup.axes.len());
        let is_other_name = sets.is_some() && seen.contains(&sets);
        if matches!(key.action, Action::Jam(_)) || is_other_name || fails_elsewhere {
            continue;
        }
        seen.push(sets.clone());
        keys.push(MachineKey { name: key.name.clone(), sets, selections: key.selections });
    }
    let program = MachineProgram {
        name: "part program".into(),
        line: "SIM.LINE".into(),
        number: None,
        base: None,
        text: setup.part_text.clone(),
        entries: setup.entry_texts(),
    };
    Equipment {
        axes: axes.collect(),
        devices: devices.collect(),
        keys,
        programs: if has_control { vec![program] } else { vec![] },
        paths: vec![],
    }
}

/// The variable that a key sets.
fn sets(key: &Key, name_of: &dyn Fn(Handle) -> String) -> Option<String> {
    match key.action {
        Action::Row(handle) => Some(name_of(handle)),
        Action::Touch(window, button) => Some(window.button(button)),
        Action::Jam(_) | Action::Enter(_) | Action::Fail(..) | Action::Answer => None,
    }
}

fn machine_axis(setup: &Setup, at: usize, axis: &Axis) -> MachineAxis {
    let scale = axis.counts as f64;
    let is_pmi = setup.rules.dialect == Dialect::Pmi;
    let one = |name: String| Reading { names: vec![name], scale };
    let words = |first: usize| Reading {
        names: [first, first + 1].map(|word| format!("RH{word:03}")).into(),
        scale,
    };
    let (actual, commanded, error) = match is_pmi {
        true => (one(format!("@POSRG[{at}]")), Some(one(format!("@CMDRG[{at}]"))), None),
        // The lag stands after the actual position (NCT 6.4).
        false => (words(100 + 5 * at), None, Some(words(102 + 5 * at))),
    };
    let entry = setup.table.axes.get(at);
    let has_travel =
        is_pmi || entry.is_some_and(|entry| entry.min.is_some() && entry.max.is_some());
    let units = |length: i128| length as f64 / axis.unit.max(1) as f64;
    let [low, high] = axis.limits;
    MachineAxis {
        name: axis.name.map_or_else(|| format!("axis {at}"), String::from),
        unit: match axis.name {
            Some('A' | 'B' | 'C') => "°",
            _ if setup.rules.is_inch => "inch",
            _ => "mm",
        },
        actual,
        commanded,
        error,
        travel: has_travel.then(|| (units(low), units(high))),
        active: None,
    }
}

fn device(entry: &DeviceEntry, tick_ns: u64) -> MachineDevice {
    let name = entry.name.value.trim().to_ascii_uppercase();
    let mut lines: Vec<(&'static str, String)> = vec![];
    let mut line = |role, name: &Located<String>| lines.push((role, name.value.trim().to_owned()));
    let kind = match &entry.kind {
        DeviceKind::Relay { output, input, .. } => {
            line("output", output);
            line("input", input);
            MachineKind::Relay
        }
        DeviceKind::Cylinder { extend, retract, extended, retracted, .. } => {
            line("extend", extend);
            for (role, name) in
                [("retract", retract), ("extended", extended), ("retracted", retracted)]
            {
                name.iter().for_each(|name| line(role, name));
            }
            MachineKind::Cylinder
        }
        DeviceKind::Turret { output, reverse, stations, station_time, code, strobe, .. } => {
            line("output", output);
            reverse.iter().for_each(|name| line("reverse", name));
            match code {
                TurretCode::None => {}
                TurretCode::Number(name) => line("code", name),
                TurretCode::Bits(names) => names.iter().for_each(|name| line("code", name)),
            }
            strobe.iter().for_each(|name| line("strobe", name));
            let step = ticks(*station_time, tick_ns).max(2);
            MachineKind::Turret { stations: (*stations).max(1), step }
        }
        DeviceKind::Pump { output, input, on, off, .. } => {
            line("output", output);
            line("input", input);
            MachineKind::Pump { on: *on, off: *off }
        }
        DeviceKind::Switch { input, .. } => {
            line("input", input);
            MachineKind::Switch
        }
    };
    MachineDevice { at: format!("SIM.{name}"), jam: format!("KEY.JAM {name}"), kind, lines, name }
}

#[cfg(test)]
mod tests {
    use super::Reading;

    #[test]
    fn two_words_make_a_number_with_a_sign() {
        let reading = Reading { names: vec!["RH100".into(), "RH101".into()], scale: 1000.0 };
        let words = |low: f64, high: f64| {
            reading.value(move |name| Some(if name == "RH100" { low } else { high }))
        };
        assert_eq!(words(500.0, 1.0), Some(66.036));
        // Words may be shown with a sign or without.
        assert_eq!((words(65_535.0, 65_535.0), words(-1.0, -1.0)), (Some(-0.001), Some(-0.001)));
        assert_eq!(reading.value(|_| None), None);
        assert_eq!(Reading::of("X").value(|_| Some(2.5)), Some(2.5));
    }
}
