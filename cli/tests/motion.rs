//! Motors, coordinate systems and motion programs of a PMAC: `plcc run --simulate`.

#![allow(clippy::unwrap_used, clippy::indexing_slicing)]

mod support;

use support::Folder;

/// Motor 1 with a servo cycle of 0.5 ms, a waiting time of two cycles, and straight ramps of 10 ms.
const MOTOR: &str = "I5=3 I10=4194304 I8=0 I12=1 I120=10 I121=0 I119=100 I122=10 I123=5\n";

/// The trace of one name: tick and value, as text.
fn rows(trace: &str, name: &str) -> Vec<(u64, f64)> {
    let row = |line: &str| {
        let mut parts = line.split(',');
        let (tick, found, value) = (parts.next()?, parts.next()?, parts.next()?);
        (found == name).then(|| (tick.parse().unwrap(), value.parse().unwrap()))
    };
    trace.lines().skip(1).filter_map(row).collect()
}

fn events(folder: &Folder, name: &str) -> Vec<String> {
    folder.read(name).lines().map(str::to_owned).collect()
}

#[test]
fn a_jog_follows_its_trapezoid_and_ends_exactly() {
    let text = format!(
        "{MOTOR}M140->Y:$0814,0,1\nM133->X:$003D,13,1\n#1->X\nOPEN PLC 0 CLEAR\nIF (P1=0) P1=1 CMD\"#1J=200\" ENDIF\nCLOSE\n"
    );
    let folder = Folder::with(&[("j.pmc", &text)]);
    let done =
        folder.plcc("run j.pmc --simulate --ticks 90 --watch #1.CMD,M133,M140 --trace -").exits(0);
    // The command is carried out in the background of tick 0 and waits 1 ms, two cycles: time 0 is tick 2. In 10 ms it
    // reaches 10 counts/ms, then 10 ms at that speed, then 10 ms down.
    let at: Vec<(u64, f64)> = rows(&done.stdout, "#1.CMD");
    let position = |tick| at.iter().rev().find(|row| row.0 <= tick).unwrap().1;
    assert_eq!(position(2), 0.0);
    assert_eq!(position(4), 0.5);
    assert_eq!(position(22), 50.0);
    assert_eq!(position(32), 100.0);
    assert_eq!(position(42), 150.0);
    assert_eq!(position(62), 200.0);
    assert_eq!(at.last().unwrap(), &(62, 200.0));
    // The cycle that reaches the end still has velocity; the motor is in position in the one after.
    assert_eq!(rows(&done.stdout, "M133"), [(0, 1.0), (3, 0.0), (63, 1.0)]);
    assert_eq!(rows(&done.stdout, "M140"), [(0, 1.0), (2, 0.0), (63, 1.0)]);
}

