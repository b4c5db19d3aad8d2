//! A program made by hand, and an engine that is a closure.

use plcc_abi::image::{read_i16, read_i32, read_u8, write_i16, write_u8};
use plcc_abi::pmi::{
    Announcement, FlipFlop, Format, Lines, PmiTables, Role, Special, Symbol, TextItem, Timer,
    TimerKind, Type,
};
use plcc_abi::{Engine, Outcome, Program, ResumePoint, Scan, Tables, Task, TrapCode};

use super::{PmiExecutive, PmiLoadError, PmiOptions};
use crate::{Event, EventBody, Executive, NameError, Purpose, Setting, Stop, Value};

struct Script<F>(F);

impl<F: FnMut(&mut [u8]) -> Outcome> Engine for Script<F> {
    fn call(&mut self, _: usize, _: Option<ResumePoint>, scan: &mut Scan<'_>) -> Outcome {
        (self.0)(scan.image)
    }
}

const IPL: u32 = 0;
const ESTOP: u32 = 1;
const CRSET: u32 = 2;
const TC: u32 = 3;
const DC: u32 = 4;
const LAMP: u32 = 5;
const BUTTON: u32 = 6;
const Q: u32 = 7;
const D: u32 = 8;
const CK: u32 = 9;
const PR: u32 = 10;
const CL: u32 = 11;
const LAST: u32 = 12;
const BROKEN: u32 = 13;
const TOOL: u32 = 16;
const SPEED: u32 = 18;
const LIST: u32 = 20;
const COUNTER: u32 = 32;
const TOTAL: u32 = 36;
const KEPT: u32 = 40;
const PORTS: u32 = 64;

fn program(kind: TimerKind) -> Program {
    let lines = |port, low, count, format| Lines { port, low, count, format };
    let symbol = |name: &str, ty, offset, role| Symbol {
        name: name.into(),
        ty,
        offset,
        elements: None,
        role,
        dumped: !name.starts_with('@'),
        retained: false,
    };
    let (logical, integer, long) = (Type::Logical, Type::Integer, Type::Long);
    let variable = Role::Variable;
    let pin = Role::FlipFlopPin(0);
    let bcd = lines(2, 0, 8, Format::Bcd);
    let symbols = vec![
        symbol("@CRSET", logical, CRSET, variable),
        symbol("@ESTOP", logical, ESTOP, variable),
        symbol("@IPL", logical, IPL, variable),
        Symbol { elements: Some(2), retained: true, ..symbol("@NVLNG", long, KEPT, variable) },
        symbol("BROKEN", logical, BROKEN, variable),
        symbol("BUTTON", logical, BUTTON, Role::Input(lines(0, 3, 1, Format::Bit))),
        symbol("CK", logical, CK, pin),
        symbol("CL", logical, CL, pin),
        symbol("D", logical, D, variable),
        symbol("DC", logical, DC, variable),
        symbol("FIVE", integer, 30, Role::Constant),
        symbol("LAMP", logical, LAMP, Role::Output(lines(1, 0, 1, Format::Bit))),
        Symbol { elements: Some(3), ..symbol("LIST", integer, LIST, variable) },
        symbol("PR", logical, PR, pin),
        symbol("Q", logical, Q, variable),
        symbol("SPEED", integer, SPEED, Role::Output(lines(1, 4, 4, Format::TwosComplement))),
        symbol("TC", logical, TC, Role::TimerControl(0)),
        symbol("TOOL", integer, TOOL, Role::Input(bcd)),
        symbol("TOTAL", long, TOTAL, variable),
    ];
    let announcement = |name: &str, offset| Announcement {
        name: name.into(),
        offset,
        text: vec![TextItem::Text("TOOL".into()), TextItem::Value { ty: integer, offset: TOOL }],
    };
    let tables = PmiTables {
        codes: vec![],
        symbols,
        timers: vec![Timer { kind, control: TC, delayed: DC, counter: COUNTER, preset: 3 }],
        flipflops: vec![FlipFlop {
            q: Q,
            d: Some(D),
            clock: Some(CK),
            preset: Some(PR),
            clear: Some(CL),
            last_clock: LAST,
        }],
        faults: vec![announcement("BROKEN", BROKEN)],
        messages: vec![announcement("LAMP", LAMP)],
        special: Special { ipl: IPL, estop: ESTOP, crset: CRSET },
        ports: PORTS,
        initial: vec![(30, integer, 5), (COUNTER, long, -1)],
    };
    Program {
        files: vec!["test.pmi".into()],
        image_size: PORTS + 2048,
        regions: vec![],
        tasks: vec![Task { name: "scan".into(), entry: 0, resume_points: vec![] }],
        tables: Tables::Pmi(tables),
        names: vec![],
    }
}

