//! `plcc test`

#![allow(clippy::unwrap_used, clippy::indexing_slicing)]

mod support;

use support::{COUNTER, Folder, PLC1, SLICES, STOPS};

/// A pump with a door and a message.
const PUMP: &str = "$INPUT\nDOOR=1/0\nSTART=1/1\n$OUTPUT\nPUMP=2/0\n$INTEGER\nN\n$MESSAGE\nWARN = \"DOOR IS OPEN\"\n\
    $END\nN=N+1\nPUMP = START & DOOR ! PUMP & DOOR\nWARN = /DOOR & START\n";

/// Runs a script with the statements of one test in all engines.
fn run(program: &str, text: &str, head: &str, statements: &str) -> (Folder, String, i32) {
    let script = format!("program \"{program}\"\n{head}test \"it\"\n{statements}\nend\n");
    let folder = Folder::with(&[(program, text), ("a.plctest", &script)]);
    let mut all = vec![];
    for engine in ["jit", "interp", "aot"] {
        let done = folder.plcc(&format!("test a.plctest --engine {engine} --records r"));
        assert_eq!(done.stderr, "", "{statements}");
        all.push((done.stdout, done.status));
    }
    assert!(all.windows(2).all(|pair| pair[0] == pair[1]), "{all:#?}");
    let (text, status) = all.remove(0);
    (folder, text, status)
}

fn passes(program: &str, text: &str, statements: &str) {
    let (_, said, status) = run(program, text, "", statements);
    assert_eq!(status, 0, "{statements}\n{said}");
}

fn fails(program: &str, text: &str, head: &str, statements: &str, parts: &[&str]) {
    let (_, said, status) = run(program, text, head, statements);
    assert_eq!(status, 1, "{statements}\n{said}");
    for part in parts {
        assert!(said.contains(part), "{part} is not in\n{said}");
    }
}

#[test]
fn statements_act_in_the_tick_that_they_say() {
    for statements in [
        "expect N = 1\nexpect N = 1",
        "run 1 tick\nexpect N = 1",
        "run 40 ms\nexpect N = 2",
        "run 41 ms\nexpect N = 3",
        "wait until N = 1 within 1 tick\nexpect N = 1",
        "set N = 100\nexpect N = 101",
        "run 2 ticks\nset N = 100, DOOR = 1\nexpect N = 2, /DOOR\nrun 1 tick\nexpect N = 101, DOOR",
        "wait until N = 5 within 4 ticks\nexpect N = 5",
        "pulse START\nrun 1 tick\nexpect START\nrun 1 tick\nexpect /START",
        "pulse START for 60 ms\nrun 3 ticks\nexpect START\nrun 1 tick\nexpect /START",
        "set DOOR = 1\npulse START\nwait until PUMP within 1 s\nhold PUMP, DOOR for 1 s\nexpect N = 51",
        "force DOOR = 1\nset DOOR = 0\nrun 3 ticks\nexpect DOOR\nrelease DOOR\nrun 1 tick\nexpect /DOOR",
        "pulse START\nrun 3 ticks\nexpect message \"DOOR IS\"",
        "run 3 ticks\npower cycle\nexpect N = 1",
        "force DOOR = 1\nrun 1 tick\npower cycle\nrun 1 tick\nexpect DOOR",
        "set PORT1.0 = 1\nrun 1 tick\nexpect PORT1.0 = 1, DOOR",
        "",
    ] {
        passes("a.pmi", PUMP, statements);
    }
}

#[test]
fn names_that_people_gave_are_taken_everywhere() {
    let folder = Folder::with(&[
        ("a.pmi", PUMP),
        (
            "a.machine.toml",
            "[names]\nDOOR = { alias = \"GATE\" }\nPUMP = { alias = \"Main_pump\" }\n",
        ),
        ("c.pmc", "#define COUNT P1\nI5=2\nOPEN PLC 1 CLEAR\nCOUNT=COUNT+1\nCLOSE\n"),
        (
            "a.plctest",
            "program \"a.pmi\"\nnever Main_pump & /GATE\ntest \"a\"\nset GATE = 1, START = 1\nrun 1 tick\n\
            expect Main_pump & GATE\nforce GATE = 0\nrun 1 tick\nexpect /GATE, Main_pump = 0\nend\n",
        ),
        (
            "c.plctest",
            "program \"c.pmc\"\ntest \"c\"\nwait until COUNT>3 AND COUNT<9 within 1 s\nset COUNT = 70\nrun 1 tick\nexpect COUNT!<70\nend\n",
        ),
        ("bad.plctest", "program \"a.pmi\"\ntest \"a\"\nexpect GATE & Main_pump & NONE\nend\n"),
    ]);
    folder.plcc("test a.plctest c.plctest").exits(0);
    let found = folder.plcc("test bad.plctest --message-format json").exits(2).json();
    assert_eq!((&found[0]["line"], &found[0]["column"]), (&3.into(), &27.into()));
}

