//! `plcc run`

#![allow(clippy::unwrap_used, clippy::indexing_slicing)]

mod support;

use support::{BROKEN, COUNTER, Folder, PLC1, SLICES, STOPS};

#[test]
fn the_dump_is_the_documented_json() {
    let folder = Folder::with(&[("a.pmi", COUNTER)]);
    let done = folder.plcc("run a.pmi --ticks 5 --dump -").exits(0);
    let dump =
        r#"{"dialect":"pmi","ticks":5,"state":"running","stop":null,"variables":{"N":5,"OUT":1}}"#;
    assert_eq!(done.stdout, format!("{dump}\n"));
    assert_eq!(done.stderr, "");
}

#[test]
fn every_engine_and_optimisation_level_gives_the_same_output() {
    let files = [("a.pmi", COUNTER), ("s.pmi", STOPS), ("b.plc", SLICES), ("c.pmc", PLC1)];
    let folder = Folder::with(&files);
    for (file, names, status) in
        [("a.pmi", "N,OUT", 0), ("s.pmi", "A,N", 3), ("b.plc", "F020,OP1", 0), ("c.pmc", "P1", 0)]
    {
        let mut all = vec![];
        for engine in ["interp", "jit", "aot"] {
            for opt in ["none", "speed"] {
                let done = folder.plcc(&format!(
                    "run {file} --ticks 9 --engine {engine} --opt {opt} --watch {names} \
                     --trace - --events e.jsonl --dump d.json"
                ));
                let done = done.exits(status);
                all.push([done.stdout, folder.read("e.jsonl"), folder.read("d.json"), done.stderr]);
            }
        }
        assert!(all.windows(2).all(|pair| pair[0] == pair[1]), "{file}: {all:#?}");
    }
}

/// A download that moves a definition now and then, and waits in a loop meanwhile.
const MOVES: &str = "I5=3\nM1->X:$07F0,0,24\nM2->X:$07F1,0,24\nM101->Y:$BC01,0,16\n\
    OPEN PLC 1 CLEAR\nP1=P1+1\nM101=$07F4+INT(P1/40)%4\nWHILE (M1<P1)\nM1=M1+7\nENDWHILE\n\
    M2=M2+M1\nSEND\"X\"\nCLOSE\nOPEN PLCC 2 CLEAR\nM2=M2+1\nCLOSE\n";

#[test]
fn programs_that_move_definitions_give_the_same_results() {
    let folder = Folder::with(&[("m.pmc", MOVES)]);
    let mut all = vec![];
    for option in ["--engine interp", "--engine aot", "--opt none", ""] {
        let done = folder
            .plcc(&format!(
                "run m.pmc --ticks 900 {option} --watch M1,M2,P1 --trace - --events e.jsonl \
                 --dump d.json"
            ))
            .exits(0);
        all.push([done.stdout, folder.read("e.jsonl"), folder.read("d.json"), done.stderr]);
    }
    assert!(all.windows(2).all(|pair| pair[0] == pair[1]), "{all:#?}");
    folder.plcc("run m.pmc --realtime --watchdog 1h --ticks 300").exits(0);
}

#[test]
fn a_fault_is_status_3_with_everything_up_to_it() {
    let folder = Folder::with(&[("a.pmi", STOPS)]);
    let done = folder
        .plcc("run a.pmi --ticks 100 --watch N,A --trace t.csv --events e.jsonl --dump d.json")
        .exits(3)
        .says(&["NO PMI DATA", "tick 3", "A[3]", "line 4 of a.pmi"]);
    assert_eq!(done.stdout, "");
    assert!(folder.read("t.csv").ends_with("2,N,3\n2,A,\"[1,1,1]\"\n"), "{}", folder.read("t.csv"));
    assert_eq!(
        folder.read("e.jsonl"),
        "{\"tick\":3,\"kind\":\"stop\",\"code\":\"NO PMI DATA\",\"file\":\"a.pmi\",\"line\":4}\n"
    );
    let dump: serde_json::Value = serde_json::from_str(&folder.read("d.json")).unwrap();
    assert_eq!(dump["ticks"], 4);
    assert_eq!(dump["state"], "stopped");
    assert_eq!(dump["stop"]["tick"], 3);
    assert_eq!(dump["stop"]["code"], "NO PMI DATA");
    assert_eq!((&dump["stop"]["file"], &dump["stop"]["line"]), (&"a.pmi".into(), &4.into()));
}

