//! Reads the sources and the machine file that the command line names, and finds out their language.

use std::io;
use std::path::{Path, PathBuf};

use plcc_abi::Dialect;
use plcc_diag::lints::Level;
use plcc_diag::{Diagnostic, FileId, SourceMap, Span};
use plcc_files::{MAX_SETTINGS, read_at_most, read_regular, why_not_read};
use plcc_frontend::common::{FileLoader, LintLevels, Machine, Options, Words};
use plcc_frontend::{LANGUAGES, detect, language};
use plcc_load::Artifact;

use crate::args::{Denied, SourceArgs};
use crate::compile::{self, Checked};
use crate::disk::{self, Below, Disk, existing_path};
use crate::failure::Failure;
use crate::names;
use crate::report::{Destination, Report};

/// The settings with which a program is compiled, and the machine file that some of them come from.
pub(crate) struct SourceSettings {
    pub(crate) options: Options,
    /// The machine file: the one that is named, or the one beside the source.
    pub(crate) machine: Option<PathBuf>,
}

impl SourceSettings {
    /// The settings for a program whose first file is `source`. Where no machine file is named, a file
    /// `STEM.machine.toml` beside the source is used, and a note says so.
    ///
    /// # Errors
    /// When the machine file can't be read or is not valid.
    pub(crate) fn of(args: &SourceArgs, source: &Path, report: &Report) -> Result<Self, Failure> {
        let beside = machine_beside(source).filter(|_| args.machine.is_none() && !args.no_machine);
        if let Some(path) = &beside {
            let path = path.display();
            report.note(&format!("{path} is used as the machine file; --no-machine ignores it"));
        }
        let machine = args.machine.clone().or(beside);
        let machine_file = machine.as_deref().map(self::machine).transpose()?.unwrap_or_default();
        let lints = lint_levels(args, &machine_file)
            .map_err(|error| Failure::file(machine.as_deref().unwrap_or(Path::new("")), error))?;
        let options = Options {
            simulate: false,
            limits: args.limits.unwrap_or_default().into(),
            defines: args.define.clone(),
            controller: args.controller.unwrap_or_default().into(),
            machine: machine_file,
            include_dirs: args.include.clone(),
            lints,
        };
        Ok(Self { options, machine })
    }

    /// The settings for a program of these files; the first one decides the machine file.
    ///
    /// # Errors
    /// When the machine file can't be read or is not valid.
    pub(crate) fn for_files(
        args: &SourceArgs,
        files: &[PathBuf],
        report: &Report,
    ) -> Result<Self, Failure> {
        Self::of(args, files.first().map_or(Path::new("-"), PathBuf::as_path), report)
    }

    /// What the machine file says, where there is one.
    pub(crate) fn machine_file(&self) -> Option<&Machine> {
        self.machine.as_ref().map(|_| &self.options.machine)
    }
}

/// The levels of lints: those of the machine file, then those of the command line.
///
/// # Errors
/// When the machine file names a lint or a level that does not exist.
fn lint_levels(args: &SourceArgs, machine: &Machine) -> Result<LintLevels, String> {
    let mut levels = LintLevels::of_machine(machine)?;
    args.lints_off.iter().for_each(|lint| levels.set(lint, Level::Allow));
    args.lints_on.iter().for_each(|lint| levels.set(lint, Level::Warn));
    for denied in &args.deny {
        match denied {
            Denied::Warnings => levels.deny_warnings = true,
            Denied::Lint(lint) => levels.set(lint, Level::Deny),
        }
    }
    Ok(levels)
}

/// The file `STEM.machine.toml` beside a source, if there is one.
pub(crate) fn machine_beside(source: &Path) -> Option<PathBuf> {
    if is_standard_input(source) {
        return None;
    }
    let mut name = source.file_stem()?.to_owned();
    name.push(".machine.toml");
    Some(source.with_file_name(name)).filter(|path| path.is_file())
}

/// The folder of a file, as it is named; of standard input the current one.
fn folder_of(file: &Path) -> PathBuf {
    file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new(".")).into()
}

