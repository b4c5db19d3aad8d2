//! Runs every case of `tests/conformance/` and every scenario of `examples/` in every engine. Trace,
//! events and dump must be the expected ones, byte for byte, in each engine.
//!
//! A case is a folder with `args` (the options of `plcc run`, no paths), the program as
//! `program.*` or its path in a file `program`, and of `stimulus.csv`, `machine.toml`,
//! `expected.csv` (trace), `expected.jsonl` (events) and `expected.json` (dump) those that it
//! needs. With `--simulate` in `args`, `machine.toml` has the simulator's table, and `part.nc` is the part program. A scenario of `examples/DIALECT/NAME.*` is a folder `examples/DIALECT/NAME/SCENARIO`.
//!
//! `BLESS=1` overwrites the expected files that exist, if all engines agree.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use clap::Parser;
use plcc_abi::Dialect;
use plcc_control::executive;
use plcc_control::{Watch, dump};
use plcc_frontend::common::{Controller, Limits, Machine, Options};
use plcc_host::args::RunArgs;
use plcc_host::run::{Player, Run, Stimulus};
use plcc_host::session;
use plcc_tests::compile::{Compiled, EngineKind, compile};

/// What may stand in `args`.
#[derive(Parser)]
struct Args {
    #[command(flatten)]
    run: RunArgs,
    #[arg(long, default_value = "pmac", value_parser = ["pmac", "turbo"])]
    controller: String,
    #[arg(long, default_value = "original", value_parser = ["original", "none"])]
    limits: String,
    #[arg(long)]
    define: Vec<String>,
}

