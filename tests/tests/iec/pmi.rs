//! PMI.

use plcc_abi::Dialect;
use plcc_random::seeds;
use plcc_tests::{gen_pmi, idioms};

use crate::batch::{Batch, files};
use crate::case::{Rules, is_located_output};
use crate::source::{exported, on_its_machine};

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
static RULES: Rules = Rules {
    dialect: Dialect::Pmi,
    is_given,
    line,
    differs: |name| name == "@CRSET",
    bits_alone: false,
    from_control: |_| None,
    is_output: is_located_output,
    refusal: "",
};

/// STruC++ takes no first values for arrays.
#[test]
fn constant_arrays_are_assigned_in_the_first_scan() {
    let source = "$INTEGER\nTABLE[2]=[10,-20],SUM,I\n$END\nSUM = TABLE[I] + TABLE[1]\nI = 1 - I\n";
    let text = exported(&RULES, "case.pmi", source);
    assert!(text.contains("    TABLE : ARRAY [0..1] OF INT;\n"), "{text}");
    let assigned = "  IF FIRST_SCAN THEN\n    TABLE[0] := 10;\n    TABLE[1] := -20;\n  END_IF;\n";
    assert!(text.contains(assigned), "{text}");
    let Some(mut batch) = Batch::new(&RULES) else { return };
    batch.generated("case.pmi", source, 1);
    batch.finish("PMI, constant arrays");
}

#[test]
fn generated_programs_scan_alike() {
    let Some(mut batch) = Batch::new(&RULES) else { return };
    for seed in seeds(12) {
        batch.generated("case.pmi", &gen_pmi::generate(seed, 20 + seed as usize % 50).source, seed);
    }
    batch.finish("PMI, generated");
}

#[test]
fn idioms_scan_alike() {
    let Some(mut batch) = Batch::new(&RULES) else { return };
    for seed in seeds(12) {
        batch.generated("case.pmi", &idioms::pmi::generate(seed).source, seed);
    }
    batch.finish("PMI, idioms");
}

#[test]
fn examples_and_conformance_cases_scan_alike() {
    let Some(mut batch) = Batch::new(&RULES) else { return };
    for path in files(&["examples", "tests/conformance/pmi"], &["pmi"]) {
        batch.file(&path, &on_its_machine(&path));
    }
    let tally = batch.finish("PMI, files");
    assert!(tally.compared > 3, "{tally:?}");
}
