//! `plcc test --coverage`: what the tests have covered of their programs.

use std::path::{Path, PathBuf};

use plcc_diag::SourceMap;
use plcc_plctest::coverage::{Counts, Coverage, Map, Summary, html, json, lcov};

use super::Job;
use super::program::TestProgram;
use crate::args::TestArgs;
use crate::failure::Failure;
use crate::output;

/// In which form coverage is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Form {
    Html,
    Lcov,
    Json,
}

/// Where coverage is written, besides its summary.
pub(super) struct CoverageFile {
    path: PathBuf,
    form: Form,
}

impl CoverageFile {
    /// What `--coverage` says: whether coverage is counted, and where it is written. A path behind the option that is a
    /// script or a folder is one that is to be tested, since the option's file may be missing: it is added to `paths`.
    ///
    /// # Errors
    /// When the file has another ending than those of the forms.
    pub(super) fn of(args: &TestArgs, paths: &mut Vec<PathBuf>) -> Result<Option<Self>, Failure> {
        let Some(Some(path)) = &args.coverage else {
            return Ok(None);
        };
        let ending = path.extension().unwrap_or_default().to_ascii_lowercase();
        let form = match ending.to_str() {
            Some("html" | "htm") => Form::Html,
            Some("info") => Form::Lcov,
            Some("json" | "jsonl") => Form::Json,
            _ if output::is_stdout(path) => Form::Json,
            Some("plctest") => {
                paths.insert(0, path.to_owned());
                return Ok(None);
            }
            _ if path.is_dir() => {
                paths.insert(0, path.to_owned());
                return Ok(None);
            }
            _ => {
                let what = "coverage is written to a file that ends in .html, .info or .json";
                return Err(Failure::file(path, what));
            }
        };
        Ok(Some(Self { path: path.to_owned(), form }))
    }

    /// Whether standard output has it.
    pub(super) fn is_stdout(&self) -> bool {
        output::is_stdout(&self.path)
    }

    /// Writes it.
    ///
    /// # Errors
    /// When the file can't be written.
    pub(super) fn write(&self, all: &[Coverage], read: &[PathBuf]) -> Result<(), Failure> {
        let text = match self.form {
            Form::Html => html(all),
            Form::Json => json(all),
            Form::Lcov => lcov(all, &|path| {
                let full = Path::new(path).canonicalize().unwrap_or_else(|_| path.into());
                full.to_string_lossy().into_owned()
            }),
        };
        output::write(&self.path, text.as_bytes(), &SourceMap::new(), read)
    }
}

/// The coverage of each program by the tests of it: `counts` are in the order of `jobs`.
pub(super) fn coverage(
    jobs: &[Job<'_>],
    counts: &[Option<Counts>],
    programs: &[TestProgram],
    maps: &[Map],
) -> Vec<Coverage> {
    let all = programs.iter().zip(maps).enumerate();
    all.map(|(number, (program, map))| {
        let own = jobs.iter().zip(counts).filter(|(job, _)| job.script.program == number);
        let tests = own.filter_map(|(job, counts)| {
            Some((format!("{}: {}", job.script.path, job.test.name), counts.clone()?))
        });
        Coverage::new(map, &program.sources, &tests.collect::<Vec<_>>())
    })
    .collect()
}

/// How much was covered of all programs.
pub(super) fn summary(all: &[Coverage]) -> Summary {
    all.iter().fold(Summary::default(), |sum, one| sum.plus(one.summary()))
}
