//! `plcio` with Modbus: a device that misbehaves in every way, and peers of another make (pymodbus).
//!
//! The tests with pymodbus are left out where Python has it not; `PLCC_PYTHON` names a Python that has.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, clippy::panic, clippy::indexing_slicing)]

mod outputs;
mod serial;
mod server;

use std::fs;
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};
use std::time::Duration;

use plcc_abi::Dialect;
use plcc_image::{ImageReader, Number};
use plcc_tests::loader::{Folder, Running, plcio, wait_until};
use plcc_tests::tools;

/// The pump runs while the door is closed, and a number goes from a device to another place.
const PMI: &str = "$INPUT\nDOOR = 0/0\nLEVEL = 1/0-3/B\n$OUTPUT\nPUMP = 2/0\nCOPY = 3/0-3/B\n$INTEGER\n\
                   SPEED\n$END\nPUMP = /DOOR\nCOPY = LEVEL\n";

fn start_driver(folder: &Folder) -> Running {
    let mut command = plcio();
    Running::start(command.arg("c.toml").current_dir(folder.path("")))
}

/// A control and `plcio`.
struct Plant {
    folder: Folder,
    control: Running,
    driver: Running,
}

impl Plant {
    /// `device` is the address of the device: `modbus-tcp` and host and port, or `modbus-rtu` and a line.
    fn start(name: &str, driver: &str, device: &str, more: &str) -> Self {
        let point = |name: &str, at: &str| {
            format!(
                "[[io]]\nname = \"{name}\"\ndriver = \"{driver}\"\naddress = \"{device}/1/{at}\"\n\
                 safe = 1\ntimeout_ms = 400\n"
            )
        };
        let configuration = [
            more,
            &point("DOOR", "discrete/0"),
            &point("LEVEL", "input/0"),
            &point("PUMP", "coil/0"),
            &point("COPY", "holding/0"),
        ]
        .concat();
        Self::with(name, &configuration)
    }

    /// `configuration` is the rest of the table `[plcio]`, and the entries.
    fn with(name: &str, configuration: &str) -> Self {
        Self::of(name, PMI, "", configuration)
    }

    /// The same for another program; `own` are further keys of the control.
    fn of(name: &str, program: &str, own: &str, configuration: &str) -> Self {
        let folder = Folder::new(name);
        folder.artifact("p.plcx", Dialect::Pmi, program);
        let configuration = [
            "artifact = \"p.plcx\"\nimage = \"image\"\nperiod = 5\nlog = \"log.jsonl\"\n",
            own,
            "[plcio]\npoll_ms = 10\nanswer_ms = 150\nlog = \"plcio.jsonl\"\n",
            configuration,
        ]
        .concat();
        fs::write(folder.path("c.toml"), configuration).unwrap();
        let control = folder.start(&["--config", "c.toml"]);
        let driver = start_driver(&folder);
        wait_until("the image file is there", || ImageReader::open(&folder.path("image")).is_ok());
        Self { folder, control, driver }
    }

    /// Starts `plcio` once more.
    fn start_driver(&mut self) {
        self.driver = start_driver(&self.folder);
    }

    fn line(&self, name: &str) -> Number {
        let image = ImageReader::open(&self.folder.path("image")).unwrap();
        let symbols = image.symbols();
        let symbol = symbols.iter().find(|symbol| symbol.name == name).unwrap();
        image.read().unwrap().output(symbol).unwrap()
    }

    /// Waits until the device's values have come: the door is closed, the level is 9.
    fn wait_for_values(&self) {
        wait_until("values come from the device", || {
            (self.line("PUMP"), self.line("COPY")) == (Number::Int(1), Number::Int(9))
        });
    }

    /// Waits until the inputs are safe: the door counts as open.
    fn wait_for_safety(&self) {
        wait_until("the inputs are safe", || {
            (self.line("PUMP"), self.line("COPY")) == (Number::Int(0), Number::Int(1))
        });
    }

