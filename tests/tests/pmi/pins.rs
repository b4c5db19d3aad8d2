//! Timers and flip-flops do the same whether program code assigns their pins or a stimulus does. Three
//! implementations are compared: compiled code, the statement interpreter and the executive.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use plcc_abi::Dialect;
use plcc_control::ControlArgs;
use plcc_control::executive;
use plcc_frontend::common::Options;
use plcc_host::run::{Player, Stimulus};
use plcc_random::Rng;
use plcc_runtime::{Purpose, Value};
use plcc_tests::compile::{Compiled, EngineKind, compile};

const TICKS: u64 = 600;

/// Copies inputs to the pins. The outputs of the timers are read before that.
const BY_PROGRAM: &str = "\
$INPUT
I0 = 0/0
I1 = 0/1
I2 = 0/2
I3 = 0/3
I4 = 0/4
I5 = 0/5
$TIMER
E/TE/DE = 3
D/TD/DD = 4
$FLIPFLOP
Q/D/CK/PR/CL
$END
SE = DE
SD = DD
D = I0
CK = I1
PR = I2
CL = I3
TE = I4
TD = I5
";

const BY_STIMULUS: &str = "\
$TIMER
E/TE/DE = 3
D/TD/DD = 4
$FLIPFLOP
Q/D/CK/PR/CL
$END
X = Q
";

fn compiled(folder: &Path, text: &str) -> Compiled {
    let file = folder.join("pins.pmi");
    fs::write(&file, text).unwrap();
    compile(&file, Dialect::Pmi, &Options::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// The variables' values at the end of each tick.
fn values(compiled: &Compiled, way: EngineKind, table: &str, names: &[&str]) -> Vec<Vec<Value>> {
    let (program, mut engine) = compiled.engine(way).unwrap();
    let mut executive = executive(&program, &ControlArgs::default(), false, None).unwrap();
    let executive = executive.as_mut();
    let stimulus =
        Stimulus::parse(table.as_bytes(), &*executive.names(), executive.tick_ns()).unwrap();
    let mut player = Player::new(stimulus, false);
    let watched: Vec<_> =
        names.iter().map(|name| executive.names().find(name, Purpose::Watch).unwrap()).collect();
    let mut ticks = vec![];
    for tick in 0..TICKS {
        player.apply(tick, executive);
        executive.tick(&mut engine, &mut vec![]).unwrap();
        ticks.push(watched.iter().map(|&variable| executive.read(variable)).collect());
    }
    ticks
}

#[test]
fn pins_assigned_by_program_or_stimulus_act_alike() {
    let folder: PathBuf = std::env::temp_dir().join(format!("plcc-pins-{}", std::process::id()));
    fs::create_dir_all(&folder).unwrap();
    let (inside, outside) = (compiled(&folder, BY_PROGRAM), compiled(&folder, BY_STIMULUS));
    fs::remove_dir_all(&folder).unwrap();
    let mut rng = Rng::new(7);
    let mut inputs = "tick,name,value\n".to_owned();
    let mut pins = inputs.clone();
    let mut now = [false; 6];
    for tick in 0..TICKS {
        // They change seldom, so that timers run out.
        for (input, pin) in [(0, "D"), (1, "CK"), (2, "PR"), (3, "CL"), (4, "TE"), (5, "TD")] {
            let value = &mut now[input];
            *value ^= rng.chance(if input < 2 { 50 } else { 20 });
            let value = u8::from(*value);
            // What the program does in a scan comes to the same as a stimulus of the next tick
            // for timers, since their time passes between; a flip-flop knows no time.
            let later = u64::from(input > 3);
            writeln!(inputs, "{tick},I{input},{value}").unwrap();
            writeln!(pins, "{},{pin},{value}", tick + later).unwrap();
        }
    }
    let expected = values(&outside, EngineKind::Statements, &pins, &["Q", "DE", "DD"]);
    for way in [EngineKind::Statements, EngineKind::Ir, EngineKind::JitSpeed] {
        let found = values(&inside, way, &inputs, &["Q", "SE", "SD"]);
        for (tick, (found, expected)) in found.iter().zip(&expected).enumerate() {
            assert_eq!(found, expected, "{way:?} tick {tick}");
        }
    }
    for column in 0..3 {
        let on = expected.iter().filter(|row| row[column] == Value::Int(1)).count();
        assert!((10..TICKS as usize - 10).contains(&on), "column {column} is on {on} times");
    }
}
