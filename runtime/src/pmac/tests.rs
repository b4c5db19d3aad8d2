//! The executive with a scripted engine: what runs when, and what the host does.

use plcc_abi::{
    Engine, HostFn, Outcome, Program, ResumePoint, Scan, Tables, Task,
    image::{read_f64, write_f64},
    pmac::{
        self, CommandStep, Controller, Define, Definition, Field, Kind, Layout, Memory, PlcOp,
        PmacTables, Range, Run, Space, Text, Variable as Named,
    },
};

use super::{PmacExecutive, PmacOptions};
use crate::online_change::TakeOver;
use crate::{Event, EventBody, Executive, Purpose, Setting, Value};

type Call = Box<dyn FnMut(&mut Scan<'_>) -> Outcome>;

/// Tasks as closures; notes which were called, and with which resume point.
#[derive(Default)]
struct Script {
    tasks: Vec<(&'static str, Call)>,
    log: Vec<String>,
}

impl Engine for Script {
    fn call(&mut self, task: usize, from: Option<ResumePoint>, scan: &mut Scan<'_>) -> Outcome {
        let (name, call) = &mut self.tasks[task];
        let from = from.map_or_else(String::new, |point| format!("@{}", point.0));
        self.log.push(format!("{name}{from}"));
        call(scan)
    }
}

/// A download in the making.
struct Download {
    layout: Layout,
    image: Vec<u8>,
    tables: PmacTables,
    script: Script,
}

impl Download {
    fn new(controller: Controller) -> Self {
        let layout = Layout::new(controller);
        let mut image = vec![0; layout.size as usize];
        write_f64(&mut image, layout.i_offset(5), 3.0);
        write_f64(&mut image, layout.i_offset(8), 2.0);
        write_f64(&mut image, layout.i_offset(10), 3_713_707.0);
        let ranges = vec![(5, Range::Integer(0, 3)), (8, Range::Integer(0, 255))];
        let tables = PmacTables { controller, ranges, ..PmacTables::default() };
        Self { layout, image, tables, script: Script::default() }
    }

    fn memory(&mut self) -> Memory<'_> {
        Memory { image: &mut self.image, layout: &self.layout, sparse: &mut self.tables.sparse }
    }

    fn task(
        &mut self,
        name: &'static str,
        call: impl FnMut(&mut Scan<'_>) -> Outcome + 'static,
    ) -> u32 {
        self.script.tasks.push((name, Box::new(call)));
        self.script.tasks.len() as u32 - 1
    }

    /// A PLC that does something and ends; its number is after the C or CC of its name.
    fn plc(&mut self, name: &'static str, mut call: impl FnMut(&mut Scan<'_>) + 'static) {
        let task = self.task(name, move |scan| {
            call(scan);
            Outcome::End
        });
        let number = name.trim_start_matches(char::is_alphabetic).parse().unwrap();
        let compiled = name.starts_with("PLCC");
        self.tables.programs.push(pmac::Program {
            number,
            compiled,
            task,
            enabled: true,
            paused: false,
            fingerprint: 0,
        });
    }

    fn start(self) -> (PmacExecutive, Script) {
        let (executive, script, _) = self.start_with_program();
        (executive, script)
    }

    fn start_with_program(mut self) -> (PmacExecutive, Script, Program) {
        self.memory().definitions().set_reference();
        self.tables.initial = Run::pack(&self.image);
        let program = Program {
            files: vec![],
            image_size: self.layout.size,
            regions: self.layout.regions(),
            tasks: self
                .script
                .tasks
                .iter()
                .map(|(name, _)| Task { name: (*name).into(), entry: 0, resume_points: vec![] })
                .collect(),
            tables: Tables::Pmac(self.tables),
            names: vec![],
        };
        let executive = PmacExecutive::new(&program, PmacOptions::default()).unwrap();
        (executive, self.script, program)
    }
}

fn call(scan: &mut Scan<'_>, function: HostFn, args: [u64; 4]) -> u64 {
    scan.host.call(scan.image, function, args)
}

fn plc(scan: &mut Scan<'_>, op: PlcOp, compiled: bool, number: u64) {
    call(scan, HostFn::PmacPlc, [op as u64, u64::from(compiled), number, number]);
}

fn run(executive: &mut PmacExecutive, script: &mut Script, ticks: u32) -> Vec<Event> {
    let mut events = Vec::new();
    for _ in 0..ticks {
        executive.tick(script, &mut events).unwrap();
    }
    events
}

fn set(executive: &mut PmacExecutive, name: &str, text: &str) {
    let variable = executive.names().find(name, Purpose::Stimulus).unwrap();
    let value = executive.names().parse(variable, text).unwrap();
    executive.write(variable, value);
}

fn get(executive: &mut PmacExecutive, name: &str) -> f64 {
    let variable = executive.names().find(name, Purpose::Watch).unwrap();
    match executive.read(variable) {
        Value::Float(value) => value,
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_tick_runs_its_tasks_in_order() {
    let mut download = Download::new(Controller::Pmac);
    for name in ["PLCC0", "PLC0", "PLC2", "PLC1", "PLCC3", "PLCC1"] {
        download.plc(name, |_| ());
    }
    let (mut executive, mut script) = download.start();
    run(&mut executive, &mut script, 4);
    let expected = "PLC0 PLCC0 PLC1 PLCC1 PLCC3 PLC2 PLCC1 PLCC3 PLC1 PLCC1 PLCC3 \
                    PLC0 PLCC0 PLC2 PLCC1 PLCC3";
    assert_eq!(script.log.join(" "), expected);
    assert_eq!(get(&mut executive, "X:0"), 4.0);
    assert_eq!(get(&mut executive, "X:$700"), f64::from(0x100_0000 - 4));
    assert_eq!(get(&mut executive, "Y:$1F"), 4095.0);
}

#[test]
fn i5_says_what_runs_and_is_asked_before_each() {
    for (i5, expected) in [
        ("0", ""),
        ("1", "PLC0 PLCC0"),
        ("2", "PLC1 PLCC1"),
        ("3", "PLC0 PLCC0 PLC1 PLCC1"),
        ("5", "PLC0 PLCC0"),
    ] {
        let mut download = Download::new(Controller::Pmac);
        for name in ["PLC0", "PLCC0", "PLC1", "PLCC1"] {
            download.plc(name, |_| ());
        }
        let (mut executive, mut script) = download.start();
        set(&mut executive, "I5", i5);
        run(&mut executive, &mut script, 1);
        assert_eq!(script.log.join(" "), expected, "I5={i5}");
    }
    let mut download = Download::new(Controller::Pmac);
    download.plc("PLC1", |scan| {
        call(scan, HostFn::PmacIWrite, [5, 1_f64.to_bits(), 0, 0]);
    });
    download.plc("PLCC1", |_| ());
    let (mut executive, mut script) = download.start();
    run(&mut executive, &mut script, 2);
    assert_eq!(script.log.join(" "), "PLC1");
}

#[test]
fn the_interrupt_counter_is_reloaded_at_each_interrupt() {
    let mut download = Download::new(Controller::Pmac);
    download.plc("PLC0", |_| ());
    let (mut executive, mut script) = download.start();
    let mut seen = Vec::new();
    for tick in 0..12 {
        if tick == 4 {
            set(&mut executive, "I8", "0");
        }
        if run(&mut executive, &mut script, 1).is_empty() && !script.log.is_empty() {
            seen.push(tick);
        }
        script.log.clear();
    }
    assert_eq!(seen, [0, 3, 6, 7, 8, 9, 10, 11]);
}

#[test]
fn plccs_run_for_every_plc() {
    let mut download = Download::new(Controller::Pmac);
    for name in ["PLC1", "PLC2", "PLC3", "PLC4", "PLC5", "PLC6", "PLC31"] {
        download.plc(name, |_| ());
    }
    download.plc("PLCC1", |_| ());
    let (mut executive, mut script) = download.start();
    run(&mut executive, &mut script, 14);
    let count = |wanted: &str| script.log.iter().filter(|name| *name == wanted).count();
    assert_eq!((count("PLC1"), count("PLC31"), count("PLCC1")), (2, 2, 14));
}

/// A PLC is set as by the on-line commands ENABLE, DISABLE, PAUSE and RESUME.
#[test]
fn plcs_are_enabled_and_disabled_from_outside() {
    let mut download = Download::new(Controller::Pmac);
    download.plc("PLC1", |_| ());
    download.plc("PLCC2", |_| ());
    let (mut executive, mut script) = download.start();
    assert_eq!((get(&mut executive, "PLC1"), get(&mut executive, "PLCC2")), (1.0, 1.0));
    for (name, value, state) in [
        ("PLCC2", "0", 0.0),
        ("PLC1", "2", 2.0),
        // Only what is paused goes on, and only what is enabled pauses.
        ("PLCC2", "3", 0.0),
        ("PLCC2", "2", 0.0),
        ("PLC1", "3", 1.0),
        ("PLC1", "0", 0.0),
    ] {
        set(&mut executive, name, value);
        assert_eq!(get(&mut executive, name), state, "{name}={value}");
    }
    run(&mut executive, &mut script, 2);
    assert_eq!(script.log.join(" "), "");
    set(&mut executive, "PLC1", "1");
    run(&mut executive, &mut script, 1);
    assert_eq!(script.log.join(" "), "PLC1");
    assert!(executive.names().find("PLC3", Purpose::Watch).is_err());
    let plc = executive.names().find("PLC1", Purpose::Stimulus).unwrap();
    assert!(executive.names().parse(plc, "4").is_err());
    let [key] = executive.names().elements(plc)[..] else { panic!() };
    assert!(executive.force(key, Some(Setting::Float(0.0))).is_err());
}

#[test]
fn several_background_steps_run_in_a_tick() {
    let mut download = Download::new(Controller::Pmac);
    download.plc("PLC1", |_| ());
    download.plc("PLC2", |_| ());
    let (mut executive, mut script) = download.start();
    executive.options.background_steps = 3;
    run(&mut executive, &mut script, 1);
    assert_eq!(script.log.join(" "), "PLC1 PLC2 PLC1");
}

#[test]
fn a_plc_that_disables_itself_finishes_its_scan() {
    let mut download = Download::new(Controller::Pmac);
    let p1 = download.layout.p_offset(1);
    download.plc("PLC1", move |scan| {
        plc(scan, PlcOp::Disable, false, 1);
        let count = read_f64(scan.image, p1);
        write_f64(scan.image, p1, count + 1.0);
    });
    download.plc("PLC2", |_| ());
    let (mut executive, mut script) = download.start();
    run(&mut executive, &mut script, 3);
    assert_eq!(script.log.join(" "), "PLC1 PLC2 PLC2");
    assert_eq!(get(&mut executive, "P1"), 1.0);
}

#[test]
fn enable_starts_at_the_top_and_resume_does_not() {
    let mut download = Download::new(Controller::Pmac);
    let waiting = download.task("PLC3", |_| Outcome::Suspended(ResumePoint(2)));
    let entry = pmac::Program {
        number: 3,
        compiled: false,
        task: waiting,
        enabled: true,
        paused: false,
        fingerprint: 0,
    };
    download.tables.programs.push(entry);
    let mut step = 0;
    download.plc("PLC0", move |scan| {
        step += 1;
        match step {
            2 => plc(scan, PlcOp::Pause, false, 3),
            3 => plc(scan, PlcOp::Resume, false, 3),
            4 => plc(scan, PlcOp::Enable, false, 3),
            5 => {
                plc(scan, PlcOp::Disable, false, 3);
                plc(scan, PlcOp::Resume, false, 3);
                plc(scan, PlcOp::Pause, false, 3);
            }
            6 => plc(scan, PlcOp::Enable, false, 3),
            _ => {}
        }
    });
    let (mut executive, mut script) = download.start();
    set(&mut executive, "I8", "0");
    run(&mut executive, &mut script, 6);
    let expected = "PLC0 PLC3 PLC0 PLC0 PLC3@2 PLC0 PLC3 PLC0 PLC0 PLC3";
    assert_eq!(script.log.join(" "), expected);
}

#[test]
fn commands_wait_for_the_end_of_the_step() {
    let mut download = Download::new(Controller::Pmac);
    let layout = download.layout;
    download.plc("PLC4", move |scan| {
        let q_base = layout.q_base_of(2);
        plcc_abi::image::write_u32(scan.image, layout.q_base_at(4), q_base);
        call(scan, HostFn::PmacEvent, [0; 4]);
        call(scan, HostFn::PmacEvent, [1, 0, 0, 0]);
    });
    download.plc("PLCC1", |_| ());
    let task = download.task("command", move |scan| {
        let base = plcc_abi::image::read_u32(scan.image, layout.q_base_at(pmac::COMMAND_CONTEXT));
        write_f64(scan.image, layout.q_offset(base + 5), 7.0);
        Outcome::End
    });
    download.tables.texts = vec![
        Text::Command { text: "Q5=7".into(), error: None, steps: vec![CommandStep::Task(task)] },
        Text::Command { text: "Q5=".into(), error: Some("ERR003".into()), steps: vec![] },
    ];
    let (mut executive, mut script) = download.start();
    let events = run(&mut executive, &mut script, 1);
    assert_eq!(script.log.join(" "), "PLC4 PLCC1 command");
    assert_eq!(get(&mut executive, "&2Q5"), 7.0);
    let lines: Vec<String> =
        events.iter().map(|event| serde_json::to_string(event).unwrap()).collect();
    assert_eq!(
        lines,
        [
            r#"{"tick":0,"kind":"command","text":"Q5=7"}"#,
            r#"{"tick":0,"kind":"command","text":"Q5=","error":"ERR003"}"#,
        ]
    );
}

#[test]
fn texts_become_events_at_the_statement() {
    let mut download = Download::new(Controller::Pmac);
    download.tables.texts = vec![
        Text::Send { text: "HELLO".into(), port: None },
        Text::Send { text: "^G".into(), port: Some("S".into()) },
        Text::Show { text: "READY".into(), position: 8 },
        Text::Value { position: 20, width: 8, decimals: 2 },
        Text::Macro { text: "MACROSLVWRITE0,MI910,P1".into() },
    ];
    download.plc("PLC1", |scan| {
        for index in 0..6 {
            call(scan, HostFn::PmacEvent, [index, (-2.345_f64).to_bits(), 0, 0]);
        }
    });
    let (mut executive, mut script) = download.start();
    let events = run(&mut executive, &mut script, 1);
    let bodies: Vec<EventBody> = events.into_iter().map(|event| event.body).collect();
    assert_eq!(
        bodies,
        [
            EventBody::Send { text: "HELLO".into(), port: None },
            EventBody::Send { text: "^G".into(), port: Some("S".into()) },
            EventBody::Display { text: "READY".into(), position: Some(8) },
            EventBody::Display { text: "   -2.35".into(), position: Some(20) },
            EventBody::Macro { text: "MACROSLVWRITE0,MI910,P1".into() },
        ]
    );
}

#[test]
fn timers_count_down_to_their_least_value() {
    let mut download = Download::new(Controller::Turbo);
    download.plc("PLC1", |_| ());
    let (mut executive, mut script) = download.start();
    set(&mut executive, "X:$700", "10");
    set(&mut executive, "Y:$701", "-8388607");
    set(&mut executive, "X:0", "$FFFFFF");
    set(&mut executive, "I5111", "100");
    set(&mut executive, "I6612", "-8388608");
    run(&mut executive, &mut script, 3);
    assert_eq!(get(&mut executive, "X:$700"), 7.0);
    assert_eq!(get(&mut executive, "Y:$701"), f64::from(0x80_0000));
    assert_eq!(get(&mut executive, "X:$0"), 2.0);
    assert_eq!(get(&mut executive, "I5111"), 97.0);
    assert_eq!(get(&mut executive, "I6612"), -8_388_608.0);
    assert_eq!(get(&mut executive, "I5011"), 0.0);
}

#[test]
fn a_stimulus_is_converted_as_an_assignment() {
    let mut download = Download::new(Controller::Pmac);
    let output = Field { offset: 8, width: 1, format: pmac::Format::U };
    download.memory().define(1, Definition::Y { address: 0xFFC2, field: output });
    let word = Field { offset: 0, width: 24, format: pmac::Format::U };
    download.tables.l = vec![(7, Definition::X { address: 0x10, field: word })];
    let (mut executive, mut script) = download.start();
    for (name, text, stored) in [
        ("M1", "3", 1.0),
        ("M2", "-1.5", -2.0),
        ("P3", "-0", 0.0),
        ("P3", "0.25", 0.25),
        ("I5", "6", 2.0),
        ("Q3", "$10", 16.0),
        ("L7", "$FFFFFF", f64::from(0xFF_FFFF)),
        ("Y:$FFC2", "-1", f64::from(0xFF_FFFF)),
        ("L:$1003", "1.5", 1.5),
    ] {
        set(&mut executive, name, text);
        assert_eq!(get(&mut executive, name), stored, "{name}");
    }
    assert_eq!(get(&mut executive, "P3"), 1.5);
    assert_eq!(get(&mut executive, "X:$10"), f64::from(0xFF_FFFF));
    run(&mut executive, &mut script, 1);
    let variable = executive.names().find("P3", Purpose::Watch).unwrap();
    executive.write(variable, Setting::Float(f64::NAN));
    assert_eq!(get(&mut executive, "P3"), 0.0);
}

#[test]
fn dumps_are_in_natural_order() {
    let mut download = Download::new(Controller::Pmac);
    let named = |kind, number, system| Named { kind, number, system };
    download.tables.named = vec![
        named(Kind::Q, 5, 1),
        named(Kind::P, 10, 1),
        named(Kind::P, 2, 1),
        named(Kind::Q, 5, 2),
        named(Kind::M, 11, 1),
        named(Kind::P, 2, 1),
        named(Kind::I, 5, 1),
    ];
    let (executive, _) = download.start();
    let names: Vec<String> =
        executive.names().declared().into_iter().map(|(name, _)| name).collect();
    assert_eq!(names, ["&2Q5", "I5", "M11", "P2", "P10", "Q5"]);
}

#[test]
fn a_command_can_change_a_definition() {
    let mut download = Download::new(Controller::Pmac);
    let field = Field { offset: 0, width: 4, format: pmac::Format::U };
    let definition = Definition::X { address: 0x20, field };
    download.tables.defines = vec![Define { first: 5, last: 6, definition }];
    download.plc("PLC1", |scan| {
        call(scan, HostFn::PmacDefine, [0; 4]);
        call(scan, HostFn::PmacMWrite, [5, 9_f64.to_bits(), 0, 0]);
        assert_eq!(call(scan, HostFn::PmacMRead, [6, 0, 0, 0]), 9_f64.to_bits());
        assert_eq!(call(scan, HostFn::PmacWordRead, [0, 0x20, 0, 0]), 9);
        call(scan, HostFn::PmacWordWrite, [1, 0x20, 0x5, 0]);
    });
    let (mut executive, mut script) = download.start();
    run(&mut executive, &mut script, 1);
    assert_eq!(executive.view().read_word(Space::Y, 0x20), 5);
    assert!(executive.view().differs_from_reference(5));
    assert!(!executive.view().differs_from_reference(7));
}

#[test]
fn save_keeps_the_values_of_its_moment() {
    let make = || {
        let mut download = Download::new(Controller::Pmac);
        download.memory().define(9, Definition::L { address: 0x1400 });
        download.plc("PLC1", |scan| {
            call(scan, HostFn::PmacSave, [0; 4]);
        });
        download.start()
    };
    let (mut executive, mut script) = make();
    assert_eq!(executive.retained(), None);
    set(&mut executive, "P5", "0.1");
    set(&mut executive, "M3", "-4");
    set(&mut executive, "Y:$BC09", "$1401");
    run(&mut executive, &mut script, 1);
    set(&mut executive, "P5", "2");
    let saved = executive.retained().unwrap();
    let (mut executive, _) = make();
    executive.restore(&saved).unwrap();
    assert_eq!(get(&mut executive, "P5"), 0.1);
    assert_eq!(get(&mut executive, "M3"), -4.0);
    assert_eq!(executive.view().definition(9), Definition::L { address: 0x1401 });
    assert!(executive.view().differs_from_reference(9));
    assert_eq!(executive.retained(), Some(saved.clone()));
    for wrong in [&[][..], &saved[..saved.len() - 1], &[1, 2, 3]] {
        assert!(executive.restore(wrong).is_err());
    }
    // Another download has other definitions after load; what was saved goes over to it.
    let (mut other, _) = Download::new(Controller::Pmac).start();
    let restored = other.restore(&saved).unwrap();
    assert!(restored.other_program, "{restored:?}");
    assert_eq!((get(&mut other, "P5"), get(&mut other, "M3")), (0.1, -4.0));
    let (mut own, _) = make();
    assert!(!own.restore(&other.retained().unwrap()).unwrap().is_complete());
    let (mut again, _) = Download::new(Controller::Pmac).start();
    assert!(!again.restore(&other.retained().unwrap()).unwrap().other_program);
}

#[test]
fn a_tick_lasts_as_i10_says() {
    let (mut executive, _) = Download::new(Controller::Pmac).start();
    assert_eq!(executive.tick_ns(), 442_708);
    set(&mut executive, "I10", "8388608");
    assert_eq!(executive.tick_ns(), 1_000_000);
    set(&mut executive, "I10", "0");
    assert_eq!(executive.tick_ns(), 442_708);
}

#[test]
fn a_trap_stops_the_control() {
    let mut download = Download::new(Controller::Pmac);
    let task = download.task("PLC1", |_| Outcome::trap(plcc_abi::TrapCode::Internal));
    let entry = pmac::Program {
        number: 1,
        compiled: false,
        task,
        enabled: true,
        paused: false,
        fingerprint: 0,
    };
    download.tables.programs.push(entry);
    let (mut executive, mut script) = download.start();
    let stop = executive.tick(&mut script, &mut Vec::new()).unwrap_err();
    assert_eq!(stop.code, "INTERNAL ERROR");
}

#[test]
fn forced_fields_are_held_for_the_program_and_behind_it() {
    let mut download = Download::new(Controller::Pmac);
    let field = Field { offset: 8, width: 1, format: pmac::Format::U };
    download.memory().define(7, Definition::Y { address: 0xFFC2, field });
    let seen = std::rc::Rc::new(std::cell::RefCell::new(vec![]));
    let log = std::rc::Rc::clone(&seen);
    download.plc("PLC1", move |scan| {
        log.borrow_mut().push(f64::from_bits(call(scan, HostFn::PmacMRead, [7, 0, 0, 0])));
        call(scan, HostFn::PmacMWrite, [7, 0_f64.to_bits(), 0, 0]);
    });
    let (mut executive, mut script) = download.start();
    let key = |executive: &mut PmacExecutive, name: &str| {
        let variable = executive.names().find(name, Purpose::Watch).unwrap();
        executive.names().elements(variable)[0]
    };
    let m7 = key(&mut executive, "M7");
    assert!(executive.force(m7, Some(Setting::Float(7.0))).is_err(), "a bit");
    executive.force(m7, Some(Setting::Float(1.0))).unwrap();
    run(&mut executive, &mut script, 2);
    assert_eq!(*seen.borrow(), [1.0, 1.0], "an input");
    assert_eq!(get(&mut executive, "Y:$FFC2"), 256.0, "an output");
    executive.force(m7, None).unwrap();
    run(&mut executive, &mut script, 2);
    assert_eq!(*seen.borrow(), [1.0, 1.0, 1.0, 0.0]);
    assert_eq!(get(&mut executive, "Y:$FFC2"), 0.0);
    let word = key(&mut executive, "X:$0100");
    executive.force(word, Some(Setting::Float(5.0))).unwrap();
    run(&mut executive, &mut script, 1);
    assert_eq!(get(&mut executive, "X:$100"), 5.0);
    for name in ["P1", "I5", "Q3", "M8"] {
        let key = key(&mut executive, name);
        assert!(executive.force(key, Some(Setting::Float(1.0))).is_err(), "{name}");
    }
}

#[test]
fn the_used_parts_of_an_image_are_those_of_its_variables() {
    let mut download = Download::new(Controller::Turbo);
    let field = Field { offset: 0, width: 24, format: pmac::Format::U };
    download.memory().define(7, Definition::Y { address: 0x7_8000, field });
    download.tables.named = vec![Named { kind: Kind::P, number: 9, system: 1 }];
    let layout = download.layout;
    let (executive, _) = download.start();
    let used = executive.used_ranges();
    let holds = |offset: u32| used.iter().any(|range| range.contains(&offset));
    assert!(holds(layout.p_offset(9)) && !holds(layout.p_offset(10)));
    let pmac::Place::Word(word) = layout.place(Space::Y, 0x7_8000) else { panic!("no word") };
    assert!(holds(word) && !holds(word + 8));
    let pmac::Place::Word(timer) = layout.place(Space::X, 0x700) else { panic!("no word") };
    assert!(holds(timer));
}

/// After an online change what is saved is still that of the former download, also in an executive that goes
/// on from a checkpoint.
#[test]
fn a_checkpoint_knows_which_download_has_saved() {
    let mut saving = Download::new(Controller::Pmac);
    saving.plc("PLC1", |scan| {
        call(scan, HostFn::PmacSave, [0; 4]);
    });
    let (mut old, mut script, old_program) = saving.start_with_program();
    set(&mut old, "P5", "0.1");
    run(&mut old, &mut script, 1);
    let make = || {
        let mut download = Download::new(Controller::Pmac);
        download.memory().define(9, Definition::L { address: 0x1400 });
        download.start_with_program()
    };
    let (mut new, _, new_program) = make();
    let comparison = crate::compare(&old_program, &new_program).unwrap();
    assert_eq!(new.take_over(&mut old, &comparison.plan), TakeOver::Done);
    let retained = new.retained().unwrap();
    assert!(make().0.restore(&retained).unwrap().other_program);
    let (mut resumed, ..) = make();
    resumed.resume(&new.checkpoint()).unwrap();
    assert_eq!(resumed.retained(), Some(retained));
}
