//! Units of time, and pieces of a motion: polynomials of the third degree in milliseconds.

use plcc_abi::pmac::arithmetic::finite;
use serde::{Deserialize, Serialize};

/// The longest duration: far behind the end of any run, and small enough that sums of a few do not overflow.
pub(crate) const LONGEST: i64 = 1 << 59;

/// A duration in milliseconds. It is exact for all durations of moves.
#[inline]
pub(crate) fn ms(units: i64) -> f64 {
    units as f64 / 8_388_608.0
}

/// A duration in units of 2^-23 ms, to the nearest, ties away from zero.
#[inline]
pub(crate) fn units(ms: f64) -> i64 {
    rnd(ms * 8_388_608.0)
}

/// The nearest integer, ties away from zero, as a duration.
#[inline]
pub(crate) fn rnd(value: f64) -> i64 {
    (value.round() as i64).clamp(-LONGEST, LONGEST)
}

/// A piece of a motion: its duration and the coefficients of its position in counts, lowest power first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Piece {
    pub(crate) duration: i64,
    pub(crate) a: [f64; 4],
}

/// The position of a polynomial after a time in ms.
#[inline]
pub(crate) fn position(a: &[f64; 4], t: f64) -> f64 {
    finite(((a[3] * t + a[2]) * t + a[1]) * t + a[0])
}

/// The velocity of a polynomial after a time in ms, in counts/ms.
#[inline]
pub(crate) fn velocity(a: &[f64; 4], t: f64) -> f64 {
    finite((3.0 * a[3] * t + 2.0 * a[2]) * t + a[1])
}

/// Makes the pieces of an S-curve from one velocity to another: `put` gets the duration and the coefficients of
/// each. `ta` is the whole time, `ts` that of each half of the curve, 2·ts ≤ ta.
pub(crate) fn ramp(
    p0: f64,
    v0: f64,
    v1: f64,
    (ta, ts): (i64, i64),
    mut put: impl FnMut(i64, [f64; 4]),
) {
    let (whole, half) = (ms(ta), ms(ts));
    let middle = ta - 2 * ts;
    let a = (v1 - v0) / (whole - half);
    let l = ms(middle);
    if ts > 0 {
        put(ts, [p0, v0, 0.0, (a / half) / 6.0]);
    }
    let p = p0 + v0 * half + a * half * half / 6.0;
    let v = v0 + a * half / 2.0;
    if middle > 0 {
        put(middle, [p, v, a / 2.0, 0.0]);
    }
    let p = p + v * l + a * l * l / 2.0;
    let v = v + a * l;
    if ts > 0 {
        put(ts, [p, v, a / 2.0, -(a / half) / 6.0]);
    }
}

/// Pieces one behind the other that one motor goes through alone: a jog, a search, a deceleration.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Row {
    pieces: [Piece; 10],
    count: u8,
    at: u8,
    /// The time since the present piece began.
    time: i64,
    /// Where the motor is at the end; `None` for a motion without end.
    end: Option<f64>,
}

impl Row {
    pub(crate) fn push(&mut self, duration: i64, a: [f64; 4]) {
        if let Some(slot) = self.pieces.get_mut(usize::from(self.count)) {
            *slot = Piece { duration, a };
            self.count += 1;
        }
    }

    pub(crate) fn ramp(&mut self, p0: f64, v0: f64, v1: f64, times: (i64, i64)) {
        ramp(p0, v0, v1, times, |duration, a| self.push(duration, a));
    }

    pub(crate) fn end_at(&mut self, end: f64) {
        self.end = Some(end);
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.count == 0
    }

    pub(crate) fn has_end(&self) -> bool {
        self.end.is_some()
    }

    /// Lets a time pass. Gives the position, and whether the row is over.
    pub(crate) fn advance(&mut self, by: i64) -> (f64, bool) {
        self.time = self.time.saturating_add(by);
        while let Some(piece) = self.present()
            && self.time >= piece.duration
        {
            self.time -= piece.duration;
            self.at += 1;
        }
        match (self.present(), self.end) {
            (Some(piece), _) => (position(&piece.a, ms(self.time)), false),
            (None, end) => (finite(end.unwrap_or(0.0)), true),
        }
    }

    fn present(&self) -> Option<Piece> {
        let pieces = self.pieces.get(..usize::from(self.count))?;
        pieces.get(usize::from(self.at)).copied()
    }

    /// The velocity now, in counts/ms of the time in which the row runs.
    pub(crate) fn velocity(&self) -> f64 {
        self.present().map_or(0.0, |piece| velocity(&piece.a, ms(self.time)))
    }

    /// Moves all of it, since the motor's zero has moved.
    pub(crate) fn shift(&mut self, by: f64) {
        for piece in &mut self.pieces {
            piece.a[0] = finite(piece.a[0] + by);
        }
        if let Some(end) = &mut self.end {
            *end = finite(*end + by);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ramp_reaches_its_velocity_and_the_mean_way() {
        let mut row = Row::default();
        let (ta, ts) = (units(100.0), units(50.0));
        row.ramp(5.0, 0.0, 2.0, (ta, ts));
        row.push(LONGEST, [105.0, 2.0, 0.0, 0.0]);
        // Half of the time: half of the velocity, and a sixth of the way that full speed would have gone.
        let (half, _) = row.advance(units(50.0));
        assert!((half - (5.0 + 2.0 * 50.0 / 6.0)).abs() < 1e-9, "{half}");
        assert!((row.velocity() - 1.0).abs() < 1e-12);
        assert_eq!(row.advance(units(50.0)), (105.0, false));
        assert_eq!(row.velocity(), 2.0);
        assert_eq!(row.advance(units(10.0)), (125.0, false));
    }

    #[test]
    fn what_is_left_of_a_piece_goes_to_the_next_and_is_lost_at_the_end() {
        let mut row = Row::default();
        row.push(10, [0.0, 8_388_608.0, 0.0, 0.0]);
        row.push(10, [100.0, 8_388_608.0, 0.0, 0.0]);
        row.end_at(7.0);
        assert_eq!(row.advance(13), (103.0, false));
        assert_eq!(row.advance(7), (7.0, true));
    }

    #[test]
    fn rounding_goes_away_from_zero() {
        assert_eq!([rnd(0.5), rnd(-0.5), rnd(2.4), rnd(f64::MAX)], [1, -1, 2, LONGEST]);
        assert_eq!(rnd(f64::NAN), 0);
    }
}