/// What a run writes, each with the name of the file that holds what is expected.
type Written = [(&'static str, String); 3];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().to_owned()
}

fn folders(path: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(path).into_iter().flatten().map(|entry| entry.unwrap().path());
    let mut folders: Vec<PathBuf> = entries.filter(|path| path.is_dir()).collect();
    folders.sort();
    folders
}

/// The file `STEM.*` of a folder that is the dialect's.
fn source(folder: &Path, stem: &str) -> Option<PathBuf> {
    let endings = ["pmi", "nct", "plc", "pmc", "pmac"];
    let mut files = endings.iter().map(|ending| folder.join(format!("{stem}.{ending}")));
    files.find(|file| file.is_file())
}

/// All cases and scenarios of a dialect, with their programs.
fn cases(dialect: Dialect) -> Vec<(PathBuf, PathBuf)> {
    let root = root();
    let mut cases = vec![];
    for case in folders(&root.join("tests/conformance").join(dialect.name())) {
        let named = fs::read_to_string(case.join("program")).ok();
        let program = named.map(|path| root.join(path.trim())).or_else(|| source(&case, "program"));
        cases.push((case.clone(), program.unwrap_or_else(|| panic!("{case:?} has no program"))));
    }
    let examples = root.join("examples").join(dialect.name());
    for example in folders(&examples) {
        let name = example.file_name().unwrap().to_string_lossy().into_owned();
        let Some(program) = source(&examples, &name) else { continue };
        let scenarios = folders(&example).into_iter().filter(|case| case.join("args").is_file());
        cases.extend(scenarios.map(|scenario| (scenario, program.clone())));
    }
    cases
}

/// Runs the program of a source with the stimulus of a case.
fn run(
    compiled: &Compiled,
    way: EngineKind,
    dialect: Dialect,
    args: &Args,
    case: &Path,
    source: &Path,
) -> Written {
    let (program, mut engine) = compiled.engine(way).unwrap_or_else(|e| panic!("{way:?}: {e}"));
    let mut executive = if args.run.simulate {
        let (machine, part) = (case.join("machine.toml"), case.join("part.nc"));
        let table = Machine::parse(&fs::read_to_string(&machine).unwrap()).unwrap();
        let run = RunArgs {
            control: args.run.control.clone(),
            simulate: true,
            machine_path: Some(machine),
            part_program: Some(part).filter(|part| part.is_file()),
            ..RunArgs::default()
        };
        let made = session::simulated_executive(&program, &run, Some(&table));
        made.unwrap_or_else(|error| panic!("{case:?}: {error}"))
    } else {
        executive(&program, &args.run.control, false, None).unwrap()
    };
    let executive = executive.as_mut();
    let table = fs::read(case.join("stimulus.csv")).unwrap_or_else(|_| b"tick,name,value\n".into());
    let stimulus = Stimulus::parse(&table, &*executive.names(), executive.tick_ns())
        .unwrap_or_else(|e| panic!("{case:?}: {e:?}"));
    let watch = Watch::parse(&args.run.watch, &*executive.names());
    let watch = watch.unwrap_or_else(|e| panic!("{case:?}: {e:?}"));
    let (mut trace, mut events, mut state) = (vec![], vec![], vec![]);
    let end = Run {
        player: Player::new(stimulus, args.run.repeat),
        watch: watch.clone(),
        trace: Some(&mut trace),
        events: Some(&mut events),
        ticks: args.run.ticks,
        ..Run::new(executive, &mut engine)
    }
    .go();
    assert!(end.failure.is_none(), "{:?}", end.failure);
    dump(&mut state, dialect, executive, &watch, end.ticks, end.stop.as_ref()).unwrap();
    // A source is named as given. Only where the case lies is left out.
    let folder = format!("{}/", source.parent().unwrap().display());
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap().replace(&folder, "");
    [
        ("expected.csv", text(trace)),
        ("expected.jsonl", text(events)),
        ("expected.json", text(state)),
    ]
}

/// The first lines that differ, in their context.
fn difference(expected: &str, found: &str) -> String {
    const CONTEXT: usize = 3;
    const SHOWN: usize = 12;
    let (old, new): (Vec<&str>, Vec<&str>) = (expected.lines().collect(), found.lines().collect());
    let same = old.iter().zip(&new).take_while(|(a, b)| a == b).count();
    let cut = |line: &str| line.chars().take(300).collect::<String>();
    let mut text = String::new();
    for (number, line) in old.iter().enumerate().take(same).skip(same.saturating_sub(CONTEXT)) {
        writeln!(text, "  {:5}   {}", number + 1, cut(line)).unwrap();
    }
    for (mark, lines) in [('-', &old), ('+', &new)] {
        for (number, line) in lines.iter().enumerate().skip(same).take(SHOWN) {
            writeln!(text, "  {:5} {mark} {}", number + 1, cut(line)).unwrap();
        }
        if lines.len() > same + SHOWN {
            writeln!(text, "        {mark} … {} more", lines.len() - same - SHOWN).unwrap();
        }
    }
    text
}

/// Runs a case in every engine. The error says what differs.
fn check(dialect: Dialect, case: &Path, program: &Path) -> Result<(), String> {
    let words = fs::read_to_string(case.join("args")).map_err(|e| format!("args: {e}"))?;
    let args = Args::try_parse_from(std::iter::once("run").chain(words.split_whitespace()))
        .map_err(|error| error.to_string())?;
    let machine = match fs::read_to_string(case.join("machine.toml")) {
        Ok(text) => Machine::parse(&text).map_err(|error| error.to_string())?,
        Err(_) => Machine::default(),
    };
    let define = |text: &String| text.split_once('=').map(|(n, v)| (n.to_owned(), v.to_owned()));
    let options = Options {
        limits: if args.limits == "none" { Limits::None } else { Limits::Original },
        controller: if args.controller == "turbo" { Controller::Turbo } else { Controller::Pmac },
        defines: args.define.iter().filter_map(define).collect(),
        machine,
        ..Options::default()
    };
    let compiled = compile(program, dialect, &options)?;
    let [oracle, others @ ..] = EngineKind::ALL;
    let first = run(&compiled, oracle, dialect, &args, case, program);
    for way in others {
        for ((file, expected), (_, found)) in
            first.iter().zip(run(&compiled, way, dialect, &args, case, program))
        {
            if *expected != found {
                let what = file.replace("expected", &format!("{way:?} against {oracle:?}"));
                return Err(format!("{what}\n{}", difference(expected, &found)));
            }
        }
    }
    let bless = std::env::var_os("BLESS").is_some_and(|value| value == "1");
    let mut expects = false;
    for (file, found) in &first {
        let path = case.join(file);
        let Ok(expected) = fs::read_to_string(&path) else { continue };
        expects = true;
        if expected == *found {
            continue;
        }
        if !bless {
            return Err(format!("{file}\n{}", difference(&expected, found)));
        }
        fs::write(&path, found).map_err(|error| error.to_string())?;
    }
    if expects { Ok(()) } else { Err("nothing is expected of it".into()) }
}

fn conform(dialect: Dialect, at_least: usize) {
    let cases = cases(dialect);
    assert!(cases.len() >= at_least, "only {} cases are found", cases.len());
    let mut failed = String::new();
    for (case, program) in &cases {
        if let Err(why) = check(dialect, case, program) {
            let name = case.strip_prefix(root()).unwrap_or(case);
            writeln!(failed, "{}: {why}", name.display()).unwrap();
        }
    }
    assert!(failed.is_empty(), "\n{failed}");
}

#[test]
fn pmi_cases_give_what_is_expected() {
    conform(Dialect::Pmi, 25);
}

#[test]
fn nct_cases_give_what_is_expected() {
    conform(Dialect::Nct, 10);
}

#[test]
fn pmac_cases_give_what_is_expected() {
    conform(Dialect::Pmac, 20);
}

/// The lathe of PMI's manual with its stimulus, in a run that is longer than any case.
#[test]
fn the_lathe_runs_alike_in_every_engine() {
    let folder = root().join("examples/pmi");
    let lathe = folder.join("lathe.pmi");
    let compiled = compile(&lathe, Dialect::Pmi, &Options::default()).unwrap();
    let words = ["run", "--ticks", "3000", "--repeat", "--watch", "@CL115,@MODRQ,@SPDAC"];
    let args = Args::parse_from(words);
    let case = std::env::temp_dir().join(format!("plcc-lathe-{}", std::process::id()));
    fs::create_dir_all(&case).unwrap();
    fs::copy(folder.join("lathe.csv"), case.join("stimulus.csv")).unwrap();
    let all = EngineKind::ALL.map(|way| run(&compiled, way, Dialect::Pmi, &args, &case, &lathe));
    fs::remove_dir_all(&case).unwrap();
    let [first, others @ ..] = all;
    for other in others {
        assert_eq!(first, other);
    }
    let [(_, trace), ..] = first;
    assert!(trace.lines().count() > 20, "{trace}");
}
