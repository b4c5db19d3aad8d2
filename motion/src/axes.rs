//! Axes and motors: targets of motors from those of axes, and matching, which is the other way.

use plcc_abi::pmac::layout::ADDRESS_SIZE;
use plcc_abi::pmac::motion::registers::set_bias;
use plcc_abi::pmac::motion::{Axis, AxisDefinition, AxisGroup, AxisSet, MotionTables};

use plcc_abi::image::read_f64;
use plcc_abi::pmac::View;

use crate::machine::{Machine, Setup, State};
use crate::variables::Variables;
use crate::words::{read_float, read_integer};

/// How a motor follows its axes.
#[derive(Clone, Copy, Debug)]
struct Row {
    group: AxisGroup,
    scales: [f64; 3],
}

impl Row {
    /// Which of the three scale factors count.
    fn slots(&self) -> impl Iterator<Item = (usize, Axis)> + '_ {
        let named = |slot| self.group.axis(slot).map(|axis| (slot, axis));
        (0..3).filter_map(named).filter(|(slot, _)| self.scales[*slot] != 0.0)
    }

    /// The scale factors times the targets of the axes.
    fn scaled(&self, axes: &[f64; 9]) -> Option<f64> {
        let at = |slot: usize| {
            self.group.axis(slot).map_or(0.0, |axis| self.scales[slot] * axes[axis as usize])
        };
        match self.group {
            AxisGroup::Single(_) => Some(at(0)),
            AxisGroup::Xyz | AxisGroup::Uvw => Some((at(0) + at(1)) + at(2)),
            AxisGroup::Kinematics => None,
        }
    }
}

/// What can be seen of the simulation without changing it.
#[derive(Clone, Copy)]
pub(crate) struct Look<'a> {
    pub(crate) state: &'a State,
    pub(crate) setup: &'a Setup,
    pub(crate) tables: &'a MotionTables,
    pub(crate) view: View<'a>,
}

