//! What memory shows of motors and coordinate systems (guide, appendix E).

use plcc_abi::pmac::motion::{Axis, Mode};
use plcc_abi::pmac::{Space, fixed};

use crate::linear::Progress;
use crate::machine::{Machine, NOWHERE};
use crate::motor::{FILTER, Loop, Motor, Purpose};
use crate::system::{System, Wait};

const WORD: u32 = 0xFF_FFFF;

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
            if motor.history.len() > FILTER - 1 {
                let then = motor.history.front().copied().unwrap_or(motor.actual);
                let way = motor.actual - then;
                motor.history.pop_front();
                motor.history.push_back(motor.actual);
                let value = way / (80.0 * cycles) * rate;
                self.set_word(self.setup.motors[index].filtered, fixed::bits(value) as u32);
                continue;
            }
            let then = motor.history.front().copied().unwrap_or(motor.actual);
            let value = (motor.actual - then) / (80.0 * cycles) * rate;
            motor.history.push_back(motor.actual);
            self.set_word(self.setup.motors[index].filtered, fixed::bits(value) as u32);
        }
    }

    /// Writes the status words of motors and coordinate systems.
    pub fn show_status(&mut self) {
        for index in 0..self.motor_count() {
            let (x, y) = self.motor_status(index);
            let words = self.setup.motors[index];
            self.set_word(words.status_x, x);
            self.set_word(words.status_y, y);
        }
        for index in 0..self.system_count() {
            let (x, y) = self.system_status(index);
            let words = self.setup.systems[index];
            self.set_word(words.status_x, x);
            self.set_word(words.status_y, y);
        }
    }

    /// Whether a motor is in a move with an end: a programmed move, a jog, a DWELL.
    pub(crate) fn is_in_move(&self, index: usize) -> bool {
        let dwells = self.system_of(index).is_some_and(|s| self.state.systems[s].dwells());
        dwells || self.in_sequence(index) || self.state.motors[index].moves()
    }

    /// The two status words of a motor, as `?` gives them.
    pub(crate) fn motor_status(&self, index: usize) -> (u32, u32) {
        let motor: &Motor = &self.state.motors[index];
        let system = self.system_of(index);
        let of_system = system.map(|system| &self.state.systems[system]);
        let turbo = self.turbo();
        let in_sequence = of_system.is_some_and(|s| s.sequence.runs() && s.sequence.member[index]);
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
            | bit(14, motor.data_error)
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
            | bit(11, motor.stopped_on_limit)
            | bit(10, motor.home_complete)
            | bit(7, motor.trigger_move)
            | bit(3, motor.fault)
            | bit(2, motor.fatal)
            | bit(1, motor.warning)
            | bit(0, motor.in_position);
        (x, y)
    }

    /// The two status words of a coordinate system, as `??` gives them.
    pub(crate) fn system_status(&self, index: usize) -> (u32, u32) {
        let system = &self.state.systems[index];
        let bit = |number: u32, is: bool| u32::from(is) << number;
        let mut x = 0;
        for axis in Axis::ALL {
            // From the top down in pairs: Z Y X W V U C B A.
            let pair = 6 + 2 * axis as u32;
            x |= bit(pair + 1, system.modes.feedrate.has(axis));
            x |= bit(pair, system.modes.incremental.has(axis));
        }
        x |= bit(5, system.modes.incremental.has_r())
            | bit(4, system.continuous)
            | bit(3, system.by_time)
            | bit(2, system.sequence.progress == Progress::Running)
            | bit(1, system.step)
            | bit(0, system.running);
        let (mut any, mut all, mut motors) = ((false, false, false), true, false);
        for motor in self.motors_of(index).map(|motor| &self.state.motors[motor]) {
            motors = true;
            any.0 |= motor.fault;
            any.1 |= motor.fatal;
            any.2 |= motor.warning;
            all &= motor.in_position;
        }
        let mode = match system.mode {
            Mode::Linear => 0,
            Mode::Rapid => 0b00_010,
            Mode::Spline1 | Mode::Spline2 => 0b10_001,
            Mode::Circle1 => 0b00_001,
            Mode::Circle2 => 0b00_011,
            Mode::Pvt => 0b10_010,
        };
        let y = bit(22, system.run_error)
            | bit(21, system.circle_error)
            | bit(20, any.0)
            | bit(19, any.1)
            | bit(18, any.2)
            | bit(17, motors && all && !matches!(system.wait, Wait::Dwell(..)))
            | bit(15, system.idle)
            | mode;
        (x, y)
    }
}