#[test]
fn every_language_is_tested_in_its_own_conditions() {
    passes("b.plc", SLICES, "expect F020 = 1\nrun 4 ticks\nexpect LF020 =5, F020 >= 5, NF0201");
    passes(
        "c.pmc",
        PLC1,
        "wait until P1>3 AND P1<9 within 1 s\nset P1 = 100.5\nrun 40 ticks\nexpect P1!<101",
    );
    passes("c.pmc", PLC1, "set X:$07F0 = $FF\nrun 1 tick\nexpect X:$07F0 = 255");
    fails("b.plc", SLICES, "", "expect F020 = 2", &["F020 = 1"]);
    fails("c.pmc", PLC1, "", "wait until P1 = 0 within 1 s\nexpect P1 = 7", &["P1 = "]);
}

#[test]
fn a_failure_shows_its_line_values_tick_and_events() {
    let parts = [
        "a.plctest:4: wait until PUMP within 1 s",
        "after 50 ticks, in tick 50",
        "PUMP = 0",
        "\"DOOR IS OPEN\"",
        "1 failed",
    ];
    fails("a.pmi", PUMP, "", "set START = 1\nwait until PUMP within 1 s\nexpect N = 0", &parts);
    fails("a.pmi", PUMP, "", "hold N < 4 for 1 s", &["in tick 4 of 50", "N = 4"]);
    fails("a.pmi", PUMP, "", "expect message \"TURRET\"", &["no event contains \"TURRET\""]);
    fails(
        "a.pmi",
        PUMP,
        "never N = 3\n",
        "run 9 ticks",
        &[
            "a.plctest:2: never N = 3",
            "`N = 3` holds, in tick 2",
            "during a.plctest:4: run 9 ticks",
        ],
    );
    fails(
        "a.pmi",
        PUMP,
        "always N < 3\n",
        "expect N = 1\nhold N > 0 for 1 s",
        &["a.plctest:2: always N < 3", "N = 3"],
    );
    let parts = ["after a power cycle", "in tick 1", "N = 2"];
    fails("a.pmi", PUMP, "", "run 7 ticks\npower cycle\nrun 2 ticks\nexpect N = 9", &parts);
}

#[test]
fn invariants_hold_for_the_tests_below_them() {
    let script = "program \"a.pmi\"\ntest \"above\"\nrun 5 ticks\nend\nnever N = 3\ntest \"below\"\nrun 5 ticks\nend\n";
    let folder = Folder::with(&[("a.pmi", PUMP), ("a.plctest", script)]);
    let done = folder.plcc("test a.plctest").exits(1);
    assert!(
        done.stdout.contains("ok     above") && done.stdout.contains("FAILED below"),
        "{}",
        done.stdout
    );
}

#[test]
fn what_has_to_follow_is_looked_at_in_each_tick_of_the_tests_below() {
    let late = "$INPUT\nA=0/0\n$OUTPUT\nX=1/0\n$TIMER\nE/TC/DC=5\n$END\nTC = A\nX = DC\n";
    let script = |within: &str, statements: &str| {
        format!("program \"a.pmi\"\nafter A, X within {within}\ntest \"t\"\n{statements}\nend\n")
    };
    let folder = Folder::with(&[("a.pmi", late)]);
    let done = |within: &str, statements: &str, status| {
        folder.write("a.plctest", script(within, statements));
        folder.plcc("test a.plctest").exits(status).stdout
    };
    done("5 ticks", "set A = 1\nrun 20 ticks", 0);
    done("100 ms", "run 3 ticks\nset A = 1\nrun 20 ticks", 0);
    let shown = done("4 ticks", "run 3 ticks\nset A = 1\nrun 20 ticks", 1);
    for part in [
        "a.plctest:2: after A, X within 4 ticks",
        "`X` does not hold 4 ticks after `A` became true",
        "X = 0",
    ] {
        assert!(shown.contains(part), "{shown}");
    }
    // It is due from when A becomes true, and only then; the end of a test and of the power end it.
    done("5 ticks", "pulse A\nrun 20 ticks", 1);
    done("5 ticks", "pulse A\nrun 5 ticks", 0);
    done("5 ticks", "set A = 1\nrun 4 ticks\npower cycle\nrun 20 ticks", 0);
    let shown = done("0 ticks", "set A = 1\nrun 1 tick", 1);
    assert!(shown.contains("`X` does not hold where `A` becomes true"), "{shown}");
    folder.write("a.plctest", script("5 ticks", "run 1 tick").replace("X within", "Z+ within"));
    let done = folder.plcc("test a.plctest").exits(2);
    assert!(done.stderr.contains("a.plctest:2:10"), "{}", done.stderr);
}

