//! The other commands, help, and wrong usage.

#![allow(clippy::unwrap_used, clippy::indexing_slicing)]

mod support;

use support::{BROKEN, COUNTER, Folder, PLC1, SLICES, STOPS};

const COMMANDS: [&str; 9] =
    ["check", "build", "run", "bench", "explain", "why", "xref", "completions", "man"];

#[test]
fn help_says_what_each_command_does() {
    let folder = Folder::with(&[]);
    let all = folder.plcc("--help").exits(0).stdout;
    assert!(all.contains("Exit status") && all.contains("Examples:"), "{all}");
    for command in COMMANDS {
        assert!(all.contains(&format!("  {command} ")), "{command} is not in\n{all}");
        let help = folder.plcc(&format!("help {command}")).exits(0).stdout;
        assert_eq!(help, folder.plcc(&format!("{command} --help")).exits(0).stdout);
        assert!(help.contains("Example"), "{help}");
        assert!(help.contains(&format!("plcc {command}")), "{help}");
    }
    let version = folder.plcc("--version").exits(0).stdout;
    assert_eq!(version, format!("plcc {}\n", env!("CARGO_PKG_VERSION")));
}

/// Whether a help text has a line for an option: `-o, --output <OUT>`, `--json`.
fn has_option(help: &str, option: &str) -> bool {
    let begins = |text: &str| {
        let behind = text.strip_prefix(option);
        behind.is_some_and(|rest| rest.is_empty() || rest.starts_with([' ', ',']))
    };
    help.lines().any(|line| {
        let line = line.trim_start();
        begins(line) || line.split_once(", ").is_some_and(|(_, long)| begins(long))
    })
}

#[test]
fn an_option_is_a_line_of_its_own() {
    let help = "  -o, --output <OUT>  Where to\n      --json  As -x says, see --other\n";
    for option in ["-o", "--output", "--json"] {
        assert!(has_option(help, option), "{option}");
    }
    for option in ["--out", "-x", "--other", "--jso", "-"] {
        assert!(!has_option(help, option), "{option}");
    }
}

#[test]
fn every_documented_option_exists() {
    let folder = Folder::with(&[]);
    let source = ["--dialect", "--limits", "--define", "--controller", "--machine", "-I"];
    let control = ["--period", "--param", "--const", "--macro", "--control"];
    let run = ["--engine", "--ticks", "--for", "--realtime", "--opt", "--stimulus", "--watch"];
    let more = [
        "--trace",
        "--time",
        "--events",
        "--dump",
        "--retain",
        "--keep-going",
        "--level0-safepoints",
    ];
    let build = ["--emit", "--target", "--opt", "-o"];
    let bench = ["--stimulus", "--ticks", "--json"];
    for (command, options) in [
        ("check", vec![&source[..], &["--message-format", "--no-machine"]]),
        ("build", vec![&source, &build, &["--message-format"]]),
        ("run", vec![&source, &control, &run, &more, &["--background-steps"]]),
        ("bench", vec![&source, &control, &bench]),
        ("xref", vec![&source]),
    ] {
        let help = folder.plcc(&format!("help {command}")).exits(0).stdout;
        for option in options.into_iter().flatten() {
            assert!(has_option(&help, option), "{command} {option}\n{help}");
        }
    }
}

#[test]
fn wrong_usage_is_status_2() {
    let folder = Folder::with(&[("a.pmi", COUNTER), ("b.plc", SLICES)]);
    for (line, part) in [
        ("", "Usage"),
        ("chekc a.pmi", "check"),
        ("check", "FILE"),
        ("check a.pmi --nothing", "--nothing"),
        ("check none.pmi", "none.pmi"),
        ("check a.pmi --dialect gcode", "gcode"),
        ("check a.pmi --define =1", "NAME=VALUE"),
        ("build", "FILE"),
        ("build .", "folder"),
        ("build a.pmi --emit exe", "exe"),
        ("build a.pmi --opt fast", "fast"),
        ("run", "FILE"),
        ("run a.pmi --ticks x", "whole number of ticks"),
        ("run a.pmi --for 5", "ms"),
        ("run a.pmi --ticks 1 --engine gcc", "gcc"),
        ("run b.plc --ticks 1 --const 41=1", "not a number from 1 to 40"),
        ("run b.plc --ticks 1 --control nct1", "nct104"),
        ("bench a.pmi --ticks 0", "0 is not in"),
        ("xref", "FILE"),
        ("xref a.pmi b.plc", "--dialect"),
        ("explain", "CODE"),
        ("explain PMX-31", "PMI-31"),
        ("explain --list PMI-31", "--list"),
        ("explain --search xyzzy", "xyzzy"),
        ("check a.pmi --machine m.toml --no-machine", "--no-machine"),
        ("completions tcsh", "tcsh"),
    ] {
        folder.plcc(line).exits(2).says(&[part]);
    }
}

