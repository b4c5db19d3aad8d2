//! `plcc run --record`, `plcc replay` and `plcc convert`

#![allow(clippy::unwrap_used, clippy::indexing_slicing)]

mod support;
#[path = "../../tests/src/tools.rs"]
mod tools;

use std::fs;
use std::process::Command;

use support::{COUNTER, Folder, PLC1, SLICES, STOPS};

/// A stimulus that changes the counters of the programs.
fn stimulus(name: &str) -> String {
    format!("tick,name,value\n2,{name},7\n5,{name},1\n5,{name},2\n")
}

/// A replay writes the same trace, events and dump as the run, in every engine.
#[test]
fn a_replay_writes_what_the_run_has_written() {
    let files = [("a.pmi", COUNTER), ("s.pmi", STOPS), ("b.plc", SLICES), ("c.pmc", PLC1)];
    let folder = Folder::with(&files);
    for (file, names, set, status) in [
        ("a.pmi", "N,OUT", "N", 0),
        ("s.pmi", "A,N", "A[0]", 3),
        ("b.plc", "F020,OP1", "F020", 0),
        ("c.pmc", "P1", "P1", 0),
    ] {
        folder.write("s.csv", stimulus(set));
        let outputs =
            format!("--watch {names} --trace t.csv --events e.jsonl --dump d.json --time");
        let read = || ["t.csv", "e.jsonl", "d.json"].map(|name| folder.read(name));
        let run = format!("run {file} --ticks 9 --stimulus s.csv --record r.plcrec {outputs}");
        folder.plcc(&run).exits(status);
        let expected = read();
        for engine in ["interp", "jit", "aot"] {
            let replay = format!("replay r.plcrec --engine {engine} {outputs}");
            folder.plcc(&replay).exits(0).says(&["went as they were recorded"]);
            assert_eq!(read(), expected, "{file} {engine}");
        }
        folder.plcc(&format!("replay r.plcrec {file} {outputs}")).exits(0);
        assert_eq!(read(), expected, "{file} from the disk");
        let part =
            folder.plcc(&format!("replay r.plcrec --from 2 --until 3 --watch {names}")).exits(0);
        assert!(
            part.stdout.lines().skip(1).all(|row| row.starts_with(['2', '3'])),
            "{}",
            part.stdout
        );
    }
}

#[test]
fn included_files_and_the_machine_file_are_in_the_record() {
    let folder = Folder::with(&[
        ("main.pmc", "#include \"more.pmc\"\nI5=2\nOPEN PLC 1 CLEAR\nP1=P1+STEP\nCLOSE\n"),
        ("more.pmc", "#define STEP 3\n"),
    ]);
    folder.plcc("run main.pmc --ticks 5 --record r.plcrec --dump d.json").exits(0);
    let expected = folder.read("d.json");
    fs::remove_file(folder.path().join("more.pmc")).unwrap();
    fs::remove_file(folder.path().join("main.pmc")).unwrap();
    folder.plcc("replay r.plcrec --dump d.json").exits(0);
    assert_eq!(folder.read("d.json"), expected);
}

#[test]
fn what_does_not_fit_a_record_is_refused() {
    let folder = Folder::with(&[("a.pmi", COUNTER), ("other.pmi", STOPS), ("r.txt", "no record")]);
    folder.plcc("run a.pmi --ticks 5 --record r.plcrec").exits(0);
    folder.plcc("replay r.txt").exits(2).says(&["r.txt is not a record"]);
    folder.plcc("replay missing.plcrec").exits(2).says(&["there is no such file"]);
    folder.plcc("replay r.plcrec other.pmi").exits(2).says(&["another program"]);
    folder.plcc("replay r.plcrec --from 9").exits(2).says(&["ticks from 0 to 4"]);
    folder.plcc("replay r.plcrec --run 2").exits(2).says(&["it has 1 run"]);
    folder.plcc("run a.pmi --ticks 5 --record a.pmi").exits(2).says(&["--record would overwrite"]);
    folder.plcc("build a.pmi --no-source").exits(0);
    folder.plcc("run a.plcx --ticks 5 --record r.plcrec").exits(0);
    folder.plcc("replay r.plcrec").exits(0);
    folder.plcc("replay r.plcrec --engine interp").exits(2).says(&["name the program's sources"]);
    folder.plcc("replay r.plcrec a.pmi --engine interp").exits(0);
    folder.plcc("replay r.plcrec other.pmi").exits(2).says(&["another program"]);
}

