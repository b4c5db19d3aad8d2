//! Waits for signals that the process receives, and says which of them it does not take.
//!
//! A handler marks each signal as received and writes a byte to a socket, which wakes the thread that waits. If the
//! system refuses to write or to read this byte, the thread finds the signal when it looks next, at most half a
//! second later. (`signal_hook`'s own iterators panic when the byte can't be read.)

use std::ffi::c_int;
use std::fs;
use std::io::{self, ErrorKind, Read};
use std::os::unix::net::UnixStream;
use std::thread;
use std::time::Duration;

#[cfg(target_os = "linux")]
use nix::sys::signal::{SigSet, Signal};
use signal_hook::iterator::backend::{Handle, Pending, SignalDelivery};
use signal_hook::iterator::exfiltrator::SignalOnly;

/// How often signals are looked for when nothing wakes the thread.
const LOOK_INTERVAL: Duration = Duration::from_millis(500);
/// The pause after a wait that has failed, so that a failure that lasts does not keep a processor busy.
const FAILURE_PAUSE: Duration = Duration::from_millis(10);

/// The signals that a process receives, as an iterator that waits for the next one. It ends when its
/// [handle](Self::handle) is closed.
#[derive(Debug)]
pub(crate) struct SignalListener {
    delivery: SignalDelivery<UnixStream, SignalOnly>,
    /// Those that have come and were not given yet.
    pending: Pending<SignalOnly>,
}

impl SignalListener {
    /// Has these signals noted from now on, instead of what they would do otherwise.
    ///
    /// # Errors
    /// When the operating system refuses it.
    pub(crate) fn new(signals: Vec<c_int>) -> io::Result<Self> {
        let (read, write) = UnixStream::pair()?;
        read.set_read_timeout(Some(LOOK_INTERVAL))?;
        let mut delivery = SignalDelivery::with_pipe(read, write, SignalOnly, signals)?;
        let pending = delivery.pending();
        Ok(Self { delivery, pending })
    }

    /// By which another thread ends the iterator.
    pub(crate) fn handle(&self) -> Handle {
        self.delivery.handle()
    }

    /// Waits until the handler or the handle wakes this thread, or until it is time to look.
    fn wait(&mut self) {
        match self.delivery.get_read_mut().read(&mut [0]) {
            Ok(1..) => {}
            Err(error)
                if matches!(
                    error.kind(),
                    ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted
                ) => {}
            Ok(0) | Err(_) => thread::sleep(FAILURE_PAUSE),
        }
    }
}

impl Iterator for SignalListener {
    type Item = c_int;

    fn next(&mut self) -> Option<c_int> {
        loop {
            if let Some(signal) = self.pending.next() {
                return Some(signal);
            }
            // This empties the socket. What comes after it leaves a byte there for the wait.
            self.pending = self.delivery.pending();
            if let Some(signal) = self.pending.next() {
                return Some(signal);
            }
            if self.delivery.handle().is_closed() {
                return None;
            }
            self.wait();
        }
    }
}

/// Has no terminal suspend this thread, and the threads that it starts from now on: neither by Ctrl-Z nor
/// when they write to a terminal in whose background the process runs.
///
/// # Errors
/// When the operating system refuses it.
#[cfg(target_os = "linux")]
pub(crate) fn refuse_suspension() -> Result<(), String> {
    let refused = SigSet::from_iter([Signal::SIGTSTP, Signal::SIGTTOU, Signal::SIGTTIN]);
    refused.thread_block().map_err(|error| format!("Ctrl-Z can't be refused: {error}"))
}

/// Other systems suspend a run as any other process.
#[cfg(not(target_os = "linux"))]
pub(crate) fn refuse_suspension() -> Result<(), String> {
    Ok(())
}

/// Has this thread take Ctrl-Z, for which it has a handler.
pub(crate) fn take_suspension() {
    // Where that fails, nobody is told that Ctrl-Z is refused.
    #[cfg(target_os = "linux")]
    let _ = SigSet::from(Signal::SIGTSTP).thread_unblock();
}

/// Whether the process was started to survive its terminal (`nohup plcc run …`). Where the system
/// does not say, it is taken to be so.
pub(crate) fn ignores_hangup() -> bool {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_none_or(|mask| mask & 1 != 0)
}

#[cfg(test)]
mod tests {
    use std::net::Shutdown;
    use std::sync::mpsc;

    use signal_hook::consts::{SIGUSR1, SIGUSR2};
    use signal_hook::low_level::raise;

    use super::*;

    #[test]
    fn signals_come_until_the_handle_is_closed() {
        let mut signals = SignalListener::new(vec![SIGUSR1]).unwrap();
        raise(SIGUSR1).unwrap();
        assert_eq!(signals.next(), Some(SIGUSR1));
        let handle = signals.handle();
        let waiting = thread::spawn(move || signals.next());
        handle.close();
        assert_eq!(waiting.join().unwrap(), None);
    }

    /// Neither end of the socket does anything any more: bytes can't be written, and there are none to be read.
    #[test]
    fn signals_come_although_nothing_wakes_the_thread() {
        let mut signals = SignalListener::new(vec![SIGUSR2]).unwrap();
        signals.delivery.get_read_mut().shutdown(Shutdown::Both).unwrap();
        let handle = signals.handle();
        let (sender, received) = mpsc::channel();
        let waiting =
            thread::spawn(move || signals.for_each(|signal| sender.send(signal).unwrap()));
        raise(SIGUSR2).unwrap();
        assert_eq!(received.recv(), Ok(SIGUSR2));
        handle.close();
        waiting.join().unwrap();
        assert!(received.recv().is_err(), "there was one signal");
    }
}
