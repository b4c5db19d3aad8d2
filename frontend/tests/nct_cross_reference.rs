//! NCT's cross-reference (NCT 5, STAT): where variables are used, and the warnings of variables
//! that seem to be forgotten.
#![allow(clippy::unwrap_used, clippy::panic, clippy::indexing_slicing)]

use plcc_diag::SourceMap;
use plcc_frontend::{
    common::{CrossReference, MemoryLoader, Options},
    nct,
};

/// The cross-reference of a program, and the code and line of each of its warnings.
fn cross_reference(text: &str) -> (CrossReference, Vec<(&'static str, u32)>) {
    let mut sources = SourceMap::new();
    let file = sources.add("main.nct", text.as_bytes());
    let (program, all) = nct::check(&mut sources, file, &MemoryLoader::new(), &Options::default());
    let cross_reference = program.unwrap_or_else(|| panic!("{all:?}")).cross_reference();
    let warnings: Vec<_> = cross_reference
        .warnings
        .iter()
        .map(|w| (w.code, sources.line_col(file, w.span.start).0))
        .collect();
    (cross_reference, warnings)
}

#[test]
fn every_use_has_its_line() {
    let (cross_reference, _) =
        cross_reference(":001\nI000\nU012\nZ\nLF020\n+LF020\nSF022\nY012 UQ01 Z\nJ1\n:000 J0");
    let row = |name: &str| cross_reference.rows.iter().find(|row| row.name == name).unwrap();
    assert_eq!(row("I000").tested, [2]);
    assert_eq!((&row("Y012").written, &row("Y012").tested), (&vec![3], &vec![8]));
    assert_eq!((&row("F020").read, &row("F020").written), (&vec![5, 6], &vec![]));
    assert_eq!(row("F022").written, [7]);
    assert!(row("Q01").written == [8]);
}

#[test]
fn a_bit_written_and_never_read_is_reported() {
    assert_eq!(cross_reference(":001\nUF0200\nJ1\n:000 J0").1, [("NCT-W4", 2)]);
    // A test, or a word that holds it, reads it.
    assert_eq!(cross_reference(":001\nUF0200\nF0200 U012 Z J1\n:000 J0").1, []);
    assert_eq!(cross_reference(":001\nUF0200\nLF019\nJ1\n:000 J0").1, []);
    // The machine reads outputs.
    assert_eq!(cross_reference(":001\nU012\nJ1\n:000 J0").1, []);
}

/// The lines of a program in which `check` warns of a bit that is read and never written.
fn never_written(text: &str) -> Vec<u32> {
    let mut sources = SourceMap::new();
    let file = sources.add("main.nct", text.as_bytes());
    let (_, all) = nct::check(&mut sources, file, &MemoryLoader::new(), &Options::default());
    let found = all.iter().filter(|d| d.code == "NCT-W5");
    found.map(|d| sources.line_col(file, d.span.start).0).collect()
}

#[test]
fn a_bit_read_and_never_written_is_reported_by_check() {
    assert_eq!(never_written(":001\nF0200 U012 Z\nJ1\n:000 J0"), [2]);
    assert!(never_written(":001\n,0 SF020\nF0200 U012 Z\nJ1\n:000 J0").is_empty());
    // These write where a word of the program says.
    assert!(never_written(":001\n,40 SF030\n,1 SFI030\nF0200 U012 Z\nJ1\n:000 J0").is_empty());
    assert!(never_written(":001\nMR040\nF0200 U012 Z\nJ1\n:000 J0").is_empty());
    // The control writes these.
    assert!(never_written(":001\nF0040 U012 Z\nJ1\n:000 J0").is_empty());
}

#[test]
fn an_output_written_in_two_modules_is_reported() {
    assert_eq!(cross_reference(":001\nU012\nJ1\n:000\nD012\nJ0").1, [("NCT-W6", 5)]);
    // A subroutine belongs to all that call it.
    let two = ":001\nC010 J1\n:000\nC010 J0\n:010\nU012\nR";
    assert_eq!(cross_reference(two).1, [("NCT-W6", 6)]);
}

#[test]
fn the_words_of_a_register_area_are_used() {
    let (cross_reference, warnings) =
        cross_reference(":001\nHF120\nPF130\nCMP140\nMR150\nLF128 SQ01\nJ1\n:000 J0");
    let row = |name: &str| cross_reference.rows.iter().find(|row| row.name == name).unwrap();
    for (name, line) in [("F120", 2), ("F126", 2), ("F132", 3), ("F144", 4), ("F156", 5)] {
        assert_eq!((&row(name).read, &row(name).written), (&vec![line], &vec![]), "{name}");
    }
    assert_eq!((&row("F128").read, &row("F128").written), (&vec![6], &vec![2]));
    assert_eq!((&row("F134").read, &row("F134").written), (&vec![], &vec![3]));
    assert!(cross_reference.rows.iter().all(|row| row.name != "F146" && row.name != "F158"));
    assert_eq!(warnings, []);
}
