//! `plcc check`: checks files and folders of sources, and prints every diagnostic and a summary.

use std::collections::HashSet;
use std::fs;
use std::path::{Path, PathBuf};

use plcc_abi::{Dialect, natural_cmp};
use plcc_control::ControlArgs;
use plcc_diag::{Diagnostic, FileId, Severity, SourceMap};
use plcc_files::why_not_read;
use plcc_frontend::detect::{self, Ending, ending};
use plcc_frontend::language;
use plcc_host::simulation::Simulation;

use crate::args::{CheckArgs, FormatArg};
use crate::commands::bound;
use crate::compile::Checked;
use crate::disk::existing_path;
use crate::failure::{DONE, ERRORS, Failure, USAGE};
use crate::input::{self, Input, Program, SourceFile, SourceSettings};
use crate::output;
use crate::report::{Count, Destination, Report, count_of};

/// Folders within folders are followed this deep.
const MAX_DEPTH: usize = 64;

/// The programs that were checked, and why others could not be.
#[derive(Default)]
struct Results {
    programs: Vec<Program>,
    /// How many files were named or found, without those that others include.
    files: usize,
    failures: Vec<Failure>,
}

impl Results {
    fn add(&mut self, result: Result<Program, Failure>) {
        match result {
            Ok(program) => {
                self.files += program.named_files;
                self.programs.push(program);
            }
            Err(failure) => self.failures.push(failure),
        }
    }
}

pub(crate) fn check(args: &CheckArgs, report: &Report) -> Result<u8, Failure> {
    if args.bound {
        return bound::bound(args, report);
    }
    let (folders, files): (Vec<_>, Vec<PathBuf>) =
        args.paths.iter().cloned().partition(|path| path.is_dir());
    let mut results = Results::default();
    check_named(&files, args, report, &mut results);
    if folders.is_empty() {
        refuse_options(args, &results)?;
    }
    for path in folders {
        let found = sources_in(&path, args.source.dialect, report);
        if found.is_empty() {
            let file_extensions = detect::file_extensions();
            let file_extensions: Vec<&str> = file_extensions.iter().map(String::as_str).collect();
            let what = format!("it holds no {} file", input::list(&file_extensions, "or"));
            results.failures.push(Failure::file(&path, what));
        }
        check_folder(&path, &found, args, report, &mut results);
    }
    let findings: Vec<_> = results
        .programs
        .iter()
        .flat_map(|program| {
            let part_program = program.part_program.iter();
            let part_program = part_program.map(|(sources, found)| (sources, found.as_slice()));
            [(&program.sources, program.diagnostics.as_slice())].into_iter().chain(part_program)
        })
        .collect();
    let count = report.show_all(&findings, Destination::from(args.source.message_format))?;
    if args.source.message_format == FormatArg::Human {
        results
            .programs
            .iter()
            .filter_map(Program::other_language)
            .for_each(|note| report.note(&note));
    }
    for failure in &results.failures {
        report.failure(failure);
    }
    if args.explain_arithmetic {
        explain_arithmetic(&results, args, report)?;
    }
    if args.source.message_format == FormatArg::Human && results.files > 0 {
        summary(&results, count, report);
    }
    Ok(match (results.failures.is_empty(), count.errors) {
        (false, _) => USAGE,
        (true, 0) => DONE,
        (true, _) => ERRORS,
    })
}

/// Refuses an option that is for another language than that of all programs. Where they are of
/// several languages, it is for some of them.
fn refuse_options(args: &CheckArgs, results: &Results) -> Result<(), Failure> {
    let mut dialects = results.programs.iter().map(|program| program.dialect);
    match dialects.next() {
        Some(first) if dialects.all(|dialect| dialect == first) => {
            input::refuse_options_of_others(first, |other| args.source.option_of(other))
        }
        _ => Ok(()),
    }
}

/// Prints whether PMAC's statements are computed in integers or in floating point: on standard
/// output, or, where diagnostics are lines of JSON there, on standard error.
fn explain_arithmetic(results: &Results, args: &CheckArgs, report: &Report) -> Result<(), Failure> {
    let checked = results.programs.iter().filter_map(|program| program.checked.as_ref());
    let texts = checked.filter_map(Checked::explain_arithmetic).collect::<Result<Vec<_>, _>>()?;
    if texts.is_empty() {
        report.warn("--explain-arithmetic prints nothing: there is no PMAC program without errors");
    }
    let text = texts.join("\n");
    match args.source.message_format {
        FormatArg::Human => output::print(text.as_bytes()),
        FormatArg::Json => {
            report.message(text.trim_end());
            Ok(())
        }
    }
}

fn summary(results: &Results, count: Count, report: &Report) {
    let mut line = format!("{} checked: {count}", count_of(results.files, "file"));
    let bad = results.programs.iter().filter(|p| Count::of(&p.diagnostics).errors > 0).count();
    if bad > 0 && results.programs.len() > 1 {
        line.push_str(&format!("; {bad} of {} programs have errors", results.programs.len()));
    }
    if !results.failures.is_empty() {
        line.push_str(&format!("; {} not checked", results.failures.len()));
    }
    report.message(&line);
}

/// Checks a program with the settings of its own machine file. A warning about something that
/// another file of the machine may provide becomes a note, since not all files may have been given.
fn check_program(input: Input, args: &CheckArgs, report: &Report) -> Result<Program, Failure> {
    let settings = SourceSettings::of(&args.source, &input.first(), report)?;
    let mut program = input.check(&settings)?;
    let language = language(program.dialect);
    for diagnostic in &mut program.diagnostics {
        if diagnostic.severity == Severity::Warning && language.may_be_elsewhere(diagnostic.code) {
            diagnostic.severity = Severity::Note;
        }
    }
    program.part_program = part_program(&program, &settings)?;
    Ok(program)
}