struct Control {
    executive: PmiExecutive,
    events: Vec<Event>,
}

impl Control {
    fn with(kind: TimerKind, period_ms: u64) -> Self {
        let options = PmiOptions { period_ns: period_ms * 1_000_000 };
        let executive = PmiExecutive::new(&program(kind), options).unwrap();
        Self { executive, events: vec![] }
    }

    fn new() -> Self {
        Self::with(TimerKind::E, 20)
    }

    fn set(&mut self, name: &str, value: i64) {
        let variable = self.executive.names().find(name, Purpose::Stimulus).unwrap();
        self.executive.write(variable, Setting::Int(value));
    }

    fn get(&mut self, name: &str) -> i64 {
        let variable = self.executive.names().find(name, Purpose::Watch).unwrap();
        let Value::Int(value) = self.executive.read(variable) else {
            panic!("{name} is not a scalar")
        };
        value
    }

    fn scan(&mut self, script: impl FnMut(&mut [u8]) -> Outcome) -> Result<(), Stop> {
        self.executive.tick(&mut Script(script), &mut self.events)
    }

    fn idle(&mut self) {
        self.scan(|_| Outcome::End).unwrap();
    }
}

#[test]
fn ipl_and_reset_are_pulses() {
    let mut control = Control::new();
    control.set("@IPL", 0);
    control.set("@CRSET", 1);
    control
        .scan(|image| {
            assert_eq!([read_u8(image, IPL), read_u8(image, CRSET)], [1, 1]);
            Outcome::End
        })
        .unwrap();
    assert_eq!((control.get("@IPL"), control.get("@CRSET")), (1, 1));
    control.set("@IPL", 1);
    control
        .scan(|image| {
            assert_eq!([read_u8(image, IPL), read_u8(image, CRSET)], [0, 0]);
            Outcome::End
        })
        .unwrap();
    control.set("@CRSET", 1);
    control.idle();
    control.set("@CRSET", 1);
    control.idle();
    assert_eq!(control.get("@CRSET"), 1, "it is pulsed again");
}

#[test]
fn inputs_are_latched_and_outputs_driven() {
    let mut control = Control::new();
    control.set("BUTTON", 7);
    control.set("TOOL", 42);
    assert_eq!(control.get("BUTTON"), 0, "not latched yet");
    assert_eq!(control.get("PORT0.3"), 1);
    assert_eq!([control.get("PORT2.1"), control.get("PORT2.6"), control.get("PORT2.0")], [1, 1, 0]);
    control
        .scan(|image| {
            assert_eq!((read_u8(image, BUTTON), read_i16(image, TOOL)), (1, 42));
            write_u8(image, LAMP, 1);
            write_i16(image, SPEED, 25);
            Outcome::End
        })
        .unwrap();
    assert_eq!(control.get("SPEED"), 25, "reads back the value, not the bits");
    assert_eq!(control.executive.image()[PORTS as usize + 1], 0x91);
    control.set("PORT0.3", 0);
    control.idle();
    assert_eq!(control.get("BUTTON"), 0);
}

