//! Signals that end a run: Ctrl-C (SIGINT), SIGTERM, SIGQUIT, a power supply that fails (SIGPWR) and
//! the end of the terminal (SIGHUP).
//!
//! The first one ends the run before its next tick; then everything is saved. Signals in the second
//! after it are the same wish once more: `timeout` sends SIGTERM twice, and a terminal that closes
//! may send SIGHUP twice. A later one waits until everything is saved, but at most five seconds, and
//! ends the process.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};
use std::{fs, process};

use signal_hook::consts;
use signal_hook::iterator::{Handle, Signals};

use super::{INTERRUPTED, SessionError, message};

/// Signals within this time from the first one are that one.
const SAME_WISH: Duration = Duration::from_secs(1);
/// How long a later signal waits until everything is saved.
const SAVING_TIME: Duration = Duration::from_secs(5);
/// How long the message waits that not everything was saved.
const TELLING_TIME: Duration = Duration::from_millis(200);

/// A thread that waits for signals, until this value is dropped. Then everything is saved.
pub(super) struct EndSignals {
    handle: Handle,
    thread: Option<JoinHandle<()>>,
}

impl EndSignals {
    /// Has the first signal set the flag. A limit on the size of files (SIGXFSZ) ends nothing from now
    /// on; writing gives an error instead.
    ///
    /// # Errors
    /// When the operating system refuses it.
    pub(super) fn set(flag: &Arc<AtomicBool>) -> Result<Self, SessionError> {
        let failed = |error| SessionError(format!("Ctrl-C can't be listened for: {error}"));
        let mut wanted = vec![consts::SIGINT, consts::SIGTERM, consts::SIGQUIT];
        #[cfg(target_os = "linux")]
        wanted.push(rustix::process::Signal::POWER.as_raw());
        if !ignores_hangup() {
            wanted.push(consts::SIGHUP);
        }
        signal_hook::flag::register(consts::SIGXFSZ, Arc::default()).map_err(failed)?;
        let signals = Signals::new(wanted).map_err(failed)?;
        let handle = signals.handle();
        let flag = Arc::clone(flag);
        let wait = move || wait(signals, &flag);
        let thread = thread::Builder::new().name("signals".into()).spawn(wait).map_err(failed)?;
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
fn wait(mut signals: Signals, flag: &AtomicBool) {
    let mut first = None;
    for _ in signals.forever() {
        let now = Instant::now();
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

/// Whether the process was started to survive its terminal (`nohup plcc run …`). Where the system
/// does not say, it is taken to be so.
pub(crate) fn ignores_hangup() -> bool {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_none_or(|mask| mask & 1 != 0)
}
