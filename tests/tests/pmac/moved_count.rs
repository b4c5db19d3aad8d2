//! How many programs move a definition of an M-variable while they run. `docs/dev/moved-definitions.md` holds what
//! this counted, and what was decided because of it.
#![allow(clippy::unwrap_used)]

use std::path::{Path, PathBuf};

use plcc::disk::Disk;
use plcc_abi::pmac::{Definition, Definitions, DirectAccess, Layout, Place, Space};
use plcc_diag::{FileId, SourceMap};
use plcc_frontend::common::{Controller, FileLoader, MemoryLoader, Options};
use plcc_frontend::pmac;
use plcc_random::{Rng, seeds};
use plcc_runtime::pmac::{PmacExecutive, PmacOptions};
use plcc_runtime::{Executive, Purpose};
use plcc_tests::compile::add;
use plcc_tests::idioms::pmac::generate;

use super::corpus::{ENABLE, corpus, name, options, stimulus};

/// Servo cycles that each program runs for.
const TICKS: u32 = 500;
/// After this many ticks without a move the definitions count as settled.
const SETTLED: u32 = 100;

/// What a program does to the definitions of the M-variables that its PLCs name by a number.
#[derive(Default)]
struct Moves {
    /// How many its text shows it to move.
    seen: usize,
    /// How many of them moved in the run.
    moved: usize,
    /// How many of these moved though the text does not show it, so that general code ran.
    unseen: usize,
    /// The ticks between the last move and the end of the run.
    rest: u32,
}

fn moves(
    mut sources: SourceMap,
    files: &[FileId],
    loader: &dyn FileLoader,
    options: &Options,
) -> Option<Moves> {
    let program = pmac::check(&mut sources, files, loader, options).0?;
    let layout = Layout::new(options.controller);
    let tables = program.lower().unwrap().program;
    let mut executive = PmacExecutive::new(&tables, PmacOptions::default())?;
    let mut engine = program.interpreter();
    let definitions = |executive: &mut PmacExecutive| -> Vec<_> {
        let definitions = Definitions::new(executive.parts().0, &layout);
        program.assumptions().iter().map(|named| definitions.get(named.number)).collect()
    };
    let at_load = definitions(&mut executive);
    let seen: Vec<bool> = program
        .assumptions()
        .iter()
        .zip(&at_load)
        .map(|(a, &at_load)| a.definition.is_none() && DirectAccess::of(&layout, at_load).is_some())
        .collect();
    let declared = executive.names().declared().into_iter().map(|(name, _)| name);
    let names: Vec<String> = declared.collect();
    let leads_to_definition = |executive: &mut PmacExecutive, name: &str| {
        let Some(number) = name.strip_prefix('M').and_then(|n| n.parse().ok()) else {
            return false;
        };
        let definition = Definitions::new(executive.parts().0, &layout).get(number);
        !matches!(definition, Definition::Star | Definition::X { .. } | Definition::Tw { .. })
            && matches!(layout.place(Space::Y, definition.address()), Place::Definition(_))
    };
    let names: Vec<String> =
        names.into_iter().filter(|name| !leads_to_definition(&mut executive, name)).collect();
    let seen_count = seen.iter().filter(|seen| **seen).count();
    let mut moves = Moves { seen: seen_count, ..Moves::default() };
    let mut moved = vec![false; at_load.len()];
    let (mut before, mut rng) = (at_load, Rng::new(7));
    for _ in 0..TICKS {
        for (at, value) in stimulus(&mut rng, &names) {
            let variable = executive.names().find(&names[at], Purpose::Stimulus).unwrap();
            let value = executive.names().parse(variable, &value).unwrap();
            executive.write(variable, value);
        }
        if executive.tick(engine.as_mut(), &mut vec![]).is_err() {
            break;
        }
        let now = definitions(&mut executive);
        moves.rest += 1;
        for (moved, (now, before)) in moved.iter_mut().zip(now.iter().zip(&before)) {
            if now != before {
                (*moved, moves.rest) = (true, 0);
            }
        }
        before = now;
    }
    moves.moved = moved.iter().filter(|moved| **moved).count();
    moves.unseen = moved.iter().zip(&seen).filter(|(moved, seen)| **moved && !**seen).count();
    Some(moves)
}

