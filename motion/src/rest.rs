//! Rest: while nothing moves, a servo cycle changes nothing but what it writes to memory.
//!
//! The simulation is at rest when a servo cycle has left the state as it was. What the next one would compute then depends
//! on the I-variables and the words of memory that it reads, and on nothing else. As long as these are the same bit by bit it
//! writes what the one before has written. Whatever changes the state in another way ends the rest: a command, a calculation, a
//! stimulus, safety.

use plcc_abi::image::{read_f64, read_u32, write_u32};
use plcc_abi::pmac::Controller;

use crate::machine::{Machine, State};
use crate::motor::{Inputs, Loop, Motor};
use crate::plant::Channel;
use crate::registers::Registers;
use crate::sequence::Progress;
use crate::system::{System, Wait};
use crate::variables::Variables;
use crate::words::WORD;

/// The I-variables of a motor that name its channel and say how flags are used.
pub(crate) const OF_CHANNEL: [u32; 2] = [24, 25];

/// Those that its status words show.
pub(crate) const OF_STATUS: [u32; 4] = [0, 1, 6, 34];

/// Those from which its registers are computed.
pub(crate) const OF_REGISTERS: [u32; 2] = [8, 9];

/// Those of safety.
pub(crate) const OF_SAFETY: [u32; 6] = [11, 12, 13, 14, 28, 88];

/// What was found of a motor when it was last computed. It does not belong to the state, from which it can be found anew.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Seen {
    /// The bits of the I-variables.
    pub(crate) of_channel: [u64; 2],
    pub(crate) of_status: [u64; 4],
    pub(crate) of_registers: [u64; 2],
    pub(crate) of_safety: [u64; 6],
    pub(crate) channel: Option<Channel>,
    /// How flags are used.
    pub(crate) uses: u32,
    /// What the switches said, whatever rows and forces made of it.
    pub(crate) switches: Inputs,
    /// Which bits of the flag word the plant writes, and what they are.
    pub(crate) written: (u32, u32),
    /// The inputs among the bits of that word, as they were read.
    pub(crate) read: u32,
    pub(crate) registers: Registers,
    /// The bits of the actual position at the last interrupts, and at how many of them it was the same.
    pub(crate) actual: u64,
    pub(crate) interrupts: usize,
}

/// Two states are the same whatever was seen.
impl PartialEq for Seen {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

/// Whether the simulation is at rest. It does not belong to the state either.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Rest {
    /// A servo cycle changes nothing.
    resting: bool,
    /// Housekeeping neither, but that it counts how often motors were in position.
    safe: bool,
    /// I7 as safety has seen it.
    times: u64,
    /// The status words are as the state is.
    pub(crate) shown: bool,
    /// The coordinate systems that stood still without motors when their status words were found, a bit each.
    empty: u32,
    /// Something else has changed the state since the present servo cycle began.
    disturbed: bool,
}

impl PartialEq for Rest {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl Rest {
    /// Something has changed the state.
    pub(crate) fn end(&mut self) {
        *self = Self { disturbed: true, ..Self::default() };
    }

    /// Whether the status words of a coordinate system without motors are those that were found last.
    pub(crate) fn shows(&mut self, index: usize, system: &System) -> bool {
        let bit = 1 << index;
        let (was, is) = (self.empty & bit != 0, system.stays());
        self.empty = if is { self.empty | bit } else { self.empty & !bit };
        was && is
    }

    #[cfg(test)]
    pub(crate) fn is_rest(self) -> bool {
        self.resting
    }
}

impl Motor {
    /// Whether the servo cycle that was computed last has left it as it was, and the next one will, if it is in no sequence.
    fn stays(&self, stroke: Option<(f64, f64)>) -> bool {
        let same = |a: f64, b: f64| a.to_bits() == b.to_bits();
        let inside = |x: f64| stroke.map_or(x, |(from, to)| x.clamp(from, to));
        let physical = self.commanded + self.zero;
        let stands = match self.mode {
            Loop::Closed => self.jam || same(self.x, inside(physical)),
            Loop::Killed => {
                same(self.commanded, self.actual) && (self.jam || same(self.x, inside(self.x)))
            }
            Loop::Open(_) => false,
        };
        stands
            && !self.moves()
            && same(self.commanded, self.before)
            && same(self.x, self.x_before)
            && same(self.actual, self.actual_before)
            && same(self.actual, self.x - self.zero)
            && self.lag.iter().all(|&late| same(late, physical))
            && self.waiting.is_empty()
            && self.search.is_none()
            && !self.seen.channel.as_ref().is_some_and(Channel::is_last)
            && self.inputs == self.inputs_before
    }
}

impl System {
    /// Whether nothing of it runs or waits in a servo cycle.
    fn stays(&self) -> bool {
        !self.running
            && self.sequence.progress == Progress::None
            && self.wait == Wait::None
            && self.pause == crate::halt::Pause::None
            && self.due_next <= self.due
            && !self.returning
    }
}

impl Machine<'_> {
    /// Looks at the end of a servo cycle whether it has changed anything.
    pub(crate) fn settle(&mut self) {
        let State { motors, systems, rest, .. } = &mut *self.state;
        rest.safe = false;
        rest.resting = !rest.disturbed
            && systems.iter().all(System::stays)
            && motors
                .iter()
                .zip(&self.setup.plants)
                .all(|(motor, plant)| motor.stays(plant.stroke));
    }

