//! Acts on running controls by the socket: real processes of `plcrt` and `plcctl`, real sockets, the
//! image file, forces and online changes in every language.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing)]

use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use plcc::compile;
use plcc::disk::Disk;
use plcc::recorded::{Found, ReplayEngine};
use plcc_abi::Dialect;
use plcc_codegen::{OptLevel, Target};
use plcc_diag::SourceMap;
use plcc_frontend::common::Options;
use plcc_host::image_file::{ImageReader, State};
use plcc_host::session::replay::recorded_executive;
use plcc_load::Attached;
use plcc_record::{Recording, Replayer};
use plcc_tests::programs::program;
use serde_json::{Value as Json, json};

/// After this time something that was to happen is taken not to come. Where all is well nothing waits for it.
const HANGS: Duration = Duration::from_secs(600);

/// A folder with artifacts, which goes away with the test.
struct Shop(PathBuf);

impl Shop {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("plcc-socket-{name}-{}", std::process::id()));
        fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    /// Compiles a source to the artifact `NAME.plcx`.
    fn build(&self, name: &str, dialect: Dialect, source: &str) -> PathBuf {
        let mut sources = SourceMap::new();
        let file = sources.add(name, source.as_bytes());
        let options = Options::default();
        let (checked, diagnostics) =
            compile::check(&mut sources, &[file], dialect, &Disk, &options);
        let checked = checked.unwrap_or_else(|| panic!("{diagnostics:?}"));
        let lowered = checked.optimized(OptLevel::Speed).unwrap();
        let code = compile::code(&lowered, &Target::host_baseline().unwrap()).unwrap();
        let path = self.path(&format!("{name}.plcx"));
        fs::write(&path, compile::artifact(&lowered.program, &code).unwrap()).unwrap();
        path
    }

    /// The same with the operator's screen, as `plcc build` makes artifacts.
    fn build_for_operators(&self, name: &str, dialect: Dialect, source: &str) -> PathBuf {
        let mut sources = SourceMap::new();
        let file = sources.add(name, source.as_bytes());
        let mut options = Options::default();
        let machine = "[names]\n\"@CP103\" = { alias = \"COOL\", text = \"coolant\" }\n";
        if dialect == Dialect::Pmi {
            options.machine = plcc_abi::machine::Machine::parse(machine).unwrap();
        }
        let (checked, diagnostics) =
            compile::check(&mut sources, &[file], dialect, &Disk, &options);
        let checked = checked.unwrap_or_else(|| panic!("{diagnostics:?}"));
        let lowered = checked.optimized(OptLevel::Speed).unwrap();
        let code = compile::code(&lowered, &Target::host_baseline().unwrap()).unwrap();
        let panel = checked.operator_panel();
        let attached = Attached { operator: Some(&panel), ..Attached::default() };
        let path = self.path(&format!("{name}.plcx"));
        let bytes = compile::artifact_with(&lowered.program, &code, None, attached).unwrap();
        fs::write(&path, bytes).unwrap();
        path
    }

    /// Starts a control with a socket, and waits until it has done a tick. No tick is skipped, however
    /// busy the computer is.
    fn start(&self, artifact: &Path, options: &[&str]) -> Control {
        let socket = self.path("socket");
        let mut command = Command::new(program("plcrt"));
        command
            .arg(artifact)
            .args(["--realtime", "--watchdog", "1h", "--no-supervisor"])
            .args(["--overrun", "catch-up=100000", "--socket"])
            .arg(&socket)
            .args(options);
        command.current_dir(&self.0).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut control = Control { process: command.spawn().unwrap(), socket };
        let start = Instant::now();
        loop {
            if let Some(status) = control.process.try_wait().unwrap() {
                let mut text = String::new();
                control.process.stderr.take().unwrap().read_to_string(&mut text).unwrap();
                panic!("{status}: {text}");
            }
            if control.socket.exists() && control.ask(&json!({"request": "status"}))["ticks"] != 0 {
                return control;
            }
            assert!(start.elapsed() < HANGS, "the control does not start");
            thread::sleep(Duration::from_millis(5));
        }
    }
}

impl Drop for Shop {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// A running control; it is killed with the test.
struct Control {
    process: Child,
    socket: PathBuf,
}

impl Control {
    fn connect(&self) -> BufReader<UnixStream> {
        let stream = UnixStream::connect(&self.socket).unwrap();
        stream.set_read_timeout(Some(HANGS)).unwrap();
        BufReader::new(stream)
    }

    /// The whole reply to a request.
    fn reply(&self, request: &Json) -> Json {
        let mut request = request.clone();
        request["version"] = 1.into();
        let mut client = self.connect();
        client.get_mut().write_all(format!("{request}\n").as_bytes()).unwrap();
        let mut line = String::new();
        client.read_line(&mut line).unwrap();
        serde_json::from_str(&line).unwrap_or_else(|error| panic!("{error}: {line}"))
    }

    /// The result of a request.
    fn ask(&self, request: &Json) -> Json {
        let reply = self.reply(request);
        assert_eq!(reply["ok"], true, "{request}: {reply}");
        reply["result"].clone()
    }

    /// The code of the error of a request.
    fn refused(&self, request: &Json) -> String {
        let reply = self.reply(request);
        assert_eq!(reply["ok"], false, "{request}: {reply}");
        reply["error"]["code"].as_str().unwrap().to_owned()
    }

    fn get(&self, name: &str) -> Json {
        self.ask(&json!({"request": "get", "names": [name]}))["values"][name].clone()
    }

    fn assign(&self, request: &str, name: &str, value: impl Into<Json>) -> Json {
        let value: Json = value.into();
        self.ask(&json!({"request": request, "values": [{"name": name, "value": value}]}))
    }

    /// Waits for the next tick to end.
    fn tick(&self) {
        let ticks = || self.ask(&json!({"request": "status"}))["ticks"].as_u64().unwrap();
        let now = ticks();
        while ticks() < now + 2 {
            thread::sleep(Duration::from_millis(1));
        }
    }

    fn plcctl(&self, args: &[&str]) -> Output {
        Command::new(program("plcctl")).arg(&self.socket).args(args).output().unwrap()
    }