/// Checks the table `[simulator]` of a program's machine file, and reads the part program that it names.
///
/// # Errors
/// When the table does not fit the program, or the part program can't be read.
fn part_program(
    program: &Program,
    settings: &SourceSettings,
) -> Result<Option<(SourceMap, Vec<Diagnostic>)>, Failure> {
    let Some((path, machine)) = settings.machine.as_deref().zip(settings.machine_file()) else {
        return Ok(None);
    };
    let has_errors = program.diagnostics.iter().any(Diagnostic::is_error);
    let Some(checked) = program.checked.as_ref().filter(|_| !has_errors) else { return Ok(None) };
    if machine.simulator.is_none() {
        return Ok(None);
    }
    let tables = checked.lower()?.program;
    let simulation = Simulation::read(Some((path, machine)), None).map_err(Failure::Usage)?;
    let wrong = |errors: Vec<String>| Failure::Usage(errors.join("\nerror: "));
    let control = ControlArgs::default();
    simulation.check_table(&tables, &control, Some(machine)).map_err(wrong)?;
    simulation.diagnostics(&tables).map_err(wrong)
}

/// Checks files that were named: each on its own, but all files of a language that joins files
/// (PMAC) as one program, as `build` and `run` do. A file that does not show its language belongs to
/// that program, if there is one.
fn check_named(paths: &[PathBuf], args: &CheckArgs, report: &Report, results: &mut Results) {
    let mut files = Vec::new();
    for path in paths {
        match SourceFile::read(path) {
            Ok(raw) => files.push(raw),
            Err(failure) => results.failures.push(failure),
        }
    }
    let alone = |raw: &SourceFile| Input::of(&[raw], &args.source);
    let shows_joining_language =
        |raw: &SourceFile| alone(raw).is_ok_and(|input| language(input.dialect).joins_files());
    let first = files.iter().find(|raw| shows_joining_language(raw));
    let belongs_to_download = |raw: &SourceFile| {
        let fits_first =
            |first| alone(raw).is_err() && Input::of(&[first, raw], &args.source).is_ok();
        shows_joining_language(raw) || first.is_some_and(fits_first)
    };
    let (download, others): (Vec<&SourceFile>, Vec<&SourceFile>) =
        files.iter().partition(|raw| belongs_to_download(raw));
    if !download.is_empty() {
        results.add(
            Input::of(&download, &args.source).and_then(|input| check_program(input, args, report)),
        );
    }
    for raw in others {
        results.add(alone(raw).and_then(|input| check_program(input, args, report)));
    }
}

/// Checks the files that were found in a folder, but not on their own those that others of them include. A file that
/// can't be read, or whose language is not known, is reported.
fn check_folder(
    folder: &Path,
    paths: &[PathBuf],
    args: &CheckArgs,
    report: &Report,
    results: &mut Results,
) {
    let mut included = HashSet::new();
    let mut checked = Vec::new();
    for path in paths {
        let raw = SourceFile::read(path);
        let input = raw.and_then(|raw| Input::of(&[&raw], &args.source));
        let input = input.map(|input| Input { folder: Some(folder.to_owned()), ..input });
        let result = input.and_then(|input| check_program(input, args, report));
        let place = fs::canonicalize(path).unwrap_or_else(|_| path.clone());
        let reached: Vec<PathBuf> = match &result {
            Ok(program) => inner_files(program).filter(|inner| *inner != place).collect(),
            Err(_) => Vec::new(),
        };
        included.extend(reached.iter().cloned());
        checked.push((place, reached, result));
    }
    // Of files that include each other in a circle the first stands for all.
    let mut covered = HashSet::new();
    for (place, reached, _) in &checked {
        if !included.contains(place) {
            covered.extend(reached.iter().cloned());
        }
    }
    for (place, reached, result) in checked {
        if !covered.contains(&place) {
            covered.extend(reached);
            results.add(result);
        }
    }
}

/// Where the files are that a program includes.
fn inner_files(program: &Program) -> impl Iterator<Item = PathBuf> {
    let inner = (program.named_files as u32..program.sources.len() as u32).map(FileId);
    inner.filter_map(|id| fs::canonicalize(existing_path(Path::new(program.sources.path(id)))).ok())
}

/// The files of a folder and those below it that have a known ending, in natural order; where the
/// language is given, without those that are another's. Names that begin with a dot are left out.
fn sources_in(folder: &Path, dialect: Option<Dialect>, report: &Report) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut open = vec![(folder.to_owned(), 0)];
    let mut seen = HashSet::new();
    while let Some((folder, depth)) = open.pop() {
        // A link may lead back up.
        if !fs::canonicalize(&folder).is_ok_and(|place| seen.insert(place)) {
            continue;
        }
        let entries = match fs::read_dir(&folder) {
            Ok(entries) => entries,
            Err(error) => {
                report.warn(&format!("{}: {}", folder.display(), why_not_read(&error)));
                continue;
            }
        };
        for path in entries.flatten().map(|entry| entry.path()) {
            let hidden =
                path.file_name().is_some_and(|name| name.as_encoded_bytes().starts_with(b"."));
            let fits = match ending(&path) {
                Ending::Of(of) => dialect.is_none_or(|dialect| dialect == of),
                Ending::Shared => true,
                Ending::Unknown => false,
            };
            if hidden {
                continue;
            }
            if path.is_dir() {
                if depth < MAX_DEPTH {
                    open.push((path, depth + 1));
                }
            } else if fits {
                found.push(path);
            }
        }
    }
    found.sort_by(|a, b| natural_cmp(&a.to_string_lossy(), &b.to_string_lossy()));
    found
}
