//! `plcc debug` over its standard input and output, as an editor talks to it.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing)]

mod support;

use std::process::{Command, Stdio};

use serde_json::{Value, json};
use support::Folder;
use support::debug_client::Client;

fn at(reason: &str, tick: u64, line: u64) -> (String, u64, u64) {
    (reason.to_owned(), tick, line)
}

/// Counts to 5 in lines 6 to 12; LAMP is on from 3 on.
const PMI: &str = "$OUTPUT\nLAMP=1/0\n$INTEGER\nN,A[3]\n$END\nN=N+1\nIF (N>2)\nLAMP=T\nENDIF\n\
                   IF (N=5)\nA[1]=N\nENDIF\n";

#[test]
fn pmi_breaks_steps_back_over_scans_and_finds_the_last_writer() {
    let folder = Folder::with(&[("count.pmi", PMI)]);
    let path = folder.path().join("count.pmi");
    let mut client = Client::launch(
        json!({"program": path, "ticks": 50}),
        json!([{"line": 6, "condition": "N=3"}, {"line": 11}]),
    );
    // Before the statement N is still 3, which it became in tick 2.
    assert_eq!(client.stopped(), at("breakpoint", 3, 6));
    assert_eq!(client.value("N"), "3");
    assert_eq!(client.value("N*2 > 5"), "1");
    assert_eq!(client.accesses(), ["N (read)=3", "N (written)=3 → 4"]);
    assert_eq!(client.scope("Outputs"), ["LAMP=1"]);
    // It was switched on in the scan before, when N had become 3.
    let why = client.ask("evaluate", json!({"expression": "why LAMP", "context": "repl"}));
    let why = why["result"].as_str().unwrap();
    assert!(why.starts_with("LAMP has been 1 since tick 2 (0.04 s), because N is 3.\n"), "{why}");
    let reason = client.refused("evaluate", json!({"expression": "why L", "context": "repl"}));
    assert!(reason.contains("no variable named `L`"), "{reason}");
    // An editor that asks for values by itself shows no notice of what has none.
    let answer = client.answer("evaluate", json!({"expression": "L", "context": "hover"}));
    assert_eq!(answer["body"]["error"]["showUser"], false, "{answer}");
    assert_eq!(client.go("stepBack", json!({})), at("step", 2, 10));
    assert_eq!(client.go("plcc/scanBack", json!({})), at("step", 1, 6));
    assert_eq!(client.value("N"), "1");
    assert_eq!(client.value("LAMP"), "0");
    assert_eq!(client.go("next", json!({})), at("step", 1, 7));
    assert_eq!(client.value("N"), "2");
    // The condition is false: the body is left out.
    assert_eq!(client.go("stepIn", json!({})), at("step", 1, 10));
    assert_eq!(client.go("continue", json!({})), at("breakpoint", 3, 6));
    assert_eq!(client.go("continue", json!({})), at("breakpoint", 4, 11));
    assert_eq!(client.go("plcc/lastWriter", json!({"name": "LAMP"})), at("goto", 4, 8));
    assert_eq!(client.go("plcc/lastWriter", json!({"name": "LAMP"})), at("goto", 3, 8));
    assert_eq!(client.go("plcc/lastWriter", json!({"name": "LAMP"})), at("goto", 2, 8));
    assert_eq!(client.accesses(), ["LAMP (written)=0 → 1"]);
    let reason = client.refused("plcc/lastWriter", json!({"name": "LAMP"}));
    assert_eq!(reason, "nothing has written LAMP since tick 0");
    assert_eq!(client.go("plcc/goToTick", json!({"tick": 9})), at("step", 9, 6));
    assert_eq!(client.go("plcc/lastChange", json!({"name": "LAMP"})), at("goto", 2, 8));
    assert_eq!(client.go("plcc/goToTick", json!({"tick": 2})), at("step", 2, 6));
    assert_eq!(client.go("continue", json!({})), at("breakpoint", 3, 6));
    assert_eq!(client.go("reverseContinue", json!({})), at("pause", 0, 6));
    // Arrays are unfolded.
    assert_eq!(client.go("plcc/goToTick", json!({"tick": 10})), at("step", 10, 6));
    let scopes = client.ask("scopes", json!({"frameId": 1}));
    let scopes = scopes["scopes"].as_array().unwrap();
    let integers = scopes.iter().find(|scope| scope["name"] == "Integer variables").unwrap();
    let body =
        client.ask("variables", json!({"variablesReference": integers["variablesReference"]}));
    assert_eq!(body["variables"][0]["name"], "A");
    let elements = client.unfold(&body["variables"][0]["variablesReference"]);
    assert_eq!(elements, ["A[0]=0", "A[1]=5", "A[2]=0"]);
    let parts = client.unfold(&body["variables"][1]["variablesReference"]);
    assert_eq!(parts, ["hex=000Ah", "bits=0000 0000 0000 1010"]);
    client.leave();
}

