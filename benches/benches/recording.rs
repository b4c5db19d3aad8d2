//! Measures what a record costs: the time that it adds to a tick, and how many bytes an hour of it takes,
//! for the examples and for 2000 equations. `cargo bench -p plcc-benches --bench recording` prints a table
//! for docs/dev/measurements.md.
//!
//! Two controls of the same program take turns in short rounds, one that is recorded and one that is not, so
//! that everything else meets both alike. The median round of each counts.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::thread;
use std::time::{Duration, Instant};

use plcc::compile;
use plcc::disk::Disk;
use plcc_abi::{Dialect, Engine, Program};
use plcc_benches::kernels::{Language, families};
use plcc_codegen::OptLevel;
use plcc_control::ControlArgs;
use plcc_diag::SourceMap;
use plcc_frontend::common::{Limits, Options};
use plcc_host::run::{Player, Stimulus};
use plcc_host::session;
use plcc_record::ReplaceableExecutive;
use plcc_record::{Appending, Keep, RecordFile, RecordThread, RecordedProgram, RunHeader};
use plcc_runtime::{Event, Executive};

/// Rounds of each control, and ticks of a round.
const ROUNDS: usize = 200;
const TICKS: u64 = 2000;

/// A program that is measured.
struct Subject {
    name: &'static str,
    /// As which the text is read, so that included files are found.
    path: PathBuf,
    dialect: Dialect,
    text: Vec<u8>,
    stimulus: Option<PathBuf>,
}

fn example(dialect: Dialect, name: &'static str, stimulus: Option<&str>) -> Subject {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples").join(dialect.name());
    Subject {
        name,
        path: folder.join(name),
        dialect,
        text: std::fs::read(folder.join(name)).unwrap_or_default(),
        stimulus: stimulus.map(|stimulus| folder.join(stimulus)),
    }
}

fn main() -> ExitCode {
    let equations = families::relay_logic(Language::Pmi, 2000, 1).source().into_bytes();
    let subjects = [
        example(Dialect::Pmi, "lathe.pmi", Some("lathe.csv")),
        example(Dialect::Nct, "sample.plc", Some("sample.csv")),
        example(Dialect::Pmac, "mill.pmc", None),
        Subject {
            name: "2000 equations",
            path: "equations.pmi".into(),
            dialect: Dialect::Pmi,
            text: equations,
            stimulus: None,
        },
    ];
    println!(
        "| program | tick without a record | with a record | added | bytes a tick | MB an hour at 20 ms | at 1 ms |"
    );
    println!("| --- | --- | --- | --- | --- | --- | --- |");
    for subject in &subjects {
        if let Err(why) = measure(subject) {
            eprintln!("error: {}: {why}", subject.name);
            return ExitCode::FAILURE;
        }
    }
    ExitCode::SUCCESS
}

/// A control with what acts on it.
struct Control {
    executive: ReplaceableExecutive,
    engine: Box<dyn Engine>,
    player: Player,
    tick: u64,
    events: Vec<Event>,
    rounds: Vec<Duration>,
}

impl Control {
    fn new(subject: &Subject, program: &Program, engine: Box<dyn Engine>) -> Result<Self, String> {
        let executive = plcc_control::executive(program, &ControlArgs::default(), false, None);
        let executive = ReplaceableExecutive::new(executive.map_err(|e| e.to_string())?);
        let stimulus = subject.stimulus.as_ref();
        let stimulus = stimulus
            .map(|path| session::stimulus(path, &*executive.names(), executive.tick_ns()))
            .transpose();
        let stimulus: Stimulus = stimulus.map_err(|error| error.to_string())?.unwrap_or_default();
        let player = Player::new(stimulus, true);
        let (events, rounds) = (Vec::with_capacity(64), vec![]);
        Ok(Self { executive, engine, player, tick: 0, events, rounds })
    }

    fn round(&mut self) -> Result<(), String> {
        let start = Instant::now();
        for _ in 0..TICKS {
            self.player.apply(self.tick, &mut self.executive);
            self.tick += 1;
            self.events.clear();
            let result = self.executive.tick(self.engine.as_mut(), &mut self.events);
            result.map_err(|stop| stop.message)?;
        }
        self.rounds.push(start.elapsed());
        Ok(())
    }

    /// The nanoseconds of a tick in the median round.
    fn tick_ns(&mut self) -> f64 {
        self.rounds.sort();
        let median = self.rounds.get(self.rounds.len() / 2).copied().unwrap_or_default();
        median.as_nanos() as f64 / TICKS as f64
    }
}

fn measure(subject: &Subject) -> Result<(), String> {
    let mut sources = SourceMap::new();
    let file = sources.add(subject.path.to_string_lossy(), &subject.text);
    let options = Options { limits: Limits::None, ..Options::default() };
    let (checked, _) = compile::check(&mut sources, &[file], subject.dialect, &Disk, &options);
    let checked = checked.ok_or("it has errors")?;
    let lowered = checked.optimized(OptLevel::Speed).map_err(|error| error.to_string())?;
    let engine = || compile::jit(&lowered).map(|(engine, _)| Box::new(engine) as Box<dyn Engine>);
    let control = || {
        let engine = engine().map_err(|error| error.to_string())?;
        Control::new(subject, &lowered.program, engine)
    };
    let (mut plain, mut recorded) = (control()?, control()?);
    let path = std::env::temp_dir().join(format!("plcc-recording-{}.plcrec", std::process::id()));
    let tick_ns = recorded.executive.tick_ns();
    let header = RunHeader::new(Duration::ZERO, tick_ns, false, vec![]);
    let keep = Keep::Size(10_000_000_000);
    let file = RecordFile::create(&path, keep, Appending::No, header, RecordedProgram::Unknown)
        .map_err(|error| error.to_string())?;
    let started = RecordThread::start(file, &recorded.executive, |_| ());
    let (recorder, thread) = started.map_err(|error| error.to_string())?;
    recorded.executive.record(recorder);
    for _ in 0..ROUNDS {
        plain.round()?;
        recorded.round()?;
        // Ticks come far faster than on a machine; the writing thread gets time for them.
        thread::sleep(Duration::from_millis(5));
    }
    recorded.executive.end_record(None).map_err(|error| error.to_string())?;
    thread.finish()?;
    let bytes = std::fs::metadata(&path).map_err(|error| error.to_string())?.len() as f64;
    let _ = std::fs::remove_file(&path);
    let (without, with) = (plain.tick_ns(), recorded.tick_ns());
    let a_tick = bytes / recorded.tick as f64;
    let hour = |ticks_a_second: f64| a_tick * ticks_a_second * 3600.0 / 1e6;
    println!(
        "| {} | {without:.0} ns | {with:.0} ns | {:.0} ns | {a_tick:.1} | {:.2} | {:.1} |",
        subject.name,
        with - without,
        hour(50.0),
        hour(1000.0)
    );
    Ok(())
}
