//! One run of the simulator.

use std::sync::Arc;

use plcc_abi::Dialect;
use serde::{Deserialize, Serialize};

use crate::access::{Access, Handle};
use crate::context::{Context, MAX_TOLD};
use crate::device::{Device, DeviceState, Surroundings};
use crate::equipment::{Equipment, equipment};
use crate::event::{Awaited, Refusal, Requested, Told};
use crate::keys::{Action, Key, keys};
use crate::nct::{self, Fault, Nct};
use crate::pmi::{self, Pmi};
use crate::setup::Setup;

/// What is done about a name of the table that is not there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Strictness {
    /// It is an error.
    Refuse,
    /// Its device or key is switched off, with a note.
    SwitchOff,
}

/// The control, where the language has one.
#[derive(Clone, Debug)]
enum Control {
    None,
    Pmi(Box<Pmi>),
    Nct(Box<Nct>),
}

/// What a control remembers.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
enum ControlState {
    None,
    Pmi(Box<pmi::State>),
    Nct(Box<nct::State>),
}

/// All that a simulator remembers from tick to tick.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct State {
    /// The number of the next tick.
    tick: u64,
    /// What was told in ticks that were skipped.
    told: Vec<Told>,
    control: ControlState,
    devices: Vec<DeviceState>,
    /// For each key the tick in which it was first pressed in vain.
    vain: Vec<Option<u64>>,
}

/// A simulator: what never changes in a run, and what it remembers.
#[derive(Clone, Debug)]
pub struct Simulator {
    setup: Arc<Setup>,
    tick_ns: u64,
    control: Control,
    devices: Vec<Device>,
    keys: Vec<Key>,
    /// What it writes.
    writes: Vec<Handle>,
    state: State,
}

impl Simulator {
    /// A simulator at power-up, for ticks of `tick_ns` nanoseconds. Gives it with notes about what is switched off.
    ///
    /// # Errors
    /// Everything of the table that does not fit the program, with the lines.
    pub fn new(
        setup: Arc<Setup>,
        tick_ns: u64,
        access: &mut dyn Access,
        strictness: Strictness,
    ) -> Result<(Self, Vec<String>), Vec<String>> {
        let control = match setup.rules.dialect {
            Dialect::Pmi => Control::Pmi(Box::new(Pmi::new(Arc::clone(&setup), tick_ns, access))),
            Dialect::Nct => Control::Nct(Box::new(Nct::new(Arc::clone(&setup), tick_ns, access))),
            _ => Control::None,
        };
        let mut writes = match &control {
            Control::None => vec![],
            Control::Pmi(control) => control.writes(),
            Control::Nct(control) => control.writes(),
        };
        let mut wrong = vec![];
        let mut devices = vec![];
        for entry in &setup.table.devices {
            let made = Device::new(entry, &setup, tick_ns, access).and_then(|device| {
                let own = device.writes();
                let overlaps = |handle: &Handle, others: &[Handle]| {
                    others.iter().any(|other| access.overlap(*handle, *other))
                };
                let within = own.iter().zip(1..).any(|(handle, rest)| {
                    own.get(rest..).is_some_and(|others| overlaps(handle, others))
                });
                if within || own.iter().any(|handle| overlaps(handle, &writes)) {
                    let line = entry.name.line;
                    let what = "writes what the control, another device or another line of it writes; \
                                give it an input of its own";
                    return Err(format!("line {line}: {} {what}", device.name));
                }
                Ok(device)
            });
            match made {
                Ok(device) => {
                    writes.extend(device.writes());
                    devices.push(device);
                }
                Err(why) => {
                    let name = &entry.name.value;
                    wrong.push(match strictness {
                        Strictness::Refuse => why,
                        Strictness::SwitchOff => {
                            format!("the device {name} is switched off: {why}")
                        }
                    });
                    devices.push(Device::off(entry));
                }
            }
        }
        let names: Vec<String> = devices.iter().map(|device| device.name.clone()).collect();
        let keys = keys(&setup, &names, access, &mut wrong);
        if strictness == Strictness::Refuse && !wrong.is_empty() {
            return Err(wrong);
        }
        let state = State {
            tick: 0,
            told: Vec::with_capacity(MAX_TOLD),
            control: match &control {
                Control::None => ControlState::None,
                Control::Pmi(control) => ControlState::Pmi(Box::new(control.at_power_up(tick_ns))),
                Control::Nct(control) => ControlState::Nct(Box::new(control.at_power_up(tick_ns))),
            },
            devices: devices.iter().map(Device::at_rest).collect(),
            vain: vec![None; keys.len()],
        };
        Ok((Self { setup, tick_ns, control, devices, keys, writes, state }, wrong))
    }

