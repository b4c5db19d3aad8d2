//! Safety, in each housekeeping: limits, following errors, amplifier faults; then the bits of in position.

use crate::events::Reason;
use crate::machine::Machine;
use crate::motor::Loop;
use crate::registers::Latch;

impl Machine<'_> {
    /// Housekeeping.
    pub fn housekeeping(&mut self) {
        for index in 0..self.motor_count() {
            if self.state.motors[index].active {
                self.limits(index);
                self.errors(index);
            }
        }
        for index in 0..self.motor_count() {
            self.in_position(index);
        }
        self.panel();
        self.show_status();
    }

    /// The limits of a motor (guide, Overtravel Limits and Home Switches).
    fn limits(&mut self, index: usize) {
        let uses = self.flag_uses(index);
        let (highest, lowest) = (self.motor_i(index, 13), self.motor_i(index, 14));
        let motor = &mut self.state.motors[index];
        if motor.mode == Loop::Killed {
            return;
        }
        let inputs = uses & 1 << 17 == 0;
        let by_software = !motor.searching;
        let beyond = highest != 0.0 && motor.actual > highest;
        motor.end_positive = inputs && motor.inputs.positive || by_software && beyond;
        let beyond = lowest != 0.0 && motor.actual < lowest;
        motor.end_negative = inputs && motor.inputs.negative || by_software && beyond;
        let outwards = motor.end_positive && motor.commanded > motor.before
            || motor.end_negative && motor.commanded < motor.before;
        if !outwards || motor.decelerates() {
            return;
        }
        let programmed = motor.has_programmed() || self.in_sequence(index);
        match self.system_of(index) {
            Some(system) if programmed => self.abort(system, Reason::Limit),
            _ => self.decelerate(index),
        }
        // The deceleration is not the next move.
        self.latch(index, Latch::StoppedOnLimit, true);
    }

    /// Following errors and the fault of the amplifier.
    fn errors(&mut self, index: usize) {
        let uses = self.flag_uses(index);
        let (fatal, warning) = (self.motor_i(index, 11), self.motor_i(index, 12));
        let motor = &mut self.state.motors[index];
        let mut reason = None;
        if motor.closed() {
            let error = (motor.commanded - motor.actual).abs() * 16.0;
            motor.warning = error > warning;
            if fatal != 0.0 && error > fatal {
                motor.fatal = true;
                reason = Some(Reason::FollowingError);
            }
        }
        if uses & 1 << 20 == 0
            && self.channel(index).is_some()
            && self.state.motors[index].inputs.fault == (uses & 1 << 23 != 0)
        {
            self.state.motors[index].fault = true;
            reason = Some(Reason::AmplifierFault);
        }
        if let Some(reason) = reason {
            self.kill_group(index, uses, reason);
        }
    }

    /// Kills a motor, and others as bits 21 and 22 of its flags' use say. The programs of their coordinate systems
    /// stop, and the other motors of these decelerate.
    fn kill_group(&mut self, index: usize, uses: u32, reason: Reason) {
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

    fn in_position(&mut self, index: usize) {
        let window = self.motor_i(index, 28);
        let times = if self.turbo() { self.motor_i(index, 88) } else { self.i(7) };
        let in_move = self.is_in_move(index);
        let motor = &mut self.state.motors[index];
        let error = (motor.commanded - motor.actual).abs() * 16.0;
        let now =
            motor.active && motor.closed() && motor.velocity_zero && !in_move && error < window;
        motor.in_position_now = now;
        motor.in_position_count = if now { motor.in_position_count.saturating_add(1) } else { 0 };
        motor.in_position = f64::from(motor.in_position_count) >= times + 1.0;
    }
}