#[test]
fn conditions_and_watches_take_the_names_that_people_gave() {
    let names = "[names]\nN = { alias = \"COUNTER\" }\nA = { alias = \"LIST\" }\nLAMP = { alias = \"SIGNAL\" }\n";
    let folder = Folder::with(&[("count.pmi", PMI), ("count.machine.toml", names)]);
    let path = folder.path().join("count.pmi");
    let mut client = Client::launch(
        json!({"program": path, "ticks": 50}),
        json!([{"line": 6, "condition": "counter=3&/SIGNAL!COUNTER=7"}]),
    );
    assert_eq!(client.stopped(), at("breakpoint", 7, 6));
    assert_eq!(client.value("COUNTER*2 > 5 & LIST[1]=5"), "1");
    assert_eq!(client.value("LIST"), "[0,5,0]");
    assert_eq!(client.go("plcc/lastWriter", json!({"name": "signal"})), at("goto", 6, 8));
    client.leave();
}

#[test]
fn data_breakpoints_hit_counts_and_logpoints() {
    let folder = Folder::with(&[("count.pmi", PMI)]);
    let path = folder.path().join("count.pmi");
    let mut client = Client::launch(
        json!({"program": path, "ticks": 50, "stopOnEntry": true}),
        json!([{"line": 6, "hitCondition": "%10"}, {"line": 7, "logMessage": "N is {N}, half {N/2}"}]),
    );
    assert_eq!(client.stopped(), at("entry", 0, 6));
    let info = client.ask("dataBreakpointInfo", json!({"name": "LAMP"}));
    let set =
        client.ask("setDataBreakpoints", json!({"breakpoints": [{"dataId": info["dataId"]}]}));
    assert_eq!(set["breakpoints"][0]["verified"], true);
    assert_eq!(client.go("continue", json!({})), at("data breakpoint", 2, 8));
    let output = client.event("output");
    assert_eq!(output["output"], "N is 1, half 0\n");
    // Line 6 was met in ticks 1 and 2; where the user stood in tick 0 does not count.
    assert_eq!(client.go("continue", json!({})), at("breakpoint", 10, 6));
    assert_eq!(client.go("reverseContinue", json!({})).0, "data breakpoint");
    client.leave();
}

#[test]
fn a_program_that_is_stopped_shows_the_statement_to_blame() {
    let folder = Folder::with(&[("stops.pmi", support::STOPS)]);
    let path = folder.path().join("stops.pmi");
    let mut client = Client::launch(json!({"program": path}), json!([]));
    client.ask("setExceptionBreakpoints", json!({"filters": ["stop"]}));
    assert_eq!(client.stopped(), at("exception", 3, 4));
    let info = client.ask("exceptionInfo", json!({"threadId": 1}));
    assert!(info["description"].as_str().unwrap().contains("A[3]"), "{info}");
    assert_eq!(client.go("plcc/lastWriter", json!({"name": "N"})), at("goto", 2, 5));
    assert_eq!(client.accesses(), ["N (read)=2", "N (written)=2 → 3"]);
    client.leave();
}

