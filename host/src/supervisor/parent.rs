//! The supervisor's own process.

use std::ffi::OsString;
use std::fs;
use std::io::{self, ErrorKind, IsTerminal, Read};
use std::os::fd::{AsFd, OwnedFd};
use std::os::unix::net::UnixStream;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::process::{Pid, PidfdFlags, Signal, kill_process, pidfd_open};
use signal_hook::consts;

use super::link::is_timeout;
use super::notify::Notifier;
use super::{Heartbeat, Phase};
use crate::exit_status::{STOPPED, USAGE};
use crate::image_file::SafeOutputWriter;
use crate::journal::{Destinations, EntryKind, Journal, JournalOwner};
use crate::output_file::open;
use crate::realtime_priority;
use crate::signal_listener::{SignalListener, ignores_hangup, refuse_suspension, take_suspension};
use plcc_runtime::small_thread::small_thread;

/// How long the supervisor waits for a heartbeat before it looks at the clock, in nanoseconds.
const HEARTBEAT_WAIT: i64 = 5_000_000;
/// Has `pidfd_open` give the end of one thread rather than that of a whole process (`PIDFD_THREAD`, which
/// is the number of `O_EXCL`).
const OF_ONE_THREAD: PidfdFlags = PidfdFlags::from_bits_retain(rustix::fs::OFlags::EXCL.bits());
/// After how much time without a heartbeat the whole process of a control is taken to hang.
const SILENCE: Duration = Duration::from_secs(3);
/// The longest time that a control may take from its start to its first tick, and from its last tick to
/// its end.
const LONGEST_START_AND_END: Duration = Duration::from_secs(60);
/// Time from a death to the next start.
const RESTART_WAIT: Duration = Duration::from_secs(1);
/// How long the supervisor sleeps at a time until then.
const RESTART_STEP: Duration = Duration::from_millis(20);

/// What a supervisor does.
#[derive(Clone, Debug, Default)]
pub struct Supervision {
    /// The words of the child's command line, without its program's name.
    pub words: Vec<OsString>,
    /// The image file, in which the outputs are made safe when the child can't.
    pub image: Option<PathBuf>,
    /// The log.
    pub log: Option<PathBuf>,
    /// How often a control that has died is started again.
    pub restart: u32,
    /// The hardware watchdog.
    pub device: Option<PathBuf>,
}

/// How a control's process ended.
enum Ending {
    /// By itself, with this exit status.
    Exit(u8),
    /// It died or hung, which is explained.
    Death(String),
}

/// Runs a control in a process of its own until its end, and gives the exit status: the control's own, or
/// [`STOPPED`] when it has died or had to be killed.
///
/// # Errors
/// When no process can be started.
pub fn supervise(supervision: &Supervision) -> Result<u8, String> {
    let signals: Arc<Signalled> = Arc::default();
    refuse_suspension()?;
    // The first control is started before signals are listened for. One that comes earlier ends this
    // process as usual, and then the control, which notices that its supervisor has died.
    let mut child = Some(Supervised::start(&supervision.words)?);
    let mut journal_owner: Option<JournalOwner> = None;
    let mut notifier = Notifier::new(supervision.device.as_deref())?;
    let mut restarts = 0;
    loop {
        let mut running = match child.take() {
            Some(running) => running,
            None => Supervised::start(&supervision.words)?,
        };
        signals.set_child(running.child.id());
        if journal_owner.is_none() {
            pass_signals_on(&signals)?;
            journal_owner = Some(start_journal(supervision.log.as_deref())?);
        }
        let Some(owner) = &journal_owner else { return Err("there is no journal".into()) };
        let journal = owner.journal();
        let ending = running.watch(&mut notifier, supervision.image.as_deref(), &journal)?;
        signals.set_child(0);
        match ending {
            Ending::Exit(status) => {
                notifier.end();
                finish(journal_owner);
                return Ok(status);
            }
            Ending::Death(how) => {
                notifier.status(&how);
                let is_to_end = || signals.is_to_end.load(Ordering::SeqCst);
                let again = restarts < supervision.restart && !running.was_to_end && !is_to_end();
                journal.write(EntryKind::ControlDied { how: how.clone(), restart: again });
                if !again {
                    finish(journal_owner);
                    return Ok(STOPPED);
                }
                restarts += 1;
                let restart_at = Instant::now() + RESTART_WAIT;
                while Instant::now() < restart_at && !is_to_end() {
                    notifier.waiting(Instant::now());
                    thread::sleep(RESTART_STEP);
                }
                if is_to_end() {
                    journal.note("a signal has come: the control is not started again");
                    finish(journal_owner);
                    return Ok(STOPPED);
                }
            }
        }
    }
}

