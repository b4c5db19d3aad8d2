//! What memory shows of motors and coordinate systems (guide, appendix E).

use plcc_abi::pmac::motion::{AxisSet, Mode};
use plcc_abi::pmac::{Space, fixed};

use crate::machine::{Machine, NOWHERE};
use crate::motor::{FILTER, Loop, Motor, Purpose};
use crate::sequence::Progress;
use crate::system::{System, Wait};

const WORD: u32 = 0xFF_FFFF;

/// The latches of a motor's two status words: bits that change only by an event, and that programs may write. Memory
/// alone has them.
const MOTOR_LATCHES: (u32, u32) = (1 << 14, 1 << 11 | 1 << 10 | 1 << 7);

/// Those of the second status word of a coordinate system.
const SYSTEM_LATCHES: u32 = 1 << 22 | 1 << 21;

/// A bit of a motor's status words that changes only by an event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Latch {
    DataError,
    StoppedOnLimit,
    HomeComplete,
    TriggerMove,
}

/// The same of a coordinate system.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SystemLatch {
    RunError,
    CircleError,
}

/// How many coordinate systems a Turbo PMAC has.
const MAX_SYSTEMS: usize = 16;

/// What the status of a coordinate system tells of its motors.
#[derive(Clone, Copy, Debug, Default)]
struct OfMotors {
    any: bool,
    fault: bool,
    fatal: bool,
    warning: bool,
    /// One of them is not in position.
    misses: bool,
}

impl OfMotors {
    fn add(&mut self, motor: &Motor) {
        self.any = true;
        self.fault |= motor.fault;
        self.fatal |= motor.fatal;
        self.warning |= motor.warning;
        self.misses |= !motor.in_position;
    }

    fn are_in_position(&self) -> bool {
        self.any && !self.misses
    }
}

/// The nine axes of a set in every other bit.
const fn spread(axes: AxisSet) -> u32 {
    let mut bits = (axes.0 & AxisSet::AXES.0) as u32;
    bits = (bits | bits << 8) & 0x00FF_00FF;
    bits = (bits | bits << 4) & 0x0F0F_0F0F;
    bits = (bits | bits << 2) & 0x3333_3333;
    (bits | bits << 1) & 0x5555_5555
}

