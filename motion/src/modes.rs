//! Moves of the modes: which calculation each takes, and those of PVT and SPLINE.

use plcc_abi::pmac::arithmetic::finite;
use plcc_abi::pmac::motion::{Axis, AxisSet, Mode};

use crate::events::Reason;
use crate::machine::Machine;
use crate::moves::{Shape, Words};
use crate::sequence::{Progress, SequenceKind};
use crate::units::units;

impl Machine<'_> {
    /// A move of the present mode. Says whether the calculation is over.
    pub(crate) fn programmed_move(&mut self, system: usize, words: &Words) -> bool {
        // A kinematic program that does not end stops the motion program in front of the move, or at it.
        if !self.state.systems[system].running {
            return true;
        }
        let is_over = self.move_by_mode(system, words);
        is_over || !self.state.systems[system].running
    }

    fn move_by_mode(&mut self, system: usize, words: &Words) -> bool {
        if self.motors_of(system).any(|motor| self.motor_i(motor, 6) == 1.0) {
            return self.stop_with_error(system, Reason::Unsupported);
        }
        let mode = self.state.systems[system].mode;
        match mode {
            Mode::Linear => self.linear_move(system, words, Shape::default()),
            // Without segmentation arcs are lines (guide, Circular Interpolation).
            Mode::Circle1 | Mode::Circle2 if self.segmentation(system) <= 0.0 => {
                self.linear_move(system, words, Shape::default())
            }
            Mode::Circle1 | Mode::Circle2 => {
                let Ok(arc) = self.arc(system, words, mode == Mode::Circle1) else {
                    return self.stop_with_error(system, Reason::Circle);
                };
                self.linear_move(system, words, Shape { time: None, arc })
            }
            Mode::Pvt => {
                self.pvt(system, words);
                self.moved(system)
            }
            Mode::Spline1 => {
                self.spline(system, words, SequenceKind::Spline1);
                self.moved(system)
            }
            Mode::Spline2 => {
                self.spline(system, words, SequenceKind::Spline2);
                self.moved(system)
            }
            Mode::Rapid => {
                let moves = self.rapid(system, words);
                if self.ends_step(system) {
                    return self.end_step(system);
                }
                if moves {
                    self.state.systems[system].flag = false;
                    self.state.calculation.stop = true;
                }
                moves
            }
        }
    }

    /// I13, of Turbo PMAC Isx13.
    pub(crate) fn segmentation(&self, system: usize) -> f64 {
        if self.turbo() { self.system_i(system, 13) } else { self.i(13) }
    }

    pub(crate) fn linear_move(&mut self, system: usize, words: &Words, shape: Shape) -> bool {
        self.linear(system, words, shape);
        self.moved(system)
    }

    /// A move of a sequence is calculated. Says whether the calculation is over.
    fn moved(&mut self, system: usize) -> bool {
        if self.system_i(system, 92) == 1.0 {
            self.close_sequence(system);
        }
        if self.ends_step(system) {
            return self.end_step(system);
        }
        let sequence = &self.state.systems[system].sequence;
        if sequence.progress == Progress::Gathering && !sequence.closed {
            if sequence.calculated < self.ahead(system) {
                return false;
            }
            self.start_sequence(system);
        }
        self.state.systems[system].flag = false;
        self.state.calculation.stop = true;
        true
    }

    /// Calculates a PVT move.
    pub(crate) fn pvt(&mut self, system: usize, words: &Words) {
        let k = self.open_move(system, words, SequenceKind::Pvt);
        let by_tm = self.turbo() && self.i(42) == 0.0;
        let time = self.system_i(system, if by_tm { 89 } else { 87 }).max(0.0);
        let time = if by_tm { time } else { time.round() };
        let duration = match units(time) {
            0 => units(0.5),
            duration => duration,
        };
        let per = self.system_i(system, 90);
        let moved = self.look().moved_axes(system, words.axes);
        let kinematic = moved != AxisSet::NONE && self.look().has_inverse(system);
        let velocities = self.look().base_velocities(system, &words.velocities);
        for motor in 0..self.motor_count() {
            let mut v = 0.0;
            for axis in Axis::ALL {
                let velocity = velocities[axis as usize];
                if velocity != 0.0 {
                    v += velocity * self.scale(motor, axis) / per;
                }
            }
            if kinematic && self.state.is_kinematic(motor) {
                v = self.kinematic_velocity(motor) / per;
            }
            let sequence = &mut self.state.systems[system].sequence;
            let v = if sequence.member[motor] { finite(v) } else { 0.0 };
            sequence.at_mut(k).v[motor] = v;
        }
        self.state.systems[system].sequence.at_mut(k).tm = duration;
        self.show_targets(system, k);
    }

    /// The time of a SPLINE's segment in ms.
    fn spline_time(&self, system: usize) -> f64 {
        let by_tm = self.turbo() && self.i(42) == 0.0;
        let time = self.system_i(system, if by_tm { 89 } else { 87 });
        if units(time) <= 0 { 0.5 } else { time }
    }

    /// Whether a SPLINE1 move has another time than the sequence that it would go on with, and so closes it.
    pub(crate) fn ends_spline(&self, system: usize) -> bool {
        let sequence = &self.state.systems[system].sequence;
        sequence.kind == SequenceKind::Spline1 && sequence.last().time != self.spline_time(system)
    }

    /// Calculates a SPLINE move.
    pub(crate) fn spline(&mut self, system: usize, words: &Words, kind: SequenceKind) {
        let k = self.open_move(system, words, kind);
        let time = self.spline_time(system);
        let this = self.state.systems[system].sequence.at_mut(k);
        (this.time, this.tm) = (time, units(time));
        this.v.fill(0.0);
        self.show_targets(system, k);
    }
}
