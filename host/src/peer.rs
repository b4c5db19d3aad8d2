//! Who acts on a control from outside.

use std::fmt;

use serde::Serialize;

/// A process that is connected to the control's socket.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Peer {
    /// The user's name, or the number as text where there is none.
    pub user: String,
    /// The user's number.
    pub uid: u32,
    /// The number of the process that connected.
    pub pid: u32,
    /// The command that it runs.
    pub command: String,
}

impl fmt::Display for Peer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "user {} with {} (process {})", self.user, self.command, self.pid)
    }
}
