//! How long the functions are into which long PLCs are divided: long where the program works on single bits,
//! which pays (`BIT_CHUNK` in frontend/src/pmac/lower/mod.rs), and short elsewhere, where it would not.

#![allow(clippy::unwrap_used)]

use std::fmt::Write as _;

use plcc_abi::Dialect;
use plcc_diag::SourceMap;
use plcc_frontend::common::Options;
use plcc_tests::compile::compile_sources;

/// The length of the longest function of a PLCC with these statements, before it is optimised.
fn longest_function(definitions: &str, statements: impl Iterator<Item = String>) -> usize {
    let mut source = format!("CLOSE\n{definitions}OPEN PLCC 1 CLEAR\n");
    for statement in statements {
        writeln!(source, "{statement}").unwrap();
    }
    source.push_str("CLOSE\n");
    let mut sources = SourceMap::new();
    let file = sources.add("long.pmc", source.as_bytes());
    let compiled =
        compile_sources(&mut sources, &[file], Dialect::Pmac, &Options::default()).unwrap();
    let [plain, _] = compiled.modules();
    plain.funcs().map(|(_, func)| func.length()).max().unwrap()
}

#[test]
fn functions_that_work_on_single_bits_are_long() {
    let definitions: String =
        (0..48).map(|n| format!("M{n}->X:$07{:02x},{}\n", n / 24, n % 24)).collect();
    let statements = |n: usize| format!("M{}=M{}&M{}", n % 48, (n + 5) % 48, (n + 11) % 48);
    let longest = longest_function(&definitions, (0..6000).map(statements));
    assert!((15_000..25_000).contains(&longest), "{longest}");
}

#[test]
fn functions_of_floating_point_are_short() {
    let statements = |n: usize| format!("P{}=P{}*1.5+P{}", n % 48, (n + 5) % 48, (n + 11) % 48);
    let longest = longest_function("", (0..6000).map(statements));
    assert!((2000..4000).contains(&longest), "{longest}");
}

/// A few statements on bits among many of floating point do not make functions long.
#[test]
fn functions_with_few_bits_are_short() {
    let statements = |n: usize| match n % 40 {
        0 => "M0=1-M0".to_owned(),
        _ => format!("P{}=P{}*1.5+P{}", n % 48, (n + 5) % 48, (n + 11) % 48),
    };
    let longest = longest_function("M0->X:$0700,3\n", (0..6000).map(statements));
    assert!((2000..4000).contains(&longest), "{longest}");
}
