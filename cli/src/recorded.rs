//! Programs in records and artifacts. `recorded_sources` makes what `plcc run --record` records of a program, and
//! what `plcc build` puts into an artifact beside its code; [`Found`] is the program of a record, and makes engines that
//! replay it.

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};

use plcc_abi::{Dialect, Engine, Program};
use plcc_codegen::{OptLevel, Target};
use plcc_diag::{Diagnostic, FileId, SourceMap};
use plcc_frontend::common::{Controller, FileLoader, Limits, Machine, Options, Words};
use plcc_frontend::language;
use plcc_load::Artifact;
use plcc_record::{RecordedFile, RecordedProgram, RecordedSources};
use plcc_runtime::NativeEngine;
use serde::{Deserialize, Serialize};

use crate::compile::{self, Checked, CompileError};
use crate::later_code::jit_in_parts;

/// The options of the compiler, as a record holds them.
#[derive(Serialize, Deserialize)]
struct RecordedOptions {
    original_limits: bool,
    defines: Vec<(String, String)>,
    turbo: bool,
    /// The text of the machine file.
    machine: Option<String>,
    include_dirs: Vec<PathBuf>,
}

/// What a record or an artifact holds of the sources that a program was compiled from. The first `named` of them were named on the
/// command line, the others are included; `machine` is the text of the machine file, if there is one.
pub(crate) fn recorded_sources(
    dialect: Dialect,
    sources: &SourceMap,
    named: usize,
    options: &Options,
    machine: Option<String>,
) -> RecordedSources {
    let files = (0..u32::try_from(sources.len()).unwrap_or(u32::MAX)).map(FileId);
    let options = RecordedOptions {
        original_limits: options.limits == Limits::Original,
        defines: options.defines.clone(),
        turbo: options.controller == Controller::Turbo,
        machine,
        include_dirs: options.include_dirs.clone(),
    };
    RecordedSources {
        dialect: dialect.name().into(),
        files: files
            .map(|file| RecordedFile {
                path: sources.path(file).into(),
                text: sources.text(file).into(),
            })
            .collect(),
        named,
        // JSON of these fields does not fail.
        options: serde_json::to_vec(&options).unwrap_or_default(),
    }
}

/// Loads included files from a record instead of the disk.
struct RecordedFiles(BTreeMap<PathBuf, Vec<u8>>);

impl FileLoader for RecordedFiles {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        self.0.get(path).cloned().ok_or_else(|| io::ErrorKind::NotFound.into())
    }

    fn list(&self, dir: &Path) -> Vec<String> {
        let inside = self.0.keys().filter(|path| path.parent() == Some(dir));
        inside.filter_map(|path| Some(path.file_name()?.to_string_lossy().into_owned())).collect()
    }
}

/// Sources that a record or an artifact holds, to be read.
struct Opened {
    dialect: Dialect,
    options: Options,
    has_machine: bool,
    sources: SourceMap,
    /// The files that were named on the command line.
    named: Vec<FileId>,
    /// The files that they include.
    included: RecordedFiles,
}

impl Opened {
    /// # Errors
    /// When the record is of another version of plcc, so that its options can't be read.
    fn new(recorded: &RecordedSources) -> Result<Self, String> {
        let unusable =
            || "the program in the record can't be read: another version of plcc has recorded it";
        let named = |dialect: &&Dialect| dialect.name() == recorded.dialect;
        let dialect = *Dialect::ALL.iter().find(named).ok_or_else(unusable)?;
        let options: RecordedOptions =
            serde_json::from_slice(&recorded.options).map_err(|_| unusable())?;
        let machine = options.machine.as_deref().map(Machine::parse).transpose();
        let machine = machine.map_err(|_| unusable())?;
        let has_machine = machine.is_some();
        let options = Options {
            limits: if options.original_limits { Limits::Original } else { Limits::None },
            defines: options.defines,
            controller: if options.turbo { Controller::Turbo } else { Controller::Pmac },
            machine: machine.unwrap_or_default(),
            include_dirs: options.include_dirs,
            ..Options::default()
        };
        let mut sources = SourceMap::new();
        let files = || recorded.files.iter();
        let named = files()
            .take(recorded.named)
            .map(|file| sources.add(file.path.clone(), file.text.as_bytes()))
            .collect();
        let included = files().skip(recorded.named);
        let included =
            included.map(|file| (PathBuf::from(&file.path), file.text.clone().into_bytes()));
        let included = RecordedFiles(included.collect());
        Ok(Self { dialect, options, has_machine, sources, named, included })
    }
}

