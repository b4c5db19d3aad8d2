//! `plcc lsp` with Neovim's client: a problem is shown and mended, names are explained, found, renamed and completed.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::process::Command;

#[path = "../../tests/src/tools.rs"]
mod tools;

const SOURCE: &str = "$INPUT
DOOR = 1/0 ? the door is closed
START = 1/1
$OUTPUT
MOTOR = 2/0
$END
IF (STRAT)
MOTOR = DOOR & START
ENDIF
";

/// What Neovim shows, a line each.
const SHOWN: &str = "problem 7 5 nothing is named STRAT did you mean START?
action Write START
no problem IF (START)
hover **DOOR**
definition 2
reference 2
reference 8
renamed GUARD = 1/0 ? the door is closed
renamed MOTOR = GUARD & START
completion GUARD
formatted   MOTOR = GUARD & START
symbol GUARD
symbol START
symbol MOTOR
ended
";

#[test]
fn neovim_works_with_the_server() {
    if !tools::is_there("nvim") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let (source, report) = (folder.path().join("door.pmi"), folder.path().join("report"));
    std::fs::write(&source, SOURCE).unwrap();
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/neovim/session.lua");
    let done = Command::new("nvim")
        .args([
            "--headless",
            "-u",
            "NONE",
            "-i",
            "NONE",
            "-c",
            &format!("luafile {script}"),
            "-c",
            "qa!",
        ])
        .env("PLCC", env!("CARGO_BIN_EXE_plcc"))
        .env("SOURCE", &source)
        .env("REPORT", &report)
        // Nothing of the user's own settings.
        .env("HOME", folder.path())
        .output()
        .unwrap();
    let shown = std::fs::read_to_string(&report).unwrap_or_default();
    assert_eq!(shown, SHOWN, "{}", String::from_utf8_lossy(&done.stderr));
}