#[cfg(feature = "web")]
#[test]
fn what_the_monitor_can_not_show_is_said_in_words() {
    let folder = Folder::with(&[]);
    folder.plcc("monitor none.sock --web").exits(2).says(&["none.sock: there is no such file"]);
    folder.plcc("monitor a.pmi --web=80").exits(2).says(&["ADDRESS:PORT is expected, as in"]);
}

#[test]
fn explain_knows_codes_and_variables_in_any_case() {
    let folder = Folder::with(&[]);
    for (what, parts) in [
        ("PMI-31", vec!["PMI-31: "]),
        ("nct-63", vec!["NCT-63: "]),
        ("ERR003", vec!["PMAC-3: "]),
        ("pmi-x1", vec!["PMI-X1: "]),
        ("@fro", vec!["PMI: @FRO", "INTEGER"]),
        ("@CP107", vec!["@CP100 to @CP115"]),
        ("i510", vec!["NCT: I510", "PMAC: I510"]),
        ("M145", vec!["PMAC: M145"]),
        ("PMI-1 NCT-1", vec!["PMI-1: ", "NCT-1: "]),
        ("ixx22 m11..12", vec!["PMAC: Ix22", "M12->Y:$FFC2,1,1: machine input 2"]),
        ("I900", vec!["encoder 1", "motor 9"]),
        ("I5111 --controller turbo", vec!["PLC timer 1"]),
        ("547", vec!["no error has the number 547", "NCT: I547", "NCT: Y547", "FIN"]),
    ] {
        let text = folder.plcc(&format!("explain {what}")).exits(0).stdout;
        for part in parts {
            assert!(text.contains(part), "`{part}` is not in\n{text}");
        }
    }
    let text = folder.plcc("explain I510 --dialect nct").exits(0).stdout;
    assert!(!text.contains("PMAC"), "{text}");
    let text = folder.plcc("explain I900 --controller turbo").exits(0).stdout;
    assert!(text.contains("motor 9") && !text.contains("encoder"), "{text}");
    assert!(!text.contains("NCT"), "{text}");
    folder.plcc("explain I5111 --controller pmac").exits(2).says(&["`I5111`"]);
    folder.plcc("explain 99999").exits(2).says(&["PMI has 1 to 47, NCT has 1 to 76"]);
    let done = folder.plcc("explain PMI-1 NONSENSE").exits(2).says(&["`NONSENSE`"]);
    assert!(done.stdout.contains("PMI-1: "));
}

#[test]
fn every_code_has_a_page() {
    let folder = Folder::with(&[]);
    for (prefix, last) in [("PMI", 47), ("NCT", 76), ("PMAC", 17)] {
        let codes: Vec<String> = (1..=last).map(|n| format!("{prefix}-{n}")).collect();
        // The manual leaves these out.
        let gaps = ["PMI-26", "PMI-27", "PMI-33"];
        let codes: Vec<String> = codes.into_iter().filter(|c| !gaps.contains(&&**c)).collect();
        let line = format!("explain {}", codes.join(" "));
        let done = folder.plcc(&line).exits(0);
        for code in &codes {
            assert!(done.stdout.contains(&format!("{code}: ")), "{code} is not explained");
        }
    }
}

#[test]
fn xref_lists_reads_writes_and_tests() {
    let folder = Folder::with(&[("a.plc", SLICES), ("b.plc", ":000\nXX\n")]);
    let done = folder.plcc("xref a.plc").exits(0);
    assert!(done.stdout.contains("F020"), "{}", done.stdout);
    let done = folder.plcc("xref a.plc --message-format json").exits(0);
    let row = done.json().into_iter().find(|row| row["name"] == "F020").unwrap();
    assert_eq!(row["read"], serde_json::json!([4]));
    assert_eq!(row["written"], serde_json::json!([6]));
    folder.plcc("xref b.plc").exits(1);
}

