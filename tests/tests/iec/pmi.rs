//! PMI.

use std::path::Path;

use plcc_abi::Dialect;
use plcc_abi::machine::Machine;
use plcc_diag::SourceMap;
use plcc_frontend::common::Options;
use plcc_random::seeds;
use plcc_tests::{gen_pmi, idioms};

use crate::matiec;
use crate::run::{Compared, Rules, compare, compare_files, is_located_output};

/// Inputs and variables of the control are given; those that the control itself changes around a scan are not, since what they
/// do then is a part of what is compared.
fn is_given(name: &str) -> bool {
    name.starts_with('@') && !["@IPL", "@ESTOP", "@CRSET"].contains(&name)
}

/// The line `%IX1.0` is bit 0 of port 1.
fn line(address: &str) -> String {
    address.replace("%IX", "PORT")
}

/// A pulse of @CRSET is cleared at the end of the scan that sees it, not before the next one.
const RULES: Rules = Rules {
    dialect: Dialect::Pmi,
    is_given,
    line,
    differs: |name| name == "@CRSET",
    bits_alone: false,
    from_control: |_| None,
    is_output: is_located_output,
};

#[test]
fn generated_programs_scan_alike() {
    let Some(_) = matiec::folder() else { return };
    let (mut same, mut stopped) = (0, 0);
    for seed in seeds(12) {
        let case = gen_pmi::generate(seed, 20 + seed as usize % 50);
        match compare(&RULES, &[("case.pmi", &case.source)], seed) {
            Some(Compared::Same { stopped: stop }) => {
                same += 1;
                stopped += usize::from(stop.is_some());
            }
            other => panic!("{other:?}\n{}", case.source),
        }
    }
    eprintln!("{same} programs, {stopped} of them stopped");
}

#[test]
fn idioms_scan_alike() {
    let Some(_) = matiec::folder() else { return };
    for seed in seeds(12) {
        let source = idioms::pmi::generate(seed).source;
        match compare(&RULES, &[("case.pmi", &source)], seed) {
            Some(Compared::Same { .. }) => {}
            other => panic!("{other:?}\n{source}"),
        }
    }
}

#[test]
fn examples_and_conformance_cases_scan_alike() {
    let Some(_) = matiec::folder() else { return };
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut count = 0;
    let mut open = vec![root.join("examples"), root.join("tests/conformance/pmi")];
    while let Some(path) = open.pop() {
        if path.is_dir() {
            open.extend(std::fs::read_dir(&path).unwrap().map(|entry| entry.unwrap().path()));
            continue;
        }
        if path.extension().is_none_or(|ending| ending != "pmi") {
            continue;
        }
        let mut options = Options::default();
        let machine = path.with_extension("machine.toml");
        if machine.exists() {
            options.machine = Machine::parse(&std::fs::read_to_string(machine).unwrap()).unwrap();
        }
        options.limits = plcc_frontend::common::Limits::None;
        let mut sources = SourceMap::new();
        let file = plcc_tests::compile::add(&mut sources, &path).unwrap();
        match compare_files(&RULES, &mut sources, &[file], 1, &options) {
            Some(Compared::Same { .. }) => count += 1,
            // It has errors without the files that it includes.
            None => eprintln!("{} has errors", path.display()),
            other => panic!("{}: {other:?}", path.display()),
        }
    }
    assert!(count > 3, "{count}");
}