/// An artifact has the text of its sources, included files too, so that what it did can be run again in any engine
/// without them.
#[test]
fn an_artifact_is_replayed_in_any_engine_without_its_sources_beside_it() {
    let folder = Folder::with(&[
        (
            "main.pmc",
            "#include \"more.pmc\"\nI5=2\nOPEN PLC 1 CLEAR\nP1=P1+STEP\nCLOSE\nENABLE PLC 1\n",
        ),
        ("more.pmc", "#define STEP 3\n"),
    ]);
    folder.plcc("build main.pmc").exits(0);
    folder.plcc("build main.pmc --no-source -o small.plcx").exits(0);
    folder.plcc("build main.pmc --no-source --emit obj").exits(2).says(&["--no-source"]);
    let length = |name: &str| fs::metadata(folder.path().join(name)).unwrap().len();
    assert!(length("small.plcx") < length("main.plcx"));
    for name in ["main.pmc", "more.pmc"] {
        fs::remove_file(folder.path().join(name)).unwrap();
    }
    folder.plcc("run main.plcx --ticks 5 --record r.plcrec --dump d.json").exits(0);
    let expected = folder.read("d.json");
    for engine in ["aot", "jit", "interp"] {
        folder.plcc(&format!("replay r.plcrec --engine {engine} --dump {engine}.json")).exits(0);
        assert_eq!(folder.read(&format!("{engine}.json")), expected, "{engine}");
    }
}

#[test]
fn a_record_becomes_a_table_and_waveforms() {
    let folder = Folder::with(&[("a.pmi", COUNTER), ("c.pmc", PLC1)]);
    for (file, row, change) in [("a.pmi", "3,60,N,4", "b"), ("c.pmc", "2,", "r3 ")] {
        folder.plcc(&format!("run {file} --ticks 6 --record r.plcrec")).exits(0);
        folder.plcc("convert r.plcrec --to csv -o out.csv").exits(0);
        let table = folder.read("out.csv");
        assert!(table.starts_with("tick,ms,name,value\n"), "{table}");
        let with = |text: &str, part: &str| text.lines().any(|line| line.starts_with(part));
        assert!(with(&table, row) || table.contains(row), "{table}");
        folder.plcc("convert r.plcrec --to vcd").exits(0);
        assert!(with(&folder.read("r.vcd"), change), "{}", folder.read("r.vcd"));
        folder.plcc("convert r.plcrec --to fst").exits(0);
        assert!(fs::metadata(folder.path().join("r.fst")).unwrap().len() > 100);
        let refused = folder.plcc("convert r.plcrec --to fst -o -");
        refused.exits(2).says(&["is not written to standard output"]);
        // GTKWave's own tool, where it is installed.
        let mut tool = Command::new("fst2vcd");
        match tool.args(["-f", "r.fst"]).current_dir(folder.path()).output() {
            Ok(output) => {
                let text = String::from_utf8_lossy(&output.stdout).into_owned();
                assert!(output.status.success() && text.contains("$enddefinitions"), "{text}");
            }
            Err(_) => tools::missing("fst2vcd", "is not installed"),
        }
    }
}

/// Opening a pipe that nobody reads would wait for ever.
#[cfg(target_os = "linux")]
#[test]
fn values_are_not_written_to_a_pipe_that_nobody_reads() {
    let folder = Folder::with(&[("a.pmi", COUNTER)]);
    folder.plcc("run a.pmi --ticks 3 --record r.plcrec").exits(0);
    let pipe = folder.path().join("pipe");
    let mode = rustix::fs::Mode::RUSR | rustix::fs::Mode::WUSR;
    let kind = rustix::fs::FileType::Fifo;
    rustix::fs::mknodat(rustix::fs::CWD, &pipe, kind, mode, 0).unwrap();
    for format in ["csv", "vcd", "fst"] {
        let refused = folder.plcc(&format!("convert r.plcrec --to {format} -o pipe"));
        refused.exits(2).says(&["nobody reads"]);
    }
}

#[cfg(not(feature = "mcap"))]
#[test]
fn a_plcc_without_mcap_says_how_to_build_one_with_it() {
    let folder = Folder::with(&[("a.pmi", COUNTER)]);
    folder.plcc("run a.pmi --ticks 3 --record r.plcrec").exits(0);
    folder.plcc("convert r.plcrec --to mcap").exits(2).says(&["--features mcap"]);
    assert!(!folder.path().join("r.mcap").exists());
}

