//! Outputs that must go off: values that do not fit, devices that refuse single points, that know other functions, that close
//! their connection, and that are away when the control dies.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::{Arc, Mutex, MutexGuard};

use plcc_image::Number;
use plcc_tests::loader::wait_until;

use super::Plant;

/// The motor runs while GO is on, and the speed is one that does not fit unless FAST is on. LEVEL is an output of four lines.
const PMI: &str = "$INPUT\nGO = 0/0\nFAST = 0/1\n$OUTPUT\nMOTOR = 1/0\nLEVEL = 2/0-3/B\n$INTEGER\nSPEED\n$END\n\
                   MOTOR = GO\nLEVEL = 9\nIF (FAST)\n SPEED = 100\nELSE\n SPEED = -1\nENDIF\n";

/// Why a device refuses a request, if it does.
type Refuses = fn(&[u8]) -> Option<u8>;

/// What a device remembers.
struct Memory {
    discrete: [bool; 8],
    coils: [bool; 64],
    holding: [u16; 64],
    /// How many requests were answered.
    answered: usize,
    /// The register 8 after each of them.
    register_8: Vec<u16>,
    refuses: Refuses,
    /// Whether nobody can reach it.
    is_away: bool,
    /// Whether it closes each connection after an answer.
    closes: bool,
    /// The unit that does not answer.
    silent_unit: Option<u8>,
}

/// A device with registers that remember.
struct Device {
    at: String,
    memory: Arc<Mutex<Memory>>,
}

impl Device {
    fn start() -> Self {
        Self::at("127.0.0.1:0").unwrap()
    }

    /// A device at an address; nothing where this computer has not such an address.
    fn at(address: &str) -> Option<Self> {
        let listener = TcpListener::bind(address).ok()?;
        let at = listener.local_addr().unwrap().to_string();
        let memory = Arc::new(Mutex::new(Memory {
            discrete: [false; 8],
            coils: [false; 64],
            holding: [0; 64],
            answered: 0,
            register_8: vec![],
            refuses: |_| None,
            is_away: false,
            closes: false,
            silent_unit: None,
        }));
        let shared = Arc::clone(&memory);
        std::thread::spawn(move || {
            for stream in listener.incoming().map_while(Result::ok) {
                let memory = Arc::clone(&shared);
                std::thread::spawn(move || while serve(&stream, &memory).is_some() {});
            }
        });
        Some(Self { at, memory })
    }

    fn memory(&self) -> MutexGuard<'_, Memory> {
        self.memory.lock().unwrap()
    }

    /// An entry of the configuration.
    fn point(&self, name: &str, at: &str, more: &str) -> String {
        self.point_of(1, name, at, more)
    }

    fn point_of(&self, unit: u8, name: &str, at: &str, more: &str) -> String {
        format!(
            "[[io]]\nname = \"{name}\"\ndriver = \"modbus-tcp\"\naddress = \"{}/{unit}/{at}\"\n{more}\n",
            self.at
        )
    }

    /// The entries of the inputs.
    fn inputs(&self) -> String {
        self.point("GO", "discrete/0", "") + &self.point("FAST", "discrete/1", "")
    }

    fn give(&self, go: bool, fast: bool) {
        self.memory().discrete[..2].copy_from_slice(&[go, fast]);
    }

    fn wait_for_holding(&self, number: usize, value: u16) {
        wait_until(&format!("register {number} is {value}"), || {
            self.memory().holding[number] == value
        });
    }
}

/// Takes a request. `None` closes the connection.
fn serve(mut stream: &TcpStream, memory: &Mutex<Memory>) -> Option<()> {
    let mut head = [0; 7];
    stream.read_exact(&mut head).ok()?;
    let mut request = vec![0; usize::from(u16::from_be_bytes([head[4], head[5]])) - 1];
    stream.read_exact(&mut request).ok()?;
    let mut memory = memory.lock().unwrap();
    if memory.is_away {
        return None;
    }
    if memory.silent_unit == Some(head[6]) {
        return Some(());
    }
    let answer = match (memory.refuses)(&request) {
        Some(code) => vec![request[0] | 0x80, code],
        None => answer(&request, &mut memory),
    };
    memory.answered += 1;
    let register_8 = memory.holding[8];
    memory.register_8.push(register_8);
    let closes = memory.closes;
    drop(memory);
    head[4..6].copy_from_slice(&(answer.len() as u16 + 1).to_be_bytes());
    stream.write_all(&[&head[..], &answer].concat()).ok()?;
    (!closes).then_some(())
}

