//! `plcc monitor` in a terminal: a pseudo-terminal, keys, signals.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, clippy::panic, clippy::indexing_slicing)]

mod support;

use std::io::Read;
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::process::{Command, Stdio};

use rustix::process::Signal;
use support::process::{Killed, wait};
use support::terminal::{self, Terminal};

fn plcc() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_plcc"));
    command.current_dir(Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap());
    command.env("XDG_STATE_HOME", std::env::temp_dir().join("plcc-monitor-state"));
    command
}

/// The monitor of the lathe.
fn lathe() -> Command {
    let mut command = plcc();
    command.args(["monitor", "examples/pmi/lathe.pmi", "--stimulus", "examples/pmi/lathe.csv"]);
    command
}

#[test]
fn the_lathe_is_shown_until_the_user_leaves() {
    let mut shown = Terminal::open(&mut lathe());
    shown.wait_for("lathe.pmi (PMI)");
    shown.wait_for("directory");
    shown.press("3");
    shown.wait_for("Outputs");
    shown.press("q");
    assert_eq!(shown.end(), (0, true));
}

/// A machine with a cylinder and a key of its own; the program has it go out as long as the key is pressed.
#[test]
fn the_simulated_machine_is_shown_and_its_keys_are_pressed() {
    let folder = std::env::temp_dir().join(format!("plcc-monitor-machine-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let program =
        "$INPUT\nPB=0/0\nOUTSW=0/1\n$OUTPUT\nSOL=1/0\n$END\nSOL=PB!SOL&/@CP103\n@CL103=OUTSW\n";
    let machine = "[simulator]\n[[simulator.axis]]\nname = \"X\"\nmin = -3\nmax = 7\n\
                   [simulator.keys]\n\"GO\" = \"PB\"\n\
                   [[simulator.device]]\nname = \"CLAMP\"\nkind = \"cylinder\"\nextend = \"SOL\"\nextended = \"OUTSW\"\nextend_ms = 60\n";
    std::fs::write(folder.join("p.pmi"), program).unwrap();
    std::fs::write(folder.join("p.machine.toml"), machine).unwrap();
    let mut command = plcc();
    command.args(["monitor"]).arg(folder.join("p.pmi")).args(["--speed", "0", "--", "--simulate"]);
    let mut shown = Terminal::open(&mut command);
    shown.wait_for("p.pmi (PMI)");
    shown.press("0");
    // Only cells that change are drawn, so that texts come in pieces where the screen before had blanks.
    shown.wait_for("CLAMP");
    // The axis stands between its limits.
    shown.wait_for("[------#-------------]");
    shown.press("p");
    shown.wait_for("KEY.GO=press");
    // The rod goes out.
    shown.wait_for("========|");
    shown.press("q");
    assert_eq!(shown.end(), (0, true));
    std::fs::remove_dir_all(&folder).unwrap();
}

/// Who names the socket of a control alone sees its statements and its past, by the record that the control says it writes.
/// Without a record there is the present only.
#[test]
fn the_own_record_of_a_control_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("a.pmi"), "$OUTPUT\nLAMP = 2/0\n$END\nLAMP = /LAMP ? it blinks\n").unwrap();
    let record =
        |name| -> &[&str] { if name == "with.sock" { &["--record", "a.plcrec"] } else { &[] } };
    let start = |socket: &'static str| {
        let mut control = plcc();
        control.args(["run", "a.pmi", "--realtime", "--socket", socket]).args(record(socket));
        let control = Killed::spawn(control.current_dir(folder.path()).stderr(Stdio::null()));
        wait("the socket", || UnixStream::connect(at(socket)).ok());
        control
    };
    let _recorded = start("with.sock");
    // The record's first part is written after a while.
    wait("ticks in the record", || {
        let why = plcc().arg("why").args([at("a.plcrec"), "LAMP".into()]).output().unwrap();
        why.status.success().then_some(())
    });
    let mut shown = Terminal::open(plcc().arg("monitor").arg(at("with.sock")));
    shown.wait_for("blinks");
    shown.press("\u{1b}[D");
    shown.wait_for("PAST");
    shown.press("q");
    assert_eq!(shown.end(), (0, true));
    let _other = start("without.sock");
    let mut shown = Terminal::open(plcc().arg("monitor").arg(at("without.sock")));
    // "there is no record of this control, so that its statements and its past are not known"
    shown.wait_for("statements");
    shown.press("q");
    assert_eq!(shown.end(), (0, true));
}

#[test]
fn a_signal_leaves_the_terminal_as_it_was() {
    let shown = Terminal::open(&mut lathe());
    shown.wait_for("lathe.pmi (PMI)");
    shown.signal(Signal::TERM);
    assert_eq!(shown.end(), (0, true));
}

#[test]
fn it_ends_when_its_terminal_is_gone() {
    // Only this end, which no child inherits, is left besides those of the monitor.
    let (mut monitor, mut terminal) = terminal::start(&mut lathe());
    let mut shown = String::new();
    let mut bytes = [0; 4096];
    while !shown.contains("lathe.pmi (PMI)") {
        let count = terminal.read(&mut bytes).unwrap();
        shown.push_str(&String::from_utf8_lossy(&bytes[..count]));
    }
    drop(terminal);
    wait("the end of the monitor without a terminal", || (!monitor.is_running()).then_some(()));
}

#[test]
fn without_a_terminal_it_says_so() {
    let output = plcc().args(["monitor", "examples/pmi/lathe.pmi"]).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    let text = String::from_utf8(output.stderr).unwrap();
    assert!(text.contains("standard output is not a terminal"), "{text}");
}
