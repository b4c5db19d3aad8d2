//! Writes the retained file while a control runs by the clock, since the power may fail at any
//! time. The scan never waits for the disk: another thread writes.

use std::path::Path;
use std::sync::mpsc::{SyncSender, sync_channel};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use plcc_abi::Dialect;

use crate::{Executive, retain};

use super::SessionError;

/// Time between two looks at what is retained.
const PAUSE: Duration = Duration::from_secs(1);

/// Keeps the retained file up to date.
pub(super) struct Keeper {
    next: Instant,
    last: Vec<u8>,
    to_disk: SyncSender<Vec<u8>>,
    writer: JoinHandle<Result<(), SessionError>>,
}

impl Keeper {
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
        Ok(Self { next: Instant::now() + PAUSE, last: vec![], to_disk, writer })
    }

    /// Hands on what is retained, when it has changed and it is time to look. While the disk is
    /// busy, the next look does it.
    pub(super) fn look(&mut self, executive: &dyn Executive) {
        let now = Instant::now();
        if now < self.next {
            return;
        }
        self.next = now + PAUSE;
        if let Some(payload) = executive.retained().filter(|payload| *payload != self.last)
            && self.to_disk.try_send(payload.clone()).is_ok()
        {
            self.last = payload;
        }
    }

    /// Waits until all is written.
    pub(super) fn finish(self) -> Result<(), SessionError> {
        drop(self.to_disk);
        let died = |_| Err(SessionError("the retained file could not be written".into()));
        self.writer.join().unwrap_or_else(died)
    }
}
