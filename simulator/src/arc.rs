//! Arcs: the way of two axes on a circle (cnc-side 1.13). Angles are computed by `libm` in software, so that they are the same on
//! every computer.

use serde::{Deserialize, Serialize};

/// The planes of arcs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Plane {
    /// G17: X Y, centre I J.
    #[default]
    Xy,
    /// G18: Z X, centre K I.
    Zx,
    /// G19: Y Z, centre J K.
    Yz,
}

impl Plane {
    /// Its axes.
    pub(crate) fn letters(self) -> [char; 2] {
        match self {
            Self::Xy => ['X', 'Y'],
            Self::Zx => ['Z', 'X'],
            Self::Yz => ['Y', 'Z'],
        }
    }

    /// The places of its centre's words among I, J and K.
    pub(crate) fn centre(self) -> [usize; 2] {
        match self {
            Self::Xy => [0, 1],
            Self::Zx => [2, 0],
            Self::Yz => [1, 2],
        }
    }
}

/// How an arc is given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Given {
    /// By its centre, from the start on, in nanometres.
    Centre([i128; 2]),
    /// By its radius; a negative one is the longer arc.
    Radius(i128),
}

/// A circle, and in which direction it is gone along.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Circle {
    /// The numbers of the two axes.
    pub(crate) axes: [usize; 2],
    centre: [f64; 2],
    /// G2.
    clockwise: bool,
}

impl Eq for Circle {}

impl Circle {
    /// The circle of an arc from `start` to `end` in its plane.
    pub(crate) fn new(
        axes: [usize; 2],
        given: Given,
        clockwise: bool,
        start: [i128; 2],
        end: [i128; 2],
    ) -> Self {
        let [x, y] = start.map(|position| position as f64);
        let centre = match given {
            Given::Centre([i, j]) => [x + i as f64, y + j as f64],
            Given::Radius(radius) => {
                let [end_x, end_y] = end.map(|position| position as f64);
                let (u, v) = (end_x - x, end_y - y);
                let (chord, r) = (libm::sqrt(u * u + v * v), radius as f64);
                let height = libm::sqrt((r * r - chord * chord / 4.0).max(0.0));
                // Plus for G2 with R above 0, and for G3 with R below.
                let height = if clockwise == (radius > 0) { height } else { -height };
                let (mid_x, mid_y) = (x + u / 2.0, y + v / 2.0);
                match chord > 0.0 {
                    true => [mid_x + height * v / chord, mid_y - height * u / chord],
                    false => [x, y],
                }
            }
        };
        Self { axes, centre, clockwise }
    }

    /// The radius at a position.
    pub(crate) fn radius(&self, [x, y]: [i128; 2]) -> f64 {
        let [centre_x, centre_y] = self.centre;
        let (u, v) = (x as f64 - centre_x, y as f64 - centre_y);
        libm::sqrt(u * u + v * v)
    }

    fn angle(&self, [x, y]: [i128; 2]) -> f64 {
        let [centre_x, centre_y] = self.centre;
        libm::atan2(y as f64 - centre_y, x as f64 - centre_x)
    }

    /// The arc from `start` to `end` on this circle.
    pub(crate) fn arc(self, start: [i128; 2], end: [i128; 2]) -> Arc {
        let (from, to) = (self.angle(start), self.angle(end));
        let sweep = if self.clockwise { from - to } else { to - from };
        let sweep = if sweep > 0.0 { sweep } else { sweep + 2.0 * std::f64::consts::PI };
        Arc { circle: self, radius: self.radius(start), from, sweep }
    }
}

/// An arc.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Arc {
    pub(crate) circle: Circle,
    radius: f64,
    from: f64,
    /// The angle between its ends, above 0.
    sweep: f64,
}

impl Eq for Arc {}

impl Arc {
    /// The length of its way, with the sum of the squares of what other axes go.
    pub(crate) fn length(&self, others: u128) -> i128 {
        let along = self.radius * self.sweep;
        libm::floor(libm::sqrt(along * along + others as f64)) as i128
    }

    /// Where one of its axes is at a part of the way.
    pub(crate) fn position(&self, axis: usize, part: f64) -> Option<i128> {
        let Circle { axes: [first, second], centre: [x, y], clockwise } = self.circle;
        let turned = self.sweep * part;
        let angle = if clockwise { self.from - turned } else { self.from + turned };
        let position = if axis == first {
            x + self.radius * libm::cos(angle)
        } else if axis == second {
            y + self.radius * libm::sin(angle)
        } else {
            return None;
        };
        Some(libm::round(position) as i128)
    }
}
