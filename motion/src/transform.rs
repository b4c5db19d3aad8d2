//! Axis transformations: TSELECT, TINIT, ADISPLACE and their kind (guide, Other Programming Features; decided). The
//! programmed coordinates of X, Y and Z are a matrix times those of the motors, plus a displacement.

use plcc_abi::image::read_f64;
use plcc_abi::pmac::arithmetic::finite;
use plcc_abi::pmac::motion::{Axis, AxisSet, TransformationWord};
use serde::{Deserialize, Serialize};

use crate::axes::{Look, determinant};
use crate::events::Reason;
use crate::machine::{Machine, State};

/// The number of the first of X, Y and Z.
const X: usize = Axis::X as usize;

/// A transformation of X, Y and Z.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Transformation {
    /// By rows.
    matrix: [[f64; 3]; 3],
    displacement: [f64; 3],
}

impl Transformation {
    /// The one that changes nothing.
    pub(crate) const NONE: Self = Self {
        matrix: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        displacement: [0.0; 3],
    };

    /// A vector by the matrix alone.
    fn rotated(&self, v: [f64; 3]) -> [f64; 3] {
        self.matrix.map(|[a, b, c]| (a * v[0] + b * v[1]) + c * v[2])
    }

    /// The vector that the matrix turns into this one, by Cramer's rule; itself where there is none.
    fn unrotated(&self, v: [f64; 3]) -> [f64; 3] {
        let whole = determinant(&self.matrix);
        if whole == 0.0 || !whole.is_finite() {
            return v;
        }
        std::array::from_fn(|column| {
            let mut replaced = self.matrix;
            for (row, value) in replaced.iter_mut().zip(v) {
                row[column] = value;
            }
            determinant(&replaced) / whole
        })
    }

    fn programmed(&self, base: [f64; 3]) -> [f64; 3] {
        let rotated = self.rotated(base);
        std::array::from_fn(|i| rotated[i] + self.displacement[i])
    }

    fn base(&self, programmed: [f64; 3]) -> [f64; 3] {
        self.unrotated(std::array::from_fn(|i| programmed[i] - self.displacement[i]))
    }
}

/// X, Y and Z of nine axes replaced.
fn with_xyz(axes: &[f64; 9], by: impl Fn([f64; 3]) -> [f64; 3]) -> [f64; 9] {
    let mut out = *axes;
    let [x, y, z] = by([axes[X], axes[X + 1], axes[X + 2]]);
    (out[X], out[X + 1], out[X + 2]) = (finite(x), finite(y), finite(z));
    out
}

impl State {
    /// The transformation that a coordinate system has selected.
    fn transformation(&self, system: usize) -> Option<&Transformation> {
        let selected = self.systems.get(system)?.transformation;
        self.transformations.get(usize::from(selected).checked_sub(1)?)
    }
}

impl Look<'_> {
    /// The axes' positions before the transformation, as the motors follow them.
    pub(crate) fn base_axes(&self, system: usize, axes: &[f64; 9]) -> [f64; 9] {
        match self.state.transformation(system) {
            Some(transformation) => with_xyz(axes, |xyz| transformation.base(xyz)),
            None => *axes,
        }
    }

    /// The axes' positions as the program has them.
    pub(crate) fn programmed_axes(&self, system: usize, axes: [f64; 9]) -> [f64; 9] {
        match self.state.transformation(system) {
            Some(transformation) => with_xyz(&axes, |xyz| transformation.programmed(xyz)),
            None => axes,
        }
    }

    /// Velocities of axes as the motors follow them.
    pub(crate) fn base_velocities(&self, system: usize, velocities: &[f64; 9]) -> [f64; 9] {
        match self.state.transformation(system) {
            Some(transformation) => with_xyz(velocities, |xyz| transformation.unrotated(xyz)),
            None => *velocities,
        }
    }

    /// The axes whose motors move where these are on the line: with a transformation X, Y and Z together.
    pub(crate) fn moved_axes(&self, system: usize, axes: AxisSet) -> AxisSet {
        let any = [Axis::X, Axis::Y, Axis::Z].into_iter().any(|axis| axes.has(axis));
        match any && self.state.transformation(system).is_some() {
            true => axes.and(AxisSet::XYZ),
            false => axes,
        }
    }
}

