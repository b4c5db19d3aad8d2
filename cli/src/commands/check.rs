//! `plcc check`

use std::collections::HashSet;
use std::fs;
use std::path::{Path, PathBuf};

use plcc_diag::FileId;
use plcc_frontend::common::Options;

use crate::args::{CheckArgs, FormatArg};
use crate::detect::{Ending, ending};
use crate::failure::{DONE, ERRORS, Failure, USAGE};
use crate::input::{self, Input, Program};
use crate::report::{Count, Report};

/// Folders within folders are followed so deep.
const MAX_DEPTH: usize = 64;

pub(crate) fn check(args: &CheckArgs, report: &Report) -> Result<u8, Failure> {
    let options = input::options(&args.source)?;
    let mut status = DONE;
    let mut total = Count::default();
    let mut files = 0;
    let mut finish = |program: &Program| -> Result<(), Failure> {
        files += 1;
        total.add(report.show(&program.sources, &program.diagnostics, args.message_format)?);
        Ok(())
    };
    for path in &args.paths {
        if !path.is_dir() {
            match one(path, args, &options) {
                Ok(program) => finish(&program)?,
                Err(failure) => status = report.failure(&failure),
            }
            continue;
        }
        let found = sources_in(path, report);
        if found.is_empty() {
            let what = "no .pmi, .nct, .pmc, .pmac or .plc file is in it";
            status = report.failure(&Failure::file(path, what));
        }
        for program in folder(&found, args, &options, |failure| status = report.failure(failure)) {
            finish(&program)?;
        }
    }
    if args.message_format == FormatArg::Human {
        let plural = if files == 1 { "" } else { "s" };
        report.tell(&format!("{files} file{plural} checked: {total}"));
    }
    Ok(if status == USAGE {
        USAGE
    } else if total.errors > 0 {
        ERRORS
    } else {
        DONE
    })
}

fn one(path: &Path, args: &CheckArgs, options: &Options) -> Result<Program, Failure> {
    Ok(Input::read(&[path.to_owned()], &args.source)?.check(options))
}

/// Checks a folder's files, but not on their own those that others of them include. A file that
/// can't be read or told is reported and left out.
fn folder(
    paths: &[PathBuf],
    args: &CheckArgs,
    options: &Options,
    mut failed: impl FnMut(&Failure),
) -> Vec<Program> {
    let mut included = HashSet::new();
    let mut checked = Vec::new();
    for path in paths {
        match one(path, args, options) {
            Ok(program) => {
                for id in (1..program.sources.len() as u32).map(FileId) {
                    included.extend(fs::canonicalize(program.sources.path(id)));
                }
                checked.push((path, Ok(program)));
            }
            Err(failure) => checked.push((path, Err(failure))),
        }
    }
    let own = |path: &Path| fs::canonicalize(path).is_ok_and(|path| !included.contains(&path));
    let mut programs = Vec::new();
    for (path, result) in checked {
        match result {
            Ok(program) if own(path) => programs.push(program),
            Err(failure) if own(path) || !path.exists() => failed(&failure),
            _ => {}
        }
    }
    programs
}

/// The files of a folder and those below it that have a known ending, sorted.
fn sources_in(folder: &Path, report: &Report) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut open = vec![(folder.to_owned(), 0)];
    let mut seen = HashSet::new();
    while let Some((folder, depth)) = open.pop() {
        // A link may lead back up.
        if !fs::canonicalize(&folder).is_ok_and(|real| seen.insert(real)) {
            continue;
        }
        let entries = match fs::read_dir(&folder) {
            Ok(entries) => entries,
            Err(error) => {
                report.warn(&format!("{}: {}", folder.display(), input::reason(&error)));
                continue;
            }
        };
        for path in entries.flatten().map(|entry| entry.path()) {
            if path.is_dir() {
                if depth < MAX_DEPTH {
                    open.push((path, depth + 1));
                }
            } else if ending(&path) != Ending::Other {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}