    /// What it writes.
    pub fn writes(&self) -> &[Handle] {
        &self.writes
    }

    /// The length of a tick in nanoseconds.
    pub fn tick_ns(&self) -> u64 {
        self.tick_ns
    }

    /// The language of the program.
    pub fn dialect(&self) -> Dialect {
        self.setup.rules.dialect
    }

    /// The keys, by whose numbers [`key`](Self::key) presses them.
    pub fn keys(&self) -> &[Key] {
        &self.keys
    }

    /// What there is to be seen of the machine. `name_of` gives the name of a variable.
    pub fn equipment(&self, name_of: &dyn Fn(Handle) -> String) -> Equipment {
        equipment(self, &self.setup, name_of)
    }

    /// The names of the devices, by whose numbers [`device`](Self::device) shows them.
    pub fn devices(&self) -> impl Iterator<Item = &str> {
        self.devices.iter().map(|device| device.name.as_str())
    }

    /// The inputs that devices write: the number of the device, the key of the table that names the input, and the input.
    pub fn feedbacks(&self) -> Vec<(usize, &'static str, Handle)> {
        let of = |(number, device): (usize, &Device)| {
            let own = device.feedbacks().into_iter();
            own.map(move |(key, handle)| (number, key, handle))
        };
        self.devices.iter().enumerate().flat_map(of).collect()
    }

    /// The line of the block that is executed (`SIM.LINE`).
    pub fn line(&self) -> i64 {
        match (&self.control, &self.state.control) {
            (Control::Pmi(control), ControlState::Pmi(state)) => control.line(state),
            (Control::Nct(control), ControlState::Nct(state)) => control.line(state),
            _ => 0,
        }
    }

    /// What is shown of a device (`SIM.name`).
    pub fn device(&self, number: usize) -> i64 {
        let found = self.devices.get(number).zip(self.state.devices.get(number));
        found.map_or(0, |(device, state)| device.shown(state))
    }

    /// Presses or lets go a key, as a row of the stimulus in front of the next step.
    pub fn key(&mut self, number: usize, value: i64, access: &mut dyn Access) {
        let Some(key) = self.keys.get(number) else { return };
        let is_selected =
            key.selected.is_empty() || key.selected.iter().any(|flag| flag.is_on(access));
        if value != 0 && !is_selected {
            if let Some(vain) = self.state.vain.get_mut(number) {
                vain.get_or_insert(self.state.tick);
            }
            return;
        }
        let pressed = value != 0;
        match (key.action, &mut self.state.control) {
            (Action::Row(handle), _) => access.row(handle, value),
            (Action::Jam(device), _) => {
                if let Some(device) = self.state.devices.get_mut(device) {
                    device.jammed = pressed;
                }
            }
            (Action::Enter(entry), ControlState::Nct(state)) if pressed => state.enter(entry),
            (Action::Fail(kind, axis), ControlState::Nct(state)) if pressed => {
                state.fail(match kind {
                    0 => Fault::Servo(axis),
                    1 => Fault::Encoder(axis),
                    _ => Fault::Feedback(axis),
                });
            }
            (Action::Answer, ControlState::Nct(state)) if pressed => state.answer(),
            (Action::Touch(window, button), ControlState::Pmi(state)) => {
                state.touch_key(window, button, pressed, self.state.tick);
            }
            (Action::Enter(_) | Action::Fail(..) | Action::Answer | Action::Touch(..), _) => {}
        }
    }

    /// Does the step of a tick: the control, then the devices in their order. What is told of it waits until
    /// [`take_told`](Self::take_told).
    pub fn step(&mut self, access: &mut dyn Access) {
        let State { tick, told, control, devices, .. } = &mut self.state;
        let mut now = Context { tick: *tick, tick_ns: self.tick_ns, access, told };
        let mut outputs_live = true;
        let positions: &[i128] = match (&mut self.control, control) {
            (Control::Pmi(control), ControlState::Pmi(state)) => {
                control.step(state, &mut now);
                state.actual()
            }
            (Control::Nct(control), ControlState::Nct(state)) => {
                control.step(state, &mut now);
                outputs_live = state.is_machine_on();
                state.actual()
            }
            _ => &[],
        };
        let around = Surroundings { outputs_live, positions };
        for (device, state) in self.devices.iter().zip(devices) {
            device.step(state, &around, now.access);
        }
        *tick = tick.saturating_add(1);
    }

