//! Files that a run writes.

use std::fs::{self, File};
use std::io::{self, BufWriter, Stdout, Write};
use std::path::{Path, PathBuf};

use plcc_abi::Program;

use crate::args::RunArgs;
use crate::retain;
use plcc_files::{
    FileIdentity, can_replace, open_output, replace, resolve_links, temporary_of, why_not_written,
};

use crate::exit_status::SessionError;
use crate::output_file::{is_stdout, not_written, standard_output};

/// What [`RunArgs::reads`] holds, for messages.
const READ_FILES: &str = "the machine file, the artifact or the configuration";

/// A file that grows during the run, or standard output for `-`.
#[derive(Debug)]
pub(super) struct Output {
    to: BufWriter<Sink>,
}

#[derive(Debug)]
enum Sink {
    File(File),
    Stdout(Stdout),
}

impl Output {
    /// Creates the file, empty.
    pub(super) fn create(path: &Path) -> Result<Self, SessionError> {
        let sink = if is_stdout(path) {
            Sink::Stdout(io::stdout())
        } else {
            Sink::File(open_output(path, false).map_err(|error| not_written(path, &error))?)
        };
        Ok(Self { to: BufWriter::with_capacity(1 << 16, sink) })
    }
}

impl Write for Output {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.to.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.to.flush()
    }
}

impl Write for Sink {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match self {
            Self::File(file) => file.write(bytes),
            Self::Stdout(stdout) => stdout.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match self {
            Self::File(file) => file.flush(),
            Self::Stdout(stdout) => stdout.flush(),
        }
    }
}

/// Writes a file as a whole, or standard output for `-`. The file holds either its old contents or
/// the new ones afterwards. What is not an ordinary file (a pipe, a terminal) is written directly.
///
/// # Errors
/// When it can't be written; the message names the file.
pub fn write_whole(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let name = |error: io::Error| {
        let why = why_not_written(&error);
        io::Error::new(error.kind(), format!("{}: {why}", path.display()))
    };
    if is_stdout(path) {
        return standard_output().and_then(|mut stdout| stdout.write_all(bytes));
    }
    match fs::metadata(path) {
        Ok(about) if !about.is_file() => {
            open_output(path, false).and_then(|mut file| file.write_all(bytes)).map_err(name)
        }
        _ => replace(path, bytes).map_err(name),
    }
}

/// Checks before the first tick that a file that is written after the last one can be written. A FIFO
/// is opened, so that its reader waits until the file that is returned is closed.
pub(super) fn check_writable(path: &Path) -> Result<Option<File>, SessionError> {
    // A FIFO, a socket or a device.
    let is_special = fs::metadata(path).is_ok_and(|about| !about.is_file() && !about.is_dir());
    let checked = if is_stdout(path) {
        Ok(None)
    } else if is_special {
        open_output(path, false).map(Some)
    } else {
        can_replace(path).map(|()| None)
    };
    checked.map_err(|error| not_written(path, &error))
}

/// Checks before the first tick that the retained file can be written.
pub(super) fn check_retained(path: &Path) -> Result<(), SessionError> {
    retain::can_be_written(path).map_err(|error| not_written(path, &error))
}

/// An output that would overwrite what is read, or another output.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PathConflict {
    /// The option that names the output, such as `--log`.
    pub option: &'static str,
    /// What it would overwrite, for people.
    pub message: String,
}

/// Checks that no output is a file that is read, and that no two outputs are the same file or both
/// standard output.
///
/// # Errors
/// The first two that are the same.
pub(super) fn check_paths(program: &Program, args: &RunArgs) -> Result<(), SessionError> {
    let conflict = path_conflicts(program, args).into_iter().next();
    conflict.map_or(Ok(()), |conflict| Err(SessionError(conflict.message)))
}

