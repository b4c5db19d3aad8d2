//! Wrong part programs, tables of the simulator and test scripts: each is told at its place, with what to do.

#![allow(clippy::unwrap_used, clippy::indexing_slicing)]

mod support;

use support::Folder;

/// What is wrong: a part program of one of the controls, the table, or a script.
#[derive(Clone, Copy, Debug)]
enum Wrong {
    Pmi,
    Nct,
    Table,
    Script,
}

const PMI: &str = "$INPUT\nDOOR=0/0\nLS=0/1\nST=1/0-2/B\n$OUTPUT\nOUT=2/0\nTURN=2/1\n$INTEGER\nN\n$MCODE\n@M08/P\n$GCODE\n@G61/P\n$END\nN=N+1\nOUT=DOOR\nTURN=LS\n@M08=F\n@G61=F\n";
const NCT: &str = ":000\nJ0\n:001\nJ1\n";

/// Each with its text and what must be said.
#[rustfmt::skip]
const ALL: &[(Wrong, &str, &[&str])] = &[
    (Wrong::Pmi, "G1 X", &["SIM-1", "p.nc:1:4", "X12.5"]),
    (Wrong::Pmi, "G1 (open", &["SIM-1", "p.nc:1:4", "ends with `)`"]),
    (Wrong::Pmi, "G0 Q1", &["SIM-2", "p.nc:1:4", "[[simulator.axis]]"]),
    (Wrong::Pmi, "G0 W1", &["SIM-2", "p.nc:1:4", "[[simulator.axis]]"]),
    (Wrong::Pmi, "G0 X1 X2", &["SIM-3", "p.nc:1:7", "remove one"]),
    (Wrong::Pmi, "G0 X1.5.2", &["SIM-1", "p.nc:1:8", "X12.5"]),
    (Wrong::Pmi, "G0 X1234567890", &["SIM-4", "p.nc:1:4", "9 digits"]),
    (Wrong::Pmi, "G0 X100000", &["SIM-4", "p.nc:1:4", "99999.999999"]),
    (Wrong::Pmi, "S1.5", &["SIM-4", "p.nc:1:1", "from 0 to 2147483647"]),
    (Wrong::Pmi, "S-1", &["SIM-4", "p.nc:1:1", "from 0 to 2147483647"]),
    (Wrong::Pmi, "T2147483648", &["SIM-4", "p.nc:1:1", "9 digits"]),
    (Wrong::Pmi, "M300", &["SIM-4", "p.nc:1:1", "up to 299"]),
    (Wrong::Pmi, "G1 X1 F0", &["SIM-4", "p.nc:1:7", "above 0"]),
    (Wrong::Pmi, "G71", &["SIM-5", "p.nc:1:1", "in the book"]),
    (Wrong::Pmi, "M98", &["SIM-5", "p.nc:1:1", "write their blocks here"]),
    (Wrong::Pmi, "G0 G1 X1 F1", &["SIM-6", "p.nc:1:4", "block of its own"]),
    (Wrong::Pmi, "G4 P1 X1", &["SIM-6", "p.nc:1:7", "block of their own"]),
    (Wrong::Pmi, "G1 X1", &["SIM-8", "p.nc:1:4", "as in F200"]),
    (Wrong::Pmi, "G2 X1 Y1 F1", &["SIM-9", "p.nc:1:4", "I, J, K"]),
    (Wrong::Pmi, "G2 X1 Y0 I1 R1 F1", &["SIM-9", "p.nc:1:4", "not both"]),
    (Wrong::Pmi, "G2 X1 Y0 I2 F5", &["SIM-9", "p.nc:1:4", "same circle"]),
    (Wrong::Pmi, "X1 /M8", &["SIM-12", "p.nc:1:4", "/1 to /9"]),
    (Wrong::Pmi, "/2 X1", &["SIM-12", "p.nc:1:1", "/1 to /9"]),
    (Wrong::Pmi, "G4", &["SIM-13", "p.nc:1:1", "G4 P1.5"]),
    (Wrong::Pmi, "G61 X1", &["SIM-13", "p.nc:1:1", "[[simulator.aux]]"]),
    (Wrong::Pmi, "I1", &["SIM-2", "p.nc:1:1", "belong to G2 and G3"]),
    (Wrong::Pmi, "P5", &["SIM-2", "p.nc:1:1", "time of G4"]),
    (Wrong::Pmi, "M7\nG1 X1", &["SIM-8", "p.nc:2:4", "as in F200"]),
    (Wrong::Pmi, "G2 X1 R0 F1", &["SIM-9", "p.nc:1:4", "centre by"]),
    (Wrong::Nct, "M1 M2 M3 M4 M5 M6", &["SIM-7", "p.nc:1:16", "the next one"]),
    (Wrong::Nct, "S65536", &["SIM-4", "p.nc:1:1", "from 0 to 65535"]),
    (Wrong::Nct, "G33 Z1", &["SIM-13", "p.nc:1:1", "F in the block of G33"]),
    (Wrong::Nct, "G84 X1 F5", &["SIM-13", "p.nc:1:1", "Z in that of G74"]),
    (Wrong::Nct, "G28 G84 Z1 F5", &["SIM-6", "p.nc:1:5", "block of its own"]),
    (Wrong::Nct, "G84 Z1", &["SIM-8", "p.nc:1:5", "as in F200"]),
    (Wrong::Nct, "G28 X1 R5", &["SIM-2", "p.nc:1:8", "R to G74"]),
    (Wrong::Nct, "G81.2", &["SIM-4", "p.nc:1:1", "G81.1"]),
    (Wrong::Nct, "/0 X1", &["SIM-12", "p.nc:1:1", "/1 to /9"]),
    (Wrong::Nct, "G61 X1", &["SIM-5", "p.nc:1:1", "in the book"]),
    (Wrong::Nct, "T1 A5", &["SIM-2", "p.nc:1:4", "[[simulator.axis]]"]),
    (Wrong::Table, "[simulator]\nlagms = 1\n", &["a.machine.toml", "line 2:", "did you mean `lag_ms`"]),
    (Wrong::Table, "[simulator]\nlag_ms = -1\n", &["a.machine.toml", "line 2:", "from 0 to 86400000"]),
    (Wrong::Table, "[simulator]\nunits = \"feet\"\n", &["a.machine.toml", "line 2:", "\"inch\" or"]),
    (Wrong::Table, "[simulator]\nhomed = 1\n", &["a.machine.toml", "line 2:", "true or false"]),
    (Wrong::Table, "[simulator]\npart_program = 3\n", &["a.machine.toml", "line 2:", "in quotes"]),
    (Wrong::Table, "[[simulator.axis]]\nname = \"Q\"\n", &["a.machine.toml", "line 2:", "X, Y, Z, U"]),
    (Wrong::Table, "[[simulator.axis]]\nname = \"X\"\n[[simulator.axis]]\nname = \"X\"\n", &["a.machine.toml", "line 4:", "each letter once"]),
    (Wrong::Table, "[[simulator.axis]]\ncounts = 0\n", &["a.machine.toml", "line 2:", "from 1 to"]),
    (Wrong::Table, "[[simulator.axis]]\njog = [1, 2]\n", &["a.machine.toml", "line 2:", "three speeds"]),
    (Wrong::Table, "[[simulator.axis]]\nref_direction = 2\n", &["a.machine.toml", "line 2:", "1 or -1"]),
    (Wrong::Table, "[[simulator.axis]]\nrapid = 0\n", &["a.machine.toml", "line 2:", "above 0"]),
    (Wrong::Table, "[simulator.spindle]\nrpms = 3\n", &["a.machine.toml", "line 2:", "did you mean `rpm`"]),
    (Wrong::Table, "[[simulator.device]]\nkind = \"relay\"\n", &["a.machine.toml", "line 1:", "needs the key `name`"]),
    (Wrong::Table, "[[simulator.device]]\nname = \"K\"\n", &["a.machine.toml", "line 1:", "needs the key `kind`"]),
    (Wrong::Table, "[[simulator.device]]\nname = \"K\"\nkind = \"rely\"\n", &["a.machine.toml", "line 3:", "did you mean `relay`"]),
    (Wrong::Table, "[[simulator.device]]\nname = \"K\"\nkind = \"relay\"\noutput = \"OUT\"\n", &["a.machine.toml", "line 1:", "needs the key `input`"]),
    (Wrong::Table, "[[simulator.device]]\nname = \"K\"\nkind = \"relay\"\noutput = \"OUTT\"\ninput = \"LS\"\n", &["a.machine.toml", "line 4:", "did you mean `OUT`"]),
    (Wrong::Table, "[[simulator.device]]\nname = \"K\"\nkind = \"relay\"\noutput = \"OUT\"\ninput = \"LSS\"\n", &["a.machine.toml", "line 5:", "did you mean `LS`"]),
    (Wrong::Table, "[[simulator.device]]\nname = \"K\"\nkind = \"switch\"\naxis = \"W\"\nfrom = 0\nto = 1\ninput = \"LS\"\n", &["a.machine.toml", "line 4:", "it has X, Y, Z"]),
    (Wrong::Table, "[[simulator.device]]\nname = \"T\"\nkind = \"turret\"\noutput = \"TURN\"\nstations = 9\ncode = \"ST\"\n", &["a.machine.toml", "line 6:", "name more lines"]),
    (Wrong::Table, "[[simulator.device]]\nname = \"A\"\nkind = \"relay\"\noutput = \"OUT\"\ninput = \"LS\"\n[[simulator.device]]\nname = \"B\"\nkind = \"relay\"\noutput = \"OUT\"\ninput = \"LS\"\n", &["a.machine.toml", "line 7:", "an input of its own"]),
    (Wrong::Table, "[simulator.keys]\nDOOR = \"NN\"\n", &["a.machine.toml", "line 2:", "did you mean `N`"]),
    (Wrong::Table, "simulator = 3\n", &["a.machine.toml", "line 1:", "is a table"]),
    (Wrong::Table, "[[simulator.device]]\nname = \"P\"\nkind = \"pump\"\noutput = \"OUT\"\ninput = \"LS\"\non = 101\n", &["a.machine.toml", "line 6:", "from 0 to 100"]),
    (Wrong::Table, "[simulator]\nserial = 5\n", &["a.machine.toml", "line 2:", "in quotes"]),
    (Wrong::Table, "[[simulator.aux]]\ncount = 5\n", &["a.machine.toml", "line 2:", "did you mean `counts`"]),
    (Wrong::Script, "test \"a\"\nend\n", &["s.plctest:1:1", "begin it with"]),
    (Wrong::Script, "program \"a.pmi\"\ntest \"a\"\n", &["s.plctest:2:7", "write `end`"]),
    (Wrong::Script, "program \"a.pmi\"\ntest \"a\"\nset N 5\nend\n", &["s.plctest:3:5", "= VALUE`"]),
    (Wrong::Script, "program \"a.pmi\"\ntest \"a\"\nwait until N = 5\nend\n", &["s.plctest:3:16", "within 5 s"]),
    (Wrong::Script, "program \"a.pmi\"\ntest \"a\"\nexpect N\nend\n", &["s.plctest:3:8", "compare it"]),
    (Wrong::Script, "program \"a.pmi\"\ntest \"a\"\nrun 5 hours\nend\n", &["s.plctest:3:7", "run 200 ms"]),
    (Wrong::Script, "program \"a.pmi\"\ntest \"a\"\nset NN = 5\nend\n", &["s.plctest:3:5", "did you mean `N`?"]),
    (Wrong::Script, "program \"a.pmi\"\ntest \"a\"\nset N = five\nend\n", &["s.plctest:3:9", "as in a stimulus"]),
    (Wrong::Script, "program \"none.pmi\"\n", &["s.plctest:1:10", "script's folder"]),
    (Wrong::Script, "program \"a.pmi\"\nsimulate\ntest \"a\"\npulse KEY.CYCLE STAR\nend\n", &["s.plctest:4:7", "did you mean KEY.CYCLE START?"]),
    (Wrong::Script, "program \"a.pmi\"\ntest \"a\"\npulse KEY.CYCLE START\nend\n", &["s.plctest:3:7", "write `simulate`"]),
    (Wrong::Script, "program \"a.pmi\"\nsimulat\n", &["s.plctest:2:1", "did you mean `simulate`"]),
    (Wrong::Script, "program \"a.pmi\"\ntest \"a\"\nset N = 5 end\nend\n", &["s.plctest:3:9", "as in a stimulus"]),
    (Wrong::Script, "end\n", &["s.plctest:1:1", "leave it out"]),
    (Wrong::Script, "program \"a.pmi\"\ntest \"a\nend\n", &["s.plctest:2:7", "as in `test"]),
    (Wrong::Script, "program \"a.pmi\"\ntest \"a\"\nforce N = 1\nend\n", &["s.plctest:3:7", "sets it once"]),
    (Wrong::Script, "program \"a.pmi\"\nnever OUT &\n", &["s.plctest:2:11", "finish the expression"]),
    (Wrong::Script, "program \"a.pmi\"\nsimulate\ntest \"a\"\nset SIM.LINE = 1\nend\n", &["s.plctest:4:5", "name a single variable"]),
    (Wrong::Script, "program \"a.pmi\"\nmachine a.machine.toml\n", &["s.plctest:2:9", "`machine \"lathe.machine.toml\"`"]),
    (Wrong::Script, "program \"a.pmi\"\nmachine \"none.toml\"\n", &["s.plctest:2:10", "none.toml", "script's folder"]),
    (Wrong::Script, "program \"a.pmi\"\nalways N\n", &["s.plctest:2:8", "compare it"]),
    (Wrong::Script, "program \"a.pmi\"\nafter OUT within 2 s\n", &["s.plctest:2:7", "after CONDITION, CONDITION within 2 s"]),
    (Wrong::Script, "program \"a.pmi\"\nset N = 1\n", &["s.plctest:2:1", "write `test \"NAME\"` above it"]),
    (Wrong::Script, "program \"a.pmi\"\ntest \"a\"\ntest \"b\"\nend\n", &["s.plctest:3:1", "write `end` above this line"]),
    (Wrong::Script, "program \"a.pmi\"\ntest \"a\"\nsimulate\nend\n", &["s.plctest:3:1", "move it above `test`"]),
    (Wrong::Script, "program \"a.pmi\"\ntest \"a\"\npulse DOOR for five\nend\n", &["s.plctest:3:16", "pulse NAME for 200 ms"]),
    (Wrong::Script, "program \"a.pmi\"\ntest \"a\"\npulse DOR\nend\n", &["s.plctest:3:7", "did you mean `DOOR`?"]),
    (Wrong::Script, "program \"a.pmi\"\ntest \"a\"\nrelease DOR\nend\n", &["s.plctest:3:9", "did you mean `DOOR`?"]),
    (Wrong::Script, "program \"a.pmi\"\ntest \"a\"\nrelease N\nend\n", &["s.plctest:3:9", "only inputs and physical outputs"]),
    (Wrong::Script, "program \"a.pmi\"\ntest \"a\"\nhold OUT\nend\n", &["s.plctest:3:8", "`for`", "hold CONDITION for 1 s"]),
    (Wrong::Script, "program \"a.pmi\"\ntest \"a\"\nrun 1.5 ticks\nend\n", &["s.plctest:3:5", "whole numbers"]),
    (Wrong::Script, "program \"a.pmi\"\ntest \"a\"\nexpect message OPEN\nend\n", &["s.plctest:3:16", "`expect message \"TURRET\"`"]),
    (Wrong::Script, "program \"a.pmi\"\ntest \"a\"\nexpect stop WATCHDOG\nend\n", &["s.plctest:3:13", "`expect stop \"WATCHDOG\"`"]),
    (Wrong::Script, "program \"a.pmi\"\ntest \"a\"\npower off\nend\n", &["s.plctest:3:7", "power cycle"]),
    (Wrong::Script, "program \"a.pmi\"\ntest \"a\"\nforce DOOR = 1.5\nend\n", &["s.plctest:3:14", "as in a stimulus"]),
    (Wrong::Script, "program \"a.pmi\"\ntest \"a\"\nwait until DOR within 5 s\nend\n", &["s.plctest:3:12", "did you mean DOOR?"]),
    (Wrong::Script, "program \"a.pmi\"\nsimulate\ntest \"a\"\nset KEY.JAM DRUM = 1\nend\n", &["s.plctest:4:5", "no small machines"]),
];

