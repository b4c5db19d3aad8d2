//! Commands for simulated motors, coordinate systems and motion programs (guide, appendix C): `#1J+`, `&1B10R`, `A`, `K`.

use plcc_abi::number;
use plcc_abi::pmac::motion::{MotionAction, Online};

use super::PmacTerminal;
use crate::pmac::ast::Action;
use crate::pmac::read::online_actions;
use crate::presentation::{Answer, Desk};

/// What is said where no motor is simulated.
const NOT_SIMULATED: &str = "motors are not simulated here, so that nothing would move: start the control, or the \
monitor's program, with --simulate";

impl PmacTerminal {
    /// A row of commands, in capitals without blanks; `None` if there is one among them that concerns no motor and no coordinate
    /// system, or that is none.
    pub(super) fn motion_commands(&mut self, desk: &mut dyn Desk, plain: &str) -> Option<Answer> {
        let actions = online_actions(plain, self.controller.unwrap_or_default())?;
        let concerns = |action: &Action| matches!(action, Action::Motion(_) | Action::System(_));
        if actions.is_empty() || !actions.iter().all(concerns) {
            return None;
        }
        Some(self.do_actions(desk, actions))
    }

    fn do_actions(&mut self, desk: &mut dyn Desk, actions: Vec<Action>) -> Answer {
        let mut answers = vec![];
        for action in actions {
            let command = match action {
                Action::System(system) => {
                    self.system = u32::from(system);
                    continue;
                }
                Action::Motion(command) => command,
                _ => continue,
            };
            match command.action {
                MotionAction::Motor(motor) => self.motor = u32::from(motor),
                MotionAction::System(system) => self.system = u32::from(system),
                MotionAction::Query(_) => {
                    let answer = self.report(desk, &command.text);
                    let unknown = || Err(format!("`{}` can't be asked here", command.text));
                    answers.push(answer.unwrap_or_else(unknown)?);
                }
                action => {
                    // Both fit: there are at most 32 motors and 16 coordinate systems.
                    let (motor, system) = (self.motor as u8, self.system as u8);
                    let Some(online) = Online::of(&action, motor, system) else {
                        return Err(format!(
                            "`{}` is not given from here: put it into the source, or have a PLC give it by COMMAND",
                            command.text
                        ));
                    };
                    answers.push(self.give(desk, &online.to_string())?);
                }
            }
        }
        answers.retain(|answer| !answer.is_empty());
        Ok(answers.join("\n"))
    }

    /// Gives a command by its name. What comes of it is told by events.
    pub(super) fn give(&mut self, desk: &mut dyn Desk, name: &str) -> Answer {
        if desk.read(&["#1.ACT".to_owned()])?.is_empty() {
            return Err(NOT_SIMULATED.into());
        }
        // A control acknowledges a command without a word.
        desk.set(name, "1").map(|_| String::new())
    }

    /// `%`: the time base of the addressed coordinate system.
    pub(super) fn time_base(&mut self, desk: &mut dyn Desk) -> Answer {
        let name = format!("&{}.BASE", self.system);
        let values = desk.read(std::slice::from_ref(&name))?;
        let base = values.get(&name).ok_or_else(|| NOT_SIMULATED.to_owned())?;
        Ok(number((base * 10.0).round() / 10.0))
    }
}
