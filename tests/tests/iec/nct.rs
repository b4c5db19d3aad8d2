//! NCT.

use std::path::Path;

use plcc_abi::Dialect;
use plcc_diag::SourceMap;
use plcc_frontend::common::Options;
use plcc_random::seeds;
use plcc_tests::{gen_nct, idioms};

use crate::matiec;
use crate::run::{Compared, Rules, compare, compare_files};

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
const RULES: Rules = Rules {
    dialect: Dialect::Nct,
    is_given: |name| name.starts_with("RH"),
    line,
    from_control,
    differs: |_| false,
    bits_alone: false,
    is_output: |_, _| false,
};

fn compare_all(generate: impl Fn(u64) -> String) {
    let Some(_) = matiec::folder() else { return };
    let (mut same, mut stopped, mut refused, mut seed) = (0, 0, 0, 0);
    let wanted = seeds(10).count();
    while same < wanted {
        seed += 1;
        let source = generate(seed);
        match compare(&RULES, &[("case.nct", &source)], seed) {
            Some(Compared::Same { stopped: stop }) => {
                same += 1;
                stopped += usize::from(stop.is_some());
            }
            Some(Compared::NotExported(why)) => {
                assert!(why.iter().all(|text| text.contains("NCT-X4")), "{why:?}");
                refused += 1;
            }
            None => panic!("{source}"),
        }
    }
    eprintln!("{same} programs, {stopped} of them stopped; {refused} not exported");
}

#[test]
fn generated_programs_run_alike() {
    compare_all(|seed| gen_nct::generate(seed, 20 + seed as usize % 50).source);
}

#[test]
fn idioms_run_alike() {
    compare_all(|seed| idioms::nct::generate(seed).source);
}

#[test]
fn examples_and_conformance_cases_run_alike() {
    let Some(_) = matiec::folder() else { return };
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let (mut count, mut refused) = (0, 0);
    let mut open = vec![root.join("examples/nct"), root.join("tests/conformance/nct")];
    while let Some(path) = open.pop() {
        if path.is_dir() {
            open.extend(std::fs::read_dir(&path).unwrap().map(|entry| entry.unwrap().path()));
            continue;
        }
        if path.extension().is_none_or(|ending| ending != "plc" && ending != "nct") {
            continue;
        }
        let mut sources = SourceMap::new();
        let file = plcc_tests::compile::add(&mut sources, &path).unwrap();
        let options = Options { limits: plcc_frontend::common::Limits::None, ..Options::default() };
        match compare_files(&RULES, &mut sources, &[file], 1, &options) {
            Some(Compared::Same { .. }) => count += 1,
            Some(Compared::NotExported(_)) => refused += 1,
            None => panic!("{}", path.display()),
        }
    }
    eprintln!("{count} programs; {refused} not exported");
    assert!(count > 15, "{count}");
}
