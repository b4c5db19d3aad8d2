//! `plcc test --broken`: runs the tests again with each feedback of the small machines stuck, and says which of these faults the
//! program tells nobody of.

use std::fmt::Write;

use plcc_plctest::{Act, PlannedTest, Station, Step, Told, run_through};
use plcc_runtime::{Executive, Feedback, Names, SimulatedExecutive, Value};
use serde::Serialize;

use super::Job;
use super::parallel::{Engines, parallel};
use super::program::TestProgram;
use super::scripts::TestScript;
use crate::args::{FormatArg, TestArgs};
use crate::failure::{DONE, ERRORS, Failure};
use crate::output;
use crate::report::Report;

/// The values at which a feedback is stuck.
const STUCK: [i64; 2] = [0, 1];

/// Makes controls one of whose feedbacks is broken.
struct BrokenStation<'p> {
    program: &'p TestProgram,
    /// The number of the feedback, and its value; `None` in a run in which nothing is broken.
    broken: Option<(usize, i64)>,
}

impl Station for BrokenStation<'_> {
    fn executive(&self) -> Result<Box<dyn Executive>, String> {
        let mut executive = self.program.made()?;
        let simulated = executive.as_any_mut().downcast_mut::<SimulatedExecutive>();
        if let (Some(simulated), Some((feedback, value))) = (simulated, self.broken) {
            simulated.stick(feedback, value);
        }
        Ok(executive)
    }
}

/// A feedback that is stuck.
struct Case<'j> {
    program: usize,
    number: usize,
    feedback: &'j Feedback,
    stuck: i64,
}

/// What the program says of a fault, and in which test.
enum Verdict<'j> {
    /// It shows a text.
    Told(&'j Job<'j>, String),
    /// It stops.
    Stopped(&'j Job<'j>, String),
    /// Nothing; with a condition that must never or always hold and is broken, if there is one.
    Untold(Option<(&'j TestScript, u32, String)>),
    /// Nothing, and no test sees another value.
    Unseen,
}

/// Runs the tests with broken feedbacks, and tells of them.
///
/// # Errors
/// When no script has small machines, or a control can't be made.
pub(super) fn broken(
    jobs: &[Job<'_>],
    programs: &[TestProgram],
    args: &TestArgs,
    report: &Report,
) -> Result<u8, Failure> {
    let mut feedbacks = vec![];
    for program in programs {
        let mut executive = program.made().map_err(Failure::usage)?;
        let simulated = executive.as_any_mut().downcast_mut::<SimulatedExecutive>();
        feedbacks.push(simulated.map_or_else(Vec::new, |simulated| simulated.feedbacks()));
    }
    let mut cases = vec![];
    for (program, feedbacks) in feedbacks.iter().enumerate() {
        for (number, feedback) in feedbacks.iter().enumerate() {
            cases.extend(STUCK.map(|stuck| Case { program, number, feedback, stuck }));
        }
    }
    if cases.is_empty() {
        return Err(Failure::usage(
            "nothing can break: no script says `simulate` and has a machine file with [[simulator.device]]",
        ));
    }
    // A test that breaks something itself does not show what this one fault does.
    let mut healthy = vec![];
    for job in jobs {
        let program = programs.get(job.script.program);
        let program = program.ok_or_else(|| Failure::internal("a test has no program"))?;
        let names = program.made().map_err(Failure::usage)?.names();
        if !breaks_something(job.test, &*names) {
            healthy.push(Job { script: job.script, test: job.test });
        }
    }
    let jobs = healthy.as_slice();
    let intact = parallel(jobs.len(), |at, engines| {
        let Some(job) = jobs.get(at) else { return Ok(Told::default()) };
        let names = feedbacks.get(job.script.program).into_iter().flatten();
        let names: Vec<String> = names.map(|feedback| feedback.name.clone()).collect();
        told(job, programs, None, &names, engines)
    })?;
    let verdicts = parallel(cases.len(), |at, engines| {
        let Some(case) = cases.get(at) else { return Ok(Verdict::Unseen) };
        judge(case, jobs, &intact, programs, engines)
    })?;
    let all: Vec<(&Case<'_>, &Verdict<'_>)> = cases.iter().zip(&verdicts).collect();
    let text = match args.source.message_format {
        FormatArg::Json => json(&all, programs),
        FormatArg::Human => human(&all, programs, report),
    };
    output::print(text.as_bytes())?;
    let all_told =
        verdicts.iter().all(|verdict| matches!(verdict, Verdict::Told(..) | Verdict::Stopped(..)));
    Ok(if all_told { DONE } else { ERRORS })
}

/// Whether a test forces something, or holds a small machine where it is.
fn breaks_something(test: &PlannedTest, names: &dyn Names) -> bool {
    let breaks = |act: &Act| match act {
        Act::Force(..) => true,
        Act::Set(key, _) | Act::Pulse(key, ..) => names.canonical(*key).starts_with("KEY.JAM "),
    };
    test.statements.iter().any(|statement| match &statement.step {
        Step::Act(acts) => acts.iter().any(breaks),
        _ => false,
    })
}

/// What the program tells in a test.
fn told(
    job: &Job<'_>,
    programs: &[TestProgram],
    broken: Option<(usize, i64)>,
    names: &[String],
    engines: &mut Engines,
) -> Result<Told, Failure> {
    let number = job.script.program;
    let program = programs.get(number).ok_or_else(|| Failure::internal("a test has no program"))?;
    let engine = engines.of(number, program)?;
    let station = BrokenStation { program, broken };
    let test: &PlannedTest = job.test;
    run_through(&job.script.plan, test, &station, engine, names).map_err(Failure::usage)
}

/// What the program says of a fault in its tests, one after the other, until it says something.
fn judge<'j>(
    case: &Case<'_>,
    jobs: &'j [Job<'j>],
    intact: &[Told],
    programs: &[TestProgram],
    engines: &mut Engines,
) -> Result<Verdict<'j>, Failure> {
    let (mut is_seen, mut breaks) = (false, None);
    let own = jobs.iter().zip(intact).filter(|(job, _)| job.script.program == case.program);
    for (job, intact) in own {
        let values = intact.values.get(case.number);
        // Where it always had this value, nothing is broken.
        if values.is_none_or(|values| values.iter().all(|value| *value == Value::Int(case.stuck))) {
            continue;
        }
        is_seen = true;
        let told = told(job, programs, Some((case.number, case.stuck)), &[], engines)?;
        if let Some(text) = told.texts.into_iter().find(|text| !intact.texts.contains(text)) {
            return Ok(Verdict::Told(job, text));
        }
        if let Some(stop) = told.stop.filter(|stop| intact.stop.as_ref() != Some(stop)) {
            return Ok(Verdict::Stopped(job, stop));
        }
        let invariant = told.broken.and_then(|at| job.script.plan.invariants.get(at));
        if let (Some(invariant), None) = (invariant, &breaks) {
            breaks = Some((job.script, invariant.line, invariant.text.clone()));
        }
    }
    Ok(if is_seen { Verdict::Untold(breaks) } else { Verdict::Unseen })
}

