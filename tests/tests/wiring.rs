//! Inputs that other processes give by the image file, in a running control: the configuration's safe
//! values and timeouts, the journal, and a replay that goes exactly the same way.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, clippy::panic, clippy::indexing_slicing)]

use std::fs;
use std::time::Duration;

use plcc::recorded::{Found, ReplayEngine};
use plcc_abi::Dialect;
use plcc_host::session::replay::recorded_executive;
use plcc_image::{ImageReader, InputWriter, Number};
use plcc_record::{Recording, Replayer};
use plcc_tests::loader::{Folder, plcio, wait_until};

/// Counts the scans in which the door is open; the pump runs while the door is closed.
const PMI: &str = "$INPUT\nDOOR = 0/0\nLEVEL = 1/0-3/B\n$OUTPUT\nPUMP = 2/0\nCOPY = 3/0-3/B\n$INTEGER\nN\n\
                   $END\nPUMP = /DOOR\nCOPY = LEVEL\nIF (DOOR)\n N = N + 1\nENDIF\n";

const CONFIGURATION: &str = "artifact = \"p.plcx\"\nimage = \"image\"\nperiod = 2\nlog = \"log.jsonl\"\n\
    watchdog = \"1h\"\noverrun = \"catch-up=100000\"\n\
    [[io]]\nname = \"DOOR\"\ndriver = \"other\"\nsafe = 1\ntimeout_ms = 300\n\
    [[io]]\nname = \"LEVEL\"\ndriver = \"other\"\nsafe = \"hold\"\ntimeout_ms = 300\n\
    [[io]]\nname = \"PUMP\"\ndriver = \"other\"\n";

#[test]
fn inputs_come_by_the_image_file_become_safe_and_recover() {
    let folder = Folder::new("wiring");
    folder.artifact("p.plcx", Dialect::Pmi, PMI);
    fs::write(folder.path("c.toml"), CONFIGURATION).unwrap();
    let mut control = folder.start(&["--config", "c.toml"]);
    let path = folder.path("image");
    wait_until("the control goes on", || {
        ImageReader::open(&path).is_ok_and(|image| image.last_tick() != 0)
    });
    let image = ImageReader::open(&path).unwrap();
    let symbols = image.symbols();
    let line = |name: &str| {
        let symbol = symbols.iter().find(|symbol| symbol.name == name).unwrap();
        image.read().unwrap().output(symbol).unwrap()
    };
    assert_eq!(line("PUMP"), Number::Int(0), "an input has its safe value from the first tick on");
    let mut writer = InputWriter::open(&path, "a driver").unwrap();
    let (door, level) = (writer.claim("DOOR").unwrap(), writer.claim("LEVEL").unwrap());
    wait_until("the control goes on", || {
        writer.set(door, Number::Int(0)).unwrap();
        writer.set(level, Number::Int(9)).unwrap();
        writer.publish().unwrap();
        std::thread::sleep(Duration::from_millis(5));
        (line("PUMP"), line("COPY")) == (Number::Int(1), Number::Int(9))
    });
    // The writer is late: the door counts as open, the level stays what it is.
    wait_until("the control goes on", || line("PUMP") == Number::Int(0));
    assert_eq!(line("COPY"), Number::Int(9));
    wait_until("the control goes on", || {
        writer.set(door, Number::Int(0)).unwrap();
        writer.publish().unwrap();
        line("PUMP") == Number::Int(1)
    });
    drop(writer);
    wait_until("the control goes on", || line("PUMP") == Number::Int(0));
    control.signal("TERM", 1);
    assert_eq!(control.end().code(), Some(130));
    let log = folder.read("log.jsonl");
    for change in ["begun", "late", "recovered", "released"] {
        assert!(log.contains(&format!("\"change\":\"{change}\",\"writer\":\"a driver\"")), "{log}");
    }
    // What was given is in the record: the replay of every tick comes to the same state.
    let recording = Recording::open(&folder.path("c.plcrec")).unwrap();
    let run = recording.last_run().unwrap();
    let found = Found::in_record(run.programs.first().unwrap()).unwrap();
    let mut engine = found.engine(ReplayEngine::Aot).unwrap();
    let executive = recorded_executive(&run.header, &found.program).unwrap();
    let mut replayer = Replayer::new(&recording, run, 0, executive);
    let (mut ticks, mut events) = (0, vec![]);
    while let Some(replayed) = replayer.step(engine.as_mut(), &mut events).unwrap() {
        assert!(replayed.matches, "{replayed:?}");
        ticks += 1;
    }
    assert!(ticks > 100, "{ticks}");
}

