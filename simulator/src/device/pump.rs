//! A pump with a pressure switch.

use super::{DeviceState, Line, Surroundings};
use crate::access::Access;

#[derive(Clone, Debug)]
pub(super) struct Pump {
    pub(super) output: Line,
    pub(super) input: Line,
    pub(super) rise: u64,
    pub(super) fall: u64,
    /// At how many per cent of the pressure the switch closes.
    pub(super) on: u32,
    /// At how many it opens.
    pub(super) off: u32,
}

impl Pump {
    /// The full pressure, in parts of which a rise and a fall make a whole number in a step.
    pub(super) fn whole(&self) -> u64 {
        self.rise.saturating_mul(self.fall)
    }

    pub(super) fn step(
        &self,
        state: &mut DeviceState,
        around: &Surroundings<'_>,
        access: &mut dyn Access,
    ) {
        let whole = self.whole();
        if !state.jammed {
            let [coil, _] = state.coils;
            state.at = match coil {
                true => state.at.saturating_add(self.fall).min(whole),
                false => state.at.saturating_sub(self.rise),
            };
            let part = |percent: u32| u128::from(whole) * u128::from(percent);
            let pressure = u128::from(state.at) * 100;
            if pressure >= part(self.on) {
                state.closed = true;
            } else if pressure <= part(self.off) {
                state.closed = false;
            }
        }
        state.coils = [self.output.is_on(around, access), false];
        self.input.write(access, state.closed);
    }
}
