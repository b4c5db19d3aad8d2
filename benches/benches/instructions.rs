//! Counts the instructions of a scan of fixed kernels, and of a tick of empty programs, and compares them
//! with `benches/instructions.txt`. Other than times they do not depend on what else the machine does, so
//! the file is reviewed as a snapshot is: a change of it says what a change of the compiler or of an
//! executive costs or brings.
//!
//! ```text
//! cargo bench -p plcc-benches --bench instructions [-- --only TEXT]
//! BLESS=1 cargo bench -p plcc-benches --bench instructions
//! cargo bench -p plcc-benches --bench instructions -- --leave-one-out [--only TEXT]
//! ```
//!
//! With `--leave-one-out` it counts the kernels once more without each pass and each technique of code generation, and
//! prints for each how many instructions and bytes there are then, as a ratio to those with everything (geometric
//! mean), and the kernels that it changes most. So it is seen what each is worth on these programs.
//!
//! Code is compiled ahead of time for x86-64-v2, whatever this machine has. valgrind counts the
//! instructions of a process that loads the artifact and runs it; two runs of different length differ by
//! those of the further scans. The call of the engine is part of a scan, so the counts also change
//! with the version of rustc, which stands in the first line. The exit status is 1 if a count has changed.

use std::error::Error;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use plcc::compile;
use plcc_abi::engine::NoHost;
use plcc_abi::{Engine, Scan};
use plcc_benches::compiled;
use plcc_benches::kernels::families;
use plcc_benches::kernels::subject::Subject;
use plcc_benches::motion;
use plcc_codegen::{Optimization, Target};
use plcc_control::ControlArgs;
use plcc_load::Artifact;
use plcc_runtime::Executive;
use plcc_runtime::NativeEngine;
use plcc_runtime::pmac::{PmacExecutive, PmacOptions};

/// The kernels are generated from this seed.
const SEED: u64 = 1;
/// Scans of the shorter and of the longer run.
const SCANS: [u64; 2] = [2_000, 12_000];
/// The argument by which the program runs itself to be counted.
const RUN: &str = "--run";
/// What is counted in the place of a task: ticks, and ticks with simulated motors.
const TICK: &str = "tick";
const MOTION: &str = "motion";
/// The argument that asks for the table of what each pass is worth.
const LEAVE_ONE_OUT: &str = "--leave-one-out";
/// Scans of the shorter and of the longer run for that table, which has many.
const FEWER_SCANS: [u64; 2] = [200, 1_200];

/// What is counted.
struct Counted {
    name: String,
    bytes: usize,
    instructions: u64,
}

fn main() -> Result<(), Box<dyn Error>> {
    // Cargo passes `--bench`.
    let args: Vec<String> = std::env::args().skip(1).filter(|arg| arg != "--bench").collect();
    let words: Vec<&str> = args.iter().map(String::as_str).collect();
    let (leave_one_out, only) = match *words.as_slice() {
        [RUN, folder, task, scans] => return run(Path::new(folder), task, scans.parse()?),
        [] => (false, ""),
        ["--only", text] => (false, text),
        [LEAVE_ONE_OUT] => (true, ""),
        [LEAVE_ONE_OUT, "--only", text] => (true, text),
        _ => return Err("the arguments are `--only TEXT` and `--leave-one-out`".into()),
    };
    if cfg!(not(target_arch = "x86_64")) {
        return Err("the counts are those of x86-64".into());
    }
    let folder = std::env::temp_dir().join(format!("plcc-instructions-{}", std::process::id()));
    std::fs::create_dir_all(&folder)?;
    if leave_one_out {
        let done = leave_out_each(only, &folder);
        std::fs::remove_dir_all(&folder)?;
        return done;
    }
    let counted = count_all(only, Optimization::ALL, SCANS, &folder);
    std::fs::remove_dir_all(&folder)?;
    let text = table(&counted?);
    print!("{text}");
    if only.is_empty() { compare(&text) } else { Ok(()) }
}