/// An entry, a driver and the socket take the aliases of `[names]`.
#[test]
fn names_that_people_gave_are_wired() {
    let folder = Folder::new("wiring-names");
    let names = "[names]\nDOOR = { alias = \"Gate\" }\nPUMP = { alias = \"COOLANT\" }\n";
    folder.artifact_of("p.plcx", Dialect::Pmi, PMI, names);
    let configuration =
        CONFIGURATION.replace("\"DOOR\"", "\"gate\"").replace("\"PUMP\"", "\"Coolant\"");
    fs::write(folder.path("c.toml"), configuration).unwrap();
    let checked = folder.run(&["check-config", "c.toml"]);
    assert!(checked.status.success(), "{checked:?}");
    let mut control = folder.start(&["--config", "c.toml", "--safe", "COOLANT=hold"]);
    let path = folder.path("image");
    wait_until("the control goes on", || {
        ImageReader::open(&path).is_ok_and(|image| image.last_tick() != 0)
    });
    let image = ImageReader::open(&path).unwrap();
    let symbols = image.symbols();
    let pump = symbols.iter().find(|symbol| symbol.is_called("COOLANT")).unwrap();
    assert_eq!(pump.name, "PUMP");
    let mut writer = InputWriter::open(&path, "a driver").unwrap();
    let door = writer.claim("Gate").unwrap();
    assert_eq!(writer.symbol(door).map(|symbol| symbol.name.as_str()), Some("DOOR"));
    wait_until("the pump runs", || {
        writer.set(door, Number::Int(0)).unwrap();
        writer.publish().unwrap();
        image.read().unwrap().output(pump).unwrap() == Number::Int(1)
    });
    control.signal("TERM", 1);
    assert_eq!(control.end().code(), Some(130));
    assert_eq!(image.read().unwrap().output(pump), Some(Number::Int(1)), "it is held");
}

/// `plcio checkout` at the other end of two pipes, as two people at a terminal.
struct Checkout {
    process: std::process::Child,
    said: std::sync::mpsc::Receiver<u8>,
    text: String,
}

impl Checkout {
    fn start(folder: &Folder, args: &[&str]) -> Self {
        let mut command = plcio();
        command.args(args).current_dir(folder.path(""));
        command.stdin(std::process::Stdio::piped()).stdout(std::process::Stdio::piped());
        let mut process = command.spawn().unwrap();
        let (send, said) = std::sync::mpsc::channel();
        let out = process.stdout.take().unwrap();
        std::thread::spawn(move || {
            for byte in std::io::Read::bytes(out).map_while(Result::ok) {
                let _ = send.send(byte);
            }
        });
        Self { process, said, text: String::new() }
    }

    /// Waits until it says something behind what was waited for last.
    fn says(&mut self, part: &str) {
        while !self.text.contains(part) {
            let byte = self.said.recv_timeout(Duration::from_secs(60));
            let byte = byte.unwrap_or_else(|_| panic!("`{part}` is not in {}", self.text));
            self.text.push(char::from(byte));
        }
        self.text.clear();
    }

    fn answer(&mut self, line: &str) {
        use std::io::Write;
        let input = self.process.stdin.as_mut().unwrap();
        input.write_all(format!("{line}\n").as_bytes()).unwrap();
    }
}