/// What the thread that passes signals on shares with the one that watches the control.
#[derive(Debug, Default)]
struct Signalled {
    /// The number of the control's process; 0 while there is none.
    child: AtomicU32,
    /// Whether a signal has come that ends a run.
    is_to_end: AtomicBool,
}

impl Signalled {
    /// Notes the number of the control's process, 0 for none. A signal that came when the process was being
    /// started is made up for.
    fn set_child(&self, child: u32) {
        self.child.store(child, Ordering::SeqCst);
        if self.is_to_end.load(Ordering::SeqCst) {
            self.pass_on(Signal::TERM);
        }
    }

    /// Sends the control's process a signal, if there is one.
    fn pass_on(&self, signal: Signal) {
        let child = self.child.load(Ordering::SeqCst);
        if let Some(id) = i32::try_from(child).ok().and_then(Pid::from_raw) {
            // A child that has just ended takes no signal.
            let _ = kill_process(id, signal);
        }
    }
}

fn start_journal(log: Option<&Path>) -> Result<JournalOwner, String> {
    // The child opens it too and tells what is wrong with it. Each line is appended as a whole.
    let log = log.and_then(|path| open(path, true, true).ok());
    // A control that is killed leaves its line of progress on the terminal.
    let removes_progress = io::stderr().is_terminal();
    let to = Destinations { removes_progress, ..Destinations::standard(log) };
    let started = JournalOwner::start(to, true);
    started.map(|(owner, _)| owner).map_err(|error| format!("no thread can be started: {error}"))
}

fn finish(owner: Option<JournalOwner>) {
    // What went wrong with the log has been written to standard error.
    let _ = owner.map(JournalOwner::finish);
}

/// Starts a thread that passes the signals that end a run on to the child, if there is one, and notes that
/// one has come. A terminal sends Ctrl-C to both processes; the child takes signals within a second as
/// one. Ctrl-Z is passed on too, and the child says that it is refused.
fn pass_signals_on(signalled: &Arc<Signalled>) -> Result<(), String> {
    let failed = |error: io::Error| format!("can't install signal handlers: {error}");
    let mut wanted = vec![consts::SIGINT, consts::SIGTERM, consts::SIGQUIT, consts::SIGTSTP];
    // A process that was started to survive its terminal goes on, and so does its child.
    if !ignores_hangup() {
        wanted.push(consts::SIGHUP);
    }
    #[cfg(target_os = "linux")]
    wanted.push(Signal::POWER.as_raw());
    let signals = SignalListener::new(wanted).map_err(failed)?;
    let signalled = Arc::clone(signalled);
    let pass_on = move || {
        take_suspension();
        for signal in signals {
            if signal != consts::SIGTSTP {
                signalled.is_to_end.store(true, Ordering::SeqCst);
            }
            if let Some(signal) = Signal::from_named_raw(signal) {
                signalled.pass_on(signal);
            }
        }
    };
    small_thread("signals").spawn(pass_on).map_err(failed)?;
    Ok(())
}

/// A control in its process.
struct Supervised {
    child: Child,
    stream: UnixStream,
    /// Becomes readable when the control's first thread ends, which runs the ticks; `None` on kernels before
    /// Linux 6.9. The end of the connection comes later: all threads must have ended, and those without a
    /// real-time priority wait for their turn before they do.
    thread: Option<OwnedFd>,
    /// Whether it has said that it ends.
    was_to_end: bool,
}

impl Supervised {
    fn start(words: &[OsString]) -> Result<Self, String> {
        let failed = |error: io::Error| format!("the control's process can't be started: {error}");
        let (stream, theirs) = UnixStream::pair().map_err(failed)?;
        stream.set_nonblocking(true).map_err(failed)?;
        let program = Path::new("/proc/self/exe");
        let child = Command::new(program)
            .args(words)
            .arg("--supervised")
            .stdin(Stdio::from(OwnedFd::from(theirs)))
            .spawn()
            .map_err(failed)?;
        let id = i32::try_from(child.id()).ok().and_then(Pid::from_raw);
        let thread = id.and_then(|id| pidfd_open(id, OF_ONE_THREAD).ok());
        Ok(Self { child, stream, thread, was_to_end: false })
    }

    /// Waits for something to read from the control, for the end of the thread that runs its ticks, or a
    /// few milliseconds. Gives whether that thread has ended.
    fn wait(&self) -> bool {
        let timeout = Timespec { tv_sec: 0, tv_nsec: HEARTBEAT_WAIT };
        let stream = PollFd::from_borrowed_fd(self.stream.as_fd(), PollFlags::IN);
        let Some(thread) = &self.thread else {
            // Whatever came, reading tells.
            let _ = poll(&mut [stream], Some(&timeout));
            return false;
        };
        let mut both = [stream, PollFd::from_borrowed_fd(thread.as_fd(), PollFlags::IN)];
        let _ = poll(&mut both, Some(&timeout));
        let [_, thread] = &both;
        thread.revents().contains(PollFlags::IN)
    }

