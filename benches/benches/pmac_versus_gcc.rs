//! Measures PMAC statements, in the statement interpreter and as native code, and the same statements
//! in C, compiled by gcc -O2: logic on L-variables in a PLCC, the same logic on M- and P-variables, and
//! floating point.
//!
//! The programs take turns in short rounds within one run, so that a machine that gets slower or faster
//! for a while does so for all of them. The final states must be the same.
//! `cargo bench -p plcc-benches --bench pmac_versus_gcc` runs it; `-- 200 2000` behind it gives other
//! numbers of statements. It fails when native code is slower than the project allows.
#![allow(clippy::indexing_slicing)]

use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use plcc_abi::image::{read_f64, read_u32, write_f64, write_u32};
use plcc_abi::pmac::{Controller, Layout, Place, Space};
use plcc_abi::{Engine, Scan};
use plcc_benches::compiled::{self, Compiled};
use plcc_benches::least;
use plcc_benches::pmac::{BITS, Form, INPUT_P, INPUT_WORDS, Kernel, WORD_COUNT, patterns};
use plcc_runtime::pmac::{PmacExecutive, PmacOptions};

const ROUNDS: usize = 25;

fn main() -> Result<(), Box<dyn Error>> {
    let mut sizes: Vec<usize> = std::env::args().filter_map(|arg| arg.parse().ok()).collect();
    if sizes.is_empty() {
        sizes = vec![200, 2000];
    }
    println!(
        "{:>8} {:>10} {:>11} {:>11} {:>12} {:>8} {:>8} {:>8}",
        "form", "statements", "gcc ns", "jit ns", "interp ns", "jit/gcc", "int/jit", "int/gcc"
    );
    let mut broken = vec![];
    for size in sizes {
        let long = measure(Form::Long, size)?;
        let memory = measure(Form::Memory, size)?;
        let float = measure(Form::Float, size)?;
        // Both are compared with the same C function, so that changes of the machine's speed between
        // their measurements cancel out.
        let speed = (long.jit / long.gcc) / (memory.jit / memory.gcc);
        println!("{:>8} speed of M and P over that of L: {speed:.2}", "");
        let mut bound = |what: &str, kept: bool| {
            if !kept {
                broken.push(format!("{size} statements: {what}"));
            }
        };
        bound("L-variables: 20 times faster compiled", long.interp / long.jit >= 20.0);
        bound("floating point: 10 times faster compiled", float.interp / float.jit >= 10.0);
        bound("M and P: 0.8 of the speed of L", speed >= 0.8);
        bound("floating point: no slower than C", float.jit <= float.gcc);
        for (form, times) in [("L", &long), ("M and P", &memory), ("float", &float)] {
            bound(
                &format!("{form}: interpreter within 60 times gcc"),
                times.interp <= 60.0 * times.gcc,
            );
        }
    }
    if broken.is_empty() { Ok(()) } else { Err(broken.join("; ").into()) }
}

/// The least times of all rounds, in nanoseconds a scan.
struct Times {
    gcc: f64,
    jit: f64,
    interp: f64,
}

fn measure(form: Form, size: usize) -> Result<Times, Box<dyn Error>> {
    let kernel = Kernel::new(form, size, 11);
    let folder = std::env::temp_dir().join(format!("plcc-pmac-{}", std::process::id()));
    std::fs::create_dir_all(&folder)?;
    let program = compile_c(&folder, &kernel.c_program(form))?;
    let mut compiled = compiled::pmac(&kernel.pmac)?;
    let scans = (20_000_000 / size).max(64);
    let few = (scans / 20).max(64);
    let mut executive =
        PmacExecutive::new(&compiled.program, PmacOptions::default()).ok_or("no PMAC")?;
    let start = executive.parts().0.to_vec();
    let (mut gcc, mut jit, mut interp) = (vec![], vec![], vec![]);
    for _ in 0..ROUNDS {
        let (ns, expected) = run_c(&program, scans)?;
        gcc.push(ns);
        executive.parts().0.copy_from_slice(&start);
        jit.push(run(&mut compiled.native, &mut executive, form, scans));
        let found = state(executive.parts().0, form);
        if let Some(at) = found.iter().zip(&expected).position(|(a, b)| a != b) {
            let (ours, theirs) = (found.get(at), expected.get(at));
            return Err(format!("{form:?}: value {at} is {ours:?}, in C {theirs:?}").into());
        }
        executive.parts().0.copy_from_slice(&start);
        run(&mut compiled.native, &mut executive, form, few);
        let native = executive.parts().0.to_vec();
        executive.parts().0.copy_from_slice(&start);
        interp.push(run(&mut *compiled.interpreter, &mut executive, form, few));
        if native != executive.parts().0 {
            return Err("native code and the interpreter end in different states".into());
        }
    }
    let times = Times { gcc: least(gcc), jit: least(jit), interp: least(interp) };
    println!(
        "{:>8} {size:>10} {:>11.1} {:>11.1} {:>12.1} {:>8.2} {:>8.1} {:>8.1}",
        format!("{form:?}"),
        times.gcc,
        times.jit,
        times.interp,
        times.jit / times.gcc,
        times.interp / times.jit,
        times.interp / times.gcc,
    );
    report(&compiled);
    std::fs::remove_dir_all(&folder)?;
    Ok(times)
}

