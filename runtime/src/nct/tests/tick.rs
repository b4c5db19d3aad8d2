//! The slice's order, the images, timers, stops and messages.

use plcc_abi::image::{read_u16, read_u32, write_u16};
use plcc_abi::nct::{NctControl, NctSettings, NctTables, ToolPot, context};
use plcc_abi::{Outcome, ResumePoint, Tables, TrapCode};

use super::{Script, program};
use crate::nct::{NctExecutive, NctOptions};
use crate::{Executive, Purpose, Setting, Value};

fn executive(tables: NctTables, tasks: usize) -> NctExecutive {
    NctExecutive::new(&program(tables, tasks), NctOptions::default()).unwrap()
}

fn set(executive: &mut NctExecutive, name: &str, value: i64) {
    let variable = executive.names().find(name, Purpose::Stimulus).unwrap();
    executive.write(variable, Setting::Int(value));
}

fn get(executive: &mut NctExecutive, name: &str) -> i64 {
    let variable = executive.names().find(name, Purpose::Watch).unwrap();
    match executive.read(variable) {
        Value::Int(value) => value,
        other => panic!("{other}"),
    }
}

/// Offsets of a byte's input image and previous image.
fn tables_of(executive: &NctExecutive) -> &NctTables {
    executive.view().tables
}

#[test]
fn level_0_sees_the_inputs_of_its_start() {
    let mut executive = executive(NctTables::default(), 2);
    let input = tables_of(&executive).inputs[0];
    let previous = tables_of(&executive).previous[0];
    let seen = std::cell::RefCell::new(Vec::new());
    let mut calls = 0;
    let mut engine = Script(|module, scan: &mut plcc_abi::Scan<'_>| {
        let now = input.read(scan.image);
        seen.borrow_mut().push((module, now, now ^ previous.read(scan.image)));
        calls += usize::from(module == 0);
        // :000 takes two slices, from the first on.
        if module == 0 && calls % 2 == 1 {
            Outcome::Suspended(ResumePoint(0))
        } else {
            Outcome::End
        }
    });
    for tick in 0..4 {
        set(&mut executive, "I00", [1, 2, 3, 7][tick]);
        executive.tick(&mut engine, &mut vec![]).unwrap();
    }
    let expected =
        [(1, 1, 1), (0, 1, 1), (1, 2, 3), (0, 1, 1), (1, 3, 1), (0, 3, 2), (1, 7, 4), (0, 3, 2)];
    assert_eq!(*seen.borrow(), expected);
    assert_eq!(get(&mut executive, "I00"), 7);
}

#[test]
fn without_synchronisation_module_000_sees_inputs_of_every_slice() {
    let mut executive = executive(NctTables::default(), 2);
    let input = tables_of(&executive).inputs[0];
    let output = tables_of(&executive).outputs[54];
    let seen = std::cell::RefCell::new(Vec::new());
    let mut slices = 0;
    let mut engine = Script(|module, scan: &mut plcc_abi::Scan<'_>| {
        if module == 1 {
            // Slice 0 decides for all.
            output.set_bit(scan.image, 1, slices == 0);
            slices += 1;
            return Outcome::End;
        }
        seen.borrow_mut().push(input.read(scan.image));
        Outcome::Suspended(ResumePoint(0))
    });
    for value in 1..4 {
        set(&mut executive, "P00", value);
        executive.tick(&mut engine, &mut vec![]).unwrap();
    }
    assert_eq!(*seen.borrow(), [1, 2, 3]);
}

