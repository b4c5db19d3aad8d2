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

/// The program of the first wiring example.
fn motor(page: &str) -> String {
    let begin = "$INPUT\nSTART";
    let (_, rest) = page.split_once(begin).unwrap();
    format!("{begin}{}", rest.split("```").next().unwrap())
}

#[test]
fn the_motor_of_the_first_wiring_example_never_starts_by_itself() {
    let folder = std::env::temp_dir().join(format!("plcc-motor-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    // What happens in each tick; START, STOP, and whether the motor runs from then on.
    let steps = [
        ("the control has started, and no device has answered yet", 1, 1, false),
        ("the device answers", 0, 0, false),
        ("START is pressed", 1, 0, true),
        ("START is released", 0, 0, true),
        ("the cable is pulled: both have their safe values", 1, 1, false),
        ("the cable is back", 0, 0, false),
        ("START is pressed again", 1, 0, true),
        ("the cable is pulled while it is held", 1, 1, false),
        ("the cable is back, and it is still held", 1, 0, false),
        ("it is released", 0, 0, false),
        ("START is pressed anew", 1, 0, true),
        ("STOP is pressed", 1, 1, false),
        ("STOP is released while START is held", 1, 0, false),
    ];
    let rows = |(tick, (_, start, stop, _)): (usize, &(&str, u8, u8, bool))| {
        format!("{tick},START,{start}\n{tick},STOP,{stop}\n")
    };
    let stimulus: String = steps.iter().enumerate().map(rows).collect();
    std::fs::write(folder.join("steps.csv"), format!("tick,name,value\n{stimulus}")).unwrap();
    for page in ["README.md", "docs/wiring.md"] {
        let text = std::fs::read_to_string(root.join(page)).unwrap();
        std::fs::write(folder.join("motor.pmi"), motor(&text)).unwrap();
        let ticks = steps.len().to_string();
        let output = Command::new(env!("CARGO_BIN_EXE_plcc"))
            .args(["run", "motor.pmi", "--stimulus", "steps.csv", "--ticks", &ticks])
            .args(["--trace", "-", "--watch", "PORT1.0"])
            .current_dir(&folder)
            .output()
            .unwrap();
        let said = String::from_utf8(output.stdout).unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let mut runs = false;
        for (tick, (what, .., expected)) in steps.iter().enumerate() {
            for row in said.lines().filter_map(|row| row.strip_prefix(&format!("{tick},"))) {
                runs = row == "PORT1.0,1";
            }
            assert_eq!(runs, *expected, "{page}: {what}\n{said}");
        }
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn the_test_command_is_that_of_continuous_integration() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let readme = std::fs::read_to_string(root.join("README.md")).unwrap();
    assert!(readme.lines().any(|line| line == "scripts/test"));
    let ci = std::fs::read_to_string(root.join(".ci/run")).unwrap();
    assert!(ci.lines().any(|line| line == "scripts/test"));
}