/// The values of a tick are those after it, and a tick that the watchdog stopped in its middle has no end.
#[test]
fn a_tick_that_was_cut_has_no_row() {
    // The first ticks are short; later ones take longer than the watchdog allows, on any computer.
    let long = "B=B&C!/B\nC=/B!C\n".repeat(3000);
    let program = format!("$INTEGER\nN\n$LOGICAL\nB,C\n$END\nN=N+1\nIF (N>50)\n{long}ENDIF\n");
    let folder = Folder::with(&[("a.pmi", &program)]);
    let run =
        "run a.pmi --engine interp --watchdog 1us --ticks 32000 --record r.plcrec --events e.jsonl";
    let run = || {
        folder.plcc(run).exits(3).says(&["WATCHDOG"]);
        let events = folder.read("e.jsonl");
        let stop: serde_json::Value = serde_json::from_str(events.lines().last().unwrap()).unwrap();
        stop["tick"].as_u64().unwrap()
    };
    // On a busy computer even the first tick may be too late; a record of it has nothing to show.
    let cut = (0..).map(|_| run()).find(|cut| *cut > 0).unwrap();
    folder.plcc("convert r.plcrec --to csv --watch N -o out.csv").exits(0);
    let table = folder.read("out.csv");
    let rows = table.lines().skip(1).map(|row| row.split(',').next().unwrap().parse().unwrap());
    let rows: Vec<u64> = rows.collect();
    assert!(rows.iter().copied().eq(0..cut), "{rows:?} {cut}");
    // Neither has a file of another format: its last tick is the one before.
    folder.plcc("convert r.plcrec --to vcd --watch N -o out.vcd").exits(0);
    let vcd = folder.read("out.vcd");
    let times = vcd.lines().filter_map(|line| line.strip_prefix('#')?.parse::<u64>().ok());
    assert_eq!(times.max().unwrap(), cut * 20_000, "{vcd}");
}

/// Constants of PMI do not change, but another program may have others.
#[test]
fn constants_are_written_once_and_nothing_is_missing() {
    let folder = Folder::with(&[("a.pmi", "$INTEGER\nK=7,N\n$END\nN=N+K\n")]);
    folder.plcc("run a.pmi --ticks 3 --record r.plcrec").exits(0);
    let done = folder.plcc("convert r.plcrec --to csv -o -").exits(0);
    assert_eq!(done.stdout, "tick,ms,name,value\n0,0,K,7\n0,0,N,7\n1,20,N,14\n2,40,N,21\n");
    assert_eq!(done.stderr, "");
}

/// The stimulus of `a.pmi` has the name that the table of `a.plcrec` would get.
#[test]
fn converting_overwrites_neither_a_stimulus_nor_the_record() {
    let folder = Folder::with(&[("a.pmi", COUNTER)]);
    folder.write("a.csv", stimulus("N"));
    folder.plcc("run a.pmi --ticks 6 --stimulus a.csv --record a.plcrec").exits(0);
    let record = fs::read(folder.path().join("a.plcrec")).unwrap();
    folder.plcc("convert a.plcrec --to csv").exits(2).says(&["a.csv", "-o names another file"]);
    assert_eq!(folder.read("a.csv"), stimulus("N"));
    for output in ["a.plcrec", "./a.plcrec", "a.pmi"] {
        let convert = format!("convert a.plcrec a.pmi --to vcd -o {output}");
        folder.plcc(&convert).exits(2).says(&["is not overwritten"]);
    }
    assert_eq!(fs::read(folder.path().join("a.plcrec")).unwrap(), record);
    assert_eq!(folder.read("a.pmi"), COUNTER);
    folder.plcc("convert a.plcrec --to csv -o a.csv").exits(0);
    assert!(folder.read("a.csv").starts_with("tick,ms,name,value\n"));
}