#[test]
fn stops_are_expected_or_fail_the_test() {
    let code = "NO PMI DATA";
    for statements in [
        format!("run 9 ticks\nexpect N = 3, stop \"{code}\""),
        format!("run 9 ticks\nexpect N = 3\nexpect stop \"{code}\"\nexpect N = 3"),
        format!(
            "wait until N = 3 within 1 s\nrun 1 tick\nexpect stop \"{code}\"\npower cycle\nexpect N = 1"
        ),
    ] {
        passes("s.pmi", STOPS, &statements);
    }
    for (statements, part) in [
        ("run 9 ticks".to_owned(), "a.plctest:3: run 9 ticks"),
        ("run 3 ticks\nexpect stop \"NO PMI DATA\"".into(), "the program was not stopped"),
        ("run 9 ticks\nexpect stop \"WATCHDOG\"".into(), "stopped with NO PMI DATA"),
        (format!("run 9 ticks\nexpect stop \"{code}\"\nrun 1 tick"), "a.plctest:5: run 1 tick"),
        ("hold N < 9 for 1 s".into(), "stopped with NO PMI DATA"),
    ] {
        fails("s.pmi", STOPS, "", &statements, &[part]);
    }
}

#[test]
fn retained_values_survive_a_power_cycle() {
    // A PMAC keeps what SAVE saved, NCT F500 to F999.
    let text = "I5=2\nOPEN PLC 1 CLEAR\nP1=P1+1\nIF (P1=3)\nCOMMAND\"SAVE\"\nENDIF\nCLOSE\n";
    passes("c.pmc", text, "wait until P1=5 within 1 s\npower cycle\nexpect P1>2 AND P1<5");
    passes(
        "b.plc",
        ":000 J0 :001 LF020 +1 SF020 SF500 J1",
        "run 9 ticks\npower cycle\nexpect F500 = 1, F020 = 1",
    );
    passes("b.plc", ":000 J0 :001 LF500 +1 SF500 J1", "run 9 ticks\npower cycle\nexpect F500 = 10");
}

#[test]
fn mistakes_are_told_at_their_places_and_nothing_is_run() {
    let script = "program \"a.pmi\"\ntest \"y\"\n  set DOR = 1\n  set N = x\n  expect N\n  expect DOR\n  \
        expect N = 3, N + = 3\n  force N = 3\n  runn 5 ticks\n  set A[0 = 1\nend\n";
    let folder = Folder::with(&[("a.pmi", PUMP), ("a.plctest", script)]);
    let done = folder.plcc("test a.plctest --message-format json").exits(2);
    let found: Vec<_> = done
        .json()
        .iter()
        .map(|d| format!("{} {}:{}", d["code"].as_str().unwrap(), d["line"], d["column"]))
        .collect();
    let expected = [
        "TEST-3 3:7",
        "TEST-4 4:11",
        "TEST-5 5:10",
        "PMI-31 6:10",
        "PMI-34 7:21",
        "TEST-3 8:9",
        "TEST-1 9:3",
        "TEST-3 10:7",
    ];
    assert_eq!(found, expected);
    folder.plcc("test a.plctest").exits(2).says(&[
        "8 errors: no test is run",
        "did you mean `DOOR`?",
        "did you mean `run`?",
    ]);
    for (script, part) in [
        ("program \"none.pmi\"\n", "none.pmi"),
        ("test \"a\"\nend\n", "does not say which program"),
        ("program \"a.pmi\"\nmachine \"none.toml\"\n", "none.toml"),
        ("program \"a.pmi\"\nprogram \"a.pmi\"\n", "a pmi program is one file"),
        ("program \"a.pmi\"\n", "the scripts have no tests"),
        ("program \"broken.pmi\"\ntest \"a\"\nend\n", "PMI-31"),
    ] {
        folder.write("broken.pmi", support::BROKEN);
        folder.write("b.plctest", script);
        folder.plcc("test b.plctest").exits(2).says(&[part]);
    }
    folder.plcc("test none.plctest").exits(2).says(&["none.plctest"]);
    folder.plcc("test a.pmi").exits(2);
    folder.plcc("test").exits(2);
}

#[test]
fn two_megabytes_of_garbage_are_refused() {
    let folder = Folder::with(&[("a.pmi", PUMP)]);
    for part in
        ["program \"a.pmi\"\n", "wait until ((((", "test \"a\"\nexpect N = 1\nend\n", "\u{0}\u{ff}"]
    {
        folder.write("a.plctest", part.repeat((2 << 20) / part.len()));
        folder.plcc("test a.plctest").exits(2);
    }
}

#[test]
fn folders_are_searched_and_tests_filtered() {
    let script = |name: &str, program: &str| {
        format!("program \"{program}\"\ntest \"{name}\"\nrun 1 tick\nend\ntest \"other\"\nend\n")
    };
    let folder = Folder::with(&[("a.pmi", COUNTER)]);
    std::fs::create_dir_all(folder.path().join("t/deep")).unwrap();
    folder.write("t/b10.plctest", script("ten", "../a.pmi"));
    folder.write("t/b9.plctest", script("nine", "../a.pmi"));
    folder.write("t/deep/c.plctest", script("deep", "../../a.pmi"));
    let done = folder.plcc("test t --message-format json").exits(0);
    let tests: Vec<_> =
        done.json().iter().filter_map(|line| Some(line["test"].as_str()?.to_owned())).collect();
    assert_eq!(tests, ["nine", "other", "ten", "other", "deep", "other"]);
    let done = folder.plcc("test t --filter n --message-format json").exits(0);
    assert_eq!(done.json().last().unwrap()["tests"], 2);
    folder.plcc("test t --filter nothing").exits(2).says(&["`nothing`"]);
    std::fs::create_dir(folder.path().join("empty")).unwrap();
    folder.plcc("test empty").exits(2).says(&["no test script"]);
}