#[test]
fn every_language_has_a_cross_reference() {
    let pmi =
        "$INCLUDE D.PMI\n$FAULT\nHOT=\"N IS\", N\n$END\nIF (G>2)\nA[N]=G+@FRO\nENDIF\nHOT=F\n";
    let pmac =
        "M1->Y:$FFC2,8\nI5=2\nP3..4=0\nOPEN PLC 1 CLEAR\nIF (M1=1)\nP(P1)=P2\nENDIF\nCLOSE\n";
    let folder = Folder::with(&[
        ("a.pmi", pmi),
        ("d.pmi", "$INTEGER\nN,G,A[5]\n"),
        ("c.pmc", pmac),
        ("e.pmc", "OPEN PLC 2 CLEAR\nP2=P2+1\nCLOSE\n"),
    ]);
    let rows = |line: &str| -> Vec<(String, String, String)> {
        let done = folder.plcc(&format!("xref {line} --message-format json")).exits(0);
        let rows = done.json().into_iter().filter(|row| row["name"].is_string());
        let lines = |row: &serde_json::Value| {
            format!("w{} r{} t{}", row["written"], row["read"], row["tested"])
        };
        let text = |value: &serde_json::Value| value.as_str().unwrap().to_owned();
        rows.map(|row| (text(&row["name"]), text(&row["file"]), lines(&row))).collect()
    };
    let row = |name: &str, file: &str, lines: &str| (name.into(), file.into(), lines.into());
    assert_eq!(
        rows("a.pmi"),
        [
            row("@FRO", "a.pmi", "w[] r[6] t[]"),
            row("A", "a.pmi", "w[6] r[] t[]"),
            row("G", "a.pmi", "w[] r[6] t[5]"),
            row("HOT", "a.pmi", "w[8] r[] t[]"),
            row("N", "a.pmi", "w[] r[3,6] t[]"),
        ]
    );
    assert_eq!(
        rows("c.pmc e.pmc"),
        [
            row("I5", "c.pmc", "w[2] r[] t[]"),
            row("M1", "c.pmc", "w[] r[] t[5]"),
            row("P(…)", "c.pmc", "w[6] r[] t[]"),
            row("P1", "c.pmc", "w[] r[6] t[]"),
            row("P2", "c.pmc", "w[] r[6] t[]"),
            row("P2", "e.pmc", "w[2] r[2] t[]"),
            row("P3", "c.pmc", "w[3] r[] t[]"),
            row("P4", "c.pmc", "w[3] r[] t[]"),
        ]
    );
    let table = folder.plcc("xref c.pmc e.pmc").exits(0).stdout;
    assert!(table.starts_with("name"), "{table}");
    assert!(table.contains("P2 e.pmc"), "several files: each row has its own\n{table}");
    assert!(table.contains("machine output 1") && table.contains("which PLCs run"), "{table}");
    let table = folder.plcc("xref a.pmi").exits(0).stdout;
    assert!(table.contains("feed") || table.contains("Feed"), "what @FRO means\n{table}");
}

#[test]
fn bench_prints_the_documented_json() {
    let folder = Folder::with(&[("a.pmi", COUNTER), ("b.plc", SLICES), ("c.pmc", PLC1)]);
    folder.write("s.csv", "tick,name,value\n0,N,1\n9,N,5\n");
    for (line, dialect, entry) in [
        ("a.pmi --stimulus s.csv", "pmi", "scan"),
        ("b.plc", "nct", ":001"),
        ("c.pmc", "pmac", "PLC1"),
    ] {
        let done = folder.plcc(&format!("bench {line} --ticks 200 --json")).exits(0);
        let start = format!(
            "{{\"file\":\"{}\",\"dialect\":\"{dialect}\",\"scans\":200,\"entries\":{{",
            line.split(' ').next().unwrap()
        );
        assert!(done.stdout.starts_with(&start), "{}", done.stdout);
        let all = &done.json()[0];
        for engine in ["interp", "jit", "aot"] {
            for figure in ["min", "median", "p99"] {
                assert!(all["entries"][entry][engine][figure].is_u64(), "{all}");
                for of in ["ns_per_scan", "ns_per_tick"] {
                    assert!(all["engines"][engine][of][figure].is_u64(), "{all}");
                }
            }
        }
        for engine in ["jit", "aot"] {
            assert!(all["compile_ms"][engine].as_f64().unwrap() > 0.0, "{all}");
            assert!(all["code_bytes"][engine].as_u64().unwrap() > 0, "{all}");
        }
        let table = folder.plcc(&format!("bench {line} --scans 100")).exits(0).stdout;
        assert!(table.contains("median") && table.contains(entry), "{table}");
    }
}

