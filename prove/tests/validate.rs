//! Whether the optimised IR does what the unoptimised IR does is proved, and a wrong rewrite is refuted.

#![allow(clippy::unwrap_used, clippy::panic, clippy::indexing_slicing, reason = "tests")]

mod support;

use std::time::{Duration, Instant};

use plcc_abi::Dialect;
use plcc_ir::passes::{OptLevel, optimize};
use plcc_prove::validate::{Validation, Verdict};

/// What is found out about each function of a program, and the time it took.
fn answers(dialect: Dialect, text: &str, time: Duration) -> Option<Vec<(String, Verdict, Duration)>> {
    let before = support::Bench::try_new(dialect, text)?.lowered.module;
    let mut after = before.clone();
    optimize(&mut after, OptLevel::Speed);
    let validation = Validation::new(&before, &after);
    let answer = |number| {
        let begin = Instant::now();
        let answer = validation.function(number, time);
        (answer.function, answer.verdict, begin.elapsed())
    };
    Some((0..validation.len()).map(answer).collect())
}

#[test]
fn files_are_validated() {
    let Ok(files) = std::env::var("PLCC_VALIDATE") else { return };
    for file in files.split(' ') {
        let bytes = std::fs::read(file).unwrap();
        let text = String::from_utf8_lossy(&bytes);
        let dialect = match file {
            it if it.ends_with(".pmi") => Dialect::Pmi,
            it if it.contains("nct") => Dialect::Nct,
            _ => Dialect::Pmac,
        };
        for (name, verdict, time) in answers(dialect, &text, Duration::from_secs(20)).unwrap_or_default() {
            eprintln!("{file} {name} {time:?} {verdict:?}");
        }
    }
}
