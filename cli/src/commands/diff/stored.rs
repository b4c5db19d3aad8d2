//! A version that is not a source: an artifact, a record, or what a control runs. Each of them holds the text of its sources.

use std::fs;
use std::os::unix::fs::FileTypeExt;
use std::path::Path;
use std::thread;
use std::time::{Duration, Instant};

use plcc_abi::Program;
use plcc_load::Artifact;
use plcc_record::RecordedSources;
use plcc_replay::ControlSocket;

use crate::commands::monitor::{is_recording, readable};
use crate::failure::Failure;
use crate::running_program::{NOT_SHOWN, running_sources};

/// How long a control's record is waited for, and how often it is read meanwhile.
const PATIENCE: Duration = Duration::from_secs(5);
const PAUSE: Duration = Duration::from_millis(200);

/// What is stored of a version.
pub(super) struct Stored {
    pub(super) sources: RecordedSources,
    /// The program as it was compiled, where that is stored too.
    pub(super) program: Option<Program>,
}

impl Stored {
    /// Reads what a path names; `None` where that is a source.
    ///
    /// # Errors
    /// When it can't be read, or does not hold the text of its sources.
    pub(super) fn read(path: &Path) -> Result<Option<Self>, Failure> {
        if path.is_file()
            && let Ok(bytes) = fs::read(path)
            && Artifact::is_artifact(&bytes)
        {
            return Self::of_artifact(path, &bytes).map(Some);
        }
        if fs::metadata(path).is_ok_and(|metadata| metadata.file_type().is_socket()) {
            return Self::of_control(path).map(Some);
        }
        if path.is_file() && is_recording(path)? {
            let failure = |error| Failure::file(path, error);
            let sources = running_sources(path, None).map_err(failure)?;
            let sources = sources.ok_or_else(|| failure("the record holds no program".into()))?;
            return Ok(Some(Self { sources, program: None }));
        }
        Ok(None)
    }

    fn of_artifact(path: &Path, bytes: &[u8]) -> Result<Self, Failure> {
        let artifact = Artifact::parse(bytes, None).map_err(|error| Failure::file(path, error))?;
        let sources = RecordedSources::from_bytes(&artifact.sources);
        let sources = sources.ok_or_else(|| {
            let why = "it was built without the text of its sources (--no-source), so that its statements are not known";
            Failure::file(path, why)
        })?;
        Ok(Self { sources, program: Some(artifact.program) })
    }

    /// The program that a control runs, of which its record has the text.
    fn of_control(path: &Path) -> Result<Self, Failure> {
        let control = ControlSocket::new(path);
        let deadline = Instant::now() + PATIENCE;
        loop {
            let status = control.status().map_err(|error| Failure::file(path, error))?;
            let record = readable(status.record.clone()).ok_or_else(|| {
                let program = &status.program;
                Failure::file(
                    path,
                    format!(
                        "the control keeps no record that can be read here, so the text of its program, {program}, is not \
                         known; start it with --record, or name the artifact that it runs in its place"
                    ),
                )
            })?;
            let sources = running_sources(&record, Some((&status.fingerprint, status.generation)));
            if let Some(sources) = sources.map_err(|error| Failure::file(&record, error))? {
                return Ok(Self { sources, program: None });
            }
            // A program is in the record when its first second is.
            if Instant::now() > deadline {
                return Err(Failure::file(&record, NOT_SHOWN));
            }
            thread::sleep(PAUSE);
        }
    }
}