/// How many there are of each.
#[derive(Serialize)]
struct Counts {
    faults: usize,
    told: usize,
    untold: usize,
    unseen: usize,
}

impl Counts {
    fn of(all: &[(&Case<'_>, &Verdict<'_>)]) -> Self {
        let count = |wanted: fn(&Verdict<'_>) -> bool| {
            all.iter().filter(|(_, verdict)| wanted(verdict)).count()
        };
        Self {
            faults: all.len(),
            told: count(|verdict| matches!(verdict, Verdict::Told(..) | Verdict::Stopped(..))),
            untold: count(|verdict| matches!(verdict, Verdict::Untold(_))),
            unseen: count(|verdict| matches!(verdict, Verdict::Unseen)),
        }
    }
}

fn human(all: &[(&Case<'_>, &Verdict<'_>)], programs: &[TestProgram], report: &Report) -> String {
    let mut text = String::new();
    let mut shown = None;
    for (case, verdict) in all {
        if shown != Some(case.program) {
            shown = Some(case.program);
            let _ = writeln!(text, "{}", name_of(case, programs));
        }
        let Feedback { device, role, name } = case.feedback;
        let what = format!("{device}: {role} {name} stuck at {}", case.stuck);
        let (word, style, why) = match verdict {
            Verdict::Told(job, told) => {
                ("told  ", "32", format!("\"{told}\", in \"{}\"", job.test.name))
            }
            Verdict::Stopped(job, code) => {
                ("told  ", "32", format!("stops with {code}, in \"{}\"", job.test.name))
            }
            Verdict::Untold(None) => ("UNTOLD", "31;1", "no message, fault or stop".into()),
            Verdict::Untold(Some((script, line, broken))) => {
                let place = format!("{}:{line}: {broken}", script.path);
                ("UNTOLD", "31;1", format!("no message, fault or stop, and against {place}"))
            }
            Verdict::Unseen => ("UNSEEN", "33", "no test sees another value".into()),
        };
        let _ = writeln!(text, "  {} {what}: {why}", report.paint_result(word, style));
    }
    let Counts { faults, told, untold, unseen } = Counts::of(all);
    let faults = if faults == 1 { "1 fault".to_owned() } else { format!("{faults} faults") };
    let _ = writeln!(text, "{faults}: {told} told, {untold} untold, {unseen} unseen");
    text
}

fn name_of<'p>(case: &Case<'_>, programs: &'p [TestProgram]) -> &'p str {
    let program = programs.get(case.program);
    program.map_or("", |program| program.sources.path(plcc_diag::FileId(0)))
}

/// A fault as JSON has it.
#[derive(Serialize)]
struct Line<'l> {
    program: &'l str,
    device: &'l str,
    role: &'l str,
    input: &'l str,
    stuck: i64,
    result: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    script: Option<&'l str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    test: Option<&'l str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    text: Option<&'l str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    stop: Option<&'l str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    against: Option<&'l str>,
}

fn json(all: &[(&Case<'_>, &Verdict<'_>)], programs: &[TestProgram]) -> String {
    let mut text = String::new();
    for (case, verdict) in all {
        let Feedback { device, role, name } = case.feedback;
        let mut line = Line {
            program: name_of(case, programs),
            device,
            role,
            input: name,
            stuck: case.stuck,
            result: "told",
            script: None,
            test: None,
            text: None,
            stop: None,
            against: None,
        };
        match verdict {
            Verdict::Told(job, told) => {
                line.script = Some(&job.script.path);
                line.test = Some(&job.test.name);
                line.text = Some(told);
            }
            Verdict::Stopped(job, code) => {
                line.script = Some(&job.script.path);
                line.test = Some(&job.test.name);
                line.stop = Some(code);
            }
            Verdict::Untold(broken) => {
                line.result = "untold";
                if let Some((script, _, condition)) = broken {
                    line.script = Some(&script.path);
                    line.against = Some(condition);
                }
            }
            Verdict::Unseen => line.result = "unseen",
        }
        // JSON of these fields does not fail.
        let _ = writeln!(text, "{}", serde_json::to_string(&line).unwrap_or_default());
    }
    let counts = serde_json::to_string(&Counts::of(all)).unwrap_or_default();
    let _ = writeln!(text, "{counts}");
    text
}
