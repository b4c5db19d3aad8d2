//! Measures how soon after its start `plcrt` begins the first tick: of 2000 equations of PMI, with nothing else,
//! with a supervisor, and with each file and socket that a control may have.
//!
//! ```text
//! cargo build --profile loader -p plcrt
//! cargo bench -p plcc-benches --bench start [-- PLCRT]
//! ```
//!
//! PLCRT is the program that is started, `target/loader/plcrt` unless told. It says itself when its first tick
//! began; with a supervisor the time counts from the start of that. Each row shows the least, the median and
//! the longest of 20 starts.

use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use plcc::compile;
use plcc::disk::Disk;
use plcc_abi::Dialect;
use plcc_benches::kernels::{Language, families};
use plcc_codegen::{OptLevel, Target};
use plcc_diag::SourceMap;
use plcc_frontend::common::{Limits, Options};

/// How often the program is started for a row.
const STARTS: usize = 20;

fn main() -> Result<(), Box<dyn Error>> {
    // Cargo passes `--bench`.
    let mut args = std::env::args().skip(1).filter(|arg| arg != "--bench");
    let built = Path::new(env!("CARGO_MANIFEST_DIR")).join("../target/loader/plcrt");
    let plcrt = std::path::absolute(args.next().map_or(built, PathBuf::from))?;
    let folder = std::env::temp_dir().join(format!("plcc-start-{}", std::process::id()));
    std::fs::create_dir_all(&folder)?;
    let result = measure_all(&plcrt, &folder);
    std::fs::remove_dir_all(&folder)?;
    result
}

fn measure_all(plcrt: &Path, folder: &Path) -> Result<(), Box<dyn Error>> {
    let source = families::relay_logic(Language::Pmi, 2000, 1).source();
    let mut sources = SourceMap::new();
    let file = sources.add("equations.pmi", source.as_bytes());
    let options = Options { limits: Limits::None, ..Options::default() };
    let (checked, _) = compile::check(&mut sources, &[file], Dialect::Pmi, &Disk, &options);
    let lowered = checked.ok_or("the equations have errors")?.optimized(OptLevel::Speed)?;
    let code = compile::code(&lowered, &Target::host_baseline()?)?;
    std::fs::write(folder.join("p.plcx"), compile::artifact(&lowered.program, &code)?)?;
    println!(
        "{:<56} {:>8} {:>8} {:>8}",
        "ms from the start to the first tick", "least", "median", "most"
    );
    for options in [
        "--no-supervisor",
        "--no-supervisor --retain kept",
        "--no-supervisor --image image",
        "--no-supervisor --socket socket",
        "--no-supervisor --record p.plcrec",
        "",
        "--retain kept --image image --socket socket --record p.plcrec",
    ] {
        let mut times = vec![];
        for _ in 0..STARTS {
            times.push(start(plcrt, folder, options)?);
        }
        times.sort_by(f64::total_cmp);
        let at = |index: usize| times.get(index).copied().unwrap_or(f64::NAN);
        let name = if options.is_empty() { "with a supervisor" } else { options };
        println!("{name:<56} {:>8.1} {:>8.1} {:>8.1}", at(0), at(STARTS / 2), at(STARTS - 1));
    }
    Ok(())
}

/// Starts the program once, and gives the milliseconds until its first tick.
fn start(plcrt: &Path, folder: &Path, options: &str) -> Result<f64, Box<dyn Error>> {
    let mut command = Command::new(plcrt);
    command.args(["p.plcx", "--realtime", "--period", "20", "--ticks", "2"]);
    command.args(options.split_whitespace()).current_dir(folder).stdin(Stdio::null());
    let output = command.output()?;
    let text = String::from_utf8_lossy(&output.stderr);
    let said =
        text.split_once("the first tick began ").and_then(|(_, rest)| rest.split(' ').next());
    Ok(said.ok_or_else(|| format!("{options}: {text}"))?.parse()?)
}
