//! The spindles, their orientation and synchronism (cnc-side 3.16 to 3.18).

use super::speed::spindle_override;
use super::state::{SpindleState, State};
use super::{Nct, Step};
use crate::length::ticks;
use crate::ramp;
use crate::setup::Spindle;

/// RH061 at 10 V.
const FULL_SCALE: i64 = 4096;

/// What a spindle is asked for in a step.
struct Asked {
    /// The NC has it at all (Y652 or Y662, I540).
    is_enabled: bool,
    /// Y651: to be oriented.
    orients: bool,
    /// Y655: to follow the other one, with Y656 backwards.
    follows: bool,
    backwards: bool,
    /// Y654: by the voltage.
    by_voltage: bool,
    /// Y653.
    is_positive: bool,
    /// The speed of RH061.
    voltage_speed: i64,
    /// RH060 with S%.
    value: i64,
}

impl Nct {
    pub(super) fn spindles(&self, state: &mut State, step: &Step<'_, '_>) {
        let percent = spindle_override(step);
        for (at, (byte, (value, voltage))) in
            [65, 66].into_iter().zip(step.spindle_codes).enumerate()
        {
            let entry = self.setup.spindle(at);
            let value = match value {
                0 => 0,
                value => (value * percent / 100).max(entry.min).min(entry.rpm),
            };
            let asked = Asked {
                is_enabled: step.y(byte, 2) && state.machine_on,
                orients: step.y(byte, 1),
                follows: step.y(byte, 5),
                backwards: step.y(byte, 6),
                by_voltage: step.y(byte, 4),
                is_positive: step.y(byte, 3),
                voltage_speed: (-voltage * entry.rpm / FULL_SCALE).clamp(-entry.rpm, entry.rpm),
                value,
            };
            let [first, second] = &mut state.spindles;
            // Spindle 1 steps first.
            let (spindle, other) = if at == 0 { (first, second) } else { (second, first) };
            self.spindle_step(spindle, other.actual, &asked, entry, step);
        }
    }

    fn spindle_step(
        &self,
        spindle: &mut SpindleState,
        other: i64,
        asked: &Asked,
        entry: &Spindle,
        step: &Step<'_, '_>,
    ) {
        let (tick, tick_ns) = (step.now.tick, step.now.tick_ns);
        spindle.commanded = asked.value as u16;
        let orients = asked.is_enabled && asked.orients;
        let follows = asked.is_enabled && asked.follows && !orients;
        if spindle.orients != orients || spindle.follows != follows {
            (spindle.turns_since, spindle.reached_in) = (None, None);
        }
        (spindle.orients, spindle.follows) = (orients, follows);
        let target = if !asked.is_enabled {
            0
        } else if orients {
            asked.voltage_speed
        } else if follows {
            if asked.backwards { -other } else { other }
        } else if asked.by_voltage {
            asked.voltage_speed
        } else if asked.is_positive {
            asked.value
        } else {
            -asked.value
        };
        if orients && spindle.turns_since.is_none() && target != 0 {
            spindle.turns_since = Some(tick);
        }
        let waited = spindle.turns_since.map(|since| tick.saturating_sub(since));
        let time = ticks(entry.orient_ns, tick_ns);
        let begins = spindle.reached_in.is_none() && waited.is_some_and(|waited| waited >= time);
        if begins {
            spindle.reached_in = Some(tick);
        }
        let stands = orients && spindle.reached_in.is_some();
        let target = if stands { 0 } else { target };
        spindle.command = match asked.is_enabled && !stands {
            true => ramp::toward(spindle.command, target.into(), entry, tick_ns),
            false => 0,
        };
        let scale = ramp::scale(entry);
        let reached = spindle.command == i128::from(target) * scale;
        // In the step in which it is oriented, the target is another one than before.
        let compared = if begins && stands { spindle.target } else { target };
        spindle.has_command = reached && target == spindle.target && !(begins && stands);
        spindle.target = target;
        let mut delayed = [spindle.command];
        spindle.history.delay(&mut delayed);
        let [actual] = delayed;
        spindle.actual = (actual / scale) as i64;
        let tolerance = (compared.abs() / 10).max(10);
        spindle.is_at_speed = (spindle.actual - compared).abs() <= tolerance;
        spindle.stands = spindle.actual.abs() < 10;
        if follows && spindle.turns_since.is_none() && spindle.is_at_speed {
            spindle.turns_since = Some(tick);
            // Without a time for it, the other spindle is followed at once.
            spindle.reached_in = (time == 0).then_some(tick);
        }
        let lag = ticks(entry.lag_ns, tick_ns);
        let settled = spindle.reached_in.is_some_and(|reached| tick.saturating_sub(reached) >= lag);
        spindle.is_oriented = spindle.reached_in.is_some();
        spindle.is_positioned = orients && settled;
        spindle.is_synchronous = follows && settled;
    }
}
