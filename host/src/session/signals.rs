//! Signals that end a run: Ctrl-C (SIGINT), SIGTERM, SIGQUIT, a power supply that fails (SIGPWR) and
//! the end of the terminal (SIGHUP).
//!
//! The first one ends the run before its next tick; then everything is saved. Signals in the second
//! after it are the same request once more: `timeout` sends SIGTERM twice, and a terminal that closes
//! may send SIGHUP twice. A later one waits until everything is saved, but at most five seconds, and
//! ends the process.
//!
//! In real time a terminal can't suspend a run, neither by Ctrl-Z (SIGTSTP) nor because the run writes to
//! the terminal from the background (SIGTTOU, where `stty tostop` is set): the outputs would stay as they
//! are, and no program would control them.

use std::process;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use signal_hook::consts;
use signal_hook::iterator::Handle;

use super::{INTERRUPTED, SessionError, message};
use crate::journal::Journal;
use crate::signal_listener::{SignalListener, ignores_hangup, take_suspension};
use plcc_runtime::small_thread::small_thread;

/// Signals within this time from the first one are that one.
const SAME_WISH: Duration = Duration::from_secs(1);
/// How long a later signal waits until everything is saved.
const SAVING_TIME: Duration = Duration::from_secs(5);
/// How long the message waits that not everything was saved.
const TELLING_TIME: Duration = Duration::from_millis(200);

/// What a user is told who wants to suspend a control.
const SUSPENSION_REFUSED: &str = "Ctrl-Z (SIGTSTP) is refused: the outputs of a suspended control would stay \
                                  as they are, and no program would control them; Ctrl-C ends the run with \
                                  safe outputs";

/// A thread that waits for signals, until this value is dropped. Then everything is saved.
pub(super) struct EndSignals {
    handle: Handle,
    thread: Option<JoinHandle<()>>,
}

impl EndSignals {
    /// Has the first signal set the flag. A limit on the size of files (SIGXFSZ) ends nothing from now
    /// on; writing gives an error instead. With `refusals` Ctrl-Z does nothing but to write a warning into
    /// that journal.
    ///
    /// # Errors
    /// When the operating system refuses it.
    pub(super) fn set(
        flag: &Arc<AtomicBool>,
        refusals: Option<&Journal>,
    ) -> Result<Self, SessionError> {
        let failed = |error| {
            SessionError(format!("can't install the handlers of SIGINT and SIGTERM: {error}"))
        };
        let mut wanted = vec![consts::SIGINT, consts::SIGTERM, consts::SIGQUIT];
        #[cfg(target_os = "linux")]
        wanted.push(rustix::process::Signal::POWER.as_raw());
        if !ignores_hangup() {
            wanted.push(consts::SIGHUP);
        }
        if refusals.is_some() {
            wanted.push(consts::SIGTSTP);
        }
        signal_hook::flag::register(consts::SIGXFSZ, Arc::default()).map_err(failed)?;
        let signals = SignalListener::new(wanted).map_err(failed)?;
        let handle = signals.handle();
        let flag = Arc::clone(flag);
        let refusals = refusals.cloned();
        let wait = move || wait(signals, &flag, refusals.as_ref());
        let thread = small_thread("signals").spawn(wait).map_err(failed)?;
        Ok(Self { handle, thread: Some(thread) })
    }
}

impl Drop for EndSignals {
    fn drop(&mut self) {
        self.handle.close();
        if let Some(thread) = self.thread.take() {
            // It has not panicked, and if it had, the run would be over all the same.
            let _ = thread.join();
        }
    }
}

/// Waits for signals until the handle is closed.
fn wait(mut signals: SignalListener, flag: &AtomicBool, refusals: Option<&Journal>) {
    if refusals.is_some() {
        take_suspension();
    }
    let mut first = None;
    let mut refused: Option<Instant> = None;
    for signal in &mut signals {
        let now = Instant::now();
        if signal == consts::SIGTSTP {
            // Whoever holds the keys down is told once a second.
            let again = refused.is_none_or(|last| now.duration_since(last) > SAME_WISH);
            if let Some(journal) = refusals.filter(|_| again) {
                refused = Some(now);
                journal.warn(SUSPENSION_REFUSED);
            }
            continue;
        }
        let since = now.saturating_duration_since(*first.get_or_insert(now));
        flag.store(true, Ordering::Relaxed);
        if since > SAME_WISH {
            break;
        }
    }
    // Somebody insists, or the run is over.
    let handle = signals.handle();
    let start = Instant::now();
    while !handle.is_closed() {
        if start.elapsed() > SAVING_TIME {
            let seconds = SAVING_TIME.as_secs();
            let text = format!("not everything could be saved within {seconds} s");
            // Standard error may be what takes nothing, and is not waited for.
            let told = thread::spawn(move || message("error", text));
            let start = Instant::now();
            while !told.is_finished() && start.elapsed() < TELLING_TIME {
                thread::sleep(Duration::from_millis(5));
            }
            process::exit(INTERRUPTED.into());
        }
        thread::sleep(Duration::from_millis(5));
    }
}
