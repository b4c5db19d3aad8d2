//! `plcc diff`: two versions of a program, as a user compares them.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing)]

mod support;

#[cfg(target_os = "linux")]
use std::io::{BufRead, BufReader, Write};
#[cfg(target_os = "linux")]
use std::os::unix::net::{UnixListener, UnixStream};
use std::process::{Command, Output, Stdio};
#[cfg(target_os = "linux")]
use std::thread;

use serde_json::Value;
use support::process::{Killed, plcrt, wait};
use support::{Folder, programs};

const OLD: &str = "$INPUT\nDOOR = 1/0\n$OUTPUT\nLAMP = 2/0\n$END\nA = DOOR\nLAMP = A\n";

fn plcc(folder: &Folder, args: &[&str]) -> Output {
    let plcc = env!("CARGO_BIN_EXE_plcc");
    Command::new(plcc).args(args).current_dir(folder.path()).output().unwrap()
}

fn text(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

#[test]
fn what_differs_is_shown_with_the_outputs_that_depend_on_it() {
    let new = OLD.replace("A = DOOR", "A = /DOOR ? closed");
    let folder = Folder::with(&[
        ("old.pmi", OLD),
        ("new.pmi", &new),
        ("same.pmi", &OLD.replace(" = ", "=")),
    ]);
    let output = plcc(&folder, &["diff", "old.pmi", "new.pmi"]);
    assert_eq!(output.status.code(), Some(1));
    assert_eq!(
        text(&output),
        "changed\n  - old.pmi:6: A = DOOR\n  + new.pmi:6: A = /DOOR\n    output LAMP depends on it by way of A\n\
         1 statement differs; what depends on them: LAMP\n"
    );
    let output = plcc(&folder, &["diff", "old.pmi", "same.pmi"]);
    assert_eq!(
        (output.status.code(), text(&output).as_str()),
        (Some(0), "both versions mean the same\n")
    );
    let output = plcc(&folder, &["diff", "old.pmi", "new.pmi", "--message-format", "json"]);
    let row: Value = serde_json::from_str(&text(&output)).unwrap();
    assert_eq!(row["change"], "changed");
    assert_eq!(
        (row["old"]["line"].as_u64(), row["new"]["text"].as_str()),
        (Some(6), Some("A = /DOOR"))
    );
    assert_eq!(
        row["affects"][1],
        serde_json::json!({"name": "LAMP", "kind": "output", "via": ["A"]})
    );
}

/// Whether a control runs what is on file: an artifact holds the text of its sources.
#[test]
fn an_artifact_is_compared_with_a_source() {
    let folder =
        Folder::with(&[("a.pmi", OLD), ("new.pmi", &OLD.replace("LAMP = A", "LAMP = DOOR"))]);
    assert!(plcc(&folder, &["build", "a.pmi"]).status.success());
    assert_eq!(plcc(&folder, &["diff", "a.plcx", "a.pmi"]).status.code(), Some(0));
    let output = plcc(&folder, &["diff", "a.plcx", "new.pmi", "--html", "out.html"]);
    assert_eq!(output.status.code(), Some(1));
    let page = std::fs::read_to_string(folder.path().join("out.html")).unwrap();
    assert!(
        page.contains("<code>LAMP = DOOR</code>") && page.contains("output <b>LAMP</b>"),
        "{page}"
    );
    // The statement differs, and the machine does not.
    let output = plcc(&folder, &["diff", "--prove", "a.plcx", "new.pmi"]);
    assert_eq!((output.status.code(), text(&output)), (Some(0), "same       LAMP\n".into()));
    folder.write("other.pmi", OLD.replace("LAMP = A", "LAMP = /A"));
    let output = plcc(&folder, &["diff", "--prove", "other.pmi", "a.plcx"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output).starts_with("different  LAMP\n"), "{output:?}");
    assert!(plcc(&folder, &["build", "a.pmi", "--no-source", "-o", "b.plcx"]).status.success());
    for options in [&["diff"] as &[&str], &["diff", "--prove"]] {
        let output = plcc(&folder, &[options, &["b.plcx", "a.pmi"]].concat());
        assert_eq!(output.status.code(), Some(2));
        let words = String::from_utf8(output.stderr).unwrap();
        assert!(words.contains("without the text of its sources"), "{words}");
    }
}

/// Whether a control runs what is on file, also after an online change: its record has the text.
#[cfg(target_os = "linux")]
#[test]
fn what_a_control_runs_is_compared_with_a_source() {
    let new = OLD.replace("LAMP = A", "LAMP = DOOR");
    let folder = Folder::with(&[("a.pmi", OLD), ("new.pmi", &new)]);
    assert!(plcc(&folder, &["build", "a.pmi"]).status.success());
    assert!(plcc(&folder, &["build", "new.pmi"]).status.success());
    let control = |socket: &str, options: &[&str]| {
        let mut command = Command::new(plcrt());
        command.args(["a.plcx", "--realtime", "--no-supervisor", "--overrun", "catch-up=1000000"]);
        command.args(["--watchdog", "1h", "--allow", "swap", "--socket", socket]);
        command.args(options).current_dir(folder.path()).stderr(Stdio::null());
        let control = Killed::spawn(&mut command);
        let connect = || UnixStream::connect(folder.path().join(socket)).ok();
        wait("the control's socket", connect);
        control
    };
    let _control = control("socket", &["--record", "a.plcrec"]);
    assert_eq!(plcc(&folder, &["diff", "socket", "a.pmi"]).status.code(), Some(0));
    let output = plcc(&folder, &["diff", "socket", "new.pmi"]);
    assert_eq!(
        (output.status.code(), text(&output).lines().nth(2)),
        (Some(1), Some("  + new.pmi:7: LAMP = DOOR")),
        "{output:?}"
    );
    folder.write("other.pmi", OLD.replace("LAMP = A", "LAMP = /A"));
    let output = plcc(&folder, &["diff", "--prove", "socket", "other.pmi"]);
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    let mut change = Command::new(programs().join("plcctl"));
    change.args(["socket", "swap", "new.plcx"]).current_dir(folder.path());
    assert!(change.output().unwrap().status.success());
    assert_eq!(plcc(&folder, &["diff", "socket", "new.pmi"]).status.code(), Some(0));
    assert_eq!(plcc(&folder, &["diff", "--prove", "socket", "new.pmi"]).status.code(), Some(0));

    assert_eq!(plcc(&folder, &["diff", "a.plcrec", "new.pmi"]).status.code(), Some(0));

    let without_text = ["build", "a.pmi", "--no-source", "-o", "a.plcx"];
    assert!(plcc(&folder, &without_text).status.success());
    let _without_text = control("third", &["--record", "third.plcrec"]);
    let output = plcc(&folder, &["diff", "third", "a.pmi"]);
    let words = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{words}");
    assert!(words.contains("without the text of its sources"), "{words}");

    let _without = control("other", &[]);
    let output = plcc(&folder, &["diff", "other", "a.pmi"]);
    let words = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{words}");
    assert!(words.contains("keeps no record") && words.contains("a.pmi, is not known"), "{words}");
}

/// Where the path that a control gives for its record has another one, as between two containers, that is not taken for
/// what the control runs.
#[cfg(target_os = "linux")]
#[test]
fn the_record_of_another_control_is_refused() {
    let folder = Folder::with(&[("a.pmi", OLD)]);
    let run = ["run", "a.pmi", "--ticks", "10", "--record", "a.plcrec"];
    assert!(plcc(&folder, &run).status.success());
    let record = folder.path().join("a.plcrec");
    let listener = UnixListener::bind(folder.path().join("socket")).unwrap();
    thread::spawn(move || {
        for stream in listener.incoming() {
            let mut stream = BufReader::new(stream.unwrap());
            stream.read_line(&mut String::new()).unwrap();
            let status = serde_json::json!({"fingerprint": "0", "record": record});
            let answer = serde_json::json!({"ok": true, "result": status});
            writeln!(stream.get_mut(), "{answer}").unwrap();
        }
    });
    let output = plcc(&folder, &["diff", "socket", "a.pmi"]);
    let words = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{words}");
    assert!(words.contains("a.plcrec: ") && words.contains("is not of this control"), "{words}");
}

#[test]
fn a_version_with_errors_is_not_compared() {
    let folder =
        Folder::with(&[("a.pmi", OLD), ("b.pmi", "$END\nA = \n"), ("c.nct", ":001 J1\n:000 J0\n")]);
    let output = plcc(&folder, &["diff", "a.pmi", "b.pmi"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(String::from_utf8(output.stderr).unwrap().contains("nothing is compared"));
    assert_eq!(plcc(&folder, &["diff", "a.pmi", "c.nct"]).status.code(), Some(2));
    assert_eq!(plcc(&folder, &["diff", "a.pmi", "none.pmi"]).status.code(), Some(2));
}
