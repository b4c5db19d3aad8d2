//! A run-time stop names the statement that is to blame, by file and line, and an array with its
//! index: the same in every engine, from artifacts too.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::fs;
use std::path::PathBuf;

use plcc_abi::Dialect;
use plcc_control::ControlArgs;
use plcc_diag::SourceMap;
use plcc_frontend::common::{Limits, Options};
use plcc_runtime::Stop;
use plcc_tests::compile::{Compiled, EngineKind, compile, compile_sources};

/// The stop of a program, which must be the same in every engine. It happens within two ticks.
fn stop(compiled: &Compiled, what: &str) -> Stop {
    let stops = EngineKind::ALL.map(|way| {
        let (program, mut engine) = compiled.engine(way).unwrap();
        let args = ControlArgs::default();
        let mut executive = plcc_control::executive(&program, &args, false, None).unwrap();
        let mut tick = || executive.tick(engine.as_mut(), &mut vec![]).err();
        tick().or_else(tick).unwrap_or_else(|| panic!("{way:?} does not stop: {what}"))
    });
    let [first, others @ ..] = stops;
    for (other, way) in others.iter().zip(&EngineKind::ALL[1..]) {
        assert_eq!(first, *other, "{way:?}: {what}");
    }
    first
}

/// The stop of a source named `case`.
fn stop_of(source: &str, dialect: Dialect, limits: Limits) -> Stop {
    let mut sources = SourceMap::new();
    let file = sources.add("case", source.as_bytes());
    let options = Options { limits, ..Options::default() };
    let compiled = compile_sources(&mut sources, &[file], dialect, &options);
    stop(&compiled.unwrap_or_else(|errors| panic!("{source}\n{errors}")), source)
}

/// The line of a stop in the file `case`.
fn line(stop: &Stop) -> u32 {
    let place = stop.place.as_ref().unwrap();
    assert_eq!(place.file, "case");
    let named = format!("line {} of case", place.line);
    assert!(stop.message.contains(&named), "{}", stop.message);
    place.line
}

const HEAD: &str = "$INTEGER\nA[5],B[5],I,J\n$LOGICAL\nL[5],P,Q\n$LONG\nW[5]\n$END\n";

/// PMI: statements of which one is stopped, the line within the statements, and the array with its
/// index.
const ARRAYS: &[(&str, u32, &str)] = &[
    ("I=7\nJ=A[I]\n", 2, "A[7]"),
    ("I=-1\nJ=A[I]\n", 2, "A[-1]"),
    ("I=5\nIF(L[I])\nJ=1\nENDIF\n", 2, "L[5]"),
    ("I=5\nIF(P)\nJ=1\nELSEIF(L[I])\nJ=2\nENDIF\n", 4, "L[5]"),
    ("I=-32767-1\nW[I]=1\n", 2, "W[-32768]"),
    ("I=6\nJ=4\nA[I]=B[J+1]\n", 3, "A[6]"),
    ("I=6\nJ=4\nJ=A[J]+ #\nB[I]+A[I]\n", 3, "B[6]"),
    ("I=3\nB[3]=9\nA[B[I]]=1\n", 3, "A[9]"),
    ("I=2\nJ=A[I]\nJ=A[I+1]\nJ=A[I*I]\nJ=A[I*I+1]\n", 5, "A[5]"),
    ("I=4\nJ=A[I]+A[I]+B[I]\nI=I+1\nJ=B[I]+A[I]\n", 4, "B[5]"),
];

#[test]
fn pmi_names_the_line_the_array_and_the_index() {
    for &(statements, expected, element) in ARRAYS {
        let source = format!("{HEAD}{statements}");
        let stop = stop_of(&source, Dialect::Pmi, Limits::Original);
        assert_eq!(stop.code, "NO PMI DATA");
        assert_eq!(line(&stop), HEAD.lines().count() as u32 + expected, "{source}");
        let named = stop.message.strip_prefix(element);
        assert!(named.is_some_and(|rest| rest.starts_with(' ')), "{source}\n{}", stop.message);
    }
}

/// Arrays of other sizes than the original compiler allows, and an expression that is cut into
/// several functions after the index of its target.
#[test]
fn pmi_without_limits_names_them_too() {
    let long = "+B[I]".repeat(1500);
    for (sizes, statements, element) in [
        ("40000", "I=-1\nA[I]=1\n", "A[-1]"),
        ("1", "J=A[I]\nJ=A[I=0]\n", "A[1]"),
        ("5", &format!("I=4\nA[I]=1{long}\nA[I+1]=1{long}\n") as &str, "A[5]"),
        ("5", &format!("I=4\nA[I]=1\nA[I]=1{long}+B[I+1]+A[I+1]\n"), "B[5]"),
    ] {
        let head = format!("$INTEGER\nA[{sizes}],B[5],I,J\n$END\n");
        let source = format!("{head}{statements}");
        let stop = stop_of(&source, Dialect::Pmi, Limits::None);
        assert_eq!(line(&stop), source.lines().count() as u32, "{element}");
        assert!(stop.message.starts_with(&format!("{element} ")), "{}", stop.message);
    }
}

/// A folder that is removed when it is dropped.
struct Folder(PathBuf);

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

#[test]
fn a_stop_in_an_included_file_names_that_file() {
    let folder = Folder(std::env::temp_dir().join(format!("plcc-stops-{}", std::process::id())));
    fs::create_dir_all(&folder.0).unwrap();
    let main = folder.0.join("main.pmi");
    fs::write(&main, "$INTEGER\nA[5],I\n$END\nI=5\n$INCLUDE moves.inc\nI=1\n").unwrap();
    fs::write(folder.0.join("moves.inc"), "? moves\n\nI=I+1\nA[I]=1\n").unwrap();
    let compiled = compile(&main, Dialect::Pmi, &Options::default());
    let stop = stop(&compiled.unwrap_or_else(|errors| panic!("{errors}")), "include");
    let place = stop.place.unwrap();
    assert!(place.file.ends_with("moves.inc"), "{place:?}");
    assert_eq!(place.line, 4);
    assert!(stop.message.starts_with("A[6] "), "{}", stop.message);
}

/// NCT: programs, the stop code, and the line of the jump or call.
const MODULES: &[(&str, &str, u32)] = &[
    (":001\n:010\nUQ00\nG010\nJ1\n:000 J0\n", "PLC TIMEOUT1", 4),
    (":001 J1\n:000\n:010 C010\nJ0\n", "CALL DEPTH", 3),
    (":001\nC010\nJ1\n:000 J0\n:010\nUQ00\n:011 G010\nR\n", "PLC TIMEOUT1", 7),
    (":001\n:009 ,0016 SF020\nCF020 G009\nJ1\n:000 J0\n:010\nR\n", "PLC TIMEOUT1", 3),
    (":001\n,0016 SF020\n:010\nUQ00\nGF020\nJ1\n:000 J0\n", "PLC TIMEOUT1", 5),
    (":001\n,0016 SF020\n:010\nUQ00\nCF020\nJ1\n:000 J0\n", "CALL DEPTH", 5),
];

#[test]
fn nct_names_the_line_of_the_jump_or_call() {
    for &(source, code, expected) in MODULES {
        let stop = stop_of(source, Dialect::Nct, Limits::Original);
        assert_eq!(stop.code, code, "{source}");
        assert_eq!(line(&stop), expected, "{source}");
    }
}
