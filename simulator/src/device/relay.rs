//! A relay: an input that follows an output some ticks later.

use super::{DeviceState, Line, Surroundings};
use crate::access::Access;

#[derive(Clone, Debug)]
pub(super) struct Relay {
    pub(super) output: Line,
    pub(super) input: Line,
    pub(super) on: u64,
    pub(super) off: u64,
}

impl Relay {
    pub(super) fn step(
        &self,
        state: &mut DeviceState,
        around: &Surroundings<'_>,
        access: &mut dyn Access,
    ) {
        let coil = self.output.is_on(around, access);
        if !state.jammed {
            if coil == (state.at != 0) {
                state.differs = None;
            } else {
                let waited = state.differs.map_or(0, |waited| waited.saturating_add(1));
                state.differs = Some(waited);
                if waited >= if coil { self.on } else { self.off } {
                    (state.at, state.differs) = (coil.into(), None);
                }
            }
        }
        self.input.write(access, state.at != 0);
    }
}
