//! The sources of the program that a control runs now, which its record holds.

use std::path::Path;

use plcc_load::Artifact;
use plcc_record::{RecordedProgram, RecordedSources, Recording};

/// What is wrong where a record does not show the program that the control runs.
pub(crate) const NOT_SHOWN: &str = "the record does not show the program yet that the control runs now, or is not of this \
                                    control; try again in a second";

const WITHOUT_SOURCES: &str =
    "it holds an artifact that was built without the text of its sources (--no-source)";

/// The sources of the program that a record shows at its end; `None` if it shows none, or another one than asked for by a
/// fingerprint, in hexadecimal digits, and a number of online changes.
///
/// # Errors
/// When the record can't be read, or holds no sources.
pub(crate) fn running_sources(
    record: &Path,
    asked: Option<(&str, u64)>,
) -> Result<Option<RecordedSources>, String> {
    let recording = Recording::open(record).map_err(|error| error.to_string())?;
    let run = recording.runs().last();
    let Some((run, span)) = run.and_then(|run| Some((run, run.spans.last()?))) else {
        return Ok(None);
    };
    let shown = format!("{:016x}", span.fingerprint);
    if asked.is_some_and(|asked| asked != (shown.as_str(), u64::from(span.generation))) {
        return Ok(None);
    }
    match run.program_of(span.generation) {
        Some(RecordedProgram::Artifact(bytes)) => {
            let artifact = Artifact::parse(bytes, None).map_err(|error| error.to_string())?;
            let sources = RecordedSources::from_bytes(&artifact.sources);
            sources.ok_or_else(|| WITHOUT_SOURCES.into()).map(Some)
        }
        Some(RecordedProgram::Sources(sources)) => Ok(Some(sources.clone())),
        Some(RecordedProgram::Unknown) | None => Err("the record holds no program".into()),
    }
}