#[test]
fn the_executive_sets_the_first_call_and_start_bits() {
    let mut executive = executive(NctTables::default(), 2);
    let mut trace = vec![];
    for tick in 0..4 {
        set(&mut executive, "I510", 1);
        set(&mut executive, "I543", 0);
        set(&mut executive, "I545", 1);
        let mut engine = Script(|module, _: &mut plcc_abi::Scan<'_>| {
            if module == 0 && tick == 1 { Outcome::Suspended(ResumePoint(0)) } else { Outcome::End }
        });
        executive.tick(&mut engine, &mut vec![]).unwrap();
        trace.push(["I510", "I543", "I545"].map(|name| get(&mut executive, name)));
    }
    assert_eq!(trace, [[1, 1, 1], [0, 1, 1], [0, 0, 1], [0, 1, 1]]);
}

#[test]
fn level_2_runs_every_period_while_enabled() {
    let mut program = program(NctTables::default(), 3);
    for (control, runs) in
        [(NctControl::Nct98, 4), (NctControl::Nct990, 10), (NctControl::Nct104, 20)]
    {
        if let Tables::Nct(tables) = &mut program.tables {
            tables.settings.control = control;
        }
        let settings = NctSettings { control, ..NctSettings::default() };
        let options = NctOptions { settings, ..NctOptions::default() };
        let mut executive = NctExecutive::new(&program, options).unwrap();
        let mut order = String::new();
        for enabled in [1, 1, 0] {
            set(&mut executive, "Y546", enabled);
            let mut engine = Script(|module: usize, _: &mut plcc_abi::Scan<'_>| {
                order.push_str(&module.to_string());
                Outcome::End
            });
            executive.tick(&mut engine, &mut vec![]).unwrap();
        }
        let slice = format!("210{}", "2".repeat(runs - 1));
        assert_eq!(order, format!("{slice}{slice}10"));
    }
}

#[test]
fn timers_count_slices_seconds_and_minutes() {
    let mut executive = executive(NctTables::default(), 2);
    for name in ["T07", "H99", "M9"] {
        set(&mut executive, name, 2);
    }
    let mut engine = Script(|_, _: &mut plcc_abi::Scan<'_>| Outcome::End);
    let mut changes = vec![];
    let mut last = [2, 2, 2];
    for tick in 0..6001 {
        executive.tick(&mut engine, &mut vec![]).unwrap();
        let now = ["T07", "H99", "M9"].map(|name| get(&mut executive, name));
        if now != last {
            changes.push((tick, now));
            last = now;
        }
    }
    let expected = [
        (1, [1, 2, 2]),
        (2, [0, 2, 2]),
        (50, [0, 1, 2]),
        (100, [0, 0, 2]),
        (3000, [0, 0, 1]),
        (6000, [0, 0, 0]),
    ];
    assert_eq!(changes, expected);
}

#[test]
fn each_module_keeps_its_registers() {
    let mut executive = executive(NctTables::default(), 3);
    let at = executive.image.places.context;
    set(&mut executive, "Y546", 1);
    set(&mut executive, "OP2", -1);
    let fuel = std::cell::RefCell::new(Vec::new());
    let mut engine = Script(|module, scan: &mut plcc_abi::Scan<'_>| {
        let op = read_u16(scan.image, at + context::OP);
        write_u16(scan.image, at + context::OP, op.wrapping_add(module as u16 + 1));
        fuel.borrow_mut().push((
            module,
            read_u32(scan.image, at + context::FUEL),
            scan.image[at as usize + 8],
        ));
        Outcome::End
    });
    executive.tick(&mut engine, &mut vec![]).unwrap();
    let ops = ["OP0", "OP1", "OP2"].map(|name| get(&mut executive, name));
    assert_eq!(ops, [1, 2, 59]);
    assert_eq!(fuel.borrow()[..3], [(2, 1_000_000, 1), (1, 1_000_000, 1), (0, 10_000, 0)]);
}

