//! Programs that are compiled together and compared with their controls, one after the other.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use plcc_diag::SourceMap;
use plcc_frontend::common::Options;
use plcc_iec::{Project, structured_text};

use crate::case::{Case, Made, Rules, SCANS, Scan};
use crate::driver::{places, run};
use crate::ironplc::{self, Sums};
use crate::{matiec, strucpp};

/// How many lines the programs of a batch have at most.
const LINES: usize = 12_000;
/// How many programs a batch has at most.
const PROGRAMS: usize = 24;

/// A compiler that makes a program which is told inputs.
struct Compiler {
    name: &'static str,
    folder: PathBuf,
    compile: fn(&Path, &[&Project], &Path) -> Result<(), String>,
}

/// The compilers that the environment names.
struct Compilers {
    told: Vec<Compiler>,
    ironplc: Option<PathBuf>,
}

fn compilers() -> Compilers {
    let folder = |name: &str, what: &str| {
        let folder = std::env::var_os(name).map(PathBuf::from);
        if folder.is_none() {
            eprintln!("skipped: {name} does not name a folder with {what}");
        }
        folder
    };
    let mut told = vec![];
    if let Some(folder) = folder("PLCC_MATIEC", "matiec") {
        told.push(Compiler { name: "matiec", folder, compile: matiec::compile });
    }
    if let Some(folder) = folder("PLCC_STRUCPP", "STruC++") {
        told.push(Compiler { name: "STruC++", folder, compile: strucpp::compile });
    }
    Compilers { told, ironplc: folder("PLCC_IRONPLC", "IronPLC") }
}

/// How many programs there were of each kind.
#[derive(Debug, Default)]
pub(crate) struct Tally {
    /// Those that were compared.
    pub(crate) compared: usize,
    /// Of them, those that the control stopped.
    pub(crate) stopped: usize,
    /// Those that can't be exported.
    pub(crate) refused: usize,
    /// Those that have errors.
    pub(crate) wrong: usize,
    /// How many programs of each compiler did the same as the control.
    same: BTreeMap<&'static str, usize>,
    /// What compilers did not compile, and how often.
    not_compiled: BTreeMap<String, usize>,
    /// The programs that did something else than the control, each with its text.
    differences: Vec<String>,
}

/// Programs of a language.
pub(crate) struct Batch {
    rules: &'static Rules,
    compilers: Compilers,
    cases: Vec<Case>,
    pub(crate) tally: Tally,
}

impl Batch {
    /// No programs. None where there is no compiler.
    pub(crate) fn new(rules: &'static Rules) -> Option<Self> {
        let compilers = compilers();
        let is_any = !compilers.told.is_empty() || compilers.ironplc.is_some();
        is_any.then(|| Self { rules, compilers, cases: vec![], tally: Tally::default() })
    }

    /// How many programs can be compared so far.
    pub(crate) fn len(&self) -> usize {
        self.tally.compared + self.cases.len()
    }

    /// A generated program, which has no errors.
    pub(crate) fn generated(&mut self, file: &str, source: &str, seed: u64) {
        let mut map = SourceMap::new();
        let id = map.add(file, source.as_bytes());
        let label = format!("seed {seed}");
        let made = Case::of(self.rules, &mut map, &[id], label, seed, &Options::default());
        assert!(!matches!(made, Made::Wrong), "{source}");
        self.add(made);
    }

    /// A file.
    pub(crate) fn file(&mut self, path: &Path, options: &Options) {
        let mut map = SourceMap::new();
        let id = plcc_tests::compile::add(&mut map, path).unwrap();
        let label = path.file_name().unwrap().to_string_lossy().into_owned();
        let made = Case::of(self.rules, &mut map, &[id], label, 1, options);
        if matches!(made, Made::Wrong) {
            eprintln!("{} has errors", path.display());
        }
        self.add(made);
    }

    fn add(&mut self, made: Made) {
        match made {
            Made::Wrong => self.tally.wrong += 1,
            Made::NotExported(why) => {
                assert!(!why.is_empty());
                self.tally.refused += 1;
            }
            Made::Case(mut case) => {
                case.rename(format!("MACHINE{}", self.cases.len()));
                self.cases.push(*case);
                let lines: usize = self.cases.iter().map(|case| case.project().body.len()).sum();
                if lines > LINES || self.cases.len() >= PROGRAMS {
                    self.compare();
                }
            }
        }
    }

    /// Compares those that are left, and says how many there were. None may differ.
    pub(crate) fn finish(mut self, what: &str) -> Tally {
        self.compare();
        let Tally { compared, stopped, refused, wrong, same, not_compiled, differences } =
            &self.tally;
        let same: Vec<String> =
            same.iter().map(|(name, count)| format!("{count} by {name}")).collect();
        eprintln!(
            "{what}: {compared} programs, {stopped} of them stopped, the same {}; {refused} not exported, {wrong} with errors",
            same.join(", ")
        );
        for (why, count) in not_compiled {
            eprintln!("{what}: {count} not compiled by {why}");
        }
        assert!(differences.is_empty(), "{} differ: {}", differences.len(), differences.join("\n"));
        self.tally
    }

