//! The simulated control beside a PMI program (cnc-side 2).

mod auxiliary;
mod jog;
mod machine;
mod modes;
mod program;
mod spindle;
mod state;
mod touch;
mod variables;

use std::sync::Arc;

use crate::access::{Access, Handle};
use crate::context::Context;
use crate::event::Awaited;
use crate::setup::Setup;
pub(crate) use state::State;
pub(crate) use touch::Window;
use variables::Variables;

/// The control of a PMI program: what never changes in a run.
#[derive(Clone, Debug)]
pub(crate) struct Pmi {
    setup: Arc<Setup>,
    variables: Variables,
    machine_on_ticks: u64,
}

/// What the program and the operator have set, as a step sees it.
#[derive(Clone, Copy, Debug, Default)]
struct Seen {
    machine_on_request: bool,
    machine_ready: bool,
    estop_button: bool,
    control_reset: bool,
    mode_request: i64,
    feed_hold_request: bool,
    cycle_request: bool,
    block_inhibit: bool,
    move_hold: bool,
    simulation: bool,
    feed_override: i64,
    block_delete: bool,
    optional_stop: bool,
    axis_requests: [i64; jog::AXES],
}

impl Pmi {
    pub(crate) fn new(setup: Arc<Setup>, tick_ns: u64, access: &mut dyn Access) -> Self {
        let variables = Variables::find(&setup, access);
        let machine_on_ticks = crate::length::ticks(setup.machine_on_ns, tick_ns);
        Self { setup, variables, machine_on_ticks }
    }

    /// The state at power-up.
    pub(crate) fn at_power_up(&self, tick_ns: u64) -> State {
        State::new(&self.setup, tick_ns)
    }

    /// What it writes.
    pub(crate) fn writes(&self) -> Vec<Handle> {
        self.variables.writes()
    }

    /// What the program's block still waits for, with its line.
    pub(crate) fn waits(&self, state: &State) -> Option<(Awaited, i64)> {
        state.block.waits().map(|awaited| (awaited, state.block.line(&self.setup)))
    }

    /// The line of the block that is executed, 0 without.
    pub(crate) fn line(&self, state: &State) -> i64 {
        state.block.line(&self.setup)
    }

    fn see(&self, access: &dyn Access) -> Seen {
        let own = &self.variables;
        Seen {
            machine_on_request: own.machine_on_request.is_on(access),
            machine_ready: own.machine_ready.is_on(access),
            estop_button: own.estop_button.is_on(access),
            control_reset: own.control_reset_request.is_on(access),
            mode_request: own.mode_request.read(access),
            feed_hold_request: own.feed_hold_request.is_on(access),
            cycle_request: own.cycle_request.is_on(access),
            block_inhibit: own.block_inhibit.is_on(access),
            move_hold: own.move_hold.is_on(access),
            simulation: own.simulation.is_on(access),
            feed_override: own.feed_override.read(access),
            block_delete: own.block_delete.is_on(access),
            optional_stop: own.optional_stop.is_on(access),
            axis_requests: std::array::from_fn(|axis| {
                own.axes.get(axis).map_or(0, |axis| axis.request.read(access))
            }),
        }
    }

    /// Does a step: machine, reset, mode, options, hold and start, block, jog, auxiliary axes, spindle.
    pub(crate) fn step(&self, state: &mut State, now: &mut Context<'_>) {
        if now.tick == 0 {
            self.variables.feed_override.write(now.access, 100);
            self.variables.spindle_override.write(now.access, 100);
        }
        let seen = self.see(now.access);
        self.machine(state, &seen, now);
        self.control_reset(state, &seen, now);
        self.mode(state, &seen);
        self.options(state, &seen);
        self.hold_and_start(state, &seen, now);
        self.block(state, &seen, now);
        self.jog(state, &seen, now);
        self.auxiliary(state, now);
        self.touch(state, now);
        self.spindle(state, now);
        state.before = state::Before::of(&seen);
        self.write(state, now);
    }

    /// Writes everything that the control holds.
    fn write(&self, state: &mut State, now: &mut Context<'_>) {
        let (own, access) = (&self.variables, &mut *now.access);
        let flag = |on: bool| i64::from(on);
        own.estop.write(access, flag(!state.is_on()));
        own.machine_request.write(access, flag(!state.is_off()));
        own.mode.write(access, state.mode);
        own.feed_hold.write(access, flag(state.hold));
        let is_executing = state.block.is_executed();
        own.block_active.write(access, flag(is_executing));
        own.cycle_in_progress.write(access, flag(is_executing && !state.hold));
        own.program_end.write(access, state.program_end);
        own.s_code.write(access, state.s_code);
        own.t_code.write(access, state.t_code);
        own.interpolation.write(access, state.block.interpolation());
        own.spindle_encoder.write(access, flag(self.setup.spindle(0).encoder));
        own.inch.write(access, flag(self.setup.rules.is_inch));
        let asim = own.simulated_spindle.is_on(access) || !self.setup.spindle(0).encoder;
        let rpm = if asim { own.simulated_rpm.read(access) } else { state.rpm(&self.setup) };
        own.spindle_rpm.write(access, rpm);
        let mut moves = false;
        state.positions.delay();
        for (at, axis) in self.setup.axes.iter().enumerate() {
            let active = state.active.get(at).copied().unwrap_or(false);
            moves |= active;
            let Some(variables) = own.axes.get(at) else { continue };
            variables.active.write(access, flag(active));
            let homed = state.homed.get(at).copied().unwrap_or(false);
            variables.not_homed.write(access, flag(!homed));
            let counts = |position| crate::length::counts(position, axis.counts, axis.unit);
            variables.command.write(access, counts(state.positions.command(at)));
            variables.actual.write(access, counts(state.positions.actual(at)));
        }
        own.moves.write(access, flag(moves));
        self.show_auxiliary(state, now);
    }
}
