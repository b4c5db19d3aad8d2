//! `plcio`'s component of LinuxCNC's HAL, without LinuxCNC: a module `hal` for Python that keeps the pins in files
//! takes the place of LinuxCNC's (`hal.py`). What takes LinuxCNC itself is in `tests/peers`.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, clippy::panic)]

use std::fs;

use plcc_abi::Dialect;
use plcc_image::ImageReader;
use plcc_tests::loader::{Folder, Running, plcio, wait_until};
use serde_json::Value as Json;

const PMI: &str = "$INPUT\nDOOR = 0/0\n$OUTPUT\nPUMP = 2/0\nCOPY = 3/0-3/B\n$INTEGER\nW\n$LONG\nCOUNT\n$END\n\
                   PUMP = /DOOR\nCOPY = 9\nCOUNT = COUNT + 1\n";

/// A control with its supervisor, and `plcio` with the component.
struct Plant {
    folder: Folder,
    control: Running,
    driver: Running,
}

impl Plant {
    fn start(name: &str) -> Self {
        let folder = Folder::new(name);
        folder.artifact("p.plcx", Dialect::Pmi, PMI);
        let entry = |name: &str, more: &str| {
            format!("[[io]]\nname = \"{name}\"\ndriver = \"hal\"\n{more}\n")
        };
        let configuration = [
            // Nothing here becomes safe because of the time alone.
            "artifact = \"p.plcx\"\nimage = \"image\"\nperiod = 5\nlog = \"log.jsonl\"\n\
             [safe]\nCOPY = 2\n[plcio]\nsilence_ms = 3600000\nlog = \"plcio.jsonl\"\n",
            &entry("DOOR", "timeout_ms = 0"),
            &entry("PUMP", ""),
            &entry("COPY", ""),
            &entry("COUNT", ""),
            &entry("W", "direction = \"in\"\nsafe = 7\ntimeout_ms = 400\nscale = 1000"),
        ]
        .concat();
        fs::write(folder.path("c.toml"), configuration).unwrap();
        fs::write(folder.path("hal.py"), include_str!("hal.py")).unwrap();
        fs::write(folder.path("inputs.json"), "{\"w\": 0.005}").unwrap();
        let control = folder.start(&["--config", "c.toml"]);
        let mut driver = Running::start(
            plcio()
                .arg("c.toml")
                .current_dir(folder.path(""))
                .env("PYTHONPATH", folder.path(""))
                .env("PINS", folder.path("")),
        );
        driver.says("connected: device hal");
        let plant = Self { folder, control, driver };
        wait_until("the component gives the outputs of the program", || {
            plant.pins() == ["true", "true", "9"]
        });
        plant
    }

    /// What the pins `running`, `pump` and `copy` are; empty before there are any.
    fn pins(&self) -> Vec<String> {
        let text = fs::read_to_string(self.folder.path("pins.json")).unwrap_or_default();
        let pins: Json = serde_json::from_str(&text).unwrap_or_default();
        let pins = ["running", "pump", "copy"].map(|name| pins.get(name).map(Json::to_string));
        pins.into_iter().flatten().collect()
    }

    /// The value of a variable.
    fn value(&self, name: &str) -> f64 {
        let image = ImageReader::open(&self.folder.path("image")).unwrap();
        let symbols = image.symbols();
        let symbol = symbols.iter().find(|symbol| symbol.name == name).unwrap();
        image.read().unwrap().value(symbol).unwrap().float()
    }

    fn give(&self, inputs: &str) {
        fs::write(self.folder.path("inputs.new"), inputs).unwrap();
        fs::rename(self.folder.path("inputs.new"), self.folder.path("inputs.json")).unwrap();
    }

    /// How often the control has said this of an input.
    fn changes(&self, change: &str, name: &str) -> usize {
        let log = self.folder.read("log.jsonl");
        let entries = log.lines().filter_map(|line| serde_json::from_str::<Json>(line).ok());
        let is_it = |entry: &Json| entry["change"] == change && entry["first"] == name;
        entries.filter(is_it).count()
    }
}

/// The control, which its supervisor runs in a process of its own.
fn child(supervisor: &Running) -> String {
    let path = format!("/proc/{0}/task/{0}/children", supervisor.id());
    fs::read_to_string(path).unwrap().split_whitespace().next().unwrap().to_owned()
}

#[test]
fn pins_are_safe_as_soon_as_the_image_file_says_that_the_control_has_died_or_ended() {
    for how in ["KILL", "TERM"] {
        let mut plant = Plant::start(&format!("hal-{how}"));
        let process = child(&plant.control);
        let kill = std::process::Command::new("kill").args([&format!("-{how}"), &process]).status();
        assert!(kill.unwrap().success());
        wait_until("pins are safe", || plant.pins() == ["false", "false", "2"]);
        plant.control.end();
        // The next control has the same pins.
        plant.control = plant.folder.start(&["--config", "c.toml"]);
        wait_until("the next control is connected", || plant.pins() == ["true", "true", "9"]);
        plant.driver.signal("TERM", 1);
        plant.driver.end();
        let is_safe = || plant.pins() == ["false", "false", "2"];
        wait_until("plcio makes them safe when it ends", is_safe);
    }
}

#[test]
fn what_a_variable_cannot_have_is_an_event_and_the_variable_becomes_safe() {
    let plant = Plant::start("hal-bad");
    wait_until("W is given", || plant.value("W") == 5.0);
    for (count, bad) in (1..).zip(["NaN", "Infinity", "40.0", "-1e300"]) {
        plant.give(&format!("{{\"w\": {bad}}}"));
        wait_until("W has its safe value", || plant.value("W") == 7.0);
        for change in ["refused", "late"] {
            wait_until("the log says so", || plant.changes(change, "W") >= count);
        }
        plant.give("{\"w\": 0.005}");
        wait_until("W is given again", || plant.value("W") == 5.0);
    }
}

#[test]
fn a_variable_that_is_not_an_input_becomes_safe_when_nobody_gives_it() {
    let mut plant = Plant::start("hal-internal");
    wait_until("W is given", || plant.value("W") == 5.0);
    plant.driver.signal("KILL", 1);
    plant.driver.end();
    wait_until("W has its safe value", || plant.value("W") == 7.0);
    wait_until("the log says so", || plant.changes("late", "W") > 0);
}
