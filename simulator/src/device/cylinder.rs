//! A cylinder: it moves by its coils, and has a switch at each end.

use super::{DeviceState, Line, Surroundings};
use crate::access::Access;

#[derive(Clone, Debug)]
pub(super) struct Cylinder {
    pub(super) extend: Line,
    /// Without this coil a spring retracts it.
    pub(super) retract: Option<Line>,
    pub(super) extended: Option<Line>,
    pub(super) retracted: Option<Line>,
    pub(super) extend_ticks: u64,
    pub(super) retract_ticks: u64,
}

impl Cylinder {
    /// The stroke in parts of which both directions make a whole number in a step.
    pub(super) fn stroke(&self) -> u64 {
        self.extend_ticks.saturating_mul(self.retract_ticks)
    }

    pub(super) fn step(
        &self,
        state: &mut DeviceState,
        around: &Surroundings<'_>,
        access: &mut dyn Access,
    ) {
        if !state.jammed {
            let [extend, retract] = state.coils;
            let retract = if self.retract.is_some() { retract } else { !extend };
            state.at = match (extend, retract) {
                (true, false) => state.at.saturating_add(self.retract_ticks).min(self.stroke()),
                (false, true) => state.at.saturating_sub(self.extend_ticks),
                _ => state.at,
            };
        }
        let retract = self.retract.as_ref().is_some_and(|line| line.is_on(around, access));
        state.coils = [self.extend.is_on(around, access), retract];
        if let Some(line) = &self.extended {
            line.write(access, state.at >= self.stroke());
        }
        if let Some(line) = &self.retracted {
            line.write(access, state.at == 0);
        }
    }
}
