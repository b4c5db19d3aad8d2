//! Safety, in each housekeeping: limits, following errors, amplifier faults; then the bits of in position.

use plcc_abi::pmac::Layout;

use crate::events::Reason;
use crate::machine::{Machine, State};
use crate::motor::{Loop, Motor};
use crate::status::Latch;
use crate::variables::Variables;

impl Motor {
    /// The ends that it has reached (guide, Overtravel Limits and Home Switches). Says whether it moves on beyond one.
    fn look_at_limits(&mut self, variables: Variables<'_>, uses: u32) -> bool {
        let (highest, lowest) = (variables.i(13), variables.i(14));
        let inputs = uses & 1 << 17 == 0;
        let by_software = !self.searching;
        let beyond = highest != 0.0 && self.actual > highest;
        self.end_positive = inputs && self.inputs.positive || by_software && beyond;
        let beyond = lowest != 0.0 && self.actual < lowest;
        self.end_negative = inputs && self.inputs.negative || by_software && beyond;
        self.end_positive && self.commanded > self.before
            || self.end_negative && self.commanded < self.before
    }

    /// Its following error, and the fault of its amplifier. Says why it is killed, if it is.
    fn look_at_errors(
        &mut self,
        layout: &Layout,
        variables: Variables<'_>,
        uses: u32,
    ) -> Option<Reason> {
        let mut reason = None;
        if self.closed() {
            let (fatal, warning) = (variables.i(11), variables.i(12));
            let error = (self.commanded - self.actual).abs() * 16.0;
            self.warning = error > warning;
            if fatal != 0.0 && error > fatal {
                self.fatal = true;
                reason = Some(Reason::FollowingError);
            }
        }
        if uses & 1 << 20 == 0
            && self.inputs.fault == (uses & 1 << 23 != 0)
            && self.channel(layout, variables).is_some()
        {
            self.fault = true;
            reason = Some(Reason::AmplifierFault);
        }
        reason
    }

    /// Whether it is in position, and has been in as many housekeepings as `times` says.
    fn look_at_position(&mut self, window: f64, times: f64, in_move: bool) {
        let error = (self.commanded - self.actual).abs() * 16.0;
        let now = self.active && self.closed() && self.velocity_zero && !in_move && error < window;
        self.in_position_now = now;
        self.in_position_count = if now { self.in_position_count.saturating_add(1) } else { 0 };
        self.in_position = f64::from(self.in_position_count) >= times + 1.0;
    }

    /// What its status words show of safety.
    #[inline]
    fn safety(&self) -> [bool; 7] {
        [
            self.end_positive,
            self.end_negative,
            self.warning,
            self.fatal,
            self.fault,
            self.in_position_now,
            self.in_position,
        ]
    }
}

impl Machine<'_> {
    /// Housekeeping.
    pub fn housekeeping(&mut self) {
        if !self.housekeeping_at_rest() {
            self.safety();
            self.settle_safety();
        }
        self.panel();
        self.show_status();
    }

    fn safety(&mut self) {
        for index in 0..self.motor_count() {
            let layout = &self.setup.layout;
            let motor = &mut self.state.motors[index];
            if !motor.active {
                continue;
            }
            let before = motor.safety();
            let variables = Variables::of(self.memory.image, layout, index);
            let uses = motor.flag_uses(layout, variables);
            if motor.mode != Loop::Killed
                && motor.look_at_limits(variables, uses)
                && !motor.decelerates()
            {
                self.stop_at_limit(index);
            }
            let variables = Variables::of(self.memory.image, layout, index);
            let motor = &mut self.state.motors[index];
            let reason = motor.look_at_errors(layout, variables, uses);
            if before != motor.safety() {
                self.state.rest.end();
            }
            if let Some(reason) = reason {
                self.kill_group(index, uses, reason);
            }
        }
        self.positions_reached();
    }

    /// A motor moves beyond an end: it decelerates, and with it its coordinate system where a program moves it.
    fn stop_at_limit(&mut self, index: usize) {
        let programmed = self.state.motors[index].has_programmed() || self.in_sequence(index);
        match self.system_of(index) {
            Some(system) if programmed => self.abort(system, Reason::Limit),
            _ => {
                self.state.rest.end();
                self.decelerate(index);
            }
        }
        // The deceleration is not the next move.
        self.latch(index, Latch::StoppedOnLimit, true);
    }

    /// Which motors are in position.
    fn positions_reached(&mut self) {
        let in_move = self.in_move();
        let (turbo, times) = (self.turbo(), self.i(7));
        let layout = &self.setup.layout;
        let State { motors, rest, .. } = &mut *self.state;
        for (index, motor) in motors.iter_mut().enumerate() {
            let variables = Variables::of(self.memory.image, layout, index);
            let times = if turbo { variables.i(88) } else { times };
            let before = (motor.in_position_now, motor.in_position);
            motor.look_at_position(variables.i(28), times, in_move >> index & 1 != 0);
            if before != (motor.in_position_now, motor.in_position) {
                rest.end();
            }
        }
    }

    /// Kills a motor, and others as bits 21 and 22 of its flags' use say. The programs of their coordinate systems
    /// stop, and the other motors of these decelerate.
    fn kill_group(&mut self, index: usize, uses: u32, reason: Reason) {
        self.state.rest.end();
        let group = uses >> 21 & 3;
        let own = self.system_of(index);
        let mut systems = 0u32;
        for other in 0..self.motor_count() {
            let its = self.system_of(other);
            let concerned = other == index
                || match group {
                    0 => true,
                    1 => own.is_some() && its == own,
                    _ => false,
                };
            if concerned && self.state.motors[other].active {
                if let Some(system) = its {
                    systems |= 1 << system;
                }
                self.kill(other);
            }
        }
        for system in 0..self.system_count() {
            if systems & 1 << system != 0 {
                self.stop_program(system, reason);
                for motor in self.motors_of(system) {
                    if self.state.motors[motor].closed() {
                        self.decelerate(motor);
                    }
                }
                self.drop_calculated(system);
            }
        }
    }
}