/// The record, its older part and the program are not overwritten by what is made of them.
#[test]
fn no_output_overwrites_what_is_read() {
    let folder = Folder::with(&[("a.pmi", COUNTER)]);
    folder.plcc("run a.pmi --ticks 5 --record r.csv").exits(0);
    folder.write("r.csv.1", "older");
    let bytes =
        || ["r.csv", "a.pmi", "r.csv.1"].map(|name| fs::read(folder.path().join(name)).unwrap());
    let before = bytes();
    for command in [
        "convert r.csv --to csv",
        "convert r.csv --to fst -o ./r.csv",
        "convert r.csv --to csv -o r.csv.1",
        "convert r.csv a.pmi --to vcd -o a.pmi",
        "replay r.csv --trace r.csv --watch N",
        "replay r.csv --events r.csv",
        "replay r.csv --dump r.csv",
        "replay r.csv a.pmi --dump a.pmi",
    ] {
        folder.plcc(command).exits(2).says(&["is not overwritten"]);
        assert_eq!(bytes(), before, "{command}");
    }
    // The older part of a record has this name, also where there is none yet.
    fs::remove_file(folder.path().join("r.csv.1")).unwrap();
    folder.plcc("convert r.csv --to csv -o r.csv.1").exits(2).says(&["is not overwritten"]);
    assert!(!folder.has("r.csv.1"));
    // Another name of the record's file.
    fs::hard_link(folder.path().join("r.csv"), folder.path().join("same.csv")).unwrap();
    folder.plcc("convert r.csv --to csv -o same.csv").exits(2).says(&["is not overwritten"]);
    folder.plcc("replay r.csv --trace same.csv --watch N").exits(2).says(&["is not overwritten"]);
    assert_eq!(fs::read(folder.path().join("r.csv")).unwrap(), before[0]);
}

/// An FST has its length in its head, which is written last.
#[cfg(unix)]
#[test]
fn an_fst_is_written_to_regular_files_alone() {
    let folder = Folder::with(&[("a.pmi", COUNTER)]);
    folder.plcc("run a.pmi --ticks 5 --record r.plcrec").exits(0);
    folder.plcc("convert r.plcrec --to fst -o /dev/null").exits(2).says(&["a regular file"]);
    folder.plcc("convert r.plcrec --to vcd -o /dev/null").exits(0);
}

/// A record that is cut within its first checkpoint, or after it, has nothing that went as recorded.
#[test]
fn a_record_without_a_whole_checkpoint_or_tick_is_no_success() {
    let folder = Folder::with(&[("a.pmi", COUNTER)]);
    folder.plcc("run a.pmi --ticks 5 --record r.plcrec").exits(0);
    let bytes = fs::read(folder.path().join("r.plcrec")).unwrap();
    let checkpoint = bytes.windows(4).position(|bytes| bytes == b"\x89RB\x03").unwrap();
    folder.write("r.plcrec", &bytes[..checkpoint + 40]);
    for command in ["replay r.plcrec", "convert r.plcrec --to csv"] {
        folder.plcc(command).exits(2).says(&["it has no whole checkpoint"]);
    }
    let ticks = bytes.windows(4).position(|bytes| bytes == b"\x89RB\x04").unwrap();
    folder.write("r.plcrec", &bytes[..ticks]);
    for command in ["replay r.plcrec", "convert r.plcrec --to csv"] {
        folder.plcc(command).exits(2).says(&["the record has no whole tick"]);
    }
    folder.write("r.plcrec", &bytes);
    folder
        .plcc("replay r.plcrec --from 3 --until 2")
        .exits(2)
        .says(&["--from 3 is after --until 2"]);
    let convert = folder.plcc("convert r.plcrec --to csv --from 3 --until 2");
    convert.exits(2).says(&["--from 3 is after --until 2"]);
}

/// Ticks that are damaged are missing: the run did not go otherwise because of that.
#[test]
fn damaged_ticks_before_the_end_are_told_and_are_no_difference() {
    let folder = Folder::with(&[("a.pmi", COUNTER)]);
    folder.plcc("run a.pmi --ticks 2000 --record r.plcrec").exits(0);
    let mut bytes = fs::read(folder.path().join("r.plcrec")).unwrap();
    let ticks = bytes.windows(4).rposition(|bytes| bytes == b"\x89RB\x04").unwrap();
    bytes[ticks + 24] ^= 1;
    folder.write("r.plcrec", &bytes);
    let missing = "ticks before 2000 are damaged";
    folder.plcc("replay r.plcrec").exits(0).says(&[missing, "1500 ticks, 0 to 1"]);
    folder.plcc("convert r.plcrec --to csv").exits(0).says(&[missing]);
}