#[test]
fn homing_finds_the_index_and_goes_back_to_zero() {
    let text = format!("{MOTOR}I902=1\nM145->Y:$0814,10,1\nM815->Y:$0815,0,24,S\n#1HM\n");
    let machine = "[simulator]\n[[simulator.motor]]\nnumber = 1\nindex = 400\nindex_at = 123\n";
    let folder = Folder::with(&[("h.pmc", &text), ("h.machine.toml", machine)]);
    let command =
        "run h.pmc --simulate --ticks 200 --watch #1.CMD,#1.X,M145,M815 --trace - --events e.jsonl";
    let done = folder.plcc(command).exits(0);
    assert_eq!(rows(&done.stdout, "M815").last().unwrap().1, 123.0);
    assert_eq!(rows(&done.stdout, "#1.CMD").last().unwrap().1, 0.0);
    assert_eq!(rows(&done.stdout, "#1.X").last().unwrap().1, 123.0);
    let home = events(&folder, "e.jsonl");
    assert_eq!(home.len(), 1, "{home:?}");
    assert!(home[0].contains(r#""kind":"home","motor":1"#), "{home:?}");
}

#[test]
fn address_chooses_the_motor_of_commands_in_all_engines() {
    let text = format!(
        "{MOTOR}I200=1 I220=10 I221=0 I219=100 I222=10\nP3=2\nOPEN PLC 1 CLEAR\nIF (P1=0)\nP1=1\nADDRESS#2\nCMD\"J=200\"\nENDIF\nCLOSE\n"
    );
    let folder =
        Folder::with(&[("a.pmc", &text), ("b.pmc", &text.replace("ADDRESS#2", "ADDRESS#P3"))]);
    for engine in ["interp --opt none", "jit --opt none", "jit --opt speed", "aot --opt speed"] {
        for file in ["a.pmc", "b.pmc"] {
            let done = folder.plcc(&format!(
                "run {file} --simulate --ticks 120 --engine {engine} --watch #1.CMD,#2.CMD --trace -"
            ));
            let trace = done.exits(0).stdout;
            assert_eq!(rows(&trace, "#1.CMD").last().unwrap().1, 0.0, "{file} {engine}");
            assert_eq!(rows(&trace, "#2.CMD").last().unwrap().1, 200.0, "{file} {engine}");
        }
    }
}

/// A motion program of the guide's kind: lines that blend, a synchronous assignment, a DWELL.
const PROGRAM: &str = "I100=1 I200=1 I116=100 I216=100 I117=10 I217=10 I190=1000 I187=20 I188=0\n\
    #1->100X\n#2->100Y\nM1->X:$07F0,0,1\nM180->X:$0818,0,1\n\
    OPEN PROG 10 CLEAR\nLINEAR ABS TA20 F20\nX10\nX20 Y10 M1==1\nDWELL 10\nP1=1\n\
    WHILE (P2<3) P2=P2+1\nIF (P2=3) GOSUB 500\nRAPID X0 Y0\nRETURN\nN500 SEND\"SUB\"\nRETURN\nCLOSE\n";

#[test]
fn a_motion_program_runs_alike_in_all_engines() {
    let text = format!("{MOTOR}{PROGRAM}&1B10R\n");
    let folder = Folder::with(&[("p.pmc", &text)]);
    let mut all = vec![];
    for engine in ["interp", "jit", "aot"] {
        for opt in ["none", "speed"] {
            let done = folder.plcc(&format!(
                "run p.pmc --simulate --ticks 6000 --engine {engine} --opt {opt} --watch \
                 #1.CMD,#2.CMD,M1,M180,P1,&1.X,&1.LINE --trace - --events e.jsonl --dump d.json"
            ));
            all.push([done.exits(0).stdout, folder.read("e.jsonl"), folder.read("d.json")]);
        }
    }
    assert!(all.windows(2).all(|pair| pair[0] == pair[1]), "{all:#?}");
    let [trace, events, _] = &all[0];
    let kinds: Vec<&str> = events.lines().collect();
    assert_eq!(kinds.len(), 3, "{events}");
    assert!(kinds[0].contains(r#""kind":"program","system":1,"program":10,"state":"started"}"#));
    assert!(kinds[1].contains("SUB"));
    assert!(kinds[2].contains(r#""state":"ended","file":"p.pmc","line":16"#), "{events}");
    // It stops exactly at its targets.
    let x = rows(trace, "#1.CMD");
    assert!(x.iter().any(|row| row.1 == 2000.0) && x.last().unwrap().1 == 0.0);
    // The synchronous assignment is behind the last move, so that it waits for the DWELL.
    let stop = x.iter().find(|row| row.1 == 2000.0).unwrap().0;
    assert_eq!(rows(trace, "M1"), [(0, 0.0), (stop, 1.0)]);
    // The DWELL of 10 ms counts from the cycle behind the stop; the calculation goes on in its last one.
    assert_eq!(rows(trace, "P1"), [(0, 0.0), (stop + 20, 1.0)]);
}

#[test]
fn without_the_switch_nothing_moves() {
    let text = format!("{MOTOR}{PROGRAM}&1B10R\n");
    let folder = Folder::with(&[("p.pmc", &text)]);
    folder
        .plcc("run p.pmc --ticks 100 --watch M180,P1,Y:$0814 --trace t.csv --events e.jsonl")
        .exits(0);
    assert_eq!(folder.read("t.csv"), "tick,name,value\n0,M180,0\n0,P1,0\n0,Y:$0814,0\n");
    assert_eq!(folder.read("e.jsonl"), "");
    folder.plcc("run p.pmc --ticks 1 --watch #1.CMD").exits(2).says(&["--simulate"]);
}

#[test]
fn commands_are_refused_with_the_control_s_numbers() {
    let text = format!(
        "{MOTOR}I200=0\n#1->100X\nOPEN PLC 0 CLEAR\nP1=P1+1\nIF (P1=1)\nCMD\"&1B77R\"\nCMD\"&2R\"\n\
         CMD\"#2J+\"\nCMD\"#1K\"\nCMD\"&1R\"\nCMD\"&2#1->X\"\nCMD\"#1?\"\nENDIF\nCLOSE\n"
    );
    let folder = Folder::with(&[("r.pmc", &text)]);
    folder.plcc("run r.pmc --simulate --ticks 3 --events e.jsonl").exits(0);
    let refused: Vec<String> =
        events(&folder, "e.jsonl").into_iter().filter(|line| !line.contains("command")).collect();
    let expected = [
        r#"{"tick":0,"kind":"refused","text":"R","system":1,"error":"ERR015"}"#,
        r#"{"tick":0,"kind":"refused","text":"R","system":2,"error":"ERR014"}"#,
        r#"{"tick":0,"kind":"refused","text":"J+","motor":2,"error":"ERR013"}"#,
        r#"{"tick":0,"kind":"refused","text":"R","system":1,"error":"ERR012"}"#,
        r##"{"tick":0,"kind":"refused","text":"#1->X","motor":1,"error":"ERR003"}"##,
    ];
    assert_eq!(refused[..5], expected, "{refused:#?}");
    // Activated, integration with zero velocity alone, open loop; in system 1.
    assert_eq!(refused[5], r#"{"tick":0,"kind":"answer","text":"850000800001"}"#);
}

#[test]
fn a_wrong_motor_in_the_machine_file_is_told_with_its_line() {
    let files = [
        ("a.pmc", "I5=0\n"),
        ("a.machine.toml", "[simulator]\n[[simulator.motor]]\nnumber = 1\nlag = -1\n"),
    ];
    let folder = Folder::with(&files);
    folder.plcc("run a.pmc --simulate --ticks 1").exits(2).says(&["line 2", "lag"]);
    folder.write("a.machine.toml", "[simulator]\n[[simulator.motor]]\nnumber = 9\n");
    folder.plcc("run a.pmc --simulate --ticks 1").exits(2).says(&["motors 1 to 8"]);
    folder.plcc("run a.pmc --simulate --controller turbo --ticks 1").exits(0);
}

#[test]
fn a_wrong_motion_program_is_an_error_with_the_switch_alone() {
    let text =
        "I5=2\nOPEN PROG 1 CLEAR\nX10\nX=5\nCLOSE\nOPEN PLC 1 CLEAR\nP1=P1+1\nCLOSE\n&1B1R\n";
    let folder = Folder::with(&[("w.pmc", text)]);
    folder.plcc("check w.pmc").exits(0).says(&["PMAC-W20"]);
    folder.plcc("run w.pmc --ticks 3 --watch P1 --trace -").exits(0);
    folder.plcc("run w.pmc --simulate --ticks 3").exits(1).says(&["PMAC-3"]);
}

#[test]
fn a_limit_stops_the_program_of_the_motor() {
    let text = format!(
        "{MOTOR}{PROGRAM}I113=500 I115=2\nM143->X:$003D,21,1\nM111->Y:$0814,11,1\n&1B10R\n"
    );
    let folder = Folder::with(&[("l.pmc", &text)]);
    let done = folder
        .plcc(
            "run l.pmc --simulate --ticks 4000 --watch #1.CMD,M143,M111 --trace - --events e.jsonl",
        )
        .exits(0);
    let program = events(&folder, "e.jsonl");
    assert!(program[1].contains(r#""state":"stopped","reason":"limit""#), "{program:?}");
    assert_eq!(rows(&done.stdout, "M111").last().unwrap().1, 1.0);
    let end = rows(&done.stdout, "#1.CMD").last().unwrap().1;
    assert!((500.0..600.0).contains(&end), "{end}");
}