/// Prints what each pass and technique is worth.
fn leave_out_each(only: &str, folder: &Path) -> Result<(), Box<dyn Error>> {
    let all = count_all(only, Optimization::ALL, FEWER_SCANS, folder)?;
    println!("{:<20} {:>12} {:>6}  kernels that change most", "without", "instructions", "bytes");
    for name in Optimization::names() {
        let optimization = Optimization::ALL.with_changes(&format!("-{name}"))?;
        let without = count_all(only, optimization, FEWER_SCANS, folder)?;
        let mut kernels: Vec<(f64, &str)> = vec![];
        let (mut instructions, mut bytes) = (0.0, 0.0);
        for (with, without) in all.iter().zip(&without) {
            let ratio = without.instructions as f64 / with.instructions as f64;
            instructions += ratio.ln();
            bytes += (without.bytes.max(1) as f64 / with.bytes.max(1) as f64).ln();
            if (ratio.ln()).abs() > 0.005 {
                kernels.push((ratio, &with.name));
            }
        }
        kernels.sort_by(|a, b| b.0.ln().abs().total_cmp(&a.0.ln().abs()));
        let kernels: Vec<_> =
            kernels.iter().take(4).map(|(ratio, name)| format!("{name} {ratio:.2}")).collect();
        let mean = |sum: f64| (sum / all.len() as f64).exp();
        println!(
            "{name:<20} {:>12.3} {:>6.3}  {}",
            mean(instructions),
            mean(bytes),
            kernels.join(", ")
        );
    }
    Ok(())
}

fn count_all(
    only: &str,
    optimization: Optimization,
    scans: [u64; 2],
    folder: &Path,
) -> Result<Vec<Counted>, Box<dyn Error>> {
    let mut all = vec![];
    for (name, source) in [
        ("pmi", "$END\n"),
        ("nct", ":000\nJ0\n:001\nJ1\n"),
        ("pmac", "I5=3\n"),
        ("pmac with a PLC", "OPEN PLC 1 CLEAR\nP1=1\nCLOSE\nI5=3\nENABLE PLC 1\n"),
    ] {
        let full_name = format!("tick of empty {name}");
        if full_name.contains(only) {
            let made = match name {
                "pmi" => compiled::pmi(source, optimization),
                "nct" => compiled::nct(source, optimization),
                _ => compiled::pmac(source, optimization),
            }?;
            all.push(count(full_name, &made, Work::Tick, scans, folder)?);
        }
    }
    for (name, source) in motion::downloads() {
        let name = format!("tick of {name}");
        if name.contains(only) {
            let made = compiled::pmac(&source, optimization)?;
            all.push(count(name, &made, Work::Motion, scans, folder)?);
        }
    }
    for kernel in families::all(SEED, 100) {
        let name = format!("{} {}", kernel.language.group(), kernel.name);
        if name.contains(only) {
            let subject = Subject::new(&kernel, SEED, optimization)?;
            let (task, image) = subject.start_with_inputs();
            all.push(count(name, &subject.compiled, Work::Scan(task, image), scans, folder)?);
        }
    }
    Ok(all)
}

/// What instructions are counted of.
enum Work {
    /// A tick.
    Tick,
    /// A tick with simulated motors.
    Motion,
    /// A scan of a task that begins with an image.
    Scan(usize, Vec<u8>),
}

/// Counts the instructions of a piece of work.
fn count(
    name: String,
    made: &compiled::Compiled,
    work: Work,
    [short, long]: [u64; 2],
    folder: &Path,
) -> Result<Counted, Box<dyn Error>> {
    let code = plcc_codegen::compile(&made.module, &Target::host_baseline()?, made.codegen)?;
    std::fs::write(artifact_in(folder), compile::artifact(&made.program, &code)?)?;
    let (task, image) = match work {
        Work::Tick => (TICK.into(), vec![]),
        Work::Motion => (MOTION.into(), vec![]),
        Work::Scan(task, image) => (task.to_string(), image),
    };
    std::fs::write(image_in(folder), image)?;
    let more = executed(folder, &task, long)?.saturating_sub(executed(folder, &task, short)?);
    let instructions = (more + (long - short) / 2) / (long - short);
    Ok(Counted { name, bytes: code.bytes.len(), instructions })
}