/// The outputs of a run that are files which are read, or the same file as an output before them, or to which
/// standard output goes as well as to one before them.
pub fn path_conflicts(program: &Program, args: &RunArgs) -> Vec<PathConflict> {
    let beside = args.retain.as_deref().map(retain::files_beside);
    let outputs = outputs(args);
    let with_ending = |path: &PathBuf, ending: &str| {
        let mut name = resolve_links(path).into_os_string();
        name.push(ending);
        PathBuf::from(name)
    };
    let file = |path: &Option<PathBuf>| path.clone().filter(|path| !is_stdout(path));
    let record = args.record.as_ref().filter(|_| !args.no_record);
    let further = [
        file(&args.dump).map(|path| ("--dump's temporary file", temporary_of(&path))),
        file(&args.retain).map(|path| ("--retain's temporary file", temporary_of(&path))),
        record.map(|path| ("--record's older part", with_ending(path, ".1"))),
        args.image
            .as_ref()
            .map(|path| ("--image's copy of a dead control", with_ending(path, ".dead"))),
    ];
    let outputs = outputs.chain(further.into_iter().flatten()).chain(beside.into_iter().flatten());
    let read = args.reads.iter().map(|path| (READ_FILES, path.clone()));
    // A source that was read from standard input is not a file.
    let source = program.files.iter().map(PathBuf::from).filter(|file| !is_stdout(file));
    let source = source.map(|file| ("the program", file));
    let read = read.chain(option("--key", &args.key));
    let read = option("--stimulus", &args.stimulus).into_iter().chain(source).chain(read);
    // Each path is looked up once: that takes system calls, and the first tick waits for it.
    let mut seen: Vec<(&str, Target)> =
        read.map(|(name, path)| (name, Target::of(&path))).collect();
    let mut conflicts = vec![];
    for (name, path) in outputs {
        let target = Target::of(&path);
        if let Some((other, _)) = seen.iter().find(|(_, other)| target.excludes(other)) {
            let message = if is_stdout(&path) {
                format!(
                    "{name} and {other} can't both go to standard output: give one of them a file"
                )
            } else {
                format!("{name} would overwrite {other}: both are {}", path.display())
            };
            // Of a file that stands beside an output it is the option that names the output.
            let option = name.split_once('\'').map_or(name, |(option, _)| option);
            conflicts.push(PathConflict { option, message });
        }
        seen.push((name, target));
    }
    conflicts
}

/// An option with its path, if it is given.
fn option(name: &'static str, path: &Option<PathBuf>) -> Option<(&'static str, PathBuf)> {
    Some((name, path.clone()?))
}

/// The outputs of a run by their options.
fn outputs(args: &RunArgs) -> impl Iterator<Item = (&'static str, PathBuf)> {
    let outputs = [
        args.trace_path().map(|path| ("--trace", path.to_owned())),
        option("--events", &args.events),
        option("--dump", &args.dump),
        option("--plot", &args.plot),
        option("--log", &args.log),
        option("--retain", &args.retain),
        option("--image", &args.image),
        option("--socket", &args.socket),
        option("--record", &args.record.clone().filter(|_| !args.no_record)),
    ];
    outputs.into_iter().flatten()
}

/// The folders of a run's outputs that do not exist, each with the first option that names a file in it. Another program
/// may still make such a folder: systemd makes that of a service's sockets when it starts the service.
pub fn missing_folders(args: &RunArgs) -> Vec<(&'static str, PathBuf)> {
    let mut missing: Vec<(&str, PathBuf)> = vec![];
    for (option, path) in outputs(args).filter(|(_, path)| !is_stdout(path)) {
        let path = resolve_links(&path);
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        if let Some(folder) = folder.filter(|folder| !folder.exists())
            && !missing.iter().any(|(_, other)| other == folder)
        {
            missing.push((option, folder.to_owned()));
        }
    }
    missing
}

/// What a path of the command line means.
enum Target {
    /// Standard output.
    StandardOutput,
    /// A file, which may not exist yet.
    File(FileIdentity),
    /// A device (`/dev/null`) or something else that several options may name.
    Shared,
}

impl Target {
    fn of(path: &Path) -> Self {
        if is_stdout(path) {
            Self::StandardOutput
        } else if fs::metadata(path).is_ok_and(|about| !about.is_file()) {
            Self::Shared
        } else {
            Self::File(FileIdentity::of(path))
        }
    }

    /// Whether an output that goes here would damage the other.
    fn excludes(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::StandardOutput, Self::StandardOutput) => true,
            (Self::File(file), Self::File(other)) => file.is_same(other),
            _ => false,
        }
    }
}
