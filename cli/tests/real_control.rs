//! What `plcc` shows of a control that `plcrt` runs. Inputs and outputs are overridden from a browser and seen in a
//! terminal; monitors that hang, flood or leave change nothing of what the control does; a record with an online change
//! becomes a table; and the debugger sets variables of the control whose record it shows.
#![cfg(all(target_os = "linux", feature = "web"))]
#![allow(clippy::unwrap_used, clippy::panic, clippy::indexing_slicing)]

mod support;

use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::os::unix::net::UnixStream;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::thread;
use std::time::Duration;

use rustix::process::Signal;
use serde_json::{Value as Json, json};
use support::browser::Page;
use support::debug_client::Client;
use support::process::{Killed, plcrt, wait};
use support::programs;
use support::terminal::Terminal;

/// B follows A, and N counts scans.
const PROGRAM: &str =
    "$INPUT\nA=0/0\n$OUTPUT\nB=1/0\n$INTEGER\nN\n$END\nN=N+1\nIF (N>30000)\nN=0\nENDIF\nB=A\n";

/// A folder with the program's artifact, which goes away with the test.
struct Shop(PathBuf);

impl Drop for Shop {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

impl Shop {
    fn new(name: &str) -> Self {
        Self::of(name, PROGRAM)
    }

    fn of(name: &str, program: &str) -> Self {
        let name = format!("plcc-monitor-{name}-{}", std::process::id());
        let shop = Self(std::env::temp_dir().join(name));
        fs::create_dir_all(&shop.0).unwrap();
        fs::write(shop.0.join("p.pmi"), program).unwrap();
        assert!(shop.plcc().args(["build", "p.pmi"]).status().unwrap().success());
        // The artifact has the text of its source, so nobody needs it any more.
        fs::remove_file(shop.0.join("p.pmi")).unwrap();
        shop
    }

    fn plcc(&self) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_plcc"));
        command.current_dir(&self.0).env("XDG_STATE_HOME", &self.0);
        command
    }

    /// A control with the program; no tick is skipped, and no scan is too late, however busy the computer is.
    fn control(&self, options: &[&str]) -> Killed {
        let mut command = Command::new(plcrt());
        command.args(["p.plcx", "--realtime", "--no-supervisor", "--overrun", "catch-up=1000000"]);
        command.args(["--watchdog", "1h", "--socket", "socket"]).args(options).current_dir(&self.0);
        let mut control = Killed::spawn(command.stderr(Stdio::null()));
        wait("the control's socket", || {
            assert!(control.is_running(), "the control has ended");
            UnixStream::connect(self.0.join("socket")).ok()
        });
        control
    }

    /// A monitor of the control in a pseudo-terminal.
    fn terminal(&self, options: &[&str]) -> Terminal {
        Terminal::open(self.plcc().args(["monitor", "socket"]).args(options))
    }

    /// A browser's page of a monitor of its own, which is ended with it.
    fn page(&self, options: &[&str]) -> Page {
        self.page_of("socket", options)
    }

    /// A page of a monitor that shows something else than the control.
    fn page_of(&self, target: &str, options: &[&str]) -> Page {
        Page::open(self.plcc().args(["monitor", target, "--web=127.0.0.1:0"]).args(options))
    }

    /// An editor that debugs a record.
    fn editor(&self, record: Json) -> Client {
        let mut editor = Client::in_folder(&self.0);
        editor.ask("attach", record);
        editor.ask("configurationDone", json!({}));
        editor.event("stopped");
        editor
    }
}

/// Waits until the record of the control can be replayed.
fn wait_for_record(shop: &Shop) {
    wait("the record", || {
        let output = shop.plcc().args(["replay", "r.plcrec"]).output().unwrap();
        output.status.success().then_some(())
    });
}

