//! Counts what is taken from the allocator while a control runs. Nothing may be taken in a tick, with or
//! without events, in any language, in the statement interpreter or in native code. A test binary of its own, since it
//! has its own allocator. What counts is what the test's own thread takes: the threads of the test harness allocate
//! too, for example when a test has been running for a minute.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::path::Path;

use allocation_counter::measure;
use clap::Parser;
use plcc_abi::machine::Machine;
use plcc_abi::{Dialect, Engine};
use plcc_control::ControlArgs;
use plcc_control::executive;
use plcc_frontend::common::{Controller, Options};
use plcc_host::args::RunArgs;
use plcc_host::image_file::{Content, Publisher, State, SymbolTable};
use plcc_host::run::{Player, Stimulus};
use plcc_host::session;
use plcc_image::{InputWriter, Number};
use plcc_runtime::compare;
use plcc_runtime::online_change::TakeOver;
use plcc_runtime::{Executive, Purpose, Value};
use plcc_tests::compile::{EngineKind, compile};
/// What the thread that runs the ticks does for the image file and the socket: it writes the image,
/// reads, sets and forces variables, and takes the state of a program over into another one.
#[test]
fn acting_from_outside_allocates_nothing() {
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().join("examples");
    let path = std::env::temp_dir().join(format!("plcc-allocations-{}", std::process::id()));
    for (dialect, source, name) in [
        (Dialect::Pmi, "pmi/lathe.pmi", "MCRDY"),
        (Dialect::Nct, "nct/sample.plc", "I012"),
        (Dialect::Pmac, "pmac/mill.pmc", "X:$0700"),
    ] {
        let compiled = compile(&examples.join(source), dialect, &Options::default()).unwrap();
        let (program, mut engine) = compiled.engine(EngineKind::JitSpeed).unwrap();
        let control = ControlArgs::default();
        let make = || executive(&program, &control, false, None).unwrap();
        let (mut old, mut new) = (make(), make());
        let mut events = Vec::with_capacity(64);
        (0..50).for_each(|_| old.tick(&mut engine, &mut events).unwrap());
        let content = Content {
            program: &program,
            fingerprint: old.fingerprint(),
            image: old.image(),
            used: &old.used_ranges(),
            tick_ns: old.tick_ns(),
            generation: 0,
            safe_outputs: old.safe_lines().bytes(),
            symbols: &SymbolTable::new(&*plcc_runtime::names_of(&program)),
            rules: &[],
        };
        let mut publisher = Publisher::create(&path, &content).unwrap();
        let key = old.names().find(name, Purpose::Watch).unwrap();
        let setting = old.names().parse(key, "1").unwrap();
        let plan = compare(&program, &program).unwrap().plan;

        let mut writer = InputWriter::open(&path, "test").unwrap();
        let given = writer.symbols().iter().find(|symbol| symbol.slot.is_some()).unwrap().clone();
        let input = writer.claim(&given.name).unwrap();
        let has_fraction = given.outside().range().is_none();
        let value = if has_fraction { Number::Float(1.0) } else { Number::Int(1) };
        writer.set(input, value).unwrap();
        writer.publish().unwrap();
        let (mut set, mut events_of_inputs) = (0, 0);

        let mut before = None;
        let taken = measure(|| {
            publisher.take_inputs(1, false, |_, _| set += 1, |_| events_of_inputs += 1);
            publisher.publish(old.image(), 50, 0, State::Running, 0);
            before = Some(old.read(key));
            old.write(key, setting);
            old.force(key, Some(setting)).unwrap();
            old.each_force(&mut |forced, value| assert_eq!((forced, value), (key, setting)));
            old.force(key, None).unwrap();
            assert_eq!(new.take_over(old.as_mut(), &plan), TakeOver::Done);
        });
        // Nothing is taken, and nothing is given back.
        assert_eq!((taken.count_total, taken.count_current), (0, 0), "{dialect:?}: {taken:?}");
        assert_eq!((set, events_of_inputs), (1, 1), "{dialect:?}");
        drop(before);
        let values = |executive: &mut dyn Executive| -> Vec<String> {
            let declared = executive.names().declared();
            declared.iter().map(|(n, v)| format!("{n}={}", executive.read(*v))).collect()
        };
        let expected = values(old.as_mut());
        assert!(expected.len() > 5 && values(new.as_mut()) == expected, "{dialect:?}");
    }
    std::fs::remove_file(path).unwrap();
}