/// Two people go through the wires: nothing moves but what they ask for, and what they saw is written down.
#[test]
fn a_checkout_moves_nothing_that_was_not_asked() {
    let folder = Folder::new("wiring-checkout");
    folder.artifact("p.plcx", Dialect::Pmi, PMI);
    let more =
        "socket = \"socket\"\nallow = [\"force\"]\n[[io]]\nname = \"COPY\"\ndriver = \"other\"\n";
    let entries = CONFIGURATION.find("[[io]]").unwrap();
    let (head, entries) = CONFIGURATION.split_at(entries);
    let (keys, copy) = more.split_at(more.find("[[io]]").unwrap());
    fs::write(folder.path("c.toml"), format!("{head}{keys}{entries}{copy}")).unwrap();
    let mut control = folder.start(&["--config", "c.toml"]);
    let path = folder.path("image");
    wait_until("the control goes on", || {
        ImageReader::open(&path).is_ok_and(|image| image.last_tick() != 0)
    });
    let image = ImageReader::open(&path).unwrap();
    let symbols = image.symbols();
    let line = |name: &str| {
        let symbol = symbols.iter().find(|symbol| symbol.name == name).unwrap();
        image.read().unwrap().output(symbol).unwrap()
    };
    let (give, given) = std::sync::mpsc::channel::<i64>();
    let writer_path = path.clone();
    let driver = std::thread::spawn(move || {
        let mut writer = InputWriter::open(&writer_path, "a driver").unwrap();
        let (door, level) = (writer.claim("DOOR").unwrap(), writer.claim("LEVEL").unwrap());
        let mut open = 1;
        loop {
            match given.try_recv() {
                Ok(value) => open = value,
                Err(std::sync::mpsc::TryRecvError::Disconnected) => return,
                Err(std::sync::mpsc::TryRecvError::Empty) => {}
            }
            writer.set(door, Number::Int(open)).unwrap();
            writer.set(level, Number::Int(6)).unwrap();
            writer.publish().unwrap();
            std::thread::sleep(Duration::from_millis(10));
        }
    });
    wait_until("the inputs come", || line("COPY") == Number::Int(6));
    let mut people = Checkout::start(&folder, &["checkout", "c.toml", "--protocol", "p.csv"]);
    people.says("2 inputs and 2 outputs.");
    people.answer("yes");
    people.says("Input DOOR");
    give.send(0).unwrap();
    people.says("DOOR is 0.");
    // The program would switch the pump on now.
    people.says("Input LEVEL");
    assert_eq!(line("PUMP"), Number::Int(0), "it is held");
    people.answer("s");
    people.says("DRIVE IT TO 1?");
    assert_eq!(line("PUMP"), Number::Int(0));
    people.answer("yes");
    people.says("Has it acted?");
    wait_until("the pump runs", || line("PUMP") == Number::Int(1));
    people.answer("turns the wrong way");
    people.says("Output COPY");
    wait_until("it is as before", || line("PUMP") == Number::Int(0));
    people.answer("9");
    people.says("DRIVE IT TO 9?");
    people.answer("no");
    people.says("first person");
    people.answer("Anna");
    people.says("second person");
    people.answer("Otto");
    people.says("Give the outputs back");
    assert_eq!((line("PUMP"), line("COPY")), (Number::Int(0), Number::Int(6)));
    people.answer("yes");
    people.says("The protocol is p.csv");
    assert!(people.process.wait().unwrap().success());
    wait_until("the program has its outputs again", || line("PUMP") == Number::Int(1));
    let protocol = folder.read("p.csv");
    let rows: Vec<&str> =
        protocol.lines().skip(1).filter_map(|row| Some(row.split_once(',')?.1)).collect();
    let expected = [
        "begin,,,outputs held,2 outputs",
        "input,DOOR,other ,switched,1 to 0",
        "input,LEVEL,other ,passed over,",
        "output,PUMP,other ,fault,driven to 1 and back to 0; turns the wrong way",
        "output,COPY,other ,passed over,",
        "signed,Anna,,yes,",
        "signed,Otto,,yes,",
        "end,,,outputs given back,",
    ];
    assert_eq!(rows, expected);
    // Who leaves in the middle leaves the outputs held.
    let mut people = Checkout::start(&folder, &["--checkout", "c.toml"]);
    people.says("Begin? (yes)");
    people.answer("yes");
    people.says("Input DOOR");
    people.process.stdin = None;
    assert!(people.process.wait().unwrap().success());
    give.send(1).unwrap();
    wait_until("the door is open", || line("DOOR") == Number::Int(1));
    assert_eq!(line("PUMP"), Number::Int(1), "it is held at what it was");
    let mut people = Checkout::start(&folder, &["checkout", "c.toml", "--protocol", "q.csv"]);
    assert_eq!(people.process.wait().unwrap().code(), Some(2), "there are forces");
    drop(give);
    driver.join().unwrap();
    control.signal("TERM", 1);
    assert_eq!(control.end().code(), Some(130));
}