#[test]
fn values_of_a_stimulus_are_checked() {
    let mut control = Control::new();
    let executive = &mut control.executive;
    let tool = executive.names().find("TOOL", Purpose::Stimulus).unwrap();
    let total = executive.names().find("total", Purpose::Stimulus).unwrap();
    assert_eq!(executive.names().parse(tool, "99"), Ok(Setting::Int(99)));
    for (variable, text) in
        [(tool, "100"), (tool, "-1"), (total, "1.5"), (total, "$10"), (total, ""), (total, "x")]
    {
        assert!(executive.names().parse(variable, text).is_err(), "{text}");
    }
    assert_eq!(executive.names().parse(total, " -70000 "), Ok(Setting::Int(-70000)));
    control.set("TOTAL", 0x1_8000_0000);
    control.set("LIST[2]", 70_000);
    control.set("BROKEN", 256);
    assert_eq!(control.get("TOTAL"), i64::from(i32::MIN));
    assert_eq!(control.get("LIST[2]"), 4464);
    assert_eq!(control.get("BROKEN"), 1);
}

#[test]
fn an_e_timer_switches_on_late() {
    let mut control = Control::new();
    let on = |image: &mut [u8]| {
        write_u8(image, TC, 1);
        if read_i32(image, COUNTER) == -1 {
            plcc_abi::image::write_i32(image, COUNTER, 3);
        }
        Outcome::End
    };
    let mut delayed = vec![];
    for _ in 0..5 {
        control.scan(on).unwrap();
        delayed.push(control.get("DC"));
    }
    assert_eq!(delayed, [0, 0, 0, 1, 1], "started in scan 0, on in scan 0+3");
    control.set("TC", 0);
    assert_eq!((control.get("DC"), control.get("TC#COUNT")), (0, -1), "off at once");
    control.set("TC", 1);
    control.set("TC", 1);
    assert_eq!(control.get("TC#COUNT"), 3);
    control.idle();
    control.set("TC", 1);
    assert_eq!(control.get("TC#COUNT"), 2, "a second assignment does not start it again");
}

#[test]
fn a_d_timer_switches_off_late() {
    let mut control = Control::with(TimerKind::D, 20);
    control.set("TC", 0);
    assert_eq!(control.get("TC#COUNT"), -1, "DC is not on, so nothing starts");
    control.set("TC", 1);
    assert_eq!((control.get("DC"), control.get("TC#COUNT")), (1, -1));
    control.idle();
    control.set("TC", 0);
    let mut delayed = vec![];
    for _ in 0..4 {
        control.idle();
        delayed.push(control.get("DC"));
    }
    assert_eq!(delayed, [1, 1, 0, 0]);
}

#[test]
fn time_below_a_timer_unit_is_carried_over() {
    let mut control = Control::with(TimerKind::E, 15);
    control.set("TC", 1);
    let mut counts = vec![];
    for _ in 0..6 {
        control.idle();
        counts.push(control.get("TC#COUNT"));
    }
    assert_eq!(counts, [3, 3, 2, 1, 0, 0], "15, 30, 45, 60, 75 ms");
    let mut control = Control::with(TimerKind::E, 50);
    control.set("TC", 1);
    let mut counts = vec![];
    for _ in 0..3 {
        control.idle();
        counts.push(control.get("TC#COUNT"));
    }
    assert_eq!(counts, [3, 1, 0], "50 and 100 ms");
    assert_eq!(control.get("DC"), 1);
}

#[test]
fn a_flip_flop_acts_on_its_pins() {
    let mut control = Control::new();
    for (pin, value, q) in [
        ("D", 1, 0),
        ("CK", 1, 1),
        ("D", 0, 1),
        ("CK", 1, 1),
        ("CK", 0, 1),
        ("CK", 1, 0),
        ("PR", 1, 1),
        ("CL", 1, 0),
        ("CL", 0, 1),
        ("PR", 0, 1),
        ("CL", 1, 0),
    ] {
        control.set(pin, value);
        assert_eq!(control.get("Q"), q, "{pin} = {value}");
    }
}

