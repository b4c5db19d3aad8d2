//! The README's commands, as a stranger types them.
#![allow(clippy::unwrap_used)]

use std::path::Path;
use std::process::Command;

const START: &str = "$ plcc ";

#[test]
fn the_main_command_shows_the_outputs_change() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let readme = std::fs::read_to_string(root.join("README.md")).unwrap();
    let command = readme.lines().find_map(|line| line.strip_prefix(START)).unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_plcc"))
        .args(command.split_whitespace())
        .current_dir(&root)
        .output()
        .unwrap();
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    for row in ["tick,name,value", "10,MCHON,1", "232,SPINON,1", "240,@FRO,105"] {
        assert!(said.lines().any(|line| line == row), "{row} is missing in\n{said}");
    }
}

#[test]
fn the_test_command_is_that_of_continuous_integration() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let readme = std::fs::read_to_string(root.join("README.md")).unwrap();
    assert!(readme.lines().any(|line| line == "scripts/test"));
    let ci = std::fs::read_to_string(root.join(".ci/run")).unwrap();
    assert!(ci.lines().any(|line| line == "scripts/test"));
}
