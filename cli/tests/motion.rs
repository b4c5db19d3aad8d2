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

/// Values outside of the range of an I-variable wrap (guide, appendix B).
#[test]
fn times_outside_of_their_range_wrap_and_are_told() {
    let jog = |settings: &str| {
        let text = format!("I5=3 I8=0 I120=10 I121=0 I119=100 I122=10\n{settings}\n#1J=200\n");
        let folder = Folder::with(&[("j.pmc", &text)]);
        let done =
            folder.plcc("run j.pmc --simulate --ticks 400 --watch #1.CMD --trace -").exits(0);
        let said = folder.plcc("check j.pmc").exits(0);
        (rows(&done.stdout, "#1.CMD"), said.stdout + &said.stderr)
    };
    // A servo cycle of 0 counts as the default.
    let (usual, _) = jog("I12=1");
    let (wrapped, said) = jog("I12=1 I10=8388608");
    assert_eq!(wrapped, usual);
    assert!(usual.last().unwrap() == &(70, 200.0), "{usual:?}");
    assert!(said.contains("I10 takes 0 to 8388607: 8388608 becomes 0"), "{said}");
    // 8388607 ms: the jog waits for more than two hours.
    let (moved, said) = jog("I12=0");
    assert_eq!(moved, [(0, 0.0)]);
    assert!(said.contains("I12 takes 1 to 8388607: 0 becomes 8388607"), "{said}");
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
    folder.plcc("check w.pmc").exits(0).says(&["PMAC-W19"]);
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

/// Two motors of 100 counts a unit in a system whose moves are slow enough for no limit, in cycles of 0.5 ms.
const SYSTEM: &str = "I200=1 I111=0 I211=0 I116=1000 I216=1000 I117=100 I217=100 I190=1000 I187=20 I188=0\n\
    &1 #1->100X #2->100Y\nM1->X:$07F0,0,1\n";

/// Runs a motion program in all engines, which must agree, and gives its trace and events.
fn runs(program: &str, ticks: u32, watch: &str) -> (String, String) {
    let text = format!("{MOTOR}{SYSTEM}OPEN PROG 1 CLEAR\n{program}CLOSE\n&1B1R\n");
    let folder = Folder::with(&[("p.pmc", &text)]);
    let run = |engine| {
        let command = format!(
            "run p.pmc --simulate --ticks {ticks} --engine {engine} --watch {watch} --trace - --events e.jsonl"
        );
        (folder.plcc(&command).exits(0).stdout, folder.read("e.jsonl"))
    };
    let first = run("interp");
    for engine in ["jit", "aot"] {
        assert_eq!(run(engine), first);
    }
    first
}

/// The value of a name at the end of a tick.
fn at(trace: &str, name: &str, tick: u64) -> f64 {
    rows(trace, name).iter().rev().find(|row| row.0 <= tick).unwrap().1
}

#[test]
fn pvt_moves_reach_their_points_with_their_velocities() {
    // The guide's example: 5 units in 300 ms up to 50 units a second (5 counts/ms), 5 units down.
    let (trace, _) = runs("INC PVT300\nX5:50 M1==1\nX5:0\n", 1300, "#1.CMD,#1.VEL,M1,&1.LINE");
    // x(t) = 500·(t/300)³, so that after 150 ms it is an eighth of it.
    assert_eq!(at(&trace, "#1.CMD", 300), 62.5);
    assert_eq!(at(&trace, "#1.CMD", 600), 500.0);
    assert_eq!(at(&trace, "#1.CMD", 900), 937.5);
    assert_eq!(rows(&trace, "#1.CMD").last().unwrap(), &(1200, 1000.0));
    // The assignment behind the first move is done when the second begins.
    assert_eq!(rows(&trace, "M1"), [(0, 0.0), (600, 1.0)]);
    assert_eq!(rows(&trace, "&1.LINE"), [(0, 0.0), (1, 7.0), (600, 8.0), (1200, 0.0)]);
}

#[test]
fn a_pvt_row_that_ends_with_a_velocity_stops_dead() {
    let (trace, _) = runs("INC PVT100\nX5:50\nDWELL0\nX1:0\n", 500, "#1.CMD,#1.VEL");
    assert_eq!(at(&trace, "#1.CMD", 200), 500.0);
    // The DWELL is over in the cycle of the end, and the calculation follows in the same tick.
    assert_eq!(rows(&trace, "#1.CMD").last().unwrap(), &(400, 600.0));
}

#[test]
fn splines_relax_their_points_and_end_exactly() {
    let moves = "ABS SPLINE1 TA60\nX6\nX12\nX12\n";
    let (trace, _) = runs(moves, 700, "#1.CMD");
    // The waypoints are (q-1 + 4·q + q+1)/6 of 0, 600, 1200, 1200 counts, and there is a piece more at each end.
    for (tick, position) in [(120, 100.0), (240, 600.0), (360, 1100.0), (480, 1200.0)] {
        assert_eq!(at(&trace, "#1.CMD", tick), position, "{tick}");
    }
    // With equal times SPLINE2 is the same.
    let (other, _) = runs(&moves.replace("SPLINE1", "SPLINE2"), 700, "#1.CMD");
    assert_eq!(at(&other, "#1.CMD", 120), 100.0);
    assert_eq!(at(&other, "#1.CMD", 360), 1100.0);
    // Another TA ends a row of SPLINE1: the next one begins from its stop, behind two pieces more.
    let (trace, _) = runs("INC SPLINE1 TA60\nX6\nTA30\nX6\n", 800, "#1.CMD");
    assert_eq!(at(&trace, "#1.CMD", 360), 600.0);
    assert_eq!(rows(&trace, "#1.CMD").last().unwrap(), &(540, 1200.0));
}

#[test]
fn spline2_takes_the_time_of_each_segment() {
    // 600 counts in 60 ms, then 0 in 30 ms: a=60, b=30, e=10, f=0. The waypoint is 600 + 60·30/90·(-10)/3 = 533.3.
    let (trace, _) = runs("INC SPLINE2 TA60\nX6\nTA30\nX0\n", 800, "#1.CMD,#1.VEL");
    let waypoint = at(&trace, "#1.CMD", 240);
    assert!((waypoint - (600.0 - 200.0 / 3.0)).abs() < 1e-9, "{waypoint}");
    assert_eq!(rows(&trace, "#1.CMD").last().unwrap().1, 600.0);
}

#[test]
fn arcs_keep_their_radius_and_come_back() {
    // A full circle of radius 10 at 50 units a second, clockwise from (0, 0) round (10, 0).
    let moves = "I13=10\nABS TA100 TS20 F50\nCIRCLE1 X0 Y0 I10\n";
    let (trace, events) = runs(moves, 4000, "#1.CMD,#2.CMD,&1.SPEED,&1.X,&1.Y");
    let (x, y) = (rows(&trace, "&1.X"), rows(&trace, "&1.Y"));
    let mut farthest: f64 = 0.0;
    for tick in 0..3000 {
        let (x, y) = (at(&trace, "&1.X", tick), at(&trace, "&1.Y", tick));
        let radius = (x - 10.0).hypot(y);
        // The spline passes inside of the points by V²T²/6R = 0.25/60 at most.
        assert!((9.99..=10.000_001).contains(&radius), "{tick}: {radius}");
        farthest = farthest.max(x);
    }
    assert!(farthest > 19.98, "{farthest}");
    // Clockwise from the left it goes up.
    assert!(y[5].1 > 0.0);
    assert_eq!((x.last().unwrap().1, y.last().unwrap().1), (0.0, 0.0));
    let speed = rows(&trace, "&1.SPEED").iter().fold(0.0, |a: f64, row| a.max(row.1));
    assert!((49.9..=50.001).contains(&speed), "{speed}");
    // 62.83 units take 1256.6 ms, its acceleration 100 ms more, and the spline two segments.
    assert!((2700..2770).contains(&y.last().unwrap().0), "{:?}", y.last());
    assert!(events.contains(r#""state":"ended""#), "{events}");
}

#[test]
fn a_radius_chooses_the_short_arc_and_a_negative_one_the_long_arc() {
    for (direction, radius, highest, lowest) in [
        // From (0, 0) to (10, 10): the centres are (10, 0) and (0, 10).
        ("CIRCLE1", "10", 10.0, 0.0),
        ("CIRCLE2", "10", 10.0, 0.0),
        ("CIRCLE1", "-10", 20.0, 0.0),
        ("CIRCLE2", "-10", 10.0, -10.0),
    ] {
        let moves = format!("I13=5\nABS TA50 F50\n{direction} X10 Y10 R{radius}\n");
        let (trace, _) = runs(&moves, 3000, "&1.X,&1.Y");
        let y = rows(&trace, "&1.Y").into_iter().map(|row| row.1).collect::<Vec<_>>();
        let (top, bottom) =
            (y.iter().fold(0.0, |a: f64, &b| a.max(b)), y.iter().fold(0.0, |a: f64, &b| a.min(b)));
        assert!((top - highest).abs() < 0.02, "{direction} R{radius}: {top}");
        assert!((bottom - lowest).abs() < 0.02, "{direction} R{radius}: {bottom}");
        assert_eq!(*y.last().unwrap(), 10.0);
    }
    let (_, events) = runs("I13=5\nABS F50\nCIRCLE1 X30 Y0 R10\n", 50, "&1.X");
    assert!(events.contains(r#""state":"error","reason":"circle""#), "{events}");
}

#[test]
fn segmented_lines_blend_and_pass_their_points_by_a_spline() {
    // One line of 100 ms at 10 counts/ms with 20 ms of acceleration, in segments of 10 ms.
    let (trace, _) = runs("I13=10\nINC TA20 F100\nX10\n", 600, "#1.CMD,#1.VEL");
    // The path's points are 0, 25, 100, 200 …; the first waypoint is their spline's, 25/6 after a segment.
    assert_eq!(at(&trace, "#1.CMD", 20), 25.0 / 6.0);
    // (0 + 4·25 + 100)/6 after the second.
    assert!((at(&trace, "#1.CMD", 40) - 200.0 / 6.0).abs() < 1e-9);
    // 120 ms of path and two segments more.
    assert_eq!(rows(&trace, "#1.CMD").last().unwrap(), &(280, 1000.0));
}

#[test]
fn latches_of_the_status_words_can_be_written_by_programs() {
    let text = format!(
        "{MOTOR}M145->Y:$0814,10,1\nOPEN PLC 1 CLEAR\nP1=P1+1\nIF (P1=1) CMD\"#1HMZ\" ENDIF\nIF (P1=5) M145=0 ENDIF\nCLOSE\n"
    );
    let folder = Folder::with(&[("l.pmc", &text)]);
    let done = folder.plcc("run l.pmc --simulate --ticks 9 --watch M145 --trace -").exits(0);
    assert_eq!(rows(&done.stdout, "M145"), [(0, 1.0), (4, 0.0)]);
}

#[test]
fn read_takes_the_words_behind_a_call_and_the_line_goes_on_behind_them() {
    let text = format!(
        "{MOTOR}{SYSTEM}OPEN PROG 1000 CLEAR\nRAPID\nRETURN\nN1000 LINEAR\nRETURN\n\
         N4000 READ(P)\nIF (Q100&32768>0) DWELL(Q116)\nP2=Q116\nRETURN\n\
         N92000 READ(X,Y)\nP3=Q100\nPSET X(Q124)Y(Q125)\nRETURN\nCLOSE\n\
         OPEN PROG 1 CLEAR\nABS\nG1 X10 Y5 F50\nG4 P100\nG92 X1 Y2 G0 X3\nCALL 1000.04 P77 X4\nCLOSE\n&1B1R\n"
    );
    let folder = Folder::with(&[("g.pmc", &text)]);
    let done = folder
        .plcc("run g.pmc --simulate --ticks 4000 --watch #1.CMD,#2.CMD,&1.X,&1.Y,P2,P3 --trace -")
        .exits(0)
        .stdout;
    // X and Y are the letters 24 and 25: bits 23 and 24. READ ends at G, so that G0 is called, and X3 is a RAPID move.
    assert_eq!(rows(&done, "P3").last().unwrap().1, 25_165_824.0);
    assert_eq!(rows(&done, "P2").iter().map(|row| row.1).collect::<Vec<_>>(), [0.0, 100.0, 77.0]);
    // From 1000 counts, which PSET calls 1, by 2 to X3 and by one more to X4.
    assert_eq!(rows(&done, "#1.CMD").last().unwrap().1, 1300.0);
    assert_eq!(rows(&done, "#2.CMD").last().unwrap().1, 500.0);
    assert_eq!(rows(&done, "&1.X").last().unwrap().1, 4.0);
    assert_eq!(rows(&done, "&1.Y").last().unwrap().1, 2.0);
}

#[test]
fn a_transformation_turns_what_is_programmed_and_moves_nothing_by_itself() {
    let moves = "ABS F100\nX4 Y2\nTSEL1 TINIT\n\
        Q11=0 Q12=-1 Q13=0 Q14=1 Q15=0 Q16=0 Q17=0 Q18=0 Q19=1\nAROT 11\nDWELL100\nINC X5\nDWELL0\nTSEL0\n\
        P1=1\nTSEL1 Q1=10 Q2=0 Q3=0 ADIS 1\nABS X3\nDWELL0\nTSEL3\n";
    let text = format!("{MOTOR}{SYSTEM}DEFINE TBUF 2\nOPEN PROG 1 CLEAR\n{moves}CLOSE\n&1B1R\n");
    let folder = Folder::with(&[("t.pmc", &text)]);
    let command = "run t.pmc --simulate --ticks 3000 --watch #1.CMD,#2.CMD,&1.X,&1.Y,P1 --trace - --events e.jsonl";
    let trace = folder.plcc(command).exits(0).stdout;
    // A quarter turn: (4, 2) is called (-2, 4), and 5 along X is 5 against Y.
    let done = rows(&trace, "P1")[1].0;
    assert_eq!(at(&trace, "#1.CMD", done), 400.0);
    assert_eq!(at(&trace, "#2.CMD", done), -300.0);
    assert!(rows(&trace, "&1.X").iter().any(|row| row.1 == -2.0));
    assert_eq!((at(&trace, "&1.X", done), at(&trace, "&1.Y", done)), (13.0, 4.0));
    // That place, (4, -3), is (3, 4) turned, and (13, 4) when it is displaced by 10 too; X3 is 10 back along programmed X, which is 10 along Y.
    assert_eq!(rows(&trace, "#2.CMD").last().unwrap().1, 700.0);
    // A third one does not exist.
    assert!(events(&folder, "e.jsonl")[1].contains(r#""state":"error","reason":"unsupported""#));
}

#[test]
fn steps_end_behind_moves_or_with_i53_behind_lines() {
    for (i53, expected) in [(0, [100.0, 200.0, 300.0]), (1, [200.0, 300.0, 300.0])] {
        let text = format!(
            "{MOTOR}{SYSTEM}I53={i53}\nOPEN PROG 1 CLEAR\nINC TM20\nX1 X1\nX1\nP2=1\nCLOSE\n\
             OPEN PLC 1 CLEAR\nP1=P1+1\nIF (P1=1) CMD\"&1B1S\" ENDIF\nIF (P1=300) CMD\"&1S\" ENDIF\nIF (P1=600) CMD\"&1S\" ENDIF\n\
             CLOSE\n"
        );
        // With I53 the line with TM20 is a step of its own.
        let text = if i53 == 1 { text.replace("INC TM20\n", "INC TM20 ") } else { text };
        let folder = Folder::with(&[("s.pmc", &text)]);
        let done =
            folder.plcc("run s.pmc --simulate --ticks 900 --watch #1.CMD,P2 --trace -").exits(0);
        let reached = [299, 599, 899].map(|tick| at(&done.stdout, "#1.CMD", tick));
        assert_eq!(reached, expected, "I53={i53}");
    }
}

#[test]
fn the_time_base_may_be_any_word() {
    // Ix93 names X:$07F0, to which a PLC writes half of the servo cycle's time, then all of it.
    let text = format!(
        "{MOTOR}I193=$7F0\nI194=8388607\nM1->X:$07F0,0,24\nM2->X:$0808,0,24\n#1->X\nOPEN PLC 0 CLEAR\nP1=P1+1\n\
         M1=2097152\nIF (P1>50) M1=4194304 ENDIF\nIF (P1=1) CMD\"#1J=200\" ENDIF\nIF (P1=3) CMD\"%\" ENDIF\nCLOSE\n"
    );
    let folder = Folder::with(&[("b.pmc", &text)]);
    let done = folder
        .plcc(
            "run b.pmc --simulate --ticks 100 --watch #1.CMD,M2,&1.BASE --trace - --events e.jsonl",
        )
        .exits(0);
    let trace = done.stdout;
    assert_eq!(rows(&trace, "&1.BASE"), [(0, 0.0), (1, 50.0), (51, 100.0)]);
    assert_eq!(rows(&trace, "M2").last().unwrap().1, 4_194_304.0);
    // Time 0 is tick 2. 20 cycles of a quarter ms, half of the ramp of 10 ms: 12.5 counts.
    assert_eq!(at(&trace, "#1.CMD", 22), 12.5);
    assert_eq!(rows(&trace, "#1.CMD").last().unwrap().1, 200.0);
    assert!(folder.read("e.jsonl").contains(r#""kind":"answer","text":"50""#));
}

/// Two motors of a Turbo PMAC whose kinematics turn and stretch X and Y.
const ARM: &str = "I100=1 I200=1 I111=0 I211=0 I220=10 I221=0 I219=100 I222=10 I116=1000 I216=1000 I117=100 I217=100\n\
    I5190=1000 I5187=20 I5188=0 I5113=0 I5150=1\n&1 #1->I #2->I\n\
    OPEN FORWARD CLEAR\nQ7=P1/100\nQ8=(P2-P1)/50\nP50=P50+1\nCLOSE\n\
    OPEN INVERSE CLEAR\nP1=Q7*100\nP2=Q7*100+Q8*50\nP51=P51+1\nIF (Q10=1)\nP101=Q17*100\nP102=Q17*100+Q18*50\nENDIF\nCLOSE\n";

#[test]
fn kinematics_give_motors_from_axes_and_axes_from_motors() {
    let program = "OPEN PROG 1 CLEAR\nLINEAR ABS F20\nX10\nX20 Y10\nDWELL0\nP2=0\nP60=P51\nRAPID X0\nP61=P51\nDWELL0\n\
        PVT100\nX5:50 Y2\nX10\nDWELL0\nP62=P51\nCLOSE\n&1B1R\n";
    let text = format!("{MOTOR}{ARM}{program}").replace("P2=0\n", "");
    let folder = Folder::with(&[("k.pmc", &text)]);
    let run = |engine: &str| {
        let command = format!(
            "run k.pmc --controller turbo --simulate --ticks 4000 --engine {engine} --watch \
             #1.CMD,#2.CMD,&1.X,&1.Y,P50,P60,P61,P62 --trace - --events e.jsonl"
        );
        folder.plcc(&command).exits(0).stdout
    };
    let trace = run("interp");
    for engine in ["jit", "aot"] {
        assert_eq!(run(engine), trace);
    }
    // R matches once. Each move's end asks the inverse program once: two lines, then RAPID, then two PVT moves.
    let last = |name| rows(&trace, name).last().unwrap().1;
    assert_eq!(["P50", "P60", "P61", "P62"].map(last), [1.0, 2.0, 3.0, 5.0]);
    let second = rows(&trace, "P60")[1].0;
    assert_eq!((at(&trace, "#1.CMD", second), at(&trace, "#2.CMD", second)), (2000.0, 2500.0));
    assert_eq!((at(&trace, "&1.X", second), at(&trace, "&1.Y", second)), (20.0, 10.0));
    // The first PVT move ends at X5 with 50 units a second, which is 5 counts/ms of both motors.
    let third = rows(&trace, "P61")[1].0;
    assert!(third > second);
    assert_eq!((last("#1.CMD"), last("#2.CMD")), (1000.0, 1100.0));
    assert_eq!((last("&1.X"), last("&1.Y")), (10.0, 2.0));
}

/// A forward program that takes too long to be run for a display in each tick.
#[test]
fn a_long_forward_program_is_not_run_for_displays() {
    let program = "OPEN PROG 1 CLEAR\nLINEAR ABS F20\nX10\nCLOSE\n&1B1R\n";
    let text = format!("{MOTOR}{ARM}{program}");
    let show = |rounds: u32| {
        let wait = format!("P70=0\nWHILE (P70<{rounds})\nP70=P70+1\nENDWHILE\nP50=P50+1\n");
        let folder = Folder::with(&[("k.pmc", &text.replace("P50=P50+1\n", &wait))]);
        let command =
            "run k.pmc --controller turbo --simulate --ticks 300 --watch &1.X,P50 --trace -";
        folder.plcc(command).exits(0).stdout
    };
    let (short, long) = (show(100), show(100_000));
    for trace in [&short, &long] {
        assert_eq!(rows(trace, "P50").last().unwrap().1, 1.0, "R has run it");
    }
    // It is shown where the axis is, or else the end of the move that is calculated.
    let (now, end) = (at(&short, "&1.X", 200), at(&long, "&1.X", 200));
    assert!(0.5 < now && now < 5.0, "{now}");
    assert_eq!(end, 10.0);
}

/// The second move begins at 24 - 5/2 = 21.5 ms and so in the segment of 28 ms, and its stop would begin at 24 + TM - 5/2 ms.
#[test]
fn a_move_of_less_than_two_segments_is_late_where_the_next_point_is_beyond_its_stop() {
    let runs = |tm: u32| {
        let text = format!(
            "{MOTOR}I13=7\n#1->100X\nOPEN PROG 1 CLEAR\nLINEAR ABS TM{tm} TA16 TS7\nX1\nTA5 TS2\nX2\nX3\nCLOSE\n&1B1R\n"
        );
        let folder = Folder::with(&[("s.pmc", &text)]);
        folder.plcc("run s.pmc --simulate --ticks 200 --events e.jsonl").exits(0);
        events(&folder, "e.jsonl").swap_remove(1)
    };
    let late = runs(13);
    assert!(late.starts_with("{\"tick\":56,") && late.contains("\"late\""), "{late}");
    assert!(runs(14).contains("\"ended\""));
}

#[test]
fn kinematics_are_asked_for_each_point_of_a_path_in_segments() {
    let program = "OPEN PROG 1 CLEAR\nABS TA20 F100\nX10\nCLOSE\n&1B1R\n";
    let text = format!("{MOTOR}{ARM}I5113=10\n{program}");
    let folder = Folder::with(&[("k.pmc", &text)]);
    let command =
        "run k.pmc --controller turbo --simulate --ticks 400 --watch #1.CMD,#2.CMD,P51 --trace -";
    let trace = folder.plcc(command).exits(0).stdout;
    // As the line without kinematics: its first waypoints are 25/6 and 200/6 counts.
    assert_eq!(at(&trace, "#1.CMD", 20), 25.0 / 6.0);
    assert!((at(&trace, "#2.CMD", 40) - 200.0 / 6.0).abs() < 1e-9);
    assert_eq!(rows(&trace, "#1.CMD").last().unwrap(), &(280, 1000.0));
    // 120 ms of path and two segments more: a point each.
    assert_eq!(rows(&trace, "P51").last().unwrap().1, 14.0);
    assert_eq!(at(&trace, "P51", 1), 1.0);
}

#[test]
fn a_kinematic_program_without_an_end_and_one_that_moves_are_told() {
    let text = format!(
        "{MOTOR}{}OPEN PROG 1 CLEAR\nX10\nCLOSE\n&1B1R\n",
        ARM.replace("P51=P51+1\n", "WHILE (P51=0)\nENDWHILE\n")
    );
    let folder = Folder::with(&[("k.pmc", &text)]);
    let command = "run k.pmc --controller turbo --simulate --ticks 5 --events e.jsonl";
    folder.plcc(command).exits(0);
    let events = folder.read("e.jsonl");
    assert!(events.contains(r#""state":"error","reason":"late""#), "{events}");
    folder.write("k.pmc", text.replace("P50=P50+1\n", "CMD\"#1J+\"\n"));
    folder.plcc(command).exits(1).says(&["a kinematic program only calculates", "PLC"]);
    folder
        .plcc("check k.pmc --controller turbo")
        .exits(0)
        .says(&["PMAC-W19", "the forward kinematic program of coordinate system 1 has errors"]);
    // A PMAC has none.
    folder.write("p.pmc", "OPEN FORWARD CLEAR\nQ7=P1\nCLOSE\n");
    folder.plcc("check p.pmc").exits(0).says(&["PMAC-N1"]);
}

#[test]
fn prelude_calls_in_front_of_words() {
    let text = format!(
        "{MOTOR}{SYSTEM}OPEN PROG 500 CLEAR\nP1=P1+1\nREAD(X)\nIF (Q100>0) P3=P3+Q124\nRETURN\nN100 P2=P2+1\nRETURN\nCLOSE\n\
         OPEN PROG 1 CLEAR\nABS F200\nX1 Y1\nPRELUDE1 CALL500\nX10 Y20\nX5\nP4=P1 P5=P3\nGOSUB 9 Y4\nY3 F50 Y1\nP6=P1\n\
         PRELUDE1 CALL500.001\nN7 X3 Y2 X2\nPRELUDE0\nX1\nRETURN\nN9 Y7\nRETURN\nCLOSE\n&1B1R\n"
    );
    let folder = Folder::with(&[("p.pmc", &text)]);
    let run = |engine: &str| {
        let command = format!(
            "run p.pmc --simulate --ticks 4000 --engine {engine} --watch #1.CMD,#2.CMD,P1,P2,P3,P4,P5,P6 --trace -"
        );
        folder.plcc(&command).exits(0).stdout
    };
    let trace = run("interp");
    for engine in ["jit", "aot"] {
        assert_eq!(run(engine), trace);
    }
    let last = |name| rows(&trace, name).last().unwrap().1;
    // In front of X10, which READ takes; of Y20, which is a move then; and of X5, which is taken too.
    assert_eq!((last("P4"), last("P5")), (3.0, 15.0));
    // In front of Y4, not of the move in the subroutine; of Y3, which goes on with F50, and of Y1.
    assert_eq!(last("P6"), 6.0);
    // In front of X3 Y2, which is one move, and of X2.
    assert_eq!((last("P1"), last("P2")), (6.0, 2.0));
    // X never went to 10 or 5.
    let highest = rows(&trace, "#1.CMD").iter().fold(0.0, |a: f64, row| a.max(row.1));
    assert!((200.0..=300.0).contains(&highest), "{highest}");
    assert_eq!((last("#1.CMD"), last("#2.CMD")), (100.0, 200.0));
}

#[test]
fn the_panel_jogs_homes_starts_and_holds() {
    let text = format!(
        "{MOTOR}{SYSTEM}I2=0 I902=4\nM28->Y:$FFC0,16,4\nM20->Y:$FFC0,8\nM21->Y:$FFC0,9\nM23->Y:$FFC0,11\nM24->Y:$FFC0,12\nM25->Y:$FFC0,13\n\
         M26->Y:$FFC0,14\nM180->X:$0818,0\nOPEN PROG 1 CLEAR\nINC F100\nX20\nX20\nX20\nCLOSE\n&1B1\n"
    );
    // Motor 1 and coordinate system 1 are selected, then: J+ for 100 ticks, HM, start, and quit by the button of steps.
    let rows_of = "tick,name,value\n1,M28,14\n10,M21,0\n110,M21,1\n300,M26,0\n302,M26,1\n600,M23,0\n603,M23,1\n650,M24,0\n";
    let folder = Folder::with(&[("p.pmc", &text), ("s.csv", rows_of)]);
    let command = "run p.pmc --simulate --ticks 2000 --stimulus s.csv --watch #1.CMD,#1.VEL,M180,M20 --trace - --events e.jsonl";
    let trace = folder.plcc(command).exits(0).stdout;
    assert_eq!(rows(&trace, "M20"), [(0, 1.0)]);
    // The jog begins two cycles after the housekeeping of tick 10, and is at its speed after 10 ms.
    assert_eq!(at(&trace, "#1.VEL", 12), 0.0);
    assert_eq!(at(&trace, "#1.VEL", 60), 10.0);
    assert_eq!(at(&trace, "#1.VEL", 112), 10.0);
    assert_eq!(at(&trace, "#1.VEL", 140), 0.0);
    let events: Vec<String> = events(&folder, "e.jsonl");
    let kinds =
        [r#""kind":"home","motor":1"#, r#""state":"started""#, r#""state":"stopped","reason":"Q""#];
    assert_eq!(events.len(), 3, "{events:?}");
    for (event, kind) in events.iter().zip(kinds) {
        assert!(event.contains(kind), "{event}");
    }
    // Nobody is selected: nothing happens. Without I2=0 neither.
    folder.write("s.csv", "tick,name,value\n1,M28,15\n10,M21,0\n");
    assert_eq!(rows(&folder.plcc(command).exits(0).stdout, "#1.CMD").len(), 1);
    folder.write("s.csv", rows_of);
    folder.write("p.pmc", text.replace("I2=0", "I2=1"));
    assert_eq!(rows(&folder.plcc(command).exits(0).stdout, "#1.CMD").len(), 1);
}

/// A program of long lines in segments of 10 ms, and what PLC 1 sends in some ticks.
fn halted(commands: &[(u32, &str)]) -> String {
    let sends: String = commands
        .iter()
        .map(|(tick, text)| format!("IF (P1={tick}) CMD\"{text}\" ENDIF\n"))
        .collect();
    format!(
        "{MOTOR}{SYSTEM}I13=10 I52=20972 I195=1000\nM123->Y:$0817,23\nM180->X:$0818,0\nOPEN PROG 1 CLEAR\nINC TA20 F100\nX10\nX10\nX10\nP2=1\n\
         CLOSE\nOPEN PLC 1 CLEAR\nP1=P1+1\n{sends}CLOSE\n&1B1R\n"
    )
}

#[test]
fn a_slash_ends_behind_the_move_and_keeps_the_next_one() {
    let folder = Folder::with(&[("h.pmc", &halted(&[(100, "&1/"), (700, "&1R")]))]);
    let command = "run h.pmc --simulate --ticks 1600 --watch #1.CMD,P2 --trace - --events e.jsonl";
    let trace = folder.plcc(command).exits(0).stdout;
    // The first move is made to its end: 120 ms of path and two segments.
    assert_eq!(rows(&trace, "#1.CMD").iter().rfind(|row| row.0 < 690).unwrap(), &(280, 1000.0));
    let events = events(&folder, "e.jsonl");
    assert!(events[2].contains(r#""state":"stopped","reason":"Q""#), "{events:?}");
    // R goes on with the second, which was calculated; none is lost.
    assert_eq!(rows(&trace, "#1.CMD").last().unwrap().1, 3000.0);
    assert_eq!(rows(&trace, "P2").last().unwrap().1, 1.0);
    assert!(events.last().unwrap().contains(r#""state":"ended""#), "{events:?}");
}

#[test]
fn a_backslash_stops_on_the_path_and_the_motors_may_jog_away_and_back() {
    let commands = [(100, "&1\\"), (500, "#1J:100"), (700, "&1R"), (710, "#1J:-100"), (900, "&1R")];
    let folder = Folder::with(&[("h.pmc", &halted(&commands))]);
    let command = "run h.pmc --simulate --ticks 2200 --watch #1.CMD,M123,M180,&1.BASE,P2 --trace - --events e.jsonl";
    let trace = folder.plcc(command).exits(0).stdout;
    // I10 is 4194304, so that I52=20972 takes 200 cycles.
    let (stop, _) = rows(&trace, "M123")[1];
    assert_eq!(stop, 299);
    assert_eq!(
        rows(&trace, "M180"),
        [(0, 1.0), (299, 0.0), (899, 1.0), (rows(&trace, "M180")[3].0, 0.0)]
    );
    let held = at(&trace, "#1.CMD", stop);
    assert!(held > 100.0 && held < 2000.0 && at(&trace, "#1.CMD", 490) == held, "{held}");
    assert_eq!(at(&trace, "#1.CMD", 690), held + 100.0);
    assert!((at(&trace, "#1.CMD", 890) - held).abs() < 1e-9);
    assert_eq!(rows(&trace, "#1.CMD").last().unwrap().1, 3000.0);
    let told: Vec<String> =
        events(&folder, "e.jsonl").into_iter().filter(|e| !e.contains("command")).collect();
    let expected = [
        r#""state":"started""#,
        r#""state":"stopped","reason":"\\""#,
        r#""text":"R","system":1,"error":"ERR017""#,
        r#""state":"started""#,
        r#""state":"ended""#,
    ];
    assert_eq!(told.len(), expected.len(), "{told:#?}");
    for (event, part) in told.iter().zip(expected) {
        assert!(event.contains(part), "{event}: {part}");
    }
}

#[test]
fn what_is_not_simulated_is_told_at_load() {
    let text = "I5=0\nI100=1 I101=1 I160=1 I186=16 I125=$3440 I51=1\nI201=1\n";
    let folder = Folder::with(&[("n.pmc", text)]);
    folder.plcc("run n.pmc --simulate --ticks 1").exits(0).says(&[
        "motor 1: commutation is not simulated (I101=1)",
        "has no switches",
        "(I160=1)",
        "motor 1: backlash is not simulated (I186=16)",
        "compensation tables are not simulated (I51=1)",
    ]);
    let quiet = folder.plcc("run n.pmc --ticks 1").exits(0);
    assert!(!quiet.stderr.contains("simulated"), "{}", quiet.stderr);
    let other = folder.plcc("run n.pmc --simulate --ticks 1").stderr;
    assert!(!other.contains("motor 2"), "{other}");
}

#[test]
fn conditions_of_test_scripts_name_positions() {
    let text = format!("{MOTOR}{SYSTEM}OPEN PROG 1 CLEAR\nINC F20 X5\nP1=1\nCLOSE\n&1B1R\n");
    let script = "program \"w.pmc\"\nsimulate\nnever #1.CMD > 501\nnever #1.CMD - 100*&1.X > 1 OR &1.X > 6\ntest \"a\"\n\
        wait until #1.CMD >= 250 within 1 s\nexpect #1.VEL > 1.5, &1.X < 3\nexpect #1.CMD + 1 > 250 AND P1 = 1\n\
        wait until &1.X = 5 within 1 s\nexpect ABS(#1.FE) < 1 AND #1.CMD = 500\nend\n";
    let folder = Folder::with(&[("w.pmc", &text), ("w.plctest", script)]);
    folder.plcc("test w.plctest").exits(0);
    folder.write("w.plctest", script.replace("#1.CMD = 500", "#1.CMD = 501"));
    let failed = folder.plcc("test w.plctest").exits(1).stdout;
    assert!(failed.contains("#1.CMD = 500"), "{failed}");
    let why = folder.plcc("why w.pmc #1.CMD --simulate --ticks 200").exits(0).stdout;
    assert!(why.contains("#1.CMD has been") && why.contains("the control"), "{why}");
    folder.write("w.plctest", script.replace("#1.FE", "#1.NONE"));
    folder.plcc("test w.plctest").exits(2).says(&["#"]);
}

#[test]
fn a_sequence_keeps_the_limits_with_which_it_was_calculated() {
    // Ix17 makes 40 ms of the acceleration of 20 ms, of that of the stop too, although the program has segments from then on.
    let (trace, _) = runs("I117=0.25\nINC TA20 F100\nX10\nI13=10\n", 400, "#1.CMD");
    assert_eq!(rows(&trace, "#1.CMD").last().unwrap(), &(280, 1000.0));
}

#[test]
fn a_move_that_is_shorter_than_a_segment_is_late_and_moves_nothing() {
    let moves = "INC PVT100\nX5:0\nDWELL0\nI13=10\nLINEAR TA0 F1000\nX1\nX1\n";
    let (trace, events) = runs(moves, 500, "#1.CMD");
    assert!(events.contains(r#""state":"error","reason":"late""#), "{events}");
    assert_eq!(rows(&trace, "#1.CMD").last().unwrap(), &(200, 500.0));
}

#[test]
fn xref_lists_labels_calls_and_axes() {
    let text = "OPEN PROG 1 CLEAR\nX10 Y(P1)\nGOSUB 100\nGOTO(P2)\nCALL 2.001\nG1 X5\nCALL(P3)\nRETURN\nN100 Z1\n\
        RETURN\nCLOSE\nOPEN PROG 2 CLEAR\nN100\nCLOSE\nOPEN PROG 1000 CLEAR\nN1000 LINEAR\nCLOSE\n";
    let folder = Folder::with(&[("x.pmc", text)]);
    let table = folder.plcc("xref x.pmc").exits(0).stdout;
    let found: Vec<Vec<&str>> = table
        .lines()
        .filter(|line| line.starts_with("PROG") || line.starts_with("axis"))
        .map(|line| line.split("  ").map(str::trim).filter(|part| !part.is_empty()).collect())
        .collect();
    let expected = [
        vec!["axis X", "2 6"],
        vec!["axis Y", "2"],
        vec!["axis Z", "9"],
        vec!["PROG (…)", "-", "7"],
        vec!["PROG 1", "1"],
        vec!["PROG 1 N(…)", "-", "4"],
        vec!["PROG 1 N100", "9", "3"],
        vec!["PROG 2", "12", "5"],
        vec!["PROG 2 N100", "13", "5"],
        vec!["PROG 1000", "15", "6"],
        vec!["PROG 1000 N1000", "16", "6"],
    ];
    for row in expected {
        assert!(found.iter().any(|own| own.starts_with(&row)), "{row:?}\n{table}");
    }
    assert_eq!(found.len(), 11, "{table}");
}

#[test]
fn the_guide_s_listings_run() {
    // Each with the motor that moves and the counts at which its section says that it ends.
    let listings = [
        // Running a motion program.
        ("#1->2000X\nOPEN PROG 1 CLEAR\nLINEAR\nINC\nTA100\nTS0\nF50\nX1\nCLOSE\n", 1, 2000.0),
        // Passing arguments to subroutines.
        (
            "#1->2000X\nopen prog1 clear\nLINEAR INC TA100 TS0 F50\ngosub 100 H10\nreturn\nn100\nread(h)\nIF (Q100 & $80 > 0)\n X(Q108)\n\
             endif\nreturn\nclose\n",
            1,
            20_000.0,
        ),
        // Linear blended moves.
        (
            "&1\n#1->2000x\nOPEN PROG 1 CLEAR\n\nLINEAR\nINC\nTA100\nTS0\nTM250\nX10\nTA250\nX40\n\nCLOSE\n",
            1,
            100_000.0,
        ),
        (
            "&1\n#1->2000X\nI190=1000\nOPEN PROG 1 CLEAR\nLINEAR\nINC\nTA100\nTS0\nF40\nX3\nCLOSE\n",
            1,
            6000.0,
        ),
        (
            "&1\n#1->2000X\nI190=1000\nOPEN PROG 1\nCLEAR\nLINEAR\nINC\nTS0\nF40\nTA100\nX3\nTA75\nX3\nCLOSE\n",
            1,
            12_000.0,
        ),
        // Circular interpolation: X is a phantom.
        (
            "&1\nI200=1\n#2->2000Y\nopen prog1 clear\ninc\ninc (r)\nta300\nts0\ntm1000\ni13=10\nnormal k-1\ncircle1\nx0 y0 i10\nclose\n",
            2,
            0.0,
        ),
        // PVT-mode moves.
        ("&1 #1->2000X\n\nOPEN PROG 1 CLEAR\nINC\nPVT300\n\nX5:50\n\nX5:0\n\nCLOSE\n", 1, 20_000.0),
        // How PMAC executes a motion program.
        (
            "#1->2000X\nOPEN PROG 1 CLEAR\nI13=0\nLINEAR INC TA100 TS0 F50\nX1\nX1\nX1\nM1=1\n\nCLOSE\n",
            1,
            6000.0,
        ),
    ];
    let begin = "close\ndelete gather\nundefine all\nI10=4194304 I116=1000 I216=1000 I117=10 I217=10\nM1->*\n";
    for (listing, motor, end) in listings {
        let folder = Folder::with(&[("g.pmc", &format!("{begin}{listing}&1b1r\n"))]);
        let command = format!(
            "run g.pmc --simulate --ticks 6000 --watch #{motor}.CMD --trace - --events e.jsonl"
        );
        let trace = folder.plcc(&command).exits(0).stdout;
        assert!(folder.read("e.jsonl").contains(r#""state":"ended""#), "{listing}");
        let all = rows(&trace, &format!("#{motor}.CMD"));
        assert!(all.len() > 100, "{listing}");
        let last = all.last().unwrap().1;
        assert!((last - end).abs() < 1e-9, "{listing}: {last}");
    }
}
