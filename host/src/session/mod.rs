//! A session: everything that `plcc run` and `plcrt` do with a compiled program. It makes the
//! executive, reads the stimulus and the retained file, runs the ticks until their end or Ctrl-C,
//! shows progress, writes the outputs, and gives the exit status.

mod interfaces;
mod motors;
mod output;
mod predecessor;
mod record;
pub mod replay;
mod reports;
mod retained_data;
mod retained_writer;
mod signals;
mod simulated;

use std::fmt::Display;
use std::io::{self, IsTerminal, Write as _};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use plcc_abi::machine::Machine;
use plcc_abi::{Engine, Program};

use crate::args::RunArgs;
use crate::journal::{Destinations, EntryKind, Journal, JournalOwner, ScanJournal};
use crate::progress::Progress;
use crate::run::{
    Clock, End, Hook, Player, Punctuality, Run, Stimulus, SystemClock, TimedEngine, Timing,
};
#[cfg(target_os = "linux")]
use crate::supervisor::Link;
use plcc_control::{Watch, dump};
use plcc_files::{MAX_STIMULUS, read_regular, why_not_read};
use plcc_record::ReplaceableExecutive;
use plcc_runtime::watchdog::{self, Watchdog, WatchdogLimit};
use plcc_runtime::{Executive, Names, PanicBarrier};

pub use crate::exit_status::{DONE, INTERRUPTED, STOPPED, SessionError, USAGE};
use crate::output_file::open;
use crate::realtime_priority;
use crate::signal_listener::refuse_suspension;
use interfaces::{Interfaces, StatusSources};
pub use motors::with_motors;
pub use output::{PathConflict, missing_folders, path_conflicts, write_whole};
use output::{check_paths, check_retained, check_writable};
use predecessor::Predecessor;
use record::{IdleCheckpoints, Record};
use reports::Reports;
use retained_data::RetainedData;
use signals::EndSignals;
pub use simulated::{simulated_executive, with_simulation};

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
    run_with(program, engine, args, machine, Surroundings::default())
}

/// What a caller of [`run_with`] gives besides the options.
pub struct Surroundings<'a> {
    /// Paces the ticks where they are paced (`--realtime`).
    pub clock: &'a dyn Clock,
    /// Is called before and after each tick, besides the session's own hooks.
    pub hook: Option<&'a mut dyn Hook>,
}

impl Default for Surroundings<'_> {
    fn default() -> Self {
        Self { clock: &SystemClock, hook: None }
    }
}

/// Does what [`run`] does, with a clock and a hook of the caller's.
pub fn run_with(
    program: &Program,
    engine: &mut dyn Engine,
    args: &RunArgs,
    machine: Option<&Machine>,
    surroundings: Surroundings<'_>,
) -> u8 {
    match session(program, engine, args, machine, surroundings) {
        Ok(status) => status,
        Err(error) => {
            message("error", error);
            USAGE
        }
    }
}

/// Writes a message for people to standard error. If that fails, nothing is said, since there is nowhere
/// else to say it.
fn message(kind: &str, text: impl Display) {
    let text = text.to_string();
    let _ = writeln!(std::io::stderr(), "{kind}: {}", plcc_abi::printable(&text));
}

