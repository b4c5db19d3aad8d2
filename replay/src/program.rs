//! A program as the debugger sees it: its sources, the places of its statements, its variables.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use plcc_abi::Program;
use plcc_diag::{FileId, SourceMap};
use plcc_frontend::common::{Accessed, Expression};
use plcc_frontend::presentation::StatementPlaces;
use plcc_frontend::{CheckedProgram, Language, language};
use plcc_runtime::{GivenNames, Names};

use crate::DebugError;

/// The longest source on the disk that is compared with the program's text, in bytes.
const MAX_SOURCE: u64 = 64 << 20;

/// A checked program with what a debugger has to know of it.
#[derive(Debug)]
pub struct DebuggedProgram {
    checked: Arc<dyn CheckedProgram>,
    sources: Sources,
    tables: Program,
    places: StatementPlaces,
    names: Arc<dyn Names>,
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
        let places = StatementPlaces::new(checked.as_ref(), &sources);
        let ids = || (0..sources.len() as u32).map(FileId);
        let full = ids().map(|id| {
            let path = Path::new(sources.path(id));
            path.canonicalize().unwrap_or_else(|_| path.to_owned())
        });
        let full: Vec<PathBuf> = full.collect();
        let is_on_disk = |(path, id): (&PathBuf, FileId)| has_text(path, sources.text(id));
        let on_disk = full.iter().zip(ids()).map(is_on_disk).collect();
        let sources = Sources { full, on_disk, map: sources };
        let names = plcc_runtime::names_of(&tables);
        Self { checked: checked.into(), sources, tables, places, names }
    }

    /// The checked program.
    pub fn checked(&self) -> &dyn CheckedProgram {
        self.checked.as_ref()
    }

    /// The same, to be kept while the session changes.
    pub fn shared(&self) -> Arc<dyn CheckedProgram> {
        Arc::clone(&self.checked)
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

    /// The places of its statements.
    pub fn places(&self) -> &StatementPlaces {
        &self.places
    }

    /// What people call the variables and say of them.
    pub fn given(&self) -> &GivenNames {
        self.names.given()
    }

    /// The variable for which a name stands that the program defines or that people gave to it. `None` where a name means a
    /// variable itself.
    pub fn defined_name(&self, word: &str) -> Option<String> {
        self.given().replaced(word).or_else(|| self.checked.defined_name(word))
    }

    /// An expression of the program's language, in which variables may have the names that people gave them.
    ///
    /// # Errors
    /// What is wrong with it, for people.
    pub fn expression(&self, text: &str) -> Result<Expression, DebugError> {
        self.checked.expression(&self.given().in_expression(text)).map_err(|found| {
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
        self.checked.accessed(&self.names.spelled(name))
    }
}

/// Whether a file on the disk has a text, decoded as the compiler does it.
fn has_text(path: &Path, text: &str) -> bool {
    let Ok(bytes) = plcc_files::read_regular(path, MAX_SOURCE) else { return false };
    let mut read = SourceMap::new();
    let id = read.add(String::new(), &bytes);
    read.text(id) == text
}
