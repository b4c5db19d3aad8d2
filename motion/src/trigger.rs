//! Triggers: what ends a homing search or a move until a trigger (guide, Homing Search Moves; appendix B, I902).

use plcc_abi::pmac::fixed;

use crate::machine::Machine;
use crate::motor::{Inputs, Start, Waiting};
use crate::status::Latch;

/// What a capture waits for, by I902 and I903 of the channel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Capture {
    at_once: bool,
    index: bool,
    flag: bool,
    index_inverted: bool,
    flag_inverted: bool,
    /// 0 home, 1 beyond the positive end, 2 beyond the negative end, 3 fault.
    which: u32,
}

impl Capture {
    fn new(control: u32, which: u32) -> Self {
        Self {
            at_once: control & 3 == 0,
            index: control & 1 != 0,
            flag: control & 2 != 0,
            index_inverted: control & 4 != 0,
            flag_inverted: control & 8 != 0,
            which: which & 3,
        }
    }

    fn level_of_flag(&self, inputs: Inputs) -> bool {
        let flag = match self.which {
            0 => inputs.home,
            1 => inputs.positive,
            2 => inputs.negative,
            _ => inputs.fault,
        };
        flag != self.flag_inverted
    }

    fn level(&self, inputs: Inputs) -> bool {
        let index = !self.index || inputs.index != self.index_inverted;
        let flag = !self.flag || self.level_of_flag(inputs);
        index && flag
    }
}

