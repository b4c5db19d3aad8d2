//! What it costs that a PMAC program moves a definition of an M-variable: logic in M- and
//! P-variables before, after, with code made anew for where the definition is, and with the
//! variable left to the host because it never rests.
//!
//! `cargo bench --bench pmac_moved`, with `-- 200 2000` for other numbers of statements. It fails
//! where code made anew has less than 0.8 of the speed from before, or ends in another state than
//! the interpreter.
#![allow(clippy::indexing_slicing)]

use std::error::Error;
use std::time::Instant;

use plcc::compile::jit;
use plcc::recompile::PmacRecompiler;
use plcc_abi::image::write_u32;
use plcc_abi::pmac::{
    Assumption, Controller, Definition, Definitions, Field, Format, Layout, Place, Space,
};
use plcc_abi::{Engine, Scan};
use plcc_benches::pmac::{BITS, Form, INPUT_WORDS, Kernel, patterns};
use plcc_codegen::OptLevel;
use plcc_diag::SourceMap;
use plcc_frontend::common::{Lowered, MemoryLoader, Options};
use plcc_frontend::pmac::{self, Program};
use plcc_runtime::pmac::{PmacExecutive, PmacOptions, Recompiling, Settings};

const ROUNDS: usize = 9;
const LAYOUT: Layout = Layout::new(Controller::Pmac);
/// What the kernel does not use.
const ELSEWHERE: u32 = 0x07F8;

fn main() -> Result<(), Box<dyn Error>> {
    let mut sizes: Vec<usize> = std::env::args().filter_map(|arg| arg.parse().ok()).collect();
    if sizes.is_empty() {
        sizes = vec![200, 2000];
    }
    println!(
        "{:>10} {:>10} {:>10} {:>10} {:>14} {:>8}   ns a scan",
        "statements", "before", "moved", "made anew", "left to host", "made ms"
    );
    let mut broken = vec![];
    for size in sizes {
        let Times { before, moved, anew, left, made } = measure(size)?;
        println!("{size:>10} {before:>10.1} {moved:>10.1} {anew:>10.1} {left:>14.1} {made:>8.2}");
        if before / anew < 0.8 {
            broken.push(format!("{size} statements: code made anew is slower"));
        }
    }
    if broken.is_empty() { Ok(()) } else { Err(broken.join("; ").into()) }
}

/// Medians of nanoseconds a scan, and of the milliseconds that it took to make code anew.
struct Times {
    before: f64,
    moved: f64,
    anew: f64,
    left: f64,
    made: f64,
}

fn measure(size: usize) -> Result<Times, Box<dyn Error>> {
    let kernel = Kernel::new(Form::Memory, size, 11);
    let mut sources = SourceMap::new();
    let file = sources.add("moved.pmc", kernel.pmac.as_bytes());
    let (program, _) =
        pmac::check(&mut sources, &[file], &MemoryLoader::new(), &Options::default());
    let program = program.ok_or("the kernel has errors")?;
    let mut lowered = program.lower()?;
    plcc_ir::passes::optimize(&mut lowered.module, OptLevel::Speed);
    let number = program.assumed().first().ok_or("the kernel names no M-variable")?.number;
    let scans = (5_000_000 / size).max(64);
    let [mut before, mut moved, mut anew, mut left, mut made] = [(); 5].map(|()| vec![]);
    for _ in 0..ROUNDS {
        let mut machine = Machine::new(&program, &lowered, Settings { rest: 0, ..slow() })?;
        before.push(machine.run(scans));
        machine.define(number, ELSEWHERE);
        moved.push(machine.run(scans));
        made.push(machine.begin_tick());
        anew.push(machine.run(scans));
        let changes = machine.engine.changes();
        let mut machine = Machine::new(&program, &lowered, Settings { patience: 2, ..slow() })?;
        for address in [ELSEWHERE + 1, ELSEWHERE] {
            machine.define(number, address);
            machine.begin_tick();
        }
        left.push(machine.run(scans));
        if (changes, machine.engine.changes()) != (1, 1) {
            return Err("code was not made anew".into());
        }
    }
    agree(&program, &lowered, number)?;
    let [before, moved, anew, left, made] = [before, moved, anew, left, made].map(median);
    Ok(Times { before, moved, anew, left, made })
}

/// Settings that make nothing anew.
fn slow() -> Settings {
    Settings { rest: u32::MAX, patience: u32::MAX, ..Settings::default() }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

/// Moves an M-variable to a bit of a word.
fn define(executive: &mut PmacExecutive, number: u32, address: u32) {
    let field = Field { offset: 3, width: 1, format: Format::U };
    let code = Definition::word(Space::Y, address, field).encode();
    Definitions::new(executive.parts().0, &LAYOUT).set_code(number, code);
}

/// Nanoseconds a scan, from the state after load but for the definitions.
fn run(engine: &mut dyn Engine, executive: &mut PmacExecutive, scans: usize) -> f64 {
    let inputs: Vec<u32> = (0..INPUT_WORDS).map(word).collect();
    let (image, host) = executive.parts();
    for (start, end) in [(LAYOUT.p, LAYOUT.i), (LAYOUT.words, LAYOUT.moved)] {
        image.iter_mut().take(end as usize).skip(start as usize).for_each(|byte| *byte = 0);
    }
    let patterns = patterns();
    let start = Instant::now();
    for n in 0..scans {
        let pattern = patterns[n % patterns.len()];
        for (k, &input) in inputs.iter().enumerate() {
            write_u32(image, input, (pattern >> (k * 16) & 0xFFFF) as u32);
        }
        engine.call(0, None, &mut Scan { image, host });
    }
    start.elapsed().as_secs_f64() * 1e9 / scans as f64
}

/// The offset of an input.
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
        lowered: &Lowered,
        settings: Settings,
    ) -> Result<Self, Box<dyn Error>> {
        let (native, _) = jit(lowered)?;
        let assumed: &[Assumption] = program.assumed();
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

    /// Milliseconds that it takes.
    fn begin_tick(&mut self) -> f64 {
        let start = Instant::now();
        self.engine.begin_tick(self.executive.parts().0);
        start.elapsed().as_secs_f64() * 1e3
    }
}

/// Sees that code made anew and the interpreter come to the same state.
fn agree(program: &Program, lowered: &Lowered, number: u32) -> Result<(), Box<dyn Error>> {
    let mut machine = Machine::new(program, lowered, Settings { rest: 0, ..slow() })?;
    let mut oracle = Machine::new(program, lowered, slow())?.executive;
    let mut interpreter = program.interpreter();
    for address in [ELSEWHERE, ELSEWHERE + 1] {
        machine.define(number, address);
        define(&mut oracle, number, address);
        machine.begin_tick();
        machine.run(64);
        run(&mut *interpreter, &mut oracle, 64);
        let (ours, theirs) = (machine.executive.parts().0, oracle.parts().0);
        let state = [(0, LAYOUT.mload), (LAYOUT.tw, LAYOUT.moved)];
        let same = |(start, end): (u32, u32)| {
            let stretch = start as usize..end as usize;
            ours.get(stretch.clone()) == theirs.get(stretch)
        };
        if !state.into_iter().all(same) {
            return Err("code made anew and the interpreter end in different states".into());
        }
    }
    Ok(())
}
