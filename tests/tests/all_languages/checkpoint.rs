//! A run that stops at a checkpoint and continues from it gives what an uninterrupted run gives: the
//! same variables, events, stop and image in every tick, whichever engines run its two parts.
#![allow(clippy::unwrap_used)]

use std::path::Path;

use plcc_abi::Dialect;
use plcc_frontend::common::Options;
use plcc_random::Rng;
use plcc_runtime::{CheckpointError, Purpose, Value};
use plcc_tests::compile::EngineKind;
use plcc_tests::drive::Bench;
use plcc_tests::gen_pmi::Case;
use plcc_tests::{gen_nct, gen_pmac, gen_program};

/// The tick before which the checkpoint is taken, and the engines before and after it.
type Cut = (u64, EngineKind, EngineKind);

/// How many ticks an executive has gone on before it goes back to a checkpoint: fewer than any movement of the machines takes,
/// so that some state has changed once.
const BACK: u64 = 3;

/// Runs a program without a checkpoint, and twice for each of `cuts`.
fn compare(bench: &Bench, cuts: &[Cut], what: &str) {
    let (program, mut engine) = bench.compiled.engine(EngineKind::Statements).unwrap();
    let mut whole = bench.machine(&program).unwrap();
    let expected: Vec<_> = (0..bench.ticks)
        .map(|_| (whole.step(engine.as_mut()).unwrap(), whole.state(&program)))
        .collect();
    for &(cut, before, behind) in cuts {
        let (_, mut engine) = bench.compiled.engine(before).unwrap();
        let mut first = bench.machine(&program).unwrap();
        for _ in 0..cut {
            first.step(engine.as_mut()).unwrap();
        }
        let checkpoint = first.executive.checkpoint();
        let has_stopped = first.has_stopped();
        // An executive at power-up goes on from it, and one that has gone on already goes back to it.
        for steps in [0, BACK] {
            let (_, mut engine) = bench.compiled.engine(behind).unwrap();
            let mut second = bench.machine(&program).unwrap();
            if steps > 0 {
                second.executive.resume(&checkpoint).unwrap();
                second.go_on(cut, has_stopped);
                for _ in 0..steps.min(bench.ticks - cut) {
                    second.step(engine.as_mut()).unwrap();
                }
            }
            second.executive.resume(&checkpoint).unwrap();
            assert_eq!(second.executive.checkpoint(), checkpoint, "{what}: taken and given back");
            second.go_on(cut, has_stopped);
            for (tick, (seen, state)) in (cut..).zip(expected.iter().skip(cut as usize)) {
                let place = || {
                    format!("{what}, {before:?} to {behind:?} at {cut}, back {steps}, tick {tick}")
                };
                assert_eq!(&second.step(engine.as_mut()).unwrap(), seen, "{}", place());
                let now = second.state(&program);
                let differs = now.iter().zip(state).position(|(a, b)| a != b);
                assert_eq!(differs, None, "{}: an offset in the image", place());
            }
            assert_eq!(second.tick, whole.tick);
        }
    }
}

fn generated(dialect: Dialect, seeds: std::ops::Range<u64>) {
    for seed in seeds {
        let case = gen_program::generate_short(dialect, seed);
        let bench = Bench::new(&case, dialect, &Options::default()).unwrap();
        let way = |n: u64| EngineKind::ALL[(n % EngineKind::ALL.len() as u64) as usize];
        // Before the first tick, in the middle, and after the last but one.
        let cuts = [
            (0, way(seed), way(seed + 1)),
            (bench.ticks / 2, way(seed + 1), way(seed + 3)),
            (bench.ticks.saturating_sub(1), way(seed + 4), way(seed)),
        ];
        compare(&bench, &cuts, &format!("seed {seed}\n{}", case.source));
    }
}

#[test]
fn generated_pmi_programs_continue_from_a_checkpoint() {
    generated(Dialect::Pmi, 0..24);
}

#[test]
fn generated_nct_programs_continue_from_a_checkpoint() {
    generated(Dialect::Nct, 0..36);
}

