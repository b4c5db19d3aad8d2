//! The example `examples/retrofit`: the machine, its control, the wiring and the panel, by its own script.
//!
//! `plcio` is built without OPC UA here, so that the panel speaks Modbus; `tests/peers/run retrofit` runs the
//! example with all of its parts.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, clippy::panic)]

use std::path::Path;
use std::process::Command;

use plcc_tests::loader::{plcc, plcio, plcrt};

/// What the operator at the panel says when everything has gone right.
const STEPS: [&str; 7] = [
    "to the left: lamps 0001",
    "at the left end: lamps 0000",
    "to the right: lamps 0010",
    "at the right end: lamps 0000",
    "spindle on: lamps 0100",
    "spindle at speed: lamps 1100",
    "both buttons: lamps 0000",
];

/// Runs the example to its end: the exit status, what the panel has said, and the words of the script.
fn start(options: &[&str]) -> (Option<i32>, String, String) {
    let folders: Vec<_> = [plcc(), plcrt(), plcio()]
        .iter()
        .map(|program| Path::new(program.get_program()).parent().unwrap().to_owned())
        .chain(std::env::split_paths(&std::env::var_os("PATH").unwrap()))
        .collect();
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/retrofit/start");
    let path = std::env::join_paths(folders).unwrap();
    let output = Command::new(example).args(options).env("PATH", path).output().unwrap();
    let text = |bytes| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code(), text(&output.stdout), text(&output.stderr))
}

fn assert_steps(options: &[&str]) {
    let (status, text, errors) = start(options);
    assert_eq!(status, Some(0), "{text}{errors}");
    let mut lines = text.lines();
    for step in STEPS {
        assert!(lines.any(|line| line.starts_with(step)), "{step}: {text}{errors}");
    }
}

#[test]
fn the_example_of_a_retrofit_runs() {
    // The example has ports of its own, so that one run follows the other.
    assert_steps(&["--without-opcua", "--without-hal"]);
    let (status, _, words) = start(&["--all"]);
    assert_eq!(status, Some(2), "{words}");
    assert!(words.contains("so this runs as with --without-opcua"), "{words}");
    // With what is installed; with nothing of both it is the first run again.
    let (_, configuration, _) = start(&["--configuration"]);
    if configuration.contains("\ndriver = \"hal\"") {
        assert_steps(&[]);
    }
}
