//! `plcc prove`: whether conditions hold in every scan, for all inputs.

use std::io::IsTerminal;
use std::path::{Path, PathBuf};

use plcc_diag::{Diagnostic, SourceMap, Span};
use plcc_files::{MAX_SETTINGS, read_regular, why_not_read};
use plcc_plctest::{Plan, parse};
use plcc_prove::aiger::Coding;
use plcc_prove::contrary::{Pair, pairs};
use plcc_prove::{Answer, Inquiry, Question, Reason};
use serde_json::{Value, json};

use crate::args::{Contrary, FormatArg, ProofForm, ProveArgs};
use crate::failure::{DONE, ERRORS, Failure, USAGE};
use crate::input::{Input, SourceSettings};
use crate::output;
use crate::proof::{Bench, stimulus_file};
use crate::report::{Destination, Report};

/// The exit status if something is refuted or differs.
const REFUTED: u8 = 1;

/// The exit status if something could not be decided, and nothing is refuted.
const UNDECIDED: u8 = 5;

pub(crate) fn prove(args: &ProveArgs, report: &Report) -> Result<u8, Failure> {
    let options = [&args.never, &args.always, &args.after];
    let no_condition = options.iter().all(|given| given.is_empty()) && args.script.is_empty();
    if no_condition && args.contrary.is_none() {
        return Err(Failure::usage(
            "nothing is asked: give a condition with --never, --always or --after, or a script with --script; --contrary \
             proposes conditions",
        ));
    }
    let settings = SourceSettings::for_files(&args.source, &args.files, report)?;
    let program = Input::read(&args.files, &args.source)?.check(&settings)?;
    let to = Destination::from(args.source.message_format);
    let Some((checked, _)) = program.without_errors(to, report)? else { return Ok(ERRORS) };
    let bench =
        Bench::new(checked, &args.control, settings.machine_file(), args.retained_as_declared)?;
    let mut because = vec![];
    let mut scripts = scripts(args)?;
    if let Some(contrary) = args.contrary {
        let given = Inquiry::new(bench.subject(), &[]).given();
        let pairs = pairs(bench.lowered.program.dialect(), &*bench.names, &given);
        if pairs.is_empty() {
            report.note("no outputs are contrary by their names or by what is said of them");
        }
        match contrary {
            Contrary::Tell => tell(args.source.message_format, &pairs)?,
            Contrary::Ask => {
                scripts.extend(pairs.iter().map(|pair| script("never", &pair.condition)));
                let own = |pair: Pair| (format!("never {}", pair.condition), pair.because);
                because.extend(pairs.into_iter().map(own));
            }
        }
    }
    let mut questions = vec![];
    for (sources, found) in scripts {
        match questions_of(&bench, &sources, found) {
            Ok(found) => questions.extend(found),
            Err(mistakes) => {
                report.show(&sources, &mistakes, to)?;
                return Ok(USAGE);
            }
        }
    }
    if let Some(ProofForm::Aiger) = args.emit {
        if questions.is_empty() {
            return Err(Failure::usage("nothing is asked, so that there is nothing to write"));
        }
        return emit_aiger(args, &bench, &questions, report);
    }
    let (mut refuted, mut undecided) = (0, 0);
    let inquiry = Inquiry::new(bench.subject(), &questions);
    for question in &questions {
        let answer = inquiry.answer(question, args.timeout);
        let answer = answer.unwrap_or_else(|text| Answer::Undecided {
            scans: 0,
            reason: not_followed(text, args.files.first()),
        });
        let stimulus = match &answer {
            Answer::Refuted { stimulus, .. } => {
                refuted += 1;
                let name = format!("refuted-{refuted}");
                Some(stimulus_file(&args.files, args.out.as_deref(), &name, stimulus)?)
            }
            Answer::Undecided { .. } => {
                undecided += 1;
                None
            }
            Answer::Proved { .. } => None,
        };
        let because = because.iter().find(|(text, _)| *text == question.text);
        let because = because.map(|(_, because)| because.as_str());
        show(args.source.message_format, question, &answer, stimulus.as_deref(), because)?;
    }
    Ok(status(refuted, undecided))
}

