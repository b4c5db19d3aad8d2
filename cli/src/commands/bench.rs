//! `plcc bench`: runs a program in the three engines by turns, and prints how long scans take.

mod engine;
mod figures;

use std::time::{Duration, Instant};

use plcc_abi::{Engine, Program};
use plcc_host::run::{Player, Stimulus};
use plcc_host::session;
use plcc_runtime::{Event, Executive};
use serde::Serialize;
use serde_json::{Map, Value, json};

use crate::args::{BenchArgs, FormatArg, PassArgs};
use crate::compile::{self, Checked, CompileError};
use crate::failure::{DONE, ERRORS, Failure, STOPPED};
use crate::input::{Input, SourceSettings};
use crate::later_code::{Jit, jit_in_parts};
use crate::output;
use crate::report::{Count, Destination, Report};
use engine::Timed;
use figures::{Figures, Samples};

/// The engines take turns in rounds, so that all meet the same conditions of the machine. A round has
/// at most this many ticks of each engine.
const MAX_ROUND: u64 = 1000;
/// About how long a round of all engines together may take.
const ROUND_TIME: Duration = Duration::from_millis(50);
/// Ticks in each engine where no number is given, unless they take longer than [`TIME_LIMIT`].
const TICKS: u64 = 100_000;
/// After this time no further round is begun, where no number of ticks is given.
const TIME_LIMIT: Duration = Duration::from_secs(10);
/// The program is compiled this many times; the shortest time counts.
const COMPILES: usize = 3;

/// One engine with a control of its own, and its times.
struct TimedRun {
    name: &'static str,
    executive: Box<dyn Executive>,
    engine: Timed,
    player: Player,
    tick: u64,
    events: Vec<Event>,
    ticks: Samples,
    scans: Samples,
}

#[derive(Serialize)]
struct EngineFigures {
    ns_per_scan: Figures,
    ns_per_tick: Figures,
}

