//! The options of `plcc prove`.

use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, ValueEnum};
use plcc_abi::time::duration;
use plcc_control::ControlArgs;

use super::SourceArgs;

/// What is done with pairs of contrary outputs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Contrary {
    /// They are told
    Tell,
    /// They are asked
    Ask,
}

/// What other model checkers read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum ProofForm {
    /// AIGER 1.9, as text where the file's name ends in .aag; each question is a property `bad`
    Aiger,
}

#[derive(Args)]
pub(crate) struct ProveArgs {
    /// The source; for PMAC the files of a download, in their order
    #[arg(required = true, value_name = "FILE")]
    pub(crate) files: Vec<PathBuf>,

    /// A condition that must not hold at the end of any scan (repeatable)
    #[arg(long, value_name = "COND")]
    pub(crate) never: Vec<String>,

    /// A condition that must hold at the end of every scan (repeatable)
    #[arg(long, value_name = "COND")]
    pub(crate) always: Vec<String>,

    /// That a condition follows another one within a time, as in 'START, MOTOR within 200 ms' (repeatable)
    #[arg(long, value_name = "COND, COND within TIME")]
    pub(crate) after: Vec<String>,

    /// A test script, whose lines `never`, `always` and `after` are asked; its tests are not run (repeatable)
    #[arg(long, value_name = "SCRIPT")]
    pub(crate) script: Vec<PathBuf>,

    /// Tells which outputs are contrary by their names and texts, as open and close are, and the question whether both can be
    /// on; with =ask the questions are asked
    #[arg(long, value_name = "WHAT", num_args = 0..=1, require_equals = true, default_missing_value = "tell")]
    pub(crate) contrary: Option<Contrary>,

    /// How long may be searched for the answer to each question, as in 500ms, 10s or 2min
    #[arg(long, value_name = "TIME", default_value = "60s", value_parser = duration)]
    pub(crate) timeout: Duration,

    /// Begins with what survives power-off as after a first start, instead of anything
    #[arg(long)]
    pub(crate) retained_as_declared: bool,

    /// Writes the program with the questions to a file for another model checker, and answers nothing
    #[arg(long, value_name = "FORM")]
    pub(crate) emit: Option<ProofForm>,

    /// The folder for the stimuli that refute conditions [default: the current folder]; with --emit the file, or the folder
    /// for STEM.aig
    #[arg(short = 'o', long, value_name = "DIR|FILE")]
    pub(crate) out: Option<PathBuf>,

    #[command(flatten)]
    pub(crate) control: ControlArgs,

    #[command(flatten)]
    pub(crate) source: SourceArgs,
}
