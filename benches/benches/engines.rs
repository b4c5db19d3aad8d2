//! Measures a base tick in each engine, and the time from source text to native code, for the examples
//! and for generated programs of 200, 2000 and 20 000 equations.
//! `cargo bench -p plcc-benches --bench engines` runs all; a word after `--` selects the measurements
//! with that word in their name.

use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::time::Duration;

use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, Criterion, criterion_group, criterion_main};
use plcc::compile::{self, Checked};
use plcc::disk::Disk;
use plcc_abi::{Dialect, Engine, Program};
use plcc_benches::kernels::{Language, families};
use plcc_codegen::OptLevel;
use plcc_control::ControlArgs;
use plcc_diag::SourceMap;
use plcc_frontend::common::{Limits, Machine, Options};
use plcc_host::run::{Player, Stimulus};
use plcc_host::session;

/// A program to measure with.
struct Subject {
    name: String,
    path: PathBuf,
    text: Vec<u8>,
    dialect: Dialect,
    stimulus: Option<PathBuf>,
    options: Options,
}

fn example(dialect: Dialect, file: &str, stimulus: Option<&str>, machine: Option<&str>) -> Subject {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples").join(dialect.name());
    let path = folder.join(file);
    let machine = machine.map(|machine| read(&folder.join(machine)));
    let machine = machine.and_then(|bytes| Machine::parse(&String::from_utf8_lossy(&bytes)).ok());
    Subject {
        name: file.into(),
        text: read(&path),
        path,
        dialect,
        stimulus: stimulus.map(|stimulus| folder.join(stimulus)),
        options: Options { machine: machine.unwrap_or_default(), ..Options::default() },
    }
}

/// A file's bytes; no bytes for a missing file, which then fails to compile.
fn read(path: &Path) -> Vec<u8> {
    std::fs::read(path).unwrap_or_default()
}

fn equations(count: usize) -> Subject {
    Subject {
        name: format!("{count} equations"),
        path: "equations.pmi".into(),
        text: families::relay_logic(Language::Pmi, count, 1).source().into_bytes(),
        dialect: Dialect::Pmi,
        stimulus: None,
        options: Options { limits: Limits::None, ..Options::default() },
    }
}

fn subjects() -> Vec<Subject> {
    let mut all = vec![
        example(Dialect::Pmi, "lathe.pmi", Some("lathe.csv"), None),
        example(Dialect::Pmi, "touch.pmi", None, Some("touch.machine.toml")),
        example(Dialect::Nct, "sample.plc", Some("sample.csv"), None),
        example(Dialect::Pmac, "mill.pmc", None, None),
    ];
    all.extend([200, 2000, 20_000].map(equations));
    all
}

impl Subject {
    fn check(&self) -> Option<Checked> {
        let mut sources = SourceMap::new();
        let file = sources.add(self.path.to_string_lossy(), &self.text);
        compile::check(&mut sources, &[file], self.dialect, &Disk, &self.options).0
    }
}

fn compiling(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("compile");
    group.sample_size(10).measurement_time(Duration::from_secs(2));
    for subject in subjects() {
        group.bench_function(&subject.name, |bencher| {
            bencher.iter(|| {
                let lowered = subject.check()?.optimized(OptLevel::Speed).ok()?;
                black_box(compile::jit(&lowered).ok())
            });
        });
    }
}

fn ticks(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("tick");
    group.measurement_time(Duration::from_secs(2)).warm_up_time(Duration::from_secs(1));
    for subject in subjects() {
        let Some(checked) = subject.check() else {
            eprintln!("{}: it has errors", subject.name);
            continue;
        };
        let Ok(lowered) = checked.optimized(OptLevel::Speed) else {
            eprintln!("{}: it can't be lowered", subject.name);
            continue;
        };
        let (Ok((jit, _)), Ok((aot, _))) = (compile::jit(&lowered), compile::aot(&lowered)) else {
            eprintln!("{}: it can't be compiled", subject.name);
            continue;
        };
        let engines: [(&str, Box<dyn Engine>); 3] =
            [("interp", checked.interpreter()), ("jit", Box::new(jit)), ("aot", Box::new(aot))];
        for (engine, mut native) in engines {
            tick(&mut group, &subject, &lowered.program, engine, native.as_mut());
        }
    }
}

fn tick(
    group: &mut BenchmarkGroup<'_, WallTime>,
    subject: &Subject,
    program: &Program,
    name: &str,
    engine: &mut dyn Engine,
) {
    let Ok(mut executive) = plcc_control::executive(program, &ControlArgs::default(), false, None)
    else {
        return;
    };
    let stimulus = subject
        .stimulus
        .as_ref()
        .map(|path| session::stimulus(path, &*executive.names(), executive.tick_ns()));
    let stimulus: Stimulus = stimulus.and_then(Result::ok).unwrap_or_default();
    let mut player = Player::new(stimulus, true);
    let mut events = Vec::new();
    let mut number = 0;
    group.bench_function(format!("{}/{name}", subject.name), |bencher| {
        bencher.iter(|| {
            player.apply(number, executive.as_mut());
            number += 1;
            events.clear();
            black_box(executive.tick(engine, &mut events)).is_ok()
        });
    });
}

criterion_group!(benches, compiling, ticks);
criterion_main!(benches);