#[test]
fn a_real_control_is_overridden_from_a_browser_and_the_terminal_shows_it() {
    let shop = Shop::new("override");
    let _control = shop.control(&["--record", "r.plcrec", "--allow", "force,write"]);
    wait_for_record(&shop);
    let mut page = shop.page(&["--record", "r.plcrec"]);
    let mut terminal = shop.terminal(&["--record", "r.plcrec"]);
    terminal.wait_for_new("p.pmi (PMI)");
    terminal.press("3");
    terminal.wait_for_new("Outputs");

    // The warning of PMI 5.3 comes first.
    let force = |name: &str, value: &str| json!({"apply": {"command": "force", "name": name, "value": value}});
    let refused = page.send(force("B", "1")).to_string();
    assert!(refused.contains("completely bypassed"), "{refused}");
    page.send(json!({"apply": {"command": "confirm_warning"}}));

    // Of an output only the line changes: the program still assigns 0.
    page.send(force("B", "1"));
    let row = page.row("B", |row| row["forced"] == "1" && row["physical"] == "1");
    assert_eq!(row["logical"], "0", "{row}");
    terminal.wait_for_new("1 OVERRIDE");

    // An input is seen by the program, which assigns it to the output.
    page.send(force("A", "1"));
    let row = page.row("A", |row| row["forced"] == "1" && row["logical"] == "1");
    assert_eq!(row["physical"], "0", "{row}");
    page.row("B", |row| row["logical"] == "1");
    // Only cells that change are written, so the text comes in pieces.
    terminal.wait_for_new("2 OVER");

    // What the terminal ends is ended for the browser too.
    terminal.press("X");
    page.row("B", |row| row["forced"].is_null() && row["physical"] == "0");
    let row = page.row("A", |row| row["forced"].is_null());
    assert_eq!(row["logical"], "0", "{row}");

    // A write acts on the control, not on the monitor's replay of it.
    let set = json!({"apply": {"command": "change", "name": "N", "value": "-7000"}});
    let answer = page.send(set).to_string();
    assert!(answer.contains("N=-7000 before tick"), "{answer}");

    // To set an output is asked for first; once confirmed it is done, and the next time it is asked for again.
    let set = json!({"apply": {"command": "change", "name": "B", "value": "1"}});
    let confirm = json!({"apply": {"command": "confirm_warning"}});
    let refused = page.send(set.clone()).to_string();
    assert!(refused.contains("Set B to 1?") && refused.contains("is an output"), "{refused}");
    page.send(confirm.clone());
    let answer = page.send(set.clone()).to_string();
    assert!(answer.contains("B=1 before tick"), "{answer}");
    assert!(page.send(set).to_string().contains("Set B to 1?"));

    // From the past nothing acts on the present without a question; who forces what is told.
    page.send(json!({"apply": {"command": "go_to_tick", "tick": 3}}));
    let refused = page.send(force("A", "1")).to_string();
    assert!(refused.contains("PAST, tick 3") && refused.contains("as it is NOW"), "{refused}");
    // Another command in between makes the confirmation void.
    page.send(confirm.clone());
    page.send(json!({"apply": {"command": "move_ticks", "by": 1}}));
    let refused = page.send(force("A", "1")).to_string();
    assert!(refused.contains("PAST, tick 4"), "{refused}");
    page.send(confirm);
    let answer = page.send(force("A", "1")).to_string();
    assert!(answer.contains("A is forced to 1 from tick"), "{answer}");
    wait("the force in the status", || {
        let view = page.send(json!({"ask": {"screen": "status"}}));
        let status = &view["view"]["status"];
        assert_eq!(status["past"], true, "{status}");
        assert!(status["time"].as_str().unwrap().ends_with(" UTC"), "{status}");
        let by = status["forces"][0]["by"].as_str()?.to_owned();
        assert!(by.starts_with("user ") && by.contains("with plcc"), "{by}");
        Some(())
    });
    page.send(json!({"apply": {"command": "release_all"}}));
}

#[test]
fn what_the_control_does_not_allow_is_refused() {
    let shop = Shop::new("refuse");
    let _control = shop.control(&["--record", "r.plcrec"]);
    wait_for_record(&shop);
    let mut page = shop.page(&["--record", "r.plcrec"]);
    page.row("B", |row| row["logical"] == "0");
    page.send(json!({"apply": {"command": "confirm_warning"}}));
    for (command, why) in [
        (json!({"command": "rollback"}), "without --allow swap"),
        (json!({"command": "force", "name": "B", "value": "1"}), "without --allow force"),
        (json!({"command": "change", "name": "N", "value": "1"}), "without --allow write"),
    ] {
        let answer = page.send(json!({"apply": command})).to_string();
        assert!(answer.contains(why), "{answer}");
    }
}

