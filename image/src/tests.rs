//! Tests of the area for inputs, of both of its sides.
#![allow(clippy::unwrap_used, clippy::panic, clippy::indexing_slicing)]

use std::path::PathBuf;
use std::sync::atomic::AtomicU64;
use std::time::Duration;

use super::input_area::InputArea;
use super::latch::{Change, InputLatch, Rule, Safe};
use super::triple_buffer::{self, Taken, back, publish, take};
use super::*;

#[test]
fn what_was_published_last_is_taken_once() {
    let state = AtomicU64::new(triple_buffer::INITIAL);
    assert_eq!(take(&state), Some(Taken { front: 0, fresh: false }));
    let (first, _) = (back(&state).unwrap(), publish(&state).unwrap());
    let (second, _) = (back(&state).unwrap(), publish(&state).unwrap());
    assert_ne!(first, second);
    assert_eq!(take(&state), Some(Taken { front: second, fresh: true }));
    assert_eq!(take(&state), Some(Taken { front: second, fresh: false }));
}

#[test]
fn damaged_states_of_buffers_are_refused() {
    for state in [0, 0b11_01_00, 0b10_10_00, u64::MAX] {
        let state = AtomicU64::new(state);
        assert_eq!((back(&state), take(&state), publish(&state)), (None, None, None));
    }
}

/// What is set before a tick, and what has happened to inputs.
type Step = (Vec<(u32, Number)>, Vec<(Change, u32, u32)>);

/// An image file of four variables: the inputs `A` and `B`, the word `C`, the double `D`.
struct Control {
    path: PathBuf,
    memory: SharedMemory,
    latch: InputLatch,
}

impl Control {
    fn new(name: &str, rules: &[Option<Rule>]) -> Self {
        let symbol = |(slot, name, ty, direction): (u32, &str, Type, Direction)| Symbol {
            name: name.into(),
            aliases: vec![format!("GIVEN_{name}")],
            value: Place::bytes(slot * 8, ty),
            line: None,
            elements: 1,
            direction,
            slot: Some(slot),
            unit: String::new(),
        };
        let symbols: Vec<Symbol> = [
            (0, "A", Type::Logical, Direction::Input),
            (1, "B", Type::Word, Direction::Input),
            (2, "C", Type::Integer, Direction::Internal),
            (3, "D", Type::Double, Direction::Internal),
        ]
        .map(symbol)
        .into();
        let path = std::env::temp_dir().join(format!("plcc-area-{name}-{}", std::process::id()));
        let mut bytes = vec![0_u8; 4096 + 32];
        let mut put = |at: usize, value: &[u8]| bytes[at..at + value.len()].copy_from_slice(value);
        let area = InputArea::new(8192, symbols.len());
        put(layout::AT_MAGIC, &layout::MAGIC);
        put(layout::AT_VERSION, &[1, 0, 0, 0]);
        put(layout::AT_IMAGE_SIZE, &[32, 0, 0, 0]);
        put(layout::AT_IMAGE, &4096_u64.to_le_bytes());
        put(layout::AT_SYMBOLS, &4128_u64.to_le_bytes());
        put(layout::AT_SYMBOLS_COUNT, &4_u64.to_le_bytes());
        put(layout::AT_INPUTS, &(area.offset() as u64).to_le_bytes());
        let (mut entries, mut texts) = (vec![], vec![]);
        symbols.iter().for_each(|s| s.encode(&mut entries, &mut texts, 4128 + 4 * 48));
        bytes.extend(entries.into_iter().chain(texts));
        bytes.resize(area.offset(), 0);
        bytes.extend(area.encode());
        assert_eq!(bytes.len(), area.end());
        std::fs::write(&path, bytes).unwrap();
        let file = reader::open_regular(&path, true).unwrap();
        let memory = SharedMemory::map(&file, Access::Write).unwrap();
        assert_eq!(InputArea::of(memory.words()), Some(area));
        Self { path, memory, latch: InputLatch::new(area, symbols, rules, name != "changed") }
    }

