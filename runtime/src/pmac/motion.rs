//! The simulated motors, coordinate systems and motion programs of a PMAC, as the executive uses them (`--simulate`).

use std::sync::Arc;

use plcc_abi::image::{read_u32, write_u32};
use plcc_abi::pmac::motion::registers::motors;
use plcc_abi::pmac::motion::{MotionName, Plant};
use plcc_abi::pmac::{
    COMMAND_CONTEXT, Definition, MOTION_CONTEXT, Memory, PmacName, Run, View, fixed,
};
use plcc_abi::pmac::{Kind, Variable};
use plcc_abi::{DialectVariable, Engine, ResumePoint};
use plcc_motion::{Machine, MotionEvent, Next, ProgramState, Setup};

use super::PmacExecutive;
use super::host::{PmacHost, PreparedStep};
use crate::motion_report::MotionReport;
use crate::stop::Stop;
use crate::{DeferredAssignment, Event, EventBody, VariableKey};

/// What the executive keeps for the simulation apart from its state.
pub(super) struct Motion {
    pub(super) setup: Setup,
    /// What has happened and is not yet an event.
    pub(super) events: Vec<MotionEvent>,
    /// The coordinate system whose motion program runs, from 1; 0 while none does.
    pub(super) running: u32,
    /// The names of the source's files.
    files: Vec<Arc<str>>,
    words: Words,
}

/// The words of reports, so that making one allocates nothing.
#[derive(Default)]
struct Words(Vec<Arc<str>>);

impl Words {
    fn all() -> Self {
        let errors = plcc_motion::Error::ALL.into_iter().map(plcc_motion::Error::code);
        let reasons = plcc_motion::Reason::ALL.into_iter().map(plcc_motion::Reason::name);
        let states = ProgramState::ALL.into_iter().map(ProgramState::name);
        Self(errors.chain(reasons).chain(states).map(Into::into).collect())
    }

    fn of(&self, word: &str) -> Arc<str> {
        self.0.iter().find(|own| ***own == *word).cloned().unwrap_or_else(|| word.into())
    }
}

