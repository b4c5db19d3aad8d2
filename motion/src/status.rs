//! The status words of motors and coordinate systems (guide, appendix E).

use plcc_abi::image::{read_u32, write_u32};
use plcc_abi::pmac::motion::{AxisSet, Mode};

use crate::machine::{Machine, State};
use crate::motor::{Loop, Motor, Purpose};
use crate::rest::OF_STATUS;
use crate::sequence::Progress;
use crate::system::{System, Wait};
use crate::variables::Variables;
use crate::words::{MotorWords, SystemWords, WORD};

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

/// The nine axes of each set in every other bit.
static SPREAD: [u32; 512] = {
    let mut all = [0; 512];
    let mut set = 0;
    while set < all.len() {
        let mut axis = 0;
        while axis < 9 {
            all[set] |= (set as u32 >> axis & 1) << (2 * axis);
            axis += 1;
        }
        set += 1;
    }
    all
};

/// The nine axes of a set in every other bit.
fn spread(axes: AxisSet) -> u32 {
    SPREAD[usize::from(axes.0 & AxisSet::AXES.0)]
}

impl Machine<'_> {
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
        self.find_status(|_, _, _, _| {});
        let image = &mut *self.memory.image;
        for (motor, words) in self.state.motors.iter().zip(&self.setup.motors) {
            motor.write_status(image, words);
        }
        for (system, words) in self.state.systems.iter().zip(&self.setup.systems) {
            system.write_status(image, words);
        }
    }

    /// Writes what calculation, safety or a command has changed of the status words since they were written last.
    pub fn show_status(&mut self) {
        if self.state.rest.shown && self.has_seen_status() {
            return;
        }
        self.find_status(change);
    }

    /// Whether the I-variables that status words show are those that were seen last.
    fn has_seen_status(&self) -> bool {
        let (layout, image) = (&self.setup.layout, &*self.memory.image);
        let same = |(index, motor): (usize, &Motor)| {
            Variables::of(image, layout, index).are(OF_STATUS, &motor.seen.of_status)
        };
        self.state.motors.iter().enumerate().all(same)
    }

    /// Finds out what the status words are, and has the changes of each written.
    fn find_status(&mut self, change: impl Fn(&mut [u8], u32, u32, u32)) {
        let layout = &self.setup.layout;
        let turbo = self.turbo();
        let image = &mut *self.memory.image;
        let State { motors, systems, rest, .. } = &mut *self.state;
        let mut of_motors = [OfMotors::default(); MAX_SYSTEMS];
        for (index, (motor, words)) in motors.iter_mut().zip(&self.setup.motors).enumerate() {
            let system = motor.definition.map(|it| usize::from(it.system).wrapping_sub(1));
            let of_system = system.and_then(|system| systems.get(system));
            let variables = Variables::of(image, layout, index);
            motor.seen.of_status = variables.bits(OF_STATUS);
            let is = motor_status(motor, index, of_system, variables, turbo);
            let was = std::mem::replace(&mut motor.shown, is);
            change(image, words.status_x, was.0, is.0);
            change(image, words.status_y, was.1, is.1);
            if let Some(of_system) = system.and_then(|system| of_motors.get_mut(system)) {
                of_system.add(motor);
            }
        }
        let systems = systems.iter_mut().zip(&self.setup.systems);
        for (index, ((system, words), of_motors)) in systems.zip(&of_motors).enumerate() {
            if !of_motors.any && rest.shows(index, system) {
                continue;
            }
            let is = system_status(system, of_motors);
            let was = std::mem::replace(&mut system.shown, is);
            change(image, words.status_x, was.0, is.0);
            change(image, words.status_y, was.1, is.1);
        }
        rest.shown = true;
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
        let (x, y) = system_status(&self.state.systems[index], &of_motors);
        (x, y | self.word(self.setup.systems[index].status_y) & SYSTEM_LATCHES)
    }

    /// The motors that are in a move with an end, a bit each: a programmed move, a jog, a DWELL.
    pub(crate) fn in_move(&self) -> u32 {
        let dwells = |system: usize| self.state.systems.get(system).is_some_and(System::dwells);
        let mut bits = 0;
        for (index, motor) in self.state.motors.iter().enumerate() {
            let own = motor.definition.map(|it| usize::from(it.system).wrapping_sub(1));
            bits |= u32::from(motor.moves() || own.is_some_and(dwells)) << index;
        }
        for system in &self.state.systems {
            if system.sequence.runs() && !system.is_paused() {
                for (index, &member) in system.sequence.member.iter().enumerate() {
                    bits |= u32::from(member) << index;
                }
            }
        }
        bits
    }

    /// The two status words of a motor without their latches.
    fn motor_status(&self, index: usize) -> (u32, u32) {
        let of_system = self.system_of(index).map(|system| &self.state.systems[system]);
        let motor = &self.state.motors[index];
        let variables = Variables::of(self.memory.image, &self.setup.layout, index);
        motor_status(motor, index, of_system, variables, self.turbo())
    }
}