    /// Watches the control until it has ended. A thread of its own does so, since it gets a real-time
    /// priority, which a control that is started later must not inherit.
    fn watch(
        &mut self,
        notifier: &mut Notifier,
        image: Option<&Path>,
        journal: &Journal,
    ) -> Result<Ending, String> {
        let (last, hung, has_driven) = thread::scope(|scope| {
            let watch = || self.watch_until_safe(notifier, image, journal);
            let builder = small_thread("watch");
            let watching = builder
                .spawn_scoped(scope, watch)
                .map_err(|error| format!("no thread can be started: {error}"))?;
            watching.join().map_err(|_| "the thread that watches the control has failed".to_owned())
        })?;
        if let Some(why) = hung {
            keep_image(image.filter(|_| has_driven), journal);
            return Ok(Ending::Death(why));
        }
        let status = match self.child.wait() {
            Ok(status) => status,
            Err(error) => return Ok(Ending::Death(format!("it can't be waited for: {error}"))),
        };
        Ok(match status.code() {
            Some(code) => Ending::Exit(u8::try_from(code).unwrap_or(USAGE)),
            None => {
                keep_image(image.filter(|_| has_driven), journal);
                let ticks = last.map_or(0, |last| last.ticks);
                Ending::Death(format!("it was killed by {} after {ticks} ticks", killer(status)))
            }
        })
    }

    /// Watches the control until the thread that runs its ticks has ended, or hangs and is killed, and makes
    /// the outputs safe. Gives the last heartbeat, why it hung, and whether there is an image file in which
    /// outputs were made safe.
    fn watch_until_safe(
        &mut self,
        notifier: &mut Notifier,
        image: Option<&Path>,
        journal: &Journal,
    ) -> (Option<Heartbeat>, Option<String>, bool) {
        // This thread must run at once when the control dies: before ordinary programs and before the
        // control's scans, and without reading memory back from a disk. Where that is not permitted, the
        // control's own note says so.
        realtime_priority::raise_above_scans();
        let _ = realtime_priority::lock_memory();
        let control = self.child.id();
        let mut outputs =
            Outputs { path: image, control, is_running: false, mapped: None, journal };
        let mut now = Instant::now();
        let (mut heard, mut ticked) = (now, now);
        let mut last: Option<Heartbeat> = None;
        let mut bytes = [0; Heartbeat::SIZE];
        let mut filled = 0;
        loop {
            let has_ended = self.wait();
            let rest = bytes.get_mut(filled..).unwrap_or_default();
            let nothing = match self.stream.read(rest) {
                Ok(0) => break,
                Ok(count) => {
                    filled += count;
                    false
                }
                Err(error) if is_timeout(&error) => true,
                Err(_) => break,
            };
            now = Instant::now();
            if filled == bytes.len() {
                filled = 0;
                let Some(heartbeat) = Heartbeat::from_bytes(&bytes) else { continue };
                heard = now;
                if last.is_none_or(|l| (l.rounds, l.phase) != (heartbeat.rounds, heartbeat.phase)) {
                    ticked = now;
                }
                self.was_to_end = heartbeat.phase == Phase::Ending;
                if heartbeat.phase == Phase::Running {
                    if last.is_none_or(|last| last.phase != Phase::Running) {
                        outputs.prepare();
                    }
                    notifier.well(heartbeat.ticks, now);
                }
                last = Some(heartbeat);
            }
            if last.is_none_or(|last| last.phase != Phase::Running) {
                notifier.waiting(now);
            }
            // What it has sent before its end is read first.
            if has_ended && nothing {
                break;
            }
            if let Some(why) = hang(last, now.duration_since(heard), now.duration_since(ticked)) {
                // The outputs first: the process may take a while to die.
                outputs.make_safe();
                let _ = self.child.kill();
                let _ = self.child.wait();
                // It may have written the image once more.
                let has_driven = outputs.make_safe();
                return (last, Some(why), has_driven);
            }
        }
        // The process is gone, or is about to go. A control that has said that it ends has made its
        // outputs safe itself. One that dies at its first ticks may not yet have said that it runs.
        let is_ending = last.is_some_and(|last| last.phase == Phase::Ending);
        let has_driven = !is_ending && outputs.make_safe();
        (last, None, has_driven)
    }
}

