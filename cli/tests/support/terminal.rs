//! A program in a pseudo-terminal of 80 x 24 characters: what it draws, and keys.

use std::fs::{File, OpenOptions};
use std::io::{Read, Write};
use std::process::{Command, Stdio};
use std::sync::{Arc, Mutex};
use std::thread;

use rustix::process::{Pid, Signal, kill_process};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{Winsize, tcsetwinsize};

use super::process::{Killed, wait};

/// A program in a pseudo-terminal.
pub(crate) struct Terminal {
    process: Killed,
    /// The other end of the terminal.
    keys: File,
    /// What the program has drawn, control sequences included.
    output: Arc<Mutex<String>>,
}

/// Starts a program in a new pseudo-terminal; gives it and the terminal's other end, which no other process has.
pub(crate) fn start(command: &mut Command) -> (Killed, File) {
    let flags = OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC;
    let master = openpt(flags).unwrap();
    grantpt(&master).unwrap();
    unlockpt(&master).unwrap();
    let size = Winsize { ws_row: 24, ws_col: 80, ws_xpixel: 0, ws_ypixel: 0 };
    tcsetwinsize(&master, size).unwrap();
    let name = ptsname(&master, vec![]).unwrap().into_string().unwrap();
    let end = || OpenOptions::new().read(true).write(true).open(&name).unwrap();
    command.env("TERM", "xterm").stdin(end()).stdout(end()).stderr(Stdio::inherit());
    let process = Killed::spawn(command);
    // The command would keep its ends of the terminal open.
    command.stdin(Stdio::null()).stdout(Stdio::null());
    (process, File::from(master))
}

impl Terminal {
    /// Starts a program in a terminal.
    pub(crate) fn open(command: &mut Command) -> Self {
        let (process, keys) = start(command);
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
        Self { process, keys, output }
    }

    /// Waits until a text was drawn, at any time. Only cells that change are drawn, so a text may come in pieces.
    #[track_caller]
    pub(crate) fn wait_for(&self, text: &str) {
        wait(text, || self.output.lock().unwrap().contains(text).then_some(()));
    }

    /// Waits until a text was drawn since the last call of this function.
    #[track_caller]
    pub(crate) fn wait_for_new(&self, text: &str) {
        wait(text, || {
            let mut output = self.output.lock().unwrap();
            let found = output.contains(text);
            if found {
                output.clear();
            }
            found.then_some(())
        });
    }

    pub(crate) fn press(&mut self, keys: &str) {
        self.keys.write_all(keys.as_bytes()).unwrap();
    }

    pub(crate) fn signal(&self, signal: Signal) {
        kill_process(Pid::from_child(&self.process.0), signal).unwrap();
    }

    /// Waits for the end of the program. Gives its exit status, and whether the terminal is as it was: the other screen was
    /// left, the cursor is seen.
    pub(crate) fn end(mut self) -> (i32, bool) {
        let status = self.process.0.wait().unwrap();
        self.wait_for("\u{1b}[?1049l");
        let output = self.output.lock().unwrap();
        (status.code().unwrap_or(-1), output.contains("\u{1b}[?25h"))
    }
}
