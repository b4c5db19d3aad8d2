//! Small sources that would make the compiler do any amount of work get an error of their own, at the
//! place that goes too far.

#![allow(clippy::unwrap_used, clippy::indexing_slicing, clippy::panic)]

mod support;

use support::{Done, Folder};

/// Says that a command found exactly one error, with a code, in a line of a file.
#[track_caller]
fn one_error(done: Done, code: &str, file: &str, line: u64) {
    let errors: Vec<_> =
        done.exits(1).json().into_iter().filter(|d| d["severity"] == "error").collect();
    let [error] = errors.as_slice() else { panic!("{errors:?}") };
    assert_eq!(error["code"], code);
    assert_eq!((error["file"].as_str(), error["line"].as_u64()), (Some(file), Some(line)));
}

#[test]
fn included_text_is_limited() {
    let statements = "A=A+1\n".repeat(30_000);
    let includes = "$INCLUDE other.pmi\n".repeat(30);
    let pmi = format!("$INTEGER\nA\n$END\n{includes}");
    // 23 times 180 000 bytes are within 4 MiB.
    let folder = Folder::with(&[
        ("a.pmi", &pmi),
        ("other.pmi", &statements),
        ("a.pmc", &format!("I5=2\n{}", "#include \"missing.h\"\n".repeat(5000))),
    ]);
    one_error(folder.plcc("check --message-format json a.pmi"), "PMI-X3", "a.pmi", 27);
    // Each file counts as 1 KiB at least, also one that is not there.
    let missing = folder.plcc("check --message-format json a.pmc").exits(1).json();
    assert_eq!(missing.last().unwrap()["code"], "PMAC-X5");
    assert_eq!(missing.last().unwrap()["line"], 4096 + 2);
    assert_eq!(missing.len(), 4096 + 1);
}

#[test]
fn replaced_text_is_limited() {
    let mut text = String::from("I5=2\n#define A0 P1=P1+1\n");
    for n in 1..30 {
        text.push_str(&format!("#define A{n} A{} A{}\n", n - 1, n - 1));
    }
    text.push_str("OPEN PLC 1 CLEAR\nA10\nA29\nA29\nCLOSE\n");
    let folder = Folder::with(&[("a.pmc", &text)]);
    one_error(folder.plcc("check --message-format json a.pmc"), "PMAC-X6", "a.pmc", 34);
}

#[test]
fn variables_in_ranges_are_limited() {
    let folder = Folder::with(&[
        ("online.pmc", &format!("I5=2\n{}", "P0..8191=0\n".repeat(500))),
        (
            "commands.pmc",
            &format!("I5=2\nOPEN PLC 1 CLEAR\n{}CLOSE\n", "CMD\"I0..8191=*\"\n".repeat(500)),
        ),
    ]);
    let turbo = "check --controller turbo --message-format json";
    one_error(folder.plcc(&format!("{turbo} online.pmc")), "PMAC-X4", "online.pmc", 258);
    one_error(folder.plcc(&format!("{turbo} commands.pmc")), "PMAC-X4", "commands.pmc", 259);
}

#[test]
fn instructions_are_limited() {
    let statements = "M0..7=P1\n".repeat(10_000);
    let folder =
        Folder::with(&[("a.pmc", &format!("I5=2\nOPEN PLC 1 CLEAR\n{statements}CLOSE\n"))]);
    let done = folder.plcc("build a.pmc").exits(1);
    assert!(done.stderr.contains("PMAC-X7"), "{}", done.stderr);
    assert!(!folder.has("a.plcx"));
}

#[test]
fn the_instructions_of_a_statement_and_the_number_of_commands_are_limited() {
    let plc = |body: &str| format!("I5=2\nOPEN PLC 1 CLEAR\n{body}\nCLOSE\n");
    let folder = Folder::with(&[
        ("long.pmc", &plc(&format!("P1={}P2", "P2+".repeat(200_000)))),
        ("calls.pmc", &plc(&format!("P1={}P2", "P2%P3+".repeat(20_000)))),
        ("commands.pmc", &plc(&"CMD\"P1=1\"\n".repeat(50_000))),
    ]);
    for file in ["long.pmc", "calls.pmc", "commands.pmc"] {
        let done = folder.plcc(&format!("build {file}")).exits(1);
        assert!(done.stderr.contains("PMAC-X7"), "{}", done.stderr);
    }
}
