//! A recorded run is run again in every engine, byte for byte: from any tick on, across checkpoints at
//! random ticks, and from records that were cut or damaged anywhere, as a process leaves them that is killed.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::fs::{self, OpenOptions};
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::time::Duration;

use plcc_abi::Dialect;
use plcc_frontend::common::Options;
use plcc_random::{Rng, seeds};
use plcc_record::{
    Appending, Difference, Keep, RecordError, RecordFile, RecordedProgram, Recording, Replayer,
    RunHeader, differing_variables,
};
use plcc_tests::compile::EngineKind;
use plcc_tests::drive::Bench;
use plcc_tests::gen_pmi::Case;
use plcc_tests::gen_program;

/// A file that goes away with the test.
struct Record(PathBuf);

impl Record {
    fn new(name: &str) -> Self {
        let name = format!("plcc-replay-{name}-{}.plcrec", std::process::id());
        Self(std::env::temp_dir().join(name))
    }

    fn create(&self, keep: Keep) -> RecordFile {
        let header = RunHeader::new(Duration::ZERO, 20_000_000, false, vec![]);
        RecordFile::create(&self.0, keep, Appending::No, header, RecordedProgram::Unknown).unwrap()
    }

    fn older(&self) -> PathBuf {
        let mut name = self.0.clone().into_os_string();
        name.push(".1");
        name.into()
    }
}

impl Drop for Record {
    fn drop(&mut self) {
        let _ = (fs::remove_file(&self.0), fs::remove_file(self.older()));
    }
}

/// Records the whole run of a program in an engine, with checkpoints before random ticks. Gives the number
/// of ticks.
fn record(bench: &Bench, way: EngineKind, record: &Record, keep: Keep, rng: &mut Rng) -> u64 {
    let (program, mut engine) = bench.compiled.engine(way).unwrap();
    let file = record.create(keep);
    let wants_checkpoint = file.wants_checkpoint();
    let mut machine = bench.recorded_machine(&program, file).unwrap();
    while machine.tick < bench.ticks && !machine.has_stopped() {
        if rng.below(8) == 0 {
            wants_checkpoint.store(true, Ordering::Relaxed);
        }
        machine.step(engine.as_mut()).unwrap();
    }
    machine.end_record().unwrap();
    machine.tick
}

/// Replays what a record holds from the tick `from` on, in one engine up to `change` and then in another
/// one. Gives the number of ticks that were replayed.
fn replay(
    bench: &Bench,
    recording: &Recording,
    (from, change): (u64, u64),
    (first, then): (EngineKind, EngineKind),
    what: &str,
) -> u64 {
    let run = recording.last_run().unwrap();
    let (program, mut engine) = bench.compiled.engine(first).unwrap();
    let mut replayer = Replayer::new(recording, run, 0, bench.executive(&program).unwrap());
    replayer.go_to(from, engine.as_mut()).unwrap();
    let mut events = vec![];
    let mut ticks = 0;
    loop {
        if from + ticks == change {
            engine = bench.compiled.engine(then).unwrap().1;
        }
        let Some(replayed) = replayer.step(engine.as_mut(), &mut events).unwrap() else { break };
        let difference = replayed.difference.as_ref().map(|difference| match difference {
            Difference::Checkpoint(image) => {
                let own = replayer.executive().image().to_vec();
                format!("{:?}", differing_variables(&program, &own, image))
            }
            other => format!("{other:?}"),
        });
        let tick = replayed.tick;
        assert_eq!(difference, None, "{what}: {first:?}, {then:?} from {change}, tick {tick}");
        ticks += 1;
    }
    if let Some((end, matches)) = replayer.end() {
        assert!(matches, "{what}: the hash after the last tick");
        assert_eq!(end.ticks, from + ticks, "{what}");
    }
    ticks
}

fn way(rng: &mut Rng) -> EngineKind {
    *rng.pick(&EngineKind::ALL)
}

/// A random number from 0 to `limit - 1`.
fn below(rng: &mut Rng, limit: u64) -> u64 {
    rng.below(limit as usize) as u64
}

/// Records a program and replays it, whole, from a random tick, and from records that were cut and
/// damaged.
fn check(bench: &Bench, name: &str, rng: &mut Rng, what: &str) {
    let file = Record::new(name);
    let recorded_in = way(rng);
    let ticks = record(bench, recorded_in, &file, Keep::default(), rng);
    let what = format!("recorded in {recorded_in:?}: {what}");
    let recording = Recording::open(&file.0).unwrap();
    assert_eq!(recording.damaged_bytes(), 0);
    for _ in 0..3 {
        let (from, change) = (below(rng, ticks), below(rng, ticks + 1));
        let ways = (way(rng), way(rng));
        assert_eq!(replay(bench, &recording, (from, change), ways, &what), ticks - from, "{what}");
    }
    assert_eq!(replay(bench, &recording, (0, 0), (way(rng), way(rng)), &what), ticks, "{what}");
    drop(recording);

    // A process that is killed leaves a beginning.
    let whole = fs::read(&file.0).unwrap();
    let length = below(rng, whole.len() as u64);
    OpenOptions::new().write(true).open(&file.0).unwrap().set_len(length).unwrap();
    match Recording::open(&file.0) {
        Ok(cut) if cut.last_run().is_some_and(|run| !run.spans.is_empty()) => {
            assert!(cut.last_run().unwrap().end.is_none());
            let run = cut.last_run().unwrap();
            let kept = run.spans.iter().any(|span| cut.end_of(span).unwrap() > span.first);
            if kept {
                let replayed = replay(bench, &cut, (0, 0), (way(rng), way(rng)), &what);
                assert!(replayed <= ticks);
            }
        }
        Ok(_) => {}
        Err(error) => assert!(matches!(error, RecordError::NoRecord(_)), "{error}"),
    }

    // Damage anywhere is passed over; whatever is still there is right.
    let mut damaged = whole;
    let at = rng.below(damaged.len());
    damaged[at] ^= 0x24;
    fs::write(&file.0, &damaged).unwrap();
    if let Ok(recording) = Recording::open(&file.0) {
        assert!(recording.damaged_bytes() > 0, "{what}: byte {at}");
        let run = recording.last_run().unwrap();
        for span in &run.spans {
            let end = recording.end_of(span).unwrap();
            let (program, mut engine) = bench.compiled.engine(way(rng)).unwrap();
            let executive = bench.executive(&program).unwrap();
            let mut replayer = Replayer::new(&recording, run, 0, executive);
            if end > span.first {
                replayer.go_to(span.first, engine.as_mut()).unwrap();
                let replayed = replayer.step(engine.as_mut(), &mut vec![]).unwrap().unwrap();
                assert!(replayed.matches, "{what}: byte {at}, {replayed:?}");
            }
        }
    }
}