/// The number at a place of a request.
fn word(request: &[u8], at: usize) -> u16 {
    u16::from_be_bytes([request[at], request[at + 1]])
}

fn answer(request: &[u8], memory: &mut Memory) -> Vec<u8> {
    let (start, count) = (usize::from(word(request, 1)), usize::from(word(request, 3)));
    match request[0] {
        2 => {
            let bits = memory.discrete[start..start + count].iter().enumerate();
            let byte = bits.fold(0, |byte, (n, &bit)| byte | u8::from(bit) << n);
            vec![2, 1, byte]
        }
        3 => {
            let words = memory.holding[start..start + count].iter();
            let bytes: Vec<u8> = words.flat_map(|word| word.to_be_bytes()).collect();
            [&[3, bytes.len() as u8], &bytes[..]].concat()
        }
        5 => {
            memory.coils[start] = request[3] == 0xFF;
            request.to_vec()
        }
        6 => {
            memory.holding[start] = word(request, 3);
            request.to_vec()
        }
        15 => {
            for n in 0..count {
                memory.coils[start + n] = request[6 + n / 8] >> (n % 8) & 1 != 0;
            }
            request[..5].to_vec()
        }
        16 => {
            for n in 0..count {
                memory.holding[start + n] = word(request, 6 + 2 * n);
            }
            request[..5].to_vec()
        }
        other => vec![other | 0x80, 1],
    }
}

fn log_has(plant: &Plant, parts: &[&str]) -> bool {
    let log = std::fs::read_to_string(plant.folder.path("plcio.jsonl")).unwrap_or_default();
    log.lines().any(|line| parts.iter().all(|part| line.contains(part)))
}

fn wait_for_log(plant: &Plant, parts: &[&str]) {
    wait_until(&format!("{parts:?} is in the log"), || log_has(plant, parts));
}

#[test]
fn a_value_that_does_not_fit_leaves_its_neighbours_alone() {
    let device = Device::start();
    // 9 is 45000 there, and the safe value 15 is 75000.
    let points = [
        device.inputs(),
        device.point("SPEED", "holding/10", ""),
        device.point("MOTOR", "holding/11:bit0", ""),
        device.point("LEVEL", "holding/12", "scale = 0.0002"),
    ];
    let mut plant = Plant::of("modbus-unfit", PMI, "safe = { LEVEL = 15 }\n", &points.concat());
    device.give(true, true);
    wait_until("the motor runs", || device.memory().holding[10..13] == [100, 1, 45000]);
    // The speed becomes -1, and the motor stops.
    device.give(false, false);
    device.wait_for_holding(11, 0);
    assert_eq!(device.memory().holding[10], 100, "a value that does not fit is not written");
    wait_for_log(&plant, &["refused", "\"name\":\"SPEED\"", "-1 does not fit its registers"]);
    device.give(true, false);
    device.wait_for_holding(11, 1);
    // The control dies while a value does not fit. What is safe is written: of what does not fit the nearest.
    plant.control.signal("KILL", 1);
    plant.control.end();
    device.wait_for_holding(11, 0);
    device.wait_for_holding(12, 65535);
    plant.control = plant.folder.start(&["--config", "c.toml"]);
    device.give(true, true);
    wait_until("the motor runs", || device.memory().holding[10..13] == [100, 1, 45000]);
    wait_for_log(&plant, &["accepted", "\"name\":\"SPEED\""]);
    // plcio ends while a value does not fit.
    device.give(true, false);
    wait_until("the speed does not fit", || plant.line("SPEED") == Number::Int(-1));
    plant.end();
    assert_eq!(device.memory().holding[11..13], [0, 65535]);
}

