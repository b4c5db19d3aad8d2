//! NCT.

use plcc_abi::Dialect;
use plcc_random::seeds;
use plcc_tests::{gen_nct, idioms};

use crate::batch::{Batch, files};
use crate::case::Rules;
use crate::source::{exported, on_its_machine};

/// The line `%IX1.2` is P012.
fn line(address: &str) -> String {
    let place = address.trim_start_matches("%IX");
    let (byte, bit) = place.split_once('.').unwrap();
    format!("P{:02}{bit}", byte.parse::<u8>().unwrap())
}

/// What the NC gives as I510 is NC510.
fn from_control(name: &str) -> Option<String> {
    let digits =
        name.strip_prefix("NC").filter(|rest| rest.starts_with(|c: char| c.is_ascii_digit()));
    // The control itself sets these.
    digits.filter(|digits| !["510", "543"].contains(digits)).map(|digits| format!("I{digits}"))
}

/// Timers and registers may be set by the operator or the NC.
static RULES: Rules = Rules {
    dialect: Dialect::Nct,
    is_given: |name| name.starts_with("RH"),
    line,
    from_control,
    differs: |_| false,
    bits_alone: false,
    is_output: |_, _| false,
    refusal: "NCT-X4",
};

/// IronPLC inverts all bits of what a comparison of unsigned numbers gives, where `NOT` is in front of it.
#[test]
fn comparisons_of_words_are_not_inverted_by_not() {
    let source =
        ":001\nLF020 <=5 GF040 Z U010\nLF020 (I000 A >5) GF040 Z U011\nJ1 :000 J0 :010 U012 R\n";
    let text = exported(&RULES, "case.nct", source);
    for condition in ["OP <= 5", "I000 AND OP > 5"] {
        assert!(text.contains(&format!("IF ({condition}) = FALSE THEN")), "{text}");
    }
    let Some(mut batch) = Batch::new(&RULES) else { return };
    batch.generated("case.nct", source, 1);
    batch.finish("NCT, comparisons");
}

/// Compares as many programs as are wanted, so that those which can't be exported do not count.
fn compare_all(what: &str, generate: impl Fn(u64) -> String) {
    let Some(mut batch) = Batch::new(&RULES) else { return };
    let seeds = seeds(10);
    let wanted = seeds.clone().count();
    for seed in seeds.start.. {
        if batch.len() >= wanted {
            break;
        }
        batch.generated("case.nct", &generate(seed), seed);
    }
    batch.finish(what);
}

#[test]
fn generated_programs_run_alike() {
    compare_all("NCT, generated", |seed| gen_nct::generate(seed, 20 + seed as usize % 50).source);
}

#[test]
fn idioms_run_alike() {
    compare_all("NCT, idioms", |seed| idioms::nct::generate(seed).source);
}

#[test]
fn examples_and_conformance_cases_run_alike() {
    let Some(mut batch) = Batch::new(&RULES) else { return };
    let folders = ["examples/nct", "examples/desk", "tests/conformance/nct"];
    for path in files(&folders, &["plc", "nct"]) {
        batch.file(&path, &on_its_machine(&path));
    }
    let tally = batch.finish("NCT, files");
    assert!(tally.compared > 15, "{tally:?}");
}
