//! Measures kernels in every language against the same logic in C, compiled by gcc and clang with
//! `-O2` and `-O3`, in every layout of bits and style of logic. All final states must be the same.
//!
//! ```text
//! cargo bench -p plcc-benches --bench kernels -- [--seed N] [--percent N] [--rounds N] [--only TEXT]
//! cargo bench -p plcc-benches --bench kernels -- --without PASSES [--seed N] …
//! cargo bench -p plcc-benches --bench kernels -- --write FOLDER [--seed N] …
//! cargo bench -p plcc-benches --bench kernels -- --scans N [--seed N] …
//! ```
//!
//! The programs take turns in short rounds, so that a machine that gets slower or faster for a while
//! does so for all of them; each time is the least of all rounds. A ratio is native code's time over
//! that of the fastest C. `--only` chooses kernels by a part of `LANGUAGE NAME`; `--percent` changes
//! their size. The columns are: the times with static inputs and the C that was fastest then; the
//! ratios with static inputs, with one of a hundred inputs changing in each scan, with random
//! inputs, and with static inputs and cold caches; native code's time with random inputs over that
//! with static ones; bytes of code; and the compile time.
//!
//! With `--without -gates,-narrow` no C is compiled. Instead each kernel is compiled with all passes and
//! without those, and the two take turns: the columns are bytes of code and the times with static and
//! with random inputs, each with all passes, without those, and the ratio of the first to the second.
//!
//! `--write` only writes the source text of each kernel to a folder, for `plcc build --emit`. `--scans`
//! times nothing and runs that many scans of each kernel with static inputs: what callgrind counts in
//! two such runs differs by the instructions of the further scans, which no other load of the machine
//! changes.

use std::collections::BTreeMap;
use std::error::Error;
use std::fmt::Write as _;
use std::path::Path;

use plcc_benches::kernels::c::Variant;
use plcc_benches::kernels::c_process::{CProcess, Compiler};
use plcc_benches::kernels::subject::Subject;
use plcc_benches::kernels::{Inputs, Kernel, families};
use plcc_codegen::Optimization;

/// About how long one measurement takes, in nanoseconds.
const ROUND_NS: f64 = 1e6;
/// How many scans are run before states are compared.
const COMPARED_SCANS: usize = 500;
/// How many scans with cold caches are timed in a round, of whose times the median counts.
const COLD_SCANS: usize = 15;

/// What the command line asks for.
struct Options {
    seed: u64,
    percent: usize,
    rounds: usize,
    only: String,
    /// Changes of the set of all passes.
    without: Option<String>,
    /// The folder for source texts.
    write: Option<String>,
    /// How many scans to run without timing them.
    scans: Option<usize>,
}

fn options() -> Result<Options, Box<dyn Error>> {
    let mut options = Options {
        seed: 1,
        percent: 100,
        rounds: 15,
        only: String::new(),
        without: None,
        write: None,
        scans: None,
    };
    // Cargo passes `--bench`.
    let mut args = std::env::args().skip(1).filter(|arg| arg != "--bench");
    while let Some(arg) = args.next() {
        let value = args.next().ok_or_else(|| format!("{arg} needs a value"))?;
        match arg.as_str() {
            "--seed" => options.seed = value.parse()?,
            "--percent" => options.percent = value.parse()?,
            "--rounds" => options.rounds = value.parse()?,
            "--only" => options.only = value,
            "--without" => options.without = Some(value),
            "--write" => options.write = Some(value),
            "--scans" => options.scans = Some(value.parse()?),
            _ => return Err(format!("there is no option {arg}").into()),
        }
    }
    Ok(options)
}

/// The ratios of one kernel: for each kind of inputs, and with cold caches.
struct Ratios([f64; 4]);

