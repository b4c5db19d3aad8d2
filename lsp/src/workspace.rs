//! Which program a file belongs to, and the settings that the program is read with.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use plcc_abi::Dialect;
use plcc_diag::SourceMap;
use plcc_frontend::common::{Controller, FileLoader, Limits, LintLevels, Machine, Options};
use plcc_frontend::{detect, language};
use serde::Deserialize;

use crate::documents::Documents;
use crate::position::Encoding;
use crate::program::Program;

/// How many files of a folder are looked at to find the one that includes another.
const MAX_SEARCHED: usize = 200;

/// What the editor says about the programs: its `initializationOptions`.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(crate) struct Settings {
    /// Files that are one program, loaded in their order (PMAC).
    programs: Vec<Vec<PathBuf>>,
    /// The language of files whose ending and text do not say it.
    dialect: Option<String>,
    /// `--limits none`.
    no_limits: bool,
    /// `--controller turbo`.
    turbo: bool,
    /// `--define NAME=VALUE`.
    define: HashMap<String, String>,
    /// `-I`.
    include: Vec<PathBuf>,
    /// Whether addresses `plcc-explain:CODE` open the page of a diagnostic.
    pub(crate) explain_links: bool,
}

impl Settings {
    /// Makes paths that are relative to the editor's folder absolute.
    pub(crate) fn resolve(&mut self, root: &Path) {
        let paths = self.programs.iter_mut().flatten().chain(&mut self.include);
        paths.for_each(|path| *path = root.join(&*path));
    }
}

/// The programs that have been read, each by its first file.
#[derive(Default)]
pub(crate) struct Workspace {
    pub(crate) settings: Settings,
    programs: HashMap<PathBuf, Rc<Program>>,
    /// The first file of the program that includes a file, as it was found.
    includers: HashMap<PathBuf, Option<PathBuf>>,
}

impl Workspace {
    /// Nothing has been read yet.
    pub(crate) fn new(settings: Settings) -> Self {
        Self { settings, ..Self::default() }
    }

    /// Forgets what depends on the texts, since one has changed.
    pub(crate) fn text_changed(&mut self, path: &Path) {
        self.programs.retain(|_, program| program.file(path).is_none());
        self.programs.remove(path);
        // A machine file belongs to sources beside it.
        if path.extension().is_some_and(|ending| ending == "toml") {
            self.programs.clear();
        }
    }

    /// Forgets everything, since files may have come, gone or changed on disk.
    pub(crate) fn files_changed(&mut self) {
        self.programs.clear();
        self.includers.clear();
    }

    /// The program that a file belongs to; `None` if it is in no language.
    pub(crate) fn program(
        &mut self,
        path: &Path,
        documents: &Documents,
        encoding: Encoding,
    ) -> Option<Rc<Program>> {
        let root = self.root(path, documents);
        if let Some(program) = self.programs.get(&root).filter(|it| it.file(path).is_some()) {
            return Some(Rc::clone(program));
        }
        let program = Rc::new(self.read(&root, documents, encoding)?);
        if program.file(path).is_some() {
            self.programs.insert(root, Rc::clone(&program));
            return Some(program);
        }
        // It was included once and is no more: it is a program of its own.
        self.includers.insert(path.to_owned(), None);
        let alone = Rc::new(self.read(path, documents, encoding)?);
        self.programs.insert(path.to_owned(), Rc::clone(&alone));
        Some(alone)
    }

    /// The programs that are known, in no order.
    pub(crate) fn known(&self) -> impl Iterator<Item = &Rc<Program>> {
        self.programs.values()
    }

    fn read(&self, root: &Path, documents: &Documents, encoding: Encoding) -> Option<Program> {
        let joined = self.settings.programs.iter().find(|files| files.iter().any(|it| it == root));
        let files = joined.cloned().unwrap_or_else(|| vec![root.to_owned()]);
        let dialect = self.dialect(root, documents)?;
        let options = self.options(root, documents);
        Some(Program::read(&files, dialect, documents, options, encoding))
    }

