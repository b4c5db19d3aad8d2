//! Files that are not regular files, includes that lead elsewhere, and texts that a terminal would obey.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used)]

mod support;

use std::fs;
use std::os::unix::fs::symlink;
use std::process::Command;

use support::{COUNTER, Folder};

/// None of these may hang: nobody writes to the FIFO, and `/dev/zero` has no end.
#[test]
fn devices_and_pipes_are_refused_as_inputs() {
    let folder = Folder::with(&[("a.pmi", COUNTER), ("b.plc", ":001\nJ1\n:000\nJ0\n")]);
    assert!(Command::new("mkfifo").arg(folder.path().join("fifo")).status().unwrap().success());
    for special in ["fifo", "/dev/zero", "/dev/null"] {
        for line in [
            format!("check {special} --dialect pmi"),
            format!("build {special} --dialect pmi"),
            format!("run {special} --dialect pmi --ticks 1"),
            format!("run a.pmi --ticks 1 --stimulus {special}"),
            format!("run a.pmi --ticks 1 --retain {special}"),
            format!("run b.plc --ticks 1 --machine {special}"),
            format!("build a.pmi --sign {special}"),
        ] {
            let done = folder.plcc(&line).exits(2);
            assert!(done.stderr.contains(special), "{line}: {}", done.stderr);
            assert!(done.stderr.contains("regular file"), "{line}: {}", done.stderr);
        }
        folder.write("i.pmi", format!("$INCLUDE {special}\n$END\n"));
        folder.plcc("check i.pmi").exits(1).says(&["PMI-8"]);
    }
    folder.plcc("run a.pmi --ticks 1 --dump fifo").exits(2).says(&["nobody reads"]);
    folder.plcc("run a.pmi --ticks 1 --watch N --trace fifo").exits(2).says(&["nobody reads"]);
    folder.plcc("run a.pmi --ticks 1 --events fifo").exits(2).says(&["nobody reads"]);
    folder.plcc("run a.pmi --ticks 1 --log fifo").exits(2).says(&["nobody reads"]);
    // Had anything waited for somebody at the other side, this test would not end.
}

#[test]
fn a_source_cannot_have_other_files_shown() {
    let folder = Folder::with(&[
        ("secret", "SECRET:1\n"),
        ("inner/b.pmi", "$END\n"),
        ("inner/lib/in.pmc", "P1=1\n"),
    ]);
    let secret = fs::canonicalize(folder.path().join("secret")).unwrap();
    let inner = folder.path().join("inner");
    symlink("../secret", inner.join("link")).unwrap();
    let names = [secret.to_str().unwrap(), "../secret", "lib/../../secret", "link"];
    for name in names {
        folder.write("inner/a.pmc", format!("#include \"{name}\"\n"));
        folder.write("inner/a.pmi", format!("$INCLUDE {name}\n$END\n"));
        for source in ["a.pmc", "a.pmi"] {
            let mut plcc = Command::new(env!("CARGO_BIN_EXE_plcc"));
            let output = plcc.args(["check", source]).current_dir(&inner).output().unwrap();
            let errors = String::from_utf8(output.stderr).unwrap();
            assert_eq!(output.status.code(), Some(1), "{source}: {name}");
            assert!(!errors.contains("SECRET"), "{source}: {name}\n{errors}");
        }
    }
    // What is looked up by its trailing part, in a folder given with -I, or below the current folder.
    for (line, status) in [
        ("#include \"/oem/lib/in.pmc\"", 0),
        ("#include \"c:\\oem\\lib\\in.pmc\"", 0),
        ("#include \"lib/../lib/in.pmc\"", 0),
    ] {
        folder.write("inner/a.pmc", format!("{line}\n"));
        folder.plcc("check inner/a.pmc").exits(status);
    }
    folder.write("above.pmc", "P1=1\n");
    folder.write("inner/a.pmc", "#include \"../above.pmc\"\n");
    folder.plcc("check inner/a.pmc").exits(0);
    let check = |more: &[&str]| {
        let mut plcc = Command::new(env!("CARGO_BIN_EXE_plcc"));
        let done = plcc.arg("check").args(more).arg("a.pmc").current_dir(&inner).output();
        done.unwrap().status.code()
    };
    assert_eq!(check(&[]), Some(1), "it lies above the current folder");
    assert_eq!(check(&["-I", ".."]), Some(0));
}

#[test]
fn nothing_that_a_terminal_obeys_is_printed() {
    let folder = Folder::with(&[
        ("a.pmi", "$END\nA = \u{1b}[2J\u{7}B\u{202e}\n"),
        ("b.pmc", "I5=2\nOPEN PLC 1 CLEAR\nP1=\u{1b}]0;title\u{7}\u{9b}1m\nCLOSE\n"),
        ("m.toml", "\u{1b} = 1\n"),
    ]);
    for (line, status) in [
        ("check a.pmi", 1),
        ("check b.pmc", 1),
        ("check \u{1b}[2J.pmi", 2),
        ("check a.pmi --machine m.toml", 2),
    ] {
        let done = folder.plcc(line).exits(status);
        let obeyed = |c: char| c.is_control() && c != '\n' && c != '\t';
        assert!(!done.stderr.contains(obeyed), "{line}: {:?}", done.stderr);
        assert!(!done.stderr.contains('\u{202e}'), "{line}: {:?}", done.stderr);
    }
}
