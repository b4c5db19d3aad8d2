//! `plcc monitor` in a terminal: a pseudo-terminal, keys, signals.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, clippy::panic, clippy::indexing_slicing)]

use std::fs::{File, OpenOptions};
use std::io::{Read, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{Winsize, tcsetwinsize};

fn plcc() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_plcc"));
    command.current_dir(Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap());
    command.env("XDG_STATE_HOME", std::env::temp_dir().join("plcc-monitor-state"));
    command.env("TERM", "xterm");
    command
}

/// The monitor of the lathe in a pseudo-terminal of 80 x 24.
struct Shown {
    child: Child,
    keys: File,
    output: Arc<Mutex<String>>,
}

impl Shown {
    fn new() -> Self {
        let master =
            openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC).unwrap();
        grantpt(&master).unwrap();
        unlockpt(&master).unwrap();
        let size = Winsize { ws_row: 24, ws_col: 80, ws_xpixel: 0, ws_ypixel: 0 };
        tcsetwinsize(&master, size).unwrap();
        let name = ptsname(&master, vec![]).unwrap().into_string().unwrap();
        let end = || OpenOptions::new().read(true).write(true).open(&name).unwrap();
        let mut command = plcc();
        command.args(["monitor", "examples/pmi/lathe.pmi", "--stimulus", "examples/pmi/lathe.csv"]);
        let child = command.stdin(end()).stdout(end()).stderr(Stdio::inherit()).spawn().unwrap();
        let keys = File::from(master);
        let mut reader = keys.try_clone().unwrap();
        let output = Arc::new(Mutex::new(String::new()));
        let into = Arc::clone(&output);
        thread::spawn(move || {
            let mut bytes = [0; 4096];
            // The read fails when the last one who has the other end has closed it.
            while let Ok(count @ 1..) = reader.read(&mut bytes) {
                into.lock().unwrap().push_str(&String::from_utf8_lossy(&bytes[..count]));
            }
        });
        Self { child, keys, output }
    }

    fn wait_for(&self, text: &str) {
        let begun = Instant::now();
        while !self.output.lock().unwrap().contains(text) {
            let shown = self.output.lock().unwrap().clone();
            assert!(begun.elapsed() < Duration::from_secs(600), "no `{text}` in {shown:?}");
            thread::sleep(Duration::from_millis(20));
        }
    }

    /// Waits for the end; whether the terminal is as it was: the other screen was left, the cursor is seen.
    fn end(mut self) -> (i32, bool) {
        let status = self.child.wait().unwrap();
        self.wait_for("\u{1b}[?1049l");
        let output = self.output.lock().unwrap();
        (status.code().unwrap_or(-1), output.contains("\u{1b}[?25h"))
    }
}

#[test]
fn the_lathe_is_shown_until_the_user_leaves() {
    let mut shown = Shown::new();
    shown.wait_for("lathe.pmi (PMI)");
    shown.wait_for("directory");
    shown.keys.write_all(b"3").unwrap();
    shown.wait_for("Outputs");
    shown.keys.write_all(b"q").unwrap();
    assert_eq!(shown.end(), (0, true));
}

#[test]
fn a_signal_leaves_the_terminal_as_it_was() {
    let shown = Shown::new();
    shown.wait_for("lathe.pmi (PMI)");
    kill_process(Pid::from_child(&shown.child), Signal::TERM).unwrap();
    assert_eq!(shown.end(), (0, true));
}

#[test]
fn it_ends_when_its_terminal_is_gone() {
    let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC).unwrap();
    grantpt(&master).unwrap();
    unlockpt(&master).unwrap();
    tcsetwinsize(&master, Winsize { ws_row: 24, ws_col: 80, ws_xpixel: 0, ws_ypixel: 0 }).unwrap();
    let name = ptsname(&master, vec![]).unwrap().into_string().unwrap();
    let end = || OpenOptions::new().read(true).write(true).open(&name).unwrap();
    let mut command = plcc();
    command.args(["monitor", "examples/pmi/lathe.pmi", "--stimulus", "examples/pmi/lathe.csv"]);
    let mut child = command.stdin(end()).stdout(end()).stderr(Stdio::null()).spawn().unwrap();
    // Only this end, which no child inherits, is left besides those of the monitor.
    drop(command);
    let mut terminal = File::from(master);
    let mut shown = String::new();
    let mut bytes = [0; 4096];
    while !shown.contains("lathe.pmi (PMI)") {
        let count = terminal.read(&mut bytes).unwrap();
        shown.push_str(&String::from_utf8_lossy(&bytes[..count]));
    }
    drop(terminal);
    let begun = Instant::now();
    while child.try_wait().unwrap().is_none() {
        if begun.elapsed() > Duration::from_secs(600) {
            child.kill().unwrap();
            panic!("the monitor still runs without a terminal");
        }
        thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn without_a_terminal_it_says_so() {
    let output = plcc().args(["monitor", "examples/pmi/lathe.pmi"]).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    let text = String::from_utf8(output.stderr).unwrap();
    assert!(text.contains("standard output is no terminal"), "{text}");
}
