//! Small machines: `[[simulator.device]]` (cnc-side 4).

mod cylinder;
mod line;
mod pump;
mod relay;
mod switch;
mod turret;

use plcc_abi::machine::simulator::{DeviceEntry, DeviceKind};
use serde::{Deserialize, Serialize};

use crate::access::{Access, Handle};
use crate::length::ticks;
use crate::setup::Setup;
use cylinder::Cylinder;
use pump::Pump;
use relay::Relay;
use switch::Switch;
use turret::Turret;

pub(crate) use line::Line;

/// What devices see of the control in a step.
pub(crate) struct Surroundings<'a> {
    /// Whether physical outputs have power.
    pub(crate) outputs_live: bool,
    /// The actual positions of the axes, in nanometres.
    pub(crate) positions: &'a [i128],
}

/// A small machine.
#[derive(Clone, Debug)]
pub(crate) struct Device {
    pub(crate) name: String,
    kind: Kind,
}

#[derive(Clone, Debug)]
enum Kind {
    Relay(Relay),
    Cylinder(Cylinder),
    Turret(Turret),
    Pump(Pump),
    Switch(Switch),
    /// One of whose names is gone after an online change.
    Off,
}

/// What a device remembers.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct DeviceState {
    /// Whether a key holds it where it is.
    pub(crate) jammed: bool,
    /// Where it is: a relay 0 or 1, a stroke or a pressure in parts of the whole, an angle in ticks.
    at: u64,
    /// The coils as the step before saw them.
    coils: [bool; 2],
    /// For how many steps a relay has differed from its coil, if it does.
    differs: Option<u64>,
    /// Whether a pump's switch is closed.
    closed: bool,
}

impl Device {
    /// Makes a device of its entry.
    ///
    /// # Errors
    /// A name that is not there or does not fit, with its line.
    pub(crate) fn new(
        entry: &DeviceEntry,
        setup: &Setup,
        tick_ns: u64,
        access: &mut dyn Access,
    ) -> Result<Self, String> {
        let ticks = |time: u64| ticks(time, tick_ns);
        let kind = match &entry.kind {
            DeviceKind::Relay { output, input, on, off } => Kind::Relay(Relay {
                output: Line::output(access, output)?,
                input: Line::input(access, input)?,
                on: ticks(*on),
                off: ticks(*off),
            }),
            DeviceKind::Cylinder {
                extend,
                retract,
                extended,
                retracted,
                extend_time,
                retract_time,
            } => Kind::Cylinder(Cylinder {
                extend: Line::output(access, extend)?,
                retract: retract.as_ref().map(|name| Line::output(access, name)).transpose()?,
                extended: extended.as_ref().map(|name| Line::input(access, name)).transpose()?,
                retracted: retracted.as_ref().map(|name| Line::input(access, name)).transpose()?,
                extend_ticks: ticks(*extend_time).max(1),
                retract_ticks: ticks(*retract_time).max(1),
            }),
            DeviceKind::Turret { .. } => Kind::Turret(Turret::new(&entry.kind, tick_ns, access)?),
            DeviceKind::Pump { output, input, rise, fall, on, off } => Kind::Pump(Pump {
                output: Line::output(access, output)?,
                input: Line::input(access, input)?,
                rise: ticks(*rise).max(1),
                fall: ticks(*fall).max(1),
                on: *on,
                off: *off,
            }),
            DeviceKind::Switch { axis, from, to, input } => {
                Kind::Switch(Switch::new(axis, (*from, *to), input, setup, access)?)
            }
        };
        Ok(Self { name: entry.name.value.trim().to_ascii_uppercase(), kind })
    }

    /// A device that does nothing.
    pub(crate) fn off(entry: &DeviceEntry) -> Self {
        Self { name: entry.name.value.trim().to_ascii_uppercase(), kind: Kind::Off }
    }

    /// The state at power-up.
    pub(crate) fn at_rest(&self) -> DeviceState {
        let at = match &self.kind {
            Kind::Turret(turret) => turret.first(),
            _ => 0,
        };
        DeviceState { at, ..DeviceState::default() }
    }

    /// What it writes, each with the key of the table that names it.
    pub(crate) fn feedbacks(&self) -> Vec<(&'static str, Handle)> {
        let lines: Vec<(&'static str, Option<&Line>)> = match &self.kind {
            Kind::Relay(relay) => vec![("input", Some(&relay.input))],
            Kind::Cylinder(cylinder) => vec![
                ("extended", cylinder.extended.as_ref()),
                ("retracted", cylinder.retracted.as_ref()),
            ],
            Kind::Turret(turret) => turret.inputs(),
            Kind::Pump(pump) => vec![("input", Some(&pump.input))],
            Kind::Switch(switch) => vec![("input", Some(&switch.input))],
            Kind::Off => vec![],
        };
        lines.into_iter().filter_map(|(key, line)| Some((key, line?.handle()))).collect()
    }

    /// What it writes.
    pub(crate) fn writes(&self) -> Vec<Handle> {
        self.feedbacks().into_iter().map(|(_, handle)| handle).collect()
    }

    /// Does a step.
    pub(crate) fn step(
        &self,
        state: &mut DeviceState,
        around: &Surroundings<'_>,
        access: &mut dyn Access,
    ) {
        match &self.kind {
            Kind::Relay(relay) => relay.step(state, around, access),
            Kind::Cylinder(cylinder) => cylinder.step(state, around, access),
            Kind::Turret(turret) => turret.step(state, around, access),
            Kind::Pump(pump) => pump.step(state, around, access),
            Kind::Switch(switch) => switch.step(state, around, access),
            Kind::Off => {}
        }
    }

    /// What is shown of it: a cylinder and a pump 0 to 1000, a turret its angle in ticks, relay and switch 0 or 1.
    pub(crate) fn shown(&self, state: &DeviceState) -> i64 {
        let whole = match &self.kind {
            Kind::Cylinder(cylinder) => cylinder.stroke(),
            Kind::Pump(pump) => pump.whole(),
            _ => return state.at as i64,
        };
        (u128::from(state.at) * 1000 / u128::from(whole.max(1))) as i64
    }
}