/// Writes the program with the questions as an AIGER file, and tells what of the program is not in it.
fn emit_aiger(
    args: &ProveArgs,
    bench: &Bench,
    questions: &[Question],
    report: &Report,
) -> Result<u8, Failure> {
    let stem = args.files.first().and_then(|path| path.file_stem());
    let usual = Path::new(stem.unwrap_or("program".as_ref())).with_extension("aig");
    let path = match &args.out {
        Some(path) if path.is_dir() => path.join(usual),
        Some(path) => path.clone(),
        None => usual,
    };
    let coding = match path.extension() {
        Some(ending) if ending == "aag" => Coding::Text,
        _ => Coding::Binary,
    };
    if output::is_stdout(&path) && std::io::stdout().is_terminal() {
        let what = "the binary form is not written to a terminal; name a file with -o";
        return Err(Failure::usage(what));
    }
    let file = bench.subject().aiger(questions, coding).map_err(Failure::usage)?;
    for reason in &file.not_followed {
        report.note(&format!("{}: the file leaves open what it does", place_of(reason)));
    }
    output::write(&path, &file.bytes, &SourceMap::new(), &args.files)?;
    Ok(DONE)
}

/// The exit status, where a number of things are refuted or differ, and others could not be decided.
pub(crate) fn status(refuted: usize, undecided: usize) -> u8 {
    match (refuted, undecided) {
        (0, 0) => DONE,
        (0, _) => UNDECIDED,
        _ => REFUTED,
    }
}

/// Why nothing is known of a program whose language is not followed; the place is where it begins.
pub(crate) fn not_followed(text: String, file: Option<&PathBuf>) -> Reason {
    Reason { text, place: file.map(|file| (file.display().to_string(), 1)) }
}

/// The questions of a script, or what is wrong with it.
fn questions_of(
    bench: &Bench,
    sources: &SourceMap,
    file: plcc_diag::FileId,
) -> Result<Vec<Question>, Vec<Diagnostic>> {
    let (script, mistakes) = parse(sources, file);
    if !mistakes.is_empty() {
        return Err(mistakes);
    }
    let text = |span: Span| sources.slice(span);
    let (checked, program) = (bench.checked.program(), &bench.lowered.program);
    let plan = Plan::new(&script, &text, checked, program, &*bench.names)?;
    let question =
        |it: plcc_plctest::Invariant| Question { text: it.text.trim().to_owned(), claim: it.claim };
    Ok(plan.invariants.into_iter().map(question).collect())
}

/// The script of a condition that stands after an option.
fn script(word: &str, condition: &str) -> (SourceMap, plcc_diag::FileId) {
    let line = condition.replace(['\n', '\r'], " ");
    let text = format!("program \"-\"\n{word} {line}\n");
    let mut sources = SourceMap::new();
    let file = sources.add(format!("--{word}"), text.as_bytes());
    (sources, file)
}

/// Tells which outputs are contrary, and how to ask of each pair.
fn tell(format: FormatArg, pairs: &[Pair]) -> Result<(), Failure> {
    let mut text = String::new();
    for Pair { outputs, because, condition } in pairs {
        match format {
            FormatArg::Json => {
                let condition = format!("never {condition}");
                let pair = json!({"condition": condition, "outputs": outputs, "because": because});
                text.push_str(&format!("{pair}\n"));
            }
            FormatArg::Human => {
                text.push_str(&format!("--never '{condition}'\n           {because}\n"));
            }
        }
    }
    output::print(text.as_bytes())
}

/// The scripts with the questions: those that are named, and one of the conditions on the command line.
fn scripts(args: &ProveArgs) -> Result<Vec<(SourceMap, plcc_diag::FileId)>, Failure> {
    let mut all = vec![];
    let options = [("never", &args.never), ("always", &args.always), ("after", &args.after)];
    for (word, conditions) in options {
        for condition in conditions {
            all.push(script(word, condition));
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

/// Prints an answer.
fn show(
    format: FormatArg,
    question: &Question,
    answer: &Answer,
    stimulus: Option<&Path>,
    because: Option<&str>,
) -> Result<(), Failure> {
    let text = match format {
        FormatArg::Json => {
            let mut object = as_json(question, answer, stimulus);
            if let (Value::Object(fields), Some(because)) = (&mut object, because) {
                fields.insert("because".into(), because.into());
            }
            format!("{object}\n")
        }
        FormatArg::Human => {
            let mut text = as_text(question, answer, stimulus);
            if let Some(because) = because {
                text.push_str(&format!("           {because}\n"));
            }
            text
        }
    };
    output::print(text.as_bytes())
}

pub(crate) fn place_of(reason: &Reason) -> String {
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
            let so_far = match scans {
                0 => String::new(),
                _ => format!("; it is so in the first {scans} scans"),
            };
            format!("undecided  {condition}\n           {reason}{so_far}\n")
        }
    }
}