#[test]
fn values_are_set_once_and_forces_hold() {
    let text = "$INPUT\nKEY=0/0\n$OUTPUT\nLAMP=1/0\n$INTEGER\nN\n$END\nN=N+1\nLAMP=KEY\n";
    let folder = Folder::with(&[("key.pmi", text)]);
    let path = folder.path().join("key.pmi");
    let mut client =
        Client::launch(json!({"program": path, "ticks": 50, "stopOnEntry": true}), json!([]));
    assert_eq!(client.stopped(), at("entry", 0, 8));
    let scopes = client.ask("scopes", json!({"frameId": 1}));
    let reference = scopes["scopes"][2]["variablesReference"].clone();
    let set = json!({"variablesReference": reference, "name": "N", "value": "100"});
    assert_eq!(client.ask("setVariable", set)["value"], "100");
    assert_eq!(client.go("next", json!({})), at("step", 0, 9));
    assert_eq!(client.value("N"), "101");
    let repl = |text: &str| json!({"expression": text, "context": "repl"});
    let told = client.ask("evaluate", repl("force KEY=1"));
    assert_eq!(told["result"], "KEY is forced to 1 from tick 1 on");
    assert_eq!(client.go("plcc/goToTick", json!({"tick": 20})), at("step", 20, 8));
    assert_eq!((client.value("KEY"), client.value("LAMP")), ("1".into(), "1".into()));
    let told = client.refused("evaluate", repl("set KEY=0"));
    assert!(told.contains("`KEY` is forced, so that setting it would do nothing"), "{told}");
    client.ask("evaluate", repl("unforce KEY"));
    assert_eq!(client.go("plcc/goToTick", json!({"tick": 25})), at("step", 25, 8));
    assert_eq!((client.value("KEY"), client.value("LAMP")), ("0".into(), "0".into()));
    assert_eq!(client.go("plcc/goToTick", json!({"tick": 5})), at("step", 5, 8));
    assert_eq!((client.value("KEY"), client.value("LAMP")), ("1".into(), "1".into()));
    client.ask("evaluate", repl("force KEY=1"));
    // The word of earlier versions, and of test scripts.
    let told = client.ask("evaluate", repl("release KEY"));
    assert!(told["result"].as_str().unwrap().starts_with("KEY is not forced"), "{told}");
    client.leave();
}

#[test]
fn nct_breaks_in_subroutines_and_steps_out_of_them() {
    let text = ":001\nLF020\n+1\nSF020\nC010\nU013\nJ1\n:000\nJ0\n:010\nLF020\n=4 U012 Z\nR\n";
    let folder = Folder::with(&[("count.nct", text)]);
    let path = folder.path().join("count.nct");
    let mut client = Client::launch(
        json!({"program": path, "ticks": 50}),
        json!([{"line": 12, "condition": "LF020 =3"}]),
    );
    assert_eq!(client.stopped(), at("breakpoint", 2, 12));
    let frames = client.ask("stackTrace", json!({"threadId": 2}));
    let lines: Vec<_> =
        frames["stackFrames"].as_array().unwrap().iter().map(|f| f["line"].as_u64()).collect();
    assert_eq!(lines, [Some(12), Some(5)]);
    assert_eq!(client.go("stepOut", json!({})), at("step", 2, 6));
    assert_eq!(client.go("stepBack", json!({})), at("step", 2, 13));
    assert_eq!(client.go("plcc/scanBack", json!({})), at("step", 1, 2));
    assert_eq!(client.value("F020"), "1");
    for line in [3, 4, 5, 6, 7] {
        assert_eq!(client.go("next", json!({})), at("step", 1, line));
    }
    assert_eq!(client.go("plcc/goToTick", json!({"tick": 9})).0, "step");
    assert_eq!(client.go("plcc/lastWriter", json!({"name": "Y012"})), at("goto", 3, 12));
    assert_eq!(client.accesses(), ["Y012 (written)=0 → 1"]);
    // The condition stands in the same line, the statement before it in line 11.
    assert_eq!(client.go("stepBack", json!({})), at("step", 3, 12));
    assert_eq!(client.go("stepIn", json!({})), at("step", 3, 12));
    assert_eq!(client.go("stepBack", json!({"granularity": "line"})), at("step", 3, 11));
    assert_eq!(client.go("plcc/lastWriter", json!({"name": "F020"})), at("goto", 3, 4));
    assert_eq!(client.accesses(), ["F020 (written)=3 → 4"]);
    client.leave();
}