#[test]
fn a_point_that_a_device_refuses_leaves_its_neighbours_alone() {
    let device = Device::start();
    // No speed above 50 is permitted, by exception 3.
    device.memory().refuses = |request| {
        let first = word(request, 1);
        let values = request.get(6..).unwrap_or_default().chunks_exact(2);
        let mut written = values.map(|value| word(value, 0)).zip(first..);
        (request[0] == 16 && written.any(|(value, number)| number == 10 && (value as i16) > 50))
            .then_some(3)
    };
    let points = [
        device.inputs(),
        device.point("SPEED", "holding/10:i16", ""),
        device.point("MOTOR", "holding/11:bit0", ""),
    ];
    let plant = Plant::of("modbus-refuses", PMI, "", &points.concat());
    device.give(true, false);
    wait_until("the motor runs", || device.memory().holding[10..12] == [0xFFFF, 1]);
    device.give(false, true);
    device.wait_for_holding(11, 0);
    wait_for_log(&plant, &["refused", "\"number\":10", "Illegal data value (exception 3)"]);
    device.give(true, false);
    wait_until("the motor runs", || device.memory().holding[10..12] == [0xFFFF, 1]);
    wait_for_log(&plant, &["accepted", "\"number\":10"]);
    plant.end();
    assert_eq!(device.memory().holding[11], 0);
}

#[test]
fn a_device_that_was_away_when_the_control_died_is_made_safe_when_it_comes_back() {
    let device = Device::start();
    let points = [device.inputs(), device.point("MOTOR", "coil/0", "")];
    let mut plant = Plant::of("modbus-away", PMI, "", &points.concat());
    device.give(true, true);
    wait_until("the motor runs", || device.memory().coils[0]);
    device.memory().is_away = true;
    wait_for_log(&plant, &["\"kind\":\"lost\""]);
    plant.control.signal("KILL", 1);
    plant.control.end();
    wait_for_log(&plant, &["\"kind\":\"control_left\""]);
    assert!(device.memory().coils[0]);
    device.memory().is_away = false;
    wait_until("the motor is off", || !device.memory().coils[0]);
    // It comes back once more, as it was switched on, still without a control.
    device.memory().is_away = true;
    std::thread::sleep(std::time::Duration::from_millis(300));
    device.memory().coils[0] = true;
    device.memory().is_away = false;
    wait_until("the motor is off", || !device.memory().coils[0]);
    // Another plcio finds a control that has left.
    plant.driver.signal("KILL", 1);
    plant.driver.end();
    device.memory().coils[0] = true;
    plant.start_driver();
    wait_until("the motor is off", || !device.memory().coils[0]);
    // The next control is served.
    plant.control = plant.folder.start(&["--config", "c.toml"]);
    wait_until("the motor runs", || device.memory().coils[0]);
    plant.end();
    assert!(!device.memory().coils[0]);
}

#[test]
fn a_device_that_closes_after_every_answer_is_served() {
    let device = Device::start();
    device.memory().closes = true;
    let points = [
        device.inputs(),
        device.point("MOTOR", "coil/0", ""),
        device.point("LEVEL", "holding/3", ""),
    ];
    let plant = Plant::of("modbus-closes", PMI, "", &points.concat());
    for on in [true, false, true] {
        device.give(on, on);
        wait_until("the motor follows", || device.memory().coils[0] == on);
        assert_eq!(device.memory().holding[3], 9);
    }
    let answered = device.memory().answered;
    wait_until("it is asked again and again", || device.memory().answered > answered + 100);
    let log = plant.end();
    assert!(!device.memory().coils[0]);
    assert!(!log.contains("\"kind\":\"lost\""), "{log}");
}

#[test]
fn single_coils_and_registers_are_written_where_a_device_knows_no_others() {
    let device = Device::start();
    device.memory().refuses = |request| matches!(request[0], 15 | 16).then_some(1);
    let points = [
        device.inputs(),
        device.point("MOTOR", "coil/0", ""),
        device.point("LEVEL", "holding/3:f32-dcba", ""),
        device.point("SPEED", "holding/5:i16", ""),
    ];
    let plant = Plant::of("modbus-single", PMI, "", &points.concat());
    device.give(true, true);
    wait_until("the motor runs", || device.memory().coils[0]);
    wait_until("registers are written", || device.memory().holding[3..6] == [0x0000, 0x1041, 100]);
    let log = plant.end();
    assert!(!device.memory().coils[0]);
    let told: Vec<&str> = log.lines().filter(|line| line.contains("single_writes")).collect();
    assert_eq!(told.len(), 2, "{log}");
    assert!(!log.contains("\"kind\":\"refused\""), "{log}");
}

