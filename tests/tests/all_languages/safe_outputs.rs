//! What the physical outputs become when a program is stopped: 0, or what `--safe` says, in the tick of
//! the stop, whatever the language; the variables keep their values.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::path::PathBuf;

use clap::Parser;
use plcc_abi::{Engine, Outcome, ResumePoint, Scan, TrapCode};
use plcc_frontend::common::Options;
use plcc_frontend::detect::{Ending, ending};
use plcc_host::args::RunArgs;
use plcc_host::session;
use plcc_tests::compile::{EngineKind, compile};

#[derive(Parser)]
struct Args {
    #[command(flatten)]
    run: RunArgs,
}

/// An engine that stops the program when a task is called for the `at`-th time (from 0).
struct StopsAt {
    engine: Box<dyn Engine>,
    at: u32,
    count: u32,
}

impl Engine for StopsAt {
    fn call(&mut self, task: usize, from: Option<ResumePoint>, scan: &mut Scan<'_>) -> Outcome {
        self.count += 1;
        if self.count > self.at {
            return Outcome::trap(TrapCode::Internal);
        }
        self.engine.call(task, from, scan)
    }
}

/// Runs a source with options, and gives the exit status and the trace's rows of the last tick,
/// `name,value` each. The program is stopped at its call `at`.
fn run(file: &str, source: &str, at: u32, args: &str) -> (u8, Vec<String>) {
    let name = format!("plcc-safe-{}-{:?}", std::process::id(), std::thread::current().id());
    let folder = std::env::temp_dir().join(name);
    std::fs::create_dir_all(&folder).unwrap();
    let path: PathBuf = folder.join(file);
    std::fs::write(&path, source).unwrap();
    let Ending::Of(dialect) = ending(&path) else { panic!("{file} shows no language") };
    let compiled = compile(&path, dialect, &Options::default()).unwrap_or_else(|e| panic!("{e}"));
    let (program, engine) = compiled.engine(EngineKind::Statements).unwrap();
    let trace = folder.join("t.csv");
    let words = ["run", "--trace", trace.to_str().unwrap()].map(str::to_owned).into_iter();
    let words = words.chain(args.split_whitespace().map(str::to_owned));
    let args = Args::try_parse_from(words).unwrap_or_else(|e| panic!("{e}"));
    let mut engine = StopsAt { engine, at, count: 0 };
    let status = session::run(&program, &mut engine, &args.run, None);
    let text = std::fs::read_to_string(&trace).unwrap_or_default();
    let _ = std::fs::remove_dir_all(&folder);
    let last = text.lines().last().and_then(|row| row.split_once(',')).map(|(tick, _)| tick);
    let last = format!("{},", last.unwrap_or_default());
    let rows = text.lines().filter_map(|row| row.strip_prefix(&last));
    (status, rows.map(str::to_owned).collect())
}

const PMI: &str =
    "$OUTPUT\nLAMP = 1/0\nPUMP = 1/1\nSPEED = 2/4-7/B\n$END\nLAMP = 1\nPUMP = 1\nSPEED = 9\n";
const NCT: &str = ":001\nLF900 +1 SY000 SY012 SY02\nJ1\n:000\nJ0\n";
const PMAC: &str = "I5=2\nM1->Y:$FFC2,8\nM2->Y:$FFC2,9\nM11->Y:$FFC2,0\nM900->Y:$FFD0,0\n\
                    OPEN PLC 1 CLEAR\nM1=1 M2=1 M900=1 P1=M11\nCLOSE\n";

#[test]
fn all_outputs_are_off_after_a_stop() {
    let watch = "--ticks 9 --watch LAMP,SPEED,PORT1.0,PORT1.1,PORT2.4,PORT2.7";
    let (status, rows) = run("a.pmi", PMI, 1, watch);
    assert_eq!((status, rows.join(" ")), (3, "PORT1.0,0 PORT1.1,0 PORT2.4,0 PORT2.7,0".into()));
    let (status, rows) = run("a.nct", NCT, 2, "--ticks 9 --watch Y000,Y02,O000,O012,O02");
    assert_eq!((status, rows.join(" ")), (3, "O000,0 O012,0 O02,0".into()));
}