#[test]
fn a_report_for_build_servers_has_every_test() {
    let script =
        "program \"a.pmi\"\ntest \"good <&> \\\"\nend\ntest \"bad\"\nexpect N = 1, N = 2\nend\n";
    let folder = Folder::with(&[("a.pmi", PUMP), ("a.plctest", script)]);
    folder.plcc("test a.plctest --junit r.xml").exits(1);
    let xml = folder.read("r.xml");
    for part in [
        "<testsuites name=\"plcc test\" tests=\"2\" skipped=\"0\" failures=\"1\"",
        "<testcase name=\"good &lt;&amp;&gt; \\\"",
        "<failure message=\"`N = 2` does not hold\"",
        "classname=\"a.plctest\"",
    ] {
        assert!(xml.contains(part), "{part} is not in\n{xml}");
    }
    let done = folder.plcc("test a.plctest --message-format json").exits(1);
    let lines = done.json();
    assert_eq!(lines[1]["failure"]["values"]["N"], 1);
    assert_eq!((&lines[1]["failure"]["line"], &lines[2]["failed"]), (&5.into(), &1.into()));
    folder.plcc("test a.plctest --junit no/r.xml").exits(2).says(&["no/r.xml"]);
}

/// Two contacts, of which a script covers one both ways.
const COVERED: &str = "program \"a.pmi\"\ntest \"door\"\nset DOOR = 1\npulse START\nrun 2 ticks\nset DOOR = 0\nrun 2 ticks\nend\n\
    test \"nothing\"\nrun 1 tick\nend\n";

#[test]
fn coverage_counts_statements_and_contacts() {
    let folder = Folder::with(&[("a.pmi", PUMP), ("a.plctest", COVERED)]);
    let done = folder.plcc("test a.plctest --coverage c.json").exits(0);
    assert!(
        done.stdout.ends_with(
            "coverage: 3 of 3 statements (100 %), 1 of 6 contacts decided both ways (16 %)\n"
        ),
        "{}",
        done.stdout
    );
    let lines: Vec<serde_json::Value> =
        folder.read("c.json").lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(lines.len(), 4);
    assert_eq!((&lines[0]["line"], &lines[0]["runs"]), (&11.into(), &5.into()));
    assert_eq!(lines[0]["contacts"], serde_json::json!([]));
    // Ticks: START and DOOR, then DOOR alone, then neither, twice; in the other test neither.
    let contact = |name: &str, column: u32, counts: [u32; 4]| {
        let [zero, one, decided_zero, decided_one] = counts;
        serde_json::json!({"name": name, "column": column, "zero": zero, "one": one,
            "decided_zero": decided_zero, "decided_one": decided_one})
    };
    let expected = [
        contact("START", 8, [4, 1, 0, 1]),
        contact("DOOR", 16, [3, 2, 0, 1]),
        contact("PUMP", 23, [3, 2, 0, 1]),
        contact("DOOR", 30, [3, 2, 1, 1]),
    ];
    assert_eq!(lines[1]["contacts"].as_array().unwrap()[..], expected);
    assert_eq!(lines[3], serde_json::json!({"statements": [3, 3], "contacts": [1, 6]}));
    // The order of options and the missing file name do not matter.
    for line in
        ["test --coverage a.plctest", "test a.plctest --coverage", "test --coverage . --filter o"]
    {
        let done = folder.plcc(line).exits(0);
        assert!(done.stdout.contains("coverage: 3 of 3 statements"), "{line}: {}", done.stdout);
    }
    assert_eq!(folder.plcc("test a.plctest --coverage -").exits(0).stdout, folder.read("c.json"));
    folder.plcc("test a.plctest --coverage c.txt").exits(2).says(&[".html, .info or .json"]);
    folder.plcc("test a.plctest --coverage no/c.json").exits(2).says(&["no/c.json"]);
}

#[test]
fn coverage_is_drawn_and_written_for_other_tools() {
    let folder = Folder::with(&[("a.pmi", PUMP), ("a.plctest", COVERED)]);
    folder.plcc("test a.plctest --coverage c.html").exits(0);
    let page = folder.read("c.html");
    for part in
        ["<b class=\"g\"", "<b class=\"y\"", "a.plctest: door", "<h2>a.pmi</h2>", "1 of 6 contacts"]
    {
        assert!(page.contains(part), "{part} is not in\n{page}");
    }
    folder.plcc("test a.plctest --coverage c.info").exits(0);
    let info = folder.read("c.info");
    for part in
        ["TN:\nSF:/", "a.pmi\n", "DA:11,5\n", "BRDA:12,0,0,0\n", "LF:3\nLH:3\nend_of_record\n"]
    {
        assert!(info.contains(part), "{part} is not in\n{info}");
    }
}