impl Machine<'_> {
    /// The capture of a motor's channel.
    fn capture_of(&self, motor: usize) -> Option<Capture> {
        let address = self.channel(motor)?.address;
        let number = if self.turbo() {
            let gate = match address & 0xF_FF00 {
                a @ 0x78000..=0x78300 => (a - 0x78000) >> 8,
                a @ 0x79200..=0x79300 => 4 + ((a - 0x79200) >> 8),
                a @ 0x7A200..=0x7A300 => 6 + ((a - 0x7A200) >> 8),
                a @ 0x7B200..=0x7B300 => 8 + ((a - 0x7B200) >> 8),
                _ => return None,
            };
            let channel = (address & 0x1F) / 8 + 1;
            7000 + 100 * gate + 10 * channel + 2
        } else {
            // A PMAC has 16 encoder channels, at $C000 to $C03C.
            902 + 5 * (address.checked_sub(0xC000)?.min(0x3C) / 4)
        };
        Some(Capture::new(self.i(number) as u32, self.i(number + 1) as u32))
    }

    /// Looks whether the trigger of a search has come on the way of this cycle.
    pub(crate) fn look_for_trigger(&mut self, index: usize) {
        let Some(search) = self.state.motors[index].search else { return };
        if let Some(search) = &mut self.state.motors[index].search {
            search.fresh = false;
        }
        let Some(capture) = self.capture_of(index) else { return };
        let level_counts = self.channel(index).is_some_and(|channel| channel.pmac2) && self.turbo();
        let captured = if search.fresh {
            let motor = &self.state.motors[index];
            let holds = capture.at_once || level_counts && capture.level(motor.inputs);
            holds.then(|| motor.x.floor())
        } else {
            self.edge(index, capture, level_counts)
        };
        if let Some(at) = captured {
            self.trigger(index, at);
        }
    }

    /// Where on the way of this cycle the condition has become true.
    fn edge(&self, index: usize, capture: Capture, level_counts: bool) -> Option<f64> {
        let motor = &self.state.motors[index];
        let (now, before) = (motor.inputs, motor.inputs_before);
        if capture.at_once {
            return Some(motor.x.floor());
        }
        // A row or a force that holds the flag decides, wherever the motor is.
        let own = self.inputs_at(index, motor.x, now);
        let held = capture.level_of_flag(own) != capture.level_of_flag(now);
        if capture.index && !capture.index_inverted {
            return self.index_on_the_way(index, |at| {
                let flag = if held { now } else { self.inputs_at(index, at, now) };
                !capture.flag || capture.level_of_flag(flag)
            });
        }
        let rises = capture.level(now) && (level_counts || !capture.level(before));
        if held || capture.index || capture.which == 3 {
            return rises.then(|| motor.x.floor());
        }
        match self.flag_edge(index, capture) {
            Some(at) => Some(at),
            // A row or a force has set the flag.
            None => rises.then(|| motor.x.floor()),
        }
    }

    /// The inputs as they are at a position; those that do not depend on it as they are now.
    fn inputs_at(&self, index: usize, x: f64, now: Inputs) -> Inputs {
        let plant = &self.setup.plants[index];
        Inputs {
            home: plant.home.iter().any(|&(from, to)| from <= x && x <= to),
            positive: plant.limits.is_some_and(|(_, to)| x > to),
            negative: plant.limits.is_some_and(|(from, _)| x < from),
            ..now
        }
    }

    /// The first index pulse on the way whose count is as wanted.
    fn index_on_the_way(&self, index: usize, wanted: impl Fn(f64) -> bool) -> Option<f64> {
        let plant = &self.setup.plants[index];
        let motor = &self.state.motors[index];
        let (from, to) = (motor.x_before, motor.x);
        if plant.index == 0 || from == to {
            return None;
        }
        let (step, offset) = (f64::from(plant.index), plant.index_at as f64);
        let up = to > from;
        let mut k = if up {
            ((from - offset) / step).floor() + 1.0
        } else {
            ((from - offset) / step).ceil() - 1.0
        };
        // A way of very many turns in one cycle is none of a machine; the search goes on in the next.
        for _ in 0..10_000 {
            let at = offset + k * step;
            let inside = if up { at > from && at <= to } else { at < from && at >= to };
            if !inside {
                return None;
            }
            if wanted(at) {
                return Some(at);
            }
            k += if up { 1.0 } else { -1.0 };
        }
        None
    }

    /// The end of the interval that is entered or left on the way, so that the flag becomes as wanted.
    fn flag_edge(&self, index: usize, capture: Capture) -> Option<f64> {
        let plant = &self.setup.plants[index];
        let motor = &self.state.motors[index];
        let (from, to) = (motor.x_before, motor.x);
        if from == to {
            return None;
        }
        let up = to > from;
        // Whether the interval has to be entered; limits are 1 outside of theirs.
        let infinite = f64::INFINITY;
        let (enter, single): (bool, Option<(f64, f64)>) = match capture.which {
            0 => (!capture.flag_inverted, None),
            1 => (capture.flag_inverted, Some((-infinite, plant.limits?.1))),
            _ => (capture.flag_inverted, Some((plant.limits?.0, infinite))),
        };
        let intervals = single.as_slice();
        let intervals = if capture.which == 0 { plant.home.as_slice() } else { intervals };
        let mut found: Option<f64> = None;
        for &(low, high) in intervals {
            let at = match (enter, up) {
                (true, true) => (from < low && low <= to).then_some(low),
                (true, false) => (to <= high && high < from).then_some(high),
                (false, true) => (from <= high && high < to).then_some(high),
                (false, false) => (to < low && low <= from).then_some(low),
            };
            let Some(at) = at else { continue };
            let nearer = found.is_none_or(|found| if up { at < found } else { at > found });
            if nearer {
                found = Some(at);
            }
        }
        found
    }

    /// The trigger has come, at a physical position.
    fn trigger(&mut self, index: usize, at: f64) {
        let cycles = self.waiting_cycles(index);
        let offset = self.motor_i(index, 26) / 16.0;
        let Some(search) = self.state.motors[index].search.take() else { return };
        let motor = &mut self.state.motors[index];
        motor.searching = false;
        motor.captured = true;
        motor.capture = at;
        let start = if search.home {
            motor.move_zero(at + offset);
            Start::BehindHome
        } else {
            Start::BehindTrigger((at - motor.zero) + search.offset, search.speed)
        };
        motor.wait(Waiting { cycles, age: search.age, start, programmed: search.programmed });
        // Older ones would not begin any more.
        let zero = motor.zero;
        if search.home {
            self.latch(index, Latch::HomeComplete, true);
            self.show_zero(index, zero);
        }
        if let Some(channel) = self.channel(index) {
            let capture = fixed::bits(at) as u32;
            self.write_channel(channel.address + 3, capture);
            let bit = channel.bits().captured;
            let word = self.word(channel.flags) | 1 << bit;
            self.set_word(channel.flags, word);
        }
    }

    /// The register that says where in counts of the encoder a motor's zero is.
    pub(crate) fn show_zero(&mut self, index: usize, zero: f64) {
        self.set_word(self.setup.motors[index].home_offset, fixed::bits(zero) as u32);
    }
}
