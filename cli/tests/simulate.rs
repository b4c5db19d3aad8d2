//! `plcc run --simulate`

#![allow(clippy::unwrap_used, clippy::indexing_slicing)]

mod support;

use support::{COUNTER, Folder};

const LATHE: &str = include_str!("../../examples/pmi/lathe.pmi");
const SAMPLE: &str = include_str!("../../examples/nct/sample.plc");

/// What operators do at the machines of the manuals, and their part programs.
const LATHE_KEYS: &str = include_str!("../../examples/pmi/lathe-keys.csv");
const LATHE_PART: &str = include_str!("../../examples/pmi/lathe.nc");
const SAMPLE_KEYS: &str = include_str!("../../examples/nct/sample-keys.csv");
const SAMPLE_PART: &str = include_str!("../../examples/nct/sample.nc");

/// Two outputs that switch each other's devices, and a pump.
const DEVICES: &str = "$INPUT\nA=0/0\nB=0/1\nAT0=0/2\nAT1=0/3\nP=0/4\nST=1/0-3/BCD\nSTB=1/4\n\
    $OUTPUT\nCOIL=2/0\nOUT1=2/1\nPUMP=2/2\nTURN=2/3\n$INTEGER\nN\n$END\n\
    N=N+1\nCOIL=(N>2)&(N<9)\nOUT1=(N>2)&(N<12)\nPUMP=COIL\nTURN=N<12\n";
const DEVICE_TABLE: &str = "[[simulator.device]]\nname = \"K1\"\nkind = \"relay\"\noutput = \"COIL\"\n\
    input = \"A\"\non_ms = 40\noff_ms = 0\n\
    [[simulator.device]]\nname = \"C1\"\nkind = \"cylinder\"\nextend = \"OUT1\"\nretract = \"!OUT1\"\n\
    extended = \"AT1\"\nretracted = \"AT0\"\nextend_ms = 80\nretract_ms = 40\n\
    [[simulator.device]]\nname = \"P1\"\nkind = \"pump\"\noutput = \"PUMP\"\ninput = \"P\"\nrise_ms = 100\n\
    fall_ms = 40\n\
    [[simulator.device]]\nname = \"T1\"\nkind = \"turret\"\noutput = \"TURN\"\nstations = 3\n\
    station_ms = 80\nstation = 3\ncode = \"ST\"\nstrobe = \"!STB\"\n";

/// A trace without its header, a row a line.
fn rows(trace: &str, name: &str) -> Vec<(u64, i64)> {
    let row = |line: &str| {
        let mut fields = line.split(',');
        let tick = fields.next()?.parse().ok()?;
        (fields.next()? == name).then_some((tick, fields.next()?.parse().ok()?))
    };
    trace.lines().skip(1).filter_map(row).collect()
}

#[test]
fn both_kits_run_a_part_program_by_keys_alone_alike_in_every_engine_and_as_recorded() {
    for (file, source, keys, part, names) in [
        (
            "lathe.pmi",
            LATHE,
            LATHE_KEYS,
            LATHE_PART,
            "@ESTOP,@PGMSE,SPINON,SIM.LINE,@CMDRG,@POSRG,@SSRPM",
        ),
        (
            "sample.plc",
            SAMPLE,
            SAMPLE_KEYS,
            SAMPLE_PART,
            "I540,I546,SIM.LINE,RH000,RH010,RH100,RH110,Y547",
        ),
    ] {
        let folder = Folder::with(&[(file, source), ("keys.csv", keys), ("part.nc", part)]);
        let outputs = format!("--watch {names} --trace t.csv --events e.jsonl --dump d.json");
        let read = || ["t.csv", "e.jsonl", "d.json"].map(|name| folder.read(name));
        let run = format!(
            "run {file} --ticks 1700 --stimulus keys.csv --simulate --part-program part.nc {outputs}"
        );
        folder.plcc(&format!("{run} --record r.plcrec")).exits(0);
        let expected = read();
        for engine in ["--engine interp", "--engine aot", "--opt none"] {
            folder.plcc(&format!("{run} {engine}")).exits(0);
            assert_eq!(read(), expected, "{file} {engine}");
        }
        let events = folder.read("e.jsonl");
        let begins = events.matches("\"what\":\"block\"").count();
        assert_eq!(begins, 8, "{events}");
        assert!(events.contains("\"kind\":\"simulator\",\"what\":\"end\"}"), "{events}");
        // The record needs neither the table nor the part program, and has a checkpoint in its middle.
        std::fs::remove_file(folder.path().join("part.nc")).unwrap();
        for engine in ["interp", "jit"] {
            folder.plcc(&format!("replay r.plcrec --engine {engine} {outputs}")).exits(0);
            assert_eq!(read(), expected, "{file} {engine}");
        }
        folder.plcc("replay r.plcrec --from 1600").exits(0);
    }
}

