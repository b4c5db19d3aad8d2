//! Runs the commands of the documentation and compares what they print with what the page shows.
//!
//! A block fenced as ```` ```console ```` holds commands, each on a line that begins with `$ plcc`, and
//! below each what it prints. A line `…` stands for any number of lines; every other line must occur,
//! in this order, as part of a line of the output. Where no `…` stands between two lines, they must
//! follow each other. ```` ```console x86_64 ```` is for pages that show code of that processor.
#![allow(clippy::unwrap_used, clippy::indexing_slicing)]

use std::path::{Path, PathBuf};
use std::process::Command;

fn docs() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs")
}

/// A documented command: the line of the page, its arguments, the lines shown below it.
struct Shown {
    line: usize,
    arguments: Vec<String>,
    output: Vec<String>,
}

/// The commands of a page that this machine can run.
fn commands(page: &str) -> Vec<Shown> {
    let mut found: Vec<Shown> = Vec::new();
    let mut inside = false;
    for (line, number) in page.lines().zip(1..) {
        if let Some(fence) = line.strip_prefix("```") {
            let mut words = fence.split_whitespace();
            let console = !inside && words.next() == Some("console");
            inside = console && words.all(|machine| machine == std::env::consts::ARCH);
        } else if !inside {
        } else if let Some(command) = line.strip_prefix("$ plcc ") {
            let arguments = command.split_whitespace().map(str::to_owned).collect();
            found.push(Shown { line: number, arguments, output: Vec::new() });
        } else {
            found.last_mut().unwrap().output.push(line.to_owned());
        }
    }
    found
}

/// Where the lines shown first fail to match the lines printed.
fn mismatch<'a>(shown: &'a [String], printed: &[&str]) -> Option<&'a str> {
    let mut at = 0;
    let mut gap = false;
    for line in shown {
        if line == "…" {
            gap = true;
            continue;
        }
        let rest = printed.get(at..).unwrap_or_default();
        let found = rest
            .iter()
            .take(if gap { usize::MAX } else { 1 })
            .position(|printed| printed.contains(line));
        match found {
            Some(skipped) => at += skipped + 1,
            None => return Some(line),
        }
        gap = false;
    }
    (!gap && at < printed.len()).then_some("the end of the output")
}

#[test]
fn the_walkthrough_shows_what_its_commands_print() {
    let page = std::fs::read_to_string(docs().join("walkthrough.md")).unwrap();
    let commands = commands(&page);
    assert!(commands.len() >= 6, "the page's commands were not found");
    for Shown { line, arguments, output } in &commands {
        let done = Command::new(env!("CARGO_BIN_EXE_plcc"))
            .args(arguments)
            .current_dir(docs().join("walkthrough"))
            .output()
            .unwrap();
        let printed = String::from_utf8(done.stdout).unwrap();
        let errors = String::from_utf8_lossy(&done.stderr);
        assert!(done.status.success(), "line {line}: {errors}");
        let lines: Vec<&str> = printed.lines().collect();
        let missing = mismatch(output, &lines);
        assert!(missing.is_none(), "line {line}: {missing:?} is not there in\n{printed}");
    }
}

#[test]
fn a_page_that_shows_something_else_is_noticed() {
    let shown = |lines: &[&str]| lines.iter().map(|line| (*line).to_owned()).collect::<Vec<_>>();
    let printed = ["one", "two", "three"];
    assert_eq!(mismatch(&shown(&["one", "two", "three"]), &printed), None);
    assert_eq!(mismatch(&shown(&["one", "…"]), &printed), None);
    assert_eq!(mismatch(&shown(&["…", "three"]), &printed), None);
    assert_eq!(mismatch(&shown(&["one", "three"]), &printed), Some("three"));
    assert_eq!(mismatch(&shown(&["…", "two", "one"]), &printed), Some("one"));
    assert_eq!(mismatch(&shown(&["one"]), &printed), Some("the end of the output"));
}