#[test]
fn faults_come_before_messages_when_they_change() {
    let mut control = Control::new();
    control.set("TOOL", 7);
    let flip = |image: &mut [u8]| {
        for at in [LAMP, BROKEN] {
            let value = 1 - read_u8(image, at);
            write_u8(image, at, value);
        }
        Outcome::End
    };
    control.scan(flip).unwrap();
    control.idle();
    control.scan(flip).unwrap();
    let text = || "TOOL 7".into();
    let fault = |state| EventBody::Fault { name: "BROKEN".into(), state, text: text() };
    let message = |state| EventBody::Message {
        name: Some("LAMP".into()),
        flag: None,
        state,
        text: text(),
        index: None,
    };
    let told: Vec<_> = control.events.iter().map(|e| (e.tick, e.body.clone())).collect();
    assert_eq!(
        told,
        [(0, fault("on")), (0, message("on")), (2, fault("off")), (2, message("off"))]
    );
}

#[test]
fn an_index_out_of_bounds_is_an_emergency_stop() {
    let mut control = Control::new();
    control
        .scan(|image| {
            write_u8(image, LAMP, 1);
            Outcome::End
        })
        .unwrap();
    let stop = control.scan(|image| {
        // Lines of the port that no output declares.
        write_u8(image, PORTS + 1, 0xFF);
        write_u8(image, BROKEN, 1);
        write_i16(image, SPEED, 3);
        Outcome::trap(TrapCode::ArrayBounds)
    });
    assert_eq!(stop.unwrap_err().code, "NO PMI DATA");
    assert_eq!(control.executive.image()[PORTS as usize + 1], 0);
    assert_eq!([control.get("LAMP"), control.get("SPEED"), control.get("@ESTOP")], [1, 3, 1]);
    assert!(matches!(control.events.last().unwrap().body, EventBody::Fault { .. }));
}

#[test]
fn names_have_one_spelling() {
    let control = Control::new();
    for (written, canonical) in [
        ("tc", "TC"),
        (" LIST ", "LIST"),
        ("LIST[02]", "LIST[2]"),
        ("TC#COUNT", "TC#COUNT"),
        ("PORT01.7", "PORT1.7"),
        ("@nvlng[1]", "@NVLNG[1]"),
    ] {
        let variable = control.executive.names().find(written, Purpose::Watch).unwrap();
        assert_eq!(control.executive.names().canonical(variable), canonical);
    }
    for name in [
        "",
        "FIVE",
        "LIST[3]",
        "LIST[-1]",
        "LIST[",
        "LIST[]",
        "LIST[1]x",
        "TC[0]",
        "DC#COUNT",
        "TC#C",
        "PORT2048.0",
        "PORT1.8",
        "PORT",
        "PORT1",
        "LAMP.0",
    ] {
        assert!(control.executive.names().find(name, Purpose::Watch).is_err(), "{name}");
    }
    assert!(control.executive.names().find("LIST", Purpose::Stimulus).is_err());
    let slip = control.executive.names().find("BUTTEN", Purpose::Watch).unwrap_err();
    let NameError::Unknown { suggestion, .. } = slip else { panic!("{slip}") };
    assert_eq!(suggestion.as_deref(), Some("BUTTON"));
}

#[test]
fn a_dump_has_what_the_program_names() {
    let control = Control::new();
    let declared = control.executive.names().declared();
    let names: Vec<&str> = declared.iter().map(|(name, _)| name.as_str()).collect();
    assert!(names.contains(&"FIVE") && !names.contains(&"@ESTOP"));
    let (_, list) = declared.iter().find(|(name, _)| name == "LIST").unwrap();
    let zeros = vec![Value::Int(0); 3];
    assert_eq!(control.executive.read(*list), Value::Array(zeros));
}

#[test]
fn only_non_volatile_variables_are_retained() {
    let mut control = Control::new();
    control.set("@NVLNG[1]", -123_456);
    control.set("TOTAL", 5);
    let kept = control.executive.retained().unwrap();
    let mut next = Control::new();
    next.executive.restore(&kept).unwrap();
    assert_eq!((next.get("@NVLNG[1]"), next.get("TOTAL")), (-123_456, 0));
    for cut in 0..kept.len() {
        let mut other = Control::new();
        let _ = other.executive.restore(&kept[..cut]);
        assert_eq!(other.get("@NVLNG[1]"), 0, "{cut}");
    }
}

