//! A program that has been read, and a place in it.

use std::cell::{Cell, OnceCell};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use gen_lsp_types::{Location, Range, Uri};
use plcc_abi::{Dialect, GivenName};
use plcc_diag::{Diagnostic, FileId, SourceMap, Span};
use plcc_frontend::common::words::Word;
use plcc_frontend::common::{FileLoader, Options, Words};
use plcc_frontend::{CheckedProgram, RestOfCheck, language};

use crate::documents::{Document, Documents};
use crate::position::Encoding;

/// The program, if it has no error, and its diagnostics.
type Checked = (Option<Box<dyn CheckedProgram>>, Vec<Diagnostic>);

/// A program that has been read: of one file, or of several that are one download.
///
/// Most of what an editor asks while its user types is answered from the words. So the words are found at first, and the rest of
/// the check is done when something needs it, the problems at the latest.
pub(crate) struct Program {
    pub(crate) dialect: Dialect,
    pub(crate) sources: SourceMap,
    /// How many of the sources were named; the others are included.
    pub(crate) named: usize,
    pub(crate) words: Words,
    pub(crate) options: Options,
    pub(crate) encoding: Encoding,
    /// What gives the program and its diagnostics, until they have been asked for.
    rest: Cell<Option<RestOfCheck>>,
    checked: OnceCell<Checked>,
    given: OnceCell<Vec<GivenName>>,
}

impl std::fmt::Debug for Program {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Program").field("dialect", &self.dialect).finish_non_exhaustive()
    }
}

impl Program {
    /// Reads the program of these files.
    pub(crate) fn read(
        files: &[PathBuf],
        dialect: Dialect,
        documents: &Documents,
        options: Options,
        encoding: Encoding,
    ) -> Self {
        let mut sources = SourceMap::new();
        let load = |path: &PathBuf| {
            let bytes = documents.read(path).unwrap_or_default();
            sources.add(path.to_string_lossy(), &bytes)
        };
        let ids: Vec<FileId> = files.iter().map(load).collect();
        let (words, rest) =
            language(dialect).words_and_rest(&mut sources, &ids, documents, &options);
        Self {
            dialect,
            sources,
            named: files.len(),
            words,
            options,
            encoding,
            rest: Cell::new(Some(rest)),
            checked: OnceCell::new(),
            given: OnceCell::new(),
        }
    }

    fn rest(&self) -> &Checked {
        self.checked.get_or_init(|| match self.rest.take() {
            Some(rest) => rest(&self.sources),
            // It has panicked, and whoever asked has been told.
            None => (None, vec![]),
        })
    }

    /// The checked program, if it has no error.
    pub(crate) fn checked(&self) -> Option<&dyn CheckedProgram> {
        self.rest().0.as_deref()
    }

    pub(crate) fn diagnostics(&self) -> &[Diagnostic] {
        &self.rest().1
    }

    /// What people call the variables and say of them: in the machine file, then in the source.
    pub(crate) fn given(&self) -> &[GivenName] {
        self.given.get_or_init(|| {
            self.checked().map_or_else(Vec::new, |checked| given(checked, &self.options))
        })
    }

    /// The program that it would be with other texts in some of its files.
    pub(crate) fn with_texts(
        &self,
        texts: BTreeMap<FileId, String>,
        documents: &Documents,
    ) -> Self {
        let mut documents = documents.clone();
        for (file, text) in texts {
            if let Some(uri) = documents.uri(self.path(file)) {
                documents.open(Document { uri, version: 0, text, dialect: Some(self.dialect) });
            }
        }
        let named = self.files().take(self.named).map(|file| self.path(file).to_owned());
        let named: Vec<PathBuf> = named.collect();
        Self::read(&named, self.dialect, &documents, self.options.clone(), self.encoding)
    }

    /// The file with a path, if it belongs to the program.
    pub(crate) fn file(&self, path: &Path) -> Option<FileId> {
        self.files().find(|&id| Path::new(self.sources.path(id)) == path)
    }

    /// All its files.
    pub(crate) fn files(&self) -> impl Iterator<Item = FileId> + use<> {
        (0..self.sources.len() as u32).map(FileId)
    }

    /// The path of a file.
    pub(crate) fn path(&self, file: FileId) -> &Path {
        Path::new(self.sources.path(file))
    }

    /// The comment that says what is declared at a place.
    pub(crate) fn comment(&self, at: Span) -> Option<String> {
        let signs = language(self.dialect).comment_signs();
        self.words.comment_beside(&self.sources, at, signs)
    }

    /// The range of a span in the protocol's terms.
    pub(crate) fn range(&self, span: Span) -> Range {
        self.encoding.range(&self.sources, span)
    }

    /// The range and the file of a span.
    pub(crate) fn location(&self, span: Span, documents: &Documents) -> Option<Location> {
        let uri: Uri = documents.uri(self.path(span.file))?;
        Some(Location { uri, range: self.range(span) })
    }
}

/// What people call a program's variables and say of them.
fn given(checked: &dyn CheckedProgram, options: &Options) -> Vec<GivenName> {
    let own = options.machine.names.iter().filter_map(|it| {
        let name = checked.canonical(&it.given.name)?;
        Some(GivenName { name, ..it.given.clone() })
    });
    own.chain(checked.names_in_source()).collect()
}

/// A place in a program, which a request is about.
#[derive(Clone, Copy)]
pub(crate) struct At<'p> {
    pub(crate) program: &'p Program,
    pub(crate) documents: &'p Documents,
    pub(crate) file: FileId,
    pub(crate) offset: u32,
}

impl<'p> At<'p> {
    /// The word there.
    pub(crate) fn word(&self) -> Option<&'p Word> {
        self.program.words.at(self.file, self.offset)
    }

    /// The text of a word.
    pub(crate) fn text(&self, word: &Word) -> &'p str {
        self.program.sources.slice(word.span)
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// A program of one text, and the documents that hold it. The place is where `|` stands in the text.
    pub(crate) fn with_cursor(dialect: Dialect, text: &str) -> (Program, Documents, u32) {
        let offset = text.find('|').unwrap_or(0) as u32;
        let path = PathBuf::from(format!("/tmp/a.{}", dialect.name()));
        let mut documents = Documents::default();
        let uri = crate::documents::uri_of(&path).unwrap();
        let text = text.replacen('|', "", 1);
        documents.open(Document { uri, version: 1, text, dialect: Some(dialect) });
        let program =
            Program::read(&[path], dialect, &documents, Options::default(), Encoding::Utf16);
        (program, documents, offset)
    }

    /// The place in such a program.
    pub(crate) fn at<'p>(of: &'p (Program, Documents, u32)) -> At<'p> {
        At { program: &of.0, documents: &of.1, file: FileId(0), offset: of.2 }
    }
}