impl Machine<'_> {
    /// TSELECT and its kind. Nothing moves: the targets of X, Y and Z get other names.
    pub(crate) fn transform(
        &mut self,
        system: usize,
        word: TransformationWord,
        value: f64,
    ) -> bool {
        let count = self.state.transformations.len();
        let selected = usize::from(self.state.systems[system].transformation);
        let first = if (0.0..=8191.0).contains(&value) { value.round() as u32 } else { 0 };
        if word == TransformationWord::Select {
            if value.round() < 0.0 || value.round() > count as f64 {
                return self.stop_with_error(system, Reason::Unsupported);
            }
            self.rename(1 << system, |machine| {
                machine.state.systems[system].transformation = first as u16;
            });
            return false;
        }
        let Some(index) = selected.checked_sub(1).filter(|index| *index < count) else {
            return false;
        };
        let mut new = self.state.transformations[index];
        match word {
            TransformationWord::Select => {}
            TransformationWord::Init => new = Transformation::NONE,
            TransformationWord::Displace | TransformationWord::DisplaceMore => {
                for (at, own) in (first..).zip(&mut new.displacement) {
                    let value = self.q(system, at);
                    let old = if word == TransformationWord::Displace { 0.0 } else { *own };
                    *own = finite(old + value);
                }
            }
            TransformationWord::Rotate | TransformationWord::RotateMore => {
                let mut at = first;
                let read = [[(); 3]; 3].map(|row| {
                    row.map(|()| {
                        at += 1;
                        self.q(system, at - 1)
                    })
                });
                new.matrix = match word {
                    TransformationWord::Rotate => read,
                    _ => multiplied(&read, &new.matrix),
                };
            }
        }
        let mut concerned = 0u32;
        for (other, system) in self.state.systems.iter().enumerate() {
            concerned |= u32::from(usize::from(system.transformation) == index + 1) << other;
        }
        self.rename(concerned, |machine| machine.state.transformations[index] = new);
        false
    }

    /// Changes transformations; where the axes of these coordinate systems, a bit each, are stays, in other coordinates.
    fn rename(&mut self, systems: u32, change: impl FnOnce(&mut Self)) {
        let concerned = (0..self.system_count()).filter(|system| systems & 1 << system != 0);
        let mut bases = [[0.0; 9]; 16];
        for (system, base) in concerned.clone().zip(&mut bases) {
            *base = self.look().base_axes(system, &self.state.systems[system].axes);
        }
        change(self);
        for (system, base) in concerned.zip(bases) {
            self.state.systems[system].axes = self.look().programmed_axes(system, base);
            for axis in [Axis::X, Axis::Y, Axis::Z] {
                self.show_axis(system, axis);
            }
        }
    }

    /// A Q-variable of a coordinate system.
    fn q(&self, system: usize, number: u32) -> f64 {
        let layout = &self.setup.layout;
        let base = layout.q_base_of(system as u32 + 1);
        read_f64(self.memory.image, layout.q_offset(base.wrapping_add(number)))
    }
}

fn multiplied(left: &[[f64; 3]; 3], right: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
    let column = |j: usize| [right[0][j], right[1][j], right[2][j]];
    left.map(|[a, b, c]| {
        std::array::from_fn(|j| {
            let [x, y, z] = column(j);
            finite((a * x + b * y) + c * z)
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base_is_the_inverse_of_programmed() {
        let this = Transformation {
            matrix: [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 2.0]],
            displacement: [10.0, 20.0, 30.0],
        };
        assert_eq!(this.programmed([1.0, 2.0, 3.0]), [8.0, 21.0, 36.0]);
        assert_eq!(this.base([8.0, 21.0, 36.0]), [1.0, 2.0, 3.0]);
        let singular = Transformation { matrix: [[0.0; 3]; 3], ..this };
        assert_eq!(singular.base([11.0, 22.0, 33.0]), [1.0, 2.0, 3.0]);
    }
}
