//! Files in the forms in which PMAC programs are found on machines must pass without an error:
//! glued and split keywords, macros of all kinds, on-line text around buffers, several encodings
//! and line ends (`tests/corpus/pmac`).
#![allow(clippy::unwrap_used, clippy::panic)]

use std::path::{Path, PathBuf};

use plcc_diag::{Diagnostic, SourceMap};
use plcc_frontend::common::{Controller, FileLoader, Options};
use plcc_frontend::pmac;

struct Disk;

impl FileLoader for Disk {
    fn read(&self, path: &Path) -> std::io::Result<Vec<u8>> {
        std::fs::read(path)
    }

    fn list(&self, folder: &Path) -> Vec<String> {
        let Ok(entries) = std::fs::read_dir(folder) else {
            return Vec::new();
        };
        entries.flatten().map(|entry| entry.file_name().to_string_lossy().into_owned()).collect()
    }
}

fn corpus() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/corpus/pmac");
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|ending| ending != "h"))
        .collect();
    files.sort();
    files
}

fn check(path: &Path) -> (SourceMap, bool, Vec<Diagnostic>) {
    let turbo = path.to_string_lossy().contains("turbo");
    let controller = if turbo { Controller::Turbo } else { Controller::Pmac };
    let options = Options { controller, ..Options::default() };
    let mut sources = SourceMap::default();
    let id = sources.add(path.to_string_lossy(), &std::fs::read(path).unwrap());
    let (program, diagnostics) = pmac::check(&mut sources, &[id], &Disk, &options);
    (sources, program.is_some(), diagnostics)
}

#[test]
fn files_as_found_on_machines_pass() {
    let files = corpus();
    assert!(files.len() >= 75, "{} files", files.len());
    let mut wrong = Vec::new();
    for path in files {
        let (sources, runs, diagnostics) = check(&path);
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        for error in diagnostics.iter().filter(|diagnostic| diagnostic.is_error()) {
            let (line, column) = sources.line_col(error.span.file, error.span.start);
            wrong.push(format!("{name}:{line}:{column}: {} {}", error.code, error.message));
        }
        if !runs && !diagnostics.iter().any(Diagnostic::is_error) {
            wrong.push(format!("{name}: no program and no error"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn the_corpus_has_every_encoding_and_line_end() {
    let texts: Vec<Vec<u8>> = corpus().iter().map(|path| std::fs::read(path).unwrap()).collect();
    let with = |what: fn(&[u8]) -> bool| texts.iter().filter(|text| what(text)).count();
    assert!(with(|text| text.starts_with(b"\xEF\xBB\xBF")) >= 3);
    assert!(with(|text| text.windows(2).any(|pair| pair == b"\r\n")) >= 10);
    assert!(with(|text| text.contains(&b'\r') && !text.contains(&b'\n')) >= 1);
    assert!(with(|text| std::str::from_utf8(text).is_err()) >= 2);
    assert!(with(|text| text.ends_with(b"\x1A")) >= 1);
    assert!(with(|text| !text.ends_with(b"\n") && !text.ends_with(b"\r")) >= 2);
}