    /// What is set before a tick at `now` milliseconds, and what is reported.
    fn take(&mut self, now: u64, again: bool) -> Step {
        let (mut set, mut events) = (vec![], vec![]);
        self.latch.take(
            self.memory.words(),
            now * 1_000_000,
            again,
            |slot, value| set.push((slot, value)),
            |event| events.push((event.change, event.first, event.count)),
        );
        (set, events)
    }

    fn writer(&self) -> InputWriter {
        InputWriter::open(&self.path, "test").unwrap()
    }
}

impl Drop for Control {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.path);
    }
}

const NOTHING: Step = (vec![], vec![]);

#[test]
fn what_a_writer_gives_is_taken_as_a_whole_when_it_is_published() {
    let mut control = Control::new("whole", &[]);
    assert_eq!(control.take(0, false), NOTHING);
    let mut writer = control.writer();
    let (a, d) = (writer.claim("A").unwrap(), writer.claim("D").unwrap());
    writer.set(a, Number::Int(1)).unwrap();
    writer.set(d, Number::Float(2.5)).unwrap();
    assert_eq!(control.take(1, false), NOTHING, "nothing is published yet");
    writer.publish().unwrap();
    let set = vec![(0, Number::Int(1)), (3, Number::Float(2.5))];
    assert_eq!(control.take(2, false), (set.clone(), vec![(Change::Begun, 0, 2)]));
    assert_eq!(control.take(3, false), NOTHING);
    // The same values again: an input is not set again, another variable is.
    writer.set(a, Number::Int(1)).unwrap();
    writer.set(d, Number::Float(2.5)).unwrap();
    writer.publish().unwrap();
    assert_eq!(control.take(4, false), (vec![set[1]], vec![]));
    // Somebody else may have set variables: the inputs are set again.
    assert_eq!(control.take(5, true), (vec![set[0]], vec![]));
}

#[test]
fn values_that_a_variable_cannot_have_are_refused_on_both_sides() {
    let mut control = Control::new("values", &[]);
    let mut writer = control.writer();
    let b = writer.claim("B").unwrap();
    for value in [Number::Int(-1), Number::Int(65_536), Number::Float(1.0)] {
        assert!(matches!(writer.set(b, value), Err(ClaimError::Value { .. })), "{value}");
    }
    let d = writer.claim("D").unwrap();
    assert!(writer.set(d, Number::Float(f64::NAN)).is_err());
    // A writer that does not check.
    let area = InputArea::of(control.memory.words()).unwrap();
    let state = area.buffers(control.memory.words(), 0).unwrap();
    let back = back(state).unwrap();
    let (value, serial) = area.value(control.memory.words(), 0, back, 1).unwrap();
    value.store(70_000, std::sync::atomic::Ordering::Relaxed);
    serial.store(7, std::sync::atomic::Ordering::Relaxed);
    publish(state).unwrap();
    assert_eq!(control.take(1, false), (vec![], vec![(Change::Refused, 1, 1)]));
}

#[test]
fn a_bad_value_is_an_event_and_the_last_good_one_is_late_after_its_timeout() {
    let rule = |value| Some(Rule { safe: Safe::Value(value), timeout_ns: 50_000_000 });
    let rules = [None, rule(Number::Int(3)), None, rule(Number::Float(0.5))];
    let mut control = Control::new("bad", &rules);
    control.take(0, false);
    let mut writer = control.writer();
    let (b, d) = (writer.claim("B").unwrap(), writer.claim("D").unwrap());
    let shown = |control: &Control, slot| {
        let area = InputArea::of(control.memory.words()).unwrap();
        area.state(control.memory.words(), slot).unwrap().load(std::sync::atomic::Ordering::Relaxed)
    };
    writer.set(b, Number::Int(5)).unwrap();
    writer.set(d, Number::Float(2.5)).unwrap();
    writer.publish().unwrap();
    control.take(1, false);
    assert_eq!((shown(&control, 1), shown(&control, 3)), (1, 1), "current");
    for now in [2, 3] {
        writer.refuse(b).unwrap();
        writer.refuse(d).unwrap();
        writer.publish().unwrap();
        let events = if now == 2 { vec![(Change::Refused, 1, 2)] } else { vec![] };
        assert_eq!(control.take(now, false), (vec![], events), "the last good value is kept");
        assert_eq!((shown(&control, 1), shown(&control, 3)), (3, 3), "but it is not current");
    }
    let safe = vec![(1, Number::Int(3)), (3, Number::Float(0.5))];
    assert_eq!(control.take(51, false), (safe, vec![(Change::Late, 1, 2)]));
    assert_eq!((shown(&control, 1), shown(&control, 3)), (2, 2), "safe");
    writer.set(d, Number::Float(1.0)).unwrap();
    writer.publish().unwrap();
    let recovered = (vec![(3, Number::Float(1.0))], vec![(Change::Recovered, 3, 1)]);
    assert_eq!(control.take(52, false), recovered);
    assert_eq!((shown(&control, 1), shown(&control, 3)), (2, 1));
}

