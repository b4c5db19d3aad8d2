//! The executive of PMAC: servo cycle, timers, real-time interrupt, background rotation, the
//! commands ENABLE, DISABLE, PAUSE and RESUME, the COMMAND queue, and access to memory through
//! definitions that are known only at run time (guide, PMAC Tasks and PLC Programs; rulings, Time).
//!
//! A base tick is one servo cycle. `tick` says in which order things happen in it, `host` what
//! program code may ask for meanwhile, `names` what users call things.

mod carry_over;
mod equipment;
mod forces;
mod host;
mod motion;
mod names;
mod outputs;
mod plant;
mod save;
mod state;
#[cfg(test)]
mod tests;
mod tick;
mod transfer;
mod validate;
mod watchdog;

use std::any::Any;
use std::ops::Range;
use std::sync::Arc;
use std::time::Duration;

use plcc_abi::{
    Engine, Program, Tables,
    image::{read_f64, write_f64},
    pmac::{
        Definition, Definitions, DirectAccess, Kind, Layout, Memory, PmacName, Run,
        Variable as Named, View, arithmetic::finite, layout,
    },
};

use crate::aliased_names::with_given;
use crate::checkpoint::{CheckpointError, ProgramIdentity, without, write_state};
use crate::clock_decisions::ClockDecisions;
use crate::names::Names;
use crate::online_change::{Plan, TakeOver};
use crate::safe_outputs::SafeLines;
use crate::watchdog::Watchdog;
use crate::{
    ClockDecision, DeferredAssignment, Event, Executive, Restored, Setting, Stop, TaskStatus,
    Value, VariableKey,
};
pub use plant::not_simulated;

use host::PmacHost;
use names::PmacNames;
use state::{State, Status};
use tick::Clocks;
use watchdog::WatchdogTimer;

/// What can be chosen for a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PmacOptions {
    /// Background steps a servo cycle.
    pub background_steps: u32,
    /// Whether ticks are paced by the clock, so that the watchdog watches.
    pub realtime: bool,
}

impl Default for PmacOptions {
    fn default() -> Self {
        Self { background_steps: 1, realtime: false }
    }
}

/// A PMAC, from power-up.
pub struct PmacExecutive {
    image: Vec<u8>,
    host: PmacHost,
    options: PmacOptions,
    watchdog: Option<WatchdogTimer>,
    identity: ProgramIdentity,
    decisions: ClockDecisions,
    clocks: Clocks,
    safe_lines: SafeLines,
    /// What limits the time of a single scan.
    scan_watchdog: Option<Watchdog>,
    /// The names of the source's files, for messages.
    files: Vec<String>,
    /// With the names that people gave.
    names: Arc<dyn Names>,
    /// What has happened at power-up, in front of tick 0.
    power_up_events: Vec<Event>,
}

impl PmacExecutive {
    /// An executive for a program; `None` when it is not for a PMAC.
    pub fn new(program: &Program, options: PmacOptions) -> Option<Self> {
        let Tables::Pmac(tables) = &program.tables else {
            return None;
        };
        let layout = Layout::new(tables.controller);
        let names = PmacNames::new(tables);
        let mut image = vec![0; layout.size.max(program.image_size) as usize];
        Run::unpack(&tables.initial, &mut image);
        Some(Self {
            image,
            safe_lines: names.all_off(),
            host: PmacHost::new(tables.clone(), layout),
            watchdog: options.realtime.then(WatchdogTimer::default),
            scan_watchdog: None,
            files: program.files.clone(),
            options,
            identity: ProgramIdentity::new(program),
            decisions: ClockDecisions::default(),
            clocks: Clocks::new(&layout),
            names: with_given(Arc::new(names), &program.names),
            power_up_events: Vec::new(),
        })
    }

    /// The image and the host of program code, for a call of an engine outside of ticks.
    pub fn parts(&mut self) -> (&mut [u8], &mut dyn plcc_abi::Host) {
        (&mut self.image, &mut self.host)
    }

