//! Writes the retained file while a control runs in real time, since the power may fail at any time.
//! A thread of its own writes, so that no tick waits for the disk.

use std::path::Path;
use std::sync::mpsc::{SyncSender, sync_channel};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use plcc_abi::Dialect;

use crate::run::{AfterTick, Hook};
use crate::{Executive, retain};

use super::SessionError;

/// Time from one write to the next, at least.
const WRITE_INTERVAL: Duration = Duration::from_secs(1);

/// Keeps the retained file up to date while a control runs.
pub(super) struct RetainedWriter {
    next: Instant,
    last: Vec<u8>,
    to_disk: SyncSender<Vec<u8>>,
    writer: JoinHandle<Result<(), SessionError>>,
}

impl RetainedWriter {
    /// Starts the thread that writes.
    pub(super) fn new(path: &Path, dialect: Dialect) -> Result<Self, SessionError> {
        let path = path.to_owned();
        let (to_disk, payloads) = sync_channel::<Vec<u8>>(1);
        let write = move || {
            for payload in payloads {
                let stored = retain::store(&path, dialect, payload);
                stored.map_err(|error| SessionError(error.to_string()))?;
            }
            Ok(())
        };
        let writer = thread::Builder::new().name("retain".into()).spawn(write);
        let writer = writer.map_err(|error| {
            SessionError(format!("no thread for the retained file can be started: {error}"))
        })?;
        Ok(Self { next: Instant::now() + WRITE_INTERVAL, last: vec![], to_disk, writer })
    }

    /// Hands the retained data to the thread that writes, if it has changed and the last write is long
    /// enough ago. While that thread is busy nothing happens; the call after the next interval tries
    /// again.
    fn write_if_changed(&mut self, executive: &dyn Executive) {
        let now = Instant::now();
        if now < self.next {
            return;
        }
        self.next = now + WRITE_INTERVAL;
        if let Some(payload) = executive.retained().filter(|payload| *payload != self.last)
            && self.to_disk.try_send(payload.clone()).is_ok()
        {
            self.last = payload;
        }
    }

    /// Waits until everything that was handed over is written.
    ///
    /// # Errors
    /// When it could not be written.
    pub(super) fn finish(self) -> Result<(), SessionError> {
        drop(self.to_disk);
        let died = |_| Err(SessionError("the retained file could not be written".into()));
        self.writer.join().unwrap_or_else(died)
    }
}

impl Hook for RetainedWriter {
    fn after_tick(&mut self, now: &mut AfterTick<'_>) {
        self.write_if_changed(now.executive);
    }
}
