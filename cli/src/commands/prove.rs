//! `plcc prove`: whether conditions hold in every scan, for all inputs.

use std::fs;
use std::path::{Path, PathBuf};

use plcc_abi::{Engine, Program, Tables};
use plcc_control::ControlArgs;
use plcc_diag::{Diagnostic, SourceMap, Span};
use plcc_files::{MAX_SETTINGS, read_regular, why_not_read};
use plcc_frontend::common::Lowered;
use plcc_plctest::{Plan, parse};
use plcc_prove::control::{Settings, Source};
use plcc_prove::{Answer, Question, Station, Subject};
use plcc_runtime::Executive;
use serde_json::{Value, json};

use crate::args::{FormatArg, ProveArgs};
use crate::compile::Checked;
use crate::failure::{DONE, ERRORS, Failure, USAGE};
use crate::input::{Input, SourceSettings};
use crate::output;
use crate::report::{Destination, Report};

/// The exit status if something is refuted or differs.
const REFUTED: u8 = 1;

/// The exit status if something could not be decided, and nothing is refuted.
const UNDECIDED: u8 = 5;

pub(crate) fn prove(args: &ProveArgs, report: &Report) -> Result<u8, Failure> {
    if args.never.is_empty() && args.always.is_empty() && args.script.is_empty() {
        return Err(Failure::usage(
            "nothing is asked: give a condition with --never or --always, or a script with --script",
        ));
    }
    let settings = SourceSettings::for_files(&args.source, &args.files, report)?;
    let program = Input::read(&args.files, &args.source)?.check(&settings)?;
    let errors: Vec<_> = program.diagnostics.iter().filter(|it| it.is_error()).cloned().collect();
    let to = Destination::from(args.source.message_format);
    let Some(checked) = program.checked.filter(|_| errors.is_empty()) else {
        report.show(&program.sources, &errors, to)?;
        return Ok(ERRORS);
    };
    let bench = Bench::new(checked, &args.control, &settings, args.retained_as_declared)?;
    let mut questions = vec![];
    for (sources, found) in scripts(args)? {
        match bench.questions(&sources, found) {
            Ok(found) => questions.extend(found),
            Err(mistakes) => {
                report.show(&sources, &mistakes, to)?;
                return Ok(USAGE);
            }
        }
    }
    let mut status = Status::default();
    for question in &questions {
        let answer = bench.subject().answer(question, args.timeout).map_err(Failure::usage)?;
        status.note(&answer);
        let stimulus = match &answer {
            Answer::Refuted { stimulus, .. } => Some(write(args, status.refuted, stimulus)?),
            _ => None,
        };
        show(args.source.message_format, question, &answer, stimulus.as_deref())?;
    }
    Ok(status.code())
}

/// What came of all questions.
#[derive(Default)]
pub(crate) struct Status {
    refuted: usize,
    undecided: usize,
}

impl Status {
    fn note(&mut self, answer: &Answer) {
        match answer {
            Answer::Proved { .. } => {}
            Answer::Refuted { .. } => self.refuted += 1,
            Answer::Undecided { .. } => self.undecided += 1,
        }
    }

    fn code(&self) -> u8 {
        match (self.refuted, self.undecided) {
            (0, 0) => DONE,
            (0, _) => UNDECIDED,
            _ => REFUTED,
        }
    }
}

/// A program about which questions are asked.
struct Bench {
    checked: Checked,
    lowered: Lowered,
    image: Vec<u8>,
    settings: Settings,
    control: ControlArgs,
    machine: Option<plcc_frontend::common::Machine>,
    names: std::sync::Arc<dyn plcc_runtime::Names>,
}

impl Bench {
    fn new(
        checked: Checked,
        control: &ControlArgs,
        source: &SourceSettings,
        as_declared: bool,
    ) -> Result<Self, Failure> {
        let lowered = checked.lower()?;
        let machine = source.machine_file().cloned();
        let made = executive(&lowered.program, control, machine.as_ref());
        let made = made.map_err(Failure::usage)?;
        let settings = settings(&lowered.program, control, machine.as_ref(), as_declared);
        let (image, names) = (made.image().to_vec(), made.names());
        let control = control.clone();
        Ok(Self { checked, lowered, image, settings, control, machine, names })
    }

    fn subject(&self) -> Subject<'_> {
        let source = Source {
            program: &self.lowered.program,
            module: &self.lowered.module,
            returns: self.lowered.return_stack,
            image: &self.image,
            settings: self.settings,
        };
        let checked = self.checked.program();
        Subject { checked, source, names: &*self.names, station: self }
    }

    /// The questions of a script, or what is wrong with it.
    fn questions(
        &self,
        sources: &SourceMap,
        file: plcc_diag::FileId,
    ) -> Result<Vec<Question>, Vec<Diagnostic>> {
        let (script, mistakes) = parse(sources, file);
        if !mistakes.is_empty() {
            return Err(mistakes);
        }
        let text = |span: Span| sources.slice(span);
        let (checked, program) = (self.checked.program(), &self.lowered.program);
        let plan = Plan::new(&script, &text, checked, program, &*self.names)?;
        let question = |it: plcc_plctest::Invariant| Question {
            text: it.text.trim().to_owned(),
            conditions: it.conditions,
            holds: it.holds,
        };
        Ok(plan.invariants.into_iter().map(question).collect())
    }
}

