//! Why an artifact is refused.

use std::path::{Path, PathBuf};

use plcc_abi::ABI_VERSION;
use thiserror::Error;

use plcc_files::why_not_read;

/// Why an artifact is refused. Nothing of a refused one is executed.
#[derive(Debug, Error)]
pub enum ArtifactError {
    /// The file can't be read.
    #[error("{} can't be read: {}", path.display(), why_not_read(source))]
    Read {
        /// The file.
        path: PathBuf,
        /// Why not.
        source: std::io::Error,
    },
    /// The file does not begin with the bytes by which artifacts are known.
    #[error("this is not an artifact of plcc; `plcc build` makes one from a source")]
    NotAnArtifact,
    /// The file ends too early.
    #[error("the artifact is truncated: {found} bytes of {expected}; copy or build it again")]
    Truncated {
        /// Its length in bytes.
        found: u64,
        /// The length it should have.
        expected: u64,
    },
    /// A checksum is wrong.
    #[error("the artifact is corrupt: {what}; copy or build it again")]
    Corrupt {
        /// What was found.
        what: &'static str,
    },
    /// It was made by an older compiler.
    #[error(
        "the artifact is older than this loader: its format is {version}, the loader's \
         {ABI_VERSION}; build it again with the compiler of this version"
    )]
    Older {
        /// The artifact's [`ABI_VERSION`].
        version: u32,
    },
    /// It was made by a newer compiler.
    #[error(
        "the artifact is newer than this loader: its format is {version}, the loader's \
         {ABI_VERSION}; update the loader, or build with the compiler of this version"
    )]
    Newer {
        /// The artifact's [`ABI_VERSION`].
        version: u32,
    },
    /// It is for another kind of machine.
    #[error(
        "the artifact is foreign: it is for {artifact}, this machine is {machine}; build it with \
         `--target` for this machine"
    )]
    Architecture {
        /// The artifact's architecture.
        artifact: String,
        /// This machine's.
        machine: &'static str,
    },
    /// The processor lacks something that the code uses.
    #[error("the artifact is for a newer processor: this one lacks {}", missing.join(", "))]
    Features {
        /// What is missing.
        missing: Vec<String>,
    },
    /// Something is larger than what is accepted.
    #[error("the {what} is too large: {size} bytes; {limit} are allowed")]
    TooLarge {
        /// What.
        what: &'static str,
        /// Its size in bytes.
        size: u64,
        /// The largest allowed.
        limit: u64,
    },
    /// A key was given, and the artifact is not signed.
    #[error("the artifact is not signed, and only signed ones are taken (--key)")]
    NotSigned,
    /// A key was given, and the artifact is signed with another one.
    #[error("the artifact is signed with another key than the one that --key names")]
    OtherKey,
    /// The signature is not that of these bytes.
    #[error("the artifact's signature is wrong: its bytes are not those that were signed")]
    WrongSignature,
    /// Its tables contradict each other.
    #[error("the artifact is inconsistent: {what}; build it again")]
    Inconsistent {
        /// What does not fit.
        what: String,
    },
}

impl ArtifactError {
    /// The error as a message for people that begins with the artifact's path.
    pub fn with_path(&self, path: &Path) -> String {
        match self {
            // It has the path.
            Self::Read { .. } => self.to_string(),
            _ => format!("{}: {self}", path.display()),
        }
    }
}

/// Something that does not fit.
pub(super) fn inconsistent(what: impl Into<String>) -> ArtifactError {
    ArtifactError::Inconsistent { what: what.into() }
}