fn report(compiled: &Compiled) {
    println!("         {:?}, {} bytes of code", compiled.times, compiled.code_bytes);
}

fn compile_c(folder: &Path, text: &str) -> Result<PathBuf, Box<dyn Error>> {
    let (source, program) = (folder.join("program.c"), folder.join("program"));
    std::fs::write(&source, text)?;
    let mut gcc = Command::new("gcc");
    let status = gcc.arg("-O2").arg("-o").arg(&program).arg(&source).arg("-lm").status()?;
    if status.success() { Ok(program) } else { Err("gcc failed".into()) }
}

/// Runs a C program. Gives nanoseconds a scan and the final state.
fn run_c(program: &Path, scans: usize) -> Result<(f64, Vec<u64>), Box<dyn Error>> {
    let output = Command::new(program).arg(scans.to_string()).output()?;
    let text = String::from_utf8(output.stdout)?;
    let (ns, state) = text.trim().split_once('\n').ok_or("the C program printed too little")?;
    let state = state.split_whitespace().map(number).collect::<Option<_>>();
    Ok((ns.parse()?, state.ok_or("the C program printed no numbers")?))
}

/// The bits of a double that C printed with `%a`, or those of an integer's double.
fn number(text: &str) -> Option<u64> {
    let (negative, text) = text.strip_prefix('-').map_or((false, text), |rest| (true, rest));
    let Some(hex) = text.strip_prefix("0x") else {
        let value: f64 = text.parse().ok()?;
        return Some((if negative { -value } else { value }).to_bits());
    };
    let (digits, exponent) = hex.split_once('p')?;
    let (whole, fraction) = digits.split_once('.').unwrap_or((digits, ""));
    let mantissa = u64::from_str_radix(&format!("{whole}{fraction}"), 16).ok()?;
    let exponent: i32 = exponent.parse().ok()?;
    let value = mantissa as f64 * 2f64.powi(exponent - 4 * fraction.len() as i32);
    Some((if negative { -value } else { value }).to_bits())
}

fn offset(layout: &Layout, space: Space, address: u32) -> u32 {
    match layout.place(space, address) {
        Place::Word(offset) => offset,
        _ => 0,
    }
}

fn run(engine: &mut dyn Engine, executive: &mut PmacExecutive, form: Form, scans: usize) -> f64 {
    let layout = Layout::new(Controller::Pmac);
    let patterns = patterns();
    let words: Vec<u32> = (0..INPUT_WORDS).map(|k| offset(&layout, Space::Y, BITS + k)).collect();
    let (image, host) = executive.parts();
    let start = Instant::now();
    for n in 0..scans {
        let x = patterns[n % patterns.len()];
        if form == Form::Float {
            for i in 0..INPUT_P {
                let value = (x >> (i * 8) & 255) as f64 - 100.0;
                write_f64(image, layout.p_offset(i as u32), value);
            }
        } else {
            for (i, &word) in words.iter().enumerate() {
                write_u32(image, word, (x >> (i * 16) & 0xFFFF) as u32);
            }
        }
        engine.call(0, None, &mut Scan { image, host });
    }
    start.elapsed().as_secs_f64() * 1e9 / scans as f64
}

fn state(image: &[u8], form: Form) -> Vec<u64> {
    let layout = Layout::new(Controller::Pmac);
    let p = |n| read_f64(image, layout.p_offset(n)).to_bits();
    let word = |space, address| {
        let word = read_u32(image, offset(&layout, space, address));
        f64::from((word << 8) as i32 >> 8).to_bits()
    };
    if form == Form::Float {
        return (0..64).map(p).collect();
    }
    let bits = (0..6).map(|k| word(Space::Y, BITS + k));
    let numbers = (0..32).map(|k| match form {
        Form::Memory if k >= WORD_COUNT as u32 => p(k),
        _ => word(Space::X, 0x07D0 + k),
    });
    bits.chain(numbers).collect()
}
