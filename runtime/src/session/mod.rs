//! A session: everything that `plcc run` and `plcrt` do with a compiled program. It makes the
//! executive, reads the stimulus and the retained file, runs the ticks until their end or Ctrl-C,
//! shows progress, writes the outputs, and gives the exit status.

mod executive;
mod output;
mod realtime_priority;
mod retained_writer;

use std::fmt::Display;
use std::fs;
use std::io::{self, IsTerminal, Write};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use plcc_abi::machine::Machine;
use plcc_abi::{Dialect, Engine, Program};
use thiserror::Error;

use crate::args::RunArgs;
use crate::files::why_not_read;
use crate::journal::{Destinations, EntryKind, Journal, JournalOwner, ScanJournal};
use crate::progress::Progress;
use crate::run::{Clock, End, Hook, Player, Run, Stimulus, SystemClock, TraceFormat, Watch, dump};
use crate::{Executive, PanicBarrier, retain};

pub use executive::{executive, takes_machine_file};
pub use output::write_whole;
use output::{Output, check_paths, check_writable, open};
use retained_writer::RetainedWriter;

/// Exit status: done.
pub const DONE: u8 = 0;
/// Exit status: wrong usage, an input that is not valid, an output that can't be written.
pub const USAGE: u8 = 2;
/// Exit status: the program was stopped by a run-time fault.
pub const STOPPED: u8 = 3;
/// Exit status: Ctrl-C.
pub const INTERRUPTED: u8 = 130;

/// Why a program could not be run, or its results not be written: exit status 2. The message says
/// which file or option is meant.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{0}")]
pub struct SessionError(pub String);

/// Runs a program as the options say, with messages on standard error, and gives the exit status.
///
/// `engine` is one of `program`. `machine` is the machine file of this run; without one, the settings
/// that the program was compiled with are used.
pub fn run(
    program: &Program,
    engine: &mut dyn Engine,
    args: &RunArgs,
    machine: Option<&Machine>,
) -> u8 {
    run_with_clock(program, engine, args, machine, &SystemClock)
}

/// Does what [`run`] does, with a clock of the caller's to pace the ticks where they are paced
/// (`--realtime`).
pub fn run_with_clock(
    program: &Program,
    engine: &mut dyn Engine,
    args: &RunArgs,
    machine: Option<&Machine>,
    clock: &dyn Clock,
) -> u8 {
    match session(program, engine, args, machine, clock) {
        Ok(status) => status,
        Err(error) => {
            message("error", error);
            USAGE
        }
    }
}

/// Writes a message for people to standard error; that fails silently, since there is nowhere else to
/// say so.
fn message(kind: &str, text: impl Display) {
    let _ = writeln!(std::io::stderr(), "{kind}: {text}");
}

/// Checks what can be checked without the program's control, and runs the program with a journal.
fn session(
    program: &Program,
    engine: &mut dyn Engine,
    args: &RunArgs,
    machine: Option<&Machine>,
    clock: &dyn Clock,
) -> Result<u8, SessionError> {
    if args.ticks.is_none() && args.duration.is_none() && !args.realtime {
        let text = "nothing says how long the program is to run: give --ticks N, --for 5s, or \
                    --realtime to run until Ctrl-C";
        return Err(SessionError(text.into()));
    }
    check_paths(program, args)?;
    for path in args.dump.iter().chain(&args.retain) {
        check_writable(path)?;
    }
    let log = args.log.as_deref().map(|path| open(path, true, args.realtime)).transpose()?;
    let mut to = Destinations::standard(log);
    if args.realtime && io::stderr().is_terminal() {
        to.progress = Some(args.ticks);
    }
    let (owner, scan) = JournalOwner::start(to, args.realtime)
        .map_err(|error| SessionError(format!("no thread can be started: {error}")))?;
    let journal = owner.journal();
    let job = Job { program, args, machine, clock, journal: &journal };
    let status = job.run(engine, scan).unwrap_or_else(|error| {
        journal.error(error.0);
        USAGE
    });
    match (owner.finish(), &args.log) {
        (Err(why), Some(log)) => {
            Err(SessionError(format!("{} can't be written: {why}", log.display())))
        }
        _ => Ok(status),
    }
}

