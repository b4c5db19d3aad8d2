//! Answers to queries.

use plcc_abi::pmac::Space;
use plcc_abi::pmac::motion::Query;

use crate::events::MotionEvent;
use crate::machine::Machine;

/// A value rounded to a tenth, as ECMAScript writes it: such values have neither exponents nor further digits
/// in the range of positions.
fn tenth(value: f64) -> String {
    let value = (10.0 * value).round() / 10.0 + 0.0;
    plcc_abi::number(value)
}

impl Machine<'_> {
    /// Answers a query.
    pub(crate) fn answer(&mut self, query: Query, motor: usize, system: usize) {
        let all = |this: &Self, value: &dyn Fn(&Self, usize) -> f64| {
            let values = (0..this.motor_count()).map(|motor| tenth(value(this, motor)));
            values.collect::<Vec<_>>().join(" ")
        };
        let hex = |(x, y): (u32, u32)| format!("{x:06X}{y:06X}");
        let text = match query {
            Query::Position => tenth(self.position(motor)),
            Query::Velocity => tenth(self.velocity(motor)),
            Query::FollowingError => tenth(self.following_error(motor)),
            Query::MotorStatus => hex(self.motor_words(motor)),
            Query::SystemStatus => hex(self.system_words(system)),
            Query::GlobalStatus | Query::GlobalStatuses => hex(self.global_status()),
            Query::TimeBase => {
                let commanded = self.commanded_base(system);
                let value = 1000.0 * commanded as f64 / self.servo_units() as f64;
                plcc_abi::number(value.round() / 10.0)
            }
            Query::System => (system + 1).to_string(),
            Query::Motor => (motor + 1).to_string(),
            Query::Positions => all(self, &Self::position),
            Query::Velocities => all(self, &Self::velocity),
            Query::FollowingErrors => all(self, &Self::following_error),
            Query::MotorStatuses => {
                let all = (0..self.motor_count()).map(|motor| hex(self.motor_words(motor)));
                all.collect::<Vec<_>>().join(" ")
            }
            Query::SystemStatuses => {
                let all = (0..self.system_count()).map(|system| hex(self.system_words(system)));
                all.collect::<Vec<_>>().join(" ")
            }
        };
        self.events.push(MotionEvent::Answer { text: text.into() });
    }

    fn position(&self, motor: usize) -> f64 {
        self.state.motors[motor].actual + self.bias(motor)
    }

    fn velocity(&self, motor: usize) -> f64 {
        let motor = &self.state.motors[motor];
        motor.actual - motor.actual_before
    }

    fn following_error(&self, motor: usize) -> f64 {
        self.state.motors[motor].following_error()
    }

    fn global_status(&self) -> (u32, u32) {
        let address = if self.turbo() { 6 } else { 3 };
        let word = |space| self.memory.read_word(space, address);
        (word(Space::X), word(Space::Y))
    }
}