/// Counts the moves of a file with all of its PLCs enabled.
fn moves_of_file(path: &Path, options: &Options) -> Option<Moves> {
    let mut sources = SourceMap::new();
    let files = [add(&mut sources, path).ok()?, sources.add("enable.pmc", ENABLE.as_bytes())];
    moves(sources, &files, &Disk, options)
}

/// The programs of the conformance cases and the examples, with the controller that they are for.
fn cases() -> Vec<(PathBuf, Options)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let folders = std::fs::read_dir(root.join("tests/conformance/pmac")).unwrap();
    let mut cases = vec![];
    for folder in folders.map(|folder| folder.unwrap().path()) {
        let program = folder.join("program.pmc");
        let args = std::fs::read_to_string(folder.join("args")).unwrap();
        let controller = if args.contains("turbo") { Controller::Turbo } else { Controller::Pmac };
        if program.exists() {
            cases.push((program, Options { controller, ..Options::default() }));
        }
    }
    cases.push((root.join("examples/pmac/mill.pmc"), Options::default()));
    cases.sort_by(|a, b| a.0.cmp(&b.0));
    cases
}

/// A group of programs.
struct Group(Vec<(String, Moves)>);

impl Group {
    fn of(programs: impl Iterator<Item = (String, Option<Moves>)>) -> Self {
        Self(programs.filter_map(|(name, moves)| moves.map(|moves| (name, moves))).collect())
    }

    fn count(&self, test: fn(&Moves) -> bool) -> usize {
        self.0.iter().filter(|(_, moves)| test(moves)).count()
    }

    /// Prints a line of the table in `docs/dev/moved-definitions.md`.
    fn print(&self, name: &str) {
        println!(
            "| {name} | {} | {} | {} | {} | {} |",
            self.0.len(),
            self.count(|moves| moves.seen > 0),
            self.count(|moves| moves.moved > 0),
            self.count(|moves| moves.unseen > 0),
            self.count(|moves| moves.moved > 0 && moves.rest >= SETTLED)
        );
    }
}

/// Files as they are found on machines move few definitions, and only such as their text shows; generated programs move
/// them in all ways, so that all forms of code are compared.
#[test]
fn files_move_few_definitions_and_generated_programs_many() {
    println!("| programs | all | text shows a move | moved | unseen | settled |");
    let files = corpus().into_iter();
    let files = Group::of(files.map(|path| (name(&path), moves_of_file(&path, &options(&path)))));
    files.print("corpus");
    let cases = cases().into_iter();
    let cases =
        Group::of(cases.map(|(path, options)| (name(&path), moves_of_file(&path, &options))));
    cases.print("conformance cases and the example");
    let generated = Group::of(seeds(40).map(|seed| {
        let turbo = seed % 4 == 1;
        let controller = if turbo { Controller::Turbo } else { Controller::Pmac };
        let mut sources = SourceMap::new();
        let file = sources.add("generated.pmc", generate(seed, turbo).source.as_bytes());
        let options = Options { controller, ..Options::default() };
        (seed.to_string(), moves(sources, &[file], &MemoryLoader::new(), &options))
    }));
    generated.print("second generator");
    // The decisions in docs/dev/moved-definitions.md rest on this.
    let movers = files.0.iter().filter(|(_, moves)| moves.moved > 0).map(|(name, _)| &**name);
    assert_eq!(movers.collect::<Vec<_>>(), ["cam-switch.plc", "indirect.pmc"]);
    assert_eq!(files.count(|moves| moves.unseen > 0), 0);
    assert!(cases.count(|moves| moves.unseen > 0) > 0);
    assert!(generated.count(|moves| moves.seen > 0) > 0);
    assert!(generated.count(|moves| moves.unseen > 0) > 0);
    assert!(generated.count(|moves| moves.moved == 0) > 0);
}