#[test]
fn pmac_breaks_in_included_files_and_finds_writers_of_bits() {
    let files = [
        ("mill.pmc", "M11->Y:$FFC2,8\nM12->Y:$FFC2,9\n#include \"plc.h\"\n"),
        (
            "plc.h",
            "I5=2\nOPEN PLC 1 CLEAR\nP1=P1+1\nM12=P1%2\nIF (P1=3)\nM11=1\nENDIF\n\
             IF (P1<4) ADDRESS &2 Q5=P1 ENDIF\nCLOSE\n",
        ),
    ];
    let folder = Folder::with(&files);
    let (main, included) = (folder.path().join("mill.pmc"), folder.path().join("plc.h"));
    let mut client = Client::new();
    client.ask("launch", json!({"program": [main], "ticks": 50, "stopOnEntry": true}));
    client.event("initialized");
    let set = client.ask(
        "setBreakpoints",
        json!({"source": {"path": included}, "breakpoints": [{"line": 4, "condition": "P1>4"}]}),
    );
    assert_eq!(set["breakpoints"][0]["verified"], true, "{set}");
    client.ask("configurationDone", json!({}));
    assert_eq!(client.stopped(), at("entry", 0, 3));
    assert_eq!(client.go("continue", json!({})), at("breakpoint", 4, 4));
    assert_eq!((client.value("P1"), client.value("M11")), ("5".into(), "1".into()));
    assert_eq!(client.go("plcc/scanBack", json!({})), at("step", 3, 3));
    assert_eq!(client.value("P1"), "3");
    assert_eq!(client.go("plcc/scanForward", json!({})), at("step", 4, 3));
    // M12 is in the same word as M11, and is written later.
    assert_eq!(client.go("plcc/lastWriter", json!({"name": "M11"})), at("goto", 2, 6));
    assert_eq!(client.accesses()[0], "M11 (written)=0 → 1");
    // Q-variables of other coordinate systems are not expressions.
    assert_eq!(client.go("plcc/goToTick", json!({"tick": 9})), at("step", 9, 3));
    assert_eq!(client.go("plcc/lastChange", json!({"name": "&2Q5"})), at("goto", 2, 8));
    assert_eq!(client.accesses(), ["P1 (read)=3", "&2Q5 (written)=2 → 3"]);
    let sources = client.ask("loadedSources", json!({}));
    assert_eq!(sources["sources"].as_array().unwrap().len(), 2);
    client.leave();
}

/// A client may send anything: the adapter answers, or says what is wrong, and lives on.
#[test]
fn no_message_brings_the_adapter_down() {
    let folder = Folder::with(&[("count.pmi", PMI), ("broken.pmi", support::BROKEN)]);
    let mut client = Client::new();
    for text in ["null", "[]", "{}", "{", "\"x\"", "{\"seq\":\"x\"}", "{\"type\":\"event\"}"] {
        client.send(text.as_bytes());
    }
    let commands = [
        "setBreakpoints",
        "breakpointLocations",
        "dataBreakpointInfo",
        "setDataBreakpoints",
        "setExceptionBreakpoints",
        "exceptionInfo",
        "threads",
        "stackTrace",
        "scopes",
        "variables",
        "setVariable",
        "setExpression",
        "evaluate",
        "loadedSources",
        "source",
        "next",
        "stepIn",
        "stepOut",
        "stepBack",
        "continue",
        "reverseContinue",
        "plcc/scanBack",
        "plcc/lastWriter",
        "plcc/goToTick",
        "plcc/position",
        "nonsense",
        "",
    ];
    let arguments = [
        json!(null),
        json!({}),
        json!([1, 2]),
        json!({"source": {"path": "/nowhere"}, "breakpoints": [{"line": -5}], "line": -1}),
        json!({"variablesReference": -9_000_000_000_i64, "name": "", "value": "\u{0}", "tick": -1}),
        json!({"variablesReference": 1, "expression": "((((", "context": "repl", "threadId": 9}),
        json!({"expression": "tick 99999999999999999999", "context": "repl", "start": 99, "count": -1}),
        json!({"source": {"sourceReference": 77}, "lines": [0, 9_999_999_999_i64]}),
    ];
    let try_all = |client: &mut Client| {
        for command in commands {
            for arguments in &arguments {
                client.answer(command, arguments.clone());
            }
        }
    };
    try_all(&mut client);
    let reason = client.refused("launch", json!({"program": "/nowhere.pmi"}));
    assert!(reason.contains("nowhere.pmi"), "{reason}");
    let broken = folder.path().join("broken.pmi");
    let reason = client.refused("launch", json!({"program": broken}));
    assert!(reason.contains("broken.pmi:4:3: PMI-31"), "{reason}");
    let program = folder.path().join("count.pmi");
    let reason = client.refused("launch", json!({"program": program, "args": ["--nonsense"]}));
    assert!(reason.contains("--nonsense"), "{reason}");
    client.ask("launch", json!({"program": program, "ticks": 20}));
    try_all(&mut client);
    client.ask("pause", json!({}));
    client.leave();
}

