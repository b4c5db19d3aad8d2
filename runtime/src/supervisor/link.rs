//! The end of a control that has a supervisor.

use std::io::{self, ErrorKind, Read, Write};
use std::os::fd::AsFd;
use std::os::unix::net::UnixStream;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use super::{Heartbeat, Phase};
use crate::journal::Journal;

/// Time between two heartbeats.
const INTERVAL: Duration = Duration::from_millis(5);
/// A control is taken to hang when it has begun no tick for this many periods…
const PERIODS: u32 = 10;
/// …and at least for this time: a computer that is busy is no control that hangs.
const SHORTEST_LIMIT: Duration = Duration::from_secs(2);

/// The connection to the supervisor. A thread sends heartbeats, and ends the run when the supervisor has
/// died.
#[derive(Debug)]
pub(crate) struct Link {
    sender: Arc<Sender>,
}

/// What sends heartbeats. Two threads do.
#[derive(Debug)]
struct Sender {
    /// The connection, and whether no more ticks are run. A lock holds them together, so that no earlier
    /// heartbeat follows the one that says so.
    state: Mutex<(UnixStream, bool)>,
    limit: Duration,
    journal: Journal,
}

impl Sender {
    /// Sends a heartbeat, where `ending` says so the one that the run ends, and gives whether the run
    /// ends.
    ///
    /// # Errors
    /// When the supervisor has died.
    fn send(&self, ending: bool) -> io::Result<bool> {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let (stream, ended) = &mut *state;
        *ended |= ending;
        let (ticks, rounds, limit) = (self.journal.ticks(), self.journal.rounds(), self.limit);
        let phase = match (*ended, ticks) {
            (true, _) => Phase::Ending,
            (false, 0) => Phase::Starting,
            (false, _) => Phase::Running,
        };
        stream.write_all(&Heartbeat { phase, ticks, rounds, limit }.to_bytes())?;
        Ok(*ended)
    }
}

impl Link {
    /// Takes the connection that the supervisor has given this process as standard input. Ticks follow
    /// each other after the time `period`. When the supervisor dies, `interrupt` is set.
    ///
    /// # Errors
    /// When there is no such connection, or no thread can be started.
    pub(crate) fn start(
        period: Duration,
        interrupt: &Arc<AtomicBool>,
        journal: &Journal,
    ) -> io::Result<Self> {
        rustix::process::set_parent_process_death_signal(Some(rustix::process::Signal::TERM))?;
        let stream = UnixStream::from(io::stdin().as_fd().try_clone_to_owned()?);
        stream.set_nonblocking(false)?;
        stream.set_read_timeout(Some(INTERVAL))?;
        let reader = stream.try_clone()?;
        let limit = period.saturating_mul(PERIODS).max(SHORTEST_LIMIT);
        let state = Mutex::new((stream, false));
        let sender = Arc::new(Sender { state, limit, journal: journal.clone() });
        let (sending, interrupt) = (Arc::clone(&sender), Arc::clone(interrupt));
        let run = move || run(reader, &sending, &interrupt);
        thread::Builder::new().name("supervisor".into()).spawn(run)?;
        Ok(Self { sender })
    }

    /// Tells the supervisor that no more ticks are run.
    pub(crate) fn ending(&self) {
        // A supervisor that has died is noticed by the thread.
        let _ = self.sender.send(true);
    }
}

fn run(mut reader: UnixStream, sender: &Sender, interrupt: &AtomicBool) {
    loop {
        let sent = sender.send(false);
        // The supervisor sends nothing: what is read is the end of the connection, or the time that it was
        // waited for has passed.
        let gone = match reader.read(&mut [0]) {
            Ok(count) => count == 0,
            Err(error) => !is_timeout(&error),
        };
        if gone || sent.is_err() {
            interrupt.store(true, Ordering::Relaxed);
            if !sent.unwrap_or(false) {
                let text = "the supervisor has died; the control ends with its outputs safe";
                sender.journal.error(text);
            }
            return;
        }
    }
}

/// Whether reading has given up because nothing came.
pub(super) fn is_timeout(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted)
}