#[test]
fn the_lathe_goes_through_machine_on_a_program_and_its_end() {
    let files = [("a.pmi", LATHE), ("k.csv", LATHE_KEYS), ("part.nc", LATHE_PART)];
    let folder = Folder::with(&files);
    let run = "run a.pmi --ticks 200 --simulate --part-program part.nc --stimulus k.csv --watch ";
    let names = "@MXRDY,@ESTOP,@MODE,@BKACT,@AXACT[0],@PGMSE,@CMDRG[0],@POSRG[0],SIM.LINE";
    let trace = folder.plcc(&format!("{run}{names}")).exits(0).stdout;
    let is =
        |name: &str, expected: &[(u64, i64)]| assert_eq!(rows(&trace, name), expected, "{name}");
    // @MONRQ is set by scan 5, @MCRDY by scan 7.
    is("@MXRDY", &[(0, 0), (6, 1)]);
    is("@ESTOP", &[(0, 1), (8, 0)]);
    // The key is pressed in tick 100, and scan 100 sets @MODRQ.
    is("@MODE", &[(0, 0), (101, 2)]);
    is("@BKACT", &[(0, 0), (126, 1), (164, 0)]);
    is("SIM.LINE", &[(0, 0), (126, 3), (127, 4), (137, 5), (152, 6), (162, 7), (163, 8), (164, 0)]);
    is("@AXACT[0]", &[(0, 0), (127, 1), (152, 0)]);
    is("@PGMSE", &[(0, 0), (164, 2)]);
    // Rapid traverse is 300 inches a minute: a tenth in 20 ms.
    let commands = rows(&trace, "@CMDRG[0]");
    assert_eq!(commands[..3], [(0, 0), (128, 1000), (129, 2000)]);
    assert_eq!(*commands.last().unwrap(), (152, 15_000));
    // Actual positions are two ticks behind.
    let actual = rows(&trace, "@POSRG[0]");
    assert_eq!(actual[..2], [(0, 0), (130, 1000)]);
    assert_eq!(actual.last().unwrap(), &(154, 15_000));
}

#[test]
fn devices_follow_their_coils() {
    let folder = Folder::with(&[("a.pmi", DEVICES), ("a.machine.toml", DEVICE_TABLE)]);
    let names = "A,AT0,AT1,P,ST,STB,SIM.C1,SIM.P1,SIM.T1,COIL,OUT1";
    let done = folder.plcc(&format!("run a.pmi --ticks 24 --simulate --watch {names}")).exits(0);
    let is = |name: &str, expected: &[(u64, i64)]| {
        assert_eq!(rows(&done.stdout, name), expected, "{name}");
    };
    is("COIL", &[(0, 0), (2, 1), (8, 0)]);
    is("OUT1", &[(0, 0), (2, 1), (11, 0)]);
    // Step 3 sees the coil; the contact closes two ticks later, and opens at once.
    is("A", &[(0, 0), (5, 1), (9, 0)]);
    // Step 3 sees the coil; four ticks later the cylinder is out. It is back two ticks after step 12.
    is("AT0", &[(0, 1), (4, 0), (14, 1)]);
    is("AT1", &[(0, 0), (7, 1), (13, 0)]);
    is("SIM.C1", &[(0, 0), (4, 250), (5, 500), (6, 750), (7, 1000), (13, 500), (14, 0)]);
    // Five ticks to the full pressure, two back: closed at 80 %, open at 60 % or below.
    is("SIM.P1", &[(0, 0), (4, 200), (5, 400), (6, 600), (7, 800), (8, 1000), (10, 500), (11, 0)]);
    is("P", &[(0, 0), (7, 1), (10, 0)]);
    // Four ticks a station; the number shows in the first of them.
    assert_eq!(rows(&done.stdout, "SIM.T1")[..3], [(0, 8), (2, 9), (3, 10)]);
    assert_eq!(rows(&done.stdout, "ST")[..4], [(0, 3), (2, 0), (5, 1), (6, 0)]);
    assert_eq!(rows(&done.stdout, "STB")[..4], [(0, 0), (2, 1), (5, 0), (6, 1)]);
}