#[test]
fn a_stimulus_plays_the_machine() {
    let folder = Folder::with(&[
        ("a.pmi", COUNTER),
        ("s.csv", "tick,name,value\n3,N,100\n1,N,-7\n"),
        ("name.csv", "tick,name,value\n0,NONE,1\n"),
        ("value.csv", "tick,name,value\n0,N,x\n"),
        ("header.csv", "N,1\n"),
    ]);
    let done = folder.plcc("run a.pmi --ticks 5 --stimulus s.csv --watch N --trace -").exits(0);
    assert_eq!(done.stdout, "tick,name,value\n0,N,1\n1,N,-6\n2,N,-5\n3,N,101\n4,N,102\n");
    for (file, part) in
        [("name.csv", "NONE"), ("value.csv", "`x`"), ("header.csv", "tick,name,value")]
    {
        let done = folder.plcc(&format!("run a.pmi --ticks 5 --stimulus {file}")).exits(2);
        done.says(&[file, part]);
    }
    folder.plcc("run a.pmi --ticks 5 --stimulus none.csv").exits(2).says(&["none.csv"]);
    folder.plcc("run a.pmi --ticks 5 --watch MM").exits(2).says(&["MM"]);
}

#[test]
fn a_run_needs_ticks_or_a_time() {
    let folder = Folder::with(&[("a.pmi", COUNTER)]);
    folder.plcc("run a.pmi").exits(2).says(&["--ticks"]);
    folder.plcc("run a.pmi --ticks 0 --dump -").exits(0);
    let done = folder.plcc("run a.pmi --for 1s --dump -").exits(0);
    assert!(done.stdout.contains("\"ticks\":50"), "{}", done.stdout);
    let done = folder.plcc("run a.pmi --for 1s --period 100 --dump -").exits(0);
    assert!(done.stdout.contains("\"ticks\":10"), "{}", done.stdout);
    folder.plcc("run a.pmi --ticks 1 --for 1s").exits(2);
    folder.plcc("run a.pmi --realtime --watchdog 1h --ticks 2 --period 1").exits(0);
}

#[test]
fn mistakes_on_the_command_line_are_explained_in_plain_words() {
    let folder = Folder::with(&[("a.pmi", COUNTER), ("c.pmc", PLC1), ("s.csv", "0,N\n")]);
    for (line, part) in [
        ("a.pmi --ticks ten", "a whole number of ticks is expected"),
        ("a.pmi --ticks -1", "a whole number of ticks is expected"),
        ("a.pmi --ticks 1 --stimulus no.csv", "no.csv can't be read: there is no such file"),
        (
            "a.pmi --ticks 1 --dump no/d.json",
            "no/d.json can't be written: its folder does not exist",
        ),
        ("a.pmi --ticks 1 --dump .", ". can't be written: it is a folder"),
        ("a.pmi --ticks 1 --machine s.csv", "s.csv: it is not a valid machine file: "),
        ("a.pmi --ticks 1 --retain s.csv", "if --retain names the right file"),
        ("a.pmi --ticks 1 --watch N --trace - --dump -", "can't both go to standard output"),
        ("a.pmi --ticks 1 --watch N,", "a name is missing"),
        ("a.pmi c.pmc --ticks 1", "a program has one language"),
        ("a.pmi a.pmi --ticks 1", "only PMAC programs may have several"),
    ] {
        let done = folder.plcc(&format!("run {line}")).exits(2).says(&[part]);
        assert!(!done.stderr.contains("os error"), "{}", done.stderr);
    }
}

