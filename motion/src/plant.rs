//! The plant: where motors are, and what their switches say.

use plcc_abi::image::{read_u32, write_u32};
use plcc_abi::pmac::motion::Plant;
use plcc_abi::pmac::{Controller, Layout, Place, Space};

use crate::machine::{Machine, State};
use crate::motor::{Inputs, Loop, Motor};
use crate::rest::OF_CHANNEL;
use crate::units::ms;
use crate::variables::Variables;
use crate::words::{NOWHERE, WORD};

/// The channel of a motor: encoder, flags, DAC.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Channel {
    /// The address of its flag word.
    pub(crate) address: u32,
    /// The offsets in the image of the flag word, of the counter, of the DAC and of the word with AENA of a PMAC2.
    pub(crate) flags: u32,
    pub(crate) counter: u32,
    pub(crate) output: u32,
    enable: u32,
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

impl FlagBits {
    /// The inputs, as bits of the word.
    const fn inputs(&self) -> u32 {
        1 << self.home | 1 << self.positive | 1 << self.negative | 1 << self.fault | 1 << self.index
    }
}

impl Channel {
    /// The channel that a motor's I-variables name; `None` where Ix25 names no gate array, as for flags over the MACRO ring.
    pub(crate) fn new(layout: &Layout, variables: Variables<'_>) -> Option<Self> {
        let turbo = layout.controller == Controller::Turbo;
        let flags = variables.i(25) as u32;
        let address = flags & layout.address_mask();
        if !layout.is_io(Space::X, address) {
            return None;
        }
        let offset = |space, address| match layout.place(space, address) {
            Place::Word(offset) => offset,
            _ => NOWHERE,
        };
        let uses = if turbo { variables.i(24) as u32 } else { flags };
        Some(Self {
            address,
            flags: offset(Space::X, address),
            counter: offset(Space::X, address + 1),
            output: offset(Space::Y, address + 2),
            enable: offset(Space::X, address + 5),
            pmac2: turbo && uses & 1 != 0,
            uses,
        })
    }

    /// Whether not all of its words are in the image.
    pub(crate) fn is_last(&self) -> bool {
        self.counter == NOWHERE || self.output == NOWHERE
    }

    pub(crate) fn bits(&self) -> &'static FlagBits {
        if self.pmac2 { &PMAC2 } else { &PMAC }
    }

    /// The inputs among the bits of its flag word.
    #[inline]
    pub(crate) fn read(&self, image: &[u8]) -> u32 {
        read_u32(image, self.flags) & self.bits().inputs()
    }

    /// What they say.
    fn inputs(&self, word: u32) -> Inputs {
        let bits = self.bits();
        let is = |bit: u32| word & 1 << bit != 0;
        Inputs {
            home: is(bits.home),
            positive: is(bits.positive),
            negative: is(bits.negative),
            fault: is(bits.fault),
            index: is(bits.index),
        }
    }
}

impl Motor {
    /// The channel that a motor's I-variables name.
    #[inline]
    pub(crate) fn channel(&self, layout: &Layout, variables: Variables<'_>) -> Option<Channel> {
        match variables.are(OF_CHANNEL, &self.seen.of_channel) {
            true => self.seen.channel,
            false => Channel::new(layout, variables),
        }
    }

    /// Moves the physical position.
    fn follow(&mut self, plant: &Plant, units: i64) {
        self.x_before = self.x;
        let commanded = self.commanded + self.zero;
        let late = match self.lag.pop_front() {
            Some(late) => {
                self.lag.push_back(commanded);
                late
            }
            None => commanded,
        };
        if !self.jam {
            self.x = match self.mode {
                Loop::Closed => late,
                Loop::Killed => self.x,
                Loop::Open(n) => self.x + n / 100.0 * plant.open_loop * ms(units),
            };
            if let Some((from, to)) = plant.stroke {
                self.x = self.x.clamp(from, to);
            }
        }
        self.actual = self.x - self.zero;
        if self.mode == Loop::Killed {
            self.commanded = self.actual;
        }
    }

    /// The bits of Ix25, of Ixx24 on Turbo PMAC, that say how flags are used.
    #[inline]
    pub(crate) fn flag_uses(&self, layout: &Layout, variables: Variables<'_>) -> u32 {
        match variables.are(OF_CHANNEL, &self.seen.of_channel) {
            true => self.seen.uses,
            false => flag_uses(layout, variables),
        }
    }

    /// Notes the channel that the I-variables name.
    fn look_at_channel(&mut self, layout: &Layout, variables: Variables<'_>) {
        let seen = &mut self.seen;
        if !variables.are(OF_CHANNEL, &seen.of_channel) {
            seen.of_channel = variables.bits(OF_CHANNEL);
            seen.channel = Channel::new(layout, variables);
            seen.uses = flag_uses(layout, variables);
        }
    }