/// Going to a tick that is far away, in a run without an end, is given up for a pause, and when the client
/// leaves.
#[test]
fn a_movement_without_an_end_is_given_up() {
    let folder = Folder::with(&[("count.pmi", PMI)]);
    let program = folder.path().join("count.pmi");
    let far = json!({
        "seq": 1000, "type": "request", "command": "plcc/goToTick",
        "arguments": {"tick": 1_u64 << 62},
    });
    for leaves in ["disconnect", ""] {
        let mut client =
            Client::launch(json!({"program": program, "stopOnEntry": true}), json!([]));
        client.event("stopped");
        client.send(far.to_string().as_bytes());
        client.ask("pause", json!({}));
        let is_answer = |event: &&Value| event["request_seq"] == 1000;
        let answer = client.events.iter().find(is_answer).unwrap();
        assert_eq!(answer["message"], "it was interrupted");
        assert_eq!(client.go("plcc/goToTick", json!({"tick": 2})).1, 2);
        client.send(far.to_string().as_bytes());
        if leaves == "disconnect" {
            client.leave();
        } else {
            client.vanish();
        }
    }
}

/// The stories of docs/debugger.md: from the end of a recording to the statement that set the stop off.
/// Each row is a variable, and the tick and line of the statement that changed it last.
fn story(program: &str, stimulus: &str, ticks: u64, requests: &[(&str, u64, u64)]) {
    assert!(requests.len() <= 5);
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let (program, stimulus) = (root.join(program), root.join(stimulus));
    let folder = Folder::with(&[]);
    let record = folder.path().join("machine.plcrec");
    let recorded = Command::new(env!("CARGO_BIN_EXE_plcc"))
        .arg("run")
        .arg(program)
        .arg("--stimulus")
        .arg(stimulus)
        .arg("--record")
        .arg(&record)
        .args(["--ticks", &ticks.to_string()])
        .output()
        .unwrap();
    assert!(recorded.status.success(), "{}", String::from_utf8_lossy(&recorded.stderr));
    let mut client = Client::new();
    client.ask("attach", json!({"recording": record}));
    client.event("initialized");
    client.ask("configurationDone", json!({}));
    let (reason, tick, _) = client.stopped();
    assert_eq!((reason.as_str(), tick), ("entry", ticks - 1), "the end of the recording");
    for &(name, tick, line) in requests {
        let arrived = client.go("plcc/lastChange", json!({"name": name}));
        assert_eq!(arrived, at("goto", tick, line), "{name}");
    }
    let reason = client.refused("setVariable", json!({"name": requests[0].0, "value": "1"}));
    assert!(reason.starts_with("a recording can't be changed"), "{reason}");
    assert_eq!(client.go("reverseContinue", json!({})).1, 0, "the beginning of the recording");
    assert_eq!(client.go("continue", json!({})).1, ticks - 1);
    client.leave();
}

#[test]
fn the_stories_of_the_documentation_end_where_they_say() {
    story(
        "examples/pmi/lathe.pmi",
        "docs/debugger/lathe.csv",
        300,
        &[("MCHON", 200, 166), ("@ESTOP", 200, 45)],
    );
    story(
        "examples/nct/sample.plc",
        "examples/nct/sample.csv",
        1011,
        &[("Y710", 1010, 427), ("I655", 1010, 57), ("F0114", 981, 989)],
    );
    story(
        "examples/pmac/mill.pmc",
        "examples/pmac/mill/encoder/stimulus.csv",
        400,
        &[("P30", 182, 103), ("L5", 181, 194), ("L4", 181, 188), ("L3", 140, 184)],
    );
}