#[test]
fn generated_pmac_programs_continue_from_a_checkpoint() {
    generated(Dialect::Pmac, 0..16);
}

fn example(source: &str, stimulus: Option<&str>, ticks: u64, dialect: Dialect) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples").join(dialect.name());
    let stimulus = stimulus.map(|name| folder.join(name));
    let bench = Bench::open(&folder.join(source), stimulus.as_deref(), ticks, dialect).unwrap();
    let ways = [
        (EngineKind::Statements, EngineKind::JitSpeed),
        (EngineKind::JitNone, EngineKind::Ir),
        (EngineKind::Artifact, EngineKind::Statements),
    ];
    for ((before, behind), part) in ways.into_iter().zip(1..) {
        compare(&bench, &[(ticks * part / 4, before, behind)], source);
    }
}

#[test]
fn examples_continue_from_a_checkpoint() {
    example("lathe.pmi", Some("lathe.csv"), 300, Dialect::Pmi);
    example("sample.plc", Some("sample.csv"), 300, Dialect::Nct);
    example("mill.pmc", None, 600, Dialect::Pmac);
}

/// All engines, each from the beginning, and a change from one to the next in each of `cuts`.
fn ways(cuts: &[u64]) -> Vec<Cut> {
    let all = EngineKind::ALL.iter().map(|engine| (0, *engine, *engine));
    let mut engines = EngineKind::ALL.iter().copied().cycle();
    let mut next = || engines.next().unwrap_or(EngineKind::Ir);
    all.chain(cuts.iter().map(|cut| (*cut, next(), next()))).collect()
}

/// The control, its part program and the small machines go on from a checkpoint, too, in the middle of whatever they do.
#[test]
fn machines_on_the_desk_are_the_same_in_every_engine_and_continue_from_a_checkpoint() {
    let keys = |rows: &[(u64, &str, u64)]| {
        let row = |(tick, key, length): &(u64, &str, u64)| {
            format!("{tick},KEY.{key},1\n{},KEY.{key},0\n", tick + length)
        };
        format!("tick,name,value\n{}", rows.iter().map(row).collect::<String>())
    };
    // Among them ticks in which the spindle starts, a turret or a cylinder moves, a block waits, the axes move.
    for (dialect, file, rows, ticks, cuts) in [
        (
            Dialect::Pmi,
            "turret.pmi",
            &[("MACHINE ON", 5, 15), ("AUTO", 50, 5), ("CYCLE START", 75, 5)][..],
            190,
            &[6, 40, 77, 90, 117, 121, 150, 187][..],
        ),
        (
            Dialect::Nct,
            "changer.nct",
            &[("EMERGENCY LINE", 0, 400), ("B1", 10, 10), ("AUTO", 40, 5), ("START", 60, 5)],
            260,
            &[1, 11, 61, 62, 80, 120, 200, 250],
        ),
        (
            Dialect::Pmac,
            "router.pmc",
            &[("GUARD", 0, 200), ("START", 20, 60), ("JAM HOOD", 112, 8), ("STOP", 150, 20)],
            170,
            &[30, 90, 115, 152],
        ),
    ] {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/desk");
        let path = folder.join(file);
        let rows: Vec<(u64, &str, u64)> =
            rows.iter().map(|(key, tick, length)| (*tick, *key, *length)).collect();
        let sources = std::fs::read_to_string(&path).unwrap();
        let case = Case { source: sources, stimulus: keys(&rows), watch: vec![], ticks };
        let bench = Bench::new(&case, dialect, &Options::default()).unwrap();
        let mut machine = path.with_extension("machine.toml");
        let own = tempfile::tempdir().unwrap();
        if dialect == Dialect::Pmac {
            // A tick is so short that the machine has to be quick.
            let table = std::fs::read_to_string(&machine).unwrap();
            machine = own.path().join("quick.toml");
            std::fs::write(&machine, table.replace("00\n", "\n")).unwrap();
        }
        compare(&bench.on_the_desk(&machine, None), &ways(cuts), file);
    }
}