    fn end(mut self) -> String {
        self.driver.signal("TERM", 1);
        assert_eq!(self.driver.end().code(), Some(0));
        self.control.signal("TERM", 1);
        assert_eq!(self.control.end().code(), Some(130));
        self.folder.read("plcio.jsonl")
    }
}

/// What a device of these tests does with a request.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Conduct {
    Answers,
    SaysNothing,
    Closes,
    AnswersLate,
    SendsGarbage,
    SendsTooFewValues,
    AnswersAnotherRequest,
    SendsHalf,
    SendsByteByByte,
    Refuses,
    Floods,
}

const CONDUCTS: [Conduct; 11] = [
    Conduct::Answers,
    Conduct::SaysNothing,
    Conduct::Closes,
    Conduct::AnswersLate,
    Conduct::SendsGarbage,
    Conduct::SendsTooFewValues,
    Conduct::AnswersAnotherRequest,
    Conduct::SendsHalf,
    Conduct::SendsByteByByte,
    Conduct::Refuses,
    Conduct::Floods,
];

/// A device: unit 1, discrete input 0 is 0, input register 0 is 9, coil 0 and holding register 0.
struct Device {
    port: u16,
    conduct: Arc<AtomicU8>,
    coil: Arc<AtomicBool>,
}

impl Device {
    fn start() -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let port = listener.local_addr().unwrap().port();
        let (conduct, coil) = (Arc::new(AtomicU8::new(0)), Arc::new(AtomicBool::new(false)));
        let (shared, written) = (Arc::clone(&conduct), Arc::clone(&coil));
        std::thread::spawn(move || {
            for stream in listener.incoming().map_while(Result::ok) {
                let (conduct, coil) = (Arc::clone(&shared), Arc::clone(&written));
                std::thread::spawn(move || while serve(&stream, &conduct, &coil).is_some() {});
            }
        });
        Self { port, conduct, coil }
    }

    fn behave(&self, conduct: Conduct) {
        let number = CONDUCTS.iter().position(|&other| other == conduct).unwrap();
        self.conduct.store(number as u8, Ordering::Relaxed);
    }
}

/// The right answer to a request.
fn answer(request: &[u8], coil: &AtomicBool) -> Vec<u8> {
    match request[0] {
        1 | 2 => vec![request[0], 1, 0],
        3 | 4 => vec![request[0], 2, 0, 9],
        15 => {
            coil.store(request[6] & 1 != 0, Ordering::Relaxed);
            request[..5].to_vec()
        }
        16 => request[..5].to_vec(),
        other => vec![other | 0x80, 1],
    }
}

/// Takes one request and does with it what the device does at present. `None` closes the connection.
fn serve(mut stream: &TcpStream, conduct: &AtomicU8, coil: &AtomicBool) -> Option<()> {
    let mut head = [0; 7];
    stream.read_exact(&mut head).ok()?;
    let mut request = vec![0; usize::from(u16::from_be_bytes([head[4], head[5]])) - 1];
    stream.read_exact(&mut request).ok()?;
    let mut answer = answer(&request, coil);
    let conduct = CONDUCTS[usize::from(conduct.load(Ordering::Relaxed))];
    match conduct {
        Conduct::Answers => {}
        Conduct::SaysNothing => return Some(()),
        Conduct::Closes => return None,
        Conduct::AnswersLate => std::thread::sleep(Duration::from_millis(250)),
        Conduct::SendsGarbage => return stream.write_all(&[0xA5; 300]).ok(),
        Conduct::SendsTooFewValues => answer = vec![request[0], 0],
        Conduct::AnswersAnotherRequest => head[1] ^= 0x55,
        Conduct::SendsHalf | Conduct::SendsByteByByte => {}
        Conduct::Refuses => answer = vec![request[0] | 0x80, 2],
        Conduct::Floods => {
            for _ in 0..2000 {
                stream.write_all(&[0, 0, 0, 0, 0, 3, 1, 0x83, 2]).ok()?;
            }
            return Some(());
        }
    }
    head[4..6].copy_from_slice(&(answer.len() as u16 + 1).to_be_bytes());
    let whole = [&head[..], &answer].concat();
    match conduct {
        Conduct::SendsHalf => stream.write_all(whole.get(..whole.len() / 2)?).ok(),
        // The whole answer takes longer than the device has for it.
        Conduct::SendsByteByByte => whole.chunks(1).try_for_each(|byte| {
            std::thread::sleep(Duration::from_millis(50));
            stream.write_all(byte).ok()
        }),
        _ => stream.write_all(&whole).ok(),
    }
}