fn generated(dialect: Dialect, count: u64) {
    for seed in seeds(count) {
        let case = gen_program::generate_short(dialect, seed);
        let bench = Bench::new(&case, dialect, &Options::default()).unwrap();
        let mut rng = Rng::new(seed ^ 0x7E_C04D);
        check(&bench, dialect.name(), &mut rng, &format!("seed {seed}\n{}", case.source));
    }
}

#[test]
fn generated_pmi_programs_are_replayed() {
    generated(Dialect::Pmi, 12);
}

#[test]
fn generated_nct_programs_are_replayed() {
    generated(Dialect::Nct, 16);
}

#[test]
fn generated_pmac_programs_are_replayed() {
    generated(Dialect::Pmac, 8);
}

fn example(source: &str, stimulus: Option<&str>, ticks: u64, dialect: Dialect) -> Bench {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples").join(dialect.name());
    let stimulus = stimulus.map(|name| folder.join(name));
    Bench::open(&folder.join(source), stimulus.as_deref(), ticks, dialect).unwrap()
}

#[test]
fn examples_are_replayed() {
    let mut rng = Rng::new(7);
    let examples = [
        ("lathe.pmi", Some("lathe.csv"), 300, Dialect::Pmi),
        ("sample.plc", Some("sample.csv"), 300, Dialect::Nct),
        ("mill.pmc", None, 600, Dialect::Pmac),
    ];
    for (source, stimulus, ticks, dialect) in examples {
        check(&example(source, stimulus, ticks, dialect), source, &mut rng, source);
    }
}

/// A record keeps its size, and what is kept begins with a checkpoint.
#[test]
fn a_record_keeps_no_more_than_it_should() {
    let bench = example("lathe.pmi", Some("lathe.csv"), 150_000, Dialect::Pmi);
    let file = Record::new("kept");
    let (mut rng, keep) = (Rng::new(1), Keep::Size(200_000));
    let ticks = record(&bench, EngineKind::JitSpeed, &file, keep, &mut rng);
    let size = [file.0.clone(), file.older()].map(|path| fs::metadata(path).unwrap().len());
    assert!(size.iter().sum::<u64>() < 700_000, "{size:?}");
    let recording = Recording::open(&file.0).unwrap();
    assert_eq!(recording.runs().len(), 1, "the two parts are one run");
    let first = recording.last_run().unwrap().first_tick();
    assert!(first > 0 && first < ticks, "{first}");
    let ways = (EngineKind::JitSpeed, EngineKind::JitSpeed);
    assert_eq!(replay(&bench, &recording, (first, 0), ways, "kept"), ticks - first);
}

/// A program with the same variables that does something else is found out at the first tick that
/// differs, with the variable that does.
#[test]
fn another_program_differs_from_the_record() {
    let bench = |step: u32| {
        let source = format!("$INTEGER\nA,B\n$END\nA=A+1\nB=B+{step}\n");
        let case = Case { source, stimulus: String::new(), watch: vec![], ticks: 60 };
        Bench::new(&case, Dialect::Pmi, &Options::default()).unwrap()
    };
    let (recorded, other) = (bench(1), bench(2));
    let file = Record::new("differs");
    record(&recorded, EngineKind::JitSpeed, &file, Keep::default(), &mut Rng::new(3));
    let recording = Recording::open(&file.0).unwrap();
    let run = recording.last_run().unwrap();
    let (program, mut engine) = other.compiled.engine(EngineKind::Statements).unwrap();
    let mut replayer = Replayer::new(&recording, run, 0, other.executive(&program).unwrap());
    let replayed = replayer.step(engine.as_mut(), &mut vec![]).unwrap().unwrap();
    assert_eq!(replayed.difference, Some(Difference::State));
    let (program, mut engine) = recorded.compiled.engine(EngineKind::Statements).unwrap();
    let mut right = Replayer::new(&recording, run, 0, recorded.executive(&program).unwrap());
    assert!(right.step(engine.as_mut(), &mut vec![]).unwrap().unwrap().matches);
    let images = [&mut replayer, &mut right].map(|it| it.executive().image().to_vec());
    let names: Vec<String> = differing_variables(&program, &images[0], &images[1])
        .into_iter()
        .map(|(name, ..)| name)
        .collect();
    assert_eq!(names, ["B"]);
}