/// What a run is made from.
struct Job<'a> {
    program: &'a Program,
    args: &'a RunArgs,
    machine: Option<&'a Machine>,
    clock: &'a dyn Clock,
    journal: &'a Journal,
}

impl Job<'_> {
    /// Runs the program and gives the exit status.
    fn run(&self, engine: &mut dyn Engine, scan: ScanJournal) -> Result<u8, SessionError> {
        let Self { program, args, machine, clock, journal } = *self;
        let mut executive = executive(program, &args.control, args.realtime, machine)?;
        let executive = executive.as_mut();
        if let Some(path) = &args.retain {
            restore(path, program.dialect(), executive, journal)?;
        }
        let stimulus = match &args.stimulus {
            Some(path) => stimulus(path, executive)?,
            None => Stimulus::default(),
        };
        warn_of_idle_options(args, journal);
        let watch = Watch::parse(&args.watch, executive).map_err(|errors| {
            let errors: Vec<String> = errors.iter().map(|e| format!("--watch: {e}")).collect();
            SessionError(errors.join("\nerror: "))
        })?;
        let ticks = match args.duration {
            Some(time) => Some(ticks_in(time, executive.tick_ns())),
            None => args.ticks,
        };
        let interrupt = Arc::new(AtomicBool::new(false));
        listen(&interrupt)?;

        let trace_path = args.trace_path();
        let mut trace = trace_path.map(Output::create).transpose()?;
        let mut events = args.events.as_deref().map(Output::create).transpose()?;
        let mut progress = Progress::new(ticks);
        let mut retained_writer = match &args.retain {
            Some(path) if args.realtime => Some(RetainedWriter::new(path, program.dialect())?),
            _ => None,
        };
        if args.realtime
            && let Err(why) = realtime_priority::request()
        {
            journal.note(why);
        }
        let mut hooks: Vec<&mut dyn Hook> = vec![];
        if !args.realtime {
            hooks.push(&mut progress);
        }
        if let Some(retained_writer) = &mut retained_writer {
            hooks.push(retained_writer);
        }
        let mut engine = PanicBarrier::new(engine);
        let end = Run {
            executive,
            engine: &mut engine,
            player: Player::new(stimulus, args.repeat),
            watch: watch.clone(),
            trace: trace.as_mut().map(|out| out as &mut dyn Write),
            trace_format: trace_path
                .map_or_else(TraceFormat::default, |path| TraceFormat::of(path, args.time)),
            events: events.as_mut().map(|out| out as &mut dyn Write),
            ticks,
            clock: args.realtime.then_some(clock),
            interrupt: Some(&interrupt),
            hooks,
            journal: scan,
        }
        .go();
        progress.clear();

        let mut status = status(&end, journal);
        let mut check = |result: Result<(), SessionError>| {
            if let Err(error) = result {
                journal.error(error.0);
                status = USAGE;
            }
        };
        if let Some(path) = &args.dump {
            check(write_dump(path, program.dialect(), executive, &watch, &end));
        }
        if let Some(retained_writer) = retained_writer {
            check(retained_writer.finish());
        }
        if let Some(path) = &args.retain {
            check(keep(path, program.dialect(), executive));
        }
        Ok(status)
    }
}

/// Warns of options that do nothing without another one.
fn warn_of_idle_options(args: &RunArgs, journal: &Journal) {
    if args.trace.is_some() && args.watch.is_empty() {
        journal.warn("the trace will be empty: --watch NAME,NAME… says what it shows");
    } else if args.time && args.trace_path().is_none() {
        journal.warn("--time changes nothing: no trace is written");
    }
    if args.repeat && args.stimulus.is_none() {
        journal.warn("--repeat changes nothing: there is no --stimulus");
    }
}