/// PMI 5.2: a delay and a constant, which a monitor changes in the program that runs.
const DELAYED: &str = "$INPUT\nA=0/0\n$OUTPUT\nB=1/0\n$TIMER\nE/TC/DC=32767\n$INTEGER\nLIMIT=5,N\n$LONG\nM\n$END\nTC=A\nB=DC\n\
                       N=LIMIT\nM=M+1\n";

#[test]
fn a_delay_and_a_constant_are_changed_while_the_program_runs_and_changed_back() {
    let shop = Shop::of("delays", DELAYED);
    let options = ["--record", "r.plcrec", "--allow", "swap,force", "--log", "log.jsonl"];
    let _control = shop.control(&options);
    wait_for_record(&shop);
    let mut page = shop.page(&["--record", "r.plcrec"]);
    let change = |page: &mut Page, name: &str, value: &str| {
        let command = json!({"apply": {"command": "change", "name": name, "value": value}});
        // The record shows a change about a second after it was done; until then the next one is refused.
        wait(name, || {
            let answer = page.send(command.clone()).to_string();
            let is_early = answer.contains("try again") || answer.contains("does not answer");
            (!is_early).then_some(answer)
        })
    };
    let get = |name: &str| {
        let got = reply(&shop, json!({"request": "get", "names": [name]}));
        got["result"]["values"][name].as_i64().unwrap_or_else(|| panic!("{got}"))
    };
    for (name, value, why) in [
        ("TC#DELAY", "40000", "PMI-22"),
        ("LIMIT", "x", "takes a whole number, and `x` is not one"),
        ("DC#DELAY", "5", "neither the delay of a timer"),
    ] {
        let answer = change(&mut page, name, value);
        assert!(answer.contains(why), "{answer}");
    }
    let answer = change(&mut page, "TC#DELAY", "25");
    assert!(answer.contains("TC#DELAY=25 (was 32767) from tick"), "{answer}");
    let answer = change(&mut page, "LIMIT", "-9");
    assert!(answer.contains("LIMIT=-9 (was 5) from tick"), "{answer}");
    wait("the new constant", || (get("N") == -9).then_some(()));
    // The monitor goes over to the new program as soon as the record has it.
    page.send(json!({"apply": {"command": "watch", "names": ["TC"]}}));
    wait("the new delay", || {
        let view = page.send(json!({"ask": {"screen": "variables"}}));
        let rows = view["view"]["body"]["rows"].as_array()?.clone();
        let delay = rows.into_iter().find(|row| row["name"] == "TC#DELAY")?;
        (delay["value"] == "25").then_some(())
    });
    // The second change kept the first one: a timer that begins now has the new delay.
    let forced = reply(&shop, json!({"request": "force", "values": [{"name": "A", "value": 1}]}));
    assert_eq!(forced["ok"], true, "{forced}");
    let count = wait("the timer", || Some(get("TC#COUNT")).filter(|count| *count != -1));
    assert!((0..=25).contains(&count), "{count}");
    // All other values were kept.
    assert!(get("M") > 3);

    let answer = page.send(json!({"apply": {"command": "rollback"}})).to_string();
    assert!(answer.contains("the program before runs again"), "{answer}");
    wait("the old constant", || (get("N") == 5).then_some(()));
    let status = reply(&shop, json!({"request": "status"}));
    assert_eq!(status["result"]["generation"], 3, "{status}");
    // Each change is in the log, with the artifact and the user, and the record can be replayed.
    let log = wait("the log", || {
        let log = fs::read_to_string(shop.0.join("log.jsonl")).unwrap();
        (log.matches("\"swap\"").count() == 3).then_some(log)
    });
    assert!(log.contains("r-changed.plcx"), "{log}");
    wait_for_record(&shop);
}

/// What the control replies to a request.
fn reply(shop: &Shop, mut request: Json) -> Json {
    request["version"] = 1.into();
    let mut stream = UnixStream::connect(shop.0.join("socket")).unwrap();
    stream.write_all(format!("{request}\n").as_bytes()).unwrap();
    let mut line = String::new();
    BufReader::new(stream).read_line(&mut line).unwrap();
    serde_json::from_str(&line).unwrap()
}

/// How many ticks the control has done.
fn ticks(shop: &Shop) -> u64 {
    reply(shop, json!({"request": "status"}))["result"]["ticks"].as_u64().unwrap()
}