#[test]
fn developers_choose_passes() {
    let folder = Folder::with(&[("c.pmc", PLC1)]);
    let done = folder.plcc("dev build c.pmc --time-passes --passes=-gates").exits(0);
    done.says(&["fold", " ms"]);
    folder.plcc("dev run c.pmc --ticks 1 --passes=-gates,-narrow").exits(0);
    folder.plcc("dev bench c.pmc --ticks 10 --passes=-gates --message-format json").exits(0);
    folder.plcc("dev build c.pmc --passes=-nothing").exits(2).says(&["nothing"]);
    // They are not options of users' commands.
    folder.plcc("build c.pmc --passes=-gates").exits(2);
    assert!(!folder.plcc("help build").exits(0).stdout.contains("passes"));
}

#[test]
fn bench_has_the_exit_status_of_a_run() {
    let folder = Folder::with(&[("a.pmi", STOPS), ("b.pmi", BROKEN), ("s.csv", "nothing")]);
    folder.plcc("bench a.pmi --ticks 100 --json").exits(3).says(&["NO PMI DATA"]);
    folder.plcc("bench b.pmi").exits(1).says(&["[PMI-31]"]);
    folder.plcc("bench none.pmi").exits(2);
    folder.plcc("bench a.pmi --stimulus s.csv").exits(2).says(&["s.csv"]);
}

#[test]
fn completions_name_the_commands() {
    let folder = Folder::with(&[]);
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let script = folder.plcc(&format!("completions {shell}")).exits(0).stdout;
        for word in ["explain-arithmetic", "level0-safepoints", "scans", "xref", "completions"] {
            assert!(script.contains(word), "{shell} {word}");
        }
    }
}

#[test]
fn keywords_and_words_of_memory_are_explained() {
    let folder = Folder::with(&[]);
    for (what, parts) in [
        ("$timer", vec!["PMI: $TIMER", "20 ms", "PMI manual 3.1.9"]),
        ("GF", vec!["NCT: GF", "F0080"]),
        ("while", vec!["PMAC: WHILE", "appendix D"]),
        ("ENDW", vec!["PMAC: ENDWHILE, ENDW"]),
        ("if", vec!["PMI: IF", "PMAC: IF"]),
        ("Y:$FFC2", vec!["inputs and outputs", "M1->Y:$FFC2,8,1: machine output 1"]),
        ("X:$0700", vec!["a timer"]),
    ] {
        let text = folder.plcc(&format!("explain {what}")).exits(0).stdout;
        for part in parts {
            assert!(text.contains(part), "`{part}` is not in\n{text}");
        }
    }
    let text = folder.plcc("explain IF --dialect pmi").exits(0).stdout;
    assert!(!text.contains("PMAC"), "{text}");
    folder.plcc("explain WHIEL").exits(2).says(&["`WHILE`", "--search"]);
}

#[test]
fn what_can_be_explained_is_listed_and_searched() {
    let folder = Folder::with(&[]);
    let list = folder.plcc("explain --list").exits(0).stdout;
    let pmi = folder.plcc("explain --list --dialect pmi").exits(0).stdout;
    for line in ["PMI-31: ", "PMI @FRO: ", "PMI $TIMER: "] {
        assert!(pmi.lines().any(|l| l.starts_with(line)), "{line} is not in\n{pmi}");
    }
    assert!(pmi.lines().all(|line| line.starts_with("PMI")), "{pmi}");
    for line in ["NCT-63: ", "NCT I510: ", "NCT GF: ", "PMAC-3: ", "PMAC I5: ", "PMAC M145: "] {
        assert!(list.lines().any(|l| l.starts_with(line)), "{line} is not in the list");
    }
    assert!(list.contains(&pmi));
    let found = folder.plcc("explain --search JOG speed --dialect pmac").exits(0).stdout;
    assert!(found.contains("Ix22"), "{found}");
    for line in found.lines() {
        let line = line.to_lowercase();
        assert!(line.contains("jog") && line.contains("speed"), "{line}");
    }
    // What is listed is explained.
    let names: Vec<&str> =
        pmi.lines().filter_map(|line| line.strip_prefix("PMI ")?.split(": ").next()).collect();
    assert!(names.len() > 100);
    folder.plcc(&format!("explain {}", names.join(" "))).exits(0);
}

#[test]
fn manual_pages_are_written_for_every_command() {
    let folder = Folder::with(&[]);
    let page = folder.plcc("man").exits(0).stdout;
    assert!(page.contains(".TH plcc 1") && page.contains("Exit status"), "{page}");
    folder.plcc("man --dir m/man1").exits(0);
    assert_eq!(folder.read("m/man1/plcc.1"), page);
    for command in COMMANDS {
        let page = folder.read(&format!("m/man1/plcc-{command}.1"));
        assert!(page.contains(&format!("plcc {command}")), "{page}");
    }
    folder.write("file", "");
    folder.plcc("man --dir file/man1").exits(2).says(&["file/man1"]);
}