    /// The first file of the program that a file belongs to.
    fn root(&mut self, path: &Path, documents: &Documents) -> PathBuf {
        let named = self.settings.programs.iter().find(|files| files.iter().any(|it| it == path));
        if let Some(first) = named.and_then(|files| files.first()) {
            return first.clone();
        }
        if let Some(known) = self.includers.get(path) {
            return known.clone().unwrap_or_else(|| path.to_owned());
        }
        let found = self.includer(path, documents);
        self.includers.insert(path.to_owned(), found.clone());
        found.unwrap_or_else(|| path.to_owned())
    }

    /// A file beside it, or one folder up, that includes a file.
    fn includer(&self, path: &Path, documents: &Documents) -> Option<PathBuf> {
        let name = path.file_name()?.to_str()?.to_lowercase();
        let folder = path.parent()?;
        let folders = [Some(folder), folder.parent()];
        let endings = detect::file_extensions();
        let is_source = |name: &str| {
            let name = name.to_lowercase();
            endings.iter().any(|ending| name.ends_with(ending.as_str()))
        };
        let mut searched = 0;
        for folder in folders.into_iter().flatten() {
            let mut names = documents.list(folder);
            names.sort_unstable();
            for other in names.into_iter().filter(|name| is_source(name)) {
                let other = folder.join(other);
                searched += 1;
                if searched > MAX_SEARCHED {
                    return None;
                }
                let Some(bytes) = (other != path).then(|| documents.read(&other).ok()).flatten()
                else {
                    continue;
                };
                let text = String::from_utf8_lossy(&bytes).to_lowercase();
                let includes = |line: &str| {
                    let line = line.trim_start();
                    (line.starts_with("$include") || line.starts_with("#include"))
                        && line
                            .split(['"', '<', '>', ' ', '\t', '/', '\\'])
                            .any(|word| word == name)
                };
                if text.lines().any(includes) {
                    return Some(other);
                }
            }
        }
        None
    }

    /// The language of a file: what the editor says, else its ending or its text.
    fn dialect(&self, path: &Path, documents: &Documents) -> Option<Dialect> {
        if let Some(dialect) = documents.get(path).and_then(|document| document.dialect) {
            return Some(dialect);
        }
        let mut sources = SourceMap::new();
        let file = sources.add(path.to_string_lossy(), &documents.read(path).ok()?);
        let chosen = || {
            let name = self.settings.dialect.as_deref()?;
            Dialect::ALL.iter().copied().find(|it| it.name() == name)
        };
        detect::detect(path, sources.text(file)).ok().or_else(chosen)
    }

    /// The settings of the program whose first file this is.
    fn options(&self, root: &Path, documents: &Documents) -> Options {
        let settings = &self.settings;
        let machine = machine_beside(root, documents);
        let lints = LintLevels::of_machine(&machine).unwrap_or_default();
        Options {
            simulate: false,
            limits: if settings.no_limits { Limits::None } else { Limits::Original },
            defines: settings.define.clone().into_iter().collect(),
            controller: if settings.turbo { Controller::Turbo } else { Controller::Pmac },
            machine,
            include_dirs: settings.include.clone(),
            lints,
        }
    }
}

/// The machine file `STEM.machine.toml` beside a source, as `plcc run` takes it; an empty one if there is none or it has a
/// mistake.
fn machine_beside(source: &Path, documents: &Documents) -> Machine {
    let read = || {
        let mut name = source.file_stem()?.to_owned();
        name.push(".machine.toml");
        let bytes = documents.read(&source.with_file_name(name)).ok()?;
        let text = String::from_utf8_lossy(&bytes).into_owned();
        Machine::parse(text.trim_start_matches('\u{feff}')).ok()
    };
    read().unwrap_or_default()
}

/// The language with a name that editors use.
pub(crate) fn dialect_of(language_id: &str) -> Option<Dialect> {
    Dialect::ALL.iter().copied().find(|&dialect| language(dialect).dialect().name() == language_id)
}
