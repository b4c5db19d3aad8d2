//! The fuzz targets' oracles on their corpus, on the tests' own sources, and on mutations of
//! both, which are the same in each run.
//!
//! `PLCC_MUTATIONS=100000` runs more of them, from `PLCC_MUTATION_SEED` on. A mutation that breaks
//! a promise is written to the temporary folder; cut down, it belongs into `fuzz/corpus`.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use plcc_runtime::Artifact;
use plcc_tests::mutate::mutate;
use plcc_tests::oracle::{ORACLES, Oracle, artifacts};

/// Only what hangs, or grows faster than its input, takes longer in a debug build of a busy machine.
const PATIENCE: Duration = Duration::from_secs(60);

fn number(variable: &str) -> Option<u64> {
    std::env::var(variable).ok()?.parse().ok()
}

/// The files below a folder with one of the endings, or all.
fn files(folder: &Path, endings: &[&str], found: &mut Vec<PathBuf>) {
    let mut paths: Vec<PathBuf> =
        std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    for path in paths {
        let ending = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        if path.is_dir() {
            files(&path, endings, found);
        } else if endings.is_empty() || endings.contains(&&*ending) {
            found.push(path);
        }
    }
}

/// Runs an oracle on bytes; what made it panic is kept.
fn run(name: &str, oracle: Oracle, bytes: &[u8], what: &str) {
    let start = Instant::now();
    let result = catch_unwind(AssertUnwindSafe(|| oracle(bytes)));
    // A busy machine may have been elsewhere: what is slow is slow again.
    let slow = start.elapsed() > PATIENCE && {
        let again = Instant::now();
        let _ = catch_unwind(AssertUnwindSafe(|| oracle(bytes)));
        again.elapsed() > PATIENCE
    };
    if result.is_err() || slow {
        let path = std::env::temp_dir().join(format!("plcc-{name}-{}", what.replace('/', "_")));
        std::fs::write(&path, bytes).unwrap();
        let fault = if slow { "is slow" } else { "panics" };
        panic!("{name} {fault} on {what}, kept as {}", path.display());
    }
}

/// A target: its corpus, sources of the tests with these endings, and their mutations.
fn replay(name: &str, folders: &[&str], endings: &[&str], mutations: u64) {
    replay_with(name, folders, endings, vec![], mutations);
}

/// The same with inputs from elsewhere, which are mutated whatever their length.
fn replay_with(name: &str, folders: &[&str], endings: &[&str], more: Vec<Vec<u8>>, mutations: u64) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let (_, oracle) = ORACLES.into_iter().find(|(known, _)| *known == name).unwrap();
    let mut paths = vec![];
    files(&root.join("fuzz/corpus").join(name), &[], &mut paths);
    assert!(!paths.is_empty(), "{name} has no corpus");
    for folder in folders {
        files(&root.join(folder), endings, &mut paths);
    }
    let inputs: Vec<Vec<u8>> = paths.iter().map(|path| std::fs::read(path).unwrap()).collect();
    for (path, bytes) in paths.iter().zip(&inputs) {
        run(name, oracle, bytes, &path.file_name().unwrap().to_string_lossy());
    }
    // Long ones would take all the time.
    let short = inputs.into_iter().filter(|bytes| bytes.len() < 6000);
    let short: Vec<Vec<u8>> = short.chain(more).collect();
    let first = number("PLCC_MUTATION_SEED").unwrap_or(1);
    for seed in first..first + number("PLCC_MUTATIONS").unwrap_or(mutations) {
        run(name, oracle, &mutate(&short, seed), &format!("mutation-{seed}"));
    }
}

#[test]
fn parse_pmi() {
    replay("parse_pmi", &["tests/errors/pmi", "tests/conformance/pmi"], &["pmi", "inc"], 1500);
}

#[test]
fn parse_nct() {
    replay("parse_nct", &["tests/errors/nct"], &["nct", "plc"], 2000);
}

#[test]
fn parse_pmac() {
    let folders = ["tests/corpus/pmac", "tests/conformance/pmac"];
    replay("parse_pmac", &folders, &["pmc", "pmac", "plc", "h"], 150);
}

#[test]
fn artifact() {
    // The corpus gets too old to be read when the format changes; these never do.
    let fresh = artifacts();
    assert_eq!(fresh.len(), 3);
    if std::env::var_os("PLCC_BLESS").is_some() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../fuzz/corpus/artifact");
        for (name, bytes) in &fresh {
            std::fs::write(folder.join(format!("{name}.plcx")), bytes).unwrap();
        }
    }
    let fresh = fresh.into_iter().map(|(_, bytes)| {
        assert!(Artifact::parse(&bytes).is_ok());
        bytes
    });
    replay_with("artifact", &[], &[], fresh.collect(), 3000);
}

#[test]
fn ir_text() {
    replay("ir_text", &["tests/filetests"], &["ir"], 5000);
}