/// A fault and messages that come and go in every scan, some with values in their texts.
const ANNOUNCING: [(&str, Dialect, &str); 2] = [
    (
        "announcing.pmi",
        Dialect::Pmi,
        "$INTEGER\nN\n$FAULT\nBAD=\"broken \",N,\" times\"\n$MESSAGE\nTOLD=\"all is well\"\n$END\n\
         N=N+1\nBAD=/BAD\nTOLD=/TOLD\n",
    ),
    (
        "announcing.nct",
        Dialect::Nct,
        ":001\nLF500 +1 SF500 SRH090 SY70 SY71\nJ1\n:000\nJ0\n:198 ONE, TWO$\n:199 THREE, FOUR$\n",
    ),
];

/// The texts of events share what the executive keeps, or have room of a fixed size.
#[test]
fn ticks_with_faults_and_messages_allocate_nothing() {
    for (file, dialect, source) in ANNOUNCING {
        let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(file);
        std::fs::write(&path, source).unwrap();
        let compiled = compile(&path, dialect, &Options::default()).unwrap();
        for way in [EngineKind::Statements, EngineKind::JitSpeed] {
            let (program, mut engine) = compiled.engine(way).unwrap();
            let mut executive = executive(&program, &ControlArgs::default(), false, None).unwrap();
            let mut events = Vec::with_capacity(64);
            let mut told = 0;
            for tick in 0..100 {
                let taken = measure(|| {
                    executive.tick(&mut engine, &mut events).unwrap();
                    told += events.len();
                    events.clear();
                });
                let nothing = taken.count_total == 0 && taken.count_current == 0;
                assert!(tick == 0 || nothing, "{file} {way:?} tick {tick}: {taken:?}");
            }
            assert!(told >= 200, "{file} {way:?}: {told} events");
        }
    }
}

/// A machine of the examples with its simulator, and an engine for it.
fn on_the_desk(dialect: Dialect, name: &str) -> (Box<dyn Executive + Send>, Box<dyn Engine>) {
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().join("examples/desk");
    let compiled = compile(&examples.join(name), dialect, &Options::default()).unwrap();
    let (program, engine) = compiled.engine(EngineKind::JitSpeed).unwrap();
    let machine_path = examples.join(name).with_extension("machine.toml");
    let machine = Machine::parse(&std::fs::read_to_string(&machine_path).unwrap()).unwrap();
    let run = RunArgs { simulate: true, machine_path: Some(machine_path), ..RunArgs::default() };
    let executive = session::simulated_executive(&program, &run, Some(&machine)).unwrap();
    (executive, Box::new(engine))
}

/// The control, small machines, keys and a part program.
#[test]
fn ticks_with_a_simulated_machine_allocate_nothing() {
    for (dialect, name, keys) in [
        (Dialect::Pmi, "turret.pmi", ["KEY.MACHINE ON", "KEY.AUTO", "KEY.CYCLE START"]),
        (Dialect::Nct, "changer.nct", ["KEY.B1", "KEY.AUTO", "KEY.START"]),
        (Dialect::Pmac, "router.pmc", ["KEY.GUARD", "KEY.START", "KEY.JAM HOOD"]),
    ] {
        let (mut executive, mut engine) = on_the_desk(dialect, name);
        let names = executive.names();
        let find = |name: &str| names.find(name, Purpose::Stimulus).unwrap();
        let keys = keys.map(find);
        let value = |text| names.parse(keys[0], text).unwrap();
        let (on, off) = (value("1"), value("0"));
        if dialect == Dialect::Nct {
            executive.write(find("KEY.EMERGENCY LINE"), on);
        }
        let mut events = Vec::with_capacity(64);
        for tick in 0..600 {
            let pressed = keys.get(tick / 20).filter(|_| tick % 20 >= 10);
            let taken = measure(|| {
                if let Some(key) = pressed {
                    executive.write(*key, if tick % 20 < 19 { on } else { off });
                }
                executive.tick(engine.as_mut(), &mut events).unwrap();
                events.clear();
            });
            let nothing = taken.count_total == 0 && taken.count_current == 0;
            assert!(tick == 0 || nothing, "{name} tick {tick}: {taken:?}");
        }
        if dialect != Dialect::Pmac {
            let line = names.find("SIM.LINE", Purpose::Watch).unwrap();
            let end = if dialect == Dialect::Pmi { "@PGMSE" } else { "RH000" };
            let end = executive.read(names.find(end, Purpose::Watch).unwrap());
            let ended = (executive.read(line), end);
            let expected = if dialect == Dialect::Pmi { 2 } else { 30 };
            assert_eq!(
                ended,
                (Value::Int(0), Value::Int(expected)),
                "{name}: the part program ran"
            );
        }
    }
}