#[test]
fn each_mistake_is_told_at_its_place_with_what_to_do() {
    assert!(ALL.len() >= 60);
    let named = "[simulator]\npart_program = \"p.nc\"\n";
    for (kind, text, parts) in ALL {
        let part = format!("{text}\nM30\n");
        let (program, source) =
            if matches!(kind, Wrong::Nct) { ("a.plc", NCT) } else { ("a.pmi", PMI) };
        let table = if matches!(kind, Wrong::Table) { text } else { named };
        let folder = Folder::with(&[(program, source), ("p.nc", &part), ("a.machine.toml", table)]);
        let (command, status) = match kind {
            Wrong::Pmi | Wrong::Nct => (format!("check {program}"), 1),
            Wrong::Table => (format!("check {program}"), 2),
            Wrong::Script => {
                folder.write("s.plctest", *text);
                folder.write("p.nc", "M30\n");
                ("test s.plctest".to_owned(), 2)
            }
        };
        let done = folder.plcc(&command);
        let said = format!("{}{}", done.stdout, done.stderr);
        assert_eq!(done.status, status, "{kind:?} {text:?}\n{said}");
        for part in *parts {
            assert!(said.contains(part), "{kind:?} {text:?}: {part:?} is not in\n{said}");
        }
        // Part programs are refused by a run as by a check.
        if matches!(kind, Wrong::Pmi | Wrong::Nct) {
            folder.plcc(&format!("run {program} --ticks 1 --simulate")).exits(2);
        }
    }
}