/// Writes what has changed of a status word.
#[inline]
fn change(image: &mut [u8], offset: u32, was: u32, is: u32) {
    let mask = was ^ is;
    if mask != 0 {
        write_but(image, offset, is, !mask);
    }
}

/// Writes a word but for some bits.
#[inline]
fn write_but(image: &mut [u8], offset: u32, word: u32, kept: u32) {
    let word = read_u32(image, offset) & kept | word & !kept;
    write_u32(image, offset, word & WORD);
}

impl Motor {
    /// Writes its status words as they were computed last.
    #[inline]
    pub(crate) fn write_status(&self, image: &mut [u8], words: &MotorWords) {
        write_but(image, words.status_x, self.shown.0, MOTOR_LATCHES.0);
        write_but(image, words.status_y, self.shown.1, MOTOR_LATCHES.1);
    }
}

impl System {
    /// The same of a coordinate system.
    #[inline]
    pub(crate) fn write_status(&self, image: &mut [u8], words: &SystemWords) {
        write_but(image, words.status_x, self.shown.0, 0);
        write_but(image, words.status_y, self.shown.1, SYSTEM_LATCHES);
    }
}

#[inline]
const fn bit(number: u32, is: bool) -> u32 {
    (is as u32) << number
}

/// The two status words of a motor without their latches.
fn motor_status(
    motor: &Motor,
    index: usize,
    of_system: Option<&System>,
    variables: Variables<'_>,
    turbo: bool,
) -> (u32, u32) {
    let in_sequence = of_system.is_some_and(|system| {
        system.sequence.runs() && system.sequence.member[index] && !system.is_paused()
    });
    let dwells = of_system.is_some_and(System::dwells);
    let moves = if turbo {
        in_sequence || dwells || motor.moves() && motor.row.has_end()
    } else {
        in_sequence
            || motor.moves() && motor.programmed
            || of_system.is_some_and(|system| system.running)
    };
    let enabled = motor.mode != Loop::Killed;
    let x = bit(23, variables.is_set(0))
        | bit(22, motor.end_negative)
        | bit(21, motor.end_positive)
        | bit(20, variables.is_set(6))
        | bit(19, if turbo { enabled } else { variables.is_set(1) })
        | bit(18, !motor.closed())
        | bit(17, moves)
        | bit(16, variables.is_set(34))
        | bit(15, dwells)
        | bit(13, motor.closed() && motor.velocity_zero)
        | bit(12, motor.moves() && motor.purpose == Purpose::Abort)
        | bit(10, motor.searching);
    let has_system = of_system.is_some();
    let number = motor.definition.map_or(0, |it| u32::from(it.system) - 1);
    let y = if turbo {
        number << 20 | bit(15, has_system) | bit(13, motor.in_position_now)
    } else {
        bit(23, has_system) | (number & 7) << 20 | bit(14, enabled)
    };
    let y = y
        | bit(3, motor.fault)
        | bit(2, motor.fatal)
        | bit(1, motor.warning)
        | bit(0, motor.in_position);
    (x, y)
}

/// The two status words of a coordinate system without their latches.
fn system_status(system: &System, of_motors: &OfMotors) -> (u32, u32) {
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
