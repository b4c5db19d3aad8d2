//! The options that `plcc run` and `plcrt` share, with their help texts.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use clap::{ArgGroup, Args};
use plcc_abi::OperatorPanel;
use plcc_image::latch::Rule;

use crate::socket::{AllowedGroup, AllowedUser};
use plcc_abi::time::duration;
use plcc_control::ControlArgs;
use plcc_files::why_not_read;
use plcc_load::signature::PublicKey;
use plcc_protocol::Permission;

use crate::run::OverrunPolicy;
use crate::simulation::Simulation;
use plcc_record::{Keep, RecordedProgram};
use plcc_runtime::safe_outputs::SafeOutput;
use plcc_runtime::watchdog::WatchdogLimit;

/// What a run does. `--machine` is not among the options here, since `plcc run` uses the machine file
/// when it compiles, too, and `plcrt` takes only a part of it.
///
/// An option that needs another one names a group of it. The option `--config` of `plcrt` is in each of these
/// groups, since a configuration may have what an option on the command line needs.
#[derive(Args, Clone, Debug, Default)]
#[command(
    group(ArgGroup::new("paced").multiple(true)),
    group(ArgGroup::new("served").multiple(true)),
    group(ArgGroup::new("retained").multiple(true))
)]
pub struct RunArgs {
    /// Runs exactly N base ticks: PMI scans, NCT slices of 20 ms, PMAC servo cycles
    #[arg(
        long,
        value_name = "N",
        conflicts_with = "duration",
        value_parser = ticks,
        allow_negative_numbers = true
    )]
    pub ticks: Option<u64>,

    /// Runs the ticks that begin before this time of the control has passed: 5s, 200ms, 1.5m, 2h
    #[arg(long = "for", id = "duration", value_name = "TIME", value_parser = duration)]
    pub duration: Option<Duration>,

    /// Begins each tick when the clock says so; without --ticks or --for until Ctrl-C (exit 130)
    #[arg(long, group = "paced")]
    pub realtime: bool,

    /// What is done when a tick begins only when a later one is already due, with --realtime: skip leaves
    /// out the ticks whose time has passed (timers go on by them), stop stops the program with OVERRUN,
    /// catch-up=N makes up for at most N ticks [default: skip]
    #[arg(long, value_name = "skip|stop|catch-up=N")]
    pub overrun: Option<OverrunPolicy>,

    /// A table `tick,name,value` of what the machine and the operator do
    #[arg(long, value_name = "FILE.csv")]
    pub stimulus: Option<PathBuf>,

    /// Begins the stimulus again after its last tick, for as long as the run lasts
    #[arg(long)]
    pub repeat: bool,

    #[allow(
        rustdoc::broken_intra_doc_links,
        reason = "the text is the option's help, where brackets are brackets"
    )]
    /// The other side answers: a simulated control for PMI and NCT, motors and motion programs for
    /// PMAC, and small machines, as the table [simulator] of the machine file says. The stimulus may
    /// then press keys: KEY.CYCLE START
    #[arg(long)]
    pub simulate: bool,

    /// The part program that a simulated control executes, in the place of the machine file's
    #[arg(long, value_name = "FILE", requires = "simulate")]
    pub part_program: Option<PathBuf>,

    /// The path of the machine file.
    #[arg(skip)]
    pub machine_path: Option<PathBuf>,

    /// What the simulator is made from, once that was read.
    #[arg(skip)]
    pub simulation: Option<Arc<Simulation>>,

    /// Variables for the trace and the dump.
    #[arg(
        long,
        value_name = "NAME,NAME…",
        help = "Variables for the trace and the dump: LS27,A[3],@FRO or I002,F020 or \
                P1,&2Q5,X:$0700. A name with * or ? is a pattern for the names in a dump, as in \
                'SP*'. Without --trace the trace goes to standard output, unless --dump - or \
                --events - does"
    )]
    pub watch: Vec<String>,

    /// Writes the names that people gave in the place of the language's in traces, dumps and events: the aliases of
    /// `[names]` in the machine file, and a PMAC's #define names
    #[arg(long)]
    pub aliases: bool,

    /// Writes a row `tick,name,value` whenever a watched variable changes (- is standard output);
    /// a file whose name ends in .vcd becomes a value change dump for waveform viewers
    #[arg(long, value_name = "OUT.csv|OUT.vcd")]
    pub trace: Option<PathBuf>,

    /// Adds the time at which its tick began to each row of the trace: `tick,ms,name,value`
    #[arg(long)]
    pub time: bool,

    /// Writes what the program reports, faults, messages, SENDs, DISPLAYs, COMMANDs and its stop, a
    /// JSON object a line (- is standard output)
    #[arg(long, value_name = "OUT.jsonl")]
    pub events: Option<PathBuf>,

    /// Appends what happens around the program, such as overruns and files that can't be written, a
    /// JSON object a line (- is standard output)
    #[arg(long, value_name = "OUT.jsonl")]
    pub log: Option<PathBuf>,

    /// Writes all variables after the last tick as JSON (- is standard output)
    #[arg(long, value_name = "OUT.json")]
    pub dump: Option<PathBuf>,

    /// The file that holds what survives power-off: it is read at the start, if it exists, and
    /// written at the end, with --realtime also after changes
    #[arg(long, value_name = "FILE", group = "retained")]
    pub retain: Option<PathBuf>,

    /// Runs nothing (exit 2) if neither the retained file nor its copy exists
    #[arg(long, requires = "retained")]
    pub retain_must_exist: bool,

    /// Records the run, so that `plcc replay` can run every tick again: all that acts on the control, what
    /// the clock decides, and its state now and then. With --realtime it is appended to what is in the
    /// file
    #[arg(long, value_name = "FILE")]
    pub record: Option<PathBuf>,

    /// How much the record keeps: 200MB, 10min, 2h [default: 200MB]
    #[arg(long, value_name = "SIZE|TIME")]
    pub keep: Option<Keep>,

    /// Records nothing, also where a configuration says so
    #[arg(long)]
    pub no_record: bool,

    /// A file that always shows the process image after the last whole tick, for other processes to
    /// map into their memory; best below /dev/shm or /run
    #[arg(long, value_name = "FILE")]
    pub image: Option<PathBuf>,

    /// A Unix socket for plcctl, by which the same user and root can look at the running control;
    /// --allow says what else they may do. Needs --realtime
    #[arg(long, value_name = "PATH", group = "served", requires = "paced")]
    pub socket: Option<PathBuf>,

    /// What may be done through the socket in addition to reading: operate (press the keys of the operator's
    /// screen), write (variables), force (inputs and outputs),
    /// swap (the program), stop (it, and start it again)
    #[arg(long, value_name = "WHAT,WHAT…", value_delimiter = ',', requires = "served")]
    pub allow: Vec<Permission>,

    /// A further user, by name or number, who may use the socket like the one who runs the control
    #[arg(long, value_name = "USER,USER…", value_delimiter = ',', requires = "served")]
    pub allow_user: Vec<AllowedUser>,

    /// A group whose members may use the socket, by name or number
    #[arg(long, value_name = "GROUP,GROUP…", value_delimiter = ',', requires = "served")]
    pub allow_group: Vec<AllowedGroup>,

    /// How long a scan of any task may take on the clock before the program is stopped: 50ms, 500us, 1s.
    /// In real time three periods of the control, at least 50ms, without this option; `off` sets no limit.
    /// In simulated time there is none without it
    #[arg(long, value_name = "TIME|off", value_parser = watchdog)]
    pub watchdog: Option<WatchdogLimit>,

    /// What a physical output becomes when the program is stopped or a signal ends the run; without
    /// this option it is switched off. May be given several times
    #[arg(long, value_name = "NAME=off|hold|VALUE")]
    pub safe: Vec<SafeOutput>,

    /// Runs the artifact only if it is signed with the private key of this public key, which
    /// `plcc key new` makes
    #[arg(long, value_name = "PUBKEY")]
    pub key: Option<PathBuf>,

    /// The file that gets a picture of the watched variables; the caller of the session draws it.
    #[arg(skip)]
    pub plot: Option<PathBuf>,

    /// What the configuration says of inputs that other processes give, by the inputs' names.
    #[arg(skip)]
    pub input_rules: Vec<(String, Rule)>,

    /// What an operator sees of the control's panels; `None` where nobody knows it.
    #[arg(skip)]
    pub operator: Option<Arc<OperatorPanel>>,

    /// Shows the compiled code to gdb, which then stops at lines of the source (`break lathe.pmi:75`) and
    /// prints variables. In this process alone, and without the watchdog that real time has otherwise
    #[arg(long)]
    pub gdb: bool,

    /// The program, for its record.
    #[arg(skip)]
    pub program: Option<Arc<RecordedProgram>>,

    /// When the process began, or its supervisor's.
    #[arg(skip)]
    pub started: Option<Instant>,

    /// Whether standard input is the connection to a supervisor of this process.
    #[arg(skip)]
    pub supervised: bool,

    /// Files that are read besides the sources and the stimulus: an artifact, a machine file. No
    /// output may overwrite them.
    #[arg(skip)]
    pub reads: Vec<PathBuf>,

    /// The settings of the control.
    #[command(flatten)]
    pub control: ControlArgs,
}

