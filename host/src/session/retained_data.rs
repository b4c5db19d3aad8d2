//! The retained data of a run: taken back at its start, written at its end.

use std::path::Path;

use plcc_abi::Dialect;
use plcc_protocol::Retained;

use crate::args::RunArgs;
use crate::journal::{EntryKind, Journal};
use crate::retain::{RetainError, RetainedFile};
use crate::socket::RetainedStatus;
use plcc_runtime::Executive;

use super::SessionError;
use super::predecessor::Predecessor;
use super::retained_writer::{BufferSize, RetainedTrouble, RetainedWriter};

impl From<RetainError> for SessionError {
    fn from(error: RetainError) -> Self {
        Self(error.to_string())
    }
}

/// How a run keeps its retained data.
pub(super) enum RetainedData {
    /// It has no retained file.
    None,
    /// The file is written at the end.
    AtEnd(RetainedFile),
    /// A thread writes the file while the run lasts, and at its end.
    Continually(RetainedWriter),
}

impl RetainedData {
    /// Locks the retained file that the options name, if they do, and gives the control what it holds.
    /// In real time a thread is started that writes it.
    ///
    /// # Errors
    /// When the file can't be used, or does not exist though the options say that it must.
    pub(super) fn start(
        args: &RunArgs,
        dialect: Dialect,
        executive: &mut dyn Executive,
        predecessor: &Predecessor<'_>,
        journal: &Journal,
    ) -> Result<Self, SessionError> {
        let Some(path) = &args.retain else { return Ok(Self::None) };
        let what = format!("the retained file {}", path.display());
        let open = || RetainedFile::open(path, dialect);
        let is_held = |error: &RetainError| matches!(error, RetainError::Locked { .. });
        let mut file = predecessor.wait(&what, open, is_held)?;
        restore(path, &mut file, args.retain_must_exist, executive, journal)?;
        if !args.realtime {
            return Ok(Self::AtEnd(file));
        }
        let size = executive.retained().map_or(0, |state| state.len());
        let writer = RetainedWriter::new(path.clone(), file, size, journal.clone())?;
        Ok(Self::Continually(writer))
    }

    /// A function that tells about the retained file whenever it is called: nothing if the run has none.
    pub(super) fn status(&self, args: &RunArgs) -> RetainedStatus {
        let file = args.retain.as_ref().map(|path| path.display().to_string());
        let trouble = match self {
            Self::Continually(writer) => writer.trouble(),
            Self::None | Self::AtEnd(_) => RetainedTrouble::default(),
        };
        Box::new(move || Some(Retained { file: file.clone()?, error: trouble.get() }))
    }

    /// How large the buffers are that go to the thread that writes, if there is one.
    pub(super) fn buffer_size(&self) -> Option<BufferSize> {
        match self {
            Self::Continually(writer) => Some(writer.buffer_size()),
            Self::None | Self::AtEnd(_) => None,
        }
    }

    /// Writes the data at the end of the run.
    ///
    /// # Errors
    /// When it can't be written.
    pub(super) fn finish(self, executive: &dyn Executive) -> Result<(), SessionError> {
        match self {
            Self::None => Ok(()),
            Self::AtEnd(mut file) => match executive.retained() {
                Some(state) => Ok(file.store(&state)?),
                None => Ok(()),
            },
            Self::Continually(writer) => writer.finish(executive),
        }
    }
}

/// Gives a control what the retained file holds.
fn restore(
    path: &Path,
    file: &mut RetainedFile,
    must_exist: bool,
    executive: &mut dyn Executive,
    journal: &Journal,
) -> Result<(), SessionError> {
    let shown = path.display();
    let Some(retained) = file.load()? else {
        let missing = format!("neither the retained file {shown} nor its copy exists");
        if must_exist {
            let text = format!("{missing}, and --retain-must-exist is given");
            return Err(SessionError(text));
        }
        journal.note(format!("{missing}; the program begins with nothing retained"));
        return Ok(());
    };
    for text in retained.warnings {
        journal.write(EntryKind::RetainedFileDamaged { text });
    }
    let restored = executive.restore(&retained.payload).map_err(|why| {
        SessionError(format!("the retained file {shown} can't be used: {why}; name another one"))
    })?;
    if restored.other_program {
        // What this program has no place for is gone from the file with the next save.
        let old = file.keep_old()?;
        let (summary, old) = (restored.summary(), old.display());
        let text = format!(
            "the retained file {shown} was left by another program, or before this one was \
             changed: {summary}; it is kept as {old}"
        );
        journal.write(EntryKind::RetainedDataCarriedOver { text });
    }
    Ok(())
}