/// Retained variables of another program go over by name and type.
#[test]
fn retained_variables_go_over_to_a_program_that_declares_them_otherwise() {
    let mut control = Control::new();
    control.set("@NVLNG[0]", 4);
    control.set("@NVLNG[1]", 5);
    let kept = control.executive.retained().unwrap();
    let element = || vec!["@NVLNG[1] to [1]".to_owned()];
    let further = || vec!["@NVLNG[2] to [5]".to_owned()];
    let all = || vec!["@NVLNG".to_owned()];
    for (ty, elements, kept_count, gone, new) in [
        (Type::Long, Some(2), 2, vec![], vec![]),
        (Type::Long, Some(1), 1, element(), vec![]),
        (Type::Long, Some(6), 2, vec![], further()),
        (Type::Integer, Some(2), 0, all(), all()),
    ] {
        let mut other = program(TimerKind::E);
        let Tables::Pmi(tables) = &mut other.tables else { panic!("PMI's tables") };
        let symbol = tables.symbols.iter_mut().find(|symbol| symbol.retained).unwrap();
        (symbol.ty, symbol.elements) = (ty, elements);
        let mut executive = PmiExecutive::new(&other, PmiOptions { period_ns: 1 }).unwrap();
        let restored = executive.restore(&kept).unwrap();
        let other_program = !gone.is_empty() || !new.is_empty();
        let expected = crate::Restored { other_program, kept: kept_count, gone, new };
        assert_eq!(restored, expected);
        let first = executive.names().find("@NVLNG[0]", Purpose::Watch).unwrap();
        let value = if ty == Type::Long { 4 } else { 0 };
        assert_eq!(executive.read(first), Value::Int(value));
    }
}

#[test]
fn tables_that_do_not_fit_are_refused() {
    let mut damaged = program(TimerKind::E);
    damaged.image_size = PORTS + 2047;
    let refused = PmiExecutive::new(&damaged, PmiOptions::default());
    assert!(matches!(refused, Err(PmiLoadError::Damaged(_))));
    for (low, count) in [(0, 0), (7, 2), (255, 255)] {
        let mut damaged = program(TimerKind::E);
        let Tables::Pmi(tables) = &mut damaged.tables else { panic!("PMI's tables") };
        let lines = Lines { port: 0, low, count, format: Format::Binary };
        tables.symbols[0].role = Role::Input(lines);
        assert!(PmiExecutive::new(&damaged, PmiOptions::default()).is_err(), "{low} {count}");
    }
    let other = Program { tables: Tables::Nct(Default::default()), ..program(TimerKind::E) };
    let refused = PmiExecutive::new(&other, PmiOptions::default());
    assert_eq!(refused.unwrap_err(), PmiLoadError::OtherDialect);
}

impl Control {
    /// Forces a variable, or ends its force.
    fn force(&mut self, name: &str, value: Option<i64>) -> Result<(), &'static str> {
        let variable = self.executive.names().find(name, Purpose::Watch).unwrap();
        let keys = self.executive.names().elements(variable);
        self.executive.force(keys[0], value.map(Setting::Int))
    }
}

#[test]
fn a_forced_input_is_seen_and_its_line_stays() {
    let mut control = Control::new();
    control.set("BUTTON", 0);
    control.force("BUTTON", Some(1)).unwrap();
    control.force("TOOL", Some(42)).unwrap();
    control
        .scan(|image| {
            assert_eq!((read_u8(image, BUTTON), read_i16(image, TOOL)), (1, 42));
            Outcome::End
        })
        .unwrap();
    assert_eq!((control.get("PORT0.3"), control.get("BUTTON")), (0, 1));
    control.set("BUTTON", 1);
    control.force("BUTTON", Some(0)).unwrap();
    control.idle();
    assert_eq!((control.get("PORT0.3"), control.get("BUTTON")), (1, 0));
    control.force("BUTTON", None).unwrap();
    control.idle();
    assert_eq!(control.get("BUTTON"), 1);
}

