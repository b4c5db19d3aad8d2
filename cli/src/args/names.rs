//! The options of the commands that tell what names mean and where they stand: `plcc explain` and `plcc xref`.

use std::path::PathBuf;

use clap::Args;
use plcc_abi::Dialect;

use super::values::dialect;
use super::{ControllerArg, SourceArgs};

#[derive(Args)]
pub(crate) struct ExplainArgs {
    /// Codes of diagnostics, keywords, variables and memory words of a control, in any case of
    /// letters; also families (Ix22) and rows (M11..18) of PMAC's variables
    #[arg(required_unless_present_any = ["list", "search"], value_name = "CODE|NAME")]
    pub(crate) what: Vec<String>,

    /// Lists everything that can be explained, a line each
    #[arg(long, conflicts_with = "what")]
    pub(crate) list: bool,

    /// Lists what has all of these words in its line, in any case of letters
    #[arg(long, value_name = "WORD", num_args = 1.., conflicts_with_all = ["what", "list"])]
    pub(crate) search: Vec<String>,

    /// Explains only what it means in this language
    #[arg(long, value_name = "DIALECT", value_parser = dialect(), ignore_case = true)]
    pub(crate) dialect: Option<Dialect>,

    /// Explains only what PMAC's variables mean on this controller
    #[arg(long, value_name = "CONTROLLER")]
    pub(crate) controller: Option<ControllerArg>,
}

#[derive(Args)]
pub(crate) struct XrefArgs {
    /// The source, - is standard input; several files are one PMAC download, in their order
    #[arg(required = true, value_name = "FILE")]
    pub(crate) files: Vec<PathBuf>,

    #[command(flatten)]
    pub(crate) source: SourceArgs,
}