impl Machine<'_> {
    /// Writes the registers of positions, velocities and outputs.
    pub(crate) fn registers(&mut self) {
        for index in 0..self.motor_count() {
            let words = self.setup.motors[index];
            let scale = self.motor_i(index, 8) * 32.0;
            let rate = self.motor_i(index, 9) * 32.0;
            let motor = &mut self.state.motors[index];
            let open = matches!(motor.mode, Loop::Open(_));
            motor.velocity_zero = motor.closed() && motor.commanded == motor.before;
            let motor = &self.state.motors[index];
            let commanded = fixed::bits(motor.commanded * scale);
            let actual = fixed::bits(motor.actual * scale);
            let error = if open { 0.0 } else { motor.commanded - motor.actual };
            let error = fixed::bits(error * scale);
            let velocity = fixed::bits((motor.actual - motor.actual_before) * rate);
            let output = match motor.mode {
                Loop::Open(n) => fixed::bits(n / 100.0 * self.motor_i(index, 69)) as u32,
                Loop::Killed | Loop::Closed => 0,
            };
            let x = motor.x;
            self.set_double(words.commanded, commanded);
            self.set_double(words.actual, actual);
            self.set_double(words.following_error, error);
            self.set_word(words.velocity, velocity as u32);
            self.set_high(words.output, output);
            self.set_high(words.dac, output);
            self.set_word(words.conversion, fixed::bits((32.0 * x).floor()) as u32);
            if let Some(channel) = self.channel(index) {
                self.write_channel(channel.address + 1, fixed::bits(x.floor()) as u32);
                if words.dac == NOWHERE {
                    let word = self.memory.read_word(Space::Y, channel.address + 2);
                    let word = word & 0xFF | (output & 0xFFFF) << 8;
                    self.memory.write_word(Space::Y, channel.address + 2, word);
                }
            }
        }
    }

    /// Writes the high 16 bits of a word.
    fn set_high(&mut self, offset: u32, bits: u32) {
        let word = self.word(offset) & 0xFF | (bits & 0xFFFF) << 8;
        self.set_word(offset, word);
    }

    /// Writes an X word of a channel.
    pub(crate) fn write_channel(&mut self, address: u32, word: u32) {
        self.memory.write_word(Space::X, address, word & WORD);
    }

    /// The filtered velocity, at each real-time interrupt in front of PLC 0.
    pub fn interrupt(&mut self) {
        let cycles = self.i(8) + 1.0;
        for index in 0..self.motor_count() {
            let rate = self.motor_i(index, 9) * 32.0;
            let motor = &mut self.state.motors[index];
            let then = motor.history.front().copied().unwrap_or(motor.actual);
            if motor.history.len() >= FILTER {
                motor.history.pop_front();
            }
            motor.history.push_back(motor.actual);
            let value = (motor.actual - then) / (80.0 * cycles) * rate;
            self.set_double(self.setup.motors[index].filtered, fixed::bits(value));
        }
    }

    /// Changes a bit of a motor's status that only events change.
    pub(crate) fn latch(&mut self, motor: usize, latch: Latch, on: bool) {
        let words = &self.setup.motors[motor];
        let (offset, mask) = match latch {
            Latch::DataError => (words.status_x, 1 << 14),
            Latch::StoppedOnLimit => (words.status_y, 1 << 11),
            Latch::HomeComplete => (words.status_y, 1 << 10),
            Latch::TriggerMove => (words.status_y, 1 << 7),
        };
        self.set_bits(offset, mask, on);
    }

    /// Changes a bit of a coordinate system's status that only events change.
    pub(crate) fn system_latch(&mut self, system: usize, latch: SystemLatch, on: bool) {
        let mask = match latch {
            SystemLatch::RunError => 1 << 22,
            SystemLatch::CircleError => 1 << 21,
        };
        self.set_bits(self.setup.systems[system].status_y, mask, on);
    }

    fn set_bits(&mut self, offset: u32, mask: u32, on: bool) {
        let word = self.word(offset);
        self.set_word(offset, if on { word | mask } else { word & !mask });
    }

    /// Writes the status words of motors and coordinate systems in a servo cycle, whatever programs have written there.
    pub(crate) fn write_status(&mut self) {
        self.status_words(true);
    }

    /// Writes what calculation, safety or a command has changed of the status words since they were written last.
    pub fn show_status(&mut self) {
        self.status_words(false);
    }

    fn status_words(&mut self, all: bool) {
        for index in 0..self.motor_count() {
            let is = self.motor_status(index);
            let was = std::mem::replace(&mut self.state.motors[index].shown, is);
            let words = self.setup.motors[index];
            self.change(words.status_x, was.0, is.0, all, MOTOR_LATCHES.0);
            self.change(words.status_y, was.1, is.1, all, MOTOR_LATCHES.1);
        }
        let mut of_motors = [OfMotors::default(); MAX_SYSTEMS];
        for motor in &self.state.motors {
            let system = motor.definition.map(|it| usize::from(it.system).wrapping_sub(1));
            if let Some(of_system) = system.and_then(|system| of_motors.get_mut(system)) {
                of_system.add(motor);
            }
        }
        for (index, of_motors) in (0..self.system_count()).zip(&of_motors) {
            let is = self.system_status(index, of_motors);
            let was = std::mem::replace(&mut self.state.systems[index].shown, is);
            let words = self.setup.systems[index];
            self.change(words.status_x, was.0, is.0, all, 0);
            self.change(words.status_y, was.1, is.1, all, SYSTEM_LATCHES);
        }
    }

    /// Writes a status word but for its latches: all of it, or what has changed.
    fn change(&mut self, offset: u32, was: u32, is: u32, all: bool, latches: u32) {
        let mask = if all { WORD & !latches } else { was ^ is };
        if mask != 0 {
            let word = self.word(offset) & !mask | is & mask;
            self.set_word(offset, word);
        }
    }

    /// The two status words of a motor with their latches, as `?` gives them.
    pub(crate) fn motor_words(&self, index: usize) -> (u32, u32) {
        let (x, y) = self.motor_status(index);
        let words = &self.setup.motors[index];
        (
            x | self.word(words.status_x) & MOTOR_LATCHES.0,
            y | self.word(words.status_y) & MOTOR_LATCHES.1,
        )
    }

    /// The two status words of a coordinate system with their latches, as `??` gives them.
    pub(crate) fn system_words(&self, index: usize) -> (u32, u32) {
        let mut of_motors = OfMotors::default();
        for motor in self.motors_of(index) {
            of_motors.add(&self.state.motors[motor]);
        }
        let (x, y) = self.system_status(index, &of_motors);
        (x, y | self.word(self.setup.systems[index].status_y) & SYSTEM_LATCHES)
    }

    /// Whether a motor is in a move with an end: a programmed move, a jog, a DWELL.
    pub(crate) fn is_in_move(&self, index: usize) -> bool {
        let dwells = self.system_of(index).is_some_and(|s| self.state.systems[s].dwells());
        dwells || self.in_sequence(index) || self.state.motors[index].moves()
    }

    /// The two status words of a motor without their latches.
    pub(crate) fn motor_status(&self, index: usize) -> (u32, u32) {
        let motor: &Motor = &self.state.motors[index];
        let system = self.system_of(index);
        let of_system = system.map(|system| &self.state.systems[system]);
        let turbo = self.turbo();
        let in_sequence = of_system.is_some_and(|s| s.sequence.runs() && s.sequence.member[index])
            && !of_system.is_some_and(System::is_paused);
        let dwells = of_system.is_some_and(System::dwells);
        let moves = if turbo {
            in_sequence || dwells || motor.moves() && motor.row.has_end()
        } else {
            in_sequence || motor.moves() && motor.programmed || of_system.is_some_and(|s| s.running)
        };
        let enabled = motor.mode != Loop::Killed;
        let bit = |number: u32, is: bool| u32::from(is) << number;
        let i = |number| self.motor_i(index, number) != 0.0;
        let x = bit(23, i(0))
            | bit(22, motor.end_negative)
            | bit(21, motor.end_positive)
            | bit(20, i(6))
            | bit(19, if turbo { enabled } else { i(1) })
            | bit(18, !motor.closed())
            | bit(17, moves)
            | bit(16, i(34))
            | bit(15, dwells)
            | bit(13, motor.closed() && motor.velocity_zero)
            | bit(12, motor.moves() && motor.purpose == Purpose::Abort)
            | bit(10, motor.searching);
        let number = system.unwrap_or(0) as u32;
        let y = if turbo {
            number << 20 | bit(15, system.is_some()) | bit(13, motor.in_position_now)
        } else {
            bit(23, system.is_some()) | (number & 7) << 20 | bit(14, enabled)
        };
        let y = y
            | bit(3, motor.fault)
            | bit(2, motor.fatal)
            | bit(1, motor.warning)
            | bit(0, motor.in_position);
        (x, y)
    }

    /// The two status words of a coordinate system without their latches.
    fn system_status(&self, index: usize, of_motors: &OfMotors) -> (u32, u32) {
        let system = &self.state.systems[index];
        let bit = |number: u32, is: bool| u32::from(is) << number;
        // From the top down in pairs: Z Y X W V U C B A.
        let x = spread(system.modes.feedrate) << 7
            | spread(system.modes.incremental) << 6
            | bit(5, system.modes.incremental.has_r())
            | bit(4, system.continuous)
            | bit(3, system.by_time)
            | bit(2, system.sequence.progress == Progress::Running)
            | bit(1, system.step)
            | bit(0, system.running);
        let mode = match system.mode {
            Mode::Linear => 0,
            Mode::Rapid => 0b00_010,
            Mode::Spline1 | Mode::Spline2 => 0b10_001,
            Mode::Circle1 => 0b00_001,
            Mode::Circle2 => 0b00_011,
            Mode::Pvt => 0b10_010,
        };
        let y = bit(23, system.is_paused())
            | bit(20, of_motors.fault)
            | bit(19, of_motors.fatal)
            | bit(18, of_motors.warning)
            | bit(17, of_motors.are_in_position() && !matches!(system.wait, Wait::Dwell(..)))
            | bit(15, system.idle)
            | mode;
        (x, y)
    }
}

#[cfg(test)]
mod tests {
    use plcc_abi::pmac::motion::{Axis, AxisSet};

    #[test]
    fn sets_are_spread() {
        for axis in Axis::ALL {
            assert_eq!(super::spread(AxisSet::R.with(axis)), 1 << (2 * axis as u32));
        }
        assert_eq!(super::spread(AxisSet::AXES), 0x1_5555);
    }
}