#[test]
fn a_unit_that_does_not_answer_leaves_the_others_of_its_line_alone() {
    let device = Device::start();
    device.memory().silent_unit = Some(1);
    let points = [
        device.point_of(2, "GO", "discrete/0", "timeout_ms = 0"),
        device.point_of(1, "SPEED", "holding/10:i16", ""),
        device.point_of(2, "MOTOR", "coil/0", ""),
    ];
    let plant = Plant::of("modbus-unit", PMI, "", &points.concat());
    for on in [true, false, true] {
        device.give(on, on);
        wait_until("the motor follows", || device.memory().coils[0] == on);
    }
    wait_for_log(&plant, &["\"kind\":\"lost\"", "\"unit\":1"]);
    wait_for_log(&plant, &["\"kind\":\"connected\"", "\"unit\":2"]);
    device.memory().silent_unit = None;
    device.wait_for_holding(10, 0xFFFF);
    wait_for_log(&plant, &["\"kind\":\"connected\"", "\"unit\":1"]);
    plant.end();
    assert!(!device.memory().coils[0]);
}

#[test]
fn an_exception_that_modbus_does_not_have_is_told_by_its_number() {
    let device = Device::start();
    device.memory().refuses = |request| (request[0] == 15).then_some(0x42);
    let points = [device.inputs(), device.point("MOTOR", "coil/0", "")];
    let plant = Plant::of("modbus-exception", PMI, "", &points.concat());
    wait_for_log(&plant, &["\"kind\":\"refused\"", "\"why\":\"exception 66\""]);
    plant.end();
}

#[test]
fn a_device_may_have_an_address_of_ipv6() {
    let Some(device) = Device::at("[::1]:0") else {
        eprintln!("skipped: this computer has no IPv6");
        return;
    };
    let points = [device.inputs(), device.point("MOTOR", "coil/0", "")];
    let plant = Plant::of("modbus-ipv6", PMI, "", &points.concat());
    device.give(true, true);
    wait_until("the motor runs", || device.memory().coils[0]);
    let log = plant.end();
    assert!(log.contains(&format!("\"device\":\"{}\"", device.at)), "{log}");
}

#[test]
fn a_device_has_its_own_times_and_way_to_write() {
    let device = Device::start();
    // It is slower than plcio permits others to be, and fails at the functions 15 and 16.
    device.memory().refuses = |request| {
        std::thread::sleep(std::time::Duration::from_millis(250));
        matches!(request[0], 15 | 16).then_some(4)
    };
    let points = [
        format!("[[plcio.device]]\naddress = \"{}\"\nanswer_ms = 60000\n", device.at),
        format!("[[plcio.device]]\naddress = \"{}\"\nunit = 1\nwrite = \"single\"\n", device.at),
        device.point("GO", "discrete/0", "timeout_ms = 0"),
        device.point("MOTOR", "coil/0", ""),
    ];
    let plant = Plant::of("modbus-times", PMI, "", &points.concat());
    device.give(true, true);
    wait_until("the motor runs", || device.memory().coils[0]);
    let log = plant.end();
    for kind in ["lost", "refused", "single_writes"] {
        assert!(!log.contains(&format!("\"kind\":\"{kind}\"")), "{log}");
    }
}

/// A program counts every 5 ms, and its device is polled every 2 ms.
#[test]
fn outputs_are_as_new_as_the_poll_of_their_device() {
    let device = Device::start();
    let entries = [
        device.point("SPEED", "holding/8:i16", ""),
        format!("[[plcio.device]]\naddress = \"{}\"\npoll = \"2ms\"\n", device.at),
    ];
    let program = "$INTEGER\nSPEED\n$END\nSPEED = SPEED + 1\n";
    let plant = Plant::of("modbus-poll", program, "", &entries.concat());
    // If outputs were read every 20 ms, the device would get every fourth number.
    wait_until("the device gets each number", || {
        let memory = device.memory();
        memory.register_8.windows(2).filter(|pair| pair[1].wrapping_sub(pair[0]) == 1).count() > 20
    });
    plant.end();
}
