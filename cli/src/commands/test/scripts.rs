//! Finds and reads test scripts, and the programs that they name.

use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};

use plcc_abi::natural_cmp;
use plcc_diag::{Diagnostic, FileId, SourceMap, Span};
use plcc_files::{MAX_SETTINGS, read_regular, why_not_read};
use plcc_plctest::script::{Piece, Script};
use plcc_plctest::{Plan, parse};

use super::program::{Loaded, TestProgram};
use crate::args::TestArgs;
use crate::failure::Failure;
use crate::report::Report;

/// The code of a file that a script names and that can't be used.
const FILE: &str = "TEST-6";

/// Folders within folders are followed this deep.
const MAX_DEPTH: usize = 64;

/// A script that can be run.
pub(super) struct TestScript {
    pub(super) path: String,
    pub(super) plan: Plan,
    /// The number of its program.
    pub(super) program: usize,
}

/// What tells programs apart: their files, their machine file, and whether the other side answers.
type ProgramKey = (Vec<PathBuf>, Option<PathBuf>, bool);

/// All scripts with their programs, or what is wrong with them.
#[derive(Default)]
pub(super) struct Scripts {
    pub(super) scripts: Vec<TestScript>,
    pub(super) programs: Vec<TestProgram>,
    /// What is wrong, with the sources that it is about.
    pub(super) found: Vec<(SourceMap, Vec<Diagnostic>)>,
    /// What became of each program: its number.
    known: HashMap<ProgramKey, Option<usize>>,
}

/// The scripts that paths name: files, and all scripts in folders, in natural order.
///
/// # Errors
/// When a folder has none.
pub(super) fn find(paths: &[PathBuf]) -> Result<Vec<PathBuf>, Failure> {
    let mut all = vec![];
    for path in paths {
        if !path.is_dir() {
            all.push(path.clone());
            continue;
        }
        let mut found = vec![];
        search(path, 0, &mut found);
        if found.is_empty() {
            return Err(Failure::file(path, "it holds no test script (*.plctest)"));
        }
        found.sort_by(|a, b| natural_cmp(&a.to_string_lossy(), &b.to_string_lossy()));
        all.extend(found);
    }
    Ok(all)
}

/// The mistakes of a script with this text. What is wrong with its program is told where the script names it.
pub(crate) fn mistakes(
    path: &Path,
    text: &str,
    args: &TestArgs,
    report: &Report,
) -> Vec<Diagnostic> {
    let mut scripts = Scripts::default();
    let failure = scripts.read_text(path, text.as_bytes(), args, report).err();
    let of_script = |sources: &SourceMap| Path::new(sources.path(FileId(0))) == path;
    let (own, of_program): (Vec<_>, Vec<_>) =
        scripts.found.into_iter().partition(|(sources, _)| of_script(sources));
    let mut found: Vec<Diagnostic> = own.into_iter().flat_map(|(_, found)| found).collect();
    let first = of_program.iter().find_map(|(_, found)| found.iter().find(|it| it.is_error()));
    let why = match (first, failure) {
        (Some(error), _) => format!("the program has errors: {}: {}", error.code, error.message),
        (None, Some(Failure::Usage(why) | Failure::Internal(why))) => why,
        (None, None) => return found,
    };
    let mut sources = SourceMap::new();
    let file = sources.add(path.to_string_lossy(), text.as_bytes());
    let (script, _) = parse(&sources, file);
    let named = script.programs.first().map_or(Span::new(file, 0, 0), |piece| piece.span);
    found.push(Diagnostic::error(FILE, named, why).help("open it: its problems are shown there"));
    found
}

/// The scripts below a folder.
fn search(folder: &Path, depth: usize, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        let is_folder = entry.file_type().is_ok_and(|kind| kind.is_dir());
        if is_folder && depth < MAX_DEPTH {
            search(&path, depth + 1, found);
        } else if path.extension().is_some_and(|ending| ending == "plctest") && path.is_file() {
            found.push(path);
        }
    }
}

impl Scripts {
    /// Reads a script and its program. What is wrong is in `found`.
    ///
    /// # Errors
    /// When the script itself can't be read, or the compiler makes a mistake.
    pub(super) fn read(
        &mut self,
        path: &Path,
        args: &TestArgs,
        report: &Report,
    ) -> Result<(), Failure> {
        let bytes = read_regular(path, MAX_SETTINGS);
        let bytes = bytes.map_err(|error| Failure::file(path, why_not_read(&error)))?;
        self.read_text(path, &bytes, args, report)
    }

    /// The same with the text of the script.
    fn read_text(
        &mut self,
        path: &Path,
        text: &[u8],
        args: &TestArgs,
        report: &Report,
    ) -> Result<(), Failure> {
        let mut sources = SourceMap::new();
        let file = sources.add(path.to_string_lossy(), text);
        let (script, mut mistakes) = parse(&sources, file);
        let program = match script.programs.is_empty() {
            true => None,
            false => self.program(path, file, &script, args, report, &mut mistakes)?,
        };
        let plan = program.and_then(|number| self.programs.get(number)).and_then(|program| {
            let text = |span: Span| sources.slice(span);
            let names = program.made().ok()?.names();
            Plan::new(&script, &text, program.checked.as_ref(), &program.tables, &*names)
                .map_err(|found| mistakes.extend(found))
                .ok()
        });
        mistakes.sort_by_key(|mistake| mistake.span.start);
        if let (Some(plan), Some(program), true) = (plan, program, mistakes.is_empty()) {
            self.scripts.push(TestScript {
                path: path.to_string_lossy().into_owned(),
                plan,
                program,
            });
        }
        if !mistakes.is_empty() {
            self.found.push((sources, mistakes));
        }
        Ok(())
    }

    /// The number of the program that a script names; `None` where it has errors.
    fn program(
        &mut self,
        path: &Path,
        file: FileId,
        script: &Script,
        args: &TestArgs,
        report: &Report,
        mistakes: &mut Vec<Diagnostic>,
    ) -> Result<Option<usize>, Failure> {
        let folder = path.parent().unwrap_or(Path::new(""));
        let files: Vec<PathBuf> =
            script.programs.iter().map(|piece| folder.join(&piece.text)).collect();
        let machine = script.machine.as_ref().map(|piece| folder.join(&piece.text));
        let key = (files, machine, script.simulate.is_some());
        if let Some(known) = self.known.get(&key) {
            return Ok(*known);
        }
        let (files, machine, simulate) = &key;
        let number = match TestProgram::load(files, machine.as_deref(), *simulate, args, report) {
            Ok(Loaded::Program(program)) => {
                self.programs.push(*program);
                Some(self.programs.len() - 1)
            }
            Ok(Loaded::Errors(sources, found)) => {
                self.found.push((sources, found));
                None
            }
            Err(Failure::Usage(message)) => {
                let pieces =
                    script.programs.iter().zip(files).chain(script.machine.iter().zip(machine));
                let missing = pieces.filter(|(_, path)| !path.is_file()).map(|(piece, _)| piece);
                let named: Option<&Piece> = missing.into_iter().chain(&script.programs).next();
                let span = named.map_or(Span::new(file, 0, 0), |piece| piece.span);
                let diagnostic = Diagnostic::error(FILE, span, message);
                mistakes.push(diagnostic.help("paths start from the script's folder"));
                None
            }
            Err(internal) => return Err(internal),
        };
        self.known.insert(key, number);
        Ok(number)
    }
}