/// Checks sources that a record or an artifact holds. Gives the program where it has no errors, the sources, and what was
/// found.
///
/// # Errors
/// When the record is of another version of plcc, so that its options can't be read.
pub(crate) fn check_recorded(
    recorded: &RecordedSources,
) -> Result<(Option<Checked>, SourceMap, Vec<Diagnostic>), String> {
    let Opened { dialect, options, mut sources, named, included, .. } = Opened::new(recorded)?;
    let (checked, found) = compile::check(&mut sources, &named, dialect, &included, &options);
    Ok((checked, sources, found))
}

/// What the machine file says that a record or an artifact holds; `None` if it holds none.
///
/// # Errors
/// As those of [`check_recorded`].
pub(crate) fn machine_of_recorded(recorded: &RecordedSources) -> Result<Option<Machine>, String> {
    let Opened { options, has_machine, .. } = Opened::new(recorded)?;
    Ok(has_machine.then_some(options.machine))
}

/// The sources that a record or an artifact holds, their words, and their language.
///
/// # Errors
/// As those of [`check_recorded`].
pub(crate) fn words_of_recorded(
    recorded: &RecordedSources,
) -> Result<(SourceMap, Words, Dialect), String> {
    let Opened { dialect, options, mut sources, named, included, .. } = Opened::new(recorded)?;
    let words = language(dialect).words(&mut sources, &named, &included, &options);
    Ok((sources, words, dialect))
}

/// The first error of a program in one line, `CODE: message`; `None` if it has none.
pub(crate) fn first_error(found: &[Diagnostic]) -> Option<String> {
    let error = found.iter().find(|diagnostic| diagnostic.is_error())?;
    Some(format!("{}: {}", error.code, error.message))
}

/// An engine in which recorded ticks can be run again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReplayEngine {
    /// The statement interpreter.
    Interpreter,
    /// Compiled just in time.
    Jit,
    /// The artifact, or the sources compiled ahead of time.
    Aot,
}

/// The program of a record, taken from the record or from the disk.
#[derive(Debug)]
pub struct Found {
    /// What the executive needs of the program: its tables.
    pub program: Program,
    /// The checked program; `None` if only an artifact without sources is known.
    pub checked: Option<Checked>,
    /// The sources; empty if only an artifact without them is known.
    pub sources: SourceMap,
    artifact: Option<Artifact>,
}

impl Found {
    /// The program that a record itself holds.
    ///
    /// # Errors
    /// When it holds none, or one that can't be used here.
    pub fn in_record(recorded: &RecordedProgram) -> Result<Self, String> {
        match recorded {
            RecordedProgram::Unknown => {
                Err("the record does not hold the program; name it after the record".into())
            }
            RecordedProgram::Artifact(bytes) => {
                let artifact = Artifact::parse(bytes, None);
                Ok(Self::of_artifact(artifact.map_err(|error| {
                    format!("the artifact in the record can't be used here: {error}")
                })?))
            }
            RecordedProgram::Sources(recorded) => Self::of_recorded_sources(recorded),
        }
    }

    fn of_recorded_sources(recorded: &RecordedSources) -> Result<Self, String> {
        let (checked, sources, _) = check_recorded(recorded)?;
        let checked = checked.ok_or("the program in the record has errors for this plcc")?;
        Self::of_checked(checked, sources).map_err(|error| error.to_string())
    }