impl Look<'_> {
    /// An I-variable.
    pub(crate) fn i(&self, number: u32) -> f64 {
        read_f64(self.view.image, self.setup.layout.i_offset(number))
    }

    /// The indices of a coordinate system's motors.
    pub(crate) fn motors_of(&self, system: usize) -> impl Iterator<Item = usize> + use<> {
        self.state.motors_of(system)
    }

    fn row(&self, motor: usize) -> Option<Row> {
        let AxisDefinition { group, .. } = self.state.motors[motor].definition?;
        let first = self.setup.motors[motor].scales;
        let scales = [0, 1, 2].map(|slot| read_float(self.view.image, first + ADDRESS_SIZE * slot));
        Some(Row { group, scales })
    }

    /// The bias of a motor in counts; 0 where Ix08 is 0.
    pub(crate) fn bias(&self, motor: usize) -> f64 {
        let image = self.view.image;
        let scale = Variables::of(image, &self.setup.layout, motor).i(8) * 32.0;
        if scale == 0.0 {
            return 0.0;
        }
        read_integer(image, self.setup.motors[motor].bias) / scale
    }

    /// How many counts of a motor an axis's unit is; 0 where it does not follow the axis.
    pub(crate) fn scale(&self, motor: usize, axis: Axis) -> f64 {
        let Some(row) = self.row(motor) else { return 0.0 };
        row.slots().find(|(_, own)| *own == axis).map_or(0.0, |(slot, _)| row.scales[slot])
    }

    /// The scale factors times the axes' targets.
    fn scaled(&self, motor: usize, axes: &[f64; 9]) -> Option<f64> {
        let row = self.row(motor)?;
        let system = usize::from(self.state.motors[motor].definition?.system).wrapping_sub(1);
        row.scaled(&self.base_axes(system, axes))
    }

    /// A motor's target where one of these axes moves it. `base` are the targets of the axes before the transformation
    /// that the coordinate system has selected, `axes` behind it.
    pub(crate) fn moved_target(
        &self,
        system: usize,
        motor: usize,
        moved: AxisSet,
        (base, axes): (&[f64; 9], &[f64; 9]),
    ) -> Option<f64> {
        let row = self.row(motor)?;
        if !row.slots().any(|(_, axis)| moved.has(axis)) {
            return None;
        }
        let own = usize::from(self.state.motors[motor].definition?.system).wrapping_sub(1);
        // Its definition may be another one than when the move was calculated.
        let scaled = match own == system {
            true => row.scaled(base),
            false => row.scaled(&self.base_axes(own, axes)),
        };
        Some(scaled? - self.bias(motor))
    }

    /// Where matching takes a motor to be, in counts without bias: at the goal of its last calculated move while it is in
    /// a sequence.
    fn matched_position(&self, system: usize, motor: usize) -> f64 {
        let goal = self.state.systems[system].sequence.goal(motor);
        goal.unwrap_or(self.state.motors[motor].commanded)
    }

    /// The axes' positions by the formula of matching, for displays: of the commanded positions, now or in the
    /// cycle before.
    pub(crate) fn shown_axes(&self, system: usize, before: bool) -> [f64; 9] {
        let counts = |this: &Self, motor: usize| {
            let motor_state = &this.state.motors[motor];
            if before { motor_state.before } else { motor_state.commanded }
        };
        match self.tried_forward(system, &counts) {
            Some(axes) => {
                self.programmed_axes(system, axes).map(plcc_abi::pmac::arithmetic::finite)
            }
            None => self.matched(system, counts),
        }
    }

    fn matched(&self, system: usize, counts: impl Fn(&Self, usize) -> f64) -> [f64; 9] {
        let position = |this: &Self, motor: usize| counts(this, motor) + this.bias(motor);
        let mut axes = self.base_axes(system, &self.state.systems[system].axes);
        for axis in [Axis::A, Axis::B, Axis::C] {
            let lowest = self.motors_of(system).find_map(|motor| {
                let row = self.row(motor)?;
                let own = row.group == AxisGroup::Single(axis) && row.scales[0] != 0.0;
                own.then(|| (motor, row.scales[0]))
            });
            if let Some((motor, scale)) = lowest {
                axes[axis as usize] = position(self, motor) / scale;
            }
        }
        for group in [AxisGroup::Xyz, AxisGroup::Uvw] {
            self.match_triplet(system, group, &position, &mut axes);
        }
        self.programmed_axes(system, axes).map(plcc_abi::pmac::arithmetic::finite)
    }

    /// X, Y and Z, or U, V and W: each by its lowest motor, or by Cramer's rule where a motor has several of them.
    fn match_triplet(
        &self,
        system: usize,
        group: AxisGroup,
        position: &impl Fn(&Self, usize) -> f64,
        axes: &mut [f64; 9],
    ) {
        let mut rows = [(0usize, [0.0; 3]); 3];
        let mut count = 0;
        let mut used = [false; 3];
        let mut several = false;
        let mut lowest: [Option<usize>; 3] = [None; 3];
        for motor in self.motors_of(system) {
            let Some(row) = self.row(motor).filter(|row| row.group == group) else { continue };
            let mut own = 0;
            for (slot, _) in row.slots() {
                used[slot] = true;
                own += 1;
                if lowest[slot].is_none() {
                    lowest[slot] = Some(motor);
                }
            }
            several |= own > 1;
            if own > 0
                && let Some(free) = rows.get_mut(count)
            {
                *free = (motor, row.scales);
                count += 1;
            }
        }
        if !several {
            for (slot, motor) in lowest.into_iter().enumerate() {
                if let (Some(motor), Some(axis)) = (motor, group.axis(slot)) {
                    axes[axis as usize] = position(self, motor) / self.scale(motor, axis);
                }
            }
            return;
        }
        let unknown = used.iter().filter(|used| **used).count();
        if count < unknown {
            return;
        }
        // Axes that nothing uses have a row of their own, so that there are always three.
        let mut matrix = [[0.0; 3]; 3];
        let mut right = [0.0; 3];
        let mut next = 0;
        for slot in 0..3 {
            if used[slot] {
                let (motor, scales) = rows[next];
                matrix[slot] = scales;
                right[slot] = position(self, motor);
                next += 1;
            } else {
                matrix[slot][slot] = 1.0;
            }
        }
        let whole = determinant(&matrix);
        if whole == 0.0 || !whole.is_finite() {
            return;
        }
        for slot in 0..3 {
            let Some(axis) = group.axis(slot).filter(|_| used[slot]) else { continue };
            let mut replaced = matrix;
            for (row, value) in replaced.iter_mut().zip(right) {
                row[slot] = value;
            }
            axes[axis as usize] = determinant(&replaced) / whole;
        }
    }
}

impl Machine<'_> {
    /// The same for reading.
    pub(crate) fn look(&self) -> Look<'_> {
        Look { state: self.state, setup: self.setup, tables: self.tables, view: self.memory.view() }
    }

    /// The bias of a motor in counts.
    pub(crate) fn bias(&self, motor: usize) -> f64 {
        self.look().bias(motor)
    }

    /// How many counts of a motor an axis's unit is; 0 where it does not follow the axis.
    pub(crate) fn scale(&self, motor: usize, axis: Axis) -> f64 {
        self.look().scale(motor, axis)
    }

    /// Matches the axes of a coordinate system to its motors.
    pub(crate) fn match_axes(&mut self, system: usize) {
        self.state.systems[system].rematch = false;
        let axes = match self.forward(system) {
            Some(axes) => axes,
            None => {
                let look = self.look();
                look.matched(system, |look, motor| look.matched_position(system, motor))
            }
        };
        self.state.systems[system].axes = axes;
        for axis in Axis::ALL {
            self.show_axis(system, axis);
        }
    }

    /// `{axis}=c` and PSET: the bias makes the present position that of the axis.
    pub(crate) fn set_axis(&mut self, system: usize, axis: Axis, value: f64) {
        self.state.systems[system].axes[axis as usize] = value;
        self.show_axis(system, axis);
        for motor in self.motors_of(system) {
            if self.scale(motor, axis) == 0.0 {
                continue;
            }
            let axes = self.state.systems[system].axes;
            if let Some(target) = self.look().scaled(motor, &axes) {
                let bias = target - self.state.motors[motor].commanded;
                set_bias(&mut self.memory, motor as u32 + 1, bias);
            }
        }
    }
}

pub(crate) fn determinant([[a, b, c], [d, e, f], [g, h, i]]: &[[f64; 3]; 3]) -> f64 {
    a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)
}