/// A control that runs is looked at by the recording that it writes: it is not stopped, and what it adds
/// is found.
#[test]
fn a_control_that_runs_is_followed_by_its_recording() {
    let folder = Folder::with(&[("count.pmi", PMI)]);
    let record = folder.path().join("count.plcrec");
    let mut control = Command::new(env!("CARGO_BIN_EXE_plcc"))
        .args(["run", "count.pmi", "--realtime", "--watchdog", "1h", "--record"])
        .arg(&record)
        .current_dir(folder.path())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let mut client = Client::new();
    // The recorder needs a moment until a tick is in the file.
    loop {
        assert!(control.try_wait().unwrap().is_none(), "the control has ended");
        if client.answer("attach", json!({"recording": record}))["success"] == true {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    client.ask("configurationDone", json!({}));
    let (_, seen, _) = client.stopped();
    while client.go("continue", json!({})).1 == seen {
        assert!(control.try_wait().unwrap().is_none(), "the control has ended");
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    assert_eq!(client.go("plcc/goToTick", json!({"tick": 0})), at("step", 0, 6));
    assert!(control.try_wait().unwrap().is_none(), "the control was stopped");
    control.kill().unwrap();
    control.wait().unwrap();
    client.leave();
}

/// Steps and runs pass over ticks that are missing, as over those that were skipped.
#[test]
fn ticks_that_are_damaged_are_passed_over() {
    let folder = Folder::with(&[("count.pmi", PMI)]);
    folder.plcc("run count.pmi --ticks 3500 --record r.plcrec").exits(0);
    let record = folder.path().join("r.plcrec");
    // The ticks 1500 to 2999 stand between the second checkpoint and the third.
    let mut bytes = std::fs::read(&record).unwrap();
    let blocks = bytes.windows(4).enumerate().filter(|(_, bytes)| *bytes == b"\x89RB\x04");
    let second = blocks.map(|(at, _)| at).nth(1).unwrap();
    bytes[second + 24] ^= 1;
    std::fs::write(&record, bytes).unwrap();
    let mut client = Client::new();
    client.ask("attach", json!({"recording": record}));
    client.ask("configurationDone", json!({}));
    assert_eq!(client.stopped().1, 3499);
    assert_eq!(client.go("plcc/goToTick", json!({"tick": 3000})), at("step", 3000, 6));
    assert_eq!(client.value("N"), "3000");
    assert_eq!(client.go("stepBack", json!({})), at("step", 1499, 10));
    assert_eq!(client.value("N"), "1500");
    assert_eq!(client.go("next", json!({})), at("step", 3000, 6));
    assert_eq!(client.go("reverseContinue", json!({})).1, 0);
    assert_eq!(client.go("continue", json!({})).1, 3499);
    client.leave();
}

/// The damage may be at the beginning, and the last run may have no tick: a control that was killed within a second of
/// its start leaves one like that. What there is is shown.
#[test]
fn what_there_is_of_a_record_is_shown() {
    let folder = Folder::with(&[("count.pmi", PMI)]);
    folder.plcc("run count.pmi --ticks 2000 --record r.plcrec").exits(0);
    let record = folder.path().join("r.plcrec");
    let mut bytes = std::fs::read(&record).unwrap();
    let ticks = bytes.windows(4).position(|bytes| bytes == b"\x89RB\x04").unwrap();
    let short = bytes[..ticks].to_vec();
    bytes[ticks + 24] ^= 1;
    folder.plcc("run count.pmi --ticks 7 --record r.plcrec").exits(0);
    let whole = std::fs::read(&record).unwrap();
    for (bytes, first, last) in [(bytes, 1500, 1999), ([whole, short].concat(), 0, 6)] {
        std::fs::write(&record, bytes).unwrap();
        let mut client = Client::new();
        client.ask("attach", json!({"recording": record}));
        client.ask("configurationDone", json!({}));
        assert_eq!(client.stopped().1, last);
        assert_eq!(client.go("reverseContinue", json!({})).1, first);
        assert_eq!(client.value("N"), first.to_string());
        client.leave();
    }
}

/// If each variable took as long as all of them together, this would take a quarter of an hour.
#[test]
fn very_many_variables_are_shown() {
    const COUNT: usize = 60_000;
    let names: Vec<String> = (0..COUNT).map(|number| format!("V{number}")).collect();
    let source = format!("$LOGICAL\n{}\n$END\nV7=T\n", names.join(", #\n"));
    let folder = Folder::with(&[("many.pmi", &source)]);
    let path = folder.path().join("many.pmi");
    let mut client =
        Client::launch(json!({"program": path, "ticks": 3}), json!([{"line": COUNT + 3}]));
    assert_eq!(client.stopped().1, 0);
    assert_eq!(client.go("continue", json!({})).1, 1);
    let scopes = client.ask("scopes", json!({"frameId": 1}));
    let scopes = scopes["scopes"].as_array().unwrap();
    let scope = scopes.iter().find(|scope| scope["name"] == "Logical variables").unwrap();
    assert_eq!(scope["namedVariables"], COUNT);
    let all = client.unfold(&scope["variablesReference"]);
    assert_eq!((all.len(), all[7].as_str(), all[8].as_str()), (COUNT, "V7=1", "V8=0"));
    let part = json!({"variablesReference": scope["variablesReference"], "start": 6, "count": 2});
    let part = client.ask("variables", part);
    let part: Vec<_> =
        part["variables"].as_array().unwrap().iter().map(|one| &one["name"]).collect();
    assert_eq!(part, ["V6", "V7"]);
    client.leave();
}

/// A record with an online change and its rollback: the last program is the first one again, and the ticks of
/// each are shown.
#[cfg(unix)]
#[test]
fn a_record_with_online_changes_is_shown_from_any_tick() {
    let folder = Folder::with(&[("one.pmi", PMI), ("two.pmi", &format!("{PMI}N=N+1\n"))]);
    folder.plcc("build one.pmi").exits(0);
    folder.plcc("build two.pmi").exits(0);
    let options = "one.plcx --realtime --watchdog 1h --no-supervisor --socket s --allow swap \
                   --record r.plcrec";
    let mut control = Command::new(support::programs().join("plcrt"))
        .args(options.split(' '))
        .current_dir(folder.path())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let mut ask = |words: &[&str]| {
        assert!(control.try_wait().unwrap().is_none(), "the control has ended");
        let mut command = Command::new(support::programs().join("plcctl"));
        command.arg("s").args(words).current_dir(folder.path());
        command.output().unwrap().status.success()
    };
    while !ask(&["status"]) {
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    assert!(ask(&["swap", "two.plcx"]) && ask(&["rollback"]));
    assert!(Command::new("kill").arg(control.id().to_string()).status().unwrap().success());
    control.wait().unwrap();

    let all = folder.plcc("replay r.plcrec").exits(0);
    let text = format!("{}{}", all.stdout, all.stderr);
    let firsts: Vec<u64> = text
        .lines()
        .filter_map(|line| line.split_once(" ticks, ")?.1.split(' ').next()?.parse().ok())
        .collect();
    assert_eq!(firsts.len(), 3, "{text}");
    let from = folder.plcc(&format!("replay r.plcrec --from {}", firsts[2])).exits(0);
    let text = format!("{}{}", from.stdout, from.stderr);
    assert_eq!(text.matches("went as they were recorded").count(), 1, "{text}");
    assert!(text.contains(&format!("ticks, {} to ", firsts[2])), "{text}");
    let to = folder.plcc(&format!("replay r.plcrec --until {}", firsts[1] - 1)).exits(0);
    let text = format!("{}{}", to.stdout, to.stderr);
    assert_eq!(text.matches("went as they were recorded").count(), 1, "{text}");

    let mut client = Client::new();
    let files = json!({
        "recording": folder.path().join("r.plcrec"), "program": folder.path().join("one.pmi"),
    });
    client.ask("attach", files);
    client.ask("configurationDone", json!({}));
    assert!(client.stopped().1 >= firsts[2]);
    client.leave();
}