/// Reports to people how a run ended, and gives its exit status.
fn status(end: &End, journal: &Journal) -> u8 {
    if end.punctuality.overruns > 0 {
        let late = end.punctuality.latest.as_secs_f64() * 1000.0;
        let (overruns, ticks) = (end.punctuality.overruns, end.ticks);
        journal.warn(format!(
            "{overruns} of {ticks} ticks began only when the next one was already due; the latest \
             began {late:.1} ms late"
        ));
    }
    if let Some(stop) = &end.stop {
        let tick = end.ticks.saturating_sub(1);
        let (code, message) = (stop.code.clone(), stop.message.clone());
        journal.write(EntryKind::Stopped { at: tick, code, message });
    }
    if let Some(failure) = &end.failure
        && !failure.is_closed_pipe()
    {
        journal.error(failure.to_string());
        return USAGE;
    }
    match (&end.stop, end.interrupted) {
        (Some(_), _) => STOPPED,
        (None, true) => INTERRUPTED,
        (None, false) => DONE,
    }
}

/// How many ticks of `tick_ns` nanoseconds begin before the time has passed.
fn ticks_in(time: Duration, tick_ns: u64) -> u64 {
    let ticks = time.as_nanos().div_ceil(u128::from(tick_ns.max(1)));
    u64::try_from(ticks).unwrap_or(u64::MAX)
}

/// Has Ctrl-C (SIGINT), SIGTERM and a terminal that is closed (SIGHUP) set the flag. A second SIGINT
/// or SIGTERM ends the process at once; a second SIGHUP does not, since closing one terminal may
/// send two.
fn listen(flag: &Arc<AtomicBool>) -> Result<(), SessionError> {
    use signal_hook::{consts, flag};
    let failed = |error| SessionError(format!("Ctrl-C can't be listened for: {error}"));
    for signal in [consts::SIGINT, consts::SIGTERM] {
        flag::register_conditional_shutdown(signal, INTERRUPTED.into(), Arc::clone(flag))
            .and_then(|_| flag::register(signal, Arc::clone(flag)))
            .map_err(failed)?;
    }
    if !ignores_hangup() {
        flag::register(consts::SIGHUP, Arc::clone(flag)).map_err(failed)?;
    }
    Ok(())
}

/// Whether the process was started to survive its terminal (`nohup plcc run …`). Where the system
/// does not say, it is taken to be so.
fn ignores_hangup() -> bool {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_none_or(|mask| mask & 1 != 0)
}

/// Reads a stimulus file for a control.
///
/// # Errors
/// When it can't be read, or with the first lines that are wrong and the number of the others.
pub fn stimulus(path: &Path, executive: &mut dyn Executive) -> Result<Stimulus, SessionError> {
    let shown = path.display();
    let bytes = fs::read(path).map_err(|error| {
        SessionError(format!("{shown} can't be read: {}", why_not_read(&error)))
    })?;
    Stimulus::parse(&bytes, executive).map_err(|errors| {
        let mut lines: Vec<String> =
            errors.lines.iter().map(|e| format!("{shown}:{}: {}", e.line, e.message)).collect();
        if errors.more > 0 {
            lines.push(format!("{shown}: and {} more", errors.more));
        }
        SessionError(lines.join("\nerror: "))
    })
}

fn restore(
    path: &Path,
    dialect: Dialect,
    executive: &mut dyn Executive,
    journal: &Journal,
) -> Result<(), SessionError> {
    let found = retain::load(path, dialect).map_err(|e| SessionError(e.to_string()))?;
    let Some(retained) = found else { return Ok(()) };
    if let Some(why) = retained.damaged {
        let shown = path.display();
        journal.warn(format!(
            "the copy of the retained file {shown} is used, since the file itself can't be: {why}"
        ));
    }
    executive.restore(&retained.payload).map_err(|why| {
        let shown = path.display();
        SessionError(format!("the retained file {shown} can't be used: {why}; name another one"))
    })
}

fn keep(path: &Path, dialect: Dialect, executive: &dyn Executive) -> Result<(), SessionError> {
    match executive.retained() {
        Some(payload) => {
            retain::store(path, dialect, payload).map_err(|e| SessionError(e.to_string()))
        }
        None => Ok(()),
    }
}

fn write_dump(
    path: &Path,
    dialect: Dialect,
    executive: &mut dyn Executive,
    watch: &Watch,
    end: &End,
) -> Result<(), SessionError> {
    let mut text = vec![];
    let written =
        dump(&mut text, dialect, executive, watch, end).and_then(|()| write_whole(path, &text));
    match written {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(SessionError(format!("the dump can't be written: {error}")))
        }
        _ => Ok(()),
    }
}
