//! Tells a long movement that its client does not want it any more: going to a far tick, or looking for
//! the last writer of a variable. The thread that reads the client's messages notes each `pause`,
//! `disconnect` and `terminate`, and the end of the stream, as soon as it comes; the movement looks at
//! that before each tick.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::DebugError;

/// How many messages wait that end what is being done. Clones are the same number.
#[derive(Clone, Debug, Default)]
pub struct Interruption(Arc<AtomicUsize>);

impl Interruption {
    /// Such a message has come.
    pub(crate) fn begin(&self) {
        self.0.fetch_add(1, Ordering::Relaxed);
    }

    /// It is being answered.
    pub(crate) fn end(&self) {
        // There is one end for each beginning.
        self.0.fetch_sub(1, Ordering::Relaxed);
    }

    /// Whether one waits.
    pub(crate) fn is_wanted(&self) -> bool {
        self.0.load(Ordering::Relaxed) > 0
    }

    /// Ends a movement with an error where one waits.
    pub(crate) fn check(&self) -> Result<(), DebugError> {
        match self.is_wanted() {
            true => Err(DebugError::new("it was interrupted")),
            false => Ok(()),
        }
    }
}
