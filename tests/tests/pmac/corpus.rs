//! Files in the forms in which PMAC programs are found on machines (`tests/corpus/pmac/README.md`
//! explains them): each compiles without an error and does the same in every engine.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::path::{Path, PathBuf};

use plcc::disk::Disk;
use plcc_abi::{Dialect, Engine};
use plcc_diag::{Diagnostic, SourceMap};
use plcc_frontend::common::{Controller, Options};
use plcc_frontend::pmac;
use plcc_random::{Rng, seeds};
use plcc_runtime::pmac::{PmacExecutive, PmacOptions};
use plcc_runtime::{Event, Executive, Purpose};
use plcc_tests::compile::{EngineKind, add, compile_sources};

/// Servo cycles that each file runs for.
const TICKS: u32 = 500;
/// Downloaded after a file, so that all programs in it run.
pub(crate) const ENABLE: &str = "CLOSE\nI5=3\nENABLE PLC 0..31\nENABLE PLCC 0..31\n";

pub(crate) fn corpus() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus/pmac");
    let known = ["pmc", "pmac", "plc"];
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| {
            let ending = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
            known.contains(&&*ending)
        })
        .collect();
    files.sort();
    files
}

pub(crate) fn name(path: &Path) -> String {
    path.file_name().unwrap().to_string_lossy().into_owned()
}

/// The options of a file: Turbo PMAC by its name, templates by `defines.tsv`.
pub(crate) fn options(path: &Path) -> Options {
    let name = name(path);
    let controller = if name.contains("turbo") { Controller::Turbo } else { Controller::Pmac };
    let table = std::fs::read_to_string(path.with_file_name("defines.tsv")).unwrap();
    let row = table.lines().filter_map(|row| row.split_once('\t')).find(|row| row.0 == name);
    let defines = row.map_or("", |row| row.1).split_whitespace();
    let defines = defines.map(|define| {
        let (name, value) = define.split_once('=').unwrap();
        (name.to_owned(), value.to_owned())
    });
    Options { controller, defines: defines.collect(), ..Options::default() }
}

#[test]
fn files_in_the_forms_found_on_machines_compile() {
    let files = corpus();
    assert!(files.len() >= 110, "{} files", files.len());
    let mut wrong = Vec::new();
    for path in files {
        let mut sources = SourceMap::default();
        let file = add(&mut sources, &path).unwrap();
        let (program, found) = pmac::check(&mut sources, &[file], &Disk, &options(&path));
        let name = name(&path);
        for error in found.iter().filter(|diagnostic| diagnostic.is_error()) {
            let (line, column) = sources.line_col(error.span.file, error.span.start);
            wrong.push(format!("{name}:{line}:{column}: {} {}", error.code, error.message));
        }
        if program.is_none() && !found.iter().any(Diagnostic::is_error) {
            wrong.push(format!("{name}: no program and no error"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn the_corpus_has_every_encoding_and_line_end() {
    let texts: Vec<Vec<u8>> = corpus().iter().map(|path| std::fs::read(path).unwrap()).collect();
    let with = |what: fn(&[u8]) -> bool| texts.iter().filter(|text| what(text)).count();
    assert!(with(|text| text.starts_with(b"\xEF\xBB\xBF")) >= 5);
    assert!(with(|text| text.windows(2).any(|pair| pair == b"\r\n")) >= 20);
    assert!(with(|text| text.contains(&b'\r') && !text.contains(&b'\n')) >= 1);
    assert!(with(|text| std::str::from_utf8(text).is_err()) >= 4);
    assert!(with(|text| text.ends_with(b"\x1A")) >= 2);
    assert!(with(|text| !text.ends_with(b"\n") && !text.ends_with(b"\r")) >= 5);
}

/// What the machine and the operator do in a tick: mostly bits of M-variables, now and then a
/// counter, a timer that is done, a state asked for.
pub(crate) fn stimulus(rng: &mut Rng, names: &[String]) -> Vec<(usize, String)> {
    let mut rows = Vec::new();
    if names.is_empty() {
        return rows;
    }
    for _ in 0..rng.below(12) {
        let at = rng.below(names.len());
        let Some(name) = names.get(at) else { continue };
        let value = match name.as_bytes().first() {
            Some(b'M') if rng.chance(75) => rng.below(2).to_string(),
            Some(b'M') => (rng.below(1 << 24) as i64 - (1 << 23)).to_string(),
            // Timers of Turbo PMAC; other I-variables set up the card and stay.
            Some(b'I') if name.len() == 5 && (name.ends_with("11") || name.ends_with("12")) => {
                "-1".to_owned()
            }
            Some(b'P' | b'Q' | b'&') if rng.chance(50) => rng.below(12).to_string(),
            _ => continue,
        };
        rows.push((at, value));
    }
    rows
}

struct Machine {
    way: EngineKind,
    engine: Box<dyn Engine>,
    executive: PmacExecutive,
}

/// Runs a file in all engines and compares them. Gives the number of events.
fn run(path: &Path, seed: u64) -> usize {
    let what = name(path);
    let mut sources = SourceMap::new();
    let files = [add(&mut sources, path).unwrap(), sources.add("enable.pmc", ENABLE.as_bytes())];
    let compiled = compile_sources(&mut sources, &files, Dialect::Pmac, &options(path))
        .unwrap_or_else(|error| panic!("{what}: {error}"));
    let ways = [EngineKind::Statements, EngineKind::Ir, EngineKind::JitNone, EngineKind::JitSpeed];
    let mut machines = ways.map(|way| {
        let (program, engine) = compiled.engine(way).unwrap();
        let executive = PmacExecutive::new(&program, PmacOptions::default()).unwrap();
        Machine { way, engine, executive }
    });
    let declared = machines[0].executive.names().declared();
    let names: Vec<String> = declared.into_iter().map(|(name, _)| name).collect();
    let mut rng = Rng::new(seed);
    let mut total = 0;
    for tick in 0..TICKS {
        let rows = stimulus(&mut rng, &names);
        let mut first: Option<(bool, Vec<Event>)> = None;
        for Machine { way, engine, executive } in &mut machines {
            for (at, value) in &rows {
                let variable = executive.names().find(&names[*at], Purpose::Stimulus).unwrap();
                let value = executive.names().parse(variable, value).unwrap();
                executive.write(variable, value);
            }
            let mut events = Vec::new();
            let stopped = executive.tick(engine.as_mut(), &mut events).is_err();
            let result = (stopped, events);
            match &first {
                None => first = Some(result),
                Some(first) => assert_eq!(*first, result, "{what}, tick {tick}, {way:?}"),
            }
        }
        total += first.map_or(0, |(_, events)| events.len());
        if tick % 50 == 49 {
            let [ours, others @ ..] = &mut machines;
            for Machine { way, executive, .. } in others {
                if ours.executive.image() == executive.image() {
                    continue;
                }
                for name in &names {
                    let ask = |executive: &mut PmacExecutive| {
                        let variable = executive.names().find(name, Purpose::Watch).unwrap();
                        format!("{:?}", executive.read(variable))
                    };
                    let (right, wrong) = (ask(&mut ours.executive), ask(executive));
                    assert_eq!(right, wrong, "{what}, tick {tick}, {way:?}: {name}");
                }
                panic!("{what}, tick {tick}, {way:?}: a word that has no name differs");
            }
        }
    }
    total
}

#[test]
fn every_engine_runs_the_corpus_alike() {
    let mut events = 0;
    for round in seeds(1) {
        events +=
            corpus().iter().zip(1..).map(|(path, n)| run(path, round << 16 | n)).sum::<usize>();
    }
    assert!(events > 1000, "only {events} events");
}