    fn view(&self) -> View<'_> {
        View { image: &self.image, layout: &self.host.layout, sparse: &self.host.state.sparse }
    }

    fn memory(&mut self) -> Memory<'_> {
        let PmacHost { layout, state, .. } = &mut self.host;
        Memory { image: &mut self.image, layout, sparse: &mut state.sparse }
    }

    fn set_name(&mut self, name: PmacName, value: Setting) {
        let value = match value {
            Setting::Int(value) => value as f64,
            Setting::Float(value) => value,
        };
        match name {
            PmacName::Memory(definition) => {
                self.memory().write(definition, value);
                self.hold_bits(name);
            }
            PmacName::Motion(name) => {
                self.host.with_motion(&mut self.image, |machine| machine.set(name, value));
            }
            PmacName::Plc { compiled, number } => {
                if let Some(op) = names::plc_op(value) {
                    self.host.command_plcs(op, compiled, number, number);
                }
            }
            PmacName::Variable(Named { kind, number, system }) => {
                let layout = self.host.layout;
                match kind {
                    Kind::I => self.host.write_i(&mut self.image, number, value),
                    Kind::P => {
                        write_f64(&mut self.image, layout.p_offset(number), finite(value));
                    }
                    Kind::Q => {
                        let offset = layout.q_offset(layout.q_base_of(system) + number);
                        write_f64(&mut self.image, offset, finite(value));
                    }
                    Kind::M => {
                        self.memory().write_m(number, value);
                        self.hold_bits(name);
                    }
                    Kind::L => {
                        let definition = self.host.l_definition(number);
                        self.memory().write(definition, value);
                        self.hold_bits(name);
                    }
                }
            }
        }
    }

    fn value(&self, name: PmacName) -> Value {
        let layout = self.host.layout;
        Value::Float(match name {
            PmacName::Memory(definition) => self.view().read(definition),
            PmacName::Plc { compiled, number } => self.host.plc_status(compiled, number),
            PmacName::Motion(name) => self.host.read_motion(&self.image, name),
            PmacName::Variable(Named { kind, number, system }) => match kind {
                Kind::I => read_f64(&self.image, layout.i_offset(number)),
                Kind::P => read_f64(&self.image, layout.p_offset(number)),
                Kind::Q => {
                    read_f64(&self.image, layout.q_offset(layout.q_base_of(system) + number))
                }
                Kind::M => self.view().read_m(number),
                Kind::L => self.view().read(self.host.l_definition(number)),
            },
        })
    }

    /// Where in memory a variable is now; `None` for one that is a value of its own.
    fn field(&self, name: PmacName) -> Option<Definition> {
        match name {
            PmacName::Memory(definition) => Some(definition),
            PmacName::Variable(Named { kind: Kind::M, number, .. }) => {
                Some(self.view().definition(number))
            }
            PmacName::Variable(Named { kind: Kind::L, number, .. }) => {
                Some(self.host.l_definition(number))
            }
            PmacName::Variable(_) | PmacName::Plc { .. } | PmacName::Motion(_) => None,
        }
    }

    fn apply_forces(&mut self) {
        let PmacHost { layout, state, .. } = &mut self.host;
        let image = &mut self.image;
        state.forces.apply(&mut Memory { image, layout, sparse: &mut state.sparse });
    }
}

impl Executive for PmacExecutive {
    fn tick_ns(&self) -> u64 {
        (self.cycle_seconds() * 1e9).round().max(1.0) as u64
    }

    fn tick(&mut self, engine: &mut dyn Engine, events: &mut Vec<Event>) -> Result<(), Stop> {
        self.decisions.begin_tick();
        self.apply_forces();
        let result = self.servo_cycle(engine);
        self.apply_forces();
        if result.is_err() {
            self.drive_safe_outputs();
        }
        events.append(&mut self.host.events);
        self.host.state.tick += 1;
        result
    }

    fn skip_ticks(&mut self, count: u64) {
        self.skip_cycles(count);
        self.host.state.tick = self.host.state.tick.saturating_add(count);
    }

    fn names(&self) -> Arc<dyn Names> {
        Arc::clone(&self.names)
    }

    fn read(&self, key: VariableKey) -> Value {
        names::name(key).map_or(Value::Int(0), |name| self.value(name))
    }

    fn read_into(&self, key: VariableKey, value: &mut Value) {
        *value = self.read(key);
    }

    fn write(&mut self, key: VariableKey, value: Setting) {
        if let Some(name) = names::name(key) {
            self.set_name(name, value);
        }
    }

