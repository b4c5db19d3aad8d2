//! The options of `plcc test`.

use std::path::PathBuf;

use clap::Args;
use plcc_control::ControlArgs;

use super::{EngineArg, OptArg, SourceArgs};

#[derive(Args)]
pub(crate) struct TestArgs {
    /// Test scripts, or folders in which all scripts (*.plctest) are run
    #[arg(required_unless_present_any = ["coverage", "from"], value_name = "SCRIPT|DIR")]
    pub(crate) paths: Vec<PathBuf>,

    /// Runs only tests whose names contain this text
    #[arg(long, value_name = "TEXT")]
    pub(crate) filter: Option<String>,

    /// The engine that executes the programs [default: jit]
    #[arg(long, value_name = "ENGINE")]
    pub(crate) engine: Option<EngineArg>,

    /// How much the compiler optimises
    #[arg(long, value_name = "LEVEL", default_value = "speed")]
    pub(crate) opt: OptArg,

    /// Writes a report in JUnit's XML, which Jenkins, GitLab and GitHub show (- is standard output)
    #[arg(long, value_name = "OUT.xml")]
    pub(crate) junit: Option<PathBuf>,

    /// Counts how often each statement ran and what was seen of each contact; with a file whose name ends in .html,
    /// .info (LCOV) or .json writes what was seen there (- is JSON on standard output). The programs run in
    /// the statement interpreter then
    #[arg(long, value_name = "OUT.html|OUT.info|OUT.json", num_args = 0..=1)]
    pub(crate) coverage: Option<Option<PathBuf>>,

    /// The folder for the records of tests that failed [default: a new folder for temporary files]
    #[arg(long, value_name = "DIR")]
    pub(crate) records: Option<PathBuf>,

    /// Writes a script that gives a record's inputs again and expects its outputs, instead of running tests
    #[arg(long, value_name = "RECORD", conflicts_with_all = ["paths", "filter", "engine", "junit", "coverage", "records"])]
    pub(crate) from: Option<PathBuf>,

    /// Runs the tests again with each feedback of the simulated small machines stuck at 0 and at 1, and lists the faults of which no
    /// message, fault or stop of the program tells
    #[arg(long, conflicts_with_all = ["from", "search", "junit", "coverage"])]
    pub(crate) broken: bool,

    /// Looks, for this many seconds, for stimuli that cover what the tests do not cover yet, and writes them as a script with
    /// what came out, for a person to judge
    #[arg(long, value_name = "SECONDS", conflicts_with_all = ["from", "junit", "coverage", "records"])]
    pub(crate) search: Option<u64>,

    /// Begins a search with the random numbers of this seed; the search prints its own
    #[arg(long, value_name = "N", requires = "search")]
    pub(crate) seed: Option<u64>,

    /// The script that --from or --search writes [default: standard output]
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,

    #[command(flatten)]
    pub(crate) control: ControlArgs,

    #[command(flatten)]
    pub(crate) source: SourceArgs,
}