/// Checks what can be checked without the program's control, and runs the program with a journal.
fn session(
    program: &Program,
    engine: &mut dyn Engine,
    args: &RunArgs,
    machine: Option<&Machine>,
    surroundings: Surroundings<'_>,
) -> Result<u8, SessionError> {
    if args.ticks.is_none() && args.duration.is_none() && !args.realtime {
        let text = "nothing says how long the program is to run: give --ticks N, --for 5s, or \
                    --realtime to run until Ctrl-C";
        return Err(SessionError(text.into()));
    }
    if args.realtime {
        refuse_suspension().map_err(SessionError)?;
    }
    check_paths(program, args)?;
    let _open_until_the_dump_is_written = args.dump.as_deref().map(check_writable).transpose()?;
    let _open_until_the_plot_is_written = args.plot.as_deref().map(check_writable).transpose()?;
    args.retain.as_deref().map_or(Ok(()), check_retained)?;
    let args = &with_simulation(program, args, machine)?;
    let log = args.log.as_deref().map(|path| open(path, true, args.realtime)).transpose()?;
    let mut to = Destinations::standard(log);
    if args.realtime && io::stderr().is_terminal() {
        to.progress = Some(args.ticks);
    }
    let (owner, scan) = JournalOwner::start(to, args.realtime)
        .map_err(|error| SessionError(format!("no thread can be started: {error}")))?;
    let journal = owner.journal();
    let Surroundings { clock, hook } = surroundings;
    let job = Job { program, args, machine, clock, journal: &journal };
    let status = job.run(engine, scan, hook).unwrap_or_else(|error| {
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
    fn run(
        &self,
        engine: &mut dyn Engine,
        scan: ScanJournal,
        hook: Option<&mut dyn Hook>,
    ) -> Result<u8, SessionError> {
        let Self { program, args, machine, clock, journal } = *self;
        let executive = simulated::executive(program, args, machine, journal)?;
        let mut replaceable = ReplaceableExecutive::new(executive);
        let executive: &mut dyn Executive = &mut replaceable;
        let names = executive.names();
        let lines = names.safe_lines(&args.safe).map_err(|errors| {
            let errors: Vec<String> = errors.iter().map(|e| format!("--safe: {e}")).collect();
            SessionError(errors.join("\nerror: "))
        })?;
        executive.set_safe_lines(lines);
        set_watchdog(executive, args)?;
        let predecessor = Predecessor::new(args.realtime, journal);
        let dialect = program.dialect();
        let mut retained = RetainedData::start(args, dialect, executive, &predecessor, journal)?;
        let stimulus = match &args.stimulus {
            Some(path) => stimulus(path, &*names, executive.tick_ns())?,
            None => Stimulus::default(),
        };
        warn_of_idle_options(args, journal);
        let watch = Watch::parse(&args.watch, &*names);
        let watch = watch.map(|watch| watch.with_aliases(args.aliases)).map_err(|errors| {
            let errors: Vec<String> = errors.iter().map(|e| format!("--watch: {e}")).collect();
            SessionError(errors.join("\nerror: "))
        })?;
        let ticks = match args.duration {
            Some(time) => Some(ticks_in(time, executive.tick_ns())),
            None => args.ticks,
        };
        let interrupt = Arc::new(AtomicBool::new(false));
        let _signals = EndSignals::set(&interrupt, args.realtime.then_some(journal))?;
        #[cfg(target_os = "linux")]
        let link = if args.supervised {
            let period = Duration::from_nanos(executive.tick_ns());
            let link = Link::start(period, &interrupt, journal);
            Some(
                link.map_err(|error| SessionError(format!("can't reach the supervisor: {error}")))?,
            )
        } else {
            None
        };

        let timing = Arc::new(Timing::new(program, args.started));
        let record = Record::start(args, machine, &mut replaceable, &predecessor, journal)?;
        let executive: &mut dyn Executive = &mut replaceable;
        let recorded = record.programs();
        let sources = StatusSources { retained: &retained, timing: &timing, recorded };
        let before = (&predecessor, journal);
        let mut interfaces = Interfaces::start(
            program,
            args,
            machine,
            executive,
            (&stimulus, &watch),
            sources,
            before,
        )?;
        let reports = Reports::open(args, &watch, executive, journal);
        if let (Err(_), Some(interfaces)) = (&reports, &mut interfaces) {
            // Nothing runs, and the image file is to say so.
            interfaces.hook.end(0, executive);
        }
        let mut reports = reports?;
        let mut progress = Progress::new(ticks);
        if args.realtime
            && let Err(why) = realtime_priority::request()
        {
            journal.note(why);
        }
        let mut hooks: Vec<&mut dyn Hook> = vec![];
        if let Some(hook) = hook {
            hooks.push(hook);
        }
        if !args.realtime {
            hooks.push(&mut progress);
        }
        if let RetainedData::Continually(writer) = &mut retained {
            hooks.push(writer);
        }
        if let Some(interfaces) = &mut interfaces {
            hooks.push(&mut interfaces.hook);
        }
        // The last, since it takes what is left of the time until the next tick.
        let mut idle_checkpoints = IdleCheckpoints;
        if args.realtime {
            hooks.push(&mut idle_checkpoints);
        }
        let mut engine = PanicBarrier::new(engine);
        let mut timed = TimedEngine::new(&mut engine, &timing);
        let trace_format = reports.format;
        let (trace, events, queues) = reports.parts();
        let end = Run {
            executive,
            engine: if args.realtime { &mut timed as &mut dyn Engine } else { timed.engine() },
            player: Player::new(stimulus, args.repeat),
            watch: watch.clone(),
            trace,
            trace_format,
            events,
            queues,
            ticks,
            clock: args.realtime.then_some(clock),
            overrun: args.overrun.unwrap_or_default(),
            timing: args.realtime.then_some(&*timing),
            interrupt: Some(&interrupt),
            hooks,
            journal: scan,
        }
        .go();
        #[cfg(target_os = "linux")]
        if let Some(link) = &link {
            link.ending();
        }
        progress.clear();
        if let Some(interfaces) = &mut interfaces {
            interfaces.hook.end(end.ticks, executive);
        }

        let recorded = record.finish(&mut replaceable, &end, journal);
        let executive: &mut dyn Executive = &mut replaceable;
        executive.notes_at_end().into_iter().for_each(|note| journal.note(note));
        if args.realtime {
            journal.write(EntryKind::Timing { summary: Box::new(timing.summary()) });
        }
        let mut status = status(&end, journal);
        let mut check = |result: Result<(), SessionError>| {
            if let Err(error) = result {
                journal.error(error.0);
                status = USAGE;
            }
        };
        // What survives power-off is saved first, in case that the power fails now.
        check(retained.finish(executive));
        check(recorded);
        if let Some(path) = &args.dump {
            let mut text = vec![];
            // Writing to memory does not fail.
            let _ =
                dump(&mut text, program.dialect(), executive, &watch, end.ticks, end.stop.as_ref());
            check(reports::write_dump(path, text, args.realtime, journal));
        }
        reports.finish();
        Ok(status)
    }
}

/// Has a watchdog watch the scans in real time, and wherever its option is given.
fn set_watchdog(executive: &mut dyn Executive, args: &RunArgs) -> Result<(), SessionError> {
    let limit = match args.watchdog {
        Some(WatchdogLimit::Time(limit)) => Some(limit),
        Some(WatchdogLimit::Off) => None,
        // A scan that a breakpoint holds up is not late.
        None if args.gdb => None,
        None => {
            args.realtime.then(|| watchdog::usual_limit(Duration::from_nanos(executive.tick_ns())))
        }
    };
    let shortest = executive.shortest_time_limit().filter(|_| args.realtime);
    // Without any limit there is nothing to watch.
    let Some(shortest) = shortest.or(limit) else { return Ok(()) };
    let watchdog = Watchdog::start(limit, shortest, realtime_priority::raise_above_scans);
    let watchdog =
        watchdog.map_err(|error| SessionError(format!("no watchdog can be started: {error}")))?;
    executive.set_watchdog(watchdog);
    Ok(())
}

/// Warns of options that do nothing without another one.
fn warn_of_idle_options(args: &RunArgs, journal: &Journal) {
    if args.trace.is_some() && args.watch.is_empty() {
        journal.warn("the trace will be empty: --watch NAME,NAME… says what it shows");
    } else if args.time && args.trace_path().is_none() {
        journal.warn("--time changes nothing: no trace is written");
    }
    if args.overrun.is_some() && !args.realtime {
        journal.warn("--overrun changes nothing: only --realtime has overruns");
    }
    if args.repeat && args.stimulus.is_none() {
        journal.warn("--repeat changes nothing: there is no --stimulus");
    }
    if args.keep.is_some() && args.record.is_none() {
        journal.warn("--keep changes nothing: there is no --record");
    }
}

/// Reports to people how a run ended, and gives its exit status.
fn status(end: &End, journal: &Journal) -> u8 {
    let Punctuality { overruns, skipped, latest } = end.punctuality;
    if overruns > 0 {
        let (late, ticks) = (latest.as_secs_f64() * 1000.0, end.ticks);
        journal.warn(format!(
            "{overruns} overruns in {ticks} ticks, of which {skipped} were skipped; the latest tick began \
             {late:.1} ms late"
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

/// Reads a stimulus file for a program with these names and ticks of `tick_ns` nanoseconds.
///
/// # Errors
/// When it can't be read, or with the first lines that are wrong and the number of the others.
pub fn stimulus(path: &Path, names: &dyn Names, tick_ns: u64) -> Result<Stimulus, SessionError> {
    let shown = path.display();
    let bytes = read_regular(path, MAX_STIMULUS).map_err(|error| {
        SessionError(format!("{shown} can't be read: {}", why_not_read(&error)))
    })?;
    Stimulus::parse(&bytes, names, tick_ns).map_err(|errors| {
        let mut lines: Vec<String> =
            errors.lines.iter().map(|e| format!("{shown}:{}: {}", e.line, e.message)).collect();
        if errors.more > 0 {
            lines.push(format!("{shown}: and {} more", errors.more));
        }
        SessionError(lines.join("\nerror: "))
    })
}
