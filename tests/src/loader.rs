//! Runs `plcrt`, the loader, as a process, in a folder of its own: for tests of what happens around a
//! program, such as signals, full disks and second processes.
//!
//! ```no_run
//! use plcc_abi::Dialect;
//! use plcc_tests::loader::Folder;
//!
//! let folder = Folder::new("example");
//! folder.artifact("count.plcx", Dialect::Nct, ":001\nLF500 +1 SF500\nJ1\n:000\nJ0\n");
//! let output = folder.run(&["count.plcx", "--ticks", "3", "--watch", "F500"]);
//! assert_eq!(output.status.code(), Some(0));
//! ```
#![allow(clippy::unwrap_used, clippy::panic)]

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::PathBuf;
use std::process::{Child, ChildStderr, Command, ExitStatus, Output, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::{Duration, Instant};

use plcc::compile;
use plcc::disk::Disk;
use plcc_abi::Dialect;
use plcc_codegen::{OptLevel, Target};
use plcc_diag::SourceMap;
use plcc_frontend::common::{Machine, Options};

use crate::programs::program;

/// How long a test waits for something that happens soon, on a machine that does much else.
const PATIENCE: Duration = Duration::from_secs(600);

/// A command that starts `plcrt`, which is built once from the sources under test.
///
/// # Panics
/// When it can't be built.
pub fn plcrt() -> Command {
    Command::new(program("plcrt"))
}

/// A command that starts `plcc`, which is built once from the sources under test.
///
/// # Panics
/// When it can't be built.
pub fn plcc() -> Command {
    Command::new(program("plcc"))
}

/// A command that starts `plcio`, which is built once from the sources under test.
///
/// # Panics
/// When it can't be built.
pub fn plcio() -> Command {
    Command::new(program("plcio"))
}

/// A folder for one test, which goes away with it.
pub struct Folder(PathBuf);

impl Folder {
    /// An empty folder. The name is for people, and no other test has it.
    ///
    /// # Panics
    /// When it can't be created.
    pub fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("plcrt-{name}-{}", std::process::id()));
        fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    /// The path of a file in it.
    pub fn path(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    /// The text of a file in it.
    ///
    /// # Panics
    /// When it can't be read.
    pub fn read(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).unwrap()
    }

    /// The names of all files in it, sorted.
    ///
    /// # Panics
    /// When the folder can't be read.
    pub fn names(&self) -> Vec<String> {
        let entries = fs::read_dir(&self.0).unwrap();
        let names = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap());
        let mut names: Vec<String> = names.collect();
        names.sort();
        names
    }

    /// Compiles a program to an artifact.
    ///
    /// # Panics
    /// When the program has errors or the artifact can't be written.
    pub fn artifact(&self, name: &str, dialect: Dialect, text: &str) {
        self.artifact_of(name, dialect, text, "");
    }

    /// The same for a machine with this machine file.
    ///
    /// # Panics
    /// When the program or the machine file has errors, or the artifact can't be written.
    pub fn artifact_of(&self, name: &str, dialect: Dialect, text: &str, machine: &str) {
        let mut sources = SourceMap::new();
        let file = sources.add(name, text.as_bytes());
        let machine = Machine::parse(machine).unwrap();
        let options = Options { machine, ..Options::default() };
        let (checked, found) = compile::check(&mut sources, &[file], dialect, &Disk, &options);
        let lowered = checked.unwrap_or_else(|| panic!("{found:?}")).optimized(OptLevel::Speed);
        let lowered = lowered.unwrap();
        let code = compile::code(&lowered, &Target::host_baseline().unwrap()).unwrap();
        let bytes = compile::artifact(&lowered.program, &code).unwrap();
        fs::write(self.path(name), bytes).unwrap();
    }

    /// `plcrt` with these arguments, in this folder.
    pub fn command(&self, args: &[&str]) -> Command {
        let mut command = plcrt();
        command.args(args).current_dir(&self.0);
        command
    }

    /// Runs `plcrt` to its end.
    ///
    /// # Panics
    /// When it can't be started.
    pub fn run(&self, args: &[&str]) -> Output {
        self.command(args).stdin(Stdio::null()).output().unwrap()
    }

    /// Starts `plcrt`.
    ///
    /// # Panics
    /// When it can't be started.
    pub fn start(&self, args: &[&str]) -> Running {
        Running::start(&mut self.command(args))
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// A process that runs. It is killed when the test ends.
pub struct Running {
    child: Child,
    messages: Receiver<String>,
    seen: Vec<String>,
}

impl Running {
    /// Starts a process whose standard error is read.
    ///
    /// # Panics
    /// When it can't be started.
    pub fn start(command: &mut Command) -> Self {
        let command = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
        let mut child = command.spawn().unwrap();
        let errors: ChildStderr = child.stderr.take().unwrap();
        let (send, messages) = channel();
        thread::spawn(move || {
            for line in BufReader::new(errors).lines().map_while(Result::ok) {
                let _ = send.send(line);
            }
        });
        Self { child, messages, seen: vec![] }
    }

    /// Its number.
    pub fn id(&self) -> String {
        self.child.id().to_string()
    }

    /// Waits for a line on standard error that contains a text, and gives it.
    ///
    /// # Panics
    /// When no such line comes.
    pub fn says(&mut self, text: &str) -> String {
        let end = Instant::now() + PATIENCE;
        while let Ok(line) = self.messages.recv_timeout(end - Instant::now().min(end)) {
            self.seen.push(line.clone());
            if line.contains(text) {
                return line;
            }
        }
        panic!("`{text}` is not said:\n{}", self.seen.join("\n"));
    }

    /// Sends a signal, by its name without `SIG`, once or several times without a pause.
    ///
    /// # Panics
    /// When it can't be sent.
    pub fn signal(&self, name: &str, times: usize) {
        let one = format!("kill -{name} {};", self.id());
        assert!(Command::new("sh").args(["-c", &one.repeat(times)]).status().unwrap().success());
    }

    /// Waits for its end.
    ///
    /// # Panics
    /// When it does not end.
    pub fn end(&mut self) -> ExitStatus {
        let start = Instant::now();
        loop {
            if let Some(status) = self.child.try_wait().unwrap() {
                return status;
            }
            assert!(start.elapsed() < PATIENCE, "it does not end:\n{}", self.seen.join("\n"));
            thread::sleep(Duration::from_millis(5));
        }
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Waits until something is the case.
///
/// # Panics
/// When it does not come.
pub fn wait_until(what: &str, mut is_so: impl FnMut() -> bool) {
    let start = Instant::now();
    while !is_so() {
        assert!(start.elapsed() < PATIENCE, "{what}: it does not come");
        thread::sleep(Duration::from_millis(10));
    }
}
