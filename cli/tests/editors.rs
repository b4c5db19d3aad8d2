//! `plcc lsp` with the clients of real editors: a problem is shown and mended, names are explained, found, renamed and completed.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::path::{Path, PathBuf};
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

/// What both editors show, a line each, after the problem.
const SHOWN: &str = "action Write START
no problem IF (START)
hover **DOOR**
definition 2
reference 2
reference 8
renamed GUARD = 1/0 ? the door is closed
renamed MOTOR = GUARD & START
completion GUARD
";

/// And at the end.
const SYMBOLS: &str = "symbol GUARD
symbol START
symbol MOTOR
ended
";

/// What an editor's script of `cli/tests/editors/` notes while it works on the program in a folder.
fn session(folder: &Path, editor: &mut Command) -> (String, String) {
    let (source, report) = (folder.join("door.pmi"), folder.join("report"));
    std::fs::write(&source, SOURCE).unwrap();
    editor.env("PLCC", env!("CARGO_BIN_EXE_plcc")).env("SOURCE", &source).env("REPORT", &report);
    // Nothing of the user's own settings.
    let done = editor.env("HOME", folder).output().unwrap();
    let shown = std::fs::read_to_string(&report).unwrap_or_default();
    (shown, String::from_utf8_lossy(&done.stderr).into_owned())
}

fn script(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/editors").join(name)
}

#[test]
fn neovim_works_with_the_server() {
    if !tools::is_there("nvim") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let load = format!("luafile {}", script("neovim.lua").display());
    let mut editor = Command::new("nvim");
    editor.args(["--headless", "-u", "NONE", "-i", "NONE", "-c", &load, "-c", "qa!"]);
    let (shown, said) = session(folder.path(), &mut editor);
    let problem = "problem 7 5 nothing is named STRAT did you mean START?\n";
    let expected = format!("{problem}{SHOWN}formatted   MOTOR = GUARD & START\n{SYMBOLS}");
    assert_eq!(shown, expected, "{said}");
}

/// The settings that docs/editors.md gives for Emacs.
fn settings_for_emacs() -> String {
    let page = include_str!("../../docs/editors.md");
    let (_, settings) = page.split_once("```lisp\n").expect("settings for Emacs");
    settings.split_once("```").expect("their end").0.to_owned()
}

#[test]
fn emacs_works_with_the_server() {
    if !tools::is_there("emacs") {
        return;
    }
    let eglot = ["--batch", "-f", "package-initialize", "--eval", "(require 'eglot)"];
    if !Command::new("emacs").args(eglot).output().unwrap().status.success() {
        tools::missing("emacs", "has no Eglot");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let recipe = folder.path().join("recipe.el");
    std::fs::write(&recipe, settings_for_emacs()).unwrap();
    let mut editor = Command::new("emacs");
    editor.args(["--batch", "-l"]).arg(script("emacs.el")).env("RECIPE", recipe);
    let (shown, said) = session(folder.path(), &mut editor);
    let start =
        "mode pmi-mode\nproblem 7 plcc [PMI-31]: nothing is named STRAT\ndid you mean START?\n";
    let expected = format!("{start}{SHOWN}formatted \tMOTOR = GUARD & START\n{SYMBOLS}");
    assert_eq!(shown, expected, "{said}");
}
