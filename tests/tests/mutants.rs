//! The mutants of `tests/mutants` (its README explains them) can still be applied, and say what
//! they are about. `scripts/full mutants` finds out whether the tests notice them.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A suite with fewer mutants would say little about the tests.
const AT_LEAST: usize = 40;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap()
}

fn patches() -> Vec<PathBuf> {
    let entries = fs::read_dir(root().join("tests/mutants")).unwrap();
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    paths.retain(|path| path.extension().is_some_and(|ending| ending == "patch"));
    paths.sort();
    paths
}

/// What stands after `# FIELD: ` in a patch's header.
fn field<'a>(text: &'a str, field: &str) -> Option<&'a str> {
    let header = text.lines().take_while(|line| line.starts_with('#'));
    let mut values =
        header.filter_map(|line| line.strip_prefix("# ")?.strip_prefix(field)?.strip_prefix(": "));
    values.next().map(str::trim).filter(|value| !value.is_empty())
}

#[test]
fn there_are_enough_mutants() {
    let count = patches().len();
    assert!(count >= AT_LEAST, "only {count} mutants");
}

#[test]
fn every_mutant_has_a_complete_header() {
    for path in patches() {
        let text = fs::read_to_string(&path).unwrap();
        let name = path.display();
        assert!(field(&text, "breaks").is_some(), "{name}: no line `# breaks: `");
        let language = field(&text, "language").unwrap_or("");
        let known = ["pmi", "nct", "pmac", "all"].contains(&language);
        assert!(known, "{name}: `# language: ` must be pmi, nct, pmac or all, not `{language}`");
        let expected = field(&text, "expected").unwrap_or("");
        let reason = expected.strip_prefix("equivalent: ").map_or("", str::trim);
        assert!(
            expected == "killed" || !reason.is_empty(),
            "{name}: `# expected: ` must be `killed`, or `equivalent: ` and a reason"
        );
        assert!(text.contains("\n--- a/") && text.contains("\n+++ b/"), "{name} has no diff");
    }
}

#[test]
fn every_mutant_can_be_applied() {
    let mut wrong = vec![];
    for path in patches() {
        let mut git = Command::new("git");
        let output = git.arg("apply").arg("--check").arg(&path).current_dir(root()).output();
        let output = output.unwrap_or_else(|error| panic!("git is needed: {error}"));
        if !output.status.success() {
            wrong.push(String::from_utf8_lossy(&output.stderr).into_owned());
        }
    }
    assert!(wrong.is_empty(), "make them again in today's code:\n{}", wrong.join(""));
}
