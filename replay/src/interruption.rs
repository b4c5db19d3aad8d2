//! Ends a long movement (going to a distant tick, or looking for the last writer of a variable) when the
//! client does not want it any more. The thread that reads the client's messages counts each `pause`,
//! `disconnect` and `terminate`, and the end of the stream, as soon as it comes; the movement looks at
//! the count before each tick.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::DebugError;

/// The number of messages that end what is being done and are not answered yet. All clones share one number.
#[derive(Clone, Debug, Default)]
pub struct Interruption(Arc<AtomicUsize>);

impl Interruption {
    /// Counts such a message, which has come.
    pub fn begin(&self) {
        self.0.fetch_add(1, Ordering::Relaxed);
    }

    /// Takes one from the count: the message is being answered.
    pub fn end(&self) {
        // There is one end for each beginning.
        self.0.fetch_sub(1, Ordering::Relaxed);
    }

    /// Whether such a message waits for its answer.
    pub fn is_wanted(&self) -> bool {
        self.0.load(Ordering::Relaxed) > 0
    }

    /// An error if such a message waits for its answer. A movement that gets it ends with it.
    pub fn check(&self) -> Result<(), DebugError> {
        match self.is_wanted() {
            true => Err(DebugError::new("it was interrupted")),
            false => Ok(()),
        }
    }
}
