//! Arcs (guide, Circular Interpolation).

use plcc_abi::pmac::motion::Axis;
use serde::{Deserialize, Serialize};

use crate::machine::Machine;
use crate::moves::Words;

/// An arc in the plane of two axes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Arc {
    /// The axes of the plane, by number.
    plane: (u8, u8),
    center: (f64, f64),
    /// The angle of its beginning, and how far it goes, counter-clockwise.
    begin: f64,
    sweep: f64,
    /// The radius at its beginning and at its end.
    radii: (f64, f64),
}

/// The normal of the plane: I, J or K as 0, 1 or 2, and whether it is negative.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Normal {
    pub(crate) component: u8,
    pub(crate) negative: bool,
}

impl Default for Normal {
    /// NORMAL K-1.
    fn default() -> Self {
        Self { component: 2, negative: true }
    }
}

impl Normal {
    /// The axes of the plane.
    fn plane(self) -> (Axis, Axis) {
        match self.component {
            0 => (Axis::Y, Axis::Z),
            1 => (Axis::Z, Axis::X),
            _ => (Axis::X, Axis::Y),
        }
    }
}

/// There is no circle through these points with this radius.
pub(crate) struct NoCircle;

impl Arc {
    /// The way along the arc.
    pub(crate) fn length(&self) -> f64 {
        (self.radii.0 + self.radii.1) / 2.0 * self.sweep.abs()
    }

    /// The axes of the plane, by number.
    pub(crate) fn plane(&self) -> [usize; 2] {
        [usize::from(self.plane.0.min(8)), usize::from(self.plane.1.min(8))]
    }

    /// Where it is after a part of it, from 0 to 1.
    pub(crate) fn at(&self, s: f64) -> [f64; 2] {
        let radius = self.radii.0 + (self.radii.1 - self.radii.0) * s;
        let angle = self.begin + self.sweep * s;
        [self.center.0 + radius * libm::cos(angle), self.center.1 + radius * libm::sin(angle)]
    }
}

impl Machine<'_> {
    /// The arc of a move's words; `None` where they give neither a radius nor a centre, so that it is a line.
    pub(crate) fn arc(
        &self,
        system: usize,
        words: &Words,
        clockwise: bool,
    ) -> Result<Option<Arc>, NoCircle> {
        let this = &self.state.systems[system];
        let normal = this.normal;
        let (first, second) = normal.plane();
        let at = |axes: &[f64; 9]| (axes[first as usize], axes[second as usize]);
        let (from, to) = (at(&words.from), at(&this.axes));
        // CIRCLE1 is clockwise where the normal is negative.
        let clockwise = clockwise == normal.negative;
        let center = match words.radius {
            Some(radius) => self.center_by_radius(system, from, to, radius, clockwise)?,
            None if words.center.iter().all(Option::is_none) => return Ok(None),
            None => {
                let absolute = !this.modes.incremental.has_r();
                let of = |axis: Axis, from: f64| {
                    let value = words.center[axis.slot()].unwrap_or(0.0);
                    if absolute { value } else { from + value }
                };
                (of(first, from.0), of(second, from.1))
            }
        };
        let begin = libm::atan2(from.1 - center.1, from.0 - center.0);
        let end = libm::atan2(to.1 - center.1, to.0 - center.0);
        let whole = 2.0 * std::f64::consts::PI;
        let mut sweep = end - begin;
        if clockwise {
            if sweep > 0.0 {
                sweep -= whole;
            }
        } else if sweep < 0.0 {
            sweep += whole;
        }
        // The least angle, in half turns: I90, of Turbo PMAC Isx97.
        let least = if self.turbo() { self.system_i(system, 97) } else { self.i(90) };
        let least = if least > 0.0 { least } else { 1.0 / 1_048_576.0 };
        if sweep.abs() <= least * std::f64::consts::PI {
            sweep = if clockwise { -whole } else { whole };
        }
        let radius = |point: (f64, f64)| libm::hypot(point.0 - center.0, point.1 - center.1);
        let radii = (radius(from), radius(to));
        Ok(Some(Arc { plane: (first as u8, second as u8), center, begin, sweep, radii }))
    }

    /// The centre of the short arc, of the long one where the radius is negative.
    fn center_by_radius(
        &self,
        system: usize,
        from: (f64, f64),
        to: (f64, f64),
        radius: f64,
        clockwise: bool,
    ) -> Result<(f64, f64), NoCircle> {
        let (dx, dy) = (to.0 - from.0, to.1 - from.1);
        let middle = ((from.0 + to.0) / 2.0, (from.1 + to.1) / 2.0);
        let half = libm::hypot(dx, dy) / 2.0;
        let mut size = radius.abs();
        if half > size {
            if half - size > self.system_i(system, 96) / 2.0 {
                return Err(NoCircle);
            }
            size = half;
        }
        // No circle is that of one point alone.
        if half == 0.0 {
            return Err(NoCircle);
        }
        let across = (size * size - half * half).sqrt() / (2.0 * half);
        // To the left of the way lies the centre of the short arc that goes counter-clockwise.
        let sign = if (radius < 0.0) == clockwise { 1.0 } else { -1.0 };
        let across = sign * across;
        Ok((middle.0 + across * -dy, middle.1 + across * dx))
    }
}