#[test]
fn inputs_become_safe_whatever_a_device_does_and_come_again_without_a_restart() {
    let device = Device::start();
    let plant =
        Plant::start("modbus-faults", "modbus-tcp", &format!("127.0.0.1:{}", device.port), "");
    plant.wait_for_values();
    wait_until("the pump is written", || device.coil.load(Ordering::Relaxed));
    for conduct in &CONDUCTS[1..] {
        device.behave(*conduct);
        plant.wait_for_safety();
        device.behave(Conduct::Answers);
        plant.wait_for_values();
    }
    // plcio ends: what it has written becomes safe.
    device.behave(Conduct::Answers);
    wait_until("the pump is written", || device.coil.load(Ordering::Relaxed));
    let (coil, log) = (Arc::clone(&device.coil), plant.end());
    assert!(!coil.load(Ordering::Relaxed), "{log}");
    for kind in ["control_found", "connected", "lost", "refused", "accepted", "control_left"] {
        assert!(log.contains(&format!("\"kind\":\"{kind}\"")), "{kind}: {log}");
    }
    // Nothing is told again and again.
    assert!(log.lines().count() < 200, "{log}");
}

#[test]
fn outputs_become_safe_when_the_control_is_killed_and_the_next_one_is_found() {
    let device = Device::start();
    let at = format!("127.0.0.1:{}", device.port);
    let mut plant = Plant::start("modbus-killed", "modbus-tcp", &at, "");
    plant.wait_for_values();
    wait_until("the pump is written", || device.coil.load(Ordering::Relaxed));
    // Without its supervisor the control ends, with its outputs safe.
    plant.control.signal("KILL", 1);
    wait_until("the pump is off", || !device.coil.load(Ordering::Relaxed));
    plant.control.end();
    wait_until("the control has ended", || {
        let once = ["--config", "c.toml", "--ticks", "1"];
        plant.folder.command(&once).output().unwrap().status.success()
    });
    // A control without a supervisor can't say that it has been killed.
    plant.control = plant.folder.start(&["--config", "c.toml", "--no-supervisor"]);
    wait_until("the pump is written", || device.coil.load(Ordering::Relaxed));
    plant.control.signal("KILL", 1);
    plant.control.end();
    wait_until("the pump is off", || !device.coil.load(Ordering::Relaxed));
    plant.control = plant.folder.start(&["--config", "c.toml"]);
    wait_until("the pump is written", || device.coil.load(Ordering::Relaxed));
    let log = plant.end();
    let mut rest = log.as_str();
    for kind in ["control_found", "control_silent", "control_left", "control_found", "control_left"]
    {
        let kind = format!("\"kind\":\"{kind}\"");
        rest = rest.split_once(&kind).unwrap_or_else(|| panic!("{kind}: {log}")).1;
    }
}

/// Python with pymodbus, where there is one.
fn python() -> Option<String> {
    let python = std::env::var("PLCC_PYTHON").unwrap_or_else(|_| "python3".into());
    let has = Command::new(&python).args(["-c", "import pymodbus"]).stderr(Stdio::null()).status();
    if has.is_ok_and(|status| status.success()) {
        return Some(python);
    }
    tools::missing("pymodbus", "is not installed");
    None
}

fn peer(python: &str, arguments: &[&str]) -> Command {
    let mut command = Command::new(python);
    command.arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("modbus/peer.py")).args(arguments);
    command.stderr(Stdio::null());
    command
}