#[test]
fn every_language_has_coverage() {
    let nct = ":000\nJ0\n:001\n(I000 O F0201) U012 E D012 Z\nLF020\n+1\nSF020\n=5 U013 Z\nJ1\n";
    let pmac = "I5=2\nOPEN PLC 1 CLEAR\nP1=P1+1\nIF (P1>3 AND P2=0)\nP3=1\nENDIF\nCLOSE\n";
    let script = |program: &str, ticks: u32| {
        format!("program \"{program}\"\ntest \"t\"\nrun {ticks} ticks\nend\n")
    };
    let folder = Folder::with(&[
        ("b.plc", nct),
        ("c.pmc", pmac),
        ("b.plctest", &script("b.plc", 9)),
        ("c.plctest", &script("c.pmc", 60)),
    ]);
    let lines = |name: &str| -> Vec<serde_json::Value> {
        let done = folder.plcc(&format!("test {name} --coverage -")).exits(0);
        done.json()
    };
    let nct = lines("b.plctest");
    let contacts: Vec<_> =
        nct.iter().filter_map(|line| line["contacts"].as_array()).flatten().collect();
    // F0201 is bit 1 of a number that counts to 9: it is seen from 2 to 3 and from 6 to 7. The relation holds once.
    assert_eq!(
        contacts[1],
        &serde_json::json!({"name": "F0201", "column": 9, "zero": 5, "one": 4, "decided_zero": 5, "decided_one": 4})
    );
    assert_eq!(
        contacts[2],
        &serde_json::json!({"name": "=5", "column": 1, "zero": 8, "one": 1, "decided_zero": 8, "decided_one": 1})
    );
    let pmac = lines("c.plctest");
    let condition = pmac.iter().find(|line| line["line"] == 4).unwrap();
    let runs = condition["runs"].as_u64().unwrap();
    assert!(runs > 4, "{condition}");
    assert_eq!(condition["contacts"][0]["zero"], 3);
    assert_eq!(
        (&condition["contacts"][1]["decided_one"], &condition["contacts"][1]["decided_zero"]),
        (&(runs - 3).into(), &0.into())
    );
}

#[test]
fn a_test_that_fails_leaves_a_record_that_ends_with_its_tick() {
    let script = "program \"a.pmi\"\ntest \"bad\"\nset DOOR = 1\npulse START\nrun 30 ticks\nexpect PUMP, N = 29\nend\n\
        test \"cycled\"\nrun 5 ticks\npower cycle\nwait until N = 99 within 8 ticks\nend\n";
    let folder = Folder::with(&[("a.pmi", PUMP), ("a.plctest", script)]);
    let done = folder.plcc("test a.plctest --records kept --message-format json").exits(1);
    let lines = done.json();
    for (line, ticks) in [(0, 30), (1, 9)] {
        let record = lines[line]["failure"]["record"].as_str().unwrap();
        assert!(record.starts_with("kept/"), "{record}");
        assert!(
            lines[line]["failure"]["why"].as_str().is_some_and(|why| why.contains("since")),
            "{line}"
        );
        let dump = folder.plcc(&format!("replay {record} --dump -")).exits(0).json();
        assert_eq!((&dump[0]["ticks"], &dump[0]["variables"]["N"]), (&ticks.into(), &ticks.into()));
    }
    // Without a folder a new one is made.
    let done = folder.plcc("test a.plctest --filter bad").exits(1);
    let record =
        done.stdout.lines().find_map(|line| line.split_once("the record of the run: ")).unwrap().1;
    folder.plcc(&format!("replay {record}")).exits(0);
    std::fs::remove_dir_all(std::path::Path::new(record).parent().unwrap()).unwrap();
    // Tests that pass leave none.
    let done = folder.plcc("test a.plctest --filter nothing --records none");
    assert!(done.status == 2 && !folder.has("none"));
    folder.plcc("test a.plctest --records a.pmi").exits(2).says(&["a.pmi"]);
}