#[test]
fn options_without_effect_are_warned_of() {
    let folder = Folder::with(&[("a.pmi", COUNTER)]);
    for (line, option) in [("a.pmi --time", "--time"), ("a.pmi --repeat", "--repeat")] {
        let done = folder.plcc(&format!("run {line} --ticks 1")).exits(0);
        let warning = format!("warning: {option} changes nothing: ");
        assert!(done.stderr.starts_with(&warning), "{line}: {}", done.stderr);
    }
    assert_eq!(folder.plcc("run a.pmi --ticks 1 --watch N --time").exits(0).stderr, "");
}

#[test]
fn sources_with_errors_are_status_1_and_not_run() {
    let folder = Folder::with(&[("a.pmi", BROKEN)]);
    let done = folder.plcc("run a.pmi --ticks 3 --dump -").exits(1);
    assert_eq!(done.stdout, "");
    done.says(&["[PMI-31]", "not run"]);
    let done = folder.plcc("run a.pmi --ticks 3 --message-format json").exits(1);
    assert_eq!(done.json()[1]["code"], "PMI-30");
    // Standard output is the dump's.
    let done = folder.plcc("run a.pmi --ticks 3 --message-format json --dump -").exits(1);
    assert_eq!(done.stdout, "");
}

#[test]
fn warnings_do_not_prevent_a_run() {
    let folder = Folder::with(&[("a.pmc", "OPEN PLC 1 CLEAR\nP1=P1+1\nCLOSE\n")]);
    folder.plcc("run a.pmc --ticks 3").exits(0).says(&["1 warning", "plcc check"]);
}

#[test]
fn keep_going_runs_the_plcs_that_have_no_errors() {
    let text = "I5=2\nOPEN PLC 1 CLEAR\nIF (P1=1)\nCLOSE\nOPEN PLC 2 CLEAR\nP2=P2+1\nCLOSE\n";
    let folder = Folder::with(&[("a.pmc", text), ("b.pmi", BROKEN)]);
    folder.plcc("run a.pmc --ticks 3").exits(1).says(&["[PMAC-9]"]);
    folder.plcc("check a.pmc").exits(1);
    folder.plcc("build a.pmc").exits(1);
    for engine in ["interp", "jit", "aot"] {
        let line = format!("run a.pmc --ticks 4 --keep-going --dump - --engine {engine}");
        let done = folder.plcc(&line).exits(0).says(&["[PMAC-9]"]);
        assert!(done.stdout.contains("\"P2\":"), "{}", done.stdout);
    }
    let done = folder.plcc("run b.pmi --ticks 3 --keep-going").exits(2);
    done.says(&["--keep-going is for pmac programs; this one is pmi"]);
}

#[test]
fn options_of_another_language_are_refused() {
    let folder = Folder::with(&[("a.pmi", COUNTER), ("b.plc", SLICES), ("c.pmc", PLC1)]);
    for (file, option) in [
        ("a.pmi", "--param 61=1"),
        ("a.pmi", "--control nct98"),
        ("b.plc", "--period 10"),
        ("b.plc", "--background-steps 2"),
        ("c.pmc", "--level0-safepoints 5"),
        ("a.pmi", "--define SPEED=3"),
        ("b.plc", "--controller turbo"),
        ("b.plc", "--keep-going"),
    ] {
        let done = folder.plcc(&format!("run {file} --ticks 1 {option}")).exits(2);
        done.says(&[option.split(' ').next().unwrap()]);
    }
    for command in ["check a.pmi", "check a.pmi a.pmi", "build b.plc", "bench a.pmi", "xref a.pmi"]
    {
        let done = folder.plcc(&format!("{command} --define SPEED=3")).exits(2);
        done.says(&["--define is for pmac programs"]);
    }
    folder.plcc("check a.pmi --dialect PMI --controller pmac").exits(2);
    // Where programs of several languages are checked, the option is for those that have it.
    folder.plcc("check a.pmi b.plc c.pmc --controller turbo --define A=1").exits(0);
    folder.plcc("check . --controller turbo --define A=1").exits(0);
    folder.plcc("run c.pmc --ticks 1 --controller turbo --define A=1 --keep-going").exits(0);
    folder.plcc("run b.plc --ticks 1 --param 61=1 --const 1=2 --macro 180=1.5").exits(0);
    folder.plcc("run c.pmc --ticks 1 --background-steps 2").exits(0);
}