#[test]
fn monitors_that_hang_flood_and_leave_change_no_tick() {
    let shop = Shop::new("hang");
    fs::write(shop.0.join("s.csv"), "tick,name,value\n50,A,1\n120,A,0\n200,A,1\n").unwrap();
    let run = ["--stimulus", "s.csv", "--watch", "N,B", "--trace"];
    let mut options = run.to_vec();
    options.extend(["watched.csv", "--allow", "force,write", "--record", "r.plcrec"]);
    let mut control = shop.control(&options);
    wait_for_record(&shop);
    // One monitor stops in its middle, one is killed, one goes on.
    let hanging = shop.terminal(&["--record", "r.plcrec"]);
    hanging.wait_for_new("p.pmi (PMI)");
    hanging.signal(Signal::STOP);
    let leaving = shop.terminal(&["--record", "r.plcrec"]);
    leaving.wait_for_new("p.pmi (PMI)");
    leaving.signal(Signal::KILL);
    let mut page = shop.page(&["--record", "r.plcrec"]);
    page.send(json!({"ask": {"screen": "timing"}}));
    // Clients that send and never read, and one that goes away in the middle of a request.
    let floods: Vec<_> = (0..4)
        .map(|_| {
            let mut stream = UnixStream::connect(shop.0.join("socket")).unwrap();
            stream.set_write_timeout(Some(Duration::from_secs(1))).unwrap();
            thread::spawn(move || {
                let line = "{\"version\":1,\"request\":\"get\",\"names\":[\"*\"]}\n".repeat(100);
                for _ in 0..2000 {
                    if stream.write_all(line.as_bytes()).is_err() {
                        break;
                    }
                }
            })
        })
        .collect();
    let mut half = UnixStream::connect(shop.0.join("socket")).unwrap();
    half.write_all(b"{\"version\":1,\"request\":").unwrap();
    drop(half);
    for flood in floods {
        flood.join().unwrap();
    }
    wait("the end of the stimulus", || (ticks(&shop) > 250).then_some(()));
    control.end();
    hanging.signal(Signal::CONT);

    // The same program alone, in simulated time, for as many ticks: N changes in each, so the last row tells the last.
    let watched = fs::read_to_string(shop.0.join("watched.csv")).unwrap();
    let last = watched.lines().last().unwrap().split(',').next().unwrap();
    let count = (last.parse::<u64>().unwrap() + 1).to_string();
    let mut alone = Command::new(plcrt());
    alone.arg("p.plcx").args(run).args(["alone.csv", "--ticks", &count]).current_dir(&shop.0);
    assert!(alone.stderr(Stdio::null()).status().unwrap().success());
    assert_eq!(fs::read_to_string(shop.0.join("alone.csv")).unwrap(), watched);
    // The record says too that every tick went as it goes without them.
    assert!(shop.plcc().args(["replay", "r.plcrec"]).status().unwrap().success());
}

/// Records a control whose program gets a further variable, M, by an online change. Gives the first tick of the new one.
fn record_with_online_change(shop: &Shop) -> u64 {
    let two = PROGRAM.replace("N\n$END", "N\nM\n$END\nM=-1");
    let folder = shop.0.join("two");
    fs::create_dir(&folder).unwrap();
    fs::write(folder.join("p.pmi"), two).unwrap();
    let mut build = shop.plcc();
    assert!(build.args(["build", "p.pmi"]).current_dir(&folder).status().unwrap().success());
    let mut control = shop.control(&["--record", "r.plcrec", "--allow", "swap"]);
    wait("some ticks", || (ticks(shop) > 20).then_some(()));
    let done = reply(shop, json!({"request": "swap", "path": folder.join("p.plcx")}));
    assert_eq!(done["ok"], true, "{done}");
    let changed = done["result"]["ticks"].as_u64().unwrap();
    wait("some more ticks", || (ticks(shop) > changed + 20).then_some(()));
    control.end();
    changed
}

