//! A program as the debugger sees it: its sources, the places of its statements, its variables.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use plcc_abi::Program;
use plcc_diag::{FileId, SourceMap};
use plcc_frontend::common::{Accessed, Expression};
use plcc_frontend::{CheckedProgram, Language, language};

use crate::DebugError;

/// The longest source on the disk that is compared with the program's text, in bytes.
const MAX_SOURCE: u64 = 64 << 20;

/// Where a statement stands: lines and columns from 1, columns in characters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StatementPlace {
    /// The file.
    pub file: FileId,
    /// The line in which it begins.
    pub line: u32,
    /// The column at which it begins.
    pub column: u32,
    /// The line in which it ends.
    pub end_line: u32,
    /// The column after its last character.
    pub end_column: u32,
}

/// A checked program with what a debugger has to know of it.
#[derive(Debug)]
pub struct DebuggedProgram {
    checked: Box<dyn CheckedProgram>,
    sources: Sources,
    tables: Program,
    statements: Vec<Option<StatementPlace>>,
    /// The numbers of the statements that begin in a line, in the order of their columns.
    lines: BTreeMap<(FileId, u32), Vec<u32>>,
}

/// The files of a program, with their full paths.
struct Sources {
    map: SourceMap,
    /// The full path of each file; the path as it was given, if there is no such file.
    full: Vec<PathBuf>,
    /// Whether each file has the same text on the disk.
    on_disk: Vec<bool>,
}

impl std::fmt::Debug for Sources {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_list().entries(&self.full).finish()
    }
}

impl DebuggedProgram {
    /// A checked program, the sources that it was read from, and its tables.
    pub fn new(checked: Box<dyn CheckedProgram>, sources: SourceMap, tables: Program) -> Self {
        let place = |span: plcc_diag::Span| {
            let (line, column) = sources.line_col(span.file, span.start);
            let (end_line, end_column) = sources.line_col(span.file, span.end.max(span.start));
            StatementPlace { file: span.file, line, column, end_line, end_column }
        };
        let statements: Vec<_> =
            checked.statements().into_iter().map(|span| span.map(place)).collect();
        let mut lines: BTreeMap<_, Vec<u32>> = BTreeMap::new();
        for (number, place) in (0..).zip(&statements) {
            if let Some(place) = place {
                lines.entry((place.file, place.line)).or_default().push(number);
            }
        }
        for numbers in lines.values_mut() {
            let column = |&number: &u32| {
                statements.get(number as usize).copied().flatten().map(|place| place.column)
            };
            numbers.sort_by_key(column);
        }
        let ids = || (0..sources.len() as u32).map(FileId);
        let full = ids().map(|id| {
            let path = Path::new(sources.path(id));
            path.canonicalize().unwrap_or_else(|_| path.to_owned())
        });
        let full: Vec<PathBuf> = full.collect();
        let is_on_disk = |(path, id): (&PathBuf, FileId)| has_text(path, sources.text(id));
        let on_disk = full.iter().zip(ids()).map(is_on_disk).collect();
        let sources = Sources { full, on_disk, map: sources };
        Self { checked, sources, tables, statements, lines }
    }

    /// The checked program.
    pub fn checked(&self) -> &dyn CheckedProgram {
        self.checked.as_ref()
    }

    /// Its tables.
    pub fn tables(&self) -> &Program {
        &self.tables
    }

    /// Its sources.
    pub fn sources(&self) -> &SourceMap {
        &self.sources.map
    }

    /// The full path of a file.
    pub fn path(&self, file: FileId) -> &Path {
        self.sources.full.get(file.0 as usize).map_or(Path::new(""), PathBuf::as_path)
    }

    /// Whether a file lies on the disk with the text that the program was read from. The disk may have none, or another
    /// version, where the program comes from a record.
    pub fn is_on_disk(&self, file: FileId) -> bool {
        self.sources.on_disk.get(file.0 as usize).copied().unwrap_or(false)
    }

    /// The file of a path, as the user or an editor writes it.
    pub fn file(&self, path: &str) -> Option<FileId> {
        let given = Path::new(path);
        let full = given.canonicalize().unwrap_or_else(|_| given.to_owned());
        let ids = || (0..self.sources.map.len() as u32).map(FileId);
        ids()
            .find(|&id| self.path(id) == full)
            .or_else(|| ids().find(|&id| self.sources.map.path(id) == path))
    }

    /// The place of a statement in the source; `None` for a statement that the compiler has added.
    pub fn place(&self, statement: u32) -> Option<StatementPlace> {
        self.statements.get(statement as usize).copied().flatten()
    }

    /// By a statement's number: whether it has a place in the source.
    pub fn placed(&self) -> Vec<bool> {
        self.statements.iter().map(Option::is_some).collect()
    }

    /// The first line from `line` (from 1) on in which statements begin, and the numbers of these statements.
    /// `None` if there is no such line.
    pub fn statements_from(&self, file: FileId, line: u32) -> Option<(u32, &[u32])> {
        let mut rest = self.lines.range((file, line)..(FileId(file.0.saturating_add(1)), 0));
        rest.next().map(|(&(_, line), numbers)| (line, numbers.as_slice()))
    }

    /// All statements that begin between two lines, the last one included.
    pub fn statements_between(&self, file: FileId, first: u32, last: u32) -> Vec<StatementPlace> {
        let lines = self.lines.range((file, first)..=(file, last.max(first)));
        lines.flat_map(|(_, numbers)| numbers).filter_map(|&number| self.place(number)).collect()
    }

    /// The numbers of the statements at a place.
    pub fn statements_at(&self, place: &StatementPlace) -> Vec<u32> {
        let numbers = self.lines.get(&(place.file, place.line)).map_or(&[][..], Vec::as_slice);
        let is_there = |number: &&u32| self.place(**number).as_ref() == Some(place);
        numbers.iter().filter(is_there).copied().collect()
    }

    /// An expression of the program's language.
    ///
    /// # Errors
    /// What is wrong with it, for people.
    pub fn expression(&self, text: &str) -> Result<Expression, DebugError> {
        self.checked.expression(text).map_err(|found| {
            let messages: Vec<_> =
                found.iter().map(|d| format!("{}: {}", d.code, d.message)).collect();
            DebugError(messages.join("; "))
        })
    }

    /// The language that the program is written in.
    pub fn language(&self) -> &'static dyn Language {
        language(self.checked.dialect())
    }

    /// The name of a variable that a statement has accessed: [`Presentation::name`](plcc_frontend::Presentation::name).
    pub fn name(&self, accessed: Accessed) -> Option<String> {
        self.checked.name(accessed)
    }

    /// What a name means, to compare it with what statements access; `None` if there is no such variable.
    pub fn accessed(&self, name: &str) -> Option<Accessed> {
        self.checked.accessed(name)
    }
}

/// Whether a file on the disk has a text, decoded as the compiler does it.
fn has_text(path: &Path, text: &str) -> bool {
    let Ok(bytes) = plcc_files::read_regular(path, MAX_SOURCE) else { return false };
    let mut read = SourceMap::new();
    let id = read.add(String::new(), &bytes);
    read.text(id) == text
}
