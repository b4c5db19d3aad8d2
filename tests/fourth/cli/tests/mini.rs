//! Everything that users do with a program, done with one in MINI, the language that `tests/fourth` adds.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, clippy::panic, clippy::indexing_slicing)]

mod support;

use std::path::Path;
use std::process::Command;

use serde_json::json;
use support::debug_client::Client;
use support::terminal::Terminal;
use support::{Done, Folder};

const LAMP: &str = "; A lamp, and how often it came on.\nINPUT START\nINPUT DOOR\nOUTPUT LAMP\nNUMBER TIMES\n\
                    NUMBER LEFT\nLAMP = START & /DOOR\nIF LAMP & /LEFT\nCOUNT TIMES\nEND\nLEFT = LAMP\n";
const STIMULUS: &str = "tick,name,value\n2,START,1\n4,DOOR,1\n6,DOOR,0\n";
const TRACE: &str = "tick,name,value\n0,LAMP,0\n0,TIMES,0\n2,LAMP,1\n2,TIMES,1\n4,LAMP,0\n6,LAMP,1\n6,TIMES,2\n";

fn folder() -> Folder {
    Folder::with(&[("lamp.mini", LAMP), ("s.csv", STIMULUS)])
}

/// Runs `plcrt`, which lies beside `plcc`.
fn plcrt(folder: &Folder, line: &str) -> Done {
    let plcrt = Path::new(env!("CARGO_BIN_EXE_plcc")).with_file_name("plcrt");
    let mut command = Command::new(plcrt);
    Done::of(command.args(line.split_whitespace()).current_dir(folder.path()).output().unwrap())
}

#[test]
fn it_is_checked_and_explained() {
    let folder = folder();
    folder.plcc("check lamp.mini").exits(0);
    folder.write("wrong.mini", "OUTPUT LAMP\nLAMP = STRAT\nIF LAMP\n");
    let done = folder.plcc("check wrong.mini").exits(1);
    for part in ["MINI-2", "`STRAT`", "MINI-3"] {
        assert!(done.stderr.contains(part), "{}", done.stderr);
    }
    let explained = folder.plcc("explain COUNT").exits(0);
    assert!(explained.stdout.contains("adds 1"), "{}", explained.stdout);
    assert!(folder.plcc("explain MINI-3").exits(0).stdout.contains("do not match"));
    let uses = folder.plcc("xref lamp.mini").exits(0);
    assert!(uses.stdout.contains("TIMES"), "{}", uses.stdout);
}

#[test]
fn it_says_why_a_lamp_is_off() {
    let folder = folder();
    let why = folder.plcc("why lamp.mini LAMP --stimulus s.csv --ticks 6").exits(0).stdout;
    assert!(why.starts_with("LAMP has been 0 since tick 4 (0.04 s), because DOOR is 1.\n"), "{why}");
    assert!(why.contains("The next scan would make LAMP 1 with DOOR = 0."), "{why}");
}

#[test]
fn every_engine_at_every_level_gives_the_same_trace() {
    let folder = folder();
    for engine in ["interp", "jit", "aot"] {
        for level in ["none", "speed"] {
            let line = format!(
                "run lamp.mini --engine {engine} --opt {level} --ticks 8 --stimulus s.csv --watch LAMP,TIMES"
            );
            assert_eq!(folder.plcc(&line).exits(0).stdout, TRACE, "{engine} {level}");
        }
    }
    folder.plcc("build lamp.mini -o lamp.plcx").exits(0);
    let run = plcrt(&folder, "lamp.plcx --ticks 8 --stimulus s.csv --watch LAMP,TIMES").exits(0);
    assert_eq!(run.stdout, TRACE);
}

#[test]
fn records_are_replayed_in_every_engine() {
    let folder = folder();
    let run = "run lamp.mini --ticks 8 --stimulus s.csv --record r.plcrec --watch LAMP,TIMES";
    assert_eq!(folder.plcc(run).exits(0).stdout, TRACE);
    for engine in ["interp", "jit", "aot"] {
        let done = folder.plcc(&format!("replay r.plcrec --engine {engine} --watch LAMP,TIMES"));
        let done = done.exits(0);
        assert_eq!(done.stdout, TRACE, "{engine}");
        assert!(done.stderr.contains("went as they were recorded"), "{}", done.stderr);
    }
}

#[test]
fn the_debugger_steps_back_and_finds_who_wrote() {
    let folder = folder();
    let at = |reason: &str, tick: u64, line: u64| (reason.to_owned(), tick, line);
    let mut client = Client::launch(
        json!({
            "program": folder.path().join("lamp.mini"),
            "ticks": 8,
            "stimulus": folder.path().join("s.csv"),
        }),
        json!([{"line": 9, "condition": "TIMES + 1 - 1"}]),
    );
    assert_eq!(client.stopped(), at("breakpoint", 6, 9));
    assert_eq!(client.accesses(), ["TIMES (read)=1", "TIMES (written)=1 → 2"]);
    assert_eq!(client.scope("Outputs"), ["LAMP=1"]);
    assert_eq!(client.scope("Numbers"), ["LEFT=0", "TIMES=1"]);
    assert_eq!(client.go("stepBack", json!({})), at("step", 6, 8));
    assert_eq!(client.go("plcc/lastWriter", json!({"name": "TIMES"})), at("goto", 2, 9));
    client.leave();
}

#[test]
fn the_monitor_shows_statements_inputs_and_outputs() {
    let folder = folder();
    let mut monitor = folder.command(&["monitor", "lamp.mini", "--stimulus", "s.csv"]);
    let mut shown = Terminal::open(monitor.env("XDG_STATE_HOME", folder.path()));
    shown.wait_for("lamp.mini (MINI)");
    shown.wait_for("COUNT");
    shown.press("3");
    shown.wait_for("Outputs");
    shown.wait_for("line 2");
    shown.press("q");
    assert_eq!(shown.end(), (0, true));
}

#[test]
fn wiring_is_checked_and_the_image_file_shows_the_outputs() {
    let folder = folder();
    folder.plcc("build lamp.mini -o lamp.plcx").exits(0);
    let listed = folder.plcc("io lamp.mini").exits(0);
    for name in ["START", "DOOR", "LAMP"] {
        assert!(listed.stdout.contains(&format!("name = \"{name}\"")), "{}", listed.stdout);
    }
    let configuration = |name: &str| {
        format!(
            "artifact = \"lamp.plcx\"\nimage = \"image\"\n\
             [[io]]\nname = \"{name}\"\ndriver = \"other\"\nsafe = 0\n\
             [[io]]\nname = \"LAMP\"\ndriver = \"other\"\n"
        )
    };
    folder.write("wrong.toml", configuration("STRAT"));
    let refused = plcrt(&folder, "--check-config wrong.toml");
    assert_ne!(refused.status, 0);
    assert!(refused.stderr.contains("STRAT"), "{}", refused.stderr);
    folder.write("c.toml", configuration("DOOR"));
    plcrt(&folder, "--check-config c.toml").exits(0);
    plcrt(&folder, "--config c.toml --ticks 8 --stimulus s.csv").exits(0);
    let image = plcc_image::ImageReader::open(&folder.path().join("image")).unwrap();
    let symbols = image.symbols();
    let lamp = symbols.iter().find(|symbol| symbol.name == "LAMP").unwrap();
    assert_eq!(image.read().unwrap().output(lamp).unwrap(), plcc_image::Number::Int(1));
}