#[test]
fn retained_memory_survives() {
    let folder = Folder::with(&[("a.pmi", "$END\n@NVINT[1]=@NVINT[1]+1\n")]);
    for total in [3, 6] {
        let done = folder.plcc("run a.pmi --ticks 3 --retain r.bin --watch @NVINT[1] --dump -");
        let done = done.exits(0);
        assert!(done.stdout.contains(&format!("\"@NVINT[1]\":{total}")), "{}", done.stdout);
    }
    folder.plcc("run a.pmi --ticks 3 --retain a.pmi").exits(2);
}

#[test]
fn upper_local_variables_survive_and_pots_are_only_their_first_content() {
    let machine = |tool: u32| format!("[tool_pots]\n0 = {{ tool = {tool}, width = 3 }}\n");
    let first = ":001 I510 LF500 SF010 .1234 SF600 SF499 .5678 SF999 Z J1 :000 J0\n";
    let second = ":001 I510 LF500 SF010 LF600 SF012 LF498 SF014 LF999 SF016 Z J1 :000 J0\n";
    let folder = Folder::with(&[("1.nct", first), ("2.nct", second), ("25.toml", &machine(25))]);
    let run = |program: &str, engine: &str, pots: &str| {
        let what =
            "--ticks 2 --retain r.bin --watch F010,F012,F014,F016,F500 --dump - --trace t.csv";
        folder.plcc(&format!("run {program} {what} --engine {engine} --machine {pots}")).exits(0);
        folder.read("t.csv")
    };
    // The table's first content is tool 25 of width 3; the high byte of F499 is F500.
    let trace = run("1.nct", "jit", "25.toml");
    let lines =
        ["F010,16409", "F012,0", "F014,0", "F016,0", "F500,16402"].map(|l| format!("0,{l}\n"));
    assert_eq!(trace, format!("tick,name,value\n{}", lines.concat()));
    // F500 to F999 are as they were left; F498 and F499 are 0 again, and so is what F999 lacks.
    folder.write("26.toml", machine(26));
    for engine in ["interp", "jit", "aot"] {
        let trace = run("2.nct", engine, "26.toml");
        let lines = ["F010,16402", "F012,4660", "F014,0", "F016,120", "F500,16402"];
        let lines = lines.map(|l| format!("0,{l}\n"));
        assert_eq!(trace, format!("tick,name,value\n{}", lines.concat()), "{engine}");
    }
}

#[test]
fn outputs_do_not_overwrite_what_is_read() {
    let folder = Folder::with(&[("a.pmi", COUNTER), ("s.csv", "tick,name,value\n")]);
    std::fs::hard_link(folder.path().join("a.pmi"), folder.path().join("link.pmi")).unwrap();
    for line in [
        "--trace a.pmi",
        "--dump s.csv --stimulus s.csv",
        "--trace x --dump x",
        "--trace x --image x",
        "--trace link.pmi",
    ] {
        folder.plcc(&format!("run a.pmi --ticks 1 --watch N {line}")).exits(2).says(&["overwrite"]);
    }
    assert_eq!(folder.read("a.pmi"), COUNTER);
}