/// A PMAC's lines are bits of its memory, so that the M-variable of an output shows the line. Inputs
/// stay, and so does a line that the program never assigns.
#[test]
fn variables_that_are_lines_show_the_safe_values() {
    let source = PMAC.replace("OPEN", "M901->Y:$FFD0,1\nOPEN");
    let stimulus = std::env::temp_dir().join(format!("plcc-safe-{}.csv", std::process::id()));
    std::fs::write(&stimulus, "tick,name,value\n0,M11,1\n0,M901,1\n").unwrap();
    let args = format!(
        "--ticks 9 --stimulus {} --watch M1,M2,M11,M900,M901,P1,Y:$FFC2",
        stimulus.display()
    );
    let (status, rows) = run("a.pmc", &source, 1, &args);
    let _ = std::fs::remove_file(&stimulus);
    assert_eq!((status, rows.join(" ")), (3, "M1,0 M2,0 M900,0 Y:$FFC2,1".into()));
}

#[test]
fn each_output_may_have_a_safe_value_of_its_own() {
    let args = "--ticks 9 --watch PORT1.0,PORT1.1,PORT2.4,PORT2.5,PORT2.6 \
                --safe LAMP=hold --safe PUMP=off --safe SPEED=6 --safe PORT2.5=0";
    let (status, rows) = run("a.pmi", PMI, 1, args);
    // SPEED is 9 in the lines 4 and 7; of its safe value 6 the later entry takes line 5 away.
    assert_eq!((status, rows.join(" ")), (3, "PORT1.1,0 PORT2.4,0 PORT2.6,1".into()));
    let args = "--ticks 9 --watch O000,O012,O02,Y02 --safe O012=hold --safe Y02=255 --safe O007=1";
    let (status, rows) = run("a.nct", NCT, 2, args);
    assert_eq!((status, rows.join(" ")), (3, "O000,0 O02,255".into()));
    let args = "--ticks 9 --watch M1,M2,Y:$FFD0 --safe M1=HOLD --safe M2=0 --safe Y:$FFD0=$10";
    let (status, rows) = run("a.pmc", PMAC, 1, args);
    assert_eq!((status, rows.join(" ")), (3, "M2,0 Y:$FFD0,16".into()));
}

#[test]
fn what_is_no_output_has_no_safe_value() {
    for (file, source, safe) in [
        ("a.pmi", PMI, "LAMPE=off"),
        ("a.pmi", PMI, "@FRO=off"),
        ("a.pmi", PMI, "PORT5.0=off"),
        ("a.pmi", PMI, "LAMP=2"),
        ("a.pmi", PMI, "SPEED=16"),
        ("a.pmi", PMI, "SPEED=-1"),
        ("a.pmi", PMI, "SPEED=fast"),
        ("a.nct", NCT, "I000=off"),
        ("a.nct", NCT, "F0000=hold"),
        ("a.nct", NCT, "Y700=1"),
        ("a.nct", NCT, "O012=2"),
        ("a.nct", NCT, "O00=65536"),
        ("a.pmc", PMAC, "P1=off"),
        ("a.pmc", PMAC, "M3=off"),
        ("a.pmc", PMAC, "M1=2"),
        ("a.pmc", PMAC, "M1=on"),
        ("a.pmc", PMAC, "X:$0700=0"),
    ] {
        let (status, rows) = run(file, source, 9, &format!("--ticks 1 --safe {safe}"));
        assert_eq!((status, rows.len()), (2, 0), "{safe}");
    }
}

/// What is taken for an output of a PMAC: see `frontend/src/pmac/outputs.rs`.
#[test]
fn lines_that_a_download_assigns_are_outputs() {
    for (source, watch, expected) in [
        // By a range, by a COMMAND, on-line, and by a definition that a COMMAND makes later.
        ("M5..6=1 P1=1", "M5,M6", "M5,0 M6,0"),
        ("CMD\"M5=1\" P1=1", "M5", "M5,0"),
        ("P1=M7", "M7", "M7,0"),
        ("IF (P1=0) CMD\"M8->Y:$FFD1,6\" P1=1 ELSE M8=1 ENDIF", "Y:$FFD1", "Y:$FFD1,0"),
        ("M(P2+5)=1", "M5", "M5,0"),
        // A PLCC's variable, and a word.
        ("CMD\"WY$FFD1,5\"", "Y:$FFD1", "Y:$FFD1,0"),
    ] {
        let source = format!(
            "I5=2\nM5..6->Y:$FFD1,4\nM6->Y:$FFD1,5\nM7->Y:$FFD1,7\nM8->*\nM7=1\n\
             OPEN PLC 1 CLEAR\n{source}\nCLOSE\n"
        );
        // Three calls, so that commands that wait have been done.
        let (status, rows) = run("a.pmc", &source, 4, &format!("--ticks 9 --watch {watch}"));
        assert_eq!((status, rows.join(" ")), (3, expected.to_owned()), "{source}");
    }
}