#[test]
fn a_monitor_shows_each_tick_with_the_program_that_ran_it() {
    let shop = Shop::new("versions");
    let changed = record_with_online_change(&shop);
    let mut page = shop.page_of("r.plcrec", &[]);
    let lines = |page: &mut Page| {
        let view = page.send(json!({"ask": {"screen": "statements", "first": 0, "count": 50}}));
        let lines = view["view"]["body"]["lines"].as_array().unwrap_or_else(|| panic!("{view}"));
        let text = |line: &Json| {
            let tokens = line["tokens"].as_array().unwrap().iter();
            tokens.map(|token| token["text"].as_str().unwrap()).collect::<String>()
        };
        let lines: Vec<String> = lines.iter().map(text).collect();
        (view["view"]["status"]["tick"].as_u64().unwrap(), lines)
    };
    wait("the newest tick", || {
        let (tick, lines) = lines(&mut page);
        (tick > changed + 10).then(|| assert_eq!(lines[0], "M=-1"))
    });
    let go = |tick: u64| json!({"apply": {"command": "go_to_tick", "tick": tick}});
    for (tick, first) in [(changed - 1, "N=N+1"), (changed, "M=-1"), (3, "N=N+1")] {
        page.send(go(tick));
        let (shown, lines) = lines(&mut page);
        assert_eq!((shown, lines[0].as_str()), (tick, first));
    }
    // The change before the first tick of the new program was made by the old one.
    page.send(go(changed));
    let command = json!({"apply": {"command": "previous_change", "name": "N"}});
    let answer = page.send(command).to_string();
    assert!(answer.contains(&format!("N was changed in tick {}", changed - 1)), "{answer}");
    assert_eq!(lines(&mut page).1[0], "N=N+1");
    // A scope shows both.
    page.send(json!({"apply": {"command": "scope_add", "names": ["N"]}}));
    page.send(json!({"apply": {"command": "scope_range", "from": changed - 2, "to": changed + 1}}));
    wait("the samples", || {
        let view = page.send(json!({"ask": {"screen": "scope", "samples": 10}}));
        let samples = view["view"]["body"]["channels"][0]["samples"].as_array()?.clone();
        let values: Vec<f64> =
            samples.iter().map(|sample| sample["last"].as_f64().unwrap()).collect();
        let first = (changed - 1) as f64;
        (values.len() == 4).then(|| assert_eq!(values, [0.0, 1.0, 2.0, 3.0].map(|n| first + n)))
    });
}

#[test]
fn the_debugger_steps_from_one_program_to_the_other_over_an_online_change() {
    let shop = Shop::new("steps");
    let changed = record_with_online_change(&shop);
    let mut editor = shop.editor(json!({"recording": "r.plcrec"}));
    let thread = || json!({"threadId": 1});
    // The tick, and the text of the statement's line.
    let place = |editor: &mut Client| {
        let frame = editor.ask("stackTrace", thread())["stackFrames"][0].clone();
        let source = json!({"source": frame["source"], "sourceReference": 0});
        let source = editor.ask("source", source);
        let text = source["content"].as_str().unwrap_or_else(|| panic!("{source}"));
        let tick = editor.ask("plcc/position", json!({}))["tick"].as_u64().unwrap();
        let line = frame["line"].as_u64().unwrap() as usize;
        (tick, text.lines().nth(line - 1).unwrap().to_owned())
    };
    assert_eq!(editor.ask("plcc/position", json!({}))["firstTick"], 0);
    editor.console_go(&format!("tick {changed}"));
    assert_eq!(place(&mut editor), (changed, "M=-1".into()));
    assert_eq!(editor.value("M"), "0");
    editor.go("stepBack", thread());
    assert_eq!(place(&mut editor), (changed - 1, "B=A".into()));
    assert_eq!(editor.console("M")["success"], false);
    editor.go("stepIn", thread());
    assert_eq!(place(&mut editor), (changed, "M=-1".into()));
    // The statement that wrote N last is one of the old program, which has no M.
    editor.console_go("writer N");
    assert_eq!(place(&mut editor), (changed - 1, "N=N+1".into()));
    editor.console_go(&format!("tick {changed}"));
    let unknown = editor.console("writer M");
    let why = unknown["message"].as_str().unwrap_or_default();
    assert!(why.contains("has no such variable"), "{unknown}");
    assert_eq!(place(&mut editor), (changed, "M=-1".into()));

    // A breakpoint on a line is met in both.
    let set = json!({"source": {"path": "p.pmi"}, "breakpoints": [{"line": 9}]});
    let set = editor.ask("setBreakpoints", set);
    assert_eq!(set["breakpoints"][0]["verified"], true, "{set}");
    for tick in [changed - 1, changed - 2] {
        assert_eq!(editor.go("reverseContinue", thread()), ("breakpoint".into(), tick, 9));
        assert_eq!(place(&mut editor), (tick, "IF (N>30000)".into()));
    }
    for (tick, line) in [(changed - 1, "IF (N>30000)"), (changed, "M=-1")] {
        assert_eq!(editor.go("continue", thread()), ("breakpoint".into(), tick, 9));
        assert_eq!(place(&mut editor), (tick, line.into()));
    }
}