fn main() -> Result<(), Box<dyn Error>> {
    let options = options()?;
    if let Some(without) = &options.without {
        return compare_passes(&options, Optimization::ALL.with_changes(without)?);
    }
    if let Some(folder) = &options.write {
        return write_sources(&options, Path::new(folder));
    }
    if let Some(scans) = options.scans {
        return run_scans(&options, scans);
    }
    let compilers = Compiler::installed(&["gcc", "clang", "clang-19"]);
    if compilers.is_empty() {
        return Err("neither gcc nor clang is installed".into());
    }
    let names: Vec<String> = compilers.iter().map(Compiler::name).collect();
    println!("against {}; seed {}", names.join(", "), options.seed);
    println!(
        "{:<24} {:>8} {:>8}  {:<22} {:>6} {:>6} {:>6} {:>6} {:>6} {:>7} {:>6}",
        "kernel",
        "jit ns",
        "C ns",
        "fastest C",
        "static",
        "1 %",
        "random",
        "cold",
        "rnd/st",
        "bytes",
        "ms"
    );
    let folder = std::env::temp_dir().join(format!("plcc-kernels-{}", std::process::id()));
    std::fs::create_dir_all(&folder)?;
    let mut groups: BTreeMap<&str, Vec<Ratios>> = BTreeMap::new();
    for (_, kernel) in chosen(&options) {
        let ratios = measure(&kernel, &compilers, &folder, &options)?;
        groups.entry(kernel.language.group()).or_default().push(ratios);
    }
    std::fs::remove_dir_all(&folder)?;
    let mut all = vec![];
    for (group, ratios) in &groups {
        print_means(group, ratios.iter());
        all.extend(ratios);
    }
    print_means("all", all.into_iter());
    Ok(())
}

/// The kernels that the command line asks for, each with its full name.
fn chosen(options: &Options) -> impl Iterator<Item = (String, Kernel)> {
    let all = families::all(options.seed, options.percent).into_iter();
    let named = all.map(|kernel| (format!("{} {}", kernel.language.group(), kernel.name), kernel));
    named.filter(|(name, _)| name.contains(&options.only))
}

/// Writes the source text of each kernel to a file of its own.
fn write_sources(options: &Options, folder: &Path) -> Result<(), Box<dyn Error>> {
    std::fs::create_dir_all(folder)?;
    for (name, kernel) in chosen(options) {
        let ending = match kernel.language.group() {
            "pmi" => "pmi",
            "nct" => "plc",
            _ => "pmc",
        };
        let path = folder.join(format!("{}.{ending}", name.replace(' ', "-")));
        std::fs::write(path, kernel.source())?;
    }
    Ok(())
}

/// Runs scans of each kernel with static inputs.
fn run_scans(options: &Options, scans: usize) -> Result<(), Box<dyn Error>> {
    for (name, kernel) in chosen(options) {
        let mut subject = Subject::new(&kernel, options.seed, Optimization::ALL)?;
        subject.run(Inputs::Static, scans, true);
        println!("{name}: {scans} scans, {} bytes of code", subject.compiled.code_bytes);
    }
    Ok(())
}

/// Compares native code that all passes have worked on with such that a set of passes has.
fn compare_passes(options: &Options, without: Optimization) -> Result<(), Box<dyn Error>> {
    println!(
        "{:<24} {:>8} {:>8} {:>6} {:>9} {:>9} {:>6} {:>9} {:>9} {:>6}",
        "kernel",
        "bytes",
        "without",
        "ratio",
        "ns",
        "without",
        "ratio",
        "random",
        "without",
        "ratio"
    );
    for (name, kernel) in chosen(options) {
        let mut subjects = [
            Subject::new(&kernel, options.seed, Optimization::ALL)?,
            Subject::new(&kernel, options.seed, without)?,
        ];
        let states =
            subjects.each_mut().map(|s| s.state_after(Inputs::Random, COMPARED_SCANS, true));
        if states.first() != states.last() {
            return Err(format!("{name}: the passes change the state").into());
        }
        let estimate = subjects.each_mut().map(|s| s.run(Inputs::Static, 100, true));
        let scans =
            ((ROUND_NS / estimate.iter().fold(1.0, |a: f64, &b| a.max(b))) as usize).max(50);
        let [with, without] = subjects.each_ref().map(|subject| subject.compiled.code_bytes);
        let mut line =
            format!("{name:<24} {with:>8} {without:>8} {:>6.2}", with as f64 / without as f64);
        for inputs in [Inputs::Static, Inputs::Random] {
            let mut ns = [f64::INFINITY; 2];
            for _ in 0..options.rounds {
                for (subject, least) in subjects.iter_mut().zip(&mut ns) {
                    *least = least.min(subject.run(inputs, scans, true));
                }
            }
            let [with, without] = ns;
            let _ = write!(line, " {with:>9.1} {without:>9.1} {:>6.2}", with / without);
        }
        println!("{line}");
    }
    Ok(())
}

