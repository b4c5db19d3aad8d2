//! The ramp of a spindle. Speeds are kept times the nanoseconds of the ramp, so that they stay exact.

use crate::setup::Spindle;

/// By what a kept speed is divided.
pub(crate) fn scale(spindle: &Spindle) -> i128 {
    i128::from(spindle.ramp_ns.max(1))
}

/// The kept speed after a tick on the way to `target` revolutions a minute.
pub(crate) fn toward(kept: i128, target: i128, spindle: &Spindle, tick_ns: u64) -> i128 {
    let target = target.saturating_mul(scale(spindle));
    let step = i128::from(spindle.rpm).saturating_mul(tick_ns.into());
    if spindle.ramp_ns == 0 || target.saturating_sub(kept).saturating_abs() <= step {
        return target;
    }
    if target > kept { kept + step } else { kept - step }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spindle_reaches_its_speed_after_its_ramp() {
        let spindle = Spindle {
            rpm: 5500,
            min: 0,
            ramp_ns: 2_000_000_000,
            lag_ns: 0,
            orient_ns: 0,
            encoder: true,
        };
        let mut kept = 0;
        for tick in 1..=100 {
            kept = toward(kept, 5500, &spindle, 20_000_000);
            assert_eq!(kept / scale(&spindle), 55 * tick);
        }
        assert_eq!(toward(kept, 5500, &spindle, 20_000_000), kept);
        assert_eq!(toward(0, -3, &Spindle { ramp_ns: 0, ..spindle }, 1), -3);
    }
}