/// Whether a path means standard input.
pub(crate) fn is_standard_input(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// Reads the text of a machine file.
///
/// # Errors
/// When it can't be read.
pub(crate) fn machine_text(path: &Path) -> Result<String, Failure> {
    let bytes = read_regular(path, MAX_SETTINGS);
    let bytes = bytes.map_err(|error| Failure::file(path, why_not_read(&error)))?;
    let text = String::from_utf8_lossy(&bytes);
    Ok(text.strip_prefix('\u{feff}').unwrap_or(&text).to_owned())
}

/// Reads a machine file.
///
/// # Errors
/// When it can't be read or is not valid.
pub(crate) fn machine(path: &Path) -> Result<Machine, Failure> {
    Machine::parse(&machine_text(path)?).map_err(|error| {
        let error = error.to_string();
        Failure::file(path, format!("it is not a valid machine file: {}", error.trim_end()))
    })
}

/// A source that has been read, before it is known what language it is in.
pub(crate) struct SourceFile {
    pub(crate) path: PathBuf,
    bytes: Vec<u8>,
}

impl SourceFile {
    /// Reads a source file, or standard input for `-`. It is read only once, since it may be a pipe.
    ///
    /// # Errors
    /// When it can't be read or is an artifact.
    pub(crate) fn read(path: &Path) -> Result<Self, Failure> {
        let bytes = match is_standard_input(path) {
            true => read_at_most(io::stdin().lock(), disk::MAX_SOURCE),
            false => Disk.read(path),
        };
        let bytes = bytes.map_err(|error| match error.kind() {
            io::ErrorKind::IsADirectory => {
                Failure::file(path, "it is a folder; name the program's source in it")
            }
            _ => Failure::file(path, why_not_read(&error)),
        })?;
        if Artifact::is_artifact(&bytes) {
            return Err(Failure::file(path, "it is an artifact; a source is needed here"));
        }
        Ok(Self { path: path.to_owned(), bytes })
    }
}

/// A program's sources, read.
pub(crate) struct Input {
    pub(crate) sources: SourceMap,
    pub(crate) files: Vec<FileId>,
    pub(crate) dialect: Dialect,
    /// The folder that was named, if the files were found in it.
    pub(crate) folder: Option<PathBuf>,
}

/// A program's sources, checked.
pub(crate) struct Program {
    pub(crate) sources: SourceMap,
    /// How many of the sources were named; those after them in `sources` are included ones.
    pub(crate) named_files: usize,
    pub(crate) dialect: Dialect,
    pub(crate) checked: Option<Checked>,
    pub(crate) diagnostics: Vec<Diagnostic>,
    /// The part program that the machine file names, where that was read, with what is to be said of it.
    pub(crate) part_program: Option<(SourceMap, Vec<Diagnostic>)>,
}

impl Input {
    /// Reads files that are one program, and finds out their language.
    ///
    /// # Errors
    /// When one can't be read, the language is not clear or takes only one file, or an option is for
    /// programs of another language.
    pub(crate) fn read(paths: &[PathBuf], args: &SourceArgs) -> Result<Self, Failure> {
        let raw: Vec<SourceFile> =
            paths.iter().map(|path| SourceFile::read(path)).collect::<Result<_, _>>()?;
        let input = Self::of(&raw.iter().collect::<Vec<_>>(), args)?;
        refuse_options_of_others(input.dialect, |other| args.option_of(other))?;
        Ok(input)
    }

    /// Makes one program of files that have been read.
    ///
    /// # Errors
    /// When the language is not clear, or takes only one file.
    pub(crate) fn of(raw: &[&SourceFile], args: &SourceArgs) -> Result<Self, Failure> {
        let mut sources = SourceMap::new();
        let files: Vec<FileId> =
            raw.iter().map(|raw| sources.add(raw.path.to_string_lossy(), &raw.bytes)).collect();
        let paths: Vec<&Path> = raw.iter().map(|raw| raw.path.as_path()).collect();
        let dialect = match args.dialect {
            Some(dialect) => dialect,
            None => detect_all(&sources, &files, &paths)?,
        };
        if files.len() > 1 && !language(dialect).joins_files() {
            let joining: Vec<_> =
                LANGUAGES.iter().filter(|l| l.joins_files()).map(|l| l.title()).collect();
            let message = format!(
                "a {} program is one file, and {} were given; only {} programs may have several",
                dialect.name(),
                files.len(),
                joining.join(" or ")
            );
            return Err(Failure::usage(message));
        }
        Ok(Self { sources, files, dialect, folder: None })
    }

    /// The path of the first file.
    pub(crate) fn first(&self) -> PathBuf {
        self.files
            .first()
            .map_or_else(PathBuf::new, |&id| existing_path(Path::new(self.sources.path(id))))
    }

    /// The words of the program, with the files that it includes.
    pub(crate) fn words(&self, options: &Options) -> (SourceMap, Words) {
        let mut sources = self.sources.clone();
        let loader = self.loader(options);
        let words = language(self.dialect).words(&mut sources, &self.files, &loader, options);
        (sources, words)
    }

    /// What reads the included files: they lie beside the program, or in the folders that are named for them.
    fn loader(&self, options: &Options) -> Below {
        let named = self.files.iter().map(|&file| PathBuf::from(self.sources.path(file)));
        let named: Vec<PathBuf> = named.map(|path| folder_of(&existing_path(&path))).collect();
        Below::new(named.iter().chain(&self.folder).chain(&options.include_dirs))
    }

    /// Checks the program. Its diagnostics are in the order in which the text is read.
    ///
    /// # Errors
    /// When the machine file gives names that the program can't have.
    pub(crate) fn check(self, settings: &SourceSettings) -> Result<Program, Failure> {
        let options = &settings.options;
        let loader = self.loader(options);
        let Self { mut sources, files, dialect, folder: _ } = self;
        let (checked, mut diagnostics) =
            compile::check(&mut sources, &files, dialect, &loader, options);
        diagnostics.sort_by_cached_key(|diagnostic| reading_position(&sources, diagnostic.span));
        if let Some(checked) = &checked {
            let named = names::check(checked.program(), &options.machine);
            let machine = settings.machine.as_deref().unwrap_or(Path::new(""));
            named.map_err(|why| Failure::file(machine, why))?;
        }
        let named_files = files.len();
        Ok(Program { sources, named_files, dialect, checked, diagnostics, part_program: None })
    }
}

impl Program {
    /// The checked program with its sources; `None` if it has errors, which are shown.
    ///
    /// # Errors
    /// When they can't be shown.
    pub(crate) fn without_errors(
        self,
        to: Destination,
        report: &Report,
    ) -> Result<Option<(Checked, SourceMap)>, Failure> {
        let errors: Vec<_> = self.diagnostics.into_iter().filter(Diagnostic::is_error).collect();
        match self.checked {
            Some(checked) if errors.is_empty() => Ok(Some((checked, self.sources))),
            _ => report.show(&self.sources, &errors, to).map(|_| None),
        }
    }

    /// What to say of a program with errors whose text looks like a program in another language, such as an
    /// NCT program in a file `x.pmi`; `None` if it does not.
    pub(crate) fn other_language(&self) -> Option<String> {
        if !self.diagnostics.iter().any(Diagnostic::is_error) {
            return None;
        }
        let [other] = detect::looks_like(self.sources.text(FileId(0)))[..] else { return None };
        let path = self.sources.path(FileId(0));
        (other != self.dialect).then(|| {
            let (is, name) = (language(other).title(), other.name());
            let read_as = language(self.dialect).title();
            format!("{path} was read as a program in {read_as} and looks like one in {is}; --dialect {name} reads it as that")
        })
    }
}

/// An option that means nothing to a program of language `dialect` is a mistake of the user.
/// `option_of` gives the first option on the command line that only programs of a language have.
///
/// # Errors
/// When such an option is for another language.
pub(crate) fn refuse_options_of_others(
    dialect: Dialect,
    option_of: impl Fn(Dialect) -> Option<&'static str>,
) -> Result<(), Failure> {
    let others = Dialect::ALL.iter().filter(|&&other| other != dialect);
    match others.copied().find_map(|other| Some((other, option_of(other)?))) {
        Some((other, option)) => {
            let (of, is) = (other.name(), dialect.name());
            Err(Failure::usage(format!("{option} is for {of} programs; this one is {is}")))
        }
        None => Ok(()),
    }
}

/// Where a span stands in the text with everything included: the file and offset of each statement
/// that includes its file, outermost first, and then its own. Sorting by this gives the order in
/// which the text is read.
fn reading_position(sources: &SourceMap, mut span: Span) -> Vec<(FileId, u32)> {
    let mut path = vec![(span.file, span.start)];
    while let Some(at) = sources.included_from(span.file) {
        span = at;
        path.push((span.file, span.start));
    }
    path.reverse();
    path
}

/// The dialect of files that are one program, from their endings or texts. Files that do not show
/// their language may stand beside files that do, where the language joins files.
///
/// # Errors
/// When no file shows its language, or two show different ones.
fn detect_all(sources: &SourceMap, files: &[FileId], paths: &[&Path]) -> Result<Dialect, Failure> {
    let mut found: Option<(Dialect, &Path)> = None;
    let mut doubt: Option<(&Path, Vec<Dialect>)> = None;
    for (&path, &file) in paths.iter().zip(files) {
        match detect::detect(path, sources.text(file)) {
            Ok(dialect) => match found {
                Some((other, first)) if other != dialect => {
                    let (a, b) = (first.display(), path.display());
                    let (x, y) = (other.name(), dialect.name());
                    let message = format!(
                        "{a} is {x} and {b} is {y}, but a program has one language; if that \
                                 is wrong, name the language with --dialect"
                    );
                    return Err(Failure::usage(message));
                }
                _ => found = Some((dialect, path)),
            },
            Err(like) => doubt = doubt.or(Some((path, like))),
        }
    }
    match (found, doubt) {
        (Some((dialect, _)), None) => Ok(dialect),
        // One file of a program of several may be definitions alone.
        (Some((dialect, _)), Some((_, like)))
            if like.is_empty() && language(dialect).joins_files() =>
        {
            Ok(dialect)
        }
        (_, Some((path, like))) => Err(Failure::file(path, undecided(&like))),
        (None, None) => Err(Failure::usage("no file was given")),
    }
}

fn undecided(like: &[Dialect]) -> String {
    let names: Vec<&str> = like.iter().map(|dialect| dialect.name()).collect();
    if names.is_empty() {
        let all: Vec<&str> = Dialect::ALL.iter().map(|dialect| dialect.name()).collect();
        let all = list(&all, "or");
        format!("neither its name nor its text says which language it is in; use --dialect {all}")
    } else {
        format!(
            "its text looks like {}; name the language with --dialect",
            names.join(" and like ")
        )
    }
}

/// `a, b or c`.
pub(crate) fn list(words: &[&str], before_last: &str) -> String {
    match words {
        [] => String::new(),
        [one] => (*one).into(),
        [first @ .., last] => format!("{} {before_last} {last}", first.join(", ")),
    }
}
