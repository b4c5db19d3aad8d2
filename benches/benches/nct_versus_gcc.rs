//! Measures conditions in NCT's language, in the statement interpreter and as native code, and the
//! same conditions in C, compiled by gcc -O2: once with eight bits to a byte, once with a byte a bit.
//!
//! The programs take turns in short rounds within one run, so that a machine that gets slower or faster
//! for a while does so for all of them. The outputs' final states must be the same in all.
//! `cargo bench -p plcc-benches --bench nct_versus_gcc` runs it; `-- 200 2000` behind it gives other
//! numbers of conditions.
#![allow(clippy::indexing_slicing)]

use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use plcc_abi::engine::NoHost;
use plcc_abi::nct::NctTables;
use plcc_abi::{Engine, Scan, Tables};
use plcc_benches::compiled::{self, Compiled};
use plcc_benches::conditions::{BITS, Conditions, FIRST_FLAG, Layout, patterns};
use plcc_benches::least;

/// Each time is the least of so many rounds.
const ROUNDS: usize = 9;
/// The task that is `:001`.
const MODULE: usize = 1;

fn main() -> Result<(), Box<dyn Error>> {
    let mut sizes: Vec<usize> = std::env::args().filter_map(|arg| arg.parse().ok()).collect();
    if sizes.is_empty() {
        sizes = vec![800, 2000];
    }
    println!(
        "{:>10} {:>7} {:>11} {:>11} {:>11} {:>11} {:>8} {:>8} {:>8}",
        "conditions",
        "targets",
        "bytes ns",
        "packed ns",
        "jit ns",
        "interp ns",
        "jit/gcc",
        "int/jit",
        "int/gcc"
    );
    for size in sizes {
        conditions(size, false)?;
        conditions(size, true)?;
    }
    Ok(())
}

/// Measures `size` conditions. With `again`, several conditions switch the same bit.
fn conditions(size: usize, again: bool) -> Result<(), Box<dyn Error>> {
    let conditions = Conditions::new(size, 1, again);
    let folder = std::env::temp_dir().join(format!("plcc-bench-nct-{}", std::process::id()));
    std::fs::create_dir_all(&folder)?;
    let programs = [Layout::Bytes, Layout::Packed]
        .map(|layout| compile_c(&folder, &format!("{layout:?}"), &conditions.c(layout)));
    let [bytes, packed] = programs;
    let programs = [bytes?, packed?];
    let mut compiled = compiled::nct(&conditions.nct())?;
    let scans = (40_000_000 / size).max(64);
    let few = (scans / 40).max(64);
    let mut times: [Vec<f64>; 4] = Default::default();
    for _ in 0..ROUNDS {
        let mut states = vec![];
        for (program, times) in programs.iter().zip(&mut times) {
            let (ns, state) = run_c(program, scans)?;
            times.push(ns);
            states.push(state);
        }
        let (ns, state) = run(&mut compiled, true, conditions.states(), scans)?;
        times[2].push(ns);
        states.push(state);
        if states.iter().any(|state| *state != states[0]) {
            return Err("native code and C end in different states".into());
        }
        let (_, wanted) = run(&mut compiled, true, conditions.states(), few)?;
        let (ns, state) = run(&mut compiled, false, conditions.states(), few)?;
        times[3].push(ns);
        if state != wanted {
            return Err("native code and the interpreter end in different states".into());
        }
    }
    let [bytes, packed, jit, interp] = times.map(least);
    let gcc = bytes.min(packed);
    println!(
        "{size:>10} {:>7} {bytes:>11.1} {packed:>11.1} {jit:>11.1} {interp:>11.1} {:>8.2} {:>8.1} {:>8.1}",
        if again { "any" } else { "own" },
        jit / gcc,
        interp / jit,
        interp / gcc
    );
    println!("           {:?}, {} bytes of code", compiled.times, compiled.code_bytes);
    std::fs::remove_dir_all(&folder)?;
    Ok(())
}

fn compile_c(folder: &Path, name: &str, text: &str) -> Result<PathBuf, Box<dyn Error>> {
    let (source, program) = (folder.join(format!("{name}.c")), folder.join(name));
    std::fs::write(&source, text)?;
    let status = Command::new("gcc").arg("-O2").arg("-o").args([&program, &source]).status()?;
    if status.success() { Ok(program) } else { Err("gcc failed".into()) }
}

/// Runs a C program. Gives nanoseconds a scan and the outputs' final states.
fn run_c(program: &Path, scans: usize) -> Result<(f64, String), Box<dyn Error>> {
    let output = Command::new(program).arg(scans.to_string()).output()?;
    let text = String::from_utf8(output.stdout)?;
    let (ns, state) = text.trim().split_once('\n').ok_or("the C program printed too little")?;
    Ok((ns.parse()?, state.to_owned()))
}

fn run(
    compiled: &mut Compiled,
    native: bool,
    states: usize,
    scans: usize,
) -> Result<(f64, String), String> {
    let Tables::Nct(tables) = &compiled.program.tables else { return Err("no NCT".into()) };
    let first = together(tables).ok_or("the inputs don't lie together")?;
    let mut image = vec![0; compiled.program.image_size as usize];
    for home in &tables.outputs {
        (0..8).for_each(|bit| home.set_bit(&mut image, bit, true));
    }
    let patterns = patterns();
    let engine: &mut dyn Engine =
        if native { &mut compiled.native } else { &mut *compiled.interpreter };
    let mut host = NoHost;
    let start = Instant::now();
    for n in 0..scans {
        image[first..first + BITS].copy_from_slice(&patterns[n % patterns.len()]);
        engine.call(MODULE, None, &mut Scan { image: &mut image, host: &mut host });
    }
    let ns = start.elapsed().as_secs_f64() * 1e9 / scans as f64;
    let bit = |n: usize| {
        let home = match n.checked_sub(BITS) {
            None => tables.outputs[n / 8],
            Some(flag) => tables.flags[FIRST_FLAG + flag / 8],
        };
        home.bit(&image, n as u8 % 8)
    };
    Ok((ns, (0..states).map(|n| if bit(n) { '1' } else { '0' }).collect()))
}

/// The offset of the inputs' bits, if they are adjacent in the image; then setting them all is one copy,
/// as in C.
fn together(tables: &NctTables) -> Option<usize> {
    let first = tables.inputs.first()?.offset;
    let at = |(n, home): (usize, &plcc_abi::nct::FlagLocation)| {
        home.unpacked && home.offset == first + 8 * n as u32
    };
    tables.inputs.iter().enumerate().all(at).then_some(first as usize)
}
