//! The options of every command that reads a source.

use std::path::PathBuf;

use clap::Args;
use plcc_abi::Dialect;
use plcc_diag::lints::Lint;
use plcc_frontend::language;

use super::values::{ControllerArg, Denied, FormatArg, LimitsArg, define, denied, dialect, lint};

/// How a source is read.
#[derive(Args, Clone, Debug, Default)]
#[command(next_help_heading = "Source")]
pub(crate) struct SourceArgs {
    /// The language; without it the file's ending or its text decides
    #[arg(long, value_name = "DIALECT", value_parser = dialect(), ignore_case = true)]
    pub(crate) dialect: Option<Dialect>,

    /// Whether the original compiler's limits on lengths and numbers hold [default: original]
    #[arg(long, value_name = "LIMITS")]
    pub(crate) limits: Option<LimitsArg>,

    /// PMAC: what $(NAME) stands for (repeatable)
    #[arg(long, value_name = "NAME=VALUE", value_parser = define)]
    pub(crate) define: Vec<(String, String)>,

    /// PMAC: the controller that the program is for [default: pmac]
    #[arg(long, value_name = "CONTROLLER")]
    pub(crate) controller: Option<ControllerArg>,

    /// A machine file: executive variables, NCT's parameters and tables, which this machine has
    /// in addition to those of the manual [default: STEM.machine.toml beside the source, if it exists]
    #[arg(long, value_name = "FILE.toml")]
    pub(crate) machine: Option<PathBuf>,

    /// Ignores a STEM.machine.toml that lies beside the source
    #[arg(long, conflicts_with = "machine")]
    pub(crate) no_machine: bool,

    /// A further folder in which included files are looked for (repeatable)
    #[arg(short = 'I', value_name = "DIR")]
    pub(crate) include: Vec<PathBuf>,

    /// How diagnostics are written: for people, or as JSON for programs
    #[arg(long, value_name = "FORMAT", default_value = "human")]
    pub(crate) message_format: FormatArg,

    /// Does not show a lint's findings (repeatable); `plcc explain --search lint` lists the lints
    #[arg(short = 'A', value_name = "LINT", value_parser = lint)]
    pub(crate) lints_off: Vec<&'static Lint>,

    /// Shows a lint's findings, also those of a lint that is off otherwise (repeatable)
    #[arg(short = 'W', value_name = "LINT", value_parser = lint)]
    pub(crate) lints_on: Vec<&'static Lint>,

    /// Makes a lint's findings errors, or all warnings (repeatable)
    #[arg(short = 'D', long = "deny", value_name = "LINT|warnings", value_parser = denied)]
    pub(crate) deny: Vec<Denied>,
}

impl SourceArgs {
    /// The first option among those given that only programs of language `dialect` have, as it is
    /// written on the command line.
    pub(crate) fn option_of(&self, dialect: Dialect) -> Option<&'static str> {
        let language = language(dialect);
        let given = [
            ("--define", language.takes_definitions() && !self.define.is_empty()),
            ("--controller", language.has_controllers() && self.controller.is_some()),
        ];
        given.into_iter().find(|(_, given)| *given).map(|(option, _)| option)
    }
}