#[test]
fn a_row_on_what_is_held_lasts_one_tick_and_a_key_jams_a_device() {
    let rows_of = "tick,name,value\n6,A,0\n4,KEY.JAM C1,1\n10,key.jam  c1,0\n9,@MODE,2\n";
    let files = [("a.pmi", DEVICES), ("a.machine.toml", DEVICE_TABLE), ("s.csv", rows_of)];
    let folder = Folder::with(&files);
    let run = "run a.pmi --ticks 20 --simulate --stimulus s.csv --watch A,SIM.C1,@MODE";
    let trace = folder.plcc(run).exits(0).stdout;
    assert_eq!(rows(&trace, "A"), [(0, 0), (5, 1), (6, 0), (7, 1), (9, 0)]);
    assert_eq!(rows(&trace, "SIM.C1")[..3], [(0, 0), (10, 250), (11, 500)]);
    assert_eq!(rows(&trace, "@MODE"), [(0, 0), (9, 2), (10, 0)]);
}

#[test]
fn a_flag_that_a_row_has_set_is_written_by_the_control_again_in_the_next_tick() {
    let program = ":000\nJ0\n:001\nLI541 SY540\nLI540 SY010\nJ1\n";
    let folder = Folder::with(&[("a.plc", program), ("k.csv", "tick,name,value\n5,I540,0\n")]);
    let run = "run a.plc --ticks 9 --simulate --stimulus k.csv --watch I540,Y010";
    let trace = folder.plcc(run).exits(0).stdout;
    assert_eq!(rows(&trace, "I540"), [(0, 0), (1, 1), (5, 0), (6, 1)]);
    assert_eq!(rows(&trace, "Y010"), [(0, 0), (1, 1), (5, 0), (6, 1)]);
}

#[test]
fn devices_stand_beside_a_pmac_too() {
    let source = "I5=2\nM1->Y:$FFC2,0\nM2->Y:$FFC2,8\nOPEN PLC 1 CLEAR\nM2=1\nP1=M1\nCLOSE\n";
    let table = "[[simulator.device]]\nname = \"K1\"\nkind = \"relay\"\noutput = \"M2\"\ninput = \"M1\"\n\
                 on_ms = 1\n[simulator.keys]\nDOOR = \"P7\"\n";
    let rows_of = "tick,name,value\n1ms,KEY.DOOR,press\n";
    let files = [("a.pmc", source), ("a.machine.toml", table), ("s.csv", rows_of)];
    let folder = Folder::with(&files);
    let run = "run a.pmc --ticks 400 --simulate --stimulus s.csv --watch M1,M2,P1,SIM.K1,P7";
    let trace = folder.plcc(run).exits(0).stdout;
    let first_on = |name: &str| rows(&trace, name).into_iter().find(|(_, value)| *value == 1);
    let (coil, _) = first_on("M2").unwrap();
    // Ticks of 442 microseconds: three of them in a millisecond, counted from the step that sees the coil.
    assert_eq!(first_on("M1"), Some((coil + 4, 1)));
    assert_eq!(first_on("SIM.K1"), Some((coil + 4, 1)));
    assert!(first_on("P1").unwrap().0 >= coil + 4);
    assert_eq!(rows(&trace, "P7"), [(0, 0), (3, 1), (229, 0)]);
}

