//! The options of `plcc why`.

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;
use plcc_abi::time::duration;
use plcc_control::ControlArgs;

use super::SourceArgs;

#[derive(Args)]
pub(crate) struct WhyArgs {
    /// A record, the socket of a control that runs, or a source; then the program's sources, where the record has none
    /// or the control has no record, or the other files of a PMAC download
    #[arg(required = true, value_name = "TARGET")]
    pub(crate) target: Vec<PathBuf>,

    /// The variable: a single one, or an element of an array; or the text of a fault, of a message or of a PMAC's
    /// SEND, DISPLAY or COMMAND, or a part of it; "TEXT" in quotes is nothing but all of a text
    #[arg(value_name = "NAME")]
    pub(crate) name: String,

    /// The tick at whose end the value is explained [default: the last one]
    #[arg(long, value_name = "N")]
    pub(crate) tick: Option<u64>,

    /// A source: how many ticks are run [default: up to --tick, or else as many as the stimulus has]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    pub(crate) ticks: Option<u64>,

    /// A source: the same as a time, as in 500ms, 5s or 2min
    #[arg(long = "for", id = "duration", value_name = "TIME", value_parser = duration, conflicts_with = "ticks")]
    pub(crate) duration: Option<Duration>,

    /// A source: a table `tick,name,value` of what the machine and the operator do
    #[arg(long, value_name = "FILE.csv")]
    pub(crate) stimulus: Option<PathBuf>,

    /// A source: begins the stimulus again after its last tick
    #[arg(long)]
    pub(crate) repeat: bool,

    /// A source: the other side answers, as with `plcc run --simulate`
    #[arg(long)]
    pub(crate) simulate: bool,

    /// A source: the part program that a simulated control executes
    #[arg(long, value_name = "FILE", requires = "simulate")]
    pub(crate) part_program: Option<PathBuf>,

    /// A socket: the file in which the control is being recorded; without it the control says where that is
    #[arg(long, value_name = "FILE")]
    pub(crate) record: Option<PathBuf>,

    #[command(flatten)]
    pub(crate) control: ControlArgs,

    #[command(flatten)]
    pub(crate) source: SourceArgs,
}