/// Everything that is printed.
struct Results {
    entries: Vec<(String, Vec<(&'static str, Figures)>)>,
    engines: Vec<(&'static str, EngineFigures)>,
    compile_ms: [(&'static str, f64); 2],
    code_bytes: [(&'static str, usize); 2],
}

pub(crate) fn bench(args: &BenchArgs, passes: &PassArgs, report: &Report) -> Result<u8, Failure> {
    let mut settings = SourceSettings::for_files(&args.source, &args.files, report)?;
    settings.options.simulate = args.simulate;
    let program = Input::read(&args.files, &args.source)?.check(&settings)?;
    let errors = Count::of(&program.diagnostics).errors;
    let Some(checked) = program.checked.filter(|_| errors == 0) else {
        let count = report.show(
            &program.sources,
            &program.diagnostics,
            Destination::from(args.source.message_format),
        )?;
        report.message(&format!("{count}: the program is not timed"));
        return Ok(ERRORS);
    };
    let opt = passes.at(args.opt);
    let (lowered, (aot, aot_bytes)) = match checked.compiled(opt, compile::aot) {
        Ok(made) => made,
        Err(error) => {
            return report.not_compiled(
                error,
                &program.sources,
                Destination::from(args.source.message_format),
            );
        }
    };
    let jit_in_parts = |checked: &Checked| jit_in_parts(|| checked.lower(), opt);
    let jit_ms = compile_ms(args, &settings, |checked| jit_in_parts(checked).map(drop))?;
    let make_aot = |checked: &Checked| checked.compiled(opt, compile::aot).map(drop);
    let aot_ms = compile_ms(args, &settings, make_aot)?;
    let Jit { engine: jit, bytes_of_code: jit_bytes, .. } = jit_in_parts(&checked)?;
    let engines: [(&'static str, Box<dyn Engine>); 3] =
        [("interp", checked.interpreter()), ("jit", Box::new(jit)), ("aot", Box::new(aot))];
    let mut runs = Vec::new();
    for (name, engine) in engines {
        runs.push(run(name, engine, &lowered.program, args, &settings)?);
    }
    let scans = match take_turns(&mut runs, args.ticks) {
        Ok(scans) => scans,
        Err(stop) => {
            let (tick, code) = (stop.tick, stop.code);
            report.message(&format!("stopped: {code} in tick {tick}: nothing is timed"));
            return Ok(STOPPED);
        }
    };
    check_same_state(&mut runs)?;
    let results = Results {
        entries: entries(&runs, &lowered.program),
        engines: runs
            .iter()
            .map(|run| {
                let (ns_per_scan, ns_per_tick) = (run.scans.figures(), run.ticks.figures());
                (run.name, EngineFigures { ns_per_scan, ns_per_tick })
            })
            .collect(),
        compile_ms: [("jit", jit_ms), ("aot", aot_ms)],
        code_bytes: [("jit", jit_bytes), ("aot", aot_bytes)],
    };
    let file = args.files.first().map_or_else(String::new, |file| file.to_string_lossy().into());
    let text = if args.json || args.source.message_format == FormatArg::Json {
        format!("{}\n", results.json(&file, program.dialect.name(), scans))
    } else {
        results.table(&file, scans)
    };
    output::print(text.as_bytes())?;
    Ok(DONE)
}

/// Milliseconds from source text to something that can be called.
fn compile_ms(
    args: &BenchArgs,
    settings: &SourceSettings,
    make: impl Fn(&Checked) -> Result<(), CompileError>,
) -> Result<f64, Failure> {
    let mut least = Duration::MAX;
    for _ in 0..COMPILES {
        let input = Input::read(&args.files, &args.source)?;
        let start = Instant::now();
        let program = input.check(settings)?;
        if let Some(checked) = &program.checked {
            make(checked)?;
        }
        least = least.min(start.elapsed());
    }
    Ok((least.as_secs_f64() * 1e6).round() / 1e3)
}

fn run(
    name: &'static str,
    engine: Box<dyn Engine>,
    program: &Program,
    args: &BenchArgs,
    settings: &SourceSettings,
) -> Result<TimedRun, Failure> {
    let machine = settings.machine_file();
    let control = session::with_motors(program, &args.control, args.simulate, machine);
    let executive = plcc_control::executive(program, &control, false, machine);
    let executive = executive.map_err(|error| Failure::usage(error.to_string()))?;
    let stimulus = match &args.stimulus {
        Some(path) => session::stimulus(path, &*executive.names(), executive.tick_ns())
            .map_err(|error| Failure::usage(error.to_string()))?,
        None => Stimulus::default(),
    };
    Ok(TimedRun {
        name,
        executive,
        engine: Timed::new(engine, program.tasks.len()),
        player: Player::new(stimulus, true),
        tick: 0,
        events: Vec::new(),
        ticks: Samples::default(),
        scans: Samples::default(),
    })
}

/// Why the program was stopped before all ticks were done.
struct Stopped {
    tick: u64,
    code: String,
}

/// Lets the engines take turns until each has done its ticks: `ticks` of them, else as many as there
/// is time for before [`TIME_LIMIT`]. The result is how many there were.
fn take_turns(runs: &mut [TimedRun], ticks: Option<u64>) -> Result<u64, Stopped> {
    let start = Instant::now();
    let mut done = 0;
    let mut round = 1;
    while done < ticks.unwrap_or(TICKS) && (ticks.is_some() || start.elapsed() < TIME_LIMIT) {
        round = round.min(ticks.unwrap_or(TICKS) - done);
        let begun = Instant::now();
        for run in &mut *runs {
            for _ in 0..round {
                run.step()?;
            }
        }
        done += round;
        round = match begun.elapsed() {
            time if time < ROUND_TIME => (round * 2).min(MAX_ROUND),
            _ => (round / 2).max(1),
        };
    }
    Ok(done)
}

/// Checks that all engines have come to the same state.
fn check_same_state(runs: &mut [TimedRun]) -> Result<(), Failure> {
    let mut states = runs.iter_mut().map(|run| {
        let executive = run.executive.as_mut();
        let variables = executive.names().declared().into_iter();
        let values = variables.map(|(name, variable)| (name, executive.read(variable)));
        (run.name, values.collect::<Vec<_>>())
    });
    let Some((name, state)) = states.next() else { return Ok(()) };
    for (other, values) in states {
        let differs = state.iter().zip(&values).find(|(a, b)| a != b);
        if let Some(((variable, a), (_, b))) = differs {
            let message = format!("{variable} is {a:?} in {name} and {b:?} in {other}");
            return Err(Failure::internal(message));
        }
    }
    Ok(())
}

impl TimedRun {
    /// One tick, timed.
    fn step(&mut self) -> Result<(), Stopped> {
        let tick = self.tick;
        self.player.apply(tick, self.executive.as_mut());
        self.tick += 1;
        self.events.clear();
        self.engine.begin();
        let start = Instant::now();
        let result = self.executive.tick(&mut self.engine, &mut self.events);
        let elapsed = start.elapsed().as_nanos() as u64;
        let (scan, overhead) = self.engine.finish();
        self.scans.push(scan);
        self.ticks.push(elapsed.saturating_sub(overhead));
        result.map_err(|stop| Stopped { tick, code: stop.code })
    }
}

/// The times of each entry point that was called, in each engine.
fn entries(runs: &[TimedRun], program: &Program) -> Vec<(String, Vec<(&'static str, Figures)>)> {
    let of = |task| {
        let called = runs.iter().filter_map(move |run| {
            let samples = run.engine.samples(task).filter(|samples| !samples.is_empty())?;
            Some((run.name, samples.figures()))
        });
        called.collect::<Vec<_>>()
    };
    program
        .tasks
        .iter()
        .enumerate()
        .map(|(task, entry)| (entry.name.clone(), of(task)))
        .filter(|(_, figures)| !figures.is_empty())
        .collect()
}

/// A JSON object of these pairs.
fn object<T: Serialize>(pairs: &[(&'static str, T)]) -> Value {
    Value::Object(pairs.iter().map(|(name, value)| ((*name).into(), json!(value))).collect())
}

impl Results {
    fn json(&self, file: &str, dialect: &str, scans: u64) -> Value {
        let entries: Map<String, Value> =
            self.entries.iter().map(|(name, of)| (name.clone(), object(of))).collect();
        json!({
            "file": file, "dialect": dialect, "scans": scans, "entries": entries,
            "engines": object(&self.engines),
            "compile_ms": object(&self.compile_ms), "code_bytes": object(&self.code_bytes),
        })
    }

    fn table(&self, file: &str, scans: u64) -> String {
        let mut text = format!("{file}, {scans} ticks in each engine; nanoseconds\n\n");
        let mut row = |cells: [&str; 5]| {
            let [what, engine, min, median, p99] = cells;
            text += &format!("{what:<12} {engine:<7} {min:>10} {median:>10} {p99:>10}\n");
        };
        row(["", "engine", "min", "median", "p99"]);
        let mut figures = |what: &str, engine: &str, f: &Figures| {
            let cells = [f.min, f.median, f.p99].map(|ns| ns.to_string());
            let [min, median, p99] = &cells;
            row([what, engine, min, median, p99]);
        };
        for (name, of) in &self.entries {
            for (engine, f) in of {
                figures(name, engine, f);
            }
        }
        for (engine, f) in &self.engines {
            figures("all together", engine, &f.ns_per_scan);
        }
        for (engine, f) in &self.engines {
            figures("whole tick", engine, &f.ns_per_tick);
        }
        text.push('\n');
        for ((engine, ms), (_, bytes)) in self.compile_ms.iter().zip(&self.code_bytes) {
            text += &format!("{engine}: {ms} ms from source to callable, {bytes} bytes of code\n");
        }
        text
    }
}
