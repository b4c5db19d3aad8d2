//! What the runtime asks of each control, and the place where the control of a program is chosen.
//!
//! A [`Control`] belongs to the tables of a program: they say which control the program is for. A
//! further language implements the trait for its tables in its own folder; the two matches below do
//! not compile until it is named in them.

#[cfg(feature = "args")]
use plcc_abi::{Dialect, machine::Machine};
use plcc_abi::{Program, Tables};

#[cfg(feature = "args")]
use crate::{Executive, args::ControlArgs};

/// What the runtime asks of the control that a program is for.
pub(crate) trait Control {
    /// Checks that the tables fit the image and the tasks of `program`, whose tables they are,
    /// before anything runs.
    ///
    /// # Errors
    /// What does not fit.
    fn validate(&self, program: &Program) -> Result<(), String>;

    /// Makes the executive of a program whose tables these are.
    ///
    /// # Errors
    /// When the tables do not fit together; the message is for people.
    #[cfg(feature = "args")]
    fn executive(
        &self,
        program: &Program,
        choices: &Choices<'_>,
    ) -> Result<Box<dyn Executive + Send>, String>;

    /// Whether a machine file says something that is used when the program runs, rather than when
    /// it is compiled.
    #[cfg(feature = "args")]
    fn takes_machine_file(&self) -> bool {
        false
    }
}

/// The settings that are chosen for one run.
#[cfg(feature = "args")]
pub(crate) struct Choices<'a> {
    /// The options of the command line.
    pub(crate) args: &'a ControlArgs,
    /// Whether the clock paces the ticks.
    pub(crate) realtime: bool,
    /// A machine file whose settings replace those that the program was compiled with.
    pub(crate) machine: Option<&'a Machine>,
}

/// The control that a program's tables are for.
pub(crate) fn control(tables: &Tables) -> &dyn Control {
    match tables {
        Tables::Pmi(tables) => tables,
        Tables::Nct(tables) => tables,
        Tables::Pmac(tables) => tables,
    }
}

/// The first option among `args` that only controls of language `dialect` have, as it is written on
/// the command line.
#[cfg(feature = "args")]
pub(crate) fn option_of(dialect: Dialect, args: &ControlArgs) -> Option<&'static str> {
    match dialect {
        Dialect::Pmi => args.pmi.first_given(),
        Dialect::Nct => args.nct.first_given(),
        Dialect::Pmac => args.pmac.first_given(),
    }
}
