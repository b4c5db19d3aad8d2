//! Lints on the command line, in the machine file, and in `plcc explain`.

#![allow(clippy::unwrap_used, clippy::indexing_slicing)]

mod support;

use support::Folder;

/// An output that nothing assigns (`unassigned-output`), and a timer that nothing controls
/// (`control-never-assigned`, which is off).
const LAMP: &str = "$OUTPUT\nLAMP = 2/0\n$TIMER\nE/TC/DC = 5\n$END\nX = DC\n";

/// The lints of which a command shows findings, with the severities of these.
fn lints(folder: &Folder, arguments: &str, status: i32) -> Vec<(String, String)> {
    let command = format!("check a.pmi --message-format json {arguments}");
    let shown = folder.plcc(&command).exits(status).json();
    let text = |value: &serde_json::Value| value.as_str().unwrap_or("").to_owned();
    shown.iter().map(|d| (text(&d["lint"]), text(&d["severity"]))).collect()
}

fn pair(lint: &str, severity: &str) -> (String, String) {
    (lint.to_owned(), severity.to_owned())
}

#[test]
fn options_choose_which_lints_are_shown() {
    let folder = Folder::with(&[("a.pmi", LAMP)]);
    let output = pair("unassigned-output", "warning");
    let control = pair("control-never-assigned", "warning");
    assert_eq!(lints(&folder, "", 0), std::slice::from_ref(&output));
    assert_eq!(lints(&folder, "-A unassigned-output", 0), []);
    assert_eq!(lints(&folder, "-W control-never-assigned", 0), [output, control.clone()]);
    assert_eq!(lints(&folder, "-A Unassigned-Output -W control-never-assigned", 0), [control]);
    let denied = [pair("unassigned-output", "error")];
    assert_eq!(lints(&folder, "--deny warnings", 1), denied);
    assert_eq!(lints(&folder, "--deny unassigned-output", 1), denied);
}

#[test]
fn a_denied_warning_refuses_the_program() {
    let folder = Folder::with(&[("a.pmi", LAMP)]);
    folder.plcc("build a.pmi --deny warnings").exits(1).says(&["[PMI-W6]"]);
    assert!(!folder.has("a.plcx"));
    folder.plcc("build a.pmi").exits(0);
}

#[test]
fn the_machine_file_chooses_levels_and_the_command_line_wins() {
    let machine = "[lints]\nunassigned-output = \"deny\"\ncontrol-never-assigned = \"warn\"\n";
    let folder = Folder::with(&[("a.pmi", LAMP), ("a.machine.toml", machine)]);
    let control = pair("control-never-assigned", "warning");
    assert_eq!(lints(&folder, "", 1), [pair("unassigned-output", "error"), control.clone()]);
    assert_eq!(lints(&folder, "-A unassigned-output", 0), [control]);
}

#[test]
fn unknown_lints_and_levels_are_refused_with_a_similar_name() {
    let folder = Folder::with(&[
        ("a.pmi", LAMP),
        ("name.toml", "[lints]\nnear-nam = \"warn\"\n"),
        ("level.toml", "[lints]\nnear-name = \"off\"\n"),
    ]);
    folder.plcc("check a.pmi -A near-nam").exits(2).says(&["did you mean `near-name`?"]);
    let name = folder.plcc("check a.pmi --machine name.toml").exits(2);
    name.says(&["name.toml", "no lint `near-nam`", "did you mean `near-name`?"]);
    let level = folder.plcc("check a.pmi --machine level.toml").exits(2);
    level.says(&["level.toml", "near-name is \"allow\", \"warn\" or \"deny\", not \"off\""]);
}

#[test]
fn explain_has_a_page_for_each_lint() {
    let folder = Folder::with(&[]);
    for lint in plcc_diag::lints::LINTS {
        let page = folder.plcc(&format!("explain {}", lint.name)).exits(0).stdout;
        for code in lint.codes {
            assert!(page.contains(code), "{page}");
        }
        assert!(page.contains(&format!("plcc: allow {}", lint.name)), "{page}");
    }
    let list = folder.plcc("explain --search lint near-name").exits(0).stdout;
    assert!(list.starts_with("PMI-W5"), "{list}");
}