#[test]
fn a_stop_turns_the_lines_off() {
    for (module, code, name) in [
        (1, TrapCode::Timeout, "PLC TIMEOUT1"),
        (2, TrapCode::Timeout, "PLC TIMEOUT2"),
        (0, TrapCode::CallDepth, "CALL DEPTH"),
    ] {
        let mut executive = executive(NctTables::default(), 3);
        let mut engine = Script(|_, _: &mut plcc_abi::Scan<'_>| Outcome::End);
        set(&mut executive, "Y012", 1);
        set(&mut executive, "Y546", 1);
        executive.tick(&mut engine, &mut vec![]).unwrap();
        assert_eq!(get(&mut executive, "O012"), 1);
        let mut engine = Script(
            |running, _: &mut plcc_abi::Scan<'_>| {
                if running == module { Outcome::trap(code) } else { Outcome::End }
            },
        );
        let stop = executive.tick(&mut engine, &mut vec![]).unwrap_err();
        assert_eq!(stop.code, name);
        assert_eq!((get(&mut executive, "O012"), get(&mut executive, "Y012")), (0, 1));
    }
}

#[test]
fn messages_are_events() {
    let texts198 = vec!["TOOL".to_string()];
    let texts199 = vec!["A".to_string(), "B".to_string()];
    let mut executive = executive(NctTables { texts198, texts199, ..NctTables::default() }, 2);
    let mut engine = Script(|_, _: &mut plcc_abi::Scan<'_>| Outcome::End);
    set(&mut executive, "Y711", 1);
    set(&mut executive, "Y700", 1);
    set(&mut executive, "RH090", 12);
    let mut events = vec![];
    executive.tick(&mut engine, &mut events).unwrap();
    executive.tick(&mut engine, &mut events).unwrap();
    set(&mut executive, "Y71", 0);
    executive.tick(&mut engine, &mut events).unwrap();
    let lines: Vec<_> = events.iter().map(|e| serde_json::to_string(e).unwrap()).collect();
    assert_eq!(
        lines,
        [
            r#"{"tick":0,"kind":"message","flag":"Y700","state":"on","text":"TOOL","index":12}"#,
            r#"{"tick":0,"kind":"message","flag":"Y711","state":"on","text":"B"}"#,
            r#"{"tick":2,"kind":"message","flag":"Y711","state":"off","text":"B"}"#,
        ]
    );
}

#[test]
fn upper_local_variables_are_retained_and_pots_are_their_first_content() {
    let settings = NctSettings {
        constants: vec![(39, 24)],
        tool_pots: vec![ToolPot { pot: 3, tool: 5, width: 7 }],
        ..NctSettings::default()
    };
    let program = program(NctTables::default(), 2);
    let options = NctOptions { settings, ..NctOptions::default() };
    let mut first = NctExecutive::new(&program, options.clone()).unwrap();
    assert_eq!(get(&mut first, "F506"), 0xC005);
    assert_eq!(get(&mut first, "RP039"), 24);
    set(&mut first, "F506", 1);
    set(&mut first, "F998", -2);
    set(&mut first, "F499", 0xFFFF);
    let kept = first.retained().unwrap();
    let mut second = NctExecutive::new(&program, options).unwrap();
    assert!(second.restore(&kept[1..]).is_err());
    second.restore(&kept).unwrap();
    let after = ["F506", "F998", "F499", "F500"].map(|name| get(&mut second, name));
    assert_eq!(after, [1, 0xFFFE, 0xFF00, 0xFF]);
}

#[test]
fn physical_lines_and_words_have_names() {
    let mut executive = executive(NctTables::default(), 2);
    set(&mut executive, "I39", 0x1_2345);
    set(&mut executive, "O39", -1);
    assert_eq!(get(&mut executive, "P39"), 0x45);
    assert_eq!(get(&mut executive, "O39"), 0xFF);
    assert_eq!(get(&mut executive, "I39"), 0);
    let mut engine = Script(|_, _: &mut plcc_abi::Scan<'_>| Outcome::End);
    executive.tick(&mut engine, &mut vec![]).unwrap();
    assert_eq!(get(&mut executive, "I39"), 0x2345);
    set(&mut executive, "F999", 0x1234);
    assert_eq!(get(&mut executive, "F999"), 0x34);
    for wrong in ["V012", ":003", "X1", "I9", "RH200"] {
        assert!(executive.names().find(wrong, Purpose::Watch).is_err(), "{wrong}");
    }
    let lines = |name: &str| {
        let names = executive.names();
        let lines = names.lines(names.find(name, Purpose::Watch).unwrap()).into_iter();
        lines.map(|line| names.canonical(line)).collect::<Vec<_>>()
    };
    assert_eq!((lines("I012"), lines("Y013")), (vec!["P012".into()], vec!["O013".into()]));
    assert_eq!((lines("O02").len(), lines("Y547").len(), lines("RH060").len()), (16, 0, 0));
    let variable = executive.names().find("i002", Purpose::Stimulus).unwrap();
    assert_eq!(executive.names().canonical(variable), "I002");
    assert!(executive.names().parse(variable, "1.5").is_err());
    assert_eq!(executive.names().parse(variable, "-3"), Ok(Setting::Int(-3)));
}

/// Forces a variable, or ends its force.
fn force(executive: &mut NctExecutive, name: &str, value: Option<i64>) -> Result<(), &'static str> {
    let variable = executive.names().find(name, Purpose::Watch).unwrap();
    let key = executive.names().elements(variable)[0];
    executive.force(key, value.map(Setting::Int))
}

#[test]
fn forced_inputs_are_seen_and_forced_lines_are_held() {
    let mut executive = executive(NctTables::default(), 3);
    let tables = tables_of(&executive);
    let (input, output) = (tables.inputs[1], tables.outputs[1]);
    let level2_enable = tables.outputs[54];
    let lines = executive.image.places.lines_out;
    let mut engine = Script(move |module, scan: &mut plcc_abi::Scan<'_>| {
        if module == 1 {
            let seen = input.read(scan.image);
            output.write(scan.image, seen);
            level2_enable.set_bit(scan.image, 6, true);
        }
        if module == 2 {
            // Stores into the lines themselves, as UO does.
            plcc_abi::image::write_u8(scan.image, lines + 30, 0xF0);
        }
        Outcome::End
    });
    for (name, value) in [("I012", 7), ("Y017", 2), ("O300", -1)] {
        assert!(force(&mut executive, name, Some(value)).is_err(), "{name}={value}");
    }
    force(&mut executive, "I012", Some(1)).unwrap();
    force(&mut executive, "Y017", Some(1)).unwrap();
    force(&mut executive, "O300", Some(1)).unwrap();
    let mut tick = |executive: &mut NctExecutive| executive.tick(&mut engine, &mut vec![]).unwrap();
    tick(&mut executive);
    assert_eq!(get(&mut executive, "I012"), 1);
    assert_eq!((get(&mut executive, "P012"), get(&mut executive, "Y01")), (0, 4));
    assert_eq!(get(&mut executive, "O01"), 0x84);
    assert_eq!(get(&mut executive, "O30") & 0xFF, 0xF1);
    force(&mut executive, "I01", Some(0xFFFF)).unwrap();
    force(&mut executive, "Y017", None).unwrap();
    tick(&mut executive);
    assert_eq!((get(&mut executive, "I02"), get(&mut executive, "O01")), (0xFF, 0xFF));
    force(&mut executive, "I01", None).unwrap();
    tick(&mut executive);
    assert_eq!((get(&mut executive, "I01"), get(&mut executive, "O01")), (0, 0));
    for name in ["F0103", "RH060", "Y541"] {
        assert!(force(&mut executive, name, Some(1)).is_err(), "{name}");
    }
}

