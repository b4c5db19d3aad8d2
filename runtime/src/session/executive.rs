//! The executive for a program, set as the options say.

use plcc_abi::machine::Machine;
use plcc_abi::{Dialect, Program};

use crate::Executive;
use crate::args::ControlArgs;
use crate::control::{Choices, control, option_of};

use super::SessionError;

/// Makes the executive of a program, set as `args` say; `realtime` says whether the clock will pace its
/// ticks. `machine` is the machine file of the run; without one, the settings hold with which the program
/// was compiled.
///
/// # Errors
/// When an option is for another language, or the program's tables do not fit together.
pub fn executive(
    program: &Program,
    args: &ControlArgs,
    realtime: bool,
    machine: Option<&Machine>,
) -> Result<Box<dyn Executive + Send>, SessionError> {
    check(args, program.dialect())?;
    let choices = Choices { args, realtime, machine };
    let executive = control(&program.tables).executive(program, &choices);
    executive.map_err(|error| SessionError(format!("the program can't be run: {error}")))
}

/// Whether a machine file says something that is used when a program runs, rather than when it is
/// compiled.
pub fn takes_machine_file(program: &Program) -> bool {
    control(&program.tables).takes_machine_file()
}

/// Refuses options that are for controls of another language than `dialect`.
fn check(args: &ControlArgs, dialect: Dialect) -> Result<(), SessionError> {
    for &other in Dialect::ALL.iter().filter(|&&other| other != dialect) {
        if let Some(option) = option_of(other, args) {
            let (of, is) = (other.name(), dialect.name());
            return Err(SessionError(format!("{option} is for {of} programs; this one is {is}")));
        }
    }
    Ok(())
}