/// A simulated and a real machine never share an input.
#[test]
fn what_is_simulated_no_other_process_can_give() {
    let (executive, _) = on_the_desk(Dialect::Pmi, "turret.pmi");
    let table = SymbolTable::new(&*executive.names());
    let can_be_given = |name: &str| {
        let symbol = table.symbols.iter().find(|symbol| symbol.is_called(name)).unwrap();
        symbol.slot.is_some()
    };
    for simulated in ["CONTR", "CHUCK", "TPOS", "TSTB"] {
        assert!(!can_be_given(simulated), "{simulated}");
    }
    assert!(can_be_given("PEDAL"));
}

#[test]
fn ticks_allocate_nothing() {
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().join("examples");
    for (dialect, program, stimulus) in [
        (Dialect::Pmi, "pmi/lathe.pmi", "pmi/lathe.csv"),
        (Dialect::Nct, "nct/sample.plc", "nct/sample.csv"),
        (Dialect::Pmac, "pmac/mill.pmc", "pmac/mill/tool/stimulus.csv"),
    ] {
        let compiled = compile(&examples.join(program), dialect, &Options::default()).unwrap();
        let table = std::fs::read(examples.join(stimulus)).unwrap();
        for way in [EngineKind::Statements, EngineKind::JitSpeed] {
            let (program, mut engine) = compiled.engine(way).unwrap();
            let control = ControlArgs::default();
            let mut executive = executive(&program, &control, false, None).unwrap();
            let stimulus =
                Stimulus::parse(&table, &*executive.names(), executive.tick_ns()).unwrap();
            let ticks = stimulus.period() * 2;
            let mut player = Player::new(stimulus, true);
            let mut events = Vec::with_capacity(64);
            for tick in 0..ticks {
                let taken = measure(|| {
                    player.apply(tick, executive.as_mut());
                    executive.tick(&mut engine, &mut events).unwrap();
                });
                if tick >= ticks / 2 {
                    assert_eq!(taken.count_total, 0, "{dialect:?} {way:?} tick {tick}: {taken:?}");
                }
                events.clear();
            }
            // Of a PMAC there is nothing before a SAVE; the next test has one.
            if dialect != Dialect::Pmac {
                retained_data_is_handed_over_without_allocations(executive.as_ref());
            }
        }
    }
}

/// A program with SEND, DISPLAY, COMMAND and SAVE, which also changes the definitions of
/// M-variables while it runs.
const TALK: &str = "I5=3\nM1->X:$07F0,0,24\nM2->X:$07F1,0,24\nM101->Y:$BC01,0,16\n\
    OPEN PLC 1 CLEAR\nP1=P1+1.25\nSEND\"X\"\nDISPLAY 3,8.2,P1\nDISPLAY 0\"TEXT\"\nCMD\"SAVE\"\n\
    CMD\"P9=P9+1\"\nCMD\"M2->L:$1005\"\nM101=$07F4+INT(P1/4)%4\nM1=M1+M2\nCLOSE\n";

/// The events that hold a PMAC's texts have a fixed size, and the room for what SAVE keeps is
/// taken before the first tick.
#[test]
fn ticks_of_a_pmac_that_sends_and_saves_allocate_nothing() {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("talk.pmc");
    std::fs::write(&path, TALK).unwrap();
    let compiled = compile(&path, Dialect::Pmac, &Options::default()).unwrap();
    for way in [EngineKind::Statements, EngineKind::JitSpeed] {
        let (program, mut engine) = compiled.engine(way).unwrap();
        let mut executive = executive(&program, &ControlArgs::default(), false, None).unwrap();
        let mut events = Vec::with_capacity(64);
        let mut said = 0;
        for tick in 0..100 {
            let taken = measure(|| executive.tick(&mut engine, &mut events).unwrap());
            assert!(tick == 0 || taken.count_total == 0, "{way:?} tick {tick}: {taken:?}");
            said += events.len();
            events.clear();
        }
        assert_eq!(said, 600, "{way:?}");
        assert!(executive.retained().is_some());
        retained_data_is_handed_over_without_allocations(executive.as_ref());
    }
}