/// Parameters, variables of the executive and P-variables become safe when their writer is late, and that is logged.
#[test]
fn variables_that_are_not_inputs_have_safe_values_too() {
    let pmi = "$INTEGER\nW\n$END\nW = W\n@FRO = @FRO\n";
    let pmac = "CLOSE\nI5=2\nOPEN PLC 1 CLEAR\nP3=P1+P2\nCLOSE\nENABLE PLC 1\n";
    for (name, dialect, source, given) in [
        ("pmi", Dialect::Pmi, pmi, [("W", "7", 7.0), ("@FRO", "\"off\"", 0.0)]),
        ("pmac", Dialect::Pmac, pmac, [("P1", "0.5", 0.5), ("P2", "\"hold\"", 5.0)]),
    ] {
        let folder = Folder::new(&format!("wiring-internal-{name}"));
        folder.artifact("p.plcx", dialect, source);
        let entry = |(name, safe, _): &(&str, &str, f64)| {
            format!(
                "[[io]]\nname = \"{name}\"\ndriver = \"other\"\ndirection = \"in\"\nsafe = {safe}\n\
                 timeout_ms = 300\n"
            )
        };
        let entries = given.iter().map(entry).collect::<String>();
        let head = "artifact = \"p.plcx\"\nimage = \"image\"\nlog = \"log.jsonl\"\n";
        fs::write(folder.path("c.toml"), format!("{head}{entries}")).unwrap();
        let mut control = folder.start(&["--config", "c.toml"]);
        let path = folder.path("image");
        wait_until("the control goes on", || {
            ImageReader::open(&path).is_ok_and(|image| image.last_tick() != 0)
        });
        let mut writer = InputWriter::open(&path, "a driver").unwrap();
        let inputs = given.map(|(name, ..)| writer.claim(name).unwrap());
        let logged = |change: &str| {
            let log = fs::read_to_string(folder.path("log.jsonl")).unwrap_or_default();
            log.contains(&format!("\"change\":\"{change}\",\"writer\":\"a driver\""))
        };
        wait_until("the values come", || {
            for input in inputs {
                let has_fraction = writer.symbol(input).unwrap().outside().range().is_none();
                let five = if has_fraction { Number::Float(5.0) } else { Number::Int(5) };
                writer.set(input, five).unwrap();
            }
            writer.publish().unwrap();
            logged("begun") || logged("recovered")
        });
        wait_until("the writer is late", || logged("late"));
        control.signal("TERM", 1);
        control.end();
        let image = ImageReader::open(&path).unwrap();
        let (symbols, tick) = (image.symbols(), image.read().unwrap());
        for (name, _, safe) in given {
            let symbol = symbols.iter().find(|symbol| symbol.name == name).unwrap();
            assert_eq!(tick.value(symbol).unwrap().float(), safe, "{name}");
        }
    }
}

