//! What records, debuggers and reports make of a PMAC's motion program: it is a program like a PLC.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing)]

mod support;

use serde_json::json;
use support::Folder;
use support::debug_client::Client;

/// A motion program with moves of several modes, a synchronous assignment, a subroutine and a branch that is not taken.
const MILL: &str = "I5=3 I8=0 I10=4194304 I12=1\nI100=1 I111=0 I116=100 I117=1 I119=1 I120=10 I121=0\n\
    I200=1 I211=0 I216=100 I217=1 I219=1 I220=10 I221=0\nI187=20 I188=5 I189=20 I190=1000\n&1 #1->100X #2->100Y\n\
    M1->Y:$FFC2,8,1\nM180->X:$0818,0,1\nOPEN PROG 1 CLEAR\nLINEAR ABS F20\nX5 Y2\nP1=P1+1\nX7\nM1==1\nX2 Y0\nDWELL 20\n\
    IF (P1>5)\nX9\nENDIF\nGOSUB 100\nRETURN\nN100 P2=P2+1\nPVT30\nX3:10\nX4:0\nRETURN\nCLOSE\n\
    OPEN PLC 1 CLEAR\nIF (P10=0)\nP10=1\nCMD\"&1B1R\"\nENDIF\nP11=P11+M180\nCLOSE\n";

const OUTPUTS: &str =
    "--watch #1.CMD,#2.CMD,&1.LINE,P1,P2,P11,M1 --trace TRACE --events e.jsonl --dump d.json";

#[test]
fn a_record_of_a_moving_machine_is_replayed_alike_by_every_engine() {
    let jam = "tick,name,value\n300,#2.JAM,1\n320,#2.JAM,0\n400,&1H,1\n500,&1R,1\n";
    let folder = Folder::with(&[("mill.pmc", MILL), ("s.csv", jam)]);
    let run = "run mill.pmc --simulate --ticks 2000 --stimulus s.csv --record r.plcrec";
    folder.plcc(&format!("{run} {}", OUTPUTS.replace("TRACE", "run.csv"))).exits(0);
    let [trace, events, dump] = ["run.csv", "e.jsonl", "d.json"].map(|name| folder.read(name));
    assert!(events.contains(r#""state":"ended""#), "{events}");
    assert!(trace.ends_with("#1.CMD,400\n1482,&1.LINE,0\n"), "{trace}");
    for engine in ["interp", "jit", "aot"] {
        let replay = format!("replay r.plcrec mill.pmc --engine {engine}");
        let outputs = OUTPUTS.replace("TRACE", "again.csv");
        let said = folder.plcc(&format!("{replay} {outputs}")).exits(0).stderr;
        assert!(said.contains("went as they were recorded"), "{said}");
        for (name, expected) in [("again.csv", &trace), ("e.jsonl", &events), ("d.json", &dump)] {
            assert!(folder.read(name) == *expected, "{engine}: {name}");
        }
    }
}

/// What the on-line commands at the end of a download have started is told in tick 0 alone, not again where a replay begins at a
/// later checkpoint.
#[test]
fn a_replay_from_a_later_checkpoint_tells_nothing_of_power_up() {
    let text = MILL.replace("P10=1\n", "").replace("CMD\"&1B1R\"\n", "") + "&1B1R\n";
    let folder = Folder::with(&[("mill.pmc", &text)]);
    folder
        .plcc("run mill.pmc --simulate --ticks 60100 --record r.plcrec --events e.jsonl")
        .exits(0);
    let events = folder.read("e.jsonl");
    assert_eq!(events.matches(r#""state":"started""#).count(), 1, "{events}");
    // The second checkpoint is half a minute after the first one.
    for (from, started) in [(0, 1), (60_050, 0)] {
        let replay = format!("replay r.plcrec --from {from} --events again.jsonl");
        let said = folder.plcc(&replay).exits(0).stderr;
        assert!(said.contains("went as they were recorded"), "{said}");
        let again = folder.read("again.jsonl");
        assert_eq!(again.matches(r#""state":"started""#).count(), started, "{from}: {again}");
    }
}

#[test]
fn the_debugger_steps_through_the_lines_of_a_motion_program() {
    let folder = Folder::with(&[("mill.pmc", MILL)]);
    let program = folder.path().join("mill.pmc");
    let mut client = Client::launch(
        json!({"program": program, "ticks": 2000, "args": ["--simulate"]}),
        json!([{"line": 11}, {"line": 21}]),
    );
    let at = |reason: &str, tick, line| (reason.to_owned(), tick, line);
    // The second move is calculated in the interrupt behind the start, the PLC follows.
    assert_eq!(client.stopped(), at("breakpoint", 1, 11));
    assert_eq!(client.value("P1"), "0");
    assert_eq!(client.go("next", json!({})), at("step", 1, 12));
    assert_eq!(client.value("P1"), "1");
    assert_eq!(client.go("next", json!({})), at("step", 1, 28));
    assert_eq!(client.go("stepBack", json!({})), at("step", 1, 12));
    assert_eq!(client.go("stepBack", json!({})), at("step", 1, 11));
    assert_eq!(client.value("P1"), "0");
    // In the subroutine, when the moves in front of it are done.
    assert_eq!(client.go("continue", json!({})).2, 21);
    assert_eq!(client.value("#1.CMD"), "200");
    assert_eq!(client.accesses(), ["P2 (read)=0", "P2 (written)=0 → 1"]);
    assert_eq!(client.go("next", json!({})).2, 22);
    assert_eq!(client.go("reverseContinue", json!({})).2, 21);
    assert_eq!(client.go("reverseContinue", json!({})), at("breakpoint", 1, 11));
    let (_, _, line) = client.go("plcc/goToTick", json!({"tick": 1900}));
    assert_eq!(line, 28, "the motion program has ended");
    assert_eq!(client.go("plcc/lastWriter", json!({"name": "P2"})).2, 21);
    client.leave();
}

#[test]
fn why_xref_and_coverage_know_the_statements_of_a_motion_program() {
    let script =
        "program \"mill.pmc\"\nsimulate\n\ntest \"it moves\"\n  wait until P2=1 within 2 s\nend\n";
    let folder = Folder::with(&[("mill.pmc", MILL), ("t.plctest", script)]);
    let why = folder.plcc("why mill.pmc P2 --simulate --ticks 2000").exits(0).stdout;
    assert!(why.contains("when mill.pmc:21 set it.\n  mill.pmc:21  P2=P2+1\n"), "{why}");
    // A synchronous assignment is carried out by the control, ticks after its statement.
    let why = folder.plcc("why mill.pmc M1 --simulate --ticks 2000").exits(0).stdout;
    assert!(why.contains("when mill.pmc:13 set it."), "{why}");
    let table = folder.plcc("xref mill.pmc").exits(0).stdout;
    for (name, lines) in [("P2", "21"), ("M1", "13"), ("axis Y", "10 14"), ("PROG 1 N100", "21")] {
        let row = table.lines().find(|row| row.starts_with(&format!("{name} "))).unwrap();
        assert!(row.contains(lines), "{row}");
    }
    let done = folder.plcc("test t.plctest --coverage c.info").exits(0);
    assert!(done.stdout.contains("coverage: "), "{}", done.stdout);
    let report = folder.read("c.info");
    // The branch is not taken, and the end of the test comes before the last move.
    for line in ["DA:10,1", "DA:14,1", "DA:17,0", "DA:21,1", "DA:24,0"] {
        assert!(report.lines().any(|own| own == line), "{line}\n{report}");
    }
}