/// A motion program that moves for ever in several modes, whose axes kinematic programs connect with the motors.
const MOVES: &str = "I5=3 I8=0 I10=4194304\nI100=1 I111=0 I200=1 I211=0 I300=1 I311=0\nI5187=10 I5189=20 I5190=1000 I5150=1\n\
    M1->Y:$78C02,8,1\n&1 #1->I #2->I #3->100Z\nOPEN FORWARD CLEAR\nP50=0\nWHILE (P50<20)\nP50=P50+1\nP(60+P50)=P50\nENDWHILE\n\
    Q7=P1/100\nQ8=P2/100-Q7\nCLOSE\nOPEN INVERSE CLEAR\nP1=Q7*100\nP2=(Q7+Q8)*100\nP101=Q17*100\nP102=(Q17+Q18)*100\nCLOSE\n\
    OPEN PROG 1 CLEAR\nWHILE (1=1)\nLINEAR INC TM20\nX1 Y1 Z1\nM1==1\nX-1 Y2\nGOSUB 100\nDWELL 3\nRAPID Y-3 Z-1\nPVT20\n\
    X1:5\nX-1\nTM10 SPLINE1\nX1\nX-1\nM1==0\nENDWHILE\nN100 SEND\"X\"\nRETURN\nCLOSE\n&1B1R\n";

/// Motion programs, and positions that are watched.
#[test]
fn ticks_of_moving_motors_allocate_nothing() {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("moves.pmc");
    std::fs::write(&path, MOVES).unwrap();
    let options = Options { controller: Controller::Turbo, simulate: true, ..Options::default() };
    let compiled = compile(&path, Dialect::Pmac, &options).unwrap();
    for way in [EngineKind::Statements, EngineKind::JitSpeed] {
        let (program, mut engine) = compiled.engine(way).unwrap();
        let run = RunArgs { simulate: true, ..RunArgs::default() };
        let mut executive = session::simulated_executive(&program, &run, None).unwrap();
        let names = executive.names();
        let watched = ["#1.CMD", "&1.X", "&1.VY", "&1.SPEED", "&1.LINE"];
        let watched = watched.map(|name| names.find(name, Purpose::Watch).unwrap());
        let mut value = Value::Int(0);
        let mut events = Vec::with_capacity(64);
        let mut told = 0;
        for tick in 0..3000 {
            let taken = measure(|| {
                executive.tick(engine.as_mut(), &mut events).unwrap();
                for key in watched {
                    executive.read_into(key, &mut value);
                }
            });
            assert!(tick == 0 || taken.count_total == 0, "{way:?} tick {tick}: {taken:?}");
            told += events.len();
            events.clear();
        }
        // The program goes round all the time.
        assert!(told >= 3, "{way:?}: {told} events");
    }
}

/// The thread that runs the ticks fills a buffer with what survives power-off.
fn retained_data_is_handed_over_without_allocations(executive: &dyn Executive) {
    let mut state = Vec::with_capacity(1 << 20);
    let taken = measure(|| assert!(executive.retained_into(&mut state)));
    assert_eq!(taken.count_total, 0, "{taken:?}");
    assert!(!state.is_empty());
}

#[derive(Parser)]
struct Args {
    #[command(flatten)]
    run: RunArgs,
}

/// Whole runs, as `plcc run` makes them: what they allocate does not grow with their ticks.
#[test]
fn a_run_of_many_ticks_allocates_no_more_than_one_of_few() {
    let lathe = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/pmi/lathe.pmi");
    let compiled = compile(&lathe, Dialect::Pmi, &Options::default()).unwrap();
    let (program, mut engine) = compiled.engine(EngineKind::JitSpeed).unwrap();
    let mut allocated = |ticks: &str| {
        let args = Args::try_parse_from(["run", "--ticks", ticks]).unwrap().run;
        measure(|| assert_eq!(session::run(&program, &mut engine, &args, None), 0)).bytes_total
    };
    // The first run also allocates what stays for the whole process, and each one adds a little to
    // the list of signal handlers.
    allocated("10");
    let (few, many) = (allocated("10"), allocated("100000"));
    assert!(many < few + 65_536, "{few} bytes for 10 ticks, {many} for 100000");
}
