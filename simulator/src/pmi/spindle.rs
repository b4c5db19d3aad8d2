//! The spindle, which follows @SPDAC with a ramp (cnc-side 2.17).

use super::Pmi;
use super::state::State;
use crate::context::Context;
use crate::setup::Setup;

/// @SPDAC at 10 V.
const FULL_SCALE: i128 = 32_767;

impl Pmi {
    pub(super) fn spindle(&self, state: &mut State, now: &mut Context<'_>) {
        let spindle = self.setup.spindle(0);
        let voltage = i128::from(self.variables.spindle_voltage.read(now.access));
        let target = match state.is_on() {
            true => voltage * i128::from(spindle.rpm) / FULL_SCALE,
            false => 0,
        };
        state.spindle = crate::ramp::toward(state.spindle, target, spindle, now.tick_ns);
    }
}

impl State {
    /// The magnitude of the spindle's speed, cut off.
    pub(super) fn rpm(&self, setup: &Setup) -> i64 {
        (self.spindle.abs() / crate::ramp::scale(setup.spindle(0))) as i64
    }
}
