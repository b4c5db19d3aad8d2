//! An executive with the other side beside it (`--simulate`): [`SimulatedExecutive`].
//!
//! It has an executive of any language do the ticks, and in front of each a step of the [`Simulator`]. The executive
//! knows nothing of it, so that nothing is paid where nothing is simulated.

mod bits;
mod events;
mod executive;
mod names;
mod slots;

use std::sync::Arc;

use plcc_abi::{DialectVariable, SimulatorVariable};
use plcc_simulator::{Handle, Setup, Simulator, Strictness};
use serde::{Deserialize, Serialize};

use crate::event::{Event, EventBody};
use crate::executive::Executive;
use crate::value::Value;
use crate::variable::{Setting, VariableKey};

use events::EventTexts;
use names::SimulatedNames;
use slots::{Bound, Remembered, Slots};

/// An input that a small machine writes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Feedback {
    /// The name of the small machine.
    pub device: String,
    /// The key of the table that names the input, such as `extended`.
    pub role: &'static str,
    /// The input.
    pub name: String,
}

/// An executive whose machine is simulated.
pub struct SimulatedExecutive {
    inner: Box<dyn Executive + Send>,
    simulator: Simulator,
    slots: Slots,
    names: Arc<SimulatedNames>,
    texts: EventTexts,
    /// The number of the next tick.
    tick: u64,
}

/// What a checkpoint holds besides that of the executive.
#[derive(Serialize, Deserialize)]
struct State {
    tick: u64,
    simulator: plcc_simulator::State,
    slots: Remembered,
}

impl SimulatedExecutive {
    /// Puts the simulator of a setup beside an executive at power-up. Gives it with notes about what is switched off.
    ///
    /// # Errors
    /// Everything of the table that does not fit the program, with the lines.
    pub fn new(
        mut inner: Box<dyn Executive + Send>,
        setup: &Arc<Setup>,
        strictness: Strictness,
    ) -> Result<(Self, Vec<String>), Vec<String>> {
        let tick_ns = inner.tick_ns();
        let names = inner.names();
        let mut slots = Slots::new(names.clone());
        let mut bound = Bound { slots: &mut slots, executive: inner.as_mut() };
        let made = Simulator::new(Arc::clone(setup), tick_ns, &mut bound, strictness);
        let (simulator, notes) = made?;
        let keys = simulator.keys().iter().map(|key| key.name.clone()).collect();
        let devices = simulator.devices().map(str::to_owned).collect();
        let written = simulator.writes().iter().filter_map(|handle| slots.found(*handle)).collect();
        let equipment = simulator.equipment(&|handle| slots.name(handle));
        let names = SimulatedNames::new(names, keys, devices, &simulator, written, equipment);
        let names = Arc::new(names);
        let texts = EventTexts::new(&simulator);
        Ok((Self { inner, simulator, slots, names, texts, tick: 0 }, notes))
    }

    /// The inputs that small machines write.
    pub fn feedbacks(&self) -> Vec<Feedback> {
        let devices: Vec<&str> = self.simulator.devices().collect();
        let feedback = |(device, role, handle): (usize, &'static str, Handle)| Feedback {
            device: devices.get(device).map_or_else(String::new, |name| (*name).to_owned()),
            role,
            name: self.slots.name(handle),
        };
        self.simulator.feedbacks().into_iter().map(feedback).collect()
    }

    /// Breaks the feedback with a number of [`feedbacks`](Self::feedbacks): from now on it has this value, whatever the small
    /// machine does. A row of a stimulus still counts for its tick.
    pub fn stick(&mut self, feedback: usize, value: i64) {
        if let Some((.., handle)) = self.simulator.feedbacks().get(feedback) {
            self.slots.stick(*handle, value);
        }
    }

    /// Does the step of a tick.
    fn step(&mut self) {
        let mut bound = Bound { slots: &mut self.slots, executive: self.inner.as_mut() };
        self.simulator.step(&mut bound);
        self.slots.end_tick();
    }

    /// Tells what the simulator has told, as events of this tick.
    fn tell(&mut self, events: &mut Vec<Event>) {
        let tick = self.tick;
        let mut sent = self.simulator.take_sent().into_iter();
        for told in self.simulator.take_told() {
            let body = EventBody::Simulator(self.texts.event(told, &mut sent));
            events.push(Event { tick, body });
        }
    }

    /// The value of a name of the simulator.
    fn own_value(&self, variable: SimulatorVariable) -> Value {
        Value::Int(match variable {
            SimulatorVariable::Line => self.simulator.line(),
            SimulatorVariable::Device(device) => self.simulator.device(device as usize),
            SimulatorVariable::Key(_) => 0,
        })
    }

    fn set(&mut self, variable: VariableKey, value: Setting) {
        match variable.0 {
            DialectVariable::Simulator(SimulatorVariable::Key(key)) => {
                let mut bound = Bound { slots: &mut self.slots, executive: self.inner.as_mut() };
                self.simulator.key(key as usize, value.integer(), &mut bound);
            }
            DialectVariable::Simulator(_) => {}
            _ => {
                self.slots.row(variable, value, &*self.names);
                self.inner.write(variable, value);
            }
        }
    }
}
