//! The simulated control beside an NCT program (cnc-side 3).

mod block;
mod buffer;
mod chopping;
mod flags;
mod hand;
mod messages;
mod movement;
mod panel;
mod parts;
mod plc_axis;
mod reference;
mod reset;
mod returning;
mod serial;
mod speed;
mod spindle;
mod state;

use std::sync::Arc;

use crate::access::{Access, Handle};
use crate::context::Context;
use crate::event::Awaited;
use crate::length::ticks;
use crate::setup::Setup;
use flags::{Flags, Registers, Variables};
pub(crate) use panel::panel;
pub(crate) use state::{Fault, State};

/// The control of an NCT program: what never changes in a run.
#[derive(Clone, Debug)]
pub(crate) struct Nct {
    setup: Arc<Setup>,
    variables: Variables,
    stop_ticks: u64,
    chop_ticks: u64,
}

/// What a step sees and what it gives.
struct Step<'a, 'c> {
    now: &'a mut Context<'c>,
    /// The output flags that the program has set, a byte each.
    y: Flags,
    reset_key: bool,
    /// The registers that the program writes and the NC reads.
    spindle_codes: [(i64, i64); 2],
    feed_code: i64,
    spindle_override_code: i64,
    rapid_code: i64,
    /// The strobes of this slice, by byte and bit.
    strobes: Flags,
}

/// Where an axis is, in increments.
#[derive(Clone, Copy, Default)]
struct Increments {
    actual: i64,
    /// By how much it is behind the commanded position.
    lag: i64,
}

/// The byte with these bits, the lowest first.
fn byte(bits: [bool; 8]) -> u8 {
    bits.into_iter().rev().fold(0, |byte, bit| byte << 1 | u8::from(bit))
}

impl Step<'_, '_> {
    /// Whether the output flag Ypqr is 1: byte `pq`, bit `r`.
    fn y(&self, byte: usize, bit: usize) -> bool {
        self.y.is_on(byte, bit)
    }

    /// START without STOP.
    fn runs(&self) -> bool {
        self.y(47, 0) && !self.y(47, 1)
    }

    /// Automatic mode.
    fn is_automatic(&self) -> bool {
        self.y(40, 6)
    }
}

impl Nct {
    pub(crate) fn new(setup: Arc<Setup>, tick_ns: u64, access: &mut dyn Access) -> Self {
        let variables = Variables::find(access);
        let stop_ticks = ticks(setup.stop_ns, tick_ns);
        let chop_ticks = ticks(setup.chop_ns, tick_ns);
        Self { setup, variables, stop_ticks, chop_ticks }
    }

    /// The state at power-up.
    pub(crate) fn at_power_up(&self, tick_ns: u64) -> State {
        State::new(&self.setup, tick_ns)
    }

    /// What it writes.
    pub(crate) fn writes(&self) -> Vec<Handle> {
        self.variables.writes()
    }

    /// What a block still waits for, with its line.
    pub(crate) fn waits(&self, state: &State) -> Option<(Awaited, i64)> {
        state
            .block
            .as_ref()
            .and_then(|_| state.waits.first())
            .map(|awaited| (awaited, self.line(state)))
    }

    /// The line of the block that is executed, 0 without; of the entered block n it is -n.
    pub(crate) fn line(&self, state: &State) -> i64 {
        let Some(executed) = &state.block else { return 0 };
        let line = executed.block(&self.setup).map_or(0, |block| i64::from(block.line));
        if executed.is_entered() { -line } else { line }
    }

    /// Does a step: machine on; what drops a block; I547 and answers; block; buffer; movements by hand; axes of the PLC;
    /// spindles; messages; serial data; chopping.
    pub(crate) fn step(&mut self, state: &mut State, now: &mut Context<'_>) {
        if now.tick == 0 {
            self.variables.first_overrides(now.access, self.setup.rapid_override.is_some());
        }
        let mut step = self.variables.see(now);
        let falls = self.machine_on(state, &step);
        self.drops(state, &mut step, falls);
        self.release(state, &step);
        self.block(state, &mut step);
        self.buffer(state, &step);
        self.by_hand(state, &step);
        self.plc_axes(state, &step);
        self.spindles(state, &step);
        state.positions.delay();
        self.messages(state, &step);
        self.serial(state, &mut step);
        self.chopping(state, &step);
        state.before = state::Before::of(&step);
        self.write(state, &mut step);
    }

    /// Whether I540 falls in this step.
    fn machine_on(&self, state: &mut State, step: &Step<'_, '_>) -> bool {
        let was_on = state.machine_on;
        // 6.7 has the NOT that the printed formula of I540 lacks.
        state.machine_on = step.y(54, 0) && state.fault.is_none();
        was_on && !state.machine_on
    }

