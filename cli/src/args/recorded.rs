//! The options of the commands that read records: `plcc replay`, `plcc convert` and `plcc monitor`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::{EngineArg, SourceArgs};

#[derive(Args)]
pub(crate) struct ReplayArgs {
    /// The record
    #[arg(value_name = "FILE")]
    pub(crate) record: PathBuf,

    /// The program, where it is not to be taken from the record: its sources, or an artifact
    #[arg(value_name = "PROGRAM")]
    pub(crate) files: Vec<PathBuf>,

    /// The engine that executes the program [default: jit; an artifact is always aot]
    #[arg(long, value_name = "ENGINE")]
    pub(crate) engine: Option<EngineArg>,

    /// The run, where the record has several, counted from 1 [default: the last one]
    #[arg(long, value_name = "N")]
    pub(crate) run: Option<usize>,

    /// The first tick that is shown; those before it, from the nearest checkpoint on, are run too
    #[arg(long, value_name = "TICK")]
    pub(crate) from: Option<u64>,

    /// The last tick
    #[arg(long, alias = "to", value_name = "TICK")]
    pub(crate) until: Option<u64>,

    /// Variables for the trace and the dump, as `plcc run` takes them
    #[arg(long, value_name = "NAME,NAME…")]
    pub(crate) watch: Vec<String>,

    /// Writes the names that people gave in the place of the language's in trace, dump and events: the aliases of `[names]` in the
    /// machine file, and a PMAC's #define names
    #[arg(long)]
    pub(crate) aliases: bool,

    /// Writes a row `tick,name,value` whenever a watched variable changes (- is standard output);
    /// a file whose name ends in .vcd becomes a value change dump for waveform viewers
    #[arg(long, value_name = "OUT.csv|OUT.vcd")]
    pub(crate) trace: Option<PathBuf>,

    /// Adds the time at which its tick began to each row of the trace: `tick,ms,name,value`
    #[arg(long)]
    pub(crate) time: bool,

    /// Writes what the program reports, a JSON object a line (- is standard output)
    #[arg(long, value_name = "OUT.jsonl")]
    pub(crate) events: Option<PathBuf>,

    /// Writes all variables after the last tick as JSON (- is standard output)
    #[arg(long, value_name = "OUT.json")]
    pub(crate) dump: Option<PathBuf>,

    #[command(flatten)]
    pub(crate) source: SourceArgs,
}

/// The formats of `plcc convert`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum ConvertFormat {
    /// A value change dump (IEEE 1364)
    Vcd,
    /// GTKWave's fast signal trace: a small file that is opened quickly
    Fst,
    /// A table `tick,ms,name,value`
    Csv,
    /// Messages in JSON, for Foxglove Studio, Lichtblick and PlotJuggler; only in a plcc that was built with the feature
    /// `mcap`, as released packages are
    Mcap,
}

#[derive(Args)]
pub(crate) struct ConvertArgs {
    /// The record
    #[arg(value_name = "FILE")]
    pub(crate) record: PathBuf,

    /// The program, where it is not to be taken from the record: its sources, or an artifact
    #[arg(value_name = "PROGRAM")]
    pub(crate) files: Vec<PathBuf>,

    /// The format
    #[arg(long, value_name = "FORMAT")]
    pub(crate) to: ConvertFormat,

    /// The output file [default: the record's name with the format's ending, in the current folder;
    /// a table is not written over a file that is there]
    #[arg(short, long, value_name = "OUT")]
    pub(crate) output: Option<PathBuf>,

    /// The variables [default: all that the program declares or names]
    #[arg(long, value_name = "NAME,NAME…")]
    pub(crate) watch: Vec<String>,

    /// Writes the names that people gave in the place of the language's in the file: the aliases of `[names]` in the
    /// machine file, and a PMAC's #define names
    #[arg(long)]
    pub(crate) aliases: bool,

    /// The run, where the record has several, counted from 1 [default: the last one]
    #[arg(long, value_name = "N")]
    pub(crate) run: Option<usize>,

    /// The first tick
    #[arg(long, value_name = "TICK")]
    pub(crate) from: Option<u64>,

    /// The last tick
    #[arg(long, value_name = "TICK")]
    pub(crate) until: Option<u64>,

    #[command(flatten)]
    pub(crate) source: SourceArgs,
}

/// The value of `--web`.
#[cfg(feature = "web")]
fn address(text: &str) -> Result<std::net::SocketAddr, String> {
    let expected = "ADDRESS:PORT is expected, as in 127.0.0.1:8080 or [::1]:8080";
    text.parse().map_err(|_| expected.to_owned())
}

#[derive(Args)]
pub(crate) struct MonitorArgs {
    /// A control's socket, a recording, or the source of a program
    #[arg(value_name = "TARGET")]
    pub(crate) target: PathBuf,

    /// The sources of a recorded artifact; of a PMAC program the other files of the download
    #[arg(value_name = "PROGRAM")]
    pub(crate) program: Vec<PathBuf>,

    /// The file in which the control is being recorded, for its statements and its past; without it the control says where that is
    #[arg(long, value_name = "FILE")]
    pub(crate) record: Option<PathBuf>,

    /// The stimulus of a program that runs here, as `plcc run` takes it
    #[arg(long, value_name = "IN.csv")]
    pub(crate) stimulus: Option<PathBuf>,

    /// A machine file
    #[arg(long, value_name = "FILE.toml")]
    pub(crate) machine: Option<PathBuf>,

    /// After how many ticks a program that runs here ends [default: never]
    #[arg(long, value_name = "N")]
    pub(crate) ticks: Option<u64>,

    /// The operator's screen: faults and messages in large letters, overrides, and the keys and lamps that the program uses.
    /// Keys are pressed, nothing else is changed
    #[arg(long)]
    pub(crate) operator: bool,

    /// How fast a program runs here: 1 is real time, 0 as fast as possible
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0)]
    pub(crate) speed: f64,

    /// Shows the screens in browsers, and prints the address of the page
    #[cfg(feature = "web")]
    #[arg(
        long,
        value_name = "ADDRESS:PORT",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = plcc_monitor::web::DEFAULT_ADDRESS,
        value_parser = address
    )]
    pub(crate) web: Option<std::net::SocketAddr>,

    /// Further options of `plcc run`
    #[arg(last = true, value_name = "OPTION")]
    pub(crate) run_options: Vec<String>,
}
