//! The texts that the editor has open. They are what is true, not the files on disk.

use std::collections::HashMap;
use std::io;
use std::path::{Path, PathBuf};

use gen_lsp_types::{TextDocumentContentChangeEvent, Uri};
use plcc_abi::Dialect;
use plcc_files::read_regular;
use plcc_frontend::common::FileLoader;

use crate::position::Encoding;

/// The longest source that is read.
const MAX_SOURCE: u64 = 64 << 20;

/// A text that the editor has open.
#[derive(Clone, Debug)]
pub(crate) struct Document {
    /// Its address as the editor writes it.
    pub(crate) uri: Uri,
    /// The version of the text, which the editor counts.
    pub(crate) version: i32,
    pub(crate) text: String,
    /// The language that the editor takes it for.
    pub(crate) dialect: Option<Dialect>,
}

/// The open documents, by their paths.
#[derive(Clone, Debug, Default)]
pub(crate) struct Documents(HashMap<PathBuf, Document>);

/// The path of a document. One that is not a file has its address as its path.
pub(crate) fn path_of(uri: &Uri) -> PathBuf {
    uri.to_file_path().unwrap_or_else(|()| PathBuf::from(uri.as_str()))
}

/// The address of a path.
pub(crate) fn uri_of(path: &Path) -> Option<Uri> {
    Uri::from_file_path(path).ok().or_else(|| Uri::parse(path.to_str()?).ok())
}

impl Documents {
    pub(crate) fn get(&self, path: &Path) -> Option<&Document> {
        self.0.get(path)
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = (&PathBuf, &Document)> {
        self.0.iter()
    }

    pub(crate) fn open(&mut self, document: Document) -> PathBuf {
        let path = path_of(&document.uri);
        self.0.insert(path.clone(), document);
        path
    }

    pub(crate) fn close(&mut self, path: &Path) {
        self.0.remove(path);
    }

    /// Changes a document. Changes of a document that is not open are ignored.
    pub(crate) fn change(
        &mut self,
        path: &Path,
        version: i32,
        changes: Vec<TextDocumentContentChangeEvent>,
        encoding: Encoding,
    ) {
        let Some(document) = self.0.get_mut(path) else { return };
        document.version = version;
        for change in changes {
            match change {
                TextDocumentContentChangeEvent::TextDocumentContentChangePartial(change) => {
                    let text = &document.text;
                    let start = encoding.offset_in_text(text, change.range.start);
                    let end = encoding.offset_in_text(text, change.range.end).max(start);
                    document.text.replace_range(start..end, &change.text);
                }
                TextDocumentContentChangeEvent::TextDocumentContentChangeWholeDocument(whole) => {
                    document.text = whole.text;
                }
            }
        }
    }

    /// The address of a path: as the editor writes it, if the document is open.
    pub(crate) fn uri(&self, path: &Path) -> Option<Uri> {
        self.get(path).map(|document| document.uri.clone()).or_else(|| uri_of(path))
    }
}

impl FileLoader for Documents {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        match self.get(path) {
            Some(document) => Ok(document.text.clone().into_bytes()),
            None => read_regular(path, MAX_SOURCE),
        }
    }

    fn list(&self, dir: &Path) -> Vec<String> {
        let entries = std::fs::read_dir(dir).into_iter().flatten().flatten();
        entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).take(10_000).collect()
    }
}