#[cfg(unix)]
#[test]
fn signals_end_a_run_after_the_dump_is_written() {
    use std::process::{Command, Stdio};
    use std::time::{Duration, Instant};
    // Under `nohup` the end of the terminal is not a reason to end.
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let hears = ignored.is_some_and(|m| u64::from_str_radix(m.trim(), 16).unwrap() & 1 == 0);
    for signal in ["-INT", "-TERM"].into_iter().chain(hears.then_some("-HUP")) {
        let folder = Folder::with(&[("a.pmi", COUNTER)]);
        let args =
            "run a.pmi --realtime --watchdog 1h --period 1 --watch N --trace t.csv --dump d.json";
        let mut command = folder.command(&args.split(' ').collect::<Vec<_>>());
        let mut child = command.stdout(Stdio::null()).spawn().unwrap();
        let start = Instant::now();
        // It listens once it writes.
        while !folder.has("t.csv") || folder.read("t.csv").lines().count() < 3 {
            assert!(start.elapsed() < Duration::from_secs(300), "it does not begin");
            std::thread::sleep(Duration::from_millis(5));
        }
        Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap();
        assert_eq!(child.wait().unwrap().code(), Some(130), "{signal}");
        assert!(folder.read("d.json").contains("\"state\":\"running\""), "{signal}");
    }
}

#[cfg(unix)]
#[test]
fn a_closed_pipe_ends_the_run_without_a_message() {
    use std::process::Stdio;
    let folder = Folder::with(&[("a.pmi", COUNTER)]);
    let run = ["run", "a.pmi", "--ticks", "1000000", "--watch", "N", "--trace", "-"];
    for (args, began) in [
        ([&run[..], &["--dump", "d.json"]].concat(), true),
        (vec!["run", "a.pmi", "--ticks", "3", "--dump", "-"], false),
    ] {
        let mut command = folder.command(&args);
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        drop(child.stdout.take());
        let done = support::Done::of(child.wait_with_output().unwrap());
        assert_eq!((done.status, done.stderr.as_str()), (0, ""), "{args:?}");
        assert_eq!(folder.has("d.json"), began);
        assert!(!began || folder.read("d.json").starts_with("{\"dialect\":\"pmi\",\"ticks\":"));
        let _ = std::fs::remove_file(folder.path().join("d.json"));
    }
}

#[cfg(target_os = "linux")]
#[test]
fn what_the_system_does_not_permit_is_told_in_one_note() {
    let folder = Folder::with(&[("a.pmi", COUNTER)]);
    let run =
        "run a.pmi --ticks 2 --period 1 --realtime --watchdog 1h --overrun catch-up=9 --dump -";
    let done = folder.plcc(run).exits(0);
    // The other note says how long the ticks took.
    let is_note = |line: &&str| line.starts_with("note:") && !line.contains(" ticks took ");
    let notes = done.stderr.lines().filter(is_note).count();
    assert!(notes <= 1, "{}", done.stderr);
    assert!(notes == 0 || done.stderr.contains("`ulimit"), "{}", done.stderr);
    let simulated =
        folder.plcc(&run.replace("--realtime --watchdog 1h --overrun catch-up=9", "")).exits(0);
    assert_eq!(simulated.stderr, "", "asks for nothing");
    assert_eq!(simulated.stdout, done.stdout);
}

#[test]
fn watched_variables_are_printed_where_nothing_else_is() {
    let folder = Folder::with(&[("a.pmi", COUNTER)]);
    let trace = "tick,name,value\n0,N,1\n1,N,2\n";
    let done = folder.plcc("run a.pmi --ticks 2 --watch N").exits(0);
    assert_eq!(done.stdout, trace);
    let done = folder.plcc("run a.pmi --ticks 2 --watch N --events e.jsonl --dump d.json").exits(0);
    assert_eq!(done.stdout, trace);
    let done = folder.plcc("run a.pmi --ticks 2 --watch N --dump -").exits(0);
    assert!(done.stdout.starts_with("{\"dialect\""), "{}", done.stdout);
    let done = folder.plcc("run a.pmi --ticks 2 --watch N --events -").exits(0);
    assert_eq!(done.stdout, "");
    let done = folder.plcc("run a.pmi --ticks 2 --watch N --trace t.csv").exits(0);
    assert_eq!((done.stdout.as_str(), folder.read("t.csv").as_str()), ("", trace));
    let done = folder.plcc("run a.pmi --ticks 2").exits(0);
    assert_eq!(done.stdout, "");
    folder.plcc("build a.pmi").exits(0);
    assert_eq!(folder.plcc("run a.plcx --ticks 2 --watch N").exits(0).stdout, trace);
}

