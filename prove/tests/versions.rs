//! Whether two versions of a program differ, compared with a search of all states of both.

#![allow(clippy::unwrap_used, clippy::panic, clippy::indexing_slicing, reason = "tests")]

mod support;

use std::time::Duration;

use fastrand::Rng;
use plcc_abi::Dialect;
use plcc_prove::product::{Comparison, Version, compare};
use support::Bench;

fn version(bench: &Bench) -> Version<'_> {
    Version { source: bench.source(), station: bench }
}

#[test]
fn changed_programs_are_told_apart_or_proved_equal() {
    let (mut same, mut different) = (0, 0);
    for seed in support::seeds(60) {
        let mut rng = Rng::with_seed(seed);
        let (text, _) = support::pmi(&mut rng);
        let changed = support::changed(&mut rng, &text);
        let old = Bench::new(Dialect::Pmi, &text);
        let Some(new) = Bench::try_new(Dialect::Pmi, &changed) else { continue };
        let answers = compare(version(&old), version(&new), Duration::from_secs(60)).unwrap();
        for output in ["X", "Y"] {
            let inputs = ["A", "B", "C"];
            let truth = support::first_difference(&old, &new, &inputs, output, 2_000);
            let Some(truth) = truth else { continue };
            let (_, answer) = answers.iter().find(|(name, _)| name == output).unwrap();
            match (answer, truth) {
                (Comparison::Same, None) => same += 1,
                (Comparison::Different { scans, .. }, Some(tick)) if *scans > tick => {
                    different += 1;
                }
                _ => panic!(
                    "seed {seed}, {output}: {answer:?}, and the search says {truth:?}\n{text}\n{changed}"
                ),
            }
        }
    }
    eprintln!("{same} same, {different} different");
    assert!(same > 0 && different > 0, "{same} same, {different} different");
}

#[test]
fn the_same_program_in_other_words_is_the_same() {
    let head = "$INPUT\nA = 0/0\nB = 0/1\n$OUTPUT\nX = 1/0\n$TIMER\nE/TC/DC = 500\n$END\n";
    let old = Bench::new(Dialect::Pmi, &format!("{head}TC = A & B\nX = DC ! A & /B\n"));
    let new = Bench::new(
        Dialect::Pmi,
        &format!("{head}L = /(/A ! /B)\nTC = L\nIF (DC)\nX = T\nELSE\nX = A & /L\nENDIF\n"),
    );
    let answers = compare(version(&old), version(&new), Duration::from_secs(20)).unwrap();
    assert!(matches!(answers.as_slice(), [(name, Comparison::Same)] if name == "X"), "{answers:?}");
}
