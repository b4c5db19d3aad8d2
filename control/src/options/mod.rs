//! The options of each control, a file for each language, and the executive of a program, set as they say.

mod nct;
mod pmac;
mod pmi;

use clap::Args;
use plcc_abi::machine::Machine;
use plcc_abi::{Dialect, Program};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use plcc_runtime::Executive;

pub use nct::NctArgs;
pub use pmac::PmacArgs;
pub use pmi::PmiArgs;

/// The settings of the control: a part of the options of `plcc run` and `plcrt`, and of other commands that execute programs.
/// Each language has its own options.
#[derive(Args, Clone, Debug, Default, Serialize, Deserialize)]
#[command(next_help_heading = "Control")]
pub struct ControlArgs {
    /// PMI's.
    #[command(flatten)]
    pub pmi: PmiArgs,

    /// NCT's.
    #[command(flatten)]
    pub nct: NctArgs,

    /// PMAC's.
    #[command(flatten)]
    pub pmac: PmacArgs,
}

/// What is asked of each control: its options, and its executive made from them.
trait ControlOptions: Sync {
    /// The first option among `args` that only this control has, as it is written on the command line.
    fn first_given(&self, args: &ControlArgs) -> Option<&'static str>;

    /// Whether a machine file says something that is used when a program runs, rather than when it is
    /// compiled.
    fn takes_machine_file(&self) -> bool;

    /// The control at power-up, as the options say.
    ///
    /// # Errors
    /// When the program's tables do not fit together.
    fn executive(
        &self,
        program: &Program,
        choices: &Choices<'_>,
    ) -> Result<Box<dyn Executive + Send>, String>;
}

/// The controls, in the order of [`Dialect::ALL`].
const CONTROLS: &[&dyn ControlOptions] = &[&pmi::Pmi, &nct::Nct, &pmac::Pmac];

const _: () = assert!(CONTROLS.len() == Dialect::ALL.len(), "CONTROLS misses a control");

/// The control of a language.
#[allow(clippy::indexing_slicing, reason = "the assertion above holds the list to the dialects")]
fn control(dialect: Dialect) -> &'static dyn ControlOptions {
    CONTROLS[dialect as usize]
}

/// The settings that are chosen for one run.
struct Choices<'a> {
    /// The options of the command line.
    args: &'a ControlArgs,
    /// Whether the clock paces the ticks.
    realtime: bool,
    /// A machine file whose settings replace those that the program was compiled with.
    machine: Option<&'a Machine>,
}

/// Why there is no executive for a program with these options.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum ControlError {
    /// An option is for programs in another language.
    #[error("{option} is for {of} programs; this one is {is}")]
    OtherLanguage {
        /// The option, as it is written on the command line.
        option: &'static str,
        /// The language that has it.
        of: &'static str,
        /// The language of the program.
        is: &'static str,
    },
    /// The program's tables do not fit together.
    #[error("the program can't be run: {0}")]
    Damaged(String),
}

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
) -> Result<Box<dyn Executive + Send>, ControlError> {
    check(args, program.dialect())?;
    let choices = Choices { args, realtime, machine };
    let executive = control(program.dialect()).executive(program, &choices);
    executive.map_err(ControlError::Damaged)
}

/// Whether a machine file says something that is used when a program runs, rather than when it is
/// compiled.
pub fn takes_machine_file(program: &Program) -> bool {
    control(program.dialect()).takes_machine_file()
}

/// Refuses options that are for controls of another language than `dialect`.
fn check(args: &ControlArgs, dialect: Dialect) -> Result<(), ControlError> {
    for &other in Dialect::ALL.iter().filter(|&&other| other != dialect) {
        if let Some(option) = control(other).first_given(args) {
            let (of, is) = (other.name(), dialect.name());
            return Err(ControlError::OtherLanguage { option, of, is });
        }
    }
    Ok(())
}