    /// What was told since this was called last.
    pub fn take_told(&mut self) -> impl Iterator<Item = Told> {
        self.state.told.drain(..)
    }

    /// What the serial line has sent since this was called last, a record for each time that it was told (NCT).
    pub fn take_sent(&mut self) -> Vec<Vec<u8>> {
        match &mut self.state.control {
            ControlState::Nct(state) => state.take_sent(),
            _ => vec![],
        }
    }

    /// The name of a code that the program declares, with its `@`.
    pub fn code_name(&self, code: u16) -> String {
        let code = self.setup.rules.codes.get(usize::from(code));
        code.map_or_else(String::new, |code| code.name())
    }

    /// How many codes the program declares.
    pub fn code_count(&self) -> usize {
        self.setup.rules.codes.len()
    }

    /// What a request is called in an event.
    pub fn request_name(&self, requested: Requested) -> String {
        match requested {
            Requested::CycleStart => "CYCLE START".into(),
            Requested::Jog(axis) => format!("JOG {}", self.axis_name(axis)),
        }
    }

    /// What a refusal is called in an event.
    pub fn refusal_name(&self, refusal: Refusal) -> &'static str {
        refusal.name()
    }

    /// What an axis is called: its letter, or its number.
    pub fn axis_name(&self, axis: u8) -> String {
        let name = self.setup.axes.get(usize::from(axis)).and_then(|axis| axis.name);
        name.map_or_else(|| axis.to_string(), String::from)
    }

    /// What is awaited, as an event calls it.
    pub fn awaited_name(&self, awaited: Awaited) -> String {
        match awaited {
            Awaited::Code(code) => self.code_name(code),
            Awaited::SpindleSpeed => "@NEWSC".into(),
            Awaited::Finished => "Y547".into(),
            Awaited::Feed => "Y650".into(),
            Awaited::Axis(axis) => format!("Y61{axis}"),
        }
    }

    /// What is to be told when the run has ended: what a block still waits for, and keys that were pressed in vain.
    pub fn notes(&self) -> Vec<String> {
        let mut notes = vec![];
        let waits = match (&self.control, &self.state.control) {
            (Control::Pmi(control), ControlState::Pmi(state)) => control.waits(state),
            (Control::Nct(control), ControlState::Nct(state)) => control.waits(state),
            _ => None,
        };
        if let Some((awaited, line)) = waits {
            let place = match line {
                line if line < 0 => format!("the entered block {}", -line),
                line => format!("line {line} of the part program"),
            };
            notes.push(format!("{place} still waits for {}", self.awaited_name(awaited)));
        }
        for (key, vain) in self.keys.iter().zip(&self.state.vain) {
            if let Some(tick) = vain {
                let selections = key.selections.join(" and ");
                notes.push(format!(
                    "KEY.{} did nothing in tick {tick}: the program does not select it by {selections}",
                    key.name
                ));
            }
        }
        notes
    }

    /// What it remembers.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// Goes on with another state. Returns whether that fits; if not, nothing is changed.
    pub fn set_state(&mut self, mut state: State) -> bool {
        let fits = match (&state.control, &self.state.control) {
            (ControlState::None, ControlState::None) => true,
            (ControlState::Pmi(state), ControlState::Pmi(own)) => state.fits(own),
            (ControlState::Nct(state), ControlState::Nct(own)) => state.fits(own),
            _ => false,
        };
        let lengths = |state: &State| (state.devices.len(), state.vain.len());
        if !fits || lengths(&state) != lengths(&self.state) || state.told.len() > MAX_TOLD {
            return false;
        }
        let missing = MAX_TOLD.saturating_sub(state.told.len());
        state.told.reserve(missing);
        if let ControlState::Pmi(control) = &mut state.control {
            control.reserve(self.setup.rules.codes.len());
        }
        self.state = state;
        true
    }

    /// Goes on as the simulator of another version of the program, from whose keys those of this one may differ. Nothing is
    /// allocated: the two exchange what they remember.
    pub fn take_over(&mut self, old: &mut Self) {
        let fits = match (&old.state.control, &self.state.control) {
            (ControlState::None, ControlState::None) => true,
            (ControlState::Pmi(state), ControlState::Pmi(own)) => state.fits(own),
            (ControlState::Nct(state), ControlState::Nct(own)) => state.fits(own),
            _ => false,
        };
        if fits && old.state.devices.len() == self.state.devices.len() {
            std::mem::swap(&mut self.state, &mut old.state);
            self.state.vain.resize(self.keys.len(), None);
            old.state.vain.resize(old.keys.len(), None);
        }
    }
}