#[test]
fn a_record_becomes_a_test_that_passes_until_the_program_changes() {
    let pmac = "I5=2\nM1->Y:$07F0,0,1\nM11->Y:$FFC2,8,1\nOPEN PLC 1 CLEAR\nP1=P1+1\nM11=M1\nIF (P1=20)\nSEND\"TWENTY\"\nENDIF\nCLOSE\n";
    let nct = ":000\nJ0\n:001\nLF020\n+1\nSF020\n(I000 A F0203) Y012 Z (I000 A F0203) U013 E D013 Z LY00 SY00 J1\n".replace(" Y012 Z (I000 A F0203)", "");
    for (program, text, stimulus, changed) in [
        (
            "a.pmi",
            PUMP,
            "tick,name,value\n3,DOOR,1\n9,START,1\n11,START,0\n30,DOOR,0\n35,START,1\n",
            (" ! PUMP & DOOR", ""),
        ),
        ("c.pmc", pmac, "tick,name,value\n9,M1,1\n30,M1,0\n", ("M11=M1", "M11=0")),
        ("b.plc", &nct, "tick,name,value\n3,I000,1\n", ("D013", "U013")),
        ("s.pmi", STOPS, "tick,name,value\n", ("A[N]=1", "A[0]=1")),
    ] {
        let folder = Folder::with(&[(program, text), ("s.csv", stimulus)]);
        std::fs::create_dir(folder.path().join("tests")).unwrap();
        let done =
            folder.plcc(&format!("run {program} --ticks 60 --stimulus s.csv --record r.plcrec"));
        assert!(done.status == 0 || done.status == 3, "{}", done.stderr);
        let done = folder.plcc("test --from r.plcrec -o tests/r.plctest").exits(0);
        assert_eq!(done.stderr, "");
        let script = folder.read("tests/r.plctest");
        assert!(script.contains(&format!("program \"../{program}\"")), "{script}");
        assert!(script.contains("  expect "), "{script}");
        let done = folder.plcc("test tests");
        assert_eq!(done.status, 0, "{script}\n{}", done.stdout);
        folder.write(program, text.replace(changed.0, changed.1));
        let done = folder.plcc("test tests --records t");
        assert_eq!(done.status, 1, "{script}\n{}{}", done.stdout, done.stderr);
    }
}

#[test]
fn a_record_with_retained_values_begins_with_them() {
    let nct = ":000\nJ0\n:001\nLF500\n+1\nSF500\nF5003 U012 E D012 Z\nJ1\n";
    let folder = Folder::with(&[("b.plc", nct)]);
    folder.plcc("run b.plc --ticks 5 --retain kept").exits(0);
    folder.plcc("run b.plc --ticks 20 --retain kept --record r.plcrec").exits(0);
    folder.plcc("test --from r.plcrec -o r.plctest").exits(0);
    assert!(folder.read("r.plctest").contains("set F500 = 5"), "{}", folder.read("r.plctest"));
    folder.plcc("test r.plctest").exits(0);
    folder.plcc("test --from none.plcrec").exits(2).says(&["none.plcrec"]);
    folder.plcc("test --from b.plc").exits(2);
    folder.plcc("test --from r.plcrec -o r.plcrec").exits(2).says(&["not overwritten"]);
    folder.plcc("test r.plctest -o x").exits(2);
    assert!(folder.plcc("test --from r.plcrec").exits(0).stdout.contains("test \"as in r\""));
}

#[test]
fn the_other_side_answers_where_a_script_says_so() {
    let program = "$INPUT\nUP=0/0\nDOWN=0/1\n$OUTPUT\nVALVE=2/0\n$LOGICAL\nGO\n$END\nVALVE = GO\n";
    let table = "[[simulator.device]]\nname = \"C1\"\nkind = \"cylinder\"\nextend = \"VALVE\"\nretract = \"!VALVE\"\n\
        extended = \"UP\"\nretracted = \"DOWN\"\nextend_ms = 80\nretract_ms = 40\n";
    let tests = "test \"up\"\nwait until DOWN within 1 s\nset GO = 1\nwait until UP within 200 ms\nexpect /DOWN\nend\n";
    let folder = Folder::with(&[
        ("a.pmi", program),
        ("a.machine.toml", table),
        ("with.plctest", &format!("program \"a.pmi\"\nsimulate\n{tests}")),
        ("without.plctest", &format!("program \"a.pmi\"\n{tests}")),
        ("lathe.pmi", include_str!("../../examples/pmi/lathe.pmi")),
        (
            "lathe.plctest",
            "program \"lathe.pmi\"\nsimulate\ntest \"keys\"\nrun 5 ticks\npulse KEY.MACHINE ON for 100 ms\nset MCRDY = 1\n\
            wait until MCHON within 2 s\nend\n",
        ),
        ("bad.plctest", "program \"a.pmi\"\nsimulate\ntest \"a\"\nset KEY.NOTHING = 1\nend\n"),
    ]);
    for engine in ["jit", "interp"] {
        folder.plcc(&format!("test with.plctest lathe.plctest --engine {engine}")).exits(0);
    }
    folder.plcc("test without.plctest --records r").exits(1);
    let found = folder.plcc("test bad.plctest --message-format json").exits(2).json();
    assert_eq!((&found[0]["code"], &found[0]["line"]), (&"TEST-3".into(), &4.into()));
    folder.write("a.machine.toml", table.replace("kind = \"cylinder\"", "kind = \"nothing\""));
    folder.plcc("test with.plctest").exits(2).says(&["nothing"]);
}

