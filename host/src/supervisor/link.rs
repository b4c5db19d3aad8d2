//! The end of a control that has a supervisor.

use std::io::{self, ErrorKind, Read, Write};
use std::os::fd::AsFd;
use std::os::unix::net::UnixStream;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use super::{Heartbeat, Phase};
use crate::journal::Journal;
use crate::realtime_priority;
use plcc_runtime::small_thread::small_thread;

/// Time between two heartbeats.
const INTERVAL: Duration = Duration::from_millis(5);
/// After how many periods without a tick a control is taken to hang.
const PERIODS: u32 = 10;
/// After how much time in which the supervisor takes no heartbeat it is taken to have died: it hangs, or
/// somebody has suspended it (SIGSTOP).
const SUPERVISOR_SILENCE: Duration = Duration::from_secs(3);
/// The shortest time without a tick after which a control is taken to hang, however short its period is:
/// the computer may be busy for a while.
const SHORTEST_LIMIT: Duration = Duration::from_secs(2);

/// The connection to the supervisor. A thread sends heartbeats, and ends the run when the supervisor has
/// died or takes none.
#[derive(Debug)]
pub(crate) struct Link {
    sender: Arc<Sender>,
}

/// Sends heartbeats, for two threads.
#[derive(Debug)]
struct Sender {
    connection: Mutex<Connection>,
    limit: Duration,
    journal: Journal,
}

/// The connection, with what was last said by it. One lock holds both, so that no heartbeat of a control
/// that runs can follow the one that says that the run ends.
#[derive(Debug)]
struct Connection {
    stream: UnixStream,
    /// Whether the run ends: no more ticks are run.
    ending: bool,
    /// Whether the supervisor has died or takes no heartbeats.
    lost: bool,
}

impl Sender {
    /// Sends a heartbeat. `ending` says that the run ends from now on.
    ///
    /// # Errors
    /// When the supervisor has died, or has taken no heartbeat for a long time.
    fn send(&self, ending: bool) -> io::Result<()> {
        let mut connection = self.connection.lock().unwrap_or_else(PoisonError::into_inner);
        connection.ending |= ending;
        let ending = connection.ending;
        let (ticks, rounds, limit) = (self.journal.ticks(), self.journal.rounds(), self.limit);
        let phase = match (ending, ticks) {
            (true, _) => Phase::Ending,
            (false, 0) => Phase::Starting,
            (false, _) => Phase::Running,
        };
        let heartbeat = Heartbeat { phase, ticks, rounds, limit };
        if connection.lost {
            // Nobody waits for such a supervisor again.
            return Err(ErrorKind::TimedOut.into());
        }
        if let Err(error) = connection.stream.write_all(&heartbeat.to_bytes()) {
            let what = if is_timeout(&error) { "takes no heartbeats" } else { "has died" };
            self.lose(&mut connection, what);
            return Err(error);
        }
        Ok(())
    }

    /// Says in the journal that the supervisor is lost, once. Whoever notices it first says it: at the
    /// supervisor's death the operating system also sends this process a signal, and the run may be over
    /// before the thread that sends the heartbeats is on a processor again.
    fn lose(&self, connection: &mut Connection, what: &str) {
        if !connection.lost {
            connection.lost = true;
            let text = format!("the supervisor {what}; the control ends with its outputs safe");
            self.journal.error(text);
        }
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
        // Room for few heartbeats (the operating system gives its least), so that a supervisor that takes
        // none is noticed soon.
        rustix::net::sockopt::set_socket_send_buffer_size(&stream, Heartbeat::SIZE)?;
        stream.set_write_timeout(Some(SUPERVISOR_SILENCE))?;
        let reader = stream.try_clone()?;
        let limit = period.saturating_mul(PERIODS).max(SHORTEST_LIMIT);
        let connection = Mutex::new(Connection { stream, ending: false, lost: false });
        let sender = Arc::new(Sender { connection, limit, journal: journal.clone() });
        // Sent before any tick, so that the supervisor knows from then on when this process stands still.
        sender.send(false)?;
        let (sending, interrupt) = (Arc::clone(&sender), Arc::clone(interrupt));
        let run = move || run(reader, &sending, &interrupt);
        small_thread("supervisor").spawn(run)?;
        Ok(Self { sender })
    }

    /// Tells the supervisor that no more ticks are run.
    pub(crate) fn ending(&self) {
        // That the supervisor has died is in the journal then.
        let _ = self.sender.send(true);
    }
}

fn run(mut reader: UnixStream, sender: &Sender, interrupt: &AtomicBool) {
    // It must notice the supervisor's death however busy the computer is, and has little to do.
    realtime_priority::raise_above_scans();
    loop {
        let sent = sender.send(false);
        // The supervisor sends nothing: what is read is the end of the connection, or the time that it was
        // waited for has passed.
        let gone = match reader.read(&mut [0]) {
            Ok(count) => count == 0,
            Err(error) => !is_timeout(&error),
        };
        if gone {
            let mut connection = sender.connection.lock().unwrap_or_else(PoisonError::into_inner);
            sender.lose(&mut connection, "has died");
        }
        if gone || sent.is_err() {
            interrupt.store(true, Ordering::Relaxed);
            return;
        }
    }
}

/// Whether reading has given up because nothing came.
pub(super) fn is_timeout(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted)
}