#[test]
fn forces_are_listed_as_they_were_asked_for() {
    let mut executive = executive(NctTables::default(), 2);
    let listed = |executive: &NctExecutive| -> Vec<String> {
        let names = executive.names();
        let forces = executive.forces().into_iter();
        forces.map(|(key, value)| format!("{}={value}", names.canonical(key))).collect()
    };
    for (name, value) in [("P002", 1), ("Y04", 0x8001), ("O120", 0)] {
        force(&mut executive, name, Some(value)).unwrap();
    }
    assert_eq!(listed(&executive), ["P002=1", "Y04=32769", "O120=0"]);
    force(&mut executive, "P002", Some(0)).unwrap();
    force(&mut executive, "O120", None).unwrap();
    assert_eq!(listed(&executive), ["P002=0", "Y04=32769"]);
    // A checkpoint holds the bits alone.
    let checkpoint = executive.checkpoint();
    executive.resume(&checkpoint).unwrap();
    assert_eq!(listed(&executive), ["I002=0", "Y04=32769"]);
    // When a part of a force ends, the rest of it is in effect.
    force(&mut executive, "Y050", None).unwrap();
    let rest = listed(&executive);
    assert_eq!((rest.len(), rest[1].as_str(), rest[15].as_str()), (16, "Y040=1", "Y057=1"));
    assert_eq!(executive.forces().len(), 16);
}