#[test]
fn patterns_watch_the_variables_of_a_dump_in_natural_order() {
    let text = "$LOGICAL\nP10,P2,Q[3],K=1\n$END\nP10=T\nP2=F\nQ[1]=T\n";
    let folder = Folder::with(&[("a.pmi", text), ("c.pmc", PLC1)]);
    let names = |watch: &str| -> Vec<String> {
        let done = folder.run(&["run", "a.pmi", "--ticks", "1", "--watch", watch]).exits(0);
        let names = done.stdout.lines().skip(1).map(|row| row.split(',').nth(1).unwrap().into());
        names.collect()
    };
    assert_eq!(names("P*"), ["P2", "P10"]);
    assert_eq!(names("P?"), ["P2"]);
    assert_eq!(names("*"), ["K", "P2", "P10", "Q"]);
    assert_eq!(names("Q,*"), ["Q", "K", "P2", "P10"], "each once");
    assert_eq!(names("Q[1],Q"), ["Q[1]", "Q"]);
    for (file, watch) in [("a.pmi", "X*"), ("a.pmi", "P2,P???"), ("c.pmc", "M*")] {
        let done = folder.run(&["run", file, "--ticks", "1", "--watch", watch]).exits(2);
        done.says(&["--watch: `", "matches no variable"]);
    }
    let done = folder.run(&["run", "c.pmc", "--ticks", "2", "--watch", "p*"]).exits(0);
    assert_eq!(done.stdout, "tick,name,value\n0,P1,1\n1,P1,2\n");
}

#[test]
fn a_trace_has_the_time_of_its_ticks() {
    let folder = Folder::with(&[("a.pmi", COUNTER), ("c.pmc", PLC1)]);
    let done = folder.plcc("run a.pmi --ticks 2 --watch N --time").exits(0);
    assert_eq!(done.stdout, "tick,ms,name,value\n0,0,N,1\n1,20,N,2\n");
    let done = folder.plcc("run a.pmi --ticks 2 --watch N --time --period 2.5").exits(0);
    assert_eq!(done.stdout, "tick,ms,name,value\n0,0,N,1\n1,2.5,N,2\n");
    let done = folder.plcc("run c.pmc --ticks 3 --watch P1 --time").exits(0);
    let last = done.stdout.lines().last().unwrap().to_owned();
    let [tick, ms, name, value] = last.split(',').collect::<Vec<_>>()[..] else { panic!("{last}") };
    assert_eq!((tick, name, value), ("2", "P1", "3"));
    let ms: f64 = ms.parse().unwrap();
    assert!((0.88..0.89).contains(&ms), "two servo cycles of 0.442 ms: {ms}");
}

#[test]
fn a_trace_that_ends_in_vcd_is_a_value_change_dump() {
    let folder = Folder::with(&[("a.pmi", COUNTER), ("b.plc", SLICES), ("c.pmc", PLC1)]);
    let run = |line: &str| {
        let mut all = vec![];
        for engine in ["interp", "jit", "aot"] {
            folder.plcc(&format!("run {line} --trace t.vcd --engine {engine}")).exits(0);
            all.push(folder.read("t.vcd"));
        }
        assert!(all.windows(2).all(|pair| pair[0] == pair[1]), "{all:?}");
        let (header, changes) = all[0].split_once("$enddefinitions $end\n").unwrap();
        assert!(header.contains("$timescale 1 us $end"), "{header}");
        (header.to_owned(), changes.to_owned())
    };
    let (header, changes) = run("a.pmi --ticks 5 --watch N,OUT");
    assert!(header.contains("$var integer 16 ! N $end"), "{header}");
    assert!(header.contains("$var wire 1 \" OUT $end"), "{header}");
    let expected = "#0\nb1 !\n0\"\n#20000\nb10 !\n#40000\nb11 !\n#60000\nb100 !\n1\"\n\
                    #80000\nb101 !\n#100000\n";
    assert_eq!(changes, expected);
    let (header, _) = run("b.plc --ticks 2 --watch F020,I002");
    assert!(header.contains("wire 16 ! F020 $end"), "{header}");
    assert!(header.contains("wire 1 \" I002 $end"), "{header}");
    let (header, changes) = run("c.pmc --ticks 2 --watch P1");
    assert!(header.contains("$var real 64 ! P1 $end"), "{header}");
    assert!(changes.starts_with("#0\nr1 !\n#442\nr2 !\n"), "{changes}");
}

