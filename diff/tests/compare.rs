//! Pairs of versions, and the statements that differ.
#![allow(clippy::unwrap_used, clippy::indexing_slicing)]

use plcc_diag::SourceMap;
use plcc_diff::{Change, Difference, Version, compare};
use plcc_frontend::common::{MemoryLoader, Options};
use plcc_frontend::language::{LANGUAGES, Language};

/// A language, by its place in the list.
#[derive(Clone, Copy)]
enum Dialect {
    Pmi,
    Nct,
    Pmac,
}

fn language(dialect: Dialect) -> &'static dyn Language {
    LANGUAGES[dialect as usize]
}

fn version(dialect: Dialect, text: &str) -> Version {
    let mut sources = SourceMap::new();
    let file = sources.add("a", text.as_bytes());
    let words =
        language(dialect).words(&mut sources, &[file], &MemoryLoader::new(), &Options::default());
    Version { sources, words }
}

/// What has changed: the change, the text of the statement, the names that depend on it.
fn found(dialect: Dialect, old: &str, new: &str) -> Vec<(Change, String, Vec<String>)> {
    let (old, new) = (version(dialect, old), version(dialect, new));
    let show = |it: Difference| {
        let text = match (it.new, it.old) {
            (Some(span), _) => new.sources.slice(span),
            (None, Some(span)) => old.sources.slice(span),
            (None, None) => "",
        };
        let names = it.affected.into_iter().map(|it| it.name).collect();
        (it.change, text.to_owned(), names)
    };
    compare(&old, &new).into_iter().map(show).collect()
}

const HEAD: &str =
    "$INPUT\nDOOR = 1/0\n$OUTPUT\nLAMP = 2/0\nMOTOR = 2/1\n$TIMER\nE/T1/T1D = 50\n$END\n";

fn pmi(old: &str, new: &str) -> Vec<(Change, String, Vec<String>)> {
    found(Dialect::Pmi, &format!("{HEAD}{old}"), &format!("{HEAD}{new}"))
}

fn row(change: Change, text: &str, names: &[&str]) -> (Change, String, Vec<String>) {
    (change, text.to_owned(), names.iter().map(|&name| name.to_owned()).collect())
}

#[test]
fn layout_and_comments_do_not_count() {
    assert_eq!(pmi("A = DOOR & B\n", "  A=DOOR &# x\n B ? note\n"), []);
    let old = "$INPUT\nDOOR = 1/0\n$END\nA = DOOR\n";
    let new = "? the gate\n$INPUT\nGATE = 1/0 ? was DOOR\n$END\nA = GATE\n";
    assert_eq!(found(Dialect::Pmi, old, new), []);
    let old = "#define LIMIT 15\nOPEN PLC1 CLEAR\nP1=LIMIT\nCLOSE\n";
    let new = "OPEN PLC 1 CLEAR\nP1 = $0F ; limit\nCLOSE\n";
    assert_eq!(found(Dialect::Pmac, old, new), []);
}

#[test]
fn a_changed_statement_is_found_with_what_depends_on_it() {
    let (old, new) =
        ("A = DOOR\nT1 = A\nLAMP = T1D\nMOTOR = B\n", "A = /DOOR\nT1 = A\nLAMP = T1D\nMOTOR = B\n");
    assert_eq!(pmi(old, new), [row(Change::Changed, "A = /DOOR", &["A", "T1", "T1D", "LAMP"])]);
    let found = compare(
        &version(Dialect::Pmi, &format!("{HEAD}{old}")),
        &version(Dialect::Pmi, &format!("{HEAD}{new}")),
    );
    let lamp = found[0].affected.iter().find(|it| it.name == "LAMP").unwrap();
    assert_eq!(lamp.via, ["A", "T1", "T1D"]);
}

#[test]
fn a_changed_condition_changes_its_body() {
    let old = "IF (DOOR)\nLAMP = T\nELSE\nMOTOR = T\nENDIF\nB = A\n";
    let new = "IF (DOOR & A)\nLAMP = T\nELSE\nMOTOR = T\nENDIF\nB = A\n";
    assert_eq!(pmi(old, new), [row(Change::Changed, "IF (DOOR & A)", &["LAMP", "MOTOR"])]);
}

#[test]
fn statements_come_and_go() {
    assert_eq!(
        pmi("LAMP = A\n", "LAMP = A\nMOTOR = A\n"),
        [row(Change::Added, "MOTOR = A", &["MOTOR"])]
    );
    assert_eq!(
        pmi("LAMP = A\nMOTOR = A\n", "MOTOR = A\n"),
        [row(Change::Removed, "LAMP = A", &["LAMP"])]
    );
}

#[test]
fn a_moved_statement_counts_where_order_matters() {
    // Nothing that it passes has to do with it.
    assert_eq!(pmi("A = DOOR\nLAMP = B\nMOTOR = C\n", "LAMP = B\nMOTOR = C\nA = DOOR\n"), []);
    // MOTOR reads A, which now still has its value of the scan before.
    assert_eq!(
        pmi("A = DOOR\nLAMP = B\nMOTOR = A\n", "LAMP = B\nMOTOR = A\nA = DOOR\n"),
        [row(Change::Moved, "A = DOOR", &["A", "MOTOR"])]
    );
}

#[test]
fn declarations_count_by_what_they_declare() {
    let old = format!("{HEAD}T1 = A\nLAMP = T1D\n");
    let new = old.replace("= 50", "= 60");
    let found = found(Dialect::Pmi, &old, &new);
    assert_eq!(found, [row(Change::Changed, "E/T1/T1D = 60", &["T1", "T1D", "LAMP"])]);
}

#[test]
fn what_a_jump_leaves_out_depends_on_it_and_what_a_call_passes_does_not() {
    let old = ":001 I012 C005 Z U020 J1\n:005 U012 R\n:000 J0\n";
    let found_of = |old: &str, new: &str| found(Dialect::Nct, old, new);
    let new = old.replace("I012", "NI012");
    assert_eq!(found_of(old, &new), [row(Change::Changed, "NI012", &["Y012"])]);
    let old = old.replace("C005", "G005");
    let new = old.replace("I012", "NI012");
    assert_eq!(found_of(&old, &new), [row(Change::Changed, "NI012", &["Y012", "Y020"])]);
}

#[test]
fn subroutines_and_programs_are_followed() {
    let old = ":001 I012 C005 Z J1\n:005 U012 R\n:000 J0\n";
    let new = ":001 NI012 C005 Z J1\n:005 U012 R\n:000 J0\n";
    assert_eq!(found(Dialect::Nct, old, new), [row(Change::Changed, "NI012", &["Y012"])]);
    let old = "OPEN PLC 1 CLEAR\nIF (P1=1)\nENABLE PLC 2\nENDIF\nCLOSE\nOPEN PLC 2 CLEAR\nM1=1\nCMD\"#1J+\"\nCLOSE\n";
    let new = old.replace("P1=1", "P1=2");
    assert_eq!(
        found(Dialect::Pmac, old, &new),
        [row(Change::Changed, "IF (P1=2)", &["M1", "CMD\"#1J+\""])]
    );
}