/// The places of a record's blocks of a kind.
fn blocks(bytes: &[u8], kind: u8) -> Vec<usize> {
    let marker = [0x89, b'R', b'B', kind];
    (0..bytes.len()).filter(|&at| bytes[at..].starts_with(&marker)).collect()
}

/// A control that is killed within a second of its start leaves a run without a tick. The run before it is what
/// somebody wants to see who asks for no run.
#[test]
fn a_run_without_ticks_hides_no_run_before_it() {
    let folder = Folder::with(&[("a.pmi", COUNTER)]);
    folder.plcc("run a.pmi --ticks 30 --record r.plcrec").exits(0);
    let whole = fs::read(folder.path().join("r.plcrec")).unwrap();
    folder.plcc("run a.pmi --ticks 30 --record r.plcrec").exits(0);
    let short = fs::read(folder.path().join("r.plcrec")).unwrap();
    let short = &short[..blocks(&short, 4)[0]];
    folder.write("r.plcrec", [&whole, short, short].concat());
    let told = "this is run 1 of 2: no whole tick is kept of what came after it";
    folder.plcc("replay r.plcrec").exits(0).says(&[told, "30 ticks, 0 to 29"]);
    folder.plcc("convert r.plcrec --to vcd").exits(0).says(&[told]);
    folder.plcc("replay r.plcrec --run 1").exits(0).says(&["30 ticks, 0 to 29"]);
    let told = "run 2 has no whole tick; run 1 is the last one that has any";
    folder.plcc("replay r.plcrec --run 2").exits(2).says(&[told]);
    folder.plcc("convert r.plcrec --to vcd --run 2").exits(2).says(&[told]);
}

/// What is damaged at the beginning costs the ticks up to the next checkpoint alone, whatever of it is damaged.
#[test]
fn a_record_with_a_damaged_beginning_is_read_from_its_next_checkpoint_on() {
    let folder = Folder::with(&[("a.pmi", COUNTER)]);
    folder.plcc("run a.pmi --ticks 2000 --record r.plcrec --trace t.csv --watch N").exits(0);
    let expected = folder.read("t.csv");
    let bytes = fs::read(folder.path().join("r.plcrec")).unwrap();
    let next = *blocks(&bytes, 1).last().unwrap();
    let (first_start, program) = (blocks(&bytes, 1)[0], blocks(&bytes, 2)[0]);
    let (checkpoint, ticks) = (blocks(&bytes, 3)[0], blocks(&bytes, 4)[0]);
    assert!(program < checkpoint && checkpoint < ticks && ticks < next);
    let damaged = |range: std::ops::Range<usize>| {
        let mut bytes = bytes.clone();
        bytes[range].iter_mut().for_each(|byte| *byte ^= 0x55);
        folder.write("r.plcrec", bytes);
    };
    for range in [ticks..ticks + 40, checkpoint..next, checkpoint..checkpoint + 40] {
        damaged(range);
        for options in ["", "--from 0", "--from 1500", "--engine interp"] {
            let replay = format!("replay r.plcrec {options} --trace t.csv --watch N");
            let replay = folder.plcc(&replay).exits(0);
            replay.says(&["ticks before 1500 are damaged", "500 ticks, 1500 to 1999"]);
            let rows = folder.read("t.csv");
            // Of the tick before the first one nobody knows the value.
            let rows: Vec<&str> = rows.lines().skip(2).collect();
            assert!(!rows.is_empty() && expected.ends_with(&(rows.join("\n") + "\n")), "{options}");
        }
        let table = folder.plcc("convert r.plcrec --to csv --watch N -o -").exits(0);
        let table = table.says(&["ticks before 1500 are damaged"]);
        assert_eq!(
            table.stdout.lines().nth(1).map(|row| row.split(',').next().unwrap()),
            Some("1500")
        );
    }
    // The program is damaged too: it can be named, and so it is said.
    for range in [0..next, first_start..checkpoint] {
        damaged(range);
        folder.plcc("replay r.plcrec").exits(2).says(&["name it after the record"]);
        folder.plcc("replay r.plcrec a.pmi").exits(0).says(&["500 ticks, 1500 to 1999"]);
        folder.plcc("convert r.plcrec a.pmi --to vcd").exits(0);
    }
    damaged(0..blocks(&bytes, 3)[1]);
    folder.plcc("replay r.plcrec").exits(2).says(&["what r.plcrec says of its runs is damaged"]);
}