fn free_port() -> u16 {
    TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port()
}

/// A process that is killed when the test ends.
struct Killed(Child);

impl Drop for Killed {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

#[test]
fn a_device_and_a_client_of_another_make_understand_us() {
    let Some(python) = python() else { return };
    let (port, own) = (free_port().to_string(), free_port().to_string());
    let device = || Killed(peer(&python, &["device", &port]).spawn().unwrap());
    let served = device();
    let more = format!(
        "modbus-server = \"127.0.0.1:{own}\"\n\
         [[io]]\nname = \"PUMP\"\ndriver = \"modbus-server\"\naddress = \"coil/0\"\n\
         [[io]]\nname = \"COPY\"\ndriver = \"modbus-server\"\naddress = \"holding/0\"\n\
         [[io]]\nname = \"SPEED\"\ndriver = \"modbus-server\"\naddress = \"holding/1:i16\"\n\
         direction = \"in\"\n"
    );
    let number = |at: &str| {
        format!(
            "[[io]]\nname = \"COPY\"\ndriver = \"modbus-server\"\naddress = \"holding/{at}\"\nscale = -0.5\n"
        )
    };
    let numbers = ["10:f32", "12:f32-cdab", "14:i64", "18:f64-cdab"].map(number).concat();
    let more = more + &numbers;
    let plant = Plant::start("modbus-peer", "modbus-tcp", &format!("127.0.0.1:{port}"), &more);
    plant.wait_for_values();
    wait_until("the device has the outputs", || {
        peer(&python, &["look", &port]).output().unwrap().stdout == b"1 9\n"
    });
    let output = peer(&python, &["ask", &own]).output().unwrap();
    let expected = "coil 1\nregister 9\nwrite False\nan output 2\na coil 2\nnothing 2\n";
    assert_eq!(String::from_utf8(output.stdout).unwrap(), expected);
    let output = peer(&python, &["numbers", &own]).output().unwrap();
    assert_eq!(String::from_utf8(output.stdout).unwrap(), "-18.0\n-18.0\n-18\n-18.0\n");
    wait_until("the register is in the program", || plant.line("SPEED") == Number::Int(-10));
    drop(served);
    plant.wait_for_safety();
    let _served = device();
    plant.wait_for_values();
    plant.end();
}

#[test]
fn a_serial_line_works_as_tcp_does() {
    use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
    let Some(python) = python() else { return };
    // Two lines, whose other ends are connected.
    let [one, other] = [(); 2].map(|()| {
        let end = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
        grantpt(&end).unwrap();
        unlockpt(&end).unwrap();
        let name = ptsname(&end, vec![]).unwrap().into_string().unwrap();
        (fs::File::from(end), name)
    });
    for (from, to) in [(&one.0, &other.0), (&other.0, &one.0)] {
        let (mut from, mut to) = (from.try_clone().unwrap(), to.try_clone().unwrap());
        std::thread::spawn(move || {
            let mut bytes = [0; 256];
            loop {
                // While nobody has opened the line, reading fails.
                match from.read(&mut bytes) {
                    Ok(count) => to.write_all(&bytes[..count]).unwrap(),
                    Err(_) => std::thread::sleep(Duration::from_millis(10)),
                }
            }
        });
    }
    let served = Killed(peer(&python, &["device", &other.1]).spawn().unwrap());
    let plant = Plant::start("modbus-serial", "modbus-rtu", &format!("{}@19200-8N1", one.1), "");
    plant.wait_for_values();
    drop(served);
    plant.wait_for_safety();
    let _served = Killed(peer(&python, &["device", &other.1]).spawn().unwrap());
    plant.wait_for_values();
    plant.end();
}

/// As when the program that read the messages has ended before.
#[test]
fn an_error_that_nobody_reads_ends_in_its_exit_status() {
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let status = plcio().arg("missing.toml").stderr(writer).status().unwrap();
    assert_eq!(status.code(), Some(2), "{status}");
}