#[test]
fn a_table_goes_on_over_an_online_change() {
    let shop = Shop::new("change");
    let changed = record_with_online_change(&shop);

    let convert = |options: &[&str]| {
        let mut command = shop.plcc();
        let output = command.args(["convert", "r.plcrec", "--watch", "N,M"]).args(options).output();
        let output = output.unwrap();
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{text}");
        text
    };
    let told = convert(&["--to", "csv", "-o", "out.csv"]);
    assert!(told.contains("M is not in the program"), "{told}");
    let table = fs::read_to_string(shop.0.join("out.csv")).unwrap();
    let rows: Vec<Vec<&str>> = table.lines().skip(1).map(|row| row.split(',').collect()).collect();
    let of = |name: &str| -> Vec<(u64, i64)> {
        let of_name = rows.iter().filter(|row| row[2] == name);
        of_name.map(|row| (row[0].parse().unwrap(), row[3].parse().unwrap())).collect()
    };
    // N counts on through the change; behind tick n it is n + 1.
    let counts = of("N");
    assert!(counts.len() as u64 > changed + 20, "{} {changed}", counts.len());
    assert!(counts.iter().all(|&(tick, count)| count == tick as i64 + 1), "{counts:?}");
    // M is there from the change on.
    assert_eq!(of("M"), [(changed, -1)]);
    convert(&["--to", "vcd", "-o", "out.vcd"]);
    let dump = fs::read_to_string(shop.0.join("out.vcd")).unwrap();
    assert!(dump.contains(" M $end"), "{}", &dump[..300.min(dump.len())]);
    convert(&["--to", "fst", "-o", "out.fst"]);
    #[cfg(feature = "mcap")]
    convert(&["--to", "mcap", "-o", "out.mcap"]);
}

#[test]
fn the_debugger_sets_variables_of_the_control_whose_record_it_shows() {
    let shop = Shop::new("debug");
    let _control = shop.control(&["--record", "r.plcrec", "--allow", "write"]);
    wait_for_record(&shop);
    let mut editor = shop.editor(json!({"recording": "r.plcrec", "socket": "socket"}));
    let answer = editor.console("set N=-30000");
    let text = answer["body"]["result"].as_str().unwrap_or_else(|| panic!("{answer}"));
    assert!(text.starts_with("N becomes -30000 before tick "), "{text}");
    // It counts up from there by one a tick, so it is below 0 for ten minutes.
    let got = reply(&shop, json!({"request": "get", "names": ["N"]}));
    assert!(got["result"]["values"]["N"].as_i64().unwrap() < 0, "{got}");
    // What was not allowed is refused by the control, with its reason.
    let refused = editor.console("force B=1");
    assert_eq!(refused["success"], false, "{refused}");
    assert!(refused["message"].as_str().unwrap().contains("--allow force"), "{refused}");
    // The record shows it when it has come so far: the statement that reads N sees the new value.
    wait("the change in the record", || {
        editor.go("continue", json!({"threadId": 1}));
        editor.value("N").starts_with('-').then_some(())
    });
}

#[test]
fn an_operator_at_the_console_of_a_controller_presses_keys() {
    let program = "$FAULT\nFLT=\"COOLANT LOW\"\n$END\n@CL103=@CP103\nFLT=@CP103\n@FRO=80\n";
    let shop = Shop::of("operator", program);
    let mut control = shop.control(&["--allow", "operate"]);
    let mut command = Command::new(programs().join("plcctl"));
    command.args(["socket", "operator", "--kiosk"]).current_dir(&shop.0);
    let mut terminal = Terminal::open(&mut command);
    terminal.wait_for_new("p.pmi (PMI)");
    terminal.press("q\r");
    terminal.wait_for_new("C O O L A N T   L O W");
    // Only cells that change are drawn: of another text at the same place not all would be.
    terminal.press("\r");
    terminal.wait_for_new("no fault and no message");
    control.end();
    terminal.wait_for_new("N O   C O N T R O L");
    let _control = shop.control(&[]);
    terminal.wait_for_new("no fault and no message");
}
