//! Runs the checks of the fuzz targets (`plcc_tests::promise`) without a fuzzer: on the inputs saved in
//! `fuzz/corpus`, on programs of the other tests, and on random changes (mutations) of both.
//!
//! `PLCC_MUTATIONS` is the number of mutations of each target, `PLCC_MUTATION_SEED` the seed of the
//! first. `BLESS=1` writes the artifacts in `fuzz/corpus/artifact` again, which is needed when the
//! format of artifacts has changed. An input that made a check fail belongs into `fuzz/corpus`.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use plcc_abi::ABI_VERSION;
use plcc_host::retain;
use plcc_load::Artifact;
use plcc_tests::mutate::mutate;
use plcc_tests::promises::{PROMISES, Promise, artifacts};

/// An input that takes longer than this, twice, is reported. Even a debug build on a busy machine
/// needs far less unless the compiler hangs or its time grows faster than the input.
const PATIENCE: Duration = Duration::from_secs(60);

/// The number in an environment variable, if it is set to one.
fn number(variable: &str) -> Option<u64> {
    std::env::var(variable).ok()?.parse().ok()
}

/// Adds the files in a folder and the folders in it to `found`: those with one of these extensions,
/// or all where no extension is given.
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

/// Runs the check of a target on an input. If it panics or takes too long, the input is written to
/// a file of the temporary folder, and the test fails. `what` names the input.
fn run(name: &str, promise: Promise, bytes: &[u8], what: &str) {
    let start = Instant::now();
    let result = catch_unwind(AssertUnwindSafe(|| promise(bytes)));
    // The time may have gone to other processes, so a slow input has to be slow a second time.
    let slow = start.elapsed() > PATIENCE && {
        let again = Instant::now();
        let _ = catch_unwind(AssertUnwindSafe(|| promise(bytes)));
        again.elapsed() > PATIENCE
    };
    if result.is_err() || slow {
        let path = std::env::temp_dir().join(format!("plcc-{name}-{}", what.replace('/', "_")));
        std::fs::write(&path, bytes).unwrap();
        let fault = if slow { "is slow" } else { "panics" };
        panic!("{name} {fault} on {what}, kept as {}", path.display());
    }
}

/// Runs a target on its corpus, on the files with these extensions in `folders` (paths from the
/// repository's root), and on so many mutations of them unless `PLCC_MUTATIONS` says otherwise.
fn replay(name: &str, folders: &[&str], endings: &[&str], mutations: u64) {
    replay_with(name, folders, endings, vec![], mutations);
}

/// Does what [`replay`] does. `more` are further inputs to be mutated.
fn replay_with(name: &str, folders: &[&str], endings: &[&str], more: Vec<Vec<u8>>, mutations: u64) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let (_, promise) = PROMISES.into_iter().find(|(known, _)| *known == name).unwrap();
    let mut paths = vec![];
    files(&root.join("fuzz/corpus").join(name), &[], &mut paths);
    assert!(!paths.is_empty(), "{name} has no corpus");
    for folder in folders {
        files(&root.join(folder), endings, &mut paths);
    }
    let inputs: Vec<Vec<u8>> = paths.iter().map(|path| std::fs::read(path).unwrap()).collect();
    for (path, bytes) in paths.iter().zip(&inputs) {
        run(name, promise, bytes, &path.file_name().unwrap().to_string_lossy());
    }
    // Mutations of long inputs would take most of the time.
    let short = inputs.into_iter().filter(|bytes| bytes.len() < 6000);
    let short: Vec<Vec<u8>> = short.chain(more).collect();
    let first = number("PLCC_MUTATION_SEED").unwrap_or(1);
    for seed in first..first + number("PLCC_MUTATIONS").unwrap_or(mutations) {
        run(name, promise, &mutate(&short, seed), &format!("mutation-{seed}"));
    }
}

#[test]
fn parse_pmi_keeps_its_promises_on_saved_and_changed_inputs() {
    replay("parse_pmi", &["tests/errors/pmi", "tests/conformance/pmi"], &["pmi", "inc"], 1500);
}

#[test]
fn parse_nct_keeps_its_promises_on_saved_and_changed_inputs() {
    replay("parse_nct", &["tests/errors/nct"], &["nct", "plc"], 2000);
}

#[test]
fn parse_pmac_keeps_its_promises_on_saved_and_changed_inputs() {
    let folders = ["tests/corpus/pmac", "tests/conformance/pmac"];
    replay("parse_pmac", &folders, &["pmc", "pmac", "plc", "h"], 150);
}

#[test]
fn artifact_keeps_its_promises_on_saved_and_changed_inputs() {
    // Artifacts that the compiler makes now, beside the saved ones.
    let made = artifacts().into_iter().map(|(name, bytes)| {
        assert!(Artifact::parse(&bytes, None).is_ok(), "{name}");
        bytes
    });
    replay_with("artifact", &[], &[], made.collect(), 3000);
}

/// An artifact of another version is refused at its ninth byte, so its mutations would test nothing.
#[test]
fn artifact_corpus_has_the_present_format() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../fuzz/corpus/artifact");
    let bless = std::env::var_os("BLESS").is_some_and(|value| value == "1");
    let made = artifacts();
    assert_eq!(made.len(), 3, "one for each language");
    for (name, bytes) in made {
        let path = folder.join(format!("{name}.plcx"));
        if bless {
            std::fs::write(&path, bytes).unwrap();
        }
        let saved = std::fs::read(&path).unwrap();
        let version = u32::from_le_bytes(saved[8..12].try_into().unwrap());
        assert_eq!(version, ABI_VERSION, "{}: BLESS=1 writes it again", path.display());
    }
}

#[test]
fn ir_text_keeps_its_promises_on_saved_and_changed_inputs() {
    replay("ir_text", &["tests/ir/filetests"], &["ir"], 5000);
}

#[test]
fn retained_keeps_its_promises_on_saved_and_changed_inputs() {
    // What stands in the saved files, too, since a changed file is refused by its checksum.
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../fuzz/corpus/retained");
    let mut paths = vec![];
    files(&folder, &[], &mut paths);
    let bytes = paths.iter().map(|path| std::fs::read(path).unwrap());
    let payloads = bytes.filter_map(|bytes| Some(retain::decode(&bytes).ok()?.payload));
    let payloads: Vec<Vec<u8>> = payloads.collect();
    assert_eq!(payloads.len(), 4, "one for each language, and one for Turbo PMAC");
    replay_with("retained", &[], &[], payloads, 300);
}

#[test]
fn configuration_keeps_its_promises_on_saved_and_changed_inputs() {
    replay("configuration", &[], &[], 1500);
}

#[test]
fn socket_keeps_its_promises_on_saved_and_changed_inputs() {
    replay("socket", &[], &[], 400);
}

#[test]
fn key_keeps_its_promises_on_saved_and_changed_inputs() {
    replay("key", &[], &[], 2000);
}
