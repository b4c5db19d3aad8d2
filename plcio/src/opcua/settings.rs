//! What the table `[plcio]` says of OPC UA.

use std::path::PathBuf;

/// The settings of the server.
#[derive(Clone, Debug)]
pub(crate) struct Settings {
    /// Where it listens: host and port. Without it there is no server.
    pub(crate) address: Option<String>,
    /// The folder of its certificate and of those that it trusts.
    pub(crate) certificates: PathBuf,
    /// The file with users and passwords.
    pub(crate) users: Option<PathBuf>,
    /// Whether everybody may read, without a password.
    pub(crate) anonymous: bool,
}
