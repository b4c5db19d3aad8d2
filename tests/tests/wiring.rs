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
