//! The plant: where motors are, and what their switches say.

use plcc_abi::pmac::Space;

use crate::machine::{Machine, NOWHERE};
use crate::motor::{Inputs, Loop};
use crate::units::ms;

/// The channel of a motor: encoder, flags, DAC.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Channel {
    /// The address of its flag word.
    pub(crate) address: u32,
    /// The offset of the flag word in the image.
    pub(crate) flags: u32,
    /// Whether the flag word is that of a PMAC2 gate array.
    pub(crate) pmac2: bool,
    /// The bits of Ix25, of Ixx24 on Turbo PMAC, that say how flags are used.
    pub(crate) uses: u32,
}

/// The bits of a flag word: home, beyond the positive end, beyond the negative end, fault, index, captured.
pub(crate) struct FlagBits {
    pub(crate) home: u32,
    pub(crate) positive: u32,
    pub(crate) negative: u32,
    pub(crate) fault: u32,
    pub(crate) index: u32,
    pub(crate) captured: u32,
}

const PMAC: FlagBits =
    FlagBits { home: 20, negative: 22, positive: 21, fault: 23, index: 19, captured: 17 };
const PMAC2: FlagBits =
    FlagBits { home: 16, positive: 17, negative: 18, fault: 15, index: 14, captured: 11 };

impl Channel {
    pub(crate) fn bits(&self) -> &'static FlagBits {
        if self.pmac2 { &PMAC2 } else { &PMAC }
    }
}

impl Machine<'_> {
    /// A motor's channel; `None` where Ix25 names no gate array, as for flags over the MACRO ring.
    pub(crate) fn channel(&self, motor: usize) -> Option<Channel> {
        let turbo = self.turbo();
        let flags = self.motor_i(motor, 25) as u32;
        let address = flags & self.setup.layout.address_mask();
        if !self.setup.layout.is_io(Space::X, address) {
            return None;
        }
        let offset = match self.setup.layout.place(Space::X, address) {
            plcc_abi::pmac::Place::Word(offset) => offset,
            _ => NOWHERE,
        };
        let uses = if turbo { self.motor_i(motor, 24) as u32 } else { flags };
        Some(Channel { address, flags: offset, pmac2: turbo && uses & 1 != 0, uses })
    }

    /// The bits that say how a motor's flags are used.
    pub(crate) fn flag_uses(&self, motor: usize) -> u32 {
        self.motor_i(motor, if self.turbo() { 24 } else { 25 }) as u32
    }

    /// Moves the physical positions.
    pub(crate) fn plant(&mut self, units: i64) {
        let setup = self.setup;
        for (motor, plant) in self.state.motors.iter_mut().zip(&setup.plants) {
            motor.x_before = motor.x;
            let commanded = motor.commanded + motor.zero;
            motor.lag.push_back(commanded);
            let late = motor.lag.pop_front().unwrap_or(commanded);
            if !motor.jam {
                motor.x = match motor.mode {
                    Loop::Closed => late,
                    Loop::Killed => motor.x,
                    Loop::Open(n) => motor.x + n / 100.0 * plant.open_loop * ms(units),
                };
                if let Some((from, to)) = plant.stroke {
                    motor.x = motor.x.clamp(from, to);
                }
            }
            motor.actual = motor.x - motor.zero;
            if motor.mode == Loop::Killed {
                motor.commanded = motor.actual;
            }
        }
    }

    /// Writes what the switches say to the flag words. A bit that a row has set stays for this tick.
    pub(crate) fn write_inputs(&mut self) {
        for index in 0..self.motor_count() {
            let uses = self.flag_uses(index);
            let inputs = self.switches(index, uses & 1 << 23 != 0);
            let motor = &mut self.state.motors[index];
            motor.inputs_before = motor.inputs;
            motor.inputs = inputs;
            let (captured, enabled) = (motor.captured, motor.mode != Loop::Killed);
            let active = motor.active;
            let Some(channel) = self.channel(index) else { continue };
            let bits = channel.bits();
            let mut word = self.word(channel.flags);
            let mut set = |bit: u32, value: bool| {
                word = word & !(1 << bit) | u32::from(value) << bit;
            };
            set(bits.home, inputs.home);
            set(bits.positive, inputs.positive);
            set(bits.negative, inputs.negative);
            set(bits.fault, inputs.fault);
            set(bits.index, inputs.index);
            set(bits.captured, captured);
            if !channel.pmac2 {
                set(16, false);
                if active && channel.uses & 1 << 16 == 0 {
                    set(14, enabled);
                }
            }
            for overlay in self.state.overlays.iter().filter(|o| o.offset == channel.flags) {
                word = word & !overlay.mask | overlay.bits & overlay.mask;
            }
            self.set_word(channel.flags, word);
            if channel.pmac2
                && active
                && channel.uses & 1 << 16 == 0
                && let plcc_abi::pmac::Place::Word(offset) =
                    self.setup.layout.place(Space::X, channel.address + 5)
            {
                let word = self.word(offset) & !(1 << 14) | u32::from(enabled) << 14;
                self.set_word(offset, word);
            }
        }
    }

    /// Takes the inputs from the flag words, where rows and forces may have changed them.
    pub(crate) fn read_inputs(&mut self) {
        for index in 0..self.motor_count() {
            let Some(channel) = self.channel(index) else { continue };
            let word = self.word(channel.flags);
            let bits = channel.bits();
            let is = |bit: u32| word & 1 << bit != 0;
            self.state.motors[index].inputs = Inputs {
                home: is(bits.home),
                positive: is(bits.positive),
                negative: is(bits.negative),
                fault: is(bits.fault),
                index: is(bits.index),
            };
        }
    }

    /// What the switches of a motor say at its physical position.
    fn switches(&self, index: usize, fault_high: bool) -> Inputs {
        let plant = &self.setup.plants[index];
        let motor = &self.state.motors[index];
        let x = motor.x;
        Inputs {
            home: plant.home.iter().any(|&(from, to)| from <= x && x <= to),
            positive: plant.limits.is_some_and(|(_, to)| x > to),
            negative: plant.limits.is_some_and(|(from, _)| x < from),
            fault: motor.faulty == fault_high,
            index: self.at_index(index, x),
        }
    }

    /// Whether a position is that of an index pulse.
    pub(crate) fn at_index(&self, index: usize, x: f64) -> bool {
        let plant = &self.setup.plants[index];
        if plant.index == 0 {
            return false;
        }
        let count = (x.floor() as i64).wrapping_sub(plant.index_at);
        count.rem_euclid(i64::from(plant.index)) == 0
    }
}
