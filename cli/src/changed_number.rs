//! A program that a control runs, built again with one number of its source changed: what `plcc monitor` needs to change a
//! delay or a constant (PMI 5.2 `change`).
//!
//! The sources are those in the control's record. The new artifact lies beside the record, as `STEM-changed.plcx`, and holds
//! the changed sources, so that it can be changed again.

use std::path::{Path, PathBuf};

use plcc_codegen::emit::ObjectOptions;
use plcc_codegen::{OptLevel, Target};
use plcc_host::session::write_whole;
use plcc_load::Attached;
use plcc_monitor::{Rebuilder, Rebuilt, RunningProgram};
use plcc_record::RecordedSources;

use crate::compile::{self, CompileError};
use crate::recorded::{check_recorded, first_error};
use crate::running_program::{NOT_SHOWN, running_sources};

/// Builds programs from the sources in a record.
#[derive(Debug)]
pub(crate) struct RecordRebuilder {
    record: PathBuf,
}

impl RecordRebuilder {
    /// A rebuilder for the control that writes the record.
    pub(crate) fn new(record: &Path) -> Self {
        Self { record: record.to_owned() }
    }

    /// The sources of the program that the control runs now.
    fn sources(&self, running: &RunningProgram) -> Result<RecordedSources, String> {
        let sources =
            running_sources(&self.record, Some((&running.fingerprint, running.generation)))?;
        sources.ok_or_else(|| NOT_SHOWN.into())
    }

    /// Where the new artifact lies.
    fn artifact(&self) -> Result<PathBuf, String> {
        let record = std::fs::canonicalize(&self.record);
        let record = record.map_err(|error| format!("{}: {error}", self.record.display()))?;
        let mut name = record.file_stem().unwrap_or_default().to_owned();
        name.push("-changed.plcx");
        Ok(record.with_file_name(name))
    }
}

impl Rebuilder for RecordRebuilder {
    fn rebuild(
        &mut self,
        running: &RunningProgram,
        name: &str,
        value: i64,
    ) -> Result<Rebuilt, String> {
        let (sources, old) = with_number(&self.sources(running)?, name, value)?;
        let bytes = built(&sources)?;
        let artifact = self.artifact()?;
        write_whole(&artifact, &bytes).map_err(|error| error.to_string())?;
        Ok(Rebuilt { artifact, old })
    }
}

/// The sources with another number in the place of the one that `name` means, and the number as it was.
fn with_number(
    sources: &RecordedSources,
    name: &str,
    value: i64,
) -> Result<(RecordedSources, String), String> {
    let (checked, map, _) = check_recorded(sources)?;
    let program = checked.ok_or("the program in the record has errors for this plcc")?;
    let place = program.into_program().place_of_value(name);
    let place = place.ok_or_else(|| format!("{name} has no number in the source"))?;
    let mut changed = sources.clone();
    let path = map.path(place.file);
    let file = changed.files.iter_mut().find(|file| file.path == path);
    let moved = || format!("{path} is not in the record as it was read");
    let file = file.filter(|file| file.text == map.text(place.file)).ok_or_else(moved)?;
    let range = place.start as usize..place.end as usize;
    let old = file.text.get(range.clone()).ok_or_else(moved)?.to_owned();
    file.text.replace_range(range, &value.to_string());
    Ok((changed, old))
}

/// The artifact of a program, as `plcc build` makes it.
fn built(sources: &RecordedSources) -> Result<Vec<u8>, String> {
    let (checked, _, diagnostics) = check_recorded(sources)?;
    let error = || first_error(&diagnostics).unwrap_or_else(|| "the program has errors".into());
    let checked = checked.ok_or_else(error)?;
    let made = checked.compiled(OptLevel::Speed, |lowered| {
        let target = Target::host_baseline()?;
        let code = compile::code(lowered, &target)?;
        let debug = Some((&target, &ObjectOptions::default()));
        let (sources, panel) = (sources.to_bytes(), checked.operator_panel());
        let attached =
            Attached { sources: &sources, operator: Some(&panel), ..Attached::default() };
        compile::artifact_with(&lowered.program, &code, debug, attached)
    });
    made.map(|(_, bytes)| bytes).map_err(|error: CompileError| error.to_string())
}

#[cfg(test)]
mod tests {
    use plcc_abi::Dialect;
    use plcc_diag::SourceMap;
    use plcc_frontend::common::{MemoryLoader, Options};
    use plcc_load::Artifact;

    use super::*;
    use crate::recorded::recorded_sources;

    /// A program of two files, as an artifact holds it.
    fn sources() -> RecordedSources {
        let mut map = SourceMap::new();
        let main = "$INCLUDE times.pmi\n$INTEGER\nLIMIT = -5, N\n$END\nTC=N>LIMIT\nN=N+1\n";
        let file = map.add("main.pmi", main.as_bytes());
        let loader = MemoryLoader::new().with("times.pmi", "$TIMER\nE/TC/DC = 50\n");
        let options = Options::default();
        let (checked, found) = compile::check(&mut map, &[file], Dialect::Pmi, &loader, &options);
        assert!(checked.is_some(), "{found:?}");
        recorded_sources(Dialect::Pmi, &map, 1, &options, None)
    }

    #[test]
    fn a_number_is_changed_in_its_own_file_and_the_program_is_built_again() {
        let (changed, old) = with_number(&sources(), "TC#DELAY", 25).unwrap();
        assert_eq!(old, "50");
        assert_eq!(changed.files[1].text, "$TIMER\nE/TC/DC = 25\n");
        assert_eq!(changed.files[0], sources().files[0]);
        let artifact = Artifact::parse(&built(&changed).unwrap(), None).unwrap();
        // It holds the changed sources, so that it can be changed again.
        let inside = RecordedSources::from_bytes(&artifact.sources).unwrap();
        let (again, old) = with_number(&inside, "LIMIT", 7).unwrap();
        assert_eq!(old, "-5");
        assert!(again.files[0].text.contains("LIMIT = 7, N"), "{}", again.files[0].text);
        assert!(built(&again).is_ok());
    }

    #[test]
    fn a_number_that_the_language_does_not_take_is_refused_with_its_diagnostic() {
        let (changed, _) = with_number(&sources(), "TC#DELAY", 40_000).unwrap();
        let why = built(&changed).unwrap_err();
        assert!(why.contains("PMI-22") && why.contains("40000 is not a delay"), "{why}");
        assert!(with_number(&sources(), "N", 1).unwrap_err().contains("no number in the source"));
    }
}