fn artifact_in(folder: &Path) -> PathBuf {
    folder.join("program.plcx")
}

fn image_in(folder: &Path) -> PathBuf {
    folder.join("image")
}

/// The instructions that a process executes which does this many scans.
fn executed(folder: &Path, task: &str, scans: u64) -> Result<u64, Box<dyn Error>> {
    let output = Command::new("valgrind")
        .args(["--tool=cachegrind", "--cache-sim=no", "--cachegrind-out-file=/dev/null"])
        .arg(std::env::current_exe()?)
        .args([RUN.as_ref(), folder.as_os_str(), task.as_ref(), scans.to_string().as_ref()])
        .output()
        .map_err(|error| format!("valgrind can't be started: {error}"))?;
    let messages = String::from_utf8_lossy(&output.stderr);
    let refs = messages.lines().find_map(|line| line.split_once("I   refs:"));
    let (_, number) = refs.filter(|_| output.status.success()).ok_or(messages.to_string())?;
    Ok(number.trim().replace(',', "").parse()?)
}

/// Does what is counted: scans of a task, or ticks.
fn run(folder: &Path, task: &str, scans: u64) -> Result<(), Box<dyn Error>> {
    let artifact = Artifact::open(&artifact_in(folder), None)?;
    let mut engine = NativeEngine::new(&artifact.code, &artifact.program)?;
    if task == TICK || task == MOTION {
        let program = &artifact.program;
        let mut executive: Box<dyn Executive> = match task {
            MOTION => Box::new(motion::executive(program)?),
            _ => plcc_control::executive(program, &ControlArgs::default(), false, None)
                .map_err(|error| error.to_string())?,
        };
        let mut events = vec![];
        for _ in 0..scans {
            events.clear();
            executive.tick(&mut engine, &mut events).map_err(|stop| stop.message)?;
        }
        return Ok(());
    }
    let task = task.parse()?;
    let start = std::fs::read(image_in(folder))?;
    let mut pmac = PmacExecutive::new(&artifact.program, PmacOptions::default());
    let mut own_image = start.clone();
    let (image, host) = match &mut pmac {
        Some(pmac) => pmac.parts(),
        None => (own_image.as_mut_slice(), &mut NoHost as &mut dyn plcc_abi::Host),
    };
    image.copy_from_slice(&start);
    for _ in 0..scans {
        engine.call(task, None, &mut Scan::new(image, host));
    }
    Ok(())
}

fn table(all: &[Counted]) -> String {
    let rustc = Command::new("rustc").arg("--version").output();
    let rustc = rustc.map_or_else(
        |_| "unknown".into(),
        |found| String::from_utf8_lossy(&found.stdout).trim().to_owned(),
    );
    let mut text = format!("{rustc}\n{:<28} {:>8} {:>13}\n", "", "bytes", "instructions");
    for Counted { name, bytes, instructions } in all {
        let _ = writeln!(text, "{name:<28} {bytes:>8} {instructions:>13}");
    }
    text
}

/// Compares the table with the one that was reviewed, or puts it in its place.
fn compare(text: &str) -> Result<(), Box<dyn Error>> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("instructions.txt");
    if std::env::var_os("BLESS").is_some() {
        return Ok(std::fs::write(path, text)?);
    }
    let reviewed = std::fs::read_to_string(&path)?;
    let mut differ = false;
    for (was, is) in reviewed.lines().zip(text.lines()).filter(|(was, is)| was != is) {
        println!("- {was}\n+ {is}");
        differ = true;
    }
    if differ || reviewed.lines().count() != text.lines().count() {
        return Err(format!("the counts are not those of {}", path.display()).into());
    }
    Ok(())
}