impl PmacHost {
    /// Does something with the simulation, and reports what happened. `None` where motion is not simulated.
    pub(super) fn with_motion<T>(
        &mut self,
        image: &mut [u8],
        act: impl FnOnce(&mut Machine<'_>) -> T,
    ) -> Option<T> {
        let (Some(motion), Some(state)) = (&mut self.motion, &mut self.state.motion) else {
            return None;
        };
        let memory = Memory { image, layout: &self.layout, sparse: &mut self.state.sparse };
        let mut machine = Machine {
            state,
            setup: &motion.setup,
            tables: &self.tables.motion,
            memory,
            events: &mut motion.events,
        };
        let result = act(&mut machine);
        if !motion.events.is_empty() {
            self.report_motion();
        }
        Some(result)
    }

    /// Makes events of what happened.
    fn report_motion(&mut self) {
        let Some(motion) = &mut self.motion else { return };
        for event in motion.events.drain(..) {
            let report = match event {
                MotionEvent::Refused { text, motor, system, error } => {
                    let error = motion.words.of(error.code());
                    MotionReport::Refused { text, motor, system, error }
                }
                MotionEvent::Answer { text } => MotionReport::Answer { text },
                MotionEvent::Program { system, program, state, reason, place } => {
                    let place = place.filter(|_| state != ProgramState::Started);
                    let stopped = matches!(state, ProgramState::Stopped | ProgramState::Error);
                    let reason = reason.filter(|_| stopped);
                    MotionReport::Program {
                        system,
                        program,
                        state: motion.words.of(state.name()),
                        reason: reason.map(|reason| motion.words.of(reason.name())),
                        file: place.and_then(|(file, _)| motion.files.get(file as usize).cloned()),
                        line: place.map(|(_, line)| line),
                    }
                }
                MotionEvent::Home { motor } => MotionReport::Home { motor },
                MotionEvent::SyncOverflow { system } => {
                    self.notes.push(format!(
                        "coordinate system {system}: more than 1024 synchronous assignments wait; further \
                         ones are done at once"
                    ));
                    continue;
                }
            };
            self.events.push(Event { tick: self.state.tick, body: EventBody::Motion(report) });
        }
    }

    /// Shows `see` the synchronous assignments that the last tick has carried out.
    pub(super) fn each_synchronous_assignment(&self, see: &mut dyn FnMut(DeferredAssignment<'_>)) {
        let (Some(motion), Some(state)) = (&self.motion, &self.state.motion) else { return };
        for assigned in state.carried_out() {
            let variable = Variable { kind: Kind::M, number: assigned.number, system: 1 };
            let variable = VariableKey(DialectVariable::Pmac(PmacName::Variable(variable)));
            if let Some(file) = motion.files.get(assigned.file as usize) {
                see(DeferredAssignment { variable, file, line: assigned.line });
            }
        }
    }

    /// The machine, for reading.
    pub(super) fn read_motion(&self, image: &[u8], name: MotionName) -> f64 {
        let (Some(motion), Some(state)) = (&self.motion, &self.state.motion) else { return 0.0 };
        let view = View { image, layout: &self.layout, sparse: &self.state.sparse };
        plcc_motion::read(state, &motion.setup, &self.tables.motion, view, name)
    }
}

impl PmacExecutive {
    /// Simulates the motors and coordinate systems of the control from power-up on. `plants` are the motors of
    /// which the machine file says something.
    ///
    /// # Errors
    /// When the controller does not have one of the motors.
    pub fn simulate(&mut self, plants: &[Plant]) -> Result<(), String> {
        let last = motors(self.host.layout.controller);
        if let Some(plant) = plants.iter().find(|plant| u32::from(plant.number) > last) {
            let number = plant.number;
            return Err(format!(
                "[[simulator.motor]] number {number}: this controller has motors 1 to {last}"
            ));
        }
        let tables = &self.host.tables.motion;
        Run::unpack(&tables.image, &mut self.image);
        self.host.state.sparse = tables.sparse.clone();
        let setup = Setup::new(&self.host.layout, plants, tables, &self.host.tables.ranges);
        self.host.state.motion = Some(Box::new(plcc_motion::State::new(&setup, tables)));
        let files = self.files.iter().map(|file| file.as_str().into()).collect();
        let events = Vec::with_capacity(64);
        self.host.motion = Some(Motion { setup, events, running: 0, files, words: Words::all() });
        self.host.prepare_texts();
        self.host.with_motion(&mut self.image, |machine| machine.start());
        self.power_up_events.clone_from(&self.host.events);
        self.names = Arc::new(super::names::PmacNames::simulated(&self.host.tables, plants));
        Ok(())
    }

    /// Whether motion is simulated.
    pub(super) fn simulates(&self) -> bool {
        self.host.motion.is_some()
    }

    /// The servo cycle of the simulation.
    pub(super) fn servo(&mut self) {
        if !self.simulates() {
            return;
        }
        self.host.with_motion(&mut self.image, |machine| machine.servo());
        // Inputs that are forced have their values before anything looks at them.
        self.apply_forces();
        self.host.with_motion(&mut self.image, |machine| machine.finish_servo());
    }

    /// Notes that a row of the stimulus, or somebody else, has set bits of a word, which the plant leaves alone in this
    /// tick.
    pub(super) fn hold_bits(&mut self, name: PmacName) {
        if !self.simulates() {
            return;
        }
        let (space, address, field) = match self.field(name) {
            Some(Definition::X { address, field }) => (plcc_abi::pmac::Space::X, address, field),
            Some(Definition::Y { address, field }) => (plcc_abi::pmac::Space::Y, address, field),
            _ => return,
        };
        if let plcc_abi::pmac::Place::Word(offset) = self.host.layout.place(space, address)
            && let Some(state) = &mut self.host.state.motion
        {
            let mask = fixed::insert_field(0, field, u32::MAX);
            state.overlay(offset, mask, read_u32(&self.image, offset));
        }
    }

    /// The first coordinate system from a number on whose flag is set.
    fn wanted_calculation(&self, from: u32) -> Option<u32> {
        self.host.state.motion.as_ref()?.wanted_calculation(from)
    }

    /// The calculations of all coordinate systems whose flags are set.
    pub(super) fn calculate(&mut self, engine: &mut dyn Engine) -> Result<(), Stop> {
        if !self.simulates() {
            return Ok(());
        }
        let mut from = 1;
        while let Some(system) = self.wanted_calculation(from) {
            from = system + 1;
            let begin = |machine: &mut Machine<'_>| machine.begin_calculation(system);
            let Some(mut next) = self.host.with_motion(&mut self.image, begin) else { continue };
            if next == Next::Done {
                continue;
            }
            let q_base = self.host.layout.q_base_of(system);
            write_u32(&mut self.image, self.host.layout.q_base_at(MOTION_CONTEXT), q_base);
            if let Some(motion) = &mut self.host.motion {
                motion.running = system;
            }
            while let Next::Run { task, point } = next {
                let point = ResumePoint(point);
                let at = self.run(MOTION_CONTEXT, task as usize, Some(point), engine)?;
                // A program's text ends in a RETURN, which suspends it.
                let at = at.map_or(u32::MAX, |point| point.0);
                let after = |machine: &mut Machine<'_>| machine.after(at);
                next = self.host.with_motion(&mut self.image, after).unwrap_or(Next::Done);
            }
            if let Some(motion) = &mut self.host.motion {
                motion.running = 0;
            }
        }
        self.host.with_motion(&mut self.image, |machine| machine.show_status());
        Ok(())
    }

    /// The commands that were queued, from PLCs and motion programs, in order.
    pub(super) fn do_commands(&mut self, engine: &mut dyn Engine) -> Result<(), Stop> {
        while let Some(command) = self.host.state.queue.pop_front() {
            let layout = self.host.layout;
            write_u32(&mut self.image, layout.q_base_at(COMMAND_CONTEXT), command.q_base);
            let block = layout.count / layout.systems();
            let mut system = command.q_base / block + 1;
            let mut motor = command.motor.max(1);
            for index in 0.. {
                match self.host.step(command.text, index) {
                    // On-line commands have no WHILE, so they always come to their end.
                    Some(PreparedStep::Task(task)) => {
                        self.run(COMMAND_CONTEXT, task as usize, None, engine)?;
                    }
                    Some(PreparedStep::Motion(command)) => {
                        self.host.with_motion(&mut self.image, |machine| {
                            machine.command(command, &mut motor, &mut system);
                        });
                    }
                    None => break,
                }
            }
        }
        Ok(())
    }
}