#[test]
fn wrong_tables_and_keys_are_told_with_their_place() {
    for (table, options, parts) in [
        ("[simulator]\nlagms = 1\n", "", &["line 2", "`lagms`", "did you mean `lag_ms`"][..]),
        (
            "[[simulator.device]]\nname = \"K\"\nkind = \"relay\"\noutput = \"OUTT\"\ninput = \"N\"\n",
            "",
            &["line 4", "OUTT", "did you mean `OUT`"],
        ),
        (
            "[[simulator.device]]\nname = \"K\"\nkind = \"relay\"\noutput = \"OUT\"\ninput = \"@MODE\"\n",
            "--simulate",
            &["line 2", "writes what the control"],
        ),
        ("[simulator.keys]\nDOOR = \"NN\"\n", "", &["line 2", "`NN`"]),
        (
            "",
            "--stimulus unknown.csv --simulate",
            &["unknown.csv:2", "did you mean KEY.CYCLE START?"],
        ),
        ("", "--stimulus unknown.csv", &["unknown.csv:2", "--simulate"]),
        ("", "--simulate --part-program none.nc", &["none.nc", "can't be read"]),
        (
            "[simulator]\npart_program = \"bad.nc\"\n",
            "--simulate",
            &["bad.nc:1:4", "SIM-2", "bad.nc:2:1", "SIM-5", "bad.nc:3:4", "SIM-8"],
        ),
    ] {
        let folder = Folder::with(&[
            ("a.pmi", COUNTER),
            ("a.machine.toml", table),
            ("unknown.csv", "tick,name,value\n1,KEY.CYCLE STAR,press\n"),
            ("bad.nc", "M3 Q5\nG71\nG1 X5\nM30\n"),
        ]);
        folder.plcc(&format!("run a.pmi --ticks 3 {options}")).exits(2).says(parts);
    }
}

#[test]
fn nothing_changes_without_the_option() {
    let folder = Folder::with(&[("a.pmi", DEVICES), ("k.csv", "tick,name,value\n40ms,A,1\n")]);
    let run =
        "run a.pmi --ticks 20 --stimulus k.csv --watch A,N,COIL,ST,@MODE,@ESTOP,@FRO --dump d.json";
    let before = (folder.plcc(run).exits(0).stdout, folder.read("d.json"));
    folder.write("a.machine.toml", DEVICE_TABLE);
    assert_eq!((folder.plcc(run).exits(0).stdout, folder.read("d.json")), before);
    assert_eq!(rows(&before.0, "A"), [(0, 0), (2, 1)]);
    folder.plcc("run a.pmi --ticks 3 --part-program x.nc").exits(2).says(&["--simulate"]);
}

#[test]
fn check_reads_the_part_program_that_the_table_names() {
    let folder = Folder::with(&[
        ("a.pmi", COUNTER),
        ("a.machine.toml", "[simulator]\npart_program = \"p.nc\"\n"),
        ("p.nc", "M8\nG1 X1\nM30\n"),
    ]);
    let done = folder.plcc("check a.pmi --message-format json").exits(1);
    let found = done.json();
    let place = |at: usize| {
        let found = &found[at];
        (found["code"].as_str().unwrap(), found["line"].as_u64(), found["column"].as_u64())
    };
    assert_eq!(place(0), ("SIM-11", Some(1), Some(1)));
    assert_eq!(place(1), ("SIM-8", Some(2), Some(4)));
    folder.write("p.nc", "G1 X1 F5\nM30\n");
    folder.plcc("check a.pmi").exits(0);
    folder.write("a.machine.toml", "[simulator.keys]\nDOOR = \"NN\"\n");
    folder.plcc("check a.pmi").exits(2).says(&["a.machine.toml", "line 2"]);
    let explained = folder.plcc("explain sim-8").exits(0);
    assert!(explained.stdout.starts_with("SIM-8: a feed without F\n"), "{}", explained.stdout);
}

#[test]
fn the_mill_of_the_examples_runs_closed() {
    let examples = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/pmac");
    let path = |name: &str| examples.join(name).display().to_string();
    let (program, table, keys) = (path("mill.pmc"), path("mill-desk.toml"), path("mill-keys.csv"));
    let folder = Folder::with(&[]);
    let run = format!("run {program} --machine {table} --simulate --stimulus {keys} --ticks 9000");
    let mut traces = vec![];
    for engine in ["interp", "jit"] {
        let run = format!("{run} --engine {engine} --watch M11,M12,M13,M82,M85");
        traces.push(folder.plcc(&run).exits(0).stdout);
    }
    assert_eq!(traces[0], traces[1]);
    // The valve opens the clamp, 300 ms later; the spring closes it in 400 ms.
    assert_eq!(rows(&traces[0], "M82")[..3], [(0, 0), (204, 1), (2004, 0)]);
    assert_eq!(rows(&traces[0], "M12")[..3], [(0, 0), (883, 1), (2006, 0)]);
    assert_eq!(rows(&traces[0], "M11")[..3], [(0, 1), (206, 0), (2909, 1)]);
}

