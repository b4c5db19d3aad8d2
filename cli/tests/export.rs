//! `plcc export`: the files that it writes, what it tells, and its exit status. What the files mean is compared in
//! `tests/tests/iec/`.

#![allow(clippy::unwrap_used, clippy::indexing_slicing)]

mod support;

use support::Folder;

const PROGRAM: &str = "? a slide between two switches\n$INPUT\nATWEST = 0/0 ? it is left\nATEAST = 0/1\nSPEED = 1/0-3/BCD\n$OUTPUT\n\
                       GO = 2/0\n$INTEGER\nN, A[3], S\n$LONG\nK\n$FAULT\nJAM = \"SLIDE JAMMED AT\", N ? call the fitter\n$END\n\
                       ? the slide goes\nGO = ATWEST ! GO & /ATEAST   ? until it is right\nN = N + 1\nK = N - 70000\nA[N] = K % 7 * S\n\
                       IF (A[2] > SPEED)\n S = N * 3 / 2\nELSEIF (JAM)\n GOTO OUT\nENDIF\nS = -S\nOUT: JAM = N = 9\n";

fn folder() -> Folder {
    let folder = Folder::with(&[]);
    folder.write("slide.pmi", PROGRAM);
    folder
}

#[test]
fn structured_text_has_names_comments_and_addresses() {
    let folder = folder();
    let done = folder.plcc("export slide.pmi --to st -o new/iec").exits(0);
    assert!(done.stderr.contains("the text of JAM"), "{}", done.stderr);
    let text = folder.read("new/iec/slide.st");
    for part in [
        "ATWEST AT %IX0.0 : BOOL; (* it is left *)",
        "GO AT %QX2.0 : BOOL;",
        "A : ARRAY [0..2] OF INT;",
        "JAM : BOOL; (* fault \"SLIDE JAMMED AT <N>\"; call the fitter *)",
        "S_V : INT; (* S *)",
        "SPEED := BOOL_TO_INT(IX1_0) + 2 * BOOL_TO_INT(IX1_1) + 4 * BOOL_TO_INT(IX1_2) + 8 * BOOL_TO_INT(IX1_3);",
        "(* the slide goes *)\n",
        "GO := ATWEST OR GO AND NOT ATEAST; (* until it is right *)",
        "N_V := INTEGER_ADD(N_V, 1);",
        "INTERVAL := T#20ms",
    ] {
        assert!(text.contains(part), "{part}\n{text}");
    }
    // Only the functions that are needed are there.
    assert!(text.contains("FUNCTION INTEGER_REM : INT") && !text.contains("FUNCTION INTEGER_BCD"));
}

#[test]
fn plcopen_has_the_same_statements() {
    let folder = folder();
    folder.plcc("export slide.pmi --to plcopen").exits(0);
    folder.plcc("export slide.pmi --to st").exits(0);
    let xml = folder.read("slide.xml");
    assert!(xml.starts_with("<?xml version=\"1.0\" encoding=\"utf-8\"?>"), "{xml}");
    assert!(xml.contains("<project xmlns=\"http://www.plcopen.org/xml/tc6_0201\""), "{xml}");
    let text = folder.read("slide.st");
    let body = |line: &&str| line.contains(":=") && !line.contains(" : ");
    for line in text.lines().filter(body).filter(|line| !line.contains("INTERVAL")) {
        assert!(xml.contains(line.trim()), "{line}\n{xml}");
    }
}

#[test]
fn what_is_not_written_has_its_exit_status() {
    let folder = folder();
    folder.write("wrong.pmi", "$END\nX = \n");
    folder.plcc("export wrong.pmi --to st").exits(1);
    assert!(!folder.path().join("wrong.st").exists());
    folder.plcc("export slide.pmi").exits(2);
    folder.plcc("export slide.pmi --to ld").exits(2);
    folder.plcc("export missing.pmi --to st").exits(2);
    // A file where the folder should be.
    folder.plcc("export slide.pmi --to st -o slide.pmi").exits(2);
}

#[test]
fn what_a_pmac_tells_its_host_is_told_with_its_line() {
    let folder = folder();
    let text =
        "I5=2\nM1->Y:$FFC2,8\n#define PUMP M1\nOPEN PLC 1 CLEAR\nIF (P1>2.5)\nPUMP=1\nENDIF\n";
    folder.write("pump.pmc", format!("{text}CLOSE\n"));
    folder.plcc("export pump.pmc --to st").exits(0);
    let st = folder.read("pump.st");
    for part in ["M1 : DINT := 0; (* Y:$FFC2,8,1: PUMP *)", "IF P1 > 2.5 THEN", "M1 := 1;"] {
        assert!(st.contains(part), "{part}\n{st}");
    }
    folder.write("told.pmc", format!("{text}SEND\"ON\"\nCLOSE\n"));
    let done = folder.plcc("export told.pmc --to st --message-format json").exits(1);
    let error: serde_json::Value =
        serde_json::from_str(done.stdout.lines().next().unwrap()).unwrap();
    assert_eq!((&error["code"], &error["line"]), (&"PMAC-X10".into(), &8.into()));
    assert!(!folder.path().join("told.st").exists());
}

#[test]
fn a_machine_file_of_which_something_is_left_out_is_told() {
    let folder = folder();
    folder.write("pots.nct", ":000\nJ0\n:001\nLI010 SY010\nJ1\n");
    folder.write("pots.machine.toml", "[tool_pots]\n3 = { tool = 5, width = 1 }\n");
    let done = folder.plcc("export pots.nct --to st").exits(0);
    assert!(done.stderr.contains("[tool_pots]"), "{}", done.stderr);
    folder.write("pots.machine.toml", "");
    let done = folder.plcc("export pots.nct --to st").exits(0);
    assert!(!done.stderr.contains("[tool_pots]"), "{}", done.stderr);
}

#[test]
fn comments_of_included_statements_are_kept() {
    let folder = folder();
    folder.write("lamp.inc", "L = A ? the first line\n");
    folder
        .write("whole.pmi", "$INPUT\nA = 0/0\n$OUTPUT\nL = 2/0\n$END\n$INCLUDE LAMP.INC\nA2 = A\n");
    folder.plcc("export whole.pmi --to st").exits(0);
    let st = folder.read("whole.st");
    assert!(st.contains("L_V := A; (* the first line *)"), "{st}");
}

#[test]
fn statements_of_a_define_are_told_once() {
    let folder = folder();
    folder.write("two.pmc", "#define TELL SEND\"A\" SEND\"B\"\nOPEN PLC 1 CLEAR\nTELL\nCLOSE\n");
    let done = folder.plcc("export two.pmc --to st").exits(1);
    assert_eq!(done.stderr.matches("PMAC-X10").count(), 1, "{}", done.stderr);
}

#[test]
fn notes_are_json_too() {
    let folder = folder();
    let done = folder.plcc("export slide.pmi --to st --message-format json").exits(0);
    let note: serde_json::Value =
        serde_json::from_str(done.stdout.lines().next().unwrap()).unwrap();
    assert_eq!((&note["code"], &note["line"]), (&"PMI-X6".into(), &13.into()));
}
