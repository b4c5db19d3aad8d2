//! On-line commands for motors and coordinate systems (guide, appendix C).

use std::sync::Arc;

use plcc_abi::pmac::motion::registers::{define, time_base};
use plcc_abi::pmac::motion::{Axis, AxisDefinition, JogGoal, MotionAction};

use crate::events::{Error, MotionEvent, Reason};
use crate::machine::Machine;
use crate::motor::Loop;

/// What is addressed, by index from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Address {
    pub(crate) motor: usize,
    pub(crate) system: usize,
}

/// For whom a command is, in the event of its refusal.
#[derive(Clone, Copy)]
enum Concern {
    Motor(usize),
    System(usize),
}

impl Machine<'_> {
    /// Carries out a command of the tables. `motor` and `system` are addressed, from 1; the command may change that
    /// for what follows it in its text.
    pub fn command(&mut self, index: u32, motor: &mut u32, system: &mut u32) {
        let tables = self.tables;
        let Some(command) = tables.commands.get(index as usize) else { return };
        match command.action {
            MotionAction::Motor(number) => *motor = u32::from(number),
            MotionAction::System(number) => *system = u32::from(number),
            _ => {
                let address = Address {
                    motor: (*motor as usize).saturating_sub(1),
                    system: (*system as usize).saturating_sub(1),
                };
                let text = self.setup.texts[index as usize].clone();
                self.carry_out(&command.action, &text, address);
                self.show_status();
            }
        }
    }

    pub(crate) fn carry_out(&mut self, action: &MotionAction, text: &Arc<str>, at: Address) {
        self.state.rest.end();
        let motor = at.motor.min(self.motor_count() - 1);
        let system = at.system.min(self.system_count() - 1);
        let (result, concern) = match action {
            MotionAction::Jog(_)
            | MotionAction::Home
            | MotionAction::HomeZero
            | MotionAction::Kill
            | MotionAction::OpenLoop(_)
            | MotionAction::Nothing => (self.of_motor(action, motor), Concern::Motor(motor)),
            MotionAction::Define { motor: named, .. } => {
                let named = usize::from(*named).saturating_sub(1).min(self.motor_count() - 1);
                (self.define_axes(action, named, system), Concern::Motor(named))
            }
            _ => (self.of_system(action, motor, system), Concern::System(system)),
        };
        if let Err(error) = result {
            let (motor, system) = match concern {
                Concern::Motor(motor) => (Some(motor as u32 + 1), None),
                Concern::System(system) => (None, Some(system as u32 + 1)),
            };
            self.events.push(MotionEvent::Refused { text: text.clone(), motor, system, error });
        }
    }

    fn of_motor(&mut self, action: &MotionAction, motor: usize) -> Result<(), Error> {
        if !self.state.motors[motor].active {
            return match action {
                MotionAction::Kill | MotionAction::Nothing => Ok(()),
                _ => Err(Error::NotActivated),
            };
        }
        let runs = self.system_of(motor).is_some_and(|of| {
            let system = &self.state.systems[of];
            system.running || system.sequence.runs() && !system.is_paused()
        });
        if runs || self.state.motors[motor].has_programmed() {
            return Err(Error::Running);
        }
        match *action {
            MotionAction::Jog(jog) if jog.goal == JogGoal::Whole => {
                let this = &mut self.state.motors[motor];
                this.close();
                this.commanded = this.commanded.round();
            }
            MotionAction::Jog(jog) => self.jog(motor, jog),
            MotionAction::Home => self.search_home(motor, false),
            MotionAction::HomeZero => {
                if self.is_busy(motor) {
                    return Err(Error::Moving);
                }
                self.zero_here(motor);
            }
            MotionAction::Kill => self.kill(motor),
            MotionAction::OpenLoop(percent) => {
                let this = &mut self.state.motors[motor];
                this.drop_motion();
                this.mode = Loop::Open(percent.clamp(-100.0, 100.0));
            }
            _ => {}
        }
        Ok(())
    }

    fn define_axes(
        &mut self,
        action: &MotionAction,
        motor: usize,
        system: usize,
    ) -> Result<(), Error> {
        let MotionAction::Define { group, scales, offset, .. } = action else { return Ok(()) };
        let own = self.system_of(motor);
        let number = motor as u32 + 1;
        let Some(group) = group else {
            if own.is_some_and(|own| own != system) {
                return Err(Error::Unfit);
            }
            self.state.motors[motor].definition = None;
            self.state.systems[system].rematch = true;
            return Ok(());
        };
        if own.is_some_and(|own| own != system) {
            return Err(Error::Unfit);
        }
        define(&mut self.memory, number, *scales, offset.unwrap_or(0.0));
        let definition = AxisDefinition { system: system as u8 + 1, group: *group };
        self.state.motors[motor].definition = Some(definition);
        self.state.systems[system].rematch = true;
        Ok(())
    }

    fn of_system(
        &mut self,
        action: &MotionAction,
        motor: usize,
        system: usize,
    ) -> Result<(), Error> {
        match *action {
            MotionAction::Undefine { all } => {
                for other in 0..self.motor_count() {
                    if let Some(own) = self.system_of(other)
                        && (all || own == system)
                    {
                        self.state.motors[other].definition = None;
                        self.state.systems[own].rematch = true;
                    }
                }
            }
            MotionAction::Begin { program, label } => return self.choose(system, program, label),
            MotionAction::Run => return self.run(system, false),
            MotionAction::Step => return self.run(system, true),
            MotionAction::Abort => self.abort(system, Reason::Abort),
            MotionAction::Hold => self.hold(system),
            MotionAction::ProgramHold => self.hold_program(system),
            MotionAction::Quit => self.quit(system, Reason::Quit),
            MotionAction::Halt => self.halt(system),
            MotionAction::TimeBase(percent) => {
                if percent < 0.0 {
                    return Err(Error::Unfit);
                }
                let word = time_base(&self.setup.layout, self.memory.image, percent);
                self.set_word(self.setup.systems[system].commanded_base, word);
                let this = &mut self.state.systems[system];
                if this.held {
                    (this.held, this.returning) = (false, true);
                }
            }
            MotionAction::Transformations(count) => {
                let none = crate::transform::Transformation::NONE;
                self.state.transformations.resize(usize::from(count), none);
            }
            MotionAction::Match => self.match_axes(system),
            MotionAction::Flush => {
                while let Some(next) = self.state.systems[system].sync.pop_front() {
                    self.assign(next);
                }
            }
            MotionAction::Incremental(incremental, axes) => {
                self.set_incremental(system, incremental, axes);
            }
            MotionAction::FeedrateAxes(axes) => {
                self.state.systems[system].modes.feedrate = axes;
            }
            MotionAction::SetAxis(axis, value) => self.set_axis(system, axis, value),
            MotionAction::ZeroAxes => {
                for axis in Axis::ALL {
                    self.set_axis(system, axis, 0.0);
                }
            }
            MotionAction::AbortAll => {
                for other in 0..self.system_count() {
                    self.abort(other, Reason::Abort);
                }
                for other in 0..self.motor_count() {
                    if self.state.motors[other].active && self.system_of(other).is_none() {
                        self.decelerate(other);
                        self.state.motors[other].close();
                    }
                }
            }
            MotionAction::KillAll => {
                for other in 0..self.system_count() {
                    self.stop_program(other, Reason::Kill);
                }
                for other in 0..self.motor_count() {
                    if self.state.motors[other].active {
                        self.kill(other);
                    }
                }
                for other in 0..self.system_count() {
                    self.drop_calculated(other);
                }
            }
            MotionAction::HoldAll => (0..self.system_count()).for_each(|other| self.hold(other)),
            MotionAction::QuitAll => {
                (0..self.system_count()).for_each(|other| self.quit(other, Reason::Quit));
            }
            MotionAction::RunAll | MotionAction::StepAll => {
                return self.run_all(*action == MotionAction::StepAll);
            }
            MotionAction::Query(query) => self.answer(query, motor, system),
            MotionAction::Refused(ref code) => return Err(Error::of(code)),
            MotionAction::Motor(_)
            | MotionAction::System(_)
            | MotionAction::Jog(_)
            | MotionAction::Home
            | MotionAction::HomeZero
            | MotionAction::Kill
            | MotionAction::OpenLoop(_)
            | MotionAction::Define { .. }
            | MotionAction::Nothing => {}
        }
        Ok(())
    }

    /// `^R` and `^S`: each coordinate system that has motors.
    fn run_all(&mut self, step: bool) -> Result<(), Error> {
        for system in 0..self.system_count() {
            if self.motors_of(system).next().is_none() {
                continue;
            }
            if let Err(error) = self.run(system, step) {
                let text: Arc<str> = if step { "^S" } else { "^R" }.into();
                let system = Some(system as u32 + 1);
                self.events.push(MotionEvent::Refused { text, motor: None, system, error });
            }
        }
        Ok(())
    }
}