#[test]
fn variables_that_are_not_inputs_become_safe_where_the_configuration_names_them() {
    let rule = |safe| Some(Rule { safe, timeout_ns: 50_000_000 });
    for (name, rules, safe) in [
        ("named", [None, None, rule(Safe::Value(Number::Int(7))), rule(Safe::Off)], true),
        ("held", [None, None, rule(Safe::Hold), rule(Safe::Hold)], false),
        ("unnamed", [None; 4], false),
    ] {
        let mut control = Control::new(name, &rules);
        let values = match safe {
            true => vec![(2, Number::Int(7)), (3, Number::Float(0.0))],
            false => vec![],
        };
        assert_eq!(control.take(0, false), (values.clone(), vec![]), "from the first tick on");
        let mut writer = control.writer();
        let (c, d) = (writer.claim("C").unwrap(), writer.claim("D").unwrap());
        let given = vec![(2, Number::Int(5)), (3, Number::Float(2.5))];
        let mut give = |control: &mut Control, now| {
            writer.set(c, Number::Int(5)).unwrap();
            writer.set(d, Number::Float(2.5)).unwrap();
            writer.publish().unwrap();
            assert_eq!(control.take(now, false).0, given, "{name}");
        };
        give(&mut control, 1);
        if name != "unnamed" {
            let late = (values.clone(), vec![(Change::Late, 2, 2)]);
            assert_eq!(control.take(51, false), late, "{name}");
            assert_eq!(control.take(52, true), NOTHING, "the program may change it meanwhile");
            give(&mut control, 60);
        }
        drop(writer);
        let released = (values, vec![(Change::Released, 2, 2)]);
        assert_eq!(control.take(61, false), released, "{name}");
    }
}

#[test]
fn late_and_released_inputs_take_their_safe_values_and_recover() {
    let rule = |safe, ms: u64| Some(Rule { safe, timeout_ns: ms * 1_000_000 });
    let rules = [rule(Safe::Value(Number::Int(1)), 50), rule(Safe::Hold, 20)];
    let mut control = Control::new("late", &rules);
    // From the first tick on a configured input is safe, also before anybody gives it.
    assert_eq!(control.take(100, false), (vec![(0, Number::Int(1))], vec![]));
    assert_eq!(control.take(119, false), NOTHING);
    assert_eq!(control.take(120, false), (vec![], vec![(Change::Late, 1, 1)]));
    let mut writer = control.writer();
    let [a, b] = ["A", "B"].map(|name| writer.claim(name).unwrap());
    writer.set(a, Number::Int(0)).unwrap();
    writer.set(b, Number::Int(5)).unwrap();
    writer.publish().unwrap();
    let (set, events) = control.take(130, false);
    assert_eq!(set, [(0, Number::Int(0)), (1, Number::Int(5))]);
    assert_eq!(events, [(Change::Begun, 0, 1), (Change::Recovered, 1, 1)]);
    // Only one of the two goes on coming.
    writer.set(b, Number::Int(6)).unwrap();
    writer.publish().unwrap();
    assert_eq!(control.take(145, false), (vec![(1, Number::Int(6))], vec![]));
    let late = control.take(180, false);
    let events = vec![(Change::Late, 0, 2)];
    assert_eq!(late, (vec![(0, Number::Int(1))], events), "the second one is held");
    assert_eq!(control.take(181, true).0, [(0, Number::Int(1))], "a safe value is set again");
    writer.set(a, Number::Int(0)).unwrap();
    writer.publish().unwrap();
    let recovered = (vec![(0, Number::Int(0))], vec![(Change::Recovered, 0, 1)]);
    assert_eq!(control.take(190, false), recovered);
    drop(writer);
    let released = (vec![(0, Number::Int(1))], vec![(Change::Released, 0, 1)]);
    assert_eq!(control.take(191, false), released);
}

