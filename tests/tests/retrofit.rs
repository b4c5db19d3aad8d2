//! The example `examples/retrofit`: the machine, its control, the wiring and the panel, by its own script.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, clippy::panic)]

use std::path::Path;
use std::process::Command;

use plcc_tests::loader::{plcc, plcio, plcrt};

#[test]
fn the_example_of_a_retrofit_runs() {
    let folders: Vec<_> = [plcc(), plcrt(), plcio()]
        .iter()
        .map(|program| Path::new(program.get_program()).parent().unwrap().to_owned())
        .chain(std::env::split_paths(&std::env::var_os("PATH").unwrap()))
        .collect();
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/retrofit/start");
    let path = std::env::join_paths(folders).unwrap();
    let output = Command::new(example).env("PATH", path).output().unwrap();
    let (text, errors) =
        (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert_eq!(output.status.code(), Some(0), "{text}{errors}");
    for line in ["to the left: moving 001", "at the left end: moving 000", "spindle: moving 100"] {
        assert!(text.contains(line), "{text}{errors}");
    }
}
