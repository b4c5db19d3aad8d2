//! Measures what it costs when a PMAC program changes ("moves") the definition of an M-variable. Logic
//! on M- and P-variables is run in code that was specialised for the first definition; in the same code
//! after the change, through its general path; in code that was recompiled for the new definition; and
//! with the variable left to the host because its definition changes too often.
//!
//! `cargo bench -p plcc-benches --bench pmac_moved` runs it; `-- 200 2000` after it gives other numbers
//! of statements. It fails when recompiled code has less than 0.8 of the speed before the change, or
//! ends in another state than the interpreter.
#![allow(clippy::indexing_slicing)]

use std::error::Error;
use std::time::Instant;

use plcc::compile::{Optimized, jit};
use plcc::recompile::PmacRecompiler;
use plcc_abi::image::write_u32;
use plcc_abi::pmac::{
    Assumption, Controller, Definition, Definitions, Field, Format, Layout, Place, Space,
};
use plcc_abi::{Engine, Scan};
use plcc_benches::pmac::{BITS, INPUT_WORDS, download, patterns};
use plcc_codegen::OptLevel;
use plcc_diag::SourceMap;
use plcc_frontend::common::{MemoryLoader, Options};
use plcc_frontend::pmac::{self, Program};
use plcc_runtime::pmac::{PmacExecutive, PmacOptions, Recompiling, Settings};

const ROUNDS: usize = 9;
const LAYOUT: Layout = Layout::new(Controller::Pmac);
/// The address of a word that the kernel does not use.
const ELSEWHERE: u32 = 0x07F8;

fn main() -> Result<(), Box<dyn Error>> {
    let mut sizes: Vec<usize> = std::env::args().filter_map(|arg| arg.parse().ok()).collect();
    if sizes.is_empty() {
        sizes = vec![200, 2000];
    }
    println!(
        "{:>10} {:>10} {:>10} {:>10} {:>14} {:>10}   ns a scan",
        "statements", "before", "moved", "recompiled", "left to host", "compile ms"
    );
    let mut broken = vec![];
    for size in sizes {
        let Times { before, moved, recompiled, left, compile_ms } = measure(size)?;
        println!(
            "{size:>10} {before:>10.1} {moved:>10.1} {recompiled:>10.1} {left:>14.1} {compile_ms:>10.2}"
        );
        if before / recompiled < 0.8 {
            broken.push(format!("{size} statements: recompiled code is slower"));
        }
    }
    if broken.is_empty() { Ok(()) } else { Err(broken.join("; ").into()) }
}

/// Medians of all rounds: nanoseconds a scan in each kind of code, and the milliseconds that
/// recompiling took.
struct Times {
    before: f64,
    moved: f64,
    recompiled: f64,
    left: f64,
    compile_ms: f64,
}

fn measure(size: usize) -> Result<Times, Box<dyn Error>> {
    let text = download(size, 11);
    let mut sources = SourceMap::new();
    let file = sources.add("moved.pmc", text.as_bytes());
    let (program, _) =
        pmac::check(&mut sources, &[file], &MemoryLoader::new(), &Options::default());
    let program = program.ok_or("the kernel has errors")?;
    let (lowered, _) = Optimized::of(program.lower()?, OptLevel::Speed);
    let number = program.assumptions().first().ok_or("the kernel names no M-variable")?.number;
    let scans = (5_000_000 / size).max(64);
    let [mut before, mut moved, mut recompiled, mut left, mut compile_ms] =
        [(); 5].map(|()| vec![]);
    for _ in 0..ROUNDS {
        let mut machine =
            Machine::new(&program, &lowered, Settings { settled_after: 0, ..never_recompiling() })?;
        before.push(machine.run(scans));
        machine.define(number, ELSEWHERE);
        moved.push(machine.run(scans));
        compile_ms.push(machine.begin_tick());
        recompiled.push(machine.run(scans));
        let changes = machine.engine.replacements();
        let mut machine =
            Machine::new(&program, &lowered, Settings { patience: 2, ..never_recompiling() })?;
        for address in [ELSEWHERE + 1, ELSEWHERE] {
            machine.define(number, address);
            machine.begin_tick();
        }
        left.push(machine.run(scans));
        if (changes, machine.engine.replacements()) != (1, 1) {
            return Err("the code was not recompiled once".into());
        }
    }
    agree(&program, &lowered, number)?;
    let [before, moved, recompiled, left, compile_ms] =
        [before, moved, recompiled, left, compile_ms].map(median);
    Ok(Times { before, moved, recompiled, left, compile_ms })
}