/// A simulated NC looks at its registers only where the image has changed. It notices an image that was set as a whole.
#[test]
fn registers_of_a_simulated_nc_are_written_again_in_an_image_that_was_set() {
    let folder = tempfile::tempdir().unwrap();
    let machine = folder.path().join("m.toml");
    std::fs::write(&machine, "[simulator]\n").unwrap();
    let source = ":000\nJ0\n:001\nLRH020 SF000\nJ1\n".to_owned();
    let case = Case { source, stimulus: String::new(), watch: vec![], ticks: 10 };
    let bench = Bench::new(&case, Dialect::Nct, &Options::default()).unwrap();
    let bench = bench.on_the_desk(&machine, None);
    let (program, mut engine) = bench.compiled.engine(EngineKind::Ir).unwrap();
    let mut executive = bench.executive(&program).unwrap();
    let names = executive.names();
    let key = names.find("RH020", Purpose::Watch).unwrap();
    let at = names.properties(key).value.unwrap().offset as usize;
    for _ in 0..6 {
        executive.tick(engine.as_mut(), &mut vec![]).unwrap();
    }
    let mut image = executive.image().to_vec();
    image[at] = 77;
    executive.set_image(&image);
    assert_eq!(executive.read(key), Value::Int(77));
    executive.tick(engine.as_mut(), &mut vec![]).unwrap();
    assert_eq!(executive.read(key), Value::Int(0));
}

/// Random programs, which know nothing of the control beside them, while rows play what a program would ask of it.
#[test]
fn generated_programs_continue_from_a_checkpoint_beside_a_simulated_control() {
    let folder = tempfile::tempdir().unwrap();
    let (machine, part) = (folder.path().join("m.toml"), folder.path().join("p.nc"));
    let table = "[simulator]\nblocks = [\"M8 G0 X1\"]\nserial = \"123456\"\n\
                 [[simulator.axis]]\nname = \"X\"\n[[simulator.axis]]\nname = \"Y\"\n";
    std::fs::write(&machine, table).unwrap();
    std::fs::write(&part, "G4 P0.05 S500 T3\nG1 X0.2 Y-0.3 F300\n/G91 X0.5\nG2 X1 I0.5 M90\nM30\n")
        .unwrap();
    for (dialect, names) in [
        (
            Dialect::Pmi,
            &["@MONRQ", "@MCRDY", "@CYCRQ", "@MODRQ", "@FHRQ", "@NEWSC", "@AXRRQ[0]", "@SPDAC"][..],
        ),
        (
            Dialect::Nct,
            &["Y540", "Y406", "Y470", "Y547", "Y650", "Y542", "I477", "Y605", "Y652", "Y710"],
        ),
    ] {
        for seed in 0..8 {
            let mut rng = Rng::new(seed);
            let mut case = gen_program::generate_short(dialect, seed);
            if case.stimulus.is_empty() {
                case.stimulus.push_str("tick,name,value\n");
            }
            case.ticks = case.ticks.max(60);
            for tick in 0..case.ticks {
                if dialect == Dialect::Nct && tick == 0 {
                    case.stimulus
                        .push_str("0,RH078,13\n0,RH089,13\n0,RH055,3\n0,RH054,20\n0,RH060,700\n");
                }
                // Mostly on, so that a program is executed.
                for name in names {
                    let value = match rng.below(12) {
                        0 => 0,
                        1 | 2 => 1 + i64::from(*name == "@MODRQ"),
                        _ => continue,
                    };
                    case.stimulus.push_str(&format!("{tick},{name},{value}\n"));
                }
            }
            let bench = Bench::new(&case, dialect, &Options::default()).unwrap();
            let bench = bench.on_the_desk(&machine, Some(&part));
            let cuts = [1, u64::from(case.ticks) / 3, u64::from(case.ticks) * 2 / 3];
            compare(&bench, &ways(&cuts), &format!("seed {seed}\n{}", case.source));
        }
    }
}

