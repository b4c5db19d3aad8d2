//! Measures what it costs when a PMAC program changes ("moves") the definition of an M-variable. Logic
//! on M- and P-variables is run in code that was specialised for the first definition; in the same code
//! after the change, through its general path; and with the variable left to the host because the text
//! shows that its definition changes.
//!
//! `cargo bench -p plcc-benches --bench pmac_moved` runs it; `-- 200 2000` after it gives other numbers
//! of statements. It fails when code and the interpreter end in different states.
#![allow(clippy::indexing_slicing)]

use std::error::Error;
use std::time::Instant;

use plcc::compile::{Optimized, jit};
use plcc_abi::image::write_u32;
use plcc_abi::pmac::{Controller, Definition, Definitions, Field, Format, Layout, Place, Space};
use plcc_abi::{Engine, Scan};
use plcc_benches::pmac::{BITS, INPUT_WORDS, download, patterns};
use plcc_codegen::OptLevel;
use plcc_diag::SourceMap;
use plcc_frontend::common::{MemoryLoader, Options};
use plcc_frontend::pmac::{self, Program};
use plcc_runtime::NativeEngine;
use plcc_runtime::pmac::{PmacExecutive, PmacOptions};

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
        "{:>10} {:>10} {:>10} {:>14}   ns a scan",
        "statements", "before", "moved", "left to host"
    );
    for size in sizes {
        let Times { before, moved, left } = measure(size)?;
        println!("{size:>10} {before:>10.1} {moved:>10.1} {left:>14.1}");
    }
    Ok(())
}

/// Medians of all rounds: nanoseconds a scan in each kind of code.
struct Times {
    before: f64,
    moved: f64,
    left: f64,
}

/// Checks and lowers a download.
fn compile(text: &str) -> Result<(Program, Optimized), Box<dyn Error>> {
    let mut sources = SourceMap::new();
    let file = sources.add("moved.pmc", text.as_bytes());
    let (program, _) =
        pmac::check(&mut sources, &[file], &MemoryLoader::new(), &Options::default());
    let program = program.ok_or("the kernel has errors")?;
    let (lowered, _) = Optimized::of(program.lower()?, OptLevel::Speed);
    Ok((program, lowered))
}

fn measure(size: usize) -> Result<Times, Box<dyn Error>> {
    let text = download(size, 11);
    let (program, lowered) = compile(&text)?;
    let number = program.assumptions().first().ok_or("the kernel names no M-variable")?.number;
    // The same with a PLC that does not run and that is seen to move the definition.
    let mover = format!("OPEN PLC 31 CLEAR\nCOMMAND\"M{number}->Y:$7F8,3,1\"\nCLOSE\n");
    let (_, seen) = compile(&(text + &mover))?;
    let scans = (5_000_000 / size).max(64);
    let [mut before, mut moved, mut left] = [(); 3].map(|()| vec![]);
    for _ in 0..ROUNDS {
        let mut machine = Machine::new(&lowered)?;
        before.push(machine.run(scans));
        machine.define(number, ELSEWHERE);
        moved.push(machine.run(scans));
        left.push(Machine::new(&seen)?.run(scans));
    }
    agree(&program, &lowered, number)?;
    let [before, moved, left] = [before, moved, left].map(median);
    Ok(Times { before, moved, left })
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
    engine: NativeEngine,
    executive: PmacExecutive,
}

impl Machine {
    fn new(lowered: &Optimized) -> Result<Self, Box<dyn Error>> {
        let (engine, _) = jit(lowered)?;
        let executive = PmacExecutive::new(&lowered.program, PmacOptions::default());
        Ok(Self { engine, executive: executive.ok_or("no PMAC")? })
    }

    fn run(&mut self, scans: usize) -> f64 {
        run(&mut self.engine, &mut self.executive, scans)
    }

    fn define(&mut self, number: u32, address: u32) {
        define(&mut self.executive, number, address);
    }
}

/// Checks that code and the interpreter come to the same state.
fn agree(program: &Program, lowered: &Optimized, number: u32) -> Result<(), Box<dyn Error>> {
    let mut machine = Machine::new(lowered)?;
    let mut oracle = Machine::new(lowered)?.executive;
    let mut interpreter = program.interpreter();
    for address in [ELSEWHERE, ELSEWHERE + 1] {
        machine.define(number, address);
        define(&mut oracle, number, address);
        machine.run(64);
        run(&mut *interpreter, &mut oracle, 64);
        if machine.executive.parts().0 != oracle.parts().0 {
            return Err("code and the interpreter end in different states".into());
        }
    }
    Ok(())
}