    /// Ends the control as a user would, and gives its exit status and standard error.
    fn end(mut self) -> (Option<i32>, String) {
        let pid = self.process.id().to_string();
        assert!(Command::new("kill").args(["-TERM", &pid]).status().unwrap().success());
        let status = self.process.wait().unwrap();
        let mut text = String::new();
        self.process.stderr.take().unwrap().read_to_string(&mut text).unwrap();
        (status.code(), text)
    }
}

impl Drop for Control {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

const PUMP: &str = "$INPUT\nDOOR = 0/0\n$OUTPUT\nLAMP = 1/0\n$INTEGER\nCOUNT,LEVEL,A[3]\n$END\n\
                    COUNT = COUNT + 1\nLAMP = DOOR\nA[1] = LEVEL\n";

#[test]
fn a_running_control_is_looked_at_and_acted_on() {
    let shop = Shop::new("acted");
    let artifact = shop.build("pump", Dialect::Pmi, PUMP);
    let log = shop.path("log.jsonl");
    let options = ["--period", "2", "--allow", "write,force,stop", "--log", log.to_str().unwrap()];
    let control = shop.start(&artifact, &options);
    let status = control.ask(&json!({"request": "status"}));
    assert_eq!((&status["state"], &status["dialect"]), (&"running".into(), &"pmi".into()));
    control.assign("set", "LEVEL", 7);
    control.tick();
    let values = control.ask(&json!({"request": "get", "names": ["LEVEL", "A", "A[1]"]}));
    assert_eq!(values["values"], json!({"LEVEL": 7, "A": [0, 7, 0], "A[1]": 7}));
    let list = control.ask(&json!({"request": "list", "pattern": "L*"}));
    let names: Vec<&Json> =
        list["variables"].as_array().unwrap().iter().map(|variable| &variable["name"]).collect();
    assert_eq!(names, ["LAMP", "LEVEL"]);

    // Forces: an input as the program sees it, an output on its line.
    control.assign("force", "DOOR", 1);
    control.tick();
    assert_eq!((control.get("LAMP"), control.get("PORT0.0")), (1.into(), 0.into()));
    control.assign("force", "LAMP", "0");
    control.tick();
    assert_eq!((control.get("LAMP"), control.get("PORT1.0")), (1.into(), 0.into()));
    let forces = json!([{"name": "DOOR", "value": "1"}, {"name": "LAMP", "value": "0"}]);
    assert_eq!(control.ask(&json!({"request": "status"}))["forces"], forces);
    control.ask(&json!({"request": "unforce", "names": ["LAMP"]}));
    control.tick();
    assert_eq!(control.get("PORT1.0"), 1);
    let forced = control.ask(&json!({"request": "unforce", "all": true}));
    assert_eq!(forced["forces"], json!([]));

    // A stop holds the scans and drives the safe outputs; variables stay.
    control.assign("force", "LAMP", 1);
    control.ask(&json!({"request": "stop"}));
    let stopped = control.get("COUNT");
    thread::sleep(Duration::from_millis(20));
    assert_eq!(control.get("COUNT"), stopped);
    assert_eq!(control.get("PORT1.0"), 0, "safe values win over forces");
    assert_eq!(control.ask(&json!({"request": "status"}))["state"], "stopped");
    control.ask(&json!({"request": "start"}));
    control.tick();
    assert_ne!(control.get("COUNT"), stopped);
    assert_eq!(control.get("PORT1.0"), 1, "the force is still in effect");

    for request in [
        json!({"request": "get", "names": ["NOTHING"]}),
        json!({"request": "get", "names": ["LEVEL", "NOTHING*"]}),
        json!({"request": "set", "values": [{"name": "LEVEL", "value": "x"}]}),
        json!({"request": "force", "values": [{"name": "LEVEL", "value": 1}]}),
        json!({"request": "unforce", "names": ["DOOR"]}),
        json!({"request": "swap", "path": "/x.plcx"}),
        json!({"request": "rollback"}),
    ] {
        let code = control.refused(&request);
        assert!(["not_found", "bad_value", "refused", "denied"].contains(&&*code), "{code}");
    }
    let (exit, text) = control.end();
    assert_eq!(exit, Some(130), "{text}");
    assert!(!shop.path("socket").exists());
    let log = fs::read_to_string(log).unwrap();
    let entries: Vec<Json> = log.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let write = entries.iter().find(|entry| entry["kind"] == "write").unwrap();
    assert_eq!((&write["name"], &write["value"]), (&"LEVEL".into(), &"7".into()));
    assert_eq!(write["pid"], std::process::id());
    assert!(write["user"].is_string() && write["command"].is_string() && write["time"].is_string());
    for (kind, count) in [("force", 5), ("control", 2), ("refused", 2)] {
        assert_eq!(entries.iter().filter(|entry| entry["kind"] == kind).count(), count, "{kind}");
    }
}

#[test]
fn without_permission_a_control_is_only_looked_at() {
    let shop = Shop::new("denied");
    let artifact = shop.build("pump", Dialect::Pmi, PUMP);
    let control = shop.start(&artifact, &["--period", "2"]);
    for request in [
        json!({"request": "set", "values": [{"name": "LEVEL", "value": 1}]}),
        json!({"request": "force", "values": [{"name": "DOOR", "value": 1}]}),
        json!({"request": "unforce", "all": true}),
        json!({"request": "swap", "path": "/x.plcx"}),
        json!({"request": "rollback"}),
        json!({"request": "stop"}),
        json!({"request": "start"}),
    ] {
        assert_eq!(control.refused(&request), "denied", "{request}");
    }
    assert_eq!(control.get("LEVEL"), 0);
    use std::os::unix::fs::PermissionsExt;
    let mode = fs::metadata(&control.socket).unwrap().permissions().mode();
    assert_eq!(mode & 0o777, 0o600);
}

#[test]
fn the_socket_of_a_living_control_is_not_taken() {
    let shop = Shop::new("taken");
    let artifact = shop.build("pump", Dialect::Pmi, PUMP);
    let image = shop.path("image");
    let mut control = shop.start(&artifact, &["--image", image.to_str().unwrap()]);
    let second = |option: &str, path: &Path| {
        let mut command = Command::new(program("plcrt"));
        command.arg(&artifact).args(["--realtime", "--ticks", "1", option]).arg(path);
        let output = command.output().unwrap();
        (output.status.code(), String::from_utf8(output.stderr).unwrap())
    };
    for (option, path) in [("--socket", &control.socket), ("--image", &image)] {
        let (status, text) = second(option, path);
        assert_eq!(status, Some(2), "{text}");
        assert!(text.contains("in use"), "{text}");
    }
    assert_eq!(control.ask(&json!({"request": "status"}))["state"], "running");
    // A process that dies leaves both behind; the next one takes their place.
    control.process.kill().unwrap();
    control.process.wait().unwrap();
    assert!(control.socket.exists());
    for (option, path) in [("--socket", &control.socket), ("--image", &image)] {
        let (status, text) = second(option, path);
        assert_eq!(status, Some(0), "{text}");
    }
}

#[test]
fn the_image_file_shows_the_outputs_and_how_the_control_ended() {
    let shop = Shop::new("image");
    let artifact = shop.build("pump", Dialect::Pmi, PUMP);
    let image = shop.path("image");
    let options = ["--period", "2", "--allow", "force", "--image", image.to_str().unwrap()];
    let control = shop.start(&artifact, &options);
    let reader = ImageReader::open(&image).unwrap();
    let first = reader.read().unwrap();
    assert_eq!(first.state, Some(State::Running));
    let table = String::from_utf8(reader.variables()).unwrap();
    let place = |name: &str| -> usize {
        let rows = table.lines().map(|line| serde_json::from_str::<Json>(line).unwrap());
        let row = rows.into_iter().find(|row| row["name"] == name).unwrap();
        usize::try_from(row["offset"].as_u64().unwrap()).unwrap()
    };
    let (lamp, count) = (place("LAMP"), place("COUNT"));
    control.assign("force", "DOOR", 1);
    control.tick();
    let snapshot = reader.read().unwrap();
    assert_eq!((snapshot.image[lamp], snapshot.forces), (1, 1));
    // COUNT is the number of ticks, in the same tick.
    for _ in 0..1000 {
        let snapshot = reader.read().unwrap();
        let counted = i16::from_le_bytes([snapshot.image[count], snapshot.image[count + 1]]);
        assert_eq!(counted, snapshot.ticks as i16);
    }
    assert_eq!(control.end().0, Some(130));
    assert_eq!(reader.read().unwrap().state, Some(State::Ended));
}

#[test]
fn plcctl_shows_and_sets() {
    let shop = Shop::new("plcctl");
    let artifact = shop.build("pump", Dialect::Pmi, PUMP);
    let control = shop.start(&artifact, &["--period", "2", "--allow", "write,force"]);
    let text = |output: &Output| String::from_utf8(output.stdout.clone()).unwrap();
    let set = control.plcctl(&["set", "LEVEL=5"]);
    assert_eq!((set.status.code(), text(&set)), (Some(0), String::new()));
    let get = control.plcctl(&["get", "LEVEL", "DOO?"]);
    assert_eq!((get.status.code(), text(&get)), (Some(0), "DOOR=0\nLEVEL=5\n".into()));
    let json = control.plcctl(&["--json", "get", "LEVEL"]);
    let json: Json = serde_json::from_slice(&json.stdout).unwrap();
    assert_eq!(json["values"]["LEVEL"], 5);
    assert_eq!(control.plcctl(&["force", "DOOR=1"]).status.code(), Some(0));
    let status = text(&control.plcctl(&["status"]));
    assert!(status.contains("DOOR=1") && status.contains("running"), "{status}");
    // The line of DOOR, which can't be held in two ways at once.
    assert_eq!(control.plcctl(&["unforce", "DOOR"]).status.code(), Some(0));
    assert_eq!(control.plcctl(&["force", "PORT0.0=1"]).status.code(), Some(0));
    control.tick();
    assert_eq!(text(&control.plcctl(&["get", "DOOR", "PORT0.0"])), "DOOR=1\nPORT0.0=0\n");
    let shares = control.plcctl(&["force", "DOOR=0"]);
    assert!(String::from_utf8_lossy(&shares.stderr).contains("shares bits with `PORT0.0`"));
    assert!(text(&control.plcctl(&["status"])).contains("PORT0.0=1"));
    let list = text(&control.plcctl(&["list"]));
    assert_eq!(list, "A[3]\nCOUNT\nDOOR\nLAMP\nLEVEL\n");
    let refused = control.plcctl(&["stop"]);
    assert_eq!(refused.status.code(), Some(1));
    assert!(String::from_utf8(refused.stderr).unwrap().contains("--allow stop"));
    assert_eq!(control.plcctl(&["get", "NOTHING"]).status.code(), Some(1));
    let fly = control.plcctl(&["fly"]);
    assert_eq!(fly.status.code(), Some(2));
    let message = String::from_utf8(fly.stderr).unwrap();
    assert!(message.starts_with("error: there is no command `fly`; the commands are status"));
    for (path, why) in
        [("/nowhere/socket", "no such socket"), (artifact.to_str().unwrap(), "it is not a socket")]
    {
        let nobody = Command::new(program("plcctl")).args([path, "status"]).output().unwrap();
        assert_eq!(nobody.status.code(), Some(2));
        assert!(String::from_utf8_lossy(&nobody.stderr).contains(why));
    }
    for args in [&["--completions", "bash"][..], &["--man"]] {
        let output = Command::new(program("plcctl")).args(args).output().unwrap();
        assert_eq!(output.status.code(), Some(0));
        assert!(text(&output).contains("rollback"));
    }
}

/// The names that a PMAC's `#define` gives to variables.
#[test]
fn plcctl_takes_the_names_that_people_gave() {
    let shop = Shop::new("aliases");
    let source = "#define GATE M11 ; gate closed\n#define SPEED P7\nM11->Y:$FFC2,0\nI5=2\nOPEN PLC 1 CLEAR\nP8=GATE\nCLOSE\n\
                  ENABLE PLC 1\nP7=3\n";
    let control =
        shop.start(&shop.build("mill", Dialect::Pmac, source), &["--allow", "write,force"]);
    let text = |args: &[&str]| {
        let output = control.plcctl(args);
        assert!(output.status.success(), "{output:?}");
        String::from_utf8(output.stdout).unwrap()
    };
    assert_eq!(text(&["get", "speed", "GA*"]), "M11=0\nspeed=3\n");
    text(&["set", "SPEED=5"]);
    text(&["force", "gate=1"]);
    let list = text(&["list"]);
    assert!(list.contains("M11  GATE  gate closed\n") && list.contains("P7  SPEED\n"), "{list}");
    control.tick();
    assert_eq!(text(&["get", "P7"]), "P7=5\n");
    assert!(text(&["status"]).contains("M11=1"));
    text(&["unforce", "GATE"]);
}

#[test]
fn clients_that_flood_stall_or_leave_do_no_harm() {
    let shop = Shop::new("clients");
    let artifact = shop.build("pump", Dialect::Pmi, PUMP);
    let control = shop.start(&artifact, &["--period", "2"]);
    let send = |bytes: &[u8]| {
        let mut client = control.connect();
        let _ = client.get_mut().write_all(bytes);
        client
    };
    // Too long, no JSON, a request that is not whole, one whose client has left.
    let mut line = String::new();
    send(&vec![b'x'; 70_000]).read_line(&mut line).unwrap();
    assert!(line.contains("too_large"), "{line}");
    line.clear();
    send(b"nonsense\n").read_line(&mut line).unwrap();
    assert!(line.contains("bad_request"), "{line}");
    let get = r#"{"version":1,"request":"get","names":["*"]}"#;
    let _half = send(get.as_bytes());
    drop(send(format!("{get}\n").as_bytes()));
    // A client that asks much and reads nothing, and more clients than there is room for.
    let many = format!("{get}\n").repeat(2000);
    let flood = UnixStream::connect(&control.socket).unwrap();
    flood.set_write_timeout(Some(Duration::from_millis(200))).unwrap();
    let _ = (&flood).write_all(many.as_bytes());
    let _crowd: Vec<UnixStream> =
        (0..40).map(|_| UnixStream::connect(&control.socket).unwrap()).collect();
    for _ in 0..3 {
        control.tick();
    }
    assert_eq!(control.ask(&json!({"request": "status"}))["state"], "running");
    let (exit, text) = control.end();
    assert_eq!(exit, Some(130), "{text}");
}

/// What an online change said of each name: `new`, `gone` or `changed`.
fn changes(reply: &Json) -> Vec<(String, String)> {
    let text = |row: &Json, key: &str| row[key].as_str().unwrap().to_owned();
    let rows = reply["changes"].as_array().unwrap_or_else(|| panic!("{reply}"));
    rows.iter().map(|row| (text(row, "name"), text(row, "change"))).collect()
}

fn pairs(rows: &[(&str, &str)]) -> Vec<(String, String)> {
    rows.iter().map(|(name, change)| ((*name).to_owned(), (*change).to_owned())).collect()
}

#[test]
fn pmi_programs_are_exchanged_and_taken_back() {
    let shop = Shop::new("swap-pmi");
    let source = "$INPUT\nDOOR = 0/0\n$OUTPUT\nLAMP = 1/0\nHORN = 1/1\n$INTEGER\nCOUNT,LEVEL,OLD\n\
                  $TIMER\nE/RUN/DONE = 30000\n$FAULT\nBAD = \"BAD\"\n$END\n\
                  COUNT = COUNT + 1\nLAMP = DOOR\nHORN = T\nRUN = T\nOLD = 5\nBAD = T\n";
    // COUNT moves after a new variable; HORN goes, and with it what drives its line.
    let other = "$INPUT\nDOOR = 0/0\n$OUTPUT\nLAMP = 1/0\n$INTEGER\nAHEAD[20],COUNT,LEVEL,NEWS\n\
                 $TIMER\nE/RUN/DONE = 30000\n$FAULT\nBAD = \"BAD\"\n$END\n\
                 COUNT = COUNT + 1\nLAMP = /DOOR\nRUN = T\nNEWS = NEWS + 1\nBAD = T\nAHEAD[0] = 1\n";
    let moved =
        other.replace("LAMP = 1/0", "LAMP = 1/7").replace("$INTEGER\n", "$LONG\nLEVEL\n$INTEGER\n");
    let moved = moved.replace("COUNT,LEVEL,NEWS", "COUNT,NEWS");
    let artifact = shop.build("one", Dialect::Pmi, source);
    let two = shop.build("two", Dialect::Pmi, other);
    let three = shop.build("three", Dialect::Pmi, &moved);
    let (image, events) = (shop.path("image"), shop.path("events.jsonl"));
    let options = [
        "--period",
        "2",
        "--allow",
        "write,force,swap",
        "--image",
        image.to_str().unwrap(),
        "--events",
        events.to_str().unwrap(),
    ];
    let control = shop.start(&artifact, &options);
    control.assign("set", "LEVEL", 33);
    control.assign("force", "DOOR", 1);
    control.tick();
    let first_image = ImageReader::open(&image).unwrap();
    let swap = |path: &Path, more: Json| {
        let mut request = json!({"request": "swap", "path": path});
        for (key, value) in more.as_object().unwrap() {
            request[key] = value.clone();
        }
        request
    };

    let rows = [("AHEAD", "new"), ("HORN", "gone"), ("NEWS", "new"), ("OLD", "gone")];
    let dry = control.ask(&swap(&two, json!({"dry_run": true})));
    assert_eq!(changes(&dry), pairs(&rows));
    assert!(control.get("HORN") == 1 && control.get("PORT1.1") == 1);
    let counter = control.get("RUN#COUNT").as_i64().unwrap();
    let done = control.ask(&swap(&two, json!({})));
    assert_eq!(changes(&done), pairs(&rows));
    control.tick();
    assert_eq!(control.get("LEVEL"), 33, "a value is kept");
    assert_eq!(control.get("LAMP"), 0, "the new program runs, with the force on DOOR");
    assert_eq!(control.get("PORT1.1"), 0, "nobody drives this line any more");
    let now = control.get("RUN#COUNT").as_i64().unwrap();
    assert!(now > 0 && now <= counter, "the timer goes on: {counter}, then {now}");
    let status = control.ask(&json!({"request": "status"}));
    assert_eq!(status["generation"], 1);
    assert_eq!(status["forces"], json!([{"name": "DOOR", "value": "1"}]));
    // Scans of the new program count for its task.
    let scans = || control.ask(&json!({"request": "stat"}))["tasks"][0]["count"].as_u64().unwrap();
    let counted = scans();
    control.tick();
    assert!(scans() > counted);
    // COUNT is incremented in each scan, so no scan was lost.
    let values = control.ask(&json!({"request": "get", "names": ["COUNT", "NEWS"]}));
    assert_eq!(values["values"]["COUNT"], values["ticks"]);
    assert!(
        values["values"]["NEWS"].as_i64().unwrap() < values["values"]["COUNT"].as_i64().unwrap()
    );
    // The image file of this name is another one now.
    assert_eq!(first_image.read().unwrap().state, Some(State::Replaced));
    let image_now = ImageReader::open(&image).unwrap();
    assert_eq!(image_now.generation(), 1);
    assert_eq!(image_now.read().unwrap().state, Some(State::Running));

    // A type and a line that change must be accepted.
    let refused = control.reply(&swap(&three, json!({})));
    assert_eq!(refused["error"]["code"], "refused");
    let rows = [("LAMP", "changed"), ("LEVEL", "changed")];
    assert_eq!(changes(&refused["error"]), pairs(&rows));
    assert_eq!(control.refused(&swap(&three, json!({"accept": ["LAMP"]}))), "refused");
    control.ask(&swap(&three, json!({"accept": ["LAMP", "LEVEL"]})));
    control.ask(&json!({"request": "unforce", "all": true}));
    control.tick();
    assert_eq!(control.get("LEVEL"), 0, "a value of another type begins anew");
    assert_eq!((control.get("PORT1.0"), control.get("PORT1.7")), (0.into(), 1.into()));

    // Back, and back again: what only one program has is still there.
    control.assign("set", "LEVEL", 70_000);
    let back = control.ask(&json!({"request": "rollback"}));
    assert_eq!(changes(&back), pairs(&rows));
    control.tick();
    assert_eq!(control.get("LEVEL"), 33);
    assert_eq!((control.get("PORT1.0"), control.get("PORT1.7")), (1.into(), 0.into()));
    control.ask(&json!({"request": "rollback"}));
    assert_eq!(control.get("LEVEL"), 70_000);
    let (exit, text) = control.end();
    assert_eq!(exit, Some(130), "{text}");
    let events = fs::read_to_string(events).unwrap();
    assert_eq!(events.lines().count(), 1, "a fault that stays is told once: {events}");
}

/// The message of a request that is refused.
fn message(control: &Control, request: &Json) -> String {
    let reply = control.reply(request);
    reply["error"]["message"].as_str().unwrap_or_else(|| panic!("{reply}")).to_owned()
}

fn force(values: &[(&str, i64)]) -> Json {
    let values = values.iter().map(|(name, value)| json!({"name": name, "value": value}));
    json!({"request": "force", "values": values.collect::<Vec<_>>()})
}

/// A program of a PMAC moves its variables while it runs, so only the executive that runs knows whether and
/// where one can be forced.
#[test]
fn variables_that_a_program_has_moved_are_forced_where_they_are() {
    let shop = Shop::new("forced-moved");
    let source = "CLOSE\nM1->Y:$FFC2,8\nM3->Y:$FFC2,10\nM4->*\nM6->Y:$FFC2,10\nM7->Y:$FFC2,9\n\
                  OPEN PLC 1 CLEAR\n\
                  COMMAND\"M1->*\"\nCOMMAND\"M3->Y:$FFC2,9\"\nCOMMAND\"M4->Y:$FFC2,12\"\n\
                  COMMAND\"P2=1\"\nP1=1\nDISABLE PLC 1\nCLOSE\nENABLE PLC 1\nI5=2\n";
    let artifact = shop.build("one", Dialect::Pmac, source);
    let other = shop.build("other", Dialect::Pmac, &source.replace("P1=1", "P1=2"));
    let control = shop.start(&artifact, &["--allow", "write,force,swap"]);
    while control.get("P2") != 1 {
        control.tick();
    }
    let forces = || control.ask(&json!({"request": "status"}))["forces"].clone();

    let refused = message(&control, &force(&[("M3", 1), ("M1", 1)]));
    assert!(refused.contains("`M1` is not a field of an X or Y word"), "{refused}");
    assert_eq!(forces(), json!([]), "all are forced or none");
    control.tick();
    assert_eq!(control.get("Y:$FFC2"), 0);

    control.ask(&force(&[("M3", 1), ("M4", 1)]));
    control.tick();
    assert_eq!(control.get("Y:$FFC2"), 0x1200);
    // M6 has the bit that M3 had after load, and M7 the one that it has now.
    control.ask(&force(&[("M6", 1)]));
    let refused = message(&control, &force(&[("M7", 1)]));
    assert!(refused.contains("`M7` shares bits with a variable that is forced"), "{refused}");
    control.tick();
    assert_eq!(control.get("Y:$FFC2"), 0x1600);
    control.ask(&json!({"request": "unforce", "names": ["M6"]}));
    let swap = json!({"request": "swap", "path": other});
    let refused = message(&control, &swap);
    assert!(
        refused.contains("M4 is forced"),
        "after its load the other program has no M4: {refused}"
    );
    control.ask(&json!({"request": "unforce", "names": ["M4"]}));
    control.ask(&swap);
    control.assign("set", "Y:$FFC2", 0);
    control.tick();
    assert_eq!(control.get("Y:$FFC2"), 0x200, "the force holds the bit that it held before");
    control.ask(&json!({"request": "rollback"}));
    control.assign("set", "Y:$FFC2", 0);
    control.tick();
    assert_eq!(control.get("Y:$FFC2"), 0x200);
    assert_eq!(forces(), json!([{"name": "M3", "value": "1"}]));
    control.ask(&json!({"request": "unforce", "all": true}));
    control.assign("set", "Y:$FFC2", 0);
    control.tick();
    assert_eq!(control.get("Y:$FFC2"), 0);
    let (exit, text) = control.end();
    assert_eq!(exit, Some(130), "{text}");
}

fn set(values: &[(&str, i64)]) -> Json {
    let values = values.iter().map(|(name, value)| json!({"name": name, "value": value}));
    json!({"request": "set", "values": values.collect::<Vec<_>>()})
}

/// What would have no effect is refused, with what to do instead; all variables of a request are set, or none.
#[test]
fn setting_what_a_force_holds_is_refused() {
    let shop = Shop::new("set-forced");
    let pmac = "CLOSE\nM1->Y:$FFC2,8\nM2->Y:$FFC2,9,8\n";
    let nct = ":000 J0\n:001 J1\n";
    for (name, dialect, source, forced, partly, free) in [
        ("pmi", Dialect::Pmi, PUMP, "DOOR", "PORT0.0", "LEVEL"),
        ("pmac", Dialect::Pmac, pmac, "M1", "Y:$FFC2", "M2"),
        ("nct", Dialect::Nct, nct, "I003", "I00", "I004"),
        ("nct-outputs", Dialect::Nct, nct, "O003", "Y003", "O004"),
    ] {
        let artifact = shop.build(name, dialect, source);
        let control = shop.start(&artifact, &["--allow", "force,write"]);
        control.assign("force", forced, 1);
        control.tick();
        let refused = message(&control, &set(&[(free, 1), (forced, 0)]));
        let expected = format!(
            "`{forced}` is forced, so that setting it would do nothing; end its force first (unforce), or force it to \
             another value (force)"
        );
        assert_eq!(refused, expected, "{name}");
        control.tick();
        assert_eq!(control.get(free), 0, "{name}: all are set or none");
        let output = control.plcctl(&["set", &format!("{forced}=0")]);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(1), "{name}: {said}");
        assert!(said.contains(&expected), "{name}: {said}");
        // Something comes of setting a word with other bits, a line, or the variable of an output.
        control.assign("set", partly, 0);
        control.assign("set", free, 1);
        control.ask(&json!({"request": "unforce", "names": [forced]}));
        control.assign("set", forced, 0);
        control.end();
    }
}

/// The same for an input that another process gives, or that is safe since that process has gone.
#[test]
fn setting_what_another_process_gives_is_refused() {
    let shop = Shop::new("set-given");
    let artifact = shop.build("pump", Dialect::Pmi, PUMP);
    let image = shop.path("image");
    let options = ["--allow", "force,write", "--image", image.to_str().unwrap()];
    let control = shop.start(&artifact, &options);
    control.assign("set", "DOOR", 1);
    let mut writer = plcc_image::InputWriter::open(&image, "a driver").unwrap();
    let [door, count] = ["DOOR", "COUNT"].map(|name| writer.claim(name).unwrap());
    writer.set(door, plcc_image::Number::Int(0)).unwrap();
    writer.set(count, plcc_image::Number::Int(0)).unwrap();
    writer.publish().unwrap();
    let start = Instant::now();
    while control.get("DOOR") != 0 {
        assert!(start.elapsed() < HANGS);
        control.tick();
    }
    let expected = "`DOOR` is given by another process by the image file ([[io]]), so that setting it would do nothing; \
                    force it instead (force)";
    assert_eq!(message(&control, &set(&[("DOOR", 1)])), expected);
    // It is given once, and the program changes it itself.
    control.assign("set", "COUNT", 1000);
    control.assign("force", "DOOR", 1);
    control.tick();
    assert_eq!(control.get("DOOR"), 1);
    drop(writer);
    control.tick();
    control.tick();
    assert!(message(&control, &set(&[("DOOR", 1)])).contains("is forced"));
    control.ask(&json!({"request": "unforce", "all": true}));
    assert_eq!(message(&control, &set(&[("DOOR", 1)])), expected, "it has its safe value");
    control.end();
}

/// Of two forces on the same bits only one would be in effect, though both were told.
#[test]
fn bits_that_are_forced_are_not_forced_by_another_name() {
    let shop = Shop::new("forced-twice");
    let pmac = "CLOSE\nM1->Y:$FFC2,8\nM2->Y:$FFC2,8,8\nM3->Y:$FFC2,9\n";
    let nct = ":000 J0\n:001 J1\n";
    for (name, dialect, source, taken, others, free) in [
        ("pmac", Dialect::Pmac, pmac, "M1", ["M2", "Y:$FFC2"], "M3"),
        ("nct", Dialect::Nct, nct, "Y003", ["Y00", "O003"], "Y004"),
        ("nct-inputs", Dialect::Nct, nct, "I00", ["I007", "P010"], "I020"),
    ] {
        let artifact = shop.build(name, dialect, source);
        let control = shop.start(&artifact, &["--allow", "force"]);
        control.assign("force", taken, 1);
        control.assign("force", taken, 0);
        for other in others {
            let refused = message(&control, &force(&[(other, 0)]));
            assert!(refused.contains("shares bits with "), "{name}: {refused}");
            assert!(refused.contains(" is forced; end that force first"), "{name}: {refused}");
        }
        control.assign("force", free, 1);
        control.ask(&json!({"request": "unforce", "names": [taken, free]}));
        control.assign("force", others[0], 1);
        control.end();
    }
}

/// Neither a change that was accepted nor a rollback makes a force on an input one on an output.
#[test]
fn a_force_does_not_pass_to_another_input_or_output() {
    let shop = Shop::new("swap-forced");
    let artifact = shop.build("one", Dialect::Pmi, "$OUTPUT\nLAMP = 1/0\n$END\nLAMP = F\n");
    let other = shop.build("other", Dialect::Pmi, "$INPUT\nLAMP = 1/0\n$END\n");
    let control = shop.start(&artifact, &["--allow", "force,swap"]);
    let swap = json!({"request": "swap", "path": other, "accept": ["LAMP"]});
    control.assign("force", "LAMP", 0);
    assert_eq!(control.refused(&swap), "refused");
    control.ask(&json!({"request": "unforce", "all": true}));
    control.ask(&swap);
    control.assign("force", "LAMP", 1);
    let rollback = json!({"request": "rollback"});
    assert_eq!(control.refused(&rollback), "refused");
    control.ask(&json!({"request": "unforce", "all": true}));
    control.ask(&rollback);
    control.tick();
    assert_eq!(control.get("PORT1.0"), 0, "the program drives the line");
    let (status, text) = control.end();
    assert_eq!(status, Some(130), "{text}");
}

/// The image file of the new program shows the outputs as they are, also if no tick of it has run.
#[test]
fn outputs_stay_safe_when_a_stopped_program_is_exchanged() {
    let shop = Shop::new("swap-stopped");
    let artifact = shop.build("pump", Dialect::Pmi, PUMP);
    let image = shop.path("image");
    let image_option = image.to_str().unwrap();
    let options = ["--allow", "swap,stop", "--image", image_option, "--safe", "LAMP=1"];
    let control = shop.start(&artifact, &options);
    let seen = || {
        let reader = ImageReader::open(&image).unwrap();
        let snapshot = reader.read().unwrap();
        (reader.generation(), snapshot.state, snapshot.image)
    };
    control.ask(&json!({"request": "stop"}));
    let (_, _, stopped) = seen();
    for (generation, request) in
        [(1, json!({"request": "swap", "path": artifact})), (2, json!({"request": "rollback"}))]
    {
        control.ask(&request);
        assert!(seen() == (generation, Some(State::Stopped), stopped.clone()), "{request}");
    }
    let (status, text) = control.end();
    assert_eq!(status, Some(130), "{text}");
}

#[test]
fn what_is_no_other_version_of_the_program_is_refused() {
    let shop = Shop::new("swap-refused");
    let artifact = shop.build("pump", Dialect::Pmi, PUMP);
    let nct = shop.build("nct", Dialect::Nct, ":000 J0\n:001 J1\n");
    let gone = shop.build("gone", Dialect::Pmi, &PUMP.replace("LEVEL", "OTHER"));
    let damaged = shop.path("damaged.plcx");
    let mut bytes = fs::read(&artifact).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(&damaged, bytes).unwrap();
    let trace = shop.path("trace.csv");
    let options = [
        "--period",
        "2",
        "--allow",
        "force,swap",
        "--watch",
        "COUNT,LEVEL",
        "--trace",
        trace.to_str().unwrap(),
    ];
    let control = shop.start(&artifact, &options);
    for (path, reason) in [
        (&nct, "it is a program in NCT, and the program that runs is in PMI"),
        (&damaged, "corrupt"),
        (&shop.path("missing.plcx"), "no such file"),
        (&gone, "LEVEL"),
    ] {
        let reply = control.reply(&json!({"request": "swap", "path": path, "accept": ["all"]}));
        let message = reply["error"]["message"].as_str().unwrap_or_else(|| panic!("{reply}"));
        assert!(message.contains(reason), "{message}");
    }
    // What is forced must be there.
    let without = shop.build(
        "without",
        Dialect::Pmi,
        &PUMP.replace("DOOR = 0/0", "GATE = 0/0").replace("= DOOR", "= GATE"),
    );
    control.assign("force", "DOOR", 1);
    let swap = json!({"request": "swap", "path": without, "accept": ["all"]});
    assert!(control.reply(&swap)["error"]["message"].as_str().unwrap().contains("DOOR is forced"));
    control.ask(&json!({"request": "unforce", "all": true}));
    control.ask(&swap);
    control.tick();
    assert_eq!(control.get("GATE"), 0);
    let (exit, text) = control.end();
    assert_eq!(exit, Some(130), "{text}");
    // The trace shows the same variables all along.
    let trace = fs::read_to_string(trace).unwrap();
    let counts = trace.lines().filter(|row| row.contains(",COUNT,")).count();
    assert!(counts > 10, "{trace}");
}

#[test]
fn nct_programs_are_exchanged() {
    let shop = Shop::new("swap-nct");
    // :000 counts its beginnings in F500, and in F506 how often it comes back from a subroutine, which
    // loops while F700 is 1.
    let module = ":000 LF500 +.1 SF500 C020 LF506 +.1 SF506 J0\n";
    let subroutine = ":020 :010 LF502 +.1 SF502 (F7000)G010Z R\n";
    let source = format!(":001 LRH060 A1 SF510 J1\n{module}{subroutine}");
    // The other call, which stands before it, gives the call in :000 another number.
    let two = ":001 LRH060 +.1 SF510 C030 J1\n:030 LF512 +.1 SF512 (F5140)G030Z R\n";
    let two = format!("{two}{module}{subroutine}");
    let three = two.replace("LF502 +.1", "LF502 +.2");
    let artifact = shop.build("one", Dialect::Nct, &source);
    let same = shop.path("same.plcx");
    fs::copy(&artifact, &same).unwrap();
    let two = shop.build("two", Dialect::Nct, &two);
    let three = shop.build("three", Dialect::Nct, &three);
    let control = shop.start(&artifact, &["--allow", "write,force,swap", "--record", "r.plcrec"]);
    control.assign("set", "T05", 30_000);
    control.assign("set", "F600", 0x1234);
    control.assign("set", "F700", 1);
    control.assign("force", "I012", 1);
    control.tick();
    let starts = control.get("F500");
    control.ask(&json!({"request": "swap", "path": same}));
    control.tick();
    assert_eq!(control.get("F500"), starts, "with the same code :000 goes on where it was");
    let done = control.ask(&json!({"request": "swap", "path": two}));
    assert_eq!(changes(&done), pairs(&[("F512", "new"), ("F5140", "new")]));
    control.tick();
    assert_eq!(control.get("F500"), starts, "it does where only another module has changed");
    let ends = control.get("F506").as_i64().unwrap();
    control.assign("set", "F700", 0);
    control.tick();
    assert!(control.get("F506").as_i64().unwrap() > ends, "it goes on after its own call");
    control.assign("set", "F700", 1);
    control.tick();
    let starts = control.get("F500").as_i64().unwrap();
    control.ask(&json!({"request": "swap", "path": three}));
    control.tick();
    let begun = control.get("F500");
    assert_eq!(begun, starts + 1, "where its subroutine has changed it begins at its label");
    assert_eq!((control.get("F600"), control.get("I012")), (0x1234.into(), 1.into()));
    let timer = control.get("T05").as_i64().unwrap();
    assert!((1..30_000).contains(&timer), "{timer}");
    assert_eq!(control.get("F510"), 1, "the new program runs");
    assert_eq!(control.end().0, Some(130));
    assert_eq!(replayed_programs(&shop.path("r.plcrec")), 4);
}

#[test]
fn pmac_programs_are_exchanged() {
    let shop = Shop::new("swap-pmac");
    let source = "I5=2\nI8=20\nM1->Y:$FFC2,8,1\nP5=1\nOPEN PLC 1 CLEAR\nP1=P1+1\nM1=1\nCLOSE\n\
                  OPEN PLC 2 CLEAR\nP2=P2+1\nWHILE (P9=0)\nP3=P3+1\nENDWHILE\nCLOSE\n\
                  OPEN PLC 3 CLEAR\nP4=P4+1\nCLOSE\n";
    let moved = source
        .replace("$FFC2,8", "$FFC2,9")
        .replace("P5=1", "P5=2")
        .replace("P1=P1+1", "P1=P1+0.5");
    let moved = moved.replace("I5=2", "I5=3").replace("OPEN PLC 3", "OPEN PLC 7");
    let artifact = shop.build("one", Dialect::Pmac, source);
    let same = shop.path("same.plcx");
    fs::copy(&artifact, &same).unwrap();
    let two = shop.build("two", Dialect::Pmac, &moved);
    let other = source.replace("P3=P3+1", "P3=P3+2");
    let three = shop.build("three", Dialect::Pmac, &other);
    let control = shop.start(&artifact, &["--allow", "write,force,swap", "--record", "r.plcrec"]);
    control.assign("set", "P100", "2.5");
    for _ in 0..3 {
        control.tick();
    }
    let entered = control.get("P2");
    assert_eq!((entered.clone(), control.get("Y:$FFC2")), (1.into(), 256.into()));
    control.ask(&json!({"request": "swap", "path": same}));
    for _ in 0..3 {
        control.tick();
    }
    assert_eq!(control.get("P2"), 1, "with the same code a PLC goes on in its WHILE");
    let refused = control.reply(&json!({"request": "swap", "path": two}));
    let rows = [("I5", "changed"), ("M1", "changed"), ("PLC3", "gone"), ("PLC7", "new")];
    assert_eq!(changes(&refused["error"]), pairs(&rows));
    control.ask(&json!({"request": "swap", "path": two, "accept": ["M1", "PLC3"]}));
    for _ in 0..6 {
        control.tick();
    }
    assert_eq!(control.get("P2"), 1, "it does where only other PLCs have changed");
    assert_eq!(control.get("P100"), 2.5);
    assert_eq!(control.get("P5"), 1, "on-line commands are not executed again");
    assert_eq!((control.get("I5"), control.get("Y:$FFC2")), (3.into(), 768.into()));
    let before = control.get("P4").as_f64().unwrap();
    control.tick();
    assert!(control.get("P4").as_f64().unwrap() >= before);
    control.ask(&json!({"request": "rollback"}));
    for _ in 0..6 {
        control.tick();
    }
    assert_eq!((control.get("I5"), control.get("P2")), (2.into(), 1.into()));
    control.ask(&json!({"request": "swap", "path": three}));
    for _ in 0..3 {
        control.tick();
    }
    assert_eq!(control.get("P2"), 2, "where its own statements have changed it begins at its top");
    let (exit, text) = control.end();
    assert_eq!(exit, Some(130), "{text}");
    assert_eq!(replayed_programs(&shop.path("r.plcrec")), 5);
}

/// Motion program 10 runs until P1 is set.
const MOVING: &str = "I5=2\nI100=1\nI116=50 I117=0.5 I187=10 I188=0 I190=1000\n&1\n#1->1000X\nM1->Y:$FFC2,8,1\n\
                      OPEN PROG 10 CLEAR\nLINEAR INC F20\nWHILE (P1=0)\nX0.01\nENDWHILE\nP2=P2+1\nCLOSE\n\
                      OPEN PLC 1 CLEAR\nP3=P3+1\nCLOSE\n&1B10R\n";

#[test]
fn an_online_change_waits_for_a_motion_program_and_holds_up_nobody() {
    let shop = Shop::new("swap-motion");
    let artifact = shop.build("one", Dialect::Pmac, MOVING);
    let two = shop.build("two", Dialect::Pmac, &MOVING.replace("X0.01", "X0.02"));
    let three = shop.build("three", Dialect::Pmac, &MOVING.replace("P3=P3+1", "P3=P3+2"));
    let options = ["--allow", "write,force,swap", "--simulate", "--record", "r.plcrec"];
    let control = shop.start(&artifact, &options);
    let runs = || control.get("&1.PROG") == 10;
    assert!(runs());
    control.ask(&json!({"request": "swap", "path": three}));
    assert!(runs() && control.get("P2") == 0, "where only PLCs differ nothing waits");

    let message = |reply: &Json| {
        assert_eq!(reply["ok"], false, "{reply}");
        reply["error"]["message"].as_str().unwrap().to_owned()
    };
    let swap = |wait: f64| json!({"request": "swap", "path": two, "wait": wait});
    for wait in [0.0, 0.2] {
        let why = message(&control.reply(&swap(wait)));
        let expected = format!("has waited {wait} s for its end");
        assert!(why.contains("a motion program runs") && why.contains(&expected), "{why}");
    }
    assert_eq!(control.refused(&swap(-1.0)), "bad_value");

    // It waits, and other clients are served meanwhile.
    let ask_to_wait = |request: &Json| {
        let mut request = request.clone();
        request["version"] = 1.into();
        let mut client = control.connect();
        client.get_mut().write_all(format!("{request}\n").as_bytes()).unwrap();
        let start = Instant::now();
        while waiting(&control).is_null() {
            assert!(start.elapsed() < HANGS, "the change does not wait");
            thread::sleep(Duration::from_millis(1));
        }
        client
    };
    let answer = |client: &mut BufReader<UnixStream>| {
        let mut line = String::new();
        client.read_line(&mut line).unwrap();
        serde_json::from_str::<Json>(&line).unwrap_or_else(|error| panic!("{error}: {line}"))
    };
    let mut client = ask_to_wait(&swap(600.0));
    let shown = waiting(&control);
    assert!(shown["program"].as_str().unwrap().ends_with("two.plcx"), "{shown}");
    assert!(shown["seconds_left"].as_f64().unwrap() > 1.0, "{shown}");
    for _ in 0..20 {
        let before = control.get("P3").as_f64().unwrap();
        control.tick();
        assert!(control.get("P3").as_f64().unwrap() > before, "the program goes on");
    }
    control.assign("force", "M1", 1);
    for request in [swap(1.0), json!({"request": "rollback"})] {
        assert!(message(&control.reply(&request)).contains("another online change waits"));
    }
    assert!(runs() && !waiting(&control).is_null());
    control.assign("set", "P1", 1);
    let done = answer(&mut client);
    assert_eq!((&done["ok"], &done["result"]["generation"]), (&true.into(), &2.into()), "{done}");
    assert!(waiting(&control).is_null());
    let status = control.ask(&json!({"request": "status"}));
    assert_eq!(status["forces"], json!([{"name": "M1", "value": "1"}]));
    control.tick();
    assert_eq!(control.get("Y:$FFC2"), 256, "the force has gone over");
    assert_eq!(control.get("P2"), 1);

    // Back again, but somebody cancels that, or its client leaves.
    let again = || {
        control.assign("set", "P1", 0);
        control.assign("set", "&1R", 1);
        while !runs() {
            thread::sleep(Duration::from_millis(1));
        }
    };
    again();
    assert!(message(&control.reply(&json!({"request": "cancel"}))).contains("no online change"));
    let rollback = json!({"request": "rollback", "wait": 600});
    let mut client = ask_to_wait(&rollback);
    control.ask(&json!({"request": "cancel"}));
    let why = message(&answer(&mut client));
    assert!(why.contains("given up") && why.contains("has cancelled it"), "{why}");
    drop(ask_to_wait(&rollback));
    let start = Instant::now();
    while !waiting(&control).is_null() {
        assert!(start.elapsed() < HANGS, "a change whose client has left does not end");
        thread::sleep(Duration::from_millis(1));
    }
    let mut client = ask_to_wait(&rollback);
    control.assign("set", "P1", 1);
    let done = answer(&mut client);
    assert_eq!((&done["ok"], &done["result"]["generation"]), (&true.into(), &3.into()), "{done}");
    let (exit, text) = control.end();
    assert_eq!(exit, Some(130), "{text}");
    assert_eq!(replayed_programs(&shop.path("r.plcrec")), 4);
}

/// The online change that waits.
fn waiting(control: &Control) -> Json {
    control.ask(&json!({"request": "status"}))["waiting_change"].clone()
}

#[test]
fn stimulus_and_trace_go_on_with_the_program_that_runs_then() {
    let shop = Shop::new("swap-stimulus");
    let body = "$END\nIF (GO)\nN = N + 1\nENDIF\nM = M + 1\n";
    // Of the second program each variable has another number and another place.
    let one = shop.build("one", Dialect::Pmi, &format!("$LOGICAL\nGO\n$INTEGER\nN,M\n{body}"));
    let two = format!("$LOGICAL\nHALT,GO\n$INTEGER\nL,N,M\n{body}");
    let two = shop.build("two", Dialect::Pmi, &two);
    let mut options = vec!["--allow", "swap", "--record", "r.plcrec", "--stimulus", "s.csv"];
    options.extend(["--watch", "*", "--trace", "t.csv"]);
    let mut acts = 60;
    // The stimulus is to act on the second program. On a slow computer it must come later for that.
    let control = loop {
        fs::write(shop.path("s.csv"), format!("tick,name,value\n{acts},GO,1\n")).unwrap();
        let control = shop.start(&one, &options);
        let done = control.ask(&json!({"request": "swap", "path": two}));
        if done["ticks"].as_u64().unwrap() < acts {
            break control;
        }
        assert_eq!(control.end().0, Some(130));
        fs::remove_file(shop.path("r.plcrec")).unwrap();
        acts *= 4;
    };
    let start = Instant::now();
    while control.get("N") == 0 {
        assert!(start.elapsed() < HANGS, "the stimulus does not act");
        thread::sleep(Duration::from_millis(10));
    }
    assert_eq!(control.end().0, Some(130));
    assert_eq!(replayed_programs(&shop.path("r.plcrec")), 2);
    // M counts the ticks in both programs.
    let trace = fs::read_to_string(shop.path("t.csv")).unwrap();
    let rows = trace.lines().filter_map(|row| row.split_once(",M,"));
    let rows: Vec<(u64, u64)> =
        rows.map(|(tick, value)| (tick.parse().unwrap(), value.parse().unwrap())).collect();
    assert!(rows.last().unwrap().0 > acts, "{trace}");
    assert!(rows.iter().all(|(tick, value)| tick + 1 == *value), "{trace}");
}

/// Runs a recorded run again, through all its online changes, writes and forces; every tick must go as it was
/// recorded. Gives how many programs ran, one after the other.
fn replayed_programs(record: &Path) -> usize {
    let recording = Recording::open(record).unwrap();
    let run = recording.last_run().unwrap();
    let generations = run.generations();
    for &generation in &generations {
        let found = Found::in_record(run.program_of(generation).unwrap()).unwrap();
        let mut engine = found.engine(ReplayEngine::Aot).unwrap();
        let executive = recorded_executive(&run.header, &found.program).unwrap();
        let mut replayer = Replayer::new(&recording, run, generation, executive);
        while let Some(replayed) = replayer.step(engine.as_mut(), &mut vec![]).unwrap() {
            assert!(replayed.matches && !replayed.after_gap, "{generation}: {replayed:?}");
        }
        if Some(&generation) == generations.last() {
            assert!(replayer.end().unwrap().1, "the hash after the last tick");
        }
    }
    generations.len()
}

/// What clients do in [`ticks_go_on_whatever_clients_do`].
#[derive(Clone, Copy, Debug, PartialEq)]
enum Clients {
    /// There are none.
    None,
    /// They ask as fast as they can, and read the replies.
    Flood,
    /// They ask for much, and read nothing.
    Stall,
    /// They connect, send a part of a request, and leave.
    Leave,
}

/// Does what clients do until `end`; how many requests or connections there were.
fn act(clients: Clients, socket: &Path, end: Instant) -> u64 {
    let get = b"{\"version\":1,\"request\":\"get\",\"names\":[\"*\"]}\n";
    let mut count = 0;
    let mut stalled = vec![];
    while Instant::now() < end || count == 0 {
        let Ok(stream) = UnixStream::connect(socket) else { continue };
        let timeout = Some(Duration::from_millis(20));
        stream.set_write_timeout(timeout).unwrap();
        stream.set_read_timeout(timeout).unwrap();
        match clients {
            Clients::None => thread::sleep(Duration::from_millis(1)),
            Clients::Flood => {
                let mut stream = BufReader::new(stream);
                let mut line = String::new();
                while (Instant::now() < end || count == 0)
                    && stream.get_mut().write_all(get).is_ok()
                {
                    count += 1;
                    if count % 8 == 0 {
                        line.clear();
                        let _ = stream.read_line(&mut line);
                    }
                }
            }
            Clients::Stall => {
                let _ = (&stream).write_all(&get.repeat(1000));
                stalled.push(stream);
                count += 1;
                if stalled.len() > 20 {
                    stalled.remove(0);
                }
            }
            Clients::Leave => {
                let _ = (&stream).write_all(&get[..20]);
                count += 1;
            }
        }
    }
    count
}

/// Ticks go on while clients misbehave. When they end is measured besides, with and without clients, and printed as a table
/// of how much later than after their period; PLCC_SECONDS says how long each measurement takes.
#[test]
fn ticks_go_on_whatever_clients_do() {
    let seconds = std::env::var("PLCC_SECONDS").ok().and_then(|text| text.parse().ok());
    let time = Duration::from_secs_f64(seconds.unwrap_or(0.5));
    let shop = Shop::new("delays");
    let artifact = shop.build("pump", Dialect::Pmi, PUMP);
    let image = PathBuf::from(format!("/dev/shm/plcc-delays-{}", std::process::id()));
    let options = ["--period", "1", "--image", image.to_str().unwrap()];
    let control = shop.start(&artifact, &options);
    let reader = ImageReader::open(&image).unwrap();
    println!("clients\trequests\tticks seen\tp50 us\tp99 us\tp99.9 us\tmax us");
    for clients in [Clients::None, Clients::Flood, Clients::Stall, Clients::Leave] {
        let end = Instant::now() + time;
        let threads: Vec<_> = (0..if clients == Clients::None { 0 } else { 4 })
            .map(|_| {
                let socket = control.socket.clone();
                thread::spawn(move || act(clients, &socket, end))
            })
            .collect();
        // The time from one tick to the next beyond a period, where both were seen.
        let mut last = reader.read().unwrap();
        let mut late = vec![];
        while Instant::now() < end || late.is_empty() {
            thread::sleep(Duration::from_micros(200));
            let now = reader.read().unwrap();
            let ticks = now.ticks - last.ticks;
            if ticks > 0 {
                late.push((now.time - last.time).saturating_sub(ticks * 1_000_000) / 1000);
                last = now;
            }
        }
        let requests: u64 = threads.into_iter().map(|thread| thread.join().unwrap()).sum();
        assert!(!late.is_empty(), "no tick was seen");
        assert_eq!(requests > 0, clients != Clients::None, "{clients:?}");
        late.sort_unstable();
        let quantile = |part: f64| late[((late.len() - 1) as f64 * part) as usize];
        println!(
            "{clients:?}\t{requests}\t{}\t{}\t{}\t{}\t{}",
            late.len(),
            quantile(0.5),
            quantile(0.99),
            quantile(0.999),
            quantile(1.0)
        );
    }
    assert_eq!(control.ask(&json!({"request": "status"}))["state"], "running");
    let (exit, text) = control.end();
    assert_eq!(exit, Some(130), "{text}");
    fs::remove_file(image).unwrap();
}

/// The operator's screen of a control, when `is_there` is true of it.
fn operator_screen(control: &Control, is_there: impl Fn(&Json) -> bool) -> Json {
    let start = Instant::now();
    loop {
        let screen = control.ask(&json!({"request": "operator"}));
        if is_there(&screen) {
            return screen;
        }
        assert!(start.elapsed() < HANGS, "{screen}");
        thread::sleep(Duration::from_millis(5));
    }
}

const COOLANT: &str = "$FAULT\nFLT=\"COOLANT LOW\"\n$END\n@CL103=@CP103\nFLT=@CP103\n@FRO=80\n";

#[test]
fn an_operator_presses_the_keys_that_the_program_uses_and_changes_nothing_else() {
    let shop = Shop::new("operator");
    let artifact = shop.build_for_operators("coolant", Dialect::Pmi, COOLANT);
    let control = shop.start(&artifact, &["--allow", "operate"]);
    let screen = operator_screen(&control, |screen| screen["overrides"][0]["value"] == "80");
    assert_eq!((&screen["may_press"], &screen["active"]), (&true.into(), &json!([])));
    let keys = screen["keys"].as_array().unwrap();
    // Of the control's many keys the program uses one, which people call by its text.
    assert_eq!(keys.len(), 1, "{screen}");
    assert_eq!((&keys[0]["label"], &keys[0]["light"]), (&"coolant".into(), &false.into()));
    let variable = keys[0]["variable"].as_str().unwrap();
    let press = |on: bool| json!({"request": "press", "name": variable, "on": on});
    // A key is pressed as long as its client is connected.
    let client = control.connect();
    control.ask(&press(true));
    let screen = operator_screen(&control, |screen| screen["keys"][0]["light"] == true);
    assert_eq!(screen["keys"][0]["pressed"], true);
    let fault = json!([{"kind": "fault", "name": "FLT", "text": "COOLANT LOW", "since": null}]);
    operator_screen(&control, |screen| screen["active"] == fault);
    control.ask(&press(false));
    operator_screen(&control, |screen| screen["active"] == json!([]));
    control.ask(&press(true));
    operator_screen(&control, |screen| screen["active"] == fault);
    drop(client);
    operator_screen(&control, |screen| screen["active"] == json!([]));

    for name in ["FLT", "@CL103", "@CP104", "@FRO", "NOTHING"] {
        let press = json!({"request": "press", "name": name, "on": true});
        assert_eq!(control.refused(&press), "refused", "{name}");
    }
    let set = json!({"request": "set", "values": [{"name": "@CP103", "value": 1}]});
    for request in [set, json!({"request": "stop"}), json!({"request": "rollback"})] {
        assert_eq!(control.refused(&request), "denied");
    }
    let shown = control.plcctl(&["operator", "--json"]);
    assert!(String::from_utf8(shown.stdout).unwrap().contains("\"label\":\"coolant\""));
    let unfit = control.plcctl(&["operator"]);
    assert_eq!(unfit.status.code(), Some(2), "its output is not a terminal");
    // As a user ends it, so that its socket is gone.
    control.end();

    // Without any permission it is shown all the same.
    let control = shop.start(&artifact, &[]);
    assert_eq!(operator_screen(&control, |_| true)["may_press"], false);
    assert_eq!(control.refused(&press(true)), "denied");
}

#[test]
fn an_operator_of_an_nct_sees_messages_and_softkeys() {
    let shop = Shop::new("operator-nct");
    let source = ":001\nI401 U401 Z\nI401 U710 Z\nJ1\n:000\nJ0\n:199\nDOOR OPEN$\n";
    let artifact = shop.build_for_operators("door", Dialect::Nct, source);
    let control = shop.start(&artifact, &["--allow", "write"]);
    let screen = operator_screen(&control, |_| true);
    let labels: Vec<&Json> =
        screen["keys"].as_array().unwrap().iter().map(|key| &key["label"]).collect();
    assert_eq!(labels, ["HNDL"], "{screen}");
    let _client = control.connect();
    control.ask(&json!({"request": "press", "name": "I401", "on": true}));
    let screen = operator_screen(&control, |screen| screen["active"] != json!([]));
    let message = json!({"kind": "message", "name": "Y710", "text": "DOOR OPEN", "since": null});
    assert_eq!(screen["active"], json!([message]));
}

#[test]
fn an_artifact_without_an_operators_screen_runs_and_says_so() {
    let shop = Shop::new("operator-older");
    let older = shop.build("older", Dialect::Pmi, COOLANT);
    let control = shop.start(&older, &["--allow", "operate,swap"]);
    for request in
        [json!({"request": "operator"}), json!({"request": "press", "name": "@CP103", "on": true})]
    {
        let reply = control.reply(&request);
        let message = reply["error"]["message"].as_str().unwrap();
        assert!(message.contains("build it again with plcc build"), "{reply}");
    }
    // A version with one can take its place, and the other way round.
    let newer = shop.build_for_operators("newer", Dialect::Pmi, COOLANT);
    control.ask(&json!({"request": "swap", "path": newer}));
    operator_screen(&control, |screen| screen["keys"] != json!([]));
    control.ask(&json!({"request": "rollback"}));
    assert_eq!(control.refused(&json!({"request": "operator"})), "refused");
}