/// Two megabytes of anything: no crash, no hang.
#[test]
fn two_megabytes_of_garbage_are_refused() {
    let letters = b"GMXYZFSTN/().%;0123456789 -+=[]\"#\n\n\n\xE9{},untilsexpectswait";
    let mut random = fastrand::Rng::with_seed(11);
    for lines in [true, false] {
        let any = (0..2 << 20).map(|_| letters[random.usize(..letters.len())]);
        let garbage: Vec<u8> = any.filter(|byte| lines || *byte != b'\n').collect();
        let folder = Folder::with(&[("a.pmi", PMI)]);
        let write = |name: &str| std::fs::write(folder.path().join(name), &garbage).unwrap();
        write("p.nc");
        folder.plcc("run a.pmi --ticks 1 --simulate --part-program p.nc").exits(2);
        write("s.plctest");
        folder.plcc("test s.plctest").exits(2);
        write("a.machine.toml");
        folder.plcc("check a.pmi").exits(2);
    }
}

/// What is only a warning is told at its place, too, and runs.
#[test]
fn warnings_about_a_part_program_are_told_and_run() {
    let named = "[simulator]\npart_program = \"p.nc\"\n";
    for (part, expected) in [
        ("G0 X1\nM8\n", &["SIM-10", "p.nc:2:1", "M30"][..]),
        ("M7 M30\n", &["SIM-11", "p.nc:1:1", "$MCODE"]),
    ] {
        let files = [("a.pmi", PMI), ("p.nc", part), ("a.machine.toml", named)];
        let folder = Folder::with(&files);
        let done = folder.plcc("check a.pmi").exits(0);
        let said = format!("{}{}", done.stdout, done.stderr);
        for text in expected {
            assert!(said.contains(text), "{part:?}: {text:?} is not in\n{said}");
        }
        folder.plcc("run a.pmi --ticks 1 --simulate --watch N").exits(0).says(&[expected[0]]);
    }
}