    /// An artifact, with the checked program where it has its sources. They are taken only if this `plcc` makes the same
    /// tables of them, so that variables and tasks are where the artifact's code has them.
    fn of_artifact(artifact: Artifact) -> Self {
        let program = artifact.program.clone();
        let of_sources = RecordedSources::from_bytes(&artifact.sources)
            .and_then(|sources| Self::of_recorded_sources(&sources).ok())
            .filter(|found| found.program == program);
        let (checked, sources) = match of_sources {
            Some(found) => (found.checked, found.sources),
            None => (None, SourceMap::new()),
        };
        Self { program, checked, sources, artifact: Some(artifact) }
    }

    /// A checked program.
    ///
    /// # Errors
    /// When it can't be lowered.
    pub fn of_checked(checked: Checked, sources: SourceMap) -> Result<Self, CompileError> {
        let program = checked.lower()?.program;
        Ok(Self { program, checked: Some(checked), sources, artifact: None })
    }

    /// This program, from the disk, to be used instead of the recorded one.
    ///
    /// # Errors
    /// When it is not the same program as the recorded one.
    pub fn in_place_of(self, recorded: &RecordedProgram) -> Result<Self, String> {
        let same = match recorded {
            RecordedProgram::Unknown => true,
            RecordedProgram::Artifact(bytes) => {
                let recorded = Artifact::parse(bytes, None).map_err(|error| error.to_string())?;
                self.code_number()? == recorded.code_number()
            }
            RecordedProgram::Sources(recorded) => (0..)
                .zip(&recorded.files)
                .all(|(id, file)| self.sources.text(FileId(id)) == file.text),
        };
        if same {
            return Ok(self);
        }
        Err("it is another program than the one that was recorded, or was compiled with other \
             options or by another plcc"
            .into())
    }

    /// The [number](Artifact::code_number) of the program's machine code, compiled ahead of time if there is only
    /// its source: equal numbers mean the same code.
    fn code_number(&self) -> Result<u64, String> {
        if let Some(artifact) = &self.artifact {
            return Ok(artifact.code_number());
        }
        let number = |checked: &Checked| {
            let made = checked.compiled(OptLevel::Speed, |lowered| {
                let code = compile::code(lowered, &Target::host_baseline()?)?;
                compile::artifact(&lowered.program, &code)
            });
            Ok::<u64, CompileError>(Artifact::parse(&made?.1, None)?.code_number())
        };
        let checked = self.checked.as_ref().ok_or("it has no code")?;
        number(checked).map_err(|error| error.to_string())
    }

    /// An engine of the program.
    ///
    /// # Errors
    /// When there is none of that kind: an artifact without sources has neither statements nor a compiler.
    pub fn engine(&self, engine: ReplayEngine) -> Result<Box<dyn Engine>, String> {
        if let (Some(artifact), ReplayEngine::Aot) = (&self.artifact, engine) {
            let native = NativeEngine::new(&artifact.code, &artifact.program);
            return Ok(Box::new(native.map_err(|error| error.to_string())?));
        }
        let checked = self.checked.as_ref().ok_or(
            "the record holds an artifact without the text of its sources, which only --engine aot can run; name the \
             program's sources after the record for the others",
        )?;
        let compiled = || -> Result<Box<dyn Engine>, CompileError> {
            Ok(match engine {
                ReplayEngine::Interpreter => checked.interpreter(),
                ReplayEngine::Jit => {
                    Box::new(jit_in_parts(|| checked.lower(), OptLevel::Speed)?.engine)
                }
                ReplayEngine::Aot => Box::new(checked.compiled(OptLevel::Speed, compile::aot)?.1.0),
            })
        };
        compiled().map_err(|error| error.to_string())
    }

    /// The engine that is taken where none is asked for.
    pub fn usual_engine(&self) -> ReplayEngine {
        if self.artifact.is_some() { ReplayEngine::Aot } else { ReplayEngine::Jit }
    }

    /// Another engine than this one, for comparison; `None` where there is no other.
    pub fn other_engine(&self, engine: ReplayEngine) -> Option<ReplayEngine> {
        match (&self.checked, engine) {
            (None, _) => None,
            (Some(_), ReplayEngine::Interpreter) => Some(self.usual_engine()),
            (Some(_), _) => Some(ReplayEngine::Interpreter),
        }
    }
}