    /// Compares the programs that were added.
    fn compare(&mut self) {
        let cases = std::mem::take(&mut self.cases);
        if cases.is_empty() {
            return;
        }
        let folder = tempfile::tempdir().unwrap();
        let mut outputs: Vec<Vec<(&'static str, String)>> = cases.iter().map(|_| vec![]).collect();
        for compiler in &self.compilers.told {
            let folder = folder.path().join(compiler.name);
            std::fs::create_dir(&folder).unwrap();
            let projects: Vec<&Project> = cases.iter().map(Case::project).collect();
            let together = (compiler.compile)(&compiler.folder, &projects, &folder);
            for (number, case) in cases.iter().enumerate() {
                let mut program = number;
                if together.is_err() {
                    let alone = (compiler.compile)(&compiler.folder, &[case.project()], &folder);
                    if let Err(error) = alone {
                        self.tally.miss(compiler.name, case, &error);
                        continue;
                    }
                    program = 0;
                }
                match run(&folder, program, &case.lines()) {
                    Ok(output) => outputs[number].push((compiler.name, output)),
                    Err(error) => self.tally.differs(compiler.name, case, &error),
                }
            }
        }
        for (case, outputs) in cases.iter().zip(&outputs) {
            self.compare_case(case, outputs, folder.path());
        }
    }

    fn compare_case(&mut self, case: &Case, outputs: &[(&'static str, String)], folder: &Path) {
        let mut seen: Vec<_> = outputs.iter().map(|(name, text)| (*name, text.lines())).collect();
        let count = places(case.project()).len();
        let mut sums = Sums::default();
        let mut last = vec![];
        let (mut scans, mut stopped) = (0, false);
        let ran = case.run(|scan| {
            for (name, lines) in &mut seen {
                let line = lines.next().ok_or("a scan was not run")?;
                let values: Vec<&str> = line.split_whitespace().collect();
                assert_eq!(values.len(), count, "{}", case.label);
                let compared = scan.compare(case, |at| Some(values[at]));
                compared.map_err(|error| format!("{name}: {error}"))?;
            }
            if self.compilers.ironplc.is_some() {
                if scan.number > 0 {
                    sums = sums.and(case, &last);
                }
                last = scan.values.to_vec();
            }
            (scans, stopped) = (scan.number + 1, scan.stopped);
            Ok(())
        });
        self.tally.compared += 1;
        if let Err(error) = ran {
            self.tally.differs("", case, &error);
            return;
        }
        assert!(stopped || scans == SCANS);
        self.tally.stopped += usize::from(stopped);
        for (name, _) in outputs {
            *self.tally.same.entry(name).or_default() += 1;
        }
        if let Some(ironplc) = &self.compilers.ironplc {
            if let Err(error) = ironplc::compile_exported(ironplc, case, folder) {
                self.tally.miss("IronPLC", case, &error);
            }
            if let Err(error) = ironplc::compile(ironplc, case, folder) {
                self.tally.miss("IronPLC without addresses", case, &error);
                return;
            }
            let scan = Scan { number: scans - 1, stopped, values: &last };
            let compared = ironplc::compare(ironplc, case, folder, &scan, sums);
            if let Err(error) = compared {
                self.tally.differs("IronPLC", case, &error);
                return;
            }
            *self.tally.same.entry("IronPLC").or_default() += 1;
        }
    }
}

impl Tally {
    /// A program did something else than the control.
    fn differs(&mut self, compiler: &str, case: &Case, error: &str) {
        eprintln!("{}: {compiler} {error}", case.label);
        let text = structured_text(case.project());
        let Case { label, source, .. } = case;
        self.differences.push(format!("{label}: {compiler} {error}\n{source}\n{text}"));
    }

    /// A compiler did not compile a program.
    fn miss(&mut self, compiler: &str, case: &Case, error: &str) {
        let first = error.lines().find(|line| line.contains("rror")).unwrap_or(error).trim();
        // The place is another one in each program.
        let first = first.split_once("error: ").map_or(first, |(_, what)| what);
        eprintln!("{}: not compiled by {compiler}: {first}", case.label);
        assert!(compiler != "matiec", "{error}\n{}", structured_text(case.project()));
        *self.not_compiled.entry(format!("{compiler}: {first}")).or_default() += 1;
    }
}

/// All files below some folders that have one of these endings, in order.
pub(crate) fn files(folders: &[&str], endings: &[&str]) -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut open: Vec<PathBuf> = folders.iter().map(|folder| root.join(folder)).collect();
    let mut found = vec![];
    while let Some(path) = open.pop() {
        if path.is_dir() {
            open.extend(std::fs::read_dir(&path).unwrap().map(|entry| entry.unwrap().path()));
            continue;
        }
        let ending = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        if endings.contains(&&*ending) {
            found.push(path);
        }
    }
    found.sort();
    found
}