/// A checkpoint also holds what is not in the image: commands that wait, the data kept by SAVE,
/// disabled and suspended PLCs, sparse memory and changed definitions.
#[test]
fn a_pmac_checkpoint_holds_the_state_outside_the_image() {
    let source = "I5=3\nI8=1\nM1->X:$07F0,0,24\nM2->Y:$3456,0,24\nM9->Y:$BC01,0,16\n\
         DISABLE PLC 4\nOPEN PLC 1 CLEAR\nP1=P1+1\nM2=M2+P1\nIF (P1=6)\nENABLE PLC 4\nDISABLE PLC 2\n\
         COMMAND\"P20=7\"\nCOMMAND\"SAVE\"\nENDIF\nIF (P1=9)\nM9=$07F5\nENDIF\nCLOSE\n\
         OPEN PLC 2 CLEAR\nWHILE (P2<1000)\nP2=P2+1\nM1=M1+1\nENDWHILE\nCLOSE\n\
         OPEN PLC 4 CLEAR\nWHILE (P4<3)\nP4=P4+1\nENDWHILE\nSEND\"DONE\"\nP4=0\nCLOSE\n\
         OPEN PLCC 3 CLEAR\nM1=M1+M2\nCLOSE\n";
    let (source, stimulus) = (source.to_owned(), String::new());
    let case = Case { source, stimulus, watch: vec![], ticks: 60 };
    let bench = Bench::new(&case, Dialect::Pmac, &Options::default()).unwrap();
    let cuts: Vec<Cut> = [1, 10, 11, 12, 13, 17, 18, 30]
        .into_iter()
        .map(|cut| match cut % 3 {
            0 => (cut, EngineKind::Statements, EngineKind::JitSpeed),
            1 => (cut, EngineKind::JitSpeed, EngineKind::Ir),
            _ => (cut, EngineKind::Ir, EngineKind::Statements),
        })
        .collect();
    compare(&bench, &cuts, &case.source);
}

/// Bytes that are not checkpoint, are damaged or belong to another program are refused, and the
/// control stays as it was.
#[test]
fn a_refused_checkpoint_changes_nothing() {
    let pmi = |text: &str| {
        let (source, stimulus) = (text.to_owned(), String::new());
        let case = Case { source, stimulus, watch: vec![], ticks: 3 };
        Bench::new(&case, Dialect::Pmi, &Options::default()).unwrap()
    };
    let nct = gen_nct::generate(1, 30);
    let pmac = gen_pmac::generate(1, 30);
    let benches = [
        pmi("$INTEGER\nA,B\n$END\nA=A+1\n"),
        pmi("$INTEGER\nA,C\n$END\nA=A+1\n"),
        Bench::new(&nct, Dialect::Nct, &Options::default()).unwrap(),
        Bench::new(&pmac, Dialect::Pmac, &Options::default()).unwrap(),
    ];
    let mut machines: Vec<_> = benches
        .iter()
        .map(|bench| {
            let (program, mut engine) = bench.compiled.engine(EngineKind::Statements).unwrap();
            let mut machine = bench.machine(&program).unwrap();
            for _ in 0..2 {
                machine.step(engine.as_mut()).unwrap();
            }
            machine
        })
        .collect();
    let checkpoints: Vec<Vec<u8>> =
        machines.iter().map(|machine| machine.executive.checkpoint()).collect();
    for (machine, own) in machines.iter_mut().zip(&checkpoints) {
        let mut refused = |bytes: &[u8]| {
            let result = machine.executive.resume(bytes);
            assert_eq!(&machine.executive.checkpoint(), own, "changed by what was refused");
            result.unwrap_err()
        };
        for foreign in checkpoints.iter().filter(|foreign| *foreign != own) {
            assert_eq!(refused(foreign), CheckpointError::OtherProgram);
        }
        assert_eq!(refused(b""), CheckpointError::NoCheckpoint);
        for at in [12, own.len() / 2, own.len() - 1] {
            let mut damaged = own.clone();
            damaged[at] ^= 4;
            assert_eq!(refused(&damaged), CheckpointError::Damaged);
            assert_eq!(refused(&own[..at]), CheckpointError::Damaged);
        }
        machine.executive.resume(own).unwrap();
    }
}