#[test]
fn a_search_finds_what_is_not_covered_and_writes_it_as_tests() {
    let program = "$INPUT\nDOOR=1/0\nA=1/1\nB=1/2\n$OUTPUT\nOUT=2/0\n$INTEGER\nN\n$END\nIF (A & B & /DOOR)\nN = N + 1\nENDIF\nOUT = N > 1\n";
    let folder = Folder::with(&[
        ("a.pmi", program),
        ("a.plctest", "program \"a.pmi\"\ntest \"door\"\nset DOOR = 1\nrun 5 ticks\nend\n"),
        ("b.pmi", "$INTEGER\nN\n$END\nN=N+1\n"),
        ("b.plctest", "program \"b.pmi\"\ntest \"b\"\nrun 5 ticks\nend\n"),
    ]);
    let done = folder.plcc("test a.plctest --search 0 --seed 7 -o found.plctest").exits(0);
    done.says(&[
        "the seed of this search is 7",
        "before: coverage: 2 of 3 statements",
        "after:  coverage: 3 of 3 statements",
    ]);
    let script = folder.read("found.plctest");
    assert!(
        script.contains("judge whether it is right") && script.contains("program \"a.pmi\""),
        "{script}"
    );
    assert!(script.contains("expect OUT = 1") || script.contains("expect PORT2.0 = 1"), "{script}");
    let done = folder.plcc("test a.plctest found.plctest --coverage").exits(0);
    assert!(done.stdout.contains("coverage: 3 of 3 statements (100 %)"), "{}", done.stdout);
    // The same seed finds the same.
    folder.plcc("test a.plctest --search 0 --seed 7 -o again.plctest").exits(0);
    assert_eq!(folder.read("again.plctest"), script);
    folder.plcc("test b.plctest --search 0").exits(2).says(&["no input"]);
    folder.plcc("test a.plctest b.plctest --search 0").exits(2).says(&["one program"]);
    folder.plcc("test a.plctest --seed 7").exits(2);
}

#[test]
fn scripts_that_are_written_of_a_simulated_machine_simulate_it() {
    let examples = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/desk");
    let files = ["turret.pmi", "turret.machine.toml", "turret.nc", "turret.plctest"];
    let texts = files.map(|name| std::fs::read_to_string(examples.join(name)).unwrap());
    let keys =
        "tick,name,value\n5,KEY.MACHINE ON,press\n50,KEY.AUTO,press\n75,KEY.CYCLE START,press\n";
    // The machine file is found beside the program, or has to be named.
    for machine in ["turret.machine.toml", "other.toml"] {
        let folder = Folder::with(&[("keys.csv", keys)]);
        for (name, text) in files.into_iter().zip(&texts) {
            let name = if name == "turret.machine.toml" { machine } else { name };
            let head = format!("program \"turret.pmi\"\nmachine \"{machine}\"\n");
            folder.write(name, text.replace("program \"turret.pmi\"\n", &head));
        }
        std::fs::create_dir(folder.path().join("tests")).unwrap();
        let run = "run turret.pmi --ticks 250 --simulate --stimulus keys.csv --record r.plcrec";
        folder.plcc(&format!("{run} --machine {machine} --watch @PGMSE")).exits(0);
        let done = folder.plcc("test --from r.plcrec -o tests/r.plctest").exits(0);
        assert_eq!(done.stderr, "");
        folder.plcc("test turret.plctest --search 0 --seed 3 -o tests/found.plctest").exits(0);
        let named = format!("machine \"../{machine}\"\n");
        for script in ["tests/r.plctest", "tests/found.plctest"] {
            let text = folder.read(script);
            assert!(text.contains("\nsimulate\n"), "{text}");
            assert_eq!(text.contains(&named), machine == "other.toml", "{text}");
        }
        assert!(folder.read("tests/r.plctest").contains("set KEY.CYCLE START = 1"));
        folder.plcc("test tests").exits(0);
        // A script has no part program of its own.
        folder.write("p.nc", "M30\n");
        folder
            .plcc(&format!("{run} --machine {machine} --part-program p.nc --watch @PGMSE"))
            .exits(0);
        folder
            .plcc("test --from r.plcrec -o tests/p.plctest")
            .exits(0)
            .says(&["p.nc by --part-program", "`part_program`"]);
    }
}

#[test]
fn the_tests_of_the_examples_pass_in_every_engine() {
    let examples = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples");
    let folder = Folder::with(&[]);
    for engine in ["jit", "interp", "aot"] {
        for script in ["pmi", "nct", "pmac", "desk"] {
            let path = examples.join(script);
            folder
                .run(&["test", path.to_str().unwrap(), "--engine", engine, "--records", "r"])
                .exits(0);
        }
    }
}

/// A clamp with a switch of its own, and a guard that no test opens.
const CLAMP: &str = "$TIMER\nE/CLOSE/LATE = 50\n$INPUT\nSTART=1/0\nSHUT=1/1\nBACK=1/2\nLAMPOK=1/3\n\
    $OUTPUT\nVALVE=2/0\nMOTOR=2/1\nLAMP=2/2\n$FAULT\nSLOW = \"THE CLAMP DOES NOT CLOSE\"\n$END\n\
    VALVE = START\nMOTOR = START & SHUT\nCLOSE = VALVE & /SHUT\nSLOW = LATE\nLAMP = F\n";
const CLAMP_TABLE: &str = "[[simulator.device]]\nname = \"CLAMP\"\nkind = \"cylinder\"\nextend = \"VALVE\"\n\
    extended = \"SHUT\"\nretracted = \"BACK\"\n[[simulator.device]]\nname = \"LAMP\"\nkind = \"relay\"\n\
    output = \"LAMP\"\ninput = \"LAMPOK\"\n";
