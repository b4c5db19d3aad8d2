//! The spindles (cnc-side 3.16, 3.17).

use super::speed::spindle_override;
use super::state::State;
use super::{Nct, Step};
use crate::ramp;

/// RH061 at 10 V.
const FULL_SCALE: i64 = 4096;

impl Nct {
    pub(super) fn spindles(&self, state: &mut State, step: &Step<'_, '_>) {
        let percent = spindle_override(step);
        let machine_on = state.machine_on;
        let spindles = state.spindles.iter_mut().zip([65, 66]).zip(step.spindle_codes).enumerate();
        for (at, ((spindle, byte), (value, voltage))) in spindles {
            let entry = self.setup.spindle(at);
            let value = match value {
                0 => 0,
                value => (value * percent / 100).max(entry.min).min(entry.rpm),
            };
            spindle.commanded = value as u16;
            let is_enabled = step.y(byte, 2) && machine_on;
            let target = if !is_enabled {
                0
            } else if step.y(byte, 4) {
                (-voltage * entry.rpm / FULL_SCALE).clamp(-entry.rpm, entry.rpm)
            } else if step.y(byte, 3) {
                value
            } else {
                -value
            };
            spindle.command = match is_enabled {
                true => ramp::toward(spindle.command, target.into(), entry, step.now.tick_ns),
                false => 0,
            };
            let scale = ramp::scale(entry);
            let reached = spindle.command == i128::from(target) * scale;
            spindle.has_command = reached && target == spindle.target;
            spindle.target = target;
            let mut delayed = [spindle.command];
            spindle.history.delay(&mut delayed);
            let [actual] = delayed;
            spindle.actual = (actual / scale) as i64;
            let tolerance = (target.abs() / 10).max(10);
            spindle.is_at_speed = (spindle.actual - target).abs() <= tolerance;
            spindle.stands = spindle.actual.abs() < 10;
        }
    }
}