    /// Writes everything that the control holds.
    fn write(&mut self, state: &State, step: &mut Step<'_, '_>) {
        let increments = std::array::from_fn(|axis| self.increments(state, axis));
        let flags = self.nc_flags(state, step, &increments);
        let mut registers = Registers::default();
        self.registers(state, &increments, &mut registers);
        self.variables.write(step.now.access, &flags, &registers);
        self.variables.write_message(step.now.access, state.shown_flag());
    }

    fn nc_flags(
        &self,
        state: &State,
        step: &Step<'_, '_>,
        increments: &[Increments; state::AXES],
    ) -> Flags {
        let mut flags = step.strobes;
        flags.set(51, 1, state.interrupted);
        flags.set(53, 7, state.message.is_some());
        let [off, on] = [false, true];
        let faulty = state.fault.is_some();
        let [home, full, held] = [state.home_block, state.buffer_full, state.blocks_held];
        flags.set_byte(54, byte([state.machine_on, on, faulty, off, off, home, full, held]));
        flags.set(55, 0, state.stopped);
        flags.set(55, 1, state.interpolation_done);
        flags.set(55, 2, state.ignores_stop);
        flags.set(55, 3, state.is_feed);
        flags.set(55, 4, state.is_thread);
        flags.set(60, 6, state.serial.sent);
        flags.set(60, 7, state.serial.received);
        flags.set(67, 5, state.chopping);
        flags.set(67, 6, state.is_chopping);
        flags.set(67, 7, state.stands_at_r);
        let of_second = state.spindles.each_ref().map(|spindle| spindle.is_synchronous);
        for (spindle, (number, [third, fourth])) in
            state.spindles.iter().zip([(65, [off, off]), (66, of_second)])
        {
            let [command, oriented, positioned] =
                [spindle.has_command, spindle.is_oriented, spindle.is_positioned];
            let [at_speed, stands] = [spindle.is_at_speed, spindle.stands];
            let bits = [command, oriented, positioned, third, fourth, off, at_speed, stands];
            flags.set_byte(number, byte(bits));
        }
        let [mut moves, mut moves_rapidly] = state.moved_by_hand();
        moves |= state.moves;
        moves_rapidly |= state.moves_rapidly;
        let mut in_position = 0;
        let axes = state.plc_axes.iter().zip(increments).enumerate();
        for (axis, (of_plc, Increments { lag, .. })) in axes {
            in_position |= u8::from(lag.abs() <= self.setup.in_position) << axis;
            let [plc_moves, plc_moves_rapidly] = of_plc.moves();
            moves |= u8::from(plc_moves) << axis;
            moves_rapidly |= u8::from(plc_moves_rapidly) << axis;
            let homed = state.homed >> axis & 1 != 0;
            let [stands, empty] = [of_plc.stands(), of_plc.is_empty()];
            let bits = [stands, empty, off, homed, off, off, off, state.machine_on];
            flags.set_byte(90 + axis, byte(bits));
        }
        flags.set_byte(56, in_position);
        flags.set_byte(61, moves);
        flags.set_byte(62, moves_rapidly);
        flags
    }

    fn increments(&self, state: &State, axis: usize) -> Increments {
        let Some(entry) = self.setup.axes.get(axis) else { return Increments::default() };
        let of = |position| crate::length::counts(position, entry.counts, entry.unit);
        let actual = of(state.positions.actual(axis));
        Increments { actual, lag: of(state.positions.command(axis)) - actual }
    }

    fn registers(
        &self,
        state: &State,
        increments: &[Increments; state::AXES],
        registers: &mut Registers,
    ) {
        for (number, value) in state.registers.iter().enumerate() {
            registers.set(number, *value);
        }
        for (spindle, (speed, value)) in state.spindles.iter().zip([(10, 11), (15, 16)]) {
            registers.set(speed, spindle.actual.unsigned_abs() as u16);
            registers.set(value, spindle.commanded);
        }
        registers.set(20, state.message.unwrap_or(0));
        let number = match &self.setup.program {
            Some(_) => self.setup.table.program_number.unwrap_or(1),
            None => 0,
        };
        let is_executed = state.block.as_ref().is_some_and(|block| !block.is_entered());
        registers.set(30, if is_executed || state.interrupted { number } else { 0 });
        registers.set(31, number);
        registers.set(32, 0);
        for (axis, &Increments { actual, lag }) in increments.iter().enumerate() {
            let first = 100 + 5 * axis;
            for (at, word) in [actual, actual >> 16, lag, lag >> 16].into_iter().enumerate() {
                registers.set(first + at, word as u16);
            }
        }
    }
}