fn executive(
    program: &Program,
    control: &ControlArgs,
    machine: Option<&plcc_frontend::common::Machine>,
) -> Result<Box<dyn Executive + Send>, String> {
    plcc_control::executive(program, control, false, machine).map_err(|error| error.to_string())
}

impl Station for Bench {
    #[allow(clippy::expect_used, reason = "the same was made when the bench was")]
    fn executive(&self) -> Box<dyn Executive> {
        executive(&self.lowered.program, &self.control, self.machine.as_ref())
            .expect("a control was made before")
    }

    fn engine(&self) -> Box<dyn Engine> {
        self.checked.interpreter()
    }
}

/// The settings of a control that decide what it does in a tick.
fn settings(
    program: &Program,
    control: &ControlArgs,
    machine: Option<&plcc_frontend::common::Machine>,
    as_declared: bool,
) -> Settings {
    let period = control.pmi.period.map_or(20_000_000, |period| period.as_nanos() as u64);
    let nct = match (&program.tables, machine) {
        (_, Some(machine)) => machine.nct.clone(),
        (Tables::Nct(tables), None) => tables.settings.clone(),
        _ => Default::default(),
    };
    Settings {
        period_ns: period,
        level2_ms: control.nct.control.unwrap_or(nct.control).period_ms(),
        boards: nct.boards.unwrap_or(4).min(4),
        level0_safepoints: control.nct.level0_safepoints.unwrap_or(10_000).max(1),
        as_declared,
    }
}

/// The scripts with the questions: those that are named, and one of the conditions on the command line.
fn scripts(args: &ProveArgs) -> Result<Vec<(SourceMap, plcc_diag::FileId)>, Failure> {
    let mut all = vec![];
    for (word, conditions) in [("never", &args.never), ("always", &args.always)] {
        for condition in conditions {
            let line = condition.replace(['\n', '\r'], " ");
            let text = format!("program \"-\"\n{word} {line}\n");
            let mut sources = SourceMap::new();
            let file = sources.add(format!("--{word}"), text.as_bytes());
            all.push((sources, file));
        }
    }
    for path in &args.script {
        let bytes = read_regular(path, MAX_SETTINGS);
        let bytes = bytes.map_err(|error| Failure::file(path, why_not_read(&error)))?;
        let mut sources = SourceMap::new();
        let file = sources.add(path.to_string_lossy(), &bytes);
        all.push((sources, file));
    }
    Ok(all)
}

/// Writes a stimulus to a file of its own.
fn write(args: &ProveArgs, number: usize, stimulus: &str) -> Result<PathBuf, Failure> {
    let folder = args.out.as_deref().unwrap_or(Path::new(""));
    let first = args.files.first().and_then(|path| path.file_stem());
    let stem = first.map_or("program".into(), |stem| stem.to_string_lossy());
    let path = folder.join(format!("{stem}-refuted-{number}.csv"));
    if args.out.is_some() {
        fs::create_dir_all(folder).map_err(|error| Failure::file(folder, error))?;
    }
    fs::write(&path, stimulus).map_err(|error| Failure::file(&path, error))?;
    Ok(path)
}

/// Prints an answer.
fn show(
    format: FormatArg,
    question: &Question,
    answer: &Answer,
    stimulus: Option<&Path>,
) -> Result<(), Failure> {
    let text = match format {
        FormatArg::Json => format!("{}\n", as_json(question, answer, stimulus)),
        FormatArg::Human => as_text(question, answer, stimulus),
    };
    output::print(text.as_bytes())
}

fn place_of(reason: &plcc_prove::Reason) -> String {
    match &reason.place {
        Some((file, line)) => format!("{file}:{line} {}", reason.text),
        None => reason.text.clone(),
    }
}

fn as_json(question: &Question, answer: &Answer, stimulus: Option<&Path>) -> Value {
    let condition = &question.text;
    match answer {
        Answer::Proved { scans } => {
            json!({"condition": condition, "result": "proved", "scans": scans})
        }
        Answer::Refuted { scans, .. } => {
            let stimulus = stimulus.map(|path| path.to_string_lossy());
            json!({"condition": condition, "result": "refuted", "scans": scans, "stimulus": stimulus})
        }
        Answer::Undecided { scans, reason } => {
            let reason = place_of(reason);
            json!({"condition": condition, "result": "undecided", "scans": scans, "reason": reason})
        }
    }
}

fn as_text(question: &Question, answer: &Answer, stimulus: Option<&Path>) -> String {
    let condition = &question.text;
    match answer {
        Answer::Proved { .. } => format!("proved     {condition}\n"),
        Answer::Refuted { scans, .. } => {
            let file = stimulus.map(|path| path.display().to_string()).unwrap_or_default();
            format!("refuted    {condition}\n           in scan {} with {file}\n", scans - 1)
        }
        Answer::Undecided { scans, reason } => {
            let reason = place_of(reason);
            format!(
                "undecided  {condition}\n           {reason}; it is so in the first {scans} scans\n"
            )
        }
    }
}