/// Every code of the simulator and of test scripts is among the mistakes above.
#[test]
fn every_code_is_tried() {
    let tried = |code: &str| ALL.iter().any(|(_, _, parts)| parts.contains(&code));
    // SIM-10 and SIM-11 are warnings, which the test above tries.
    for code in (1..=13).filter(|code| !(10..=11).contains(code)) {
        assert!(tried(&format!("SIM-{code}")), "SIM-{code}");
    }
    let begins = |keyword: &str| {
        let scripts = ALL.iter().filter(|(kind, ..)| matches!(kind, Wrong::Script));
        let line = |text: &str| text.lines().any(|line| line.trim().starts_with(keyword));
        scripts.into_iter().any(|(_, text, _)| line(text))
    };
    for keyword in plcc_plctest::KEYWORDS {
        assert!(begins(keyword), "{keyword}");
    }
}

/// Two megabytes of pieces that begin well, in the place of a part program, a machine file, a script, a stimulus.
#[test]
fn two_megabytes_of_pieces_that_begin_well_are_refused() {
    let named = "[simulator]\npart_program = \"p.nc\"\n";
    let script = "program \"a.pmi\"\nsimulate\ntest \"a\"\nrun 1 tick\nend\n";
    let again = |part: &str| part.repeat((2 << 20) / part.len()).into_bytes();
    for (file, pieces) in [
        ("p.nc", &["G1", "G91 X", "(", "X1.", "\n/0", "N1G2X1I1R"][..]),
        (
            "a.machine.toml",
            &[
                "[",
                "[[simulator.device]]\n",
                "[simulator]\nlag_ms",
                "a=\"",
                "[[simulator.device]]\nname=\"K\"\nkind=\"relay\"\noutput=\"Q\"\ninput=\"P\"\n",
            ],
        ),
        (
            "s.plctest",
            &[
                "test \"",
                "expect ((",
                "set KEY.",
                "wait until N = 1 within ",
                "program \"a.pmi\"\n",
            ],
        ),
        ("k.csv", &["tick,name,value\n", "1,KEY.", "0,N,\n", "9s,"]),
    ] {
        let folder = Folder::with(&[
            ("a.pmi", PMI),
            ("p.nc", "M30\n"),
            ("a.machine.toml", named),
            ("s.plctest", script),
            ("k.csv", "tick,name,value\n1,DOOR,1\n"),
        ]);
        folder.plcc("run a.pmi --ticks 2 --simulate --stimulus k.csv --watch N").exits(0);
        for text in pieces.iter().map(|part| again(part)) {
            folder.write(file, text);
            match file {
                "s.plctest" => folder.plcc("test s.plctest").exits(2),
                _ => folder
                    .plcc("run a.pmi --ticks 2 --simulate --stimulus k.csv --watch N")
                    .exits(2),
            };
            if file != "k.csv" && file != "s.plctest" {
                let status = folder.plcc("check a.pmi").status;
                assert!(matches!(status, 1 | 2), "{file}: {status}");
                folder.plcc("test s.plctest").exits(2);
            }
        }
    }
}