#[test]
fn a_configuration_that_does_not_fit_the_program_is_refused_with_its_lines() {
    let folder = Folder::new("wiring-check");
    folder.artifact("p.plcx", Dialect::Pmi, PMI);
    let good = CONFIGURATION.replace("PUMP", "COPY");
    fs::write(folder.path("good.toml"), good).unwrap();
    let output = folder.run(&["--check-config", "good.toml"]);
    let text = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(0), "{text}");
    assert_eq!(text, "warning: good.toml: output PUMP is not wired: no entry [[io]] names it\n");
    // An INTEGER may be negative, and a register without a format has no sign.
    let number =
        "[[io]]\nname = \"N\"\ndriver = \"modbus-tcp\"\naddress = \"io.local/1/holding/0\"\n";
    fs::write(folder.path("number.toml"), format!("{CONFIGURATION}{number}")).unwrap();
    let output = folder.run(&["--check-config", "number.toml"]);
    let text = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(0), "{text}");
    let warning = "warning: number.toml:20: `N` can be -32768 to 32767, but u16 is 0 to 65535: what does not fit is not \
                   written; i16 holds all\n";
    assert!(text.starts_with(warning), "{text}");
    let bad =
        format!("{CONFIGURATION}direction = \"in\"\n[[io]]\nname = \"DOR\"\ndriver = \"other\"\n");
    fs::write(folder.path("bad.toml"), bad).unwrap();
    for option in ["--check-config", "--config"] {
        let output = folder.run(&[option, "bad.toml"]);
        let text = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{text}");
        assert!(text.contains("bad.toml:17: `PUMP` is an output, and can't be given"), "{text}");
        assert!(
            text.contains(
                "bad.toml:21: the program has no variable named `DOR`; did you mean `DOOR`?"
            ),
            "{text}"
        );
    }
}

/// What only `plcio` uses is checked with the rest, and `plcio` checks all that does not need the program.
#[test]
fn the_settings_of_drivers_are_checked_with_the_wiring() {
    let folder = Folder::new("wiring-plcio");
    folder.artifact("p.plcx", Dialect::Pmi, PMI);
    let text = "artifact = \"p.plcx\"\noverrun = \"skip\"\n[[io]]\nname = \"PUMP\"\ndriver = \"modbus-server\"\n\
                address = \"coil/0\"\n[plcio]\npoll = 2\nmodbus-srever = \"[::]:502\"\n";
    fs::write(folder.path("c.toml"), text).unwrap();
    let plcio = |args: &[&str]| plcio().args(args).current_dir(folder.path("")).output().unwrap();
    let both = || {
        [folder.run(&["--check-config", "c.toml"]), plcio(&["--check-config", "c.toml"])]
            .map(|output| (output.status.code(), String::from_utf8(output.stderr).unwrap()))
    };
    for (status, text) in both() {
        assert_eq!(status, Some(2), "{text}");
        for part in [
            "c.toml:1: the key `image` is missing",
            "c.toml:8: `poll`: a time from 1ms to 1h is expected, as in \"20ms\"",
            "c.toml:9: there is no key `modbus-srever` in [plcio]; did you mean `modbus-server`?",
        ] {
            assert!(text.contains(part), "{part}: {text}");
        }
    }
    let text = text.replace("poll = 2\nmodbus-srever = \"[::]:502\"\n", "poll = \"2ms\"\n");
    fs::write(folder.path("c.toml"), format!("image = \"i\"\n{text}")).unwrap();
    for (status, text) in both() {
        assert_eq!(status, Some(0), "{text}");
        let warning =
            "warning: c.toml:4: points of the driver modbus-server need the key `modbus-server`";
        assert!(text.contains(warning), "{text}");
    }
}