    fn force(&mut self, key: VariableKey, value: Option<Setting>) -> Result<(), &'static str> {
        let Some(name) = names::name(key) else { return Err("can't be forced") };
        let field = self.field(name);
        let forces = &mut self.host.state.forces;
        match value {
            Some(Setting::Int(value)) => forces.set(name, field, value as f64),
            Some(Setting::Float(value)) => forces.set(name, field, value),
            None => {
                forces.remove(name);
                Ok(())
            }
        }
    }

    fn each_force(&self, see: &mut dyn FnMut(VariableKey, Setting)) {
        for (name, value) in self.host.state.forces.values() {
            see(names::key(name), Setting::Float(value));
        }
    }

    fn is_held(&self, key: VariableKey) -> bool {
        let field = names::name(key).and_then(|name| self.field(name));
        field.is_some_and(|field| self.host.state.forces.hold(field))
    }

    fn each_deferred_assignment(&self, see: &mut dyn FnMut(DeferredAssignment<'_>)) {
        self.host.each_synchronous_assignment(see);
    }

    fn fingerprint(&self) -> u64 {
        self.identity.fingerprint()
    }

    fn task_statuses(&self) -> Vec<TaskStatus> {
        let State { plcs, plccs, .. } = &self.host.state;
        let mut found = vec![];
        for plc in plcs.all().iter().chain(plccs.all()) {
            let status = match plc.status {
                Status::Absent => continue,
                Status::Enabled => TaskStatus::Enabled,
                Status::Disabled => TaskStatus::Disabled,
                Status::Paused => TaskStatus::Paused,
            };
            // Tasks that are not PLCs, commands, come after them and always run.
            if plc.task >= found.len() {
                found.resize(plc.task + 1, TaskStatus::Enabled);
            }
            if let Some(slot) = found.get_mut(plc.task) {
                *slot = status;
            }
        }
        found
    }

    fn used_ranges(&self) -> Vec<Range<u32>> {
        let layout = &self.host.layout;
        let words = |number| match DirectAccess::of(layout, self.view().definition(number)) {
            Some(DirectAccess::Word(offset, ..)) => {
                let from = layout.words + offset;
                Some(from..from + layout::WORD_SIZE)
            }
            _ => None,
        };
        let symbols = Tables::Pmac(self.host.tables.clone()).symbols();
        let variables = symbols.iter().map(|s| s.offset..s.offset + s.elements * s.ty.size());
        variables.chain((0..layout.count).filter_map(words)).chain(self.clocks.ranges()).collect()
    }

    fn take_over(&mut self, old: &mut dyn Executive, plan: &Plan) -> TakeOver {
        let old = old.as_any_mut().downcast_mut::<Self>();
        let (Some(old), Some(plan)) = (old, plan.of_control()) else {
            return TakeOver::Impossible;
        };
        let (was, is) = (&old.host.tables.motion, &self.host.tables.motion);
        if old.host.state.motion.as_ref().is_some_and(|state| !state.can_go_over(was, is)) {
            return TakeOver::Later("a motion program runs that the new program has differently");
        }
        self.take_over_from(old, plan);
        TakeOver::Done
    }

    fn as_any_mut(&mut self) -> &mut dyn Any {
        self
    }

    fn retained_into(&self, out: &mut Vec<u8>) -> bool {
        let origin = self.host.state.saved.origin.as_ref().unwrap_or(&self.host.origin);
        self.host.saved().is_some_and(|kept| save::pack(kept, origin, out))
    }

    fn retained_revision(&self) -> Option<u64> {
        Some(self.host.saved_revision)
    }

    /// PMAC itself limits no scan; its own watchdog looks at servo cycles.
    fn shortest_time_limit(&self) -> Option<Duration> {
        None
    }

    fn restore(&mut self, retained: &[u8]) -> Result<Restored, String> {
        self.take_back(retained)
    }

    fn set_watchdog(&mut self, watchdog: Watchdog) {
        self.scan_watchdog = Some(watchdog);
    }

    fn image(&self) -> &[u8] {
        &self.image
    }

    fn set_image(&mut self, image: &[u8]) {
        if image.len() == self.image.len() {
            self.image.copy_from_slice(image);
        }
    }

    fn set_safe_lines(&mut self, lines: SafeLines) {
        self.safe_lines = lines;
    }

    fn safe_lines(&self) -> &SafeLines {
        &self.safe_lines
    }

    fn drive_safe_outputs(&mut self) {
        self.safe_lines.drive(&mut self.image);
    }

    fn checkpoint(&self) -> Vec<u8> {
        self.identity.write(&self.image, &self.host.state)
    }

    fn state_into(&self, out: &mut Vec<u8>) {
        write_state(&self.host.state, out);
    }

    fn compared_ranges(&self) -> Vec<Range<u32>> {
        // What code assumes of definitions depends on the code.
        let layout = &self.host.layout;
        let assumed = [
            layout.reference_definitions..layout.thumbwheels,
            layout.differing_definitions..layout.q_base,
        ];
        without(0..u32::try_from(self.image.len()).unwrap_or(u32::MAX), &assumed)
    }

    fn clock_decisions(&self) -> &[ClockDecision] {
        self.decisions.noted()
    }

    fn follow_clock(&mut self, decisions: Option<&[ClockDecision]>) {
        self.decisions.follow(decisions);
    }

    fn resume(&mut self, checkpoint: &[u8]) -> Result<(), CheckpointError> {
        let (mut image, state): (_, State) = self.identity.read(self.image.len(), checkpoint)?;
        let own = (&self.host.state, &self.host.tables);
        let state = state.fitted(own.0, own.1).ok_or(CheckpointError::Damaged)?;
        let mut plcs = state.plcs.all().iter().chain(state.plccs.all());
        if !plcs.all(|plc| self.identity.can_resume(plc.task, plc.resume)) {
            return Err(CheckpointError::Damaged);
        }
        // The code of this executive's engine keeps the definitions that it assumes. Those that the code
        // assumed where the checkpoint was taken do not matter here.
        Definitions::new(&mut image, &self.host.layout).keep_assumptions_of(&self.image);
        self.image = image;
        self.host.state = state;
        // What this executive has not told yet is of another run.
        self.host.events.clear();
        if self.host.state.tick == 0 {
            self.host.events.extend_from_slice(&self.power_up_events);
        }
        self.host.saved_revision = host::next_revision();
        // The clock has gone on meanwhile; it is watched from now on.
        self.watchdog = self.options.realtime.then(WatchdogTimer::default);
        Ok(())
    }
}