const CLAMP_TESTS: &str = "program \"clamp.pmi\"\nsimulate\nnever MOTOR & BACK\ntest \"it starts\"\n\
    set START = 1\nwait until MOTOR within 2 s\nexpect /SLOW\nrun 1 s\nset START = 0\nrun 1 s\nend\n";

#[test]
fn broken_feedbacks_are_told_or_not() {
    let files =
        [("clamp.pmi", CLAMP), ("clamp.machine.toml", CLAMP_TABLE), ("clamp.plctest", CLAMP_TESTS)];
    let folder = Folder::with(&files);
    let mut all = vec![];
    for engine in ["jit", "interp", "aot"] {
        let run = format!("test clamp.plctest --broken --engine {engine}");
        let done = folder.plcc(&run).exits(1);
        for part in [
            "told   CLAMP: extended SHUT stuck at 0: \"THE CLAMP DOES NOT CLOSE\", in \"it starts\"\n",
            "UNTOLD CLAMP: extended SHUT stuck at 1: no message, fault or stop, and against clamp.plctest:3: never MOTOR & BACK\n",
            "UNTOLD CLAMP: retracted BACK stuck at 0: no message, fault or stop\n",
            "UNTOLD CLAMP: retracted BACK stuck at 1: no message, fault or stop, and against",
            "UNSEEN LAMP: input LAMPOK stuck at 0: no test sees another value\n",
            "UNTOLD LAMP: input LAMPOK stuck at 1: no message, fault or stop\n",
            "6 faults: 1 told, 4 untold, 1 unseen\n",
        ] {
            assert!(done.stdout.contains(part), "{part} is not in\n{}", done.stdout);
        }
        all.push(done.stdout);
    }
    assert!(all.windows(2).all(|pair| pair[0] == pair[1]), "{all:#?}");
    let done = folder.plcc("test clamp.plctest --broken --message-format json").exits(1);
    let lines = done.json();
    assert_eq!(lines[0]["result"], "told");
    assert_eq!(lines[0]["text"], "THE CLAMP DOES NOT CLOSE");
    assert_eq!(
        (&lines[1]["result"], &lines[1]["against"]),
        (&"untold".into(), &"never MOTOR & BACK".into())
    );
    assert_eq!((&lines[4]["result"], &lines[4]["stuck"]), (&"unseen".into(), &0.into()));
    assert_eq!(lines[6]["untold"], 4);
    // A test that breaks something itself does not count.
    let jams = "test \"a jam\"\nset START = 1, KEY.JAM CLAMP = 1\nrun 2 s\nexpect SLOW\nend\n";
    folder.write("jams.plctest", format!("program \"clamp.pmi\"\nsimulate\n{jams}"));
    let done = folder.plcc("test jams.plctest --broken").exits(1);
    assert!(done.stdout.ends_with("6 faults: 0 told, 0 untold, 6 unseen\n"), "{}", done.stdout);
    // A program that looks whether the switch opens tells of both.
    let told = CLAMP.replace("CLOSE = VALVE & /SHUT", "CLOSE = (VALVE & /SHUT) ! (/VALVE & SHUT)");
    let told = told.replace("= 50", "= 30");
    folder.write("clamp.pmi", &told);
    folder.write("clamp.machine.toml", CLAMP_TABLE.split("retracted").next().unwrap());
    folder.plcc("test clamp.plctest --broken").exits(0).says(&[]);
    // Tests have to pass before anything is broken.
    folder.write("clamp.plctest", CLAMP_TESTS.replace("within 2 s", "within 1 tick"));
    let failed = folder.plcc("test clamp.plctest --broken --records r").exits(1);
    assert!(failed.stdout.contains("FAILED it starts"), "{}", failed.stdout);
    folder.write("clamp.plctest", CLAMP_TESTS.replace("simulate\n", "").replace("wait", "# wait"));
    folder.plcc("test clamp.plctest --broken").exits(2).says(&["simulate", "[[simulator.device]]"]);
}

#[test]
fn the_record_of_a_simulated_machine_is_run_again() {
    let examples = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/desk");
    for (program, goal) in [
        ("turret.pmi", "@MXRDY & /@MXRDY"),
        ("changer.nct", "I540, NI540"),
        ("router.pmc", "P1023=77"),
    ] {
        let script = format!(
            "program \"{examples}/{program}\"\nsimulate\ntest \"it\"\nrun 20 ticks\nexpect {goal}\nend\n"
        );
        let folder = Folder::with(&[("a.plctest", &script)]);
        let done = folder.plcc("test a.plctest --records kept --message-format json");
        assert_eq!(done.status, 1, "{program}: {}", done.stdout);
        let lines = done.json();
        let record = lines[0]["failure"]["record"].as_str().unwrap();
        assert!(lines[0]["failure"]["why"].is_string(), "{program}: {}", lines[0]);
        folder.plcc(&format!("replay {record}")).exits(0);
    }
}
