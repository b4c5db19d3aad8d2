//! What memory shows of the positions, velocities and outputs of motors (guide, appendix E).

use plcc_abi::image::{read_f64, read_u32, write_u32};
use plcc_abi::pmac::{Controller, Space, fixed};

use crate::machine::Machine;
use crate::motor::{FILTER, Loop, Motor};
use crate::plant::Channel;
use crate::rest::{OF_CHANNEL, OF_REGISTERS};
use crate::variables::Variables;
use crate::words::{MotorWords, NOWHERE, WORD, write_double};

/// Up to this position 32 times of it rounded down is exact in 64 bits.
const LARGE: f64 = (1_u64 << 56) as f64;

/// What the registers of a motor show: counts in units of 1/(Ix08·32), of the velocity 1/(Ix09·32).
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Registers {
    commanded: u64,
    actual: u64,
    following_error: u64,
    velocity: u32,
    output: u32,
    conversion: u32,
    counter: u32,
}

impl Registers {
    fn of(motor: &Motor, variables: Variables<'_>) -> Self {
        let scale = variables.i(8) * 32.0;
        let rate = variables.i(9) * 32.0;
        let (error, output) = match motor.mode {
            Loop::Open(n) => (0.0, fixed::bits(n / 100.0 * variables.i(69)) as u32),
            Loop::Killed | Loop::Closed => (motor.commanded - motor.actual, 0),
        };
        let commanded = fixed::bits(motor.commanded * scale);
        let actual = match motor.commanded.to_bits() == motor.actual.to_bits() {
            true => commanded,
            false => fixed::bits(motor.actual * scale),
        };
        let conversion = fixed::floor_bits(32.0 * motor.x);
        let counter = match motor.x.abs() < LARGE {
            true => (conversion as i64 >> 5) as u64,
            false => fixed::floor_bits(motor.x),
        };
        Self {
            commanded,
            actual,
            following_error: if error == 0.0 { 0 } else { fixed::bits(error * scale) },
            velocity: fixed::bits((motor.actual - motor.actual_before) * rate) as u32 & WORD,
            output,
            conversion: conversion as u32 & WORD,
            counter: counter as u32 & WORD,
        }
    }
}

/// A word with other high 16 bits.
fn with_high(word: u32, bits: u32) -> u32 {
    word & 0xFF | (bits & 0xFFFF) << 8
}

fn write_high(image: &mut [u8], offset: u32, bits: u32) {
    write_u32(image, offset, with_high(read_u32(image, offset), bits));
}

impl Motor {
    /// Writes its registers as they were computed last.
    #[inline]
    pub(crate) fn write_registers(
        &self,
        image: &mut [u8],
        words: &MotorWords,
        channel: Option<&Channel>,
    ) {
        let shown = &self.seen.registers;
        write_double(image, words.commanded, shown.commanded);
        write_double(image, words.actual, shown.actual);
        write_double(image, words.following_error, shown.following_error);
        write_u32(image, words.velocity, shown.velocity);
        write_high(image, words.output, shown.output);
        write_high(image, words.dac, shown.output);
        write_u32(image, words.conversion, shown.conversion);
        if let Some(channel) = channel {
            write_u32(image, channel.counter, shown.counter);
            if words.dac == NOWHERE {
                write_high(image, channel.output, shown.output);
            }
        }
    }

    /// Whether its position has been the same since the first of the interrupts that the filtered velocity looks at.
    fn stood_still(&mut self) -> bool {
        let actual = self.actual.to_bits();
        if actual != self.seen.actual {
            (self.seen.actual, self.seen.interrupts) = (actual, 0);
        }
        if self.seen.interrupts >= FILTER {
            return true;
        }
        self.seen.interrupts += 1;
        false
    }
}

impl Machine<'_> {
    /// Writes the registers of positions, velocities and outputs.
    pub(crate) fn registers(&mut self) {
        let layout = &self.setup.layout;
        for (index, words) in self.setup.motors.iter().enumerate() {
            let image = &mut *self.memory.image;
            let motor = &mut self.state.motors[index];
            let variables = Variables::of(image, layout, index);
            motor.velocity_zero = motor.closed() && motor.commanded == motor.before;
            motor.seen.of_registers = variables.bits(OF_REGISTERS);
            motor.seen.registers = Registers::of(motor, variables);
            let other;
            let channel = match variables.are(OF_CHANNEL, &motor.seen.of_channel) {
                true => &motor.seen.channel,
                false => {
                    other = Channel::new(layout, variables);
                    &other
                }
            };
            motor.write_registers(image, words, channel.as_ref());
            if let Some(channel) = channel.filter(Channel::is_last) {
                let shown = motor.seen.registers;
                self.write_last(&channel, words, &shown);
            }
        }
    }

    /// The last addresses of Turbo PMAC's gate arrays have no words behind them in the image.
    fn write_last(&mut self, channel: &Channel, words: &MotorWords, shown: &Registers) {
        if channel.counter == NOWHERE {
            self.memory.write_word(Space::X, channel.address + 1, shown.counter);
        }
        if words.dac == NOWHERE && channel.output == NOWHERE {
            let word = self.memory.read_word(Space::Y, channel.address + 2);
            let word = with_high(word, shown.output);
            self.memory.write_word(Space::Y, channel.address + 2, word);
        }
    }

    /// Writes an X word of a channel.
    pub(crate) fn write_channel(&mut self, address: u32, word: u32) {
        self.memory.write_word(Space::X, address, word & WORD);
    }

    /// The filtered velocity, at each real-time interrupt in front of PLC 0.
    pub fn interrupt(&mut self) {
        let (layout, image) = (&self.setup.layout, &mut *self.memory.image);
        let pmac = layout.controller == Controller::Pmac;
        let cycles = read_f64(image, layout.i_offset(8)) + 1.0;
        for (index, motor) in self.state.motors.iter_mut().enumerate() {
            let words = &self.setup.motors[index];
            let mut value = 0;
            if !motor.stood_still() {
                let rate = Variables::of(image, layout, index).i(9) * 32.0;
                let then = motor.history.front().copied().unwrap_or(motor.actual);
                if motor.history.len() >= FILTER {
                    motor.history.pop_front();
                }
                motor.history.push_back(motor.actual);
                value = fixed::bits((motor.actual - then) / (80.0 * cycles) * rate);
            }
            match pmac {
                true => write_u32(image, words.filtered, value as u32 & WORD),
                false => write_double(image, words.filtered, value),
            }
        }
    }
}