/// The machines of `examples/desk`, with what an operator does at them, how many ticks that takes and what is watched.
const DESK: [(&str, &str, u32, &str); 3] = [
    (
        "turret.pmi",
        "5,KEY.MACHINE ON,press\n50,KEY.AUTO,press\n75,KEY.CYCLE START,press\n",
        220,
        "SIM.LINE,SIM.TURRET,TPOS,SPINON,@PGMSE,@SSRPM",
    ),
    (
        "changer.nct",
        "0,KEY.EMERGENCY LINE,1\n10,KEY.B1,press\n40,KEY.AUTO,press\n60,KEY.START,press\n",
        300,
        "SIM.LINE,SIM.CAROUSEL,RH006,RH100,Y547,I550",
    ),
    (
        "router.pmc",
        "0,KEY.GUARD,1\n0.1s,KEY.START,press\n1.5s,KEY.JAM HOOD,1\n2s,KEY.STOP,press\n",
        6000,
        "SIM.HOOD,SIM.VACUUM,M1,M11,M12,M13,P1",
    ),
];

/// A folder with all files of `examples/desk`.
fn desk() -> Folder {
    let folder = Folder::with(&[]);
    let examples = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/desk");
    for file in std::fs::read_dir(examples).unwrap() {
        let file = file.unwrap();
        folder.write(file.file_name(), std::fs::read(file.path()).unwrap());
    }
    folder
}

#[test]
fn the_machines_on_the_desk_are_replayed_as_they_were_recorded() {
    for (program, keys, ticks, names) in DESK {
        let folder = desk();
        folder.write("keys.csv", format!("tick,name,value\n{keys}"));
        let outputs = format!("--watch {names} --trace t.csv --events e.jsonl --dump d.json");
        let read = || ["t.csv", "e.jsonl", "d.json"].map(|name| folder.read(name));
        let run = format!("run {program} --ticks {ticks} --simulate --stimulus keys.csv {outputs}");
        folder.plcc(&format!("{run} --record r.plcrec")).exits(0);
        let expected = read();
        for engine in ["--engine interp", "--engine aot", "--engine jit --opt none"] {
            folder.plcc(&format!("{run} {engine}")).exits(0);
            assert_eq!(read(), expected, "{program} {engine}");
        }
        // The record needs neither the table nor the part program.
        let stem = program.split('.').next().unwrap();
        std::fs::remove_file(folder.path().join(format!("{stem}.machine.toml"))).unwrap();
        for engine in ["interp", "jit"] {
            folder.plcc(&format!("replay r.plcrec --engine {engine} {outputs}")).exits(0);
            assert_eq!(read(), expected, "{program} {engine}");
        }
        // From a checkpoint in the middle.
        folder.plcc(&format!("replay r.plcrec --from {}", ticks * 2 / 3)).exits(0);
    }
}

#[test]
fn the_table_alone_changes_no_trace() {
    for (program, _, _, names) in DESK {
        let folder = desk();
        let names: Vec<&str> = names.split(',').filter(|name| !name.starts_with("SIM.")).collect();
        let outputs =
            format!("--watch {} --trace t.csv --events e.jsonl --dump d.json", names.join(","));
        let read = || ["t.csv", "e.jsonl", "d.json"].map(|name| folder.read(name));
        let run = format!("run {program} --ticks 300 {outputs}");
        folder.plcc(&run).exits(0);
        let with = read();
        folder.plcc(&format!("{run} --no-machine")).exits(0);
        assert_eq!(read(), with, "{program}");
        assert!(!with[1].contains("simulator"), "{}", with[1]);
        folder.plcc(&format!("run {program} --ticks 1 --watch SIM.LINE")).exits(2);
    }
}
