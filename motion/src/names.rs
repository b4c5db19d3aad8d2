//! What users can watch of motors and coordinate systems, and what the stimulus can set.

use plcc_abi::pmac::motion::{Axis, MotionName, MotorValue, SystemValue};

use plcc_abi::pmac::View;
use plcc_abi::pmac::motion::MotionTables;
use plcc_abi::pmac::motion::registers::servo_units;

use crate::axes::Look;
use crate::commands::Address;
use crate::machine::{Machine, Setup, State};
use crate::motor::Loop;
use crate::units::ms;

/// The value of a name; 0 for what the controller does not have.
pub fn read(
    state: &State,
    setup: &Setup,
    tables: &MotionTables,
    view: View<'_>,
    name: MotionName,
) -> f64 {
    Look { state, setup, tables, view }.read(name)
}

impl Look<'_> {
    fn read(&self, name: MotionName) -> f64 {
        let value = match name {
            MotionName::Motor(number, value) => {
                let index = usize::from(number).wrapping_sub(1);
                let Some(motor) = self.state.motors.get(index) else { return 0.0 };
                match value {
                    MotorValue::Commanded => motor.commanded,
                    MotorValue::Actual => motor.actual,
                    MotorValue::Velocity => {
                        (motor.commanded - motor.before)
                            / ms(servo_units(&self.setup.layout, self.view.image))
                    }
                    MotorValue::FollowingError => motor.following_error(),
                    MotorValue::Physical => motor.x,
                    MotorValue::Fault => f64::from(u8::from(motor.faulty)),
                    MotorValue::Jam => f64::from(u8::from(motor.jam)),
                }
            }
            MotionName::System(number, value) => {
                let index = usize::from(number).wrapping_sub(1);
                if index >= self.state.systems.len() {
                    return 0.0;
                }
                self.system_value(index, value)
            }
            // A command has no value.
            MotionName::Online(_) => 0.0,
        };
        plcc_abi::pmac::arithmetic::finite(value)
    }

    fn system_value(&self, index: usize, value: SystemValue) -> f64 {
        let system = &self.state.systems[index];
        match value {
            SystemValue::Position(axis) => self.shown_axes(index, false)[usize::from(axis.min(8))],
            SystemValue::Velocity(axis) => self.axis_velocities(index)[usize::from(axis.min(8))],
            SystemValue::Speed => {
                let velocities = self.axis_velocities(index);
                let feedrate = Axis::ALL.into_iter().filter(|a| system.modes.feedrate.has(*a));
                let sum = feedrate.fold(0.0, |sum, axis| {
                    sum + velocities[axis as usize] * velocities[axis as usize]
                });
                sum.sqrt()
            }
            SystemValue::Base => {
                100.0 * system.base as f64 / servo_units(&self.setup.layout, self.view.image) as f64
            }
            SystemValue::Program => f64::from(self.program_number(index)),
            SystemValue::Line => f64::from(system.line.1),
        }
    }

    /// The axes' velocities in user units a second.
    fn axis_velocities(&self, index: usize) -> [f64; 9] {
        let (now, before) = (self.shown_axes(index, false), self.shown_axes(index, true));
        let cycle = ms(servo_units(&self.setup.layout, self.view.image));
        std::array::from_fn(|axis| (now[axis] - before[axis]) / cycle * 1000.0)
    }
}

impl Machine<'_> {
    /// Sets a value as the machine would. A motor in closed loop can't be moved by hand. An on-line command, set to something
    /// other than 0, is given as in the background after the tick before.
    pub fn set(&mut self, name: MotionName, value: f64) {
        self.state.rest.end();
        if let MotionName::Online(command) = name
            && value != 0.0
        {
            let index = usize::from(command.number).saturating_sub(1);
            let at = Address { motor: index, system: index };
            self.carry_out(&command.action(), &command.text().into(), at);
            self.show_status();
            return;
        }
        let MotionName::Motor(number, what) = name else { return };
        let Some(motor) = self.state.motors.get_mut(usize::from(number).wrapping_sub(1)) else {
            return;
        };
        match what {
            MotorValue::Fault => motor.faulty = value != 0.0,
            MotorValue::Jam => motor.jam = value != 0.0,
            MotorValue::Physical if motor.mode != Loop::Closed => motor.x = value,
            _ => {}
        }
    }
}
