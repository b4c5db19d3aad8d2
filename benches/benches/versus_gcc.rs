//! Measures boolean equations in PMI, in the statement interpreter and as native code, and the same
//! equations in C, compiled by gcc -O2.
//!
//! The programs take turns in short rounds within one run, so that a machine that gets slower or faster
//! for a while does so for all of them. The relays' final states must be the same in all three.
//! `cargo bench -p plcc-benches --bench versus_gcc` runs it; `-- 200 2000 20000` behind it gives other
//! numbers of equations.
#![allow(clippy::indexing_slicing)]

use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

use plcc_abi::engine::NoHost;
use plcc_abi::pmi::{PmiTables, Role};
use plcc_abi::{Engine, Scan, Tables};
use plcc_benches::compiled;
use plcc_benches::equations::{Equations, patterns};
use plcc_benches::least;

/// Each time is the least of so many rounds.
const ROUNDS: usize = 9;

fn main() -> Result<(), Box<dyn Error>> {
    let mut sizes: Vec<usize> = std::env::args().filter_map(|arg| arg.parse().ok()).collect();
    if sizes.is_empty() {
        sizes = vec![200, 2000];
    }
    println!(
        "{:>9} {:>12} {:>12} {:>12} {:>8} {:>8} {:>8} {:>11} {:>11} {:>6}",
        "equations",
        "gcc ns",
        "jit ns",
        "interp ns",
        "jit/gcc",
        "int/jit",
        "int/gcc",
        "gcc ms",
        "plcc ms",
        "times"
    );
    for size in sizes {
        measure(size)?;
    }
    Ok(())
}

fn measure(size: usize) -> Result<(), Box<dyn Error>> {
    let equations = Equations::new(size, 1);
    let folder = std::env::temp_dir().join(format!("plcc-bench-{}", std::process::id()));
    std::fs::create_dir_all(&folder)?;
    let (program, gcc_time) = compile_c(&folder, &equations)?;
    let source = equations.pmi();
    let mut best: Option<compiled::Compiled> = None;
    for _ in 0..3 {
        let next = compiled::pmi(&source)?;
        if best.as_ref().is_none_or(|best| next.times.total() < best.times.total()) {
            best = Some(next);
        }
    }
    let mut compiled = best.ok_or("nothing was compiled")?;
    let scans = (40_000_000 / size).max(64);
    let few = (scans / 40).max(64);
    let Tables::Pmi(tables) = compiled.program.tables.clone() else { return Err("no PMI".into()) };
    let mut runs = Runs { gcc: vec![], jit: vec![], interp: vec![] };
    let mut images = [vec![0; compiled.program.image_size as usize], vec![]];
    images[1] = images[0].clone();
    for _ in 0..ROUNDS {
        let (ns, state) = run_c(&program, scans)?;
        runs.gcc.push(ns);
        images[0].fill(0);
        runs.jit.push(run(&mut compiled.native, &tables, &mut images[0], scans));
        if relays(&tables, &images[0], size) != state {
            return Err("native code and C end in different states".into());
        }
        images[0].fill(0);
        images[1].fill(0);
        run(&mut compiled.native, &tables, &mut images[0], few);
        runs.interp.push(run(&mut *compiled.interpreter, &tables, &mut images[1], few));
        if images[0] != images[1] {
            return Err("native code and the interpreter end in different states".into());
        }
    }
    let (gcc, jit, interp) = (least(runs.gcc), least(runs.jit), least(runs.interp));
    let plcc = compiled.times.total();
    println!(
        "{size:>9} {gcc:>12.1} {jit:>12.1} {interp:>12.1} {:>8.2} {:>8.1} {:>8.1} {:>11.1} {:>11.1} {:>6.0}",
        jit / gcc,
        interp / jit,
        interp / gcc,
        gcc_time.as_secs_f64() * 1e3,
        plcc.as_secs_f64() * 1e3,
        gcc_time.as_secs_f64() / plcc.as_secs_f64(),
    );
    println!("          {:?}, {} bytes of code", compiled.times, compiled.code_bytes);
    std::fs::remove_dir_all(&folder)?;
    Ok(())
}

struct Runs {
    gcc: Vec<f64>,
    jit: Vec<f64>,
    interp: Vec<f64>,
}

fn compile_c(folder: &Path, equations: &Equations) -> Result<(PathBuf, Duration), Box<dyn Error>> {
    let (scan, whole, program) =
        (folder.join("scan.c"), folder.join("program.c"), folder.join("program"));
    std::fs::write(&scan, equations.c())?;
    std::fs::write(&whole, equations.c_program())?;
    let gcc = |args: &[&Path]| -> Result<(), Box<dyn Error>> {
        let status = Command::new("gcc").arg("-O2").args(args).status()?;
        if status.success() { Ok(()) } else { Err("gcc failed".into()) }
    };
    let start = Instant::now();
    gcc(&[Path::new("-c"), Path::new("-o"), &folder.join("scan.o"), &scan])?;
    let time = start.elapsed();
    gcc(&[Path::new("-o"), &program, &whole])?;
    Ok((program, time))
}

/// Runs the C program. Gives nanoseconds a scan and the relays' final states.
fn run_c(program: &Path, scans: usize) -> Result<(f64, String), Box<dyn Error>> {
    let output = Command::new(program).arg(scans.to_string()).output()?;
    let text = String::from_utf8(output.stdout)?;
    let (ns, state) = text.trim().split_once('\n').ok_or("the C program printed too little")?;
    Ok((ns.parse()?, state.to_owned()))
}

fn run(engine: &mut dyn Engine, tables: &PmiTables, image: &mut [u8], scans: usize) -> f64 {
    let patterns = patterns();
    let mut inputs: Vec<(usize, usize)> = tables
        .symbols
        .iter()
        .filter(|symbol| matches!(symbol.role, Role::Input(_)))
        .filter_map(|symbol| Some((symbol.name.get(1..)?.parse().ok()?, symbol.offset as usize)))
        .collect();
    inputs.sort_unstable();
    // The inputs are adjacent in the image, so setting them all is one copy, as in C.
    let first = inputs.first().map_or(0, |&(_, offset)| offset);
    let together = inputs.iter().all(|&(number, offset)| offset == first + number);
    let mut host = NoHost;
    let start = Instant::now();
    for n in 0..scans {
        let pattern = &patterns[n % patterns.len()];
        if together {
            image[first..first + pattern.len()].copy_from_slice(pattern);
        } else {
            for &(number, offset) in &inputs {
                image[offset] = pattern[number];
            }
        }
        engine.call(0, None, &mut Scan { image, host: &mut host });
    }
    start.elapsed().as_secs_f64() * 1e9 / scans as f64
}

fn relays(tables: &PmiTables, image: &[u8], size: usize) -> String {
    let mut state = vec!['?'; size];
    for symbol in &tables.symbols {
        let number = symbol.name.strip_prefix('R').and_then(|digits| digits.parse::<usize>().ok());
        if let Some(slot) = number.and_then(|number| state.get_mut(number)) {
            *slot = if image[symbol.offset as usize] == 0 { '0' } else { '1' };
        }
    }
    state.into_iter().collect()
}
