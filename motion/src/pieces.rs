//! PVT moves and splines: pieces of the third degree between points with given velocities (guide, PVT-Mode Moves, Splined
//! Moves).

use crate::sequence::{Advance, Sequence, SequenceKind};
use crate::units::ms;

/// The coefficients of a piece from one point and velocity to another in `t` ms.
pub(crate) fn between((p0, v0): (f64, f64), (p1, v1): (f64, f64), t: f64) -> [f64; 4] {
    let mean = (p1 - p0) / t;
    [p0, v0, (3.0 * mean - 2.0 * v0 - v1) / t, ((v0 + v1) - 2.0 * mean) / (t * t)]
}

/// What comes when a piece is over.
enum Next {
    /// A piece, with which perhaps a move begins.
    Piece { begins: bool },
    /// The end.
    Over,
    /// What is not yet calculated.
    Missing,
}

impl Sequence {
    /// Takes all pieces that are over.
    pub(crate) fn advance_pieces(&mut self) -> Advance {
        let mut advance = Advance::default();
        while self.time >= self.next_begin {
            let next = match self.kind {
                SequenceKind::Pvt => self.next_pvt(),
                _ => self.next_spline(),
            };
            match next {
                Next::Piece { begins } => {
                    self.next_piece += 1;
                    if begins {
                        self.begun += 1;
                        advance.begun += 1;
                    }
                }
                Next::Over => {
                    advance.over = true;
                    break;
                }
                Next::Missing => {
                    self.time = self.next_begin;
                    advance.late = true;
                    break;
                }
            }
        }
        advance
    }

    /// Notes that a piece of this duration begins where the last one ends.
    pub(super) fn begin_piece(&mut self, duration: i64) {
        self.bounds[0] = self.next_begin;
        (self.phase, self.phases) = (0, 1);
        self.next_begin = self.next_begin.saturating_add(duration);
    }

    fn next_pvt(&mut self) -> Next {
        let k = self.begun + 1;
        if k > self.calculated {
            return if self.closed { Next::Over } else { Next::Missing };
        }
        let duration = self.at(k).tm;
        self.begin_piece(duration);
        let t = ms(duration);
        for motor in 0..self.pieces.len() {
            if self.member[motor] {
                let before = match k {
                    1 => (self.start[motor], 0.0),
                    _ => (self.at(k - 1).p[motor], self.at(k - 1).v[motor]),
                };
                let end = (self.at(k).p[motor], self.at(k).v[motor]);
                self.pieces[motor][0] = between(before, end, t);
            }
        }
        Next::Piece { begins: true }
    }

    /// Piece j goes from waypoint j-1 to waypoint j; the first begins at the start, the last ends at the end.
    fn next_spline(&mut self) -> Next {
        let j = self.next_piece;
        let last = self.calculated + 1;
        match self.closed {
            true if j > last => return Next::Over,
            false if j + 1 > self.calculated => return Next::Missing,
            _ => {}
        }
        let duration = self.at(j.clamp(1, self.calculated)).tm;
        self.begin_piece(duration);
        let t = ms(duration);
        for motor in 0..self.pieces.len() {
            if self.member[motor] {
                let begin = match j {
                    0 => (self.start[motor], 0.0),
                    _ => self.waypoint(j - 1, motor),
                };
                let end = match j == last {
                    true => (self.last().p[motor], 0.0),
                    false => self.waypoint(j, motor),
                };
                self.pieces[motor][0] = between(begin, end, t);
            }
        }
        Next::Piece { begins: j < self.calculated }
    }

    /// The position of a spline at the end of its move i, and the velocity.
    fn waypoint(&self, i: u32, motor: usize) -> (f64, f64) {
        let point = |i: u32| match i {
            0 => self.start[motor],
            _ => self.at(i.min(self.calculated)).p[motor],
        };
        let time = |i: u32| self.at(i.clamp(1, self.calculated)).time;
        let (before, here, after) = (point(i.saturating_sub(1)), point(i), point(i + 1));
        if self.kind == SequenceKind::Spline1 {
            return waypoint(before, here, after, self.last().time);
        }
        let (a, b) = (time(i), time(i + 1));
        let (f, e) = ((after - here) / b, (here - before) / a);
        (here + a * b / (a + b) * (f - e) / 3.0, (b * e + a * f) / (a + b))
    }
}

/// The position and velocity of a spline at one of three points that are the same time apart.
pub(crate) fn waypoint(before: f64, here: f64, after: f64, time: f64) -> (f64, f64) {
    ((before + 4.0 * here + after) / 6.0, (after - before) / (2.0 * time))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::{position, velocity};

    #[test]
    fn a_piece_has_the_positions_and_velocities_of_its_ends() {
        // The guide's example: 5 units in 300 ms to 50 units a second (`X5:50`), 2000 counts a unit.
        let a = between((0.0, 0.0), (10_000.0, 100.0), 300.0);
        assert_eq!(a[..3], [0.0, 0.0, 0.0]);
        // The guide's quotient, but for the rounding of the operations in their order.
        assert!((a[3] - 10_000.0 / 27_000_000.0).abs() < 1e-18, "{}", a[3]);
        let (p, v) = (position(&a, 300.0), velocity(&a, 300.0));
        assert!((p - 10_000.0).abs() < 1e-9 && (v - 100.0).abs() < 1e-9, "{p} {v}");
    }

    #[test]
    fn a_spline_passes_its_points_at_a_sixth_of_their_distance() {
        assert_eq!(waypoint(0.0, 0.0, 60.0, 10.0), (10.0, 3.0));
        assert_eq!(waypoint(0.0, 60.0, 120.0, 10.0), (60.0, 6.0));
    }
}