#[test]
fn groups_of_lines_and_words_have_their_own_widths_in_waveforms() {
    let pmi = "$INPUT\nTPOS = 0/4-7/BCD\nTEMP = 1/0-7/TWOC\n$OUTPUT\nOUT = 2/0-7/B\n$INTEGER\nN, LIST[2]\n$LONG\nL\n\
               $END\nN = -2\nL = -3\nOUT = TPOS\nLIST[1] = TEMP\n";
    let pmac = "M9->Y:$FFC2,8,8\nM8->Y:$FFC2,0\nM10->Y:$FFC2,16,8,S\nI5=2\nOPEN PLC 1 CLEAR\nM9=P1\nM10=0-2\nCLOSE\n";
    let nct = ":001\nI001 UF0203 Z\nLF020 SRH050\nJ1\n:000\nJ0\n";
    let folder = Folder::with(&[
        ("a.pmi", pmi),
        ("a.csv", "tick,name,value\n1,TPOS,7\n1,TEMP,-5\n"),
        ("b.pmc", pmac),
        ("b.csv", "tick,name,value\n1,P1,200\n1,M8,1\n"),
        ("c.nct", nct),
        ("c.csv", "tick,name,value\n1,I001,1\n2,Y01,40000\n"),
    ]);
    for (line, declared, values) in [
        (
            "a.pmi --stimulus a.csv",
            [
                "wire 4 ! TPOS",
                "integer 8 \" TEMP",
                "integer 16 # OUT",
                "integer 16 $ N",
                "integer 32 % L",
                "integer 16 ' LIST[1]",
            ],
            [
                "b111 !",
                "b11111011 \"",
                "b111 #",
                "b1111111111111110 $",
                "b11111111111111111111111111111101 %",
                "b1111111111111011 '",
            ],
        ),
        (
            "b.pmc --stimulus b.csv",
            ["wire 8 ! M9", "wire 1 \" M8", "integer 8 # M10", "real 64 $ P1", "real 64", "wire 1"],
            ["b11001000 !", "1\"", "b11111110 #", "r200 $", "b0 !", "0\""],
        ),
        (
            "c.nct --stimulus c.csv",
            [
                "wire 16 ! F020",
                "wire 1 \" F0203",
                "wire 16 # RH050",
                "wire 16 $ Y01",
                "wire 16",
                "wire 1",
            ],
            ["b1000 !", "1\"", "b1000 #", "b1001110001000000 $", "b0 !", "0\""],
        ),
    ] {
        let names = match line.get(..1) {
            Some("a") => "TPOS,TEMP,OUT,N,L,LIST",
            Some("b") => "M9,M8,M10,P1",
            _ => "F020,F0203,RH050,Y01",
        };
        folder
            .plcc(&format!("run {line} --ticks 4 --watch {names} --trace t.vcd --record r.plcrec"))
            .exits(0);
        folder.plcc(&format!("convert r.plcrec --to vcd --watch {names} -o r.vcd")).exits(0);
        for vcd in [folder.read("t.vcd"), folder.read("r.vcd")] {
            for part in declared {
                assert!(vcd.contains(&format!("$var {part}")), "{part} is not in\n{vcd}");
            }
            for value in values {
                assert!(vcd.lines().any(|line| line == value), "{value} is not in\n{vcd}");
            }
        }
    }
}