impl RunArgs {
    /// The key of `--key`, if it is given.
    ///
    /// # Errors
    /// Why the file can't be used, with its name.
    pub fn public_key(&self) -> Result<Option<PublicKey>, String> {
        let open = |path: &PathBuf| {
            let named = |error: io::Error| match error.kind() {
                io::ErrorKind::InvalidData => format!("{}: {error}", path.display()),
                _ => format!("{} can't be read: {}", path.display(), why_not_read(&error)),
            };
            PublicKey::open(path).map_err(named)
        };
        self.key.as_ref().map(open).transpose()
    }

    /// Where the trace goes: to the file that is named, else, where variables are watched and
    /// nothing else is printed, to standard output (`-`).
    pub fn trace_path(&self) -> Option<&Path> {
        let printed = [&self.events, &self.dump];
        let stdout_taken = printed.into_iter().flatten().any(|path| path.as_os_str() == "-");
        match &self.trace {
            Some(path) => Some(path),
            None if self.watch.is_empty() || stdout_taken || self.plot.is_some() => None,
            None => Some(Path::new("-")),
        }
    }
}

/// A number of ticks.
fn ticks(text: &str) -> Result<u64, String> {
    text.parse().map_err(|_| "a whole number of ticks is expected, as in 500".into())
}

/// The watchdog's limit: a time with its unit, or none.
pub(crate) fn watchdog(text: &str) -> Result<WatchdogLimit, String> {
    if text.trim().eq_ignore_ascii_case("off") {
        return Ok(WatchdogLimit::Off);
    }
    match duration(text)? {
        time if time.is_zero() => Err("a time above 0 is expected; `off` sets no limit".into()),
        time => Ok(WatchdogLimit::Time(time)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_whole_numbers() {
        assert_eq!(ticks("500"), Ok(500));
        for text in ["ten", "-1", "1.5", "", "18446744073709551616"] {
            assert!(ticks(text).is_err_and(|why| why.contains("whole number")), "{text}");
        }
    }

    #[test]
    fn the_watchdog_has_a_time_or_none() {
        let ms = |ms| Ok(WatchdogLimit::Time(Duration::from_millis(ms)));
        assert_eq!(watchdog("50ms"), ms(50));
        assert_eq!(watchdog("1500us").ok(), Some(WatchdogLimit::Time(Duration::from_micros(1500))));
        assert_eq!(watchdog("OFF"), Ok(WatchdogLimit::Off));
        for text in ["0ms", "", "50", "on", "-1s"] {
            assert!(watchdog(text).is_err(), "{text}");
        }
    }
}
