//! Runs the binary in a folder of its own. `process` has processes that end with their test, `terminal` a pseudo-terminal,
//! `browser` a browser of the monitor's page, `debug_client` an editor that debugs.

// Not every test uses all of it.
#![allow(
    dead_code,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::indexing_slicing
)]

pub(crate) mod browser;
pub(crate) mod debug_client;
pub(crate) mod process;
#[path = "../../../tests/src/programs.rs"]
mod programs;
#[cfg(target_os = "linux")]
pub(crate) mod terminal;

use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

/// Counts, with an output; B is broken off by an index that leaves its array in tick 3.
pub(crate) const COUNTER: &str = "$OUTPUT\nOUT=1/0\n$INTEGER\nN\n$END\nN=N+1\nOUT=N>3\n";
/// Is stopped in tick 3.
pub(crate) const STOPS: &str = "$INTEGER\nN,A[3]\n$END\nA[N]=1\nN=N+1\n";
/// Two errors, in lines 4 and 5.
pub(crate) const BROKEN: &str = "$INTEGER\nN\n$END\nN=M\nN=1.5\n";
/// A PMAC program that counts.
pub(crate) const PLC1: &str = "I5=2\nOPEN PLC 1 CLEAR\nP1=P1+1\nCLOSE\n";
/// An NCT program that counts.
pub(crate) const SLICES: &str = ":000\nJ0\n:001\nLF020\n+1\nSF020\nJ1\n";

/// A folder that goes away with the test.
pub(crate) struct Folder(tempfile::TempDir);

/// What a command did.
pub(crate) struct Done {
    pub(crate) status: i32,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

impl Folder {
    /// With these files in it.
    pub(crate) fn with(files: &[(&str, &str)]) -> Self {
        let folder = Self(tempfile::tempdir().unwrap());
        for (name, text) in files {
            folder.write(name, text);
        }
        folder
    }

    pub(crate) fn path(&self) -> &Path {
        self.0.path()
    }

    /// Writes a file, its folder too.
    pub(crate) fn write(&self, name: impl AsRef<Path>, bytes: impl AsRef<[u8]>) -> PathBuf {
        let path = self.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(&path, bytes).unwrap();
        path
    }

    pub(crate) fn read(&self, name: &str) -> String {
        fs::read_to_string(self.path().join(name)).unwrap()
    }

    pub(crate) fn has(&self, name: &str) -> bool {
        self.path().join(name).exists()
    }

    /// The command, to be changed before it is run.
    pub(crate) fn command<A: AsRef<OsStr>>(&self, args: &[A]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_plcc"));
        command.args(args).current_dir(self.path()).env_remove("NO_COLOR").stdin(Stdio::null());
        command
    }

    /// Runs `plcc` with the words of a line.
    pub(crate) fn plcc(&self, line: &str) -> Done {
        self.run(&line.split_whitespace().collect::<Vec<_>>())
    }

    /// Runs `plcc`.
    pub(crate) fn run<A: AsRef<OsStr>>(&self, args: &[A]) -> Done {
        Done::of(self.command(args).output().unwrap())
    }
}

impl Folder {
    /// Runs `plcc` with a text on its standard input.
    pub(crate) fn run_with<A: AsRef<OsStr>>(&self, args: &[A], text: &str) -> Done {
        let input = self.write("standard-input", text);
        let mut command = self.command(args);
        Done::of(command.stdin(fs::File::open(input).unwrap()).output().unwrap())
    }
}

impl Done {
    pub(crate) fn of(output: Output) -> Self {
        let text = |bytes: Vec<u8>| String::from_utf8_lossy(&bytes).into_owned();
        let status = output.status.code().unwrap_or(-1);
        let done = Self { status, stdout: text(output.stdout), stderr: text(output.stderr) };
        assert!(!done.stderr.contains("panicked"), "{}", done.stderr);
        done
    }

    /// Says that it ended so, or shows everything.
    #[track_caller]
    pub(crate) fn exits(self, status: i32) -> Self {
        let Self { status: is, stdout, stderr } = &self;
        assert_eq!(*is, status, "\n--- stdout\n{stdout}\n--- stderr\n{stderr}");
        self
    }

    /// Says that standard error has these parts.
    #[track_caller]
    pub(crate) fn says(self, parts: &[&str]) -> Self {
        for part in parts {
            assert!(self.stderr.contains(part), "`{part}` is not in\n{}", self.stderr);
        }
        self
    }

    /// Standard output's lines as JSON.
    pub(crate) fn json(&self) -> Vec<serde_json::Value> {
        self.stdout.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
    }
}

/// A folder in which `plcc`, `plcrt`, `plcctl` and `plcio` lie, made from the sources under test.
pub(crate) fn programs() -> &'static Path {
    programs::folder_of_programs()
}