#[test]
fn a_writer_says_what_becomes_of_inputs_without_a_rule() {
    let mut control = Control::new("timeout", &[]);
    let mut writer = control.writer();
    writer.set_timeout(Duration::from_millis(10), false);
    let a = writer.claim("A").unwrap();
    writer.set(a, Number::Int(1)).unwrap();
    writer.publish().unwrap();
    assert_eq!(control.take(0, false).1, [(Change::Begun, 0, 1)]);
    assert_eq!(control.take(10, false), (vec![(0, Number::Int(0))], vec![(Change::Late, 0, 1)]));
    writer.set_timeout(Duration::from_millis(10), true);
    writer.set(a, Number::Int(1)).unwrap();
    writer.publish().unwrap();
    assert_eq!(control.take(11, false).1, [(Change::Recovered, 0, 1)]);
    assert_eq!(control.take(30, false), (vec![], vec![(Change::Late, 0, 1)]));
}

#[test]
fn a_variable_has_one_writer() {
    let mut control = Control::new("claims", &[]);
    let (mut first, mut second) = (control.writer(), control.writer());
    first.claim("A").unwrap();
    match second.claim("A") {
        Err(ClaimError::Taken { writer, process, .. }) => {
            assert_eq!((writer.as_str(), process), ("test", std::process::id()));
        }
        other => panic!("{other:?}"),
    }
    assert!(matches!(second.claim("E"), Err(ClaimError::Unknown(_))));
    // The first one's process dies: a word that no living process has.
    let area = InputArea::of(control.memory.words()).unwrap();
    let process = area.process(control.memory.words(), 0).unwrap();
    process.store(u64::from(u32::MAX) << 32, std::sync::atomic::Ordering::Relaxed);
    assert!(matches!(first.publish(), Err(ClaimError::Lost)));
    let a = second.claim("A").unwrap();
    second.set(a, Number::Int(1)).unwrap();
    second.publish().unwrap();
    assert_eq!(control.take(0, false).0, [(0, Number::Int(1))]);
    drop(first);
    assert_eq!(control.take(1, false), NOTHING, "who has lost his mailbox releases nothing");
    let others: Vec<InputWriter> = (0..7).map(|_| control.writer()).collect();
    assert!(matches!(InputWriter::open(&control.path, "one too many"), Err(ClaimError::NoMailbox)));
    drop(others);
    control.writer();
}

#[test]
fn a_slot_with_a_damaged_owner_can_be_claimed() {
    let control = Control::new("damaged", &[]);
    let area = InputArea::of(control.memory.words()).unwrap();
    for damaged in [9, u64::MAX] {
        let owner = area.owner(control.memory.words(), 0).unwrap();
        owner.store(damaged, std::sync::atomic::Ordering::Relaxed);
        control.writer().claim("A").unwrap();
    }
}

#[test]
fn after_an_online_change_inputs_stay_what_they_were_until_they_are_late() {
    let rule = Rule { safe: Safe::Value(Number::Int(1)), timeout_ns: 50_000_000 };
    let mut control = Control::new("changed", &[Some(rule)]);
    assert_eq!(control.take(100, false), NOTHING);
    assert_eq!(control.take(149, false), NOTHING);
    let late = (vec![(0, Number::Int(1))], vec![(Change::Late, 0, 1)]);
    assert_eq!(control.take(150, false), late);
}
