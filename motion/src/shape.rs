//! The shape of the moves of single motors: jogs, searches, RAPID (guide, appendix B, Ix19 to Ix22).

use crate::units::{LONGEST, Row, ms, units};

/// The acceleration of a motor's own moves.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shape {
    /// The least time of acceleration in ms.
    ta: f64,
    /// Half of the S-curve's part of it.
    ts: f64,
    /// The greatest acceleration in counts/ms², not above 0 for none.
    limit: f64,
}

impl Shape {
    /// The shape by Ix19, Ix20 and Ix21.
    pub(crate) fn new(limit: f64, ta: f64, ts: f64) -> Self {
        let ta = ta.max(2.0 * ts);
        Self { ta: if ta > 0.0 { ta } else { 0.5 }, ts, limit }
    }

    fn rho(&self) -> f64 {
        self.ta / (self.ta - self.ts)
    }

    /// How long a change of velocity takes.
    fn time(&self, change: f64) -> f64 {
        if self.limit <= 0.0 {
            return self.ta;
        }
        self.ta.max(change.abs() * self.rho() / self.limit)
    }

    /// A time of acceleration and its S-curve's part in units.
    fn units(&self, time: f64) -> (i64, i64) {
        let ta = units(time).max(1);
        (ta, units(time * (self.ts / self.ta)).min(ta / 2))
    }

    /// On and on at a velocity.
    pub(crate) fn endless(&self, row: &mut Row, p: f64, v0: f64, w: f64) {
        let times = self.units(self.time(w - v0));
        row.ramp(p, v0, w, times);
        row.push(LONGEST, [p + (v0 + w) / 2.0 * ms(times.0), w, 0.0, 0.0]);
    }

    /// To a stop.
    pub(crate) fn stop(&self, row: &mut Row, p: f64, v0: f64) -> f64 {
        let times = self.units(self.time(v0));
        row.ramp(p, v0, 0.0, times);
        p + v0 / 2.0 * ms(times.0)
    }

    /// To a target at a speed.
    pub(crate) fn to(&self, row: &mut Row, p: f64, v0: f64, target: f64, speed: f64) {
        if v0 == 0.0 {
            return self.rest_to(row, p, target, speed);
        }
        let way = target - (p + v0 * self.time(v0) / 2.0);
        let sign = if way > 0.0 {
            1.0
        } else if way < 0.0 {
            -1.0
        } else {
            0.0
        };
        let w = sign * speed;
        let (t1, t2) = (self.time(w - v0), self.time(w));
        let rest = (target - p) - (v0 + w) / 2.0 * t1 - w / 2.0 * t2;
        if sign != 0.0 && speed != 0.0 && rest * sign >= 0.0 {
            let first = self.units(t1);
            row.ramp(p, v0, w, first);
            let between = units(rest / w);
            if between > 0 {
                row.push(between, [p + (v0 + w) / 2.0 * ms(first.0), w, 0.0, 0.0]);
            }
            let last = self.units(t2);
            row.ramp(target - w / 2.0 * ms(last.0), w, 0.0, last);
            row.end_at(target);
        } else {
            let e = self.stop(row, p, v0);
            self.rest_to(row, e, target, speed);
        }
    }

    fn rest_to(&self, row: &mut Row, p: f64, target: f64, speed: f64) {
        let way = target - p;
        let d = way.abs();
        if d == 0.0 || speed == 0.0 {
            row.end_at(p);
            return;
        }
        let full = self.time(speed);
        let (t, c) = if d >= speed * full {
            (full, d / speed - full)
        } else if self.limit <= 0.0 || (d / self.ta) * self.rho() / self.limit <= self.ta {
            (self.ta, 0.0)
        } else {
            ((d * self.rho() / self.limit).sqrt(), 0.0)
        };
        let times = self.units(t);
        let tc = units(c);
        let w = way / ms(times.0 + tc);
        row.ramp(p, 0.0, w, times);
        if tc > 0 {
            row.push(tc, [p + w / 2.0 * ms(times.0), w, 0.0, 0.0]);
        }
        row.ramp(target - w / 2.0 * ms(times.0), w, 0.0, times);
        row.end_at(target);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs a row in cycles of 1 ms; gives the largest velocity and the end.
    fn run(row: &mut Row) -> (f64, f64, usize) {
        let mut before = row.advance(0).0;
        let mut fastest: f64 = 0.0;
        for cycle in 1..100_000 {
            let (now, over) = row.advance(1 << 23);
            fastest = fastest.max((now - before).abs());
            before = now;
            if over {
                return (fastest, now, cycle);
            }
        }
        (fastest, before, 0)
    }

    #[test]
    fn a_move_ends_exactly_and_keeps_its_limits() {
        for (ta, ts, limit) in [(0.0, 50.0, 0.015_625), (100.0, 10.0, 1.0), (0.0, 0.0, 0.0)] {
            let shape = Shape::new(limit, ta, ts);
            for (p, v0, target, speed) in [
                (0.0, 0.0, 10_000.0, 32.0),
                (0.0, 0.0, -3.0, 32.0),
                (5.5, 10.0, 20_000.25, 32.0),
                (0.0, 30.0, -100.0, 8.0),
                (0.0, -30.0, -100_000.0, 8.0),
            ] {
                let mut row = Row::default();
                shape.to(&mut row, p, v0, target, speed);
                let (fastest, end, _) = run(&mut row);
                assert_eq!(end, target);
                let allowed = f64::max(speed, f64::abs(v0)) * 1.0001;
                assert!(fastest <= allowed, "{fastest} {p} {v0} {target} {speed}");
            }
        }
    }

    #[test]
    fn the_default_jog_of_10000_counts_takes_the_time_of_its_trapezoid() {
        // A(32) = 32·2/0.015625 = 4096 ms is too long, so that T = sqrt(10000·2/0.015625) = 1131.37 ms.
        let shape = Shape::new(0.015_625, 0.0, 50.0);
        let mut row = Row::default();
        shape.to(&mut row, 0.0, 0.0, 10_000.0, 32.0);
        let (_, _, cycles) = run(&mut row);
        assert_eq!(cycles, 2263);
    }

    #[test]
    fn no_way_and_no_speed_end_at_once() {
        let shape = Shape::new(1.0, 10.0, 0.0);
        let mut row = Row::default();
        shape.to(&mut row, 3.0, 0.0, 3.0, 32.0);
        assert!(row.is_empty());
        shape.to(&mut row, 3.0, 0.0, 4.0, 0.0);
        assert!(row.is_empty());
    }
}