    /// The first part of a servo cycle at rest. Says whether it was that.
    pub(crate) fn servo_at_rest(&mut self) -> bool {
        let layout = &self.setup.layout;
        let image = &mut *self.memory.image;
        let State { motors, systems, rest, .. } = &mut *self.state;
        rest.disturbed = false;
        if !rest.resting {
            return false;
        }
        let turbo = layout.controller == Controller::Turbo;
        for (index, (system, words)) in systems.iter().zip(&self.setup.systems).enumerate() {
            let first = if turbo { 50 + index } else { index };
            let address = Variables::of(image, layout, first).i(93);
            let own = address == 0.0 || address == f64::from(words.base_address);
            let commanded = i64::from(read_u32(image, words.commanded_base) & WORD);
            let goal = if system.held { 0 } else { commanded };
            if !own || goal != system.base {
                rest.resting = false;
            }
        }
        for (index, motor) in motors.iter().enumerate() {
            let variables = Variables::of(image, layout, index);
            let same = variables.are(OF_CHANNEL, &motor.seen.of_channel);
            if !same || variables.is_set(0) != motor.active {
                rest.resting = false;
            }
        }
        if !rest.resting {
            return false;
        }
        for (system, words) in systems.iter_mut().zip(&self.setup.systems) {
            system.since_break = system.since_break.saturating_add(system.base);
            write_u32(image, words.present_base, system.base as u32 & WORD);
        }
        for motor in motors {
            motor.write_flags(image);
        }
        true
    }

    /// The second part of a servo cycle at rest. Says whether it was that.
    pub(crate) fn finish_at_rest(&mut self) -> bool {
        let layout = &self.setup.layout;
        let image = &mut *self.memory.image;
        let State { motors, systems, rest, .. } = &mut *self.state;
        if !rest.resting {
            return false;
        }
        for (index, motor) in motors.iter().enumerate() {
            let variables = Variables::of(image, layout, index);
            let seen = &motor.seen;
            let same = variables.are(OF_CHANNEL, &seen.of_channel)
                && variables.are(OF_REGISTERS, &seen.of_registers)
                && variables.are(OF_STATUS, &seen.of_status)
                && seen.channel.as_ref().is_none_or(|channel| channel.read(image) == seen.read);
            if !same {
                rest.resting = false;
            }
        }
        if !rest.resting {
            // What the first part would have left.
            for motor in motors {
                motor.inputs = motor.seen.switches;
            }
            return false;
        }
        for (motor, words) in motors.iter().zip(&self.setup.motors) {
            motor.write_registers(image, words, motor.seen.channel.as_ref());
        }
        for (motor, words) in motors.iter().zip(&self.setup.motors) {
            motor.write_status(image, words);
        }
        for (system, words) in systems.iter().zip(&self.setup.systems) {
            system.write_status(image, words);
        }
        true
    }

    /// Housekeeping at rest, but for the panel. Says whether it was that.
    pub(crate) fn housekeeping_at_rest(&mut self) -> bool {
        let layout = &self.setup.layout;
        let image = &*self.memory.image;
        let State { motors, rest, .. } = &mut *self.state;
        if !rest.resting
            || !rest.safe
            || read_f64(image, layout.i_offset(7)).to_bits() != rest.times
        {
            return false;
        }
        for (index, motor) in motors.iter().enumerate() {
            let variables = Variables::of(image, layout, index);
            if !variables.are(OF_SAFETY, &motor.seen.of_safety)
                || !variables.are(OF_CHANNEL, &motor.seen.of_channel)
            {
                return false;
            }
        }
        for motor in motors {
            let more = u32::from(motor.in_position_now);
            motor.in_position_count = motor.in_position_count.saturating_add(more);
        }
        true
    }

    /// Looks at the end of housekeeping whether the next one would find the same.
    pub(crate) fn settle_safety(&mut self) {
        let layout = &self.setup.layout;
        let image = &*self.memory.image;
        let State { motors, rest, .. } = &mut *self.state;
        rest.safe = rest.resting;
        if !rest.safe {
            return;
        }
        rest.times = read_f64(image, layout.i_offset(7)).to_bits();
        for (index, motor) in motors.iter_mut().enumerate() {
            let variables = Variables::of(image, layout, index);
            motor.seen.of_safety = variables.bits(OF_SAFETY);
            // Else it may be in position when it was counted once more.
            rest.safe &= motor.in_position || !motor.in_position_now;
        }
    }
}
