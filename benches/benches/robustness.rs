//! Measures the time and memory that `plcc check` and `plcc build` need for sources of a mebibyte that
//! were made to cost as much as possible.
//!
//! Each input is checked, and built, in a process of its own, which is this same program: it tells the
//! time and the most memory that it ever had. `cargo bench -p plcc-benches --bench robustness`; words
//! after `--` select the inputs with one of them in their names.
//!
//! Exits with 1 when checking an input takes more than a second or 100 MiB, or building it more than 3
//! seconds or 256 MiB. A program that the compiler refuses for its length counts as built.

use std::path::Path;
use std::process::{Command, ExitCode};
use std::time::Instant;
use std::{env, fs};

use plcc::compile::{self, CompileError};
use plcc::disk::Disk;
use plcc_abi::Dialect;
use plcc_abi::pmac::Controller;
use plcc_benches::hostile_inputs::{HostileInput, inputs};
use plcc_codegen::{OptLevel, Target};
use plcc_diag::SourceMap;
use plcc_frontend::common::{Limits, Options};

/// What is done with an input, and what it may take.
struct Bound {
    command: &'static str,
    seconds: f64,
    mebibytes: f64,
}

const BOUNDS: [Bound; 2] = [
    Bound { command: "check", seconds: 1.0, mebibytes: 100.0 },
    Bound { command: "build", seconds: 3.0, mebibytes: 256.0 },
];

/// The argument by which the program knows that it is the process for one input; the command, the
/// dialect, the controller and the file follow.
const CHILD: &str = "--child";

fn main() -> ExitCode {
    let args: Vec<String> = env::args().skip(1).filter(|arg| arg != "--bench").collect();
    if let [mode, command, dialect, controller, path] = args.as_slice()
        && mode == CHILD
    {
        return child(command, dialect, controller, Path::new(path));
    }
    let folder = env::temp_dir().join(format!("plcc-robustness-{}", std::process::id()));
    let result = parent(&folder, &args);
    let _ = fs::remove_dir_all(&folder);
    match result {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(2)
        }
    }
}

fn parent(folder: &Path, wanted: &[String]) -> Result<bool, std::io::Error> {
    println!(
        "{:<56} {:>10} {:>8} {:>12}   {:>10} {:>8}  built as",
        "input", "check ms", "MiB", "diagnostics", "build ms", "MiB"
    );
    let mut good = true;
    for &dialect in Dialect::ALL {
        for input in inputs(dialect) {
            let name = format!("{}: {}", dialect.name(), input.name);
            if !wanted.is_empty() && !wanted.iter().any(|word| name.contains(word)) {
                continue;
            }
            fs::create_dir_all(folder)?;
            let path = folder.join("input");
            fs::write(&path, &input.bytes)?;
            for (name, text) in &input.included {
                fs::write(folder.join(name), text)?;
            }
            print!("{name:<56}");
            for bound in &BOUNDS {
                good &= measure(bound, dialect, &input, &path)?;
            }
            println!();
            fs::remove_dir_all(folder)?;
        }
    }
    Ok(good)
}

/// Does one thing with one input and prints what it took. Says whether it was within the bound.
fn measure(
    bound: &Bound,
    dialect: Dialect,
    input: &HostileInput,
    path: &Path,
) -> Result<bool, std::io::Error> {
    let controller = if input.turbo { "turbo" } else { "pmac" };
    let output = Command::new(env::current_exe()?)
        .args([CHILD, bound.command, dialect.name(), controller])
        .arg(path)
        .output()?;
    let said = String::from_utf8_lossy(&output.stdout);
    let mut words = said.split_whitespace();
    let mut number = || words.next().and_then(|word| word.parse::<f64>().ok());
    let (Some(seconds), Some(mebibytes)) = (number(), number()) else {
        print!("  {} {}", bound.command, output.status);
        return Ok(false);
    };
    let over = seconds > bound.seconds || mebibytes > bound.mebibytes;
    let mark = if over { " OVER" } else { "" };
    let result = words.next().unwrap_or_default();
    print!(" {:>10.1} {mebibytes:>8.1} {result:>12}{mark}  ", seconds * 1e3);
    Ok(!over)
}

/// Checks or builds a file. Prints seconds, mebibytes, and the number of diagnostics or what came of
/// building.
fn child(command: &str, dialect: &str, controller: &str, path: &Path) -> ExitCode {
    let Some(&dialect) = Dialect::ALL.iter().find(|d| d.name() == dialect) else {
        return ExitCode::from(2);
    };
    let controller = if controller == "turbo" { Controller::Turbo } else { Controller::Pmac };
    let Ok(bytes) = fs::read(path) else { return ExitCode::from(2) };
    let start = Instant::now();
    let mut sources = SourceMap::new();
    let file = sources.add(path.to_string_lossy(), &bytes);
    let options = Options { limits: Limits::None, controller, ..Options::default() };
    let (program, diagnostics) = compile::check(&mut sources, &[file], dialect, &Disk, &options);
    // The first hundred diagnostics are drawn, as the command does.
    let drawn: usize = diagnostics
        .iter()
        .take(100)
        .map(|diagnostic| plcc_diag::render::draw(&sources, diagnostic, false).len())
        .sum();
    std::hint::black_box(drawn);
    let result = match program {
        _ if command == "check" => diagnostics.len().to_string(),
        None => "nothing".into(),
        Some(program) => {
            let built = program.optimized(OptLevel::Speed).and_then(|lowered| {
                let code = compile::code(&lowered, &Target::host_baseline()?)?;
                compile::artifact(&lowered.program, &code)
            });
            match built {
                Ok(artifact) => format!("{}kB", artifact.len() / 1000),
                Err(CompileError::TooLong(diagnostic)) => diagnostic.code.into(),
                Err(error) => {
                    eprintln!("error: {error}");
                    return ExitCode::FAILURE;
                }
            }
        }
    };
    println!("{} {} {result}", start.elapsed().as_secs_f64(), peak().unwrap_or(f64::NAN));
    ExitCode::SUCCESS
}

/// The peak of this process's resident memory in mebibytes, if the system tells it.
fn peak() -> Option<f64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: f64 = line.split_whitespace().next()?.parse().ok()?;
    Some(kibibytes / 1024.0)
}