/// Settings with which nothing is ever recompiled or left to the host.
fn never_recompiling() -> Settings {
    Settings { settled_after: u32::MAX, patience: u32::MAX, ..Settings::default() }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

/// Defines an M-variable as bit 3 of the Y word at an address.
fn define(executive: &mut PmacExecutive, number: u32, address: u32) {
    let field = Field { offset: 3, width: 1, format: Format::U };
    let code = Definition::word(Space::Y, address, field).encode();
    Definitions::new(executive.parts().0, &LAYOUT).set_code(number, code);
}

/// Runs scans, beginning with zero in all variables and with the definitions as they are. Gives
/// nanoseconds a scan.
fn run(engine: &mut dyn Engine, executive: &mut PmacExecutive, scans: usize) -> f64 {
    let inputs: Vec<u32> = (0..INPUT_WORDS).map(word).collect();
    let (image, host) = executive.parts();
    for (start, end) in [(LAYOUT.p, LAYOUT.i), (LAYOUT.words, LAYOUT.differing_definitions)] {
        image.iter_mut().take(end as usize).skip(start as usize).for_each(|byte| *byte = 0);
    }
    let patterns = patterns();
    let start = Instant::now();
    for n in 0..scans {
        let pattern = patterns[n % patterns.len()];
        for (k, &input) in inputs.iter().enumerate() {
            write_u32(image, input, (pattern >> (k * 16) & 0xFFFF) as u32);
        }
        engine.call(0, None, &mut Scan::new(image, host));
    }
    start.elapsed().as_secs_f64() * 1e9 / scans as f64
}

/// The offset of an input word in the image.
fn word(k: u32) -> u32 {
    match LAYOUT.place(Space::Y, BITS + k) {
        Place::Word(offset) => offset,
        _ => 0,
    }
}

struct Machine {
    engine: Recompiling,
    executive: PmacExecutive,
}

impl Machine {
    fn new(
        program: &Program,
        lowered: &Optimized,
        settings: Settings,
    ) -> Result<Self, Box<dyn Error>> {
        let (native, _) = jit(lowered)?;
        let assumed: &[Assumption] = program.assumptions();
        let compiler = Box::new(PmacRecompiler::new(Box::new(program.clone()), OptLevel::Speed));
        let engine = Recompiling::new(native, assumed, Controller::Pmac, compiler, settings);
        let executive = PmacExecutive::new(&lowered.program, PmacOptions::default());
        Ok(Self { engine, executive: executive.ok_or("no PMAC")? })
    }

    fn run(&mut self, scans: usize) -> f64 {
        run(&mut self.engine, &mut self.executive, scans)
    }

    fn define(&mut self, number: u32, address: u32) {
        define(&mut self.executive, number, address);
    }

    /// Lets the engine recompile, as at the beginning of a tick. Gives the milliseconds that it takes.
    fn begin_tick(&mut self) -> f64 {
        let start = Instant::now();
        self.engine.begin_tick(self.executive.parts().0);
        start.elapsed().as_secs_f64() * 1e3
    }
}

/// Checks that recompiled code and the interpreter come to the same state.
fn agree(program: &Program, lowered: &Optimized, number: u32) -> Result<(), Box<dyn Error>> {
    let mut machine =
        Machine::new(program, lowered, Settings { settled_after: 0, ..never_recompiling() })?;
    let mut oracle = Machine::new(program, lowered, never_recompiling())?.executive;
    let mut interpreter = program.interpreter();
    for address in [ELSEWHERE, ELSEWHERE + 1] {
        machine.define(number, address);
        define(&mut oracle, number, address);
        machine.begin_tick();
        machine.run(64);
        run(&mut *interpreter, &mut oracle, 64);
        let (ours, theirs) = (machine.executive.parts().0, oracle.parts().0);
        let state =
            [(0, LAYOUT.reference_definitions), (LAYOUT.thumbwheels, LAYOUT.differing_definitions)];
        let same = |(start, end): (u32, u32)| {
            let stretch = start as usize..end as usize;
            ours.get(stretch.clone()) == theirs.get(stretch)
        };
        if !state.into_iter().all(same) {
            return Err("recompiled code and the interpreter end in different states".into());
        }
    }
    Ok(())
}