    /// Looks at the switches: which bits of its flag word the plant writes, and what they are.
    fn look_at_switches(&mut self, plant: &Plant) {
        let x = self.x;
        let inputs = Inputs {
            home: plant.home.iter().any(|&(from, to)| from <= x && x <= to),
            positive: plant.limits.is_some_and(|(_, to)| x > to),
            negative: plant.limits.is_some_and(|(from, _)| x < from),
            fault: self.faulty == (self.seen.uses & 1 << 23 != 0),
            index: is_at_index(plant, x),
        };
        self.inputs_before = self.inputs;
        self.inputs = inputs;
        self.seen.switches = inputs;
        let Some(channel) = &self.seen.channel else { return };
        let bits = channel.bits();
        let mut mask = bits.inputs() | 1 << bits.captured;
        let bit = |number: u32, is: bool| u32::from(is) << number;
        let mut word = bit(bits.home, inputs.home)
            | bit(bits.positive, inputs.positive)
            | bit(bits.negative, inputs.negative)
            | bit(bits.fault, inputs.fault)
            | bit(bits.index, inputs.index)
            | bit(bits.captured, self.captured);
        if !channel.pmac2 {
            // EQU is 0.
            mask |= 1 << 16;
            if self.active && channel.uses & 1 << 16 == 0 {
                mask |= 1 << 14;
                word |= bit(14, self.mode != Loop::Killed);
            }
        }
        self.seen.written = (mask, word);
    }

    /// Writes what the switches have said to its flag word.
    #[inline]
    pub(crate) fn write_flags(&self, image: &mut [u8]) {
        let Some(channel) = &self.seen.channel else { return };
        let (mask, bits) = self.seen.written;
        let word = read_u32(image, channel.flags) & !mask | bits;
        write_u32(image, channel.flags, word & WORD);
        if channel.pmac2 && self.active && channel.uses & 1 << 16 == 0 && channel.enable != NOWHERE
        {
            let enabled = u32::from(self.mode != Loop::Killed);
            let word = read_u32(image, channel.enable) & !(1 << 14) | enabled << 14;
            write_u32(image, channel.enable, word & WORD);
        }
    }
}

fn flag_uses(layout: &Layout, variables: Variables<'_>) -> u32 {
    variables.i(if layout.controller == Controller::Turbo { 24 } else { 25 }) as u32
}

/// Whether a position is that of an index pulse.
fn is_at_index(plant: &Plant, x: f64) -> bool {
    if plant.index == 0 {
        return false;
    }
    let whole = x as i64;
    let down = whole.saturating_sub(i64::from(x < whole as f64));
    let count = down.wrapping_sub(plant.index_at);
    count.rem_euclid(i64::from(plant.index)) == 0
}

impl Machine<'_> {
    /// A motor's channel.
    pub(crate) fn channel(&self, motor: usize) -> Option<Channel> {
        let layout = &self.setup.layout;
        self.state.motors[motor].channel(layout, Variables::of(self.memory.image, layout, motor))
    }

    /// Moves the physical positions.
    pub(crate) fn plant(&mut self, units: i64) {
        for (motor, plant) in self.state.motors.iter_mut().zip(&self.setup.plants) {
            motor.follow(plant, units);
        }
    }

    /// Writes what the switches say to the flag words. A bit that a row has set stays for this tick.
    pub(crate) fn write_inputs(&mut self) {
        let (layout, image) = (&self.setup.layout, &mut *self.memory.image);
        let State { motors, overlays, .. } = &mut *self.state;
        for (index, (motor, plant)) in motors.iter_mut().zip(&self.setup.plants).enumerate() {
            motor.look_at_channel(layout, Variables::of(image, layout, index));
            motor.look_at_switches(plant);
            motor.write_flags(image);
            let Some(channel) = &motor.seen.channel else { continue };
            for overlay in overlays.iter().filter(|overlay| overlay.offset == channel.flags) {
                let word = read_u32(image, channel.flags) & !overlay.mask;
                write_u32(image, channel.flags, (word | overlay.bits & overlay.mask) & WORD);
            }
        }
    }

    /// Takes the inputs from the flag words, where rows and forces may have changed them.
    pub(crate) fn read_inputs(&mut self) {
        let (layout, image) = (&self.setup.layout, &*self.memory.image);
        for (index, motor) in self.state.motors.iter_mut().enumerate() {
            let variables = Variables::of(image, layout, index);
            if !variables.are(OF_CHANNEL, &motor.seen.of_channel) {
                // What is read of another channel says nothing of the next cycle.
                motor.seen.read = u32::MAX;
                if let Some(channel) = Channel::new(layout, variables) {
                    motor.inputs = channel.inputs(channel.read(image));
                }
                continue;
            }
            if let Some(channel) = &motor.seen.channel {
                let read = channel.read(image);
                motor.seen.read = read;
                if read != motor.seen.written.1 & channel.bits().inputs() {
                    motor.inputs = channel.inputs(read);
                }
            }
        }
    }
}