/// Why a control is taken to hang, if it is. `last` is its last heartbeat, `silent` the time since that, and
/// `still` the time since the last one that told of a further tick.
///
/// A control sends heartbeats from before its first tick on, by a thread that does nothing else. So a silent
/// one may have run ticks since it said that it starts, and outputs may be on. One that has said that it
/// ends has made its outputs safe, and is given its time to save.
fn hang(last: Option<Heartbeat>, silent: Duration, still: Duration) -> Option<String> {
    match last {
        Some(last) if last.phase == Phase::Running && still > last.limit => Some(format!(
            "it hung: no tick has begun for {:.1} s after tick {}",
            still.as_secs_f64(),
            last.ticks.saturating_sub(1)
        )),
        Some(last) if last.phase != Phase::Ending && silent > SILENCE => {
            Some(format!("it hung: the process did nothing for {:.1} s", silent.as_secs_f64()))
        }
        Some(last) if last.phase == Phase::Running => None,
        _ if still > LONGEST_START_AND_END => Some(format!(
            "it hung: it has run no tick for {:.0} s and has not ended",
            still.as_secs_f64()
        )),
        _ => None,
    }
}

/// The signal that killed a process, by its name where it has one.
fn killer(status: ExitStatus) -> String {
    let number = status.signal().unwrap_or(0);
    match signal_hook::low_level::signal_name(number) {
        Some(name) => name.to_owned(),
        None => format!("signal {number}"),
    }
}

/// The outputs in the image file, which get their safe values when the control dies.
struct Outputs<'a> {
    path: Option<&'a Path>,
    /// The number of the control's process. A file that another one has made is left alone: another control
    /// may be using it.
    control: u32,
    /// Whether the control has said that it runs, so that it must have made the file.
    is_running: bool,
    /// The file, mapped before it is needed.
    mapped: Option<SafeOutputWriter>,
    journal: &'a Journal,
}

impl Outputs<'_> {
    /// Maps the image file, which the control has made by now.
    fn prepare(&mut self) {
        self.is_running = true;
        self.mapped = self.path.and_then(|path| SafeOutputWriter::open(path).ok());
    }

    /// Gives the outputs their safe values. Gives whether there is a file of this control.
    fn make_safe(&self) -> bool {
        let Some(path) = self.path else { return false };
        let (mut result, mut was_mapped) = (Ok(()), false);
        if let Some(mapped) = self.mapped.as_ref().filter(|file| file.is_in_use_by(self.control)) {
            (result, was_mapped) = (mapped.write(), true);
            if mapped.is_at(path) {
                self.note(path, result);
                return true;
            }
        }
        // It could not be mapped before, or an online change has put another file in its place.
        let opened = SafeOutputWriter::open(path);
        let is_ours = opened.as_ref().is_ok_and(|file| file.is_in_use_by(self.control));
        let rest = opened.and_then(|file| if is_ours { file.write() } else { Ok(()) });
        self.note(path, result.and(rest));
        was_mapped || is_ours
    }

    fn note(&self, path: &Path, result: io::Result<()>) {
        if let Err(error) = result
            && self.is_running
            && error.kind() != ErrorKind::NotFound
        {
            self.journal.error(format!(
                "the outputs in the image file {} can't be made safe: {error}",
                path.display()
            ));
        }
    }
}

/// Keeps a copy of the image file for the post-mortem, `PATH.dead`.
fn keep_image(image: Option<&Path>, journal: &Journal) {
    let Some(path) = image else { return };
    let mut copy = path.as_os_str().to_owned();
    copy.push(".dead");
    if let Err(error) = fs::copy(path, PathBuf::from(copy)) {
        let path = path.display();
        journal.error(format!("no copy of the image file {path} can be kept: {error}"));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_control_hangs_that_is_silent_or_runs_no_tick() {
        let seconds = Duration::from_secs;
        let limit = seconds(2);
        let said = |phase| Some(Heartbeat { phase, ticks: 7, rounds: 7, limit });
        let [starting, running, ending] =
            [Phase::Starting, Phase::Running, Phase::Ending].map(said);
        for (last, silent, still, hangs) in [
            // It has yet to say anything, and may take its time.
            (None, 59, 59, None),
            (None, 61, 61, Some("no tick for 61 s")),
            (starting, 2, 50, None),
            (starting, 2, 61, Some("no tick for 61 s")),
            // It may run ticks by now.
            (starting, 4, 4, Some("did nothing for 4.0 s")),
            (running, 0, 1, None),
            (running, 0, 3, Some("after tick 6")),
            (running, 4, 1, Some("did nothing for 4.0 s")),
            // Its outputs are safe.
            (ending, 59, 59, None),
            (ending, 61, 61, Some("has not ended")),
        ] {
            let why = hang(last, seconds(silent), seconds(still));
            let right = match (&why, hangs) {
                (Some(why), Some(part)) => why.contains(part),
                (why, hangs) => why.is_none() && hangs.is_none(),
            };
            assert!(right, "{last:?}, silent for {silent} s, still for {still} s: {why:?}");
        }
    }
}