#[test]
fn a_stop_clears_forced_lines_too() {
    let mut executive = executive(NctTables::default(), 2);
    force(&mut executive, "Y010", Some(1)).unwrap();
    let mut engine = Script(|_, _: &mut plcc_abi::Scan<'_>| Outcome::End);
    executive.tick(&mut engine, &mut vec![]).unwrap();
    assert_eq!(get(&mut executive, "O010"), 1);
    let mut engine = Script(|_, _: &mut plcc_abi::Scan<'_>| Outcome::trap(TrapCode::Timeout));
    assert!(executive.tick(&mut engine, &mut vec![]).is_err());
    assert_eq!(get(&mut executive, "O010"), 0);
}

/// While no input changes, the executive copies no input images. What the modules see, and what is kept,
/// is the same as if it always did.
#[test]
fn modules_see_the_same_inputs_whether_unchanged_ones_are_copied_or_not() {
    let locations = {
        let executive = executive(NctTables::default(), 3);
        let tables = tables_of(&executive);
        [tables.inputs.clone(), tables.previous.clone()].concat()
    };
    for seed in 1..6 {
        let runs = [false, true].map(|always_copies| {
            let mut program = program(NctTables::default(), 3);
            program.tasks[0].resume_points = vec![0];
            let mut executive = NctExecutive::new(&program, NctOptions::default()).unwrap();
            let mut random = plcc_random::Rng::new(seed);
            let mut engine_random = plcc_random::Rng::new(seed + 1000);
            let mut seen = vec![];
            for tick in 0..200 {
                // Between changes there are long and short times without any.
                if random.below(if tick < 100 { 3 } else { 20 }) == 0 {
                    let name = ["I00", "I021", "I45", "I997", "Y546"][random.below(5)];
                    set(&mut executive, name, random.below(4) as i64);
                }
                if random.below(30) == 0 {
                    let value = (random.below(2) == 0).then_some(1);
                    force(&mut executive, "I021", value).unwrap();
                }
                if random.below(50) == 0 {
                    let checkpoint = executive.checkpoint();
                    executive.resume(&checkpoint).unwrap();
                }
                if always_copies {
                    executive.image.input_images_replaced();
                }
                let mut engine = Script(|module, scan: &mut plcc_abi::Scan<'_>| {
                    let inputs = locations.iter().map(|location| location.read(scan.image));
                    seen.push((module, inputs.collect::<Vec<u8>>()));
                    match module == 0 && engine_random.below(6) == 0 {
                        true => Outcome::Suspended(ResumePoint(0)),
                        false => Outcome::End,
                    }
                });
                executive.tick(&mut engine, &mut vec![]).unwrap();
                seen.push((9, executive.checkpoint()));
            }
            seen
        });
        let [fast, always] = runs;
        assert!(fast == always, "seed {seed}");
        assert!(fast.len() >= 600);
    }
}
