//! Processes that end with their test, and waiting for what they do.

use std::path::PathBuf;
use std::process::{Child, Command};
use std::thread;
use std::time::{Duration, Instant};

/// How long a state is waited for that must come. It is not a measure of anything: it ends a test that hangs.
pub(crate) const PATIENCE: Duration = Duration::from_secs(600);

/// Waits until something is there; `what` says what is missing if it does not come.
#[track_caller]
pub(crate) fn wait<T>(what: &str, mut look: impl FnMut() -> Option<T>) -> T {
    let begun = Instant::now();
    loop {
        if let Some(found) = look() {
            return found;
        }
        assert!(begun.elapsed() < PATIENCE, "{what} did not come");
        thread::sleep(Duration::from_millis(20));
    }
}

/// A process that is killed with the test.
pub(crate) struct Killed(pub(crate) Child);

impl Killed {
    /// Starts a process.
    pub(crate) fn spawn(command: &mut Command) -> Self {
        Self(command.spawn().unwrap())
    }

    /// Whether it still runs.
    pub(crate) fn is_running(&mut self) -> bool {
        self.0.try_wait().unwrap().is_none()
    }

    /// Ends it as a service manager does, and waits for it. It has to end by itself then.
    #[cfg(target_os = "linux")]
    pub(crate) fn end(&mut self) {
        use rustix::process::{Pid, Signal, kill_process};
        kill_process(Pid::from_child(&self.0), Signal::TERM).unwrap();
        assert!(self.0.wait().unwrap().code().is_some());
    }
}

impl Drop for Killed {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// `plcrt`, built from the sources under test.
pub(crate) fn plcrt() -> PathBuf {
    super::programs().join("plcrt")
}
