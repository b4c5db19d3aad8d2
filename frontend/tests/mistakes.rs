//! What is said to people who know other languages: structured text, instruction lists, C, part
//! programs, other dialects of the same control. The programs in `mistakes/LANGUAGE/` hold such
//! mistakes, and the snapshots hold the diagnostics of all of them, to be read as such a person
//! would.

#![allow(clippy::unwrap_used)]

use std::fmt::Write as _;
use std::path::Path;

use plcc_diag::{Diagnostic, SourceMap};
use plcc_frontend::common::{MemoryLoader, Options};
use plcc_frontend::{nct, pmac, pmi};

/// The diagnostics of all programs of a language: under each program's name, for each diagnostic the
/// line and column, code, text at its place, message, labels, notes and help.
fn found(language: &str, check: impl Fn(&mut SourceMap, &str, &[u8]) -> Vec<Diagnostic>) -> String {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/mistakes").join(language);
    let mut paths: Vec<_> =
        std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    let mut out = String::new();
    for path in paths {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        writeln!(out, "== {name}").unwrap();
        let mut sources = SourceMap::new();
        let all = check(&mut sources, &name, &std::fs::read(&path).unwrap());
        assert!(!all.is_empty(), "{name}: nothing is found");
        for d in &all {
            let (line, column) = sources.line_col(d.span.file, d.span.start);
            let source = sources.line_text(d.span.file, line).trim_end();
            let at = sources.slice(d.span).lines().next().unwrap_or("");
            writeln!(out, "{line}:{column} {source}").unwrap();
            writeln!(out, "    {} `{at}` {}", d.code, d.message).unwrap();
            for label in d.labels() {
                let (line, column) = sources.line_col(label.span.file, label.span.start);
                writeln!(out, "    at {line}:{column}: {}", label.text).unwrap();
            }
            for note in d.notes() {
                writeln!(out, "    note: {note}").unwrap();
            }
            if let Some(help) = &d.help {
                writeln!(out, "    help: {help}").unwrap();
            }
            assert!(d.help.is_some() || !d.is_error(), "{name}:{line}: no help");
        }
    }
    out
}

#[test]
fn pmi() {
    let found = found("pmi", |sources, name, text| {
        let file = sources.add(name, text);
        pmi::check(sources, file, &MemoryLoader::new(), &Options::default()).1
    });
    insta::assert_snapshot!(found);
}

#[test]
fn nct() {
    let found = found("nct", |sources, name, text| {
        let file = sources.add(name, text);
        nct::check(sources, file, &MemoryLoader::new(), &Options::default()).1
    });
    insta::assert_snapshot!(found);
}

#[test]
fn pmac() {
    let found = found("pmac", |sources, name, text| {
        let file = sources.add(name, text);
        pmac::check(sources, &[file], &MemoryLoader::new(), &Options::default()).1
    });
    insta::assert_snapshot!(found);
}