#[test]
fn a_forced_output_has_its_value_on_the_lines_alone() {
    let mut control = Control::new();
    control.force("LAMP", Some(1)).unwrap();
    control.force("SPEED", Some(-3)).unwrap();
    control.idle();
    assert_eq!((control.get("LAMP"), control.get("PORT1.0")), (0, 1));
    assert_eq!((control.get("SPEED"), control.get("PORT1.7")), (0, 1));
    control.force("SPEED", None).unwrap();
    control.idle();
    assert_eq!((control.get("PORT1.7"), control.get("PORT1.0")), (0, 1));
    let stop = control.scan(|_| Outcome::trap(TrapCode::ArrayBounds));
    assert!(stop.is_err());
    assert_eq!(control.get("PORT1.0"), 0, "a stop clears forced lines too");
}

#[test]
fn a_forced_line_is_latched_or_driven() {
    let mut control = Control::new();
    let names = control.executive.names();
    let tool = names.find("TOOL", Purpose::Watch).unwrap();
    let lines: Vec<String> =
        names.lines(tool).into_iter().map(|line| names.canonical(line)).collect();
    control.set("TOOL", 0);
    control.force(&lines[1], Some(1)).unwrap();
    control.force("PORT0.3", Some(1)).unwrap();
    control.force("PORT1.0", Some(1)).unwrap();
    control.idle();
    assert_eq!((control.get("TOOL"), control.get(&lines[1])), (2, 0), "the line stays what it is");
    assert_eq!(control.get("BUTTON"), 1);
    assert_eq!((control.get("LAMP"), control.get("PORT1.0")), (0, 1));
    assert!(control.force("PORT1.0", Some(2)).is_err());
    let forced: Vec<_> =
        control.executive.forces().into_iter().map(|(key, _)| names.canonical(key)).collect();
    assert_eq!(forced, [lines[1].as_str(), "PORT0.3", "PORT1.0"]);
    let line = names.find(&lines[1], Purpose::Watch).unwrap();
    assert!(names.share_forced_bits(line, tool));
    assert!(!names.share_forced_bits(line, names.find("BUTTON", Purpose::Watch).unwrap()));
    for name in [lines[1].as_str(), "PORT0.3", "PORT1.0"] {
        control.force(name, None).unwrap();
    }
    control.idle();
    assert_eq!((control.get("TOOL"), control.get("BUTTON"), control.get("PORT1.0")), (0, 0, 0));
    let shown = names.shown_in_image();
    assert!(shown.contains(&line), "a line of a group has a symbol of its own");
    assert!(
        !shown.contains(&names.find("PORT0.3", Purpose::Watch).unwrap()),
        "BUTTON is this line"
    );
}

#[test]
fn only_inputs_and_outputs_can_be_forced_to_what_their_lines_carry() {
    let mut control = Control::new();
    for name in ["TOTAL", "LIST", "TC#COUNT", "PORT7.0", "PORT0.7", "@ESTOP"] {
        assert!(control.force(name, Some(1)).is_err(), "{name}");
    }
    for value in [7, 2, -1] {
        assert!(control.force("BUTTON", Some(value)).is_err(), "{value}");
        assert!(control.force("LAMP", Some(value)).is_err(), "{value}");
    }
    assert!(control.force("TOOL", Some(100)).is_err());
    assert!(control.force("TOOL", Some(99)).is_ok());
}

#[test]
fn a_key_means_the_same_to_every_executive_of_a_program() {
    let control = Control::new();
    let mut other = Control::new();
    // The other one has looked up other names before.
    other.get("TOTAL");
    for name in ["LIST", "LAMP", "TC#COUNT", "PORT1.0", "@NVLNG[1]"] {
        let variable = control.executive.names().find(name, Purpose::Watch).unwrap();
        for (element, key) in control.executive.names().elements(variable).into_iter().enumerate() {
            let value = 1 - element as i64 % 2;
            other.executive.write(key, Setting::Int(value));
            assert_eq!(other.executive.read(key), Value::Int(value), "{name}");
        }
    }
    assert_eq!((other.get("LIST[0]"), other.get("LIST[1]"), other.get("LIST[2]")), (1, 0, 1));
}
