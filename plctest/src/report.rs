//! What is told of tests that were run: lines for people, JSON for programs, JUnit XML for build servers.

use std::fmt::Write;
use std::time::Duration;

use quick_junit::{NonSuccessKind, Report, TestCase, TestCaseStatus, TestSuite};
use serde::Serialize;

use crate::run::{Failure, Outcome};

/// A test that was run.
#[derive(Clone, Debug)]
pub struct Ran {
    /// The path of its script.
    pub script: String,
    /// Its name.
    pub name: String,
    /// The line of `test`.
    pub line: u32,
    /// How it went.
    pub outcome: Outcome,
    /// Why the value is so that failed it, in sentences.
    pub why: Option<String>,
    /// The record of the run.
    pub record: Option<String>,
    /// How long it took here.
    pub took: Duration,
}

/// How many tests there were.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Counts {
    /// All.
    pub tests: usize,
    /// Those that passed.
    pub passed: usize,
    /// The others.
    pub failed: usize,
}

impl Counts {
    /// Counts tests.
    pub fn of(all: &[Ran]) -> Self {
        let failed = all.iter().filter(|ran| ran.outcome.failure.is_some()).count();
        Self { tests: all.len(), passed: all.len() - failed, failed }
    }
}

/// The lines for people: each script with its tests, of a test that failed why.
pub fn human(all: &[Ran], paint: &dyn Fn(&str, bool) -> String) -> String {
    let mut text = String::new();
    let mut script = None;
    for ran in all {
        if script != Some(&ran.script) {
            let _ = writeln!(text, "{}", ran.script);
            script = Some(&ran.script);
        }
        let time = seconds(ran.outcome.time_ns);
        let ticks = match ran.outcome.ticks {
            1 => "1 tick".to_owned(),
            ticks => format!("{ticks} ticks"),
        };
        let Some(failure) = &ran.outcome.failure else {
            let _ = writeln!(text, "  {} {} ({ticks}, {time})", paint("ok    ", true), ran.name);
            continue;
        };
        let _ = writeln!(text, "  {} {} ({ticks}, {time})", paint("FAILED", false), ran.name);
        for line in lines(ran, failure) {
            let _ = writeln!(text, "         {line}");
        }
    }
    let Counts { tests, passed, failed } = Counts::of(all);
    let tests = if tests == 1 { "1 test".to_owned() } else { format!("{tests} tests") };
    let _ = match failed {
        0 => writeln!(text, "{tests} passed"),
        failed => writeln!(text, "{tests}: {passed} passed, {failed} failed"),
    };
    text
}

/// What is told of a failure.
fn lines(ran: &Ran, failure: &Failure) -> Vec<String> {
    let mut lines = vec![format!("{}:{}: {}", ran.script, failure.line, failure.statement)];
    let when = match failure.tick {
        Some(tick) => format!(", in tick {tick}"),
        None => String::new(),
    };
    let power = match failure.powered {
        0 | 1 => String::new(),
        2 => " after a power cycle".to_owned(),
        times => format!(" after {} power cycles", times - 1),
    };
    lines.push(format!("{}{when}{power}", failure.message));
    if !failure.values.is_empty() {
        let values = failure.values.iter().map(|(name, value)| format!("{name} = {value}"));
        lines.push(values.collect::<Vec<_>>().join(", "));
    }
    if let Some((line, statement)) = &failure.during {
        lines.push(format!("during {}:{line}: {statement}", ran.script));
    }
    if !failure.events.is_empty() {
        let events = failure.events.iter().map(|text| format!("\"{text}\""));
        lines.push(format!("the last events: {}", events.collect::<Vec<_>>().join(", ")));
    }
    lines.extend(ran.why.iter().flat_map(|why| why.lines()).map(str::to_owned));
    lines.extend(ran.record.iter().map(|record| format!("the record of the run: {record}")));
    lines
}

/// A time in seconds.
fn seconds(ns: u64) -> String {
    format!("{}.{:02} s", ns / 1_000_000_000, ns / 10_000_000 % 100)
}

/// A test as JSON has it.
#[derive(Serialize)]
struct Line<'r> {
    script: &'r str,
    test: &'r str,
    line: u32,
    result: &'static str,
    ticks: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    failure: Option<FailureLine<'r>>,
}

#[derive(Serialize)]
struct FailureLine<'r> {
    line: u32,
    statement: &'r str,
    message: &'r str,
    tick: Option<u64>,
    values: serde_json::Map<String, serde_json::Value>,
    events: &'r [String],
    #[serde(skip_serializing_if = "Option::is_none")]
    why: Option<&'r str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    record: Option<&'r str>,
}

/// A line of JSON for each test, and one with their numbers.
pub fn json(all: &[Ran]) -> String {
    let mut text = String::new();
    for ran in all {
        let failure = ran.outcome.failure.as_ref().map(|failure| FailureLine {
            line: failure.line,
            statement: &failure.statement,
            message: &failure.message,
            tick: failure.tick,
            values: failure
                .values
                .iter()
                .map(|(name, value)| {
                    (
                        name.clone(),
                        serde_json::from_str(value).unwrap_or_else(|_| value.as_str().into()),
                    )
                })
                .collect(),
            events: &failure.events,
            why: ran.why.as_deref(),
            record: ran.record.as_deref(),
        });
        let line = Line {
            script: &ran.script,
            test: &ran.name,
            line: ran.line,
            result: if failure.is_some() { "failed" } else { "passed" },
            ticks: ran.outcome.ticks,
            failure,
        };
        // JSON of these fields does not fail.
        text.push_str(&serde_json::to_string(&line).unwrap_or_default());
        text.push('\n');
    }
    text.push_str(&serde_json::to_string(&Counts::of(all)).unwrap_or_default());
    text.push('\n');
    text
}

/// The report that Jenkins, GitLab and GitHub read: a suite for each script, a case for each test.
///
/// # Errors
/// When a text can't be written in XML.
pub fn junit(all: &[Ran]) -> Result<String, String> {
    let mut report = Report::new("plcc test");
    let mut suites: Vec<TestSuite> = vec![];
    for ran in all {
        let status = match &ran.outcome.failure {
            None => TestCaseStatus::success(),
            Some(failure) => {
                let mut status = TestCaseStatus::non_success(NonSuccessKind::Failure);
                status.set_message(failure.message.clone());
                status.set_type("failed");
                status.set_description(lines(ran, failure).join("\n"));
                status
            }
        };
        let mut case = TestCase::new(ran.name.clone(), status);
        case.set_classname(ran.script.clone());
        case.set_time(ran.took);
        case.extra.insert("file".into(), ran.script.clone().into());
        case.extra.insert("line".into(), ran.line.to_string().into());
        match suites.last_mut().filter(|suite| suite.name.as_str() == ran.script) {
            Some(suite) => drop(suite.add_test_case(case)),
            None => {
                let mut suite = TestSuite::new(ran.script.clone());
                suite.add_test_case(case);
                suites.push(suite);
            }
        }
    }
    for mut suite in suites {
        let took = |case: &TestCase| case.time.unwrap_or_default();
        let time: Duration = suite.test_cases.iter().map(took).sum();
        suite.set_time(time);
        report.add_test_suite(suite);
    }
    report.set_time(all.iter().map(|ran| ran.took).sum());
    report.to_string().map_err(|error| error.to_string())
}