/// Prints the geometric means of kernels' ratios.
fn print_means<'a>(group: &str, ratios: impl Iterator<Item = &'a Ratios> + Clone) {
    let mut line = format!("{:<65}", format!("geometric mean, {group}"));
    for at in 0..4 {
        let logs = ratios.clone().filter_map(|ratios| ratios.0.get(at)).map(|ratio| ratio.ln());
        let (sum, count) = logs.fold((0.0, 0), |(sum, count), log| (sum + log, count + 1));
        let _ = write!(line, " {:>6.2}", (sum / f64::from(count)).exp());
    }
    println!("{line}");
}

/// Compares the states of a kernel in all forms, measures it and prints its line.
fn measure(
    kernel: &Kernel,
    compilers: &[Compiler],
    folder: &Path,
    options: &Options,
) -> Result<Ratios, Box<dyn Error>> {
    let name = format!("{} {}", kernel.language.group(), kernel.name);
    let fail = |error: String| format!("{name}: {error}");
    let mut subject = Subject::new(kernel, options.seed, Optimization::ALL).map_err(fail)?;
    let variants = Variant::all(kernel);
    let mut programs = vec![];
    for compiler in compilers {
        programs.push(CProcess::start(kernel, compiler, folder, options.seed)?);
    }
    for inputs in Inputs::ALL {
        let found = subject.state_after(inputs, COMPARED_SCANS, true);
        for (program, compiler) in programs.iter_mut().zip(compilers) {
            for (number, variant) in variants.iter().enumerate() {
                if program.state_after(number, inputs, COMPARED_SCANS)? != found {
                    let c = format!("{} {}", compiler.name(), variant.name());
                    return Err(fail(format!("another state than in C ({c})")).into());
                }
            }
        }
    }
    let estimate = (0..3).map(|_| subject.run(Inputs::Static, 100, true)).fold(1e9, f64::min);
    let scans = ((ROUND_NS / estimate.max(1.0)) as usize).clamp(50, 100_000);
    // For each of static, 1 %, random and cold the least time of ours and of each C.
    let mut ours = [f64::INFINITY; 4];
    let mut theirs = vec![[f64::INFINITY; 4]; programs.len() * variants.len()];
    for _ in 0..options.rounds {
        for (at, inputs, scans) in [
            (0, Inputs::Static, scans),
            (1, Inputs::Hundredth, scans),
            (2, Inputs::Random, scans),
            (3, Inputs::Static, COLD_SCANS),
        ] {
            let cold = at == 3;
            let ns = if cold {
                subject.run_cold(inputs, scans)
            } else {
                subject.run(inputs, scans, true)
            };
            if let Some(least) = ours.get_mut(at) {
                *least = least.min(ns);
            }
            for (p, program) in programs.iter_mut().enumerate() {
                for v in 0..variants.len() {
                    let ns = program.run(v, inputs, scans, cold)?;
                    let times = theirs.get_mut(p * variants.len() + v);
                    if let Some(least) = times.and_then(|times| times.get_mut(at)) {
                        *least = least.min(ns);
                    }
                }
            }
        }
    }
    let column = |at: usize| {
        let times = theirs.iter().filter_map(|times| times.get(at)).copied().enumerate();
        times.min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, f64::NAN))
    };
    let best = [0, 1, 2, 3].map(|at| column(at).1);
    let fastest = column(0).0;
    let (compiler, variant) = (fastest / variants.len(), fastest % variants.len());
    let compiler = compilers.get(compiler).map(Compiler::name).unwrap_or_default();
    let variant = variants.get(variant).map_or("", |variant| variant.name());
    let mut ratios = [0.0; 4];
    for (ratio, (ours, theirs)) in ratios.iter_mut().zip(ours.into_iter().zip(best)) {
        *ratio = ours / theirs;
    }
    let [still, _, random, _] = ours;
    let [still_c, ..] = best;
    let mut line =
        format!("{name:<24} {still:>8.0} {still_c:>8.0}  {:<22}", format!("{compiler} {variant}"));
    for ratio in ratios {
        let _ = write!(line, " {ratio:>6.2}");
    }
    println!(
        "{line} {:>6.2} {:>7} {:>6.1}",
        random / still,
        subject.compiled.code_bytes,
        subject.compiled.times.total().as_secs_f64() * 1e3
    );
    Ok(Ratios(ratios))
}
