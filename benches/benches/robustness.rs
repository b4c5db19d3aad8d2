//! Measures the time and memory that `plcc check` needs for inputs of a mebibyte that were made to
//! cost as much as possible.
//!
//! Each input is checked in a process of its own, which is this same program: it tells the time
//! of the check and the most memory that it ever had. `cargo bench -p plcc-benches --bench
//! robustness`; words behind `--` select the inputs with one of them in their names.
//!
//! Exits with 1 when an input takes more than a second or 100 MiB.

use std::fmt::Write as _;
use std::path::Path;
use std::process::{Command, ExitCode};
use std::time::{Duration, Instant};
use std::{env, fs};

use plcc::compile;
use plcc_abi::Dialect;
use plcc_diag::SourceMap;
use plcc_frontend::common::{MemoryLoader, Options};
use plcc_random::Rng;

const MEBIBYTE: usize = 1 << 20;
const SECONDS: f64 = 1.0;
const MEBIBYTES: f64 = 100.0;

/// The argument by which the program knows that it is the process that checks one input; the dialect
/// and the file follow.
const CHILD: &str = "--child";

fn main() -> ExitCode {
    let args: Vec<String> = env::args().skip(1).filter(|arg| arg != "--bench").collect();
    if let [mode, dialect, path] = args.as_slice()
        && mode == CHILD
    {
        return child(dialect, Path::new(path));
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
    fs::create_dir_all(folder)?;
    println!("{:<30} {:>10} {:>10} {:>8} {:>12}", "input", "bytes", "ms", "MiB", "diagnostics");
    let mut good = true;
    for dialect in [Dialect::Pmi, Dialect::Nct, Dialect::Pmac] {
        for (name, bytes) in inputs(dialect) {
            let name = format!("{}: {name}", dialect.name());
            if !wanted.is_empty() && !wanted.iter().any(|word| name.contains(word)) {
                continue;
            }
            let path = folder.join("input");
            fs::write(&path, &bytes)?;
            let output = Command::new(env::current_exe()?)
                .args([CHILD, dialect.name()])
                .arg(&path)
                .output()?;
            let said = String::from_utf8_lossy(&output.stdout);
            let mut words = said.split_whitespace().map(|word| word.parse::<f64>().unwrap_or(-1.0));
            let (Some(seconds), Some(mebibytes), Some(diagnostics)) =
                (words.next(), words.next(), words.next())
            else {
                println!("{name:<30} {:>10} {}", bytes.len(), output.status);
                good = false;
                continue;
            };
            let over = seconds > SECONDS || mebibytes > MEBIBYTES;
            good &= !over;
            let mark = if over { "  over the bound" } else { "" };
            println!(
                "{name:<30} {:>10} {:>10.1} {mebibytes:>8.1} {diagnostics:>12}{mark}",
                bytes.len(),
                seconds * 1e3
            );
        }
    }
    Ok(good)
}

/// Checks a file and prints seconds, mebibytes and the number of diagnostics.
fn child(dialect: &str, path: &Path) -> ExitCode {
    let dialects = [Dialect::Pmi, Dialect::Nct, Dialect::Pmac];
    let Some(dialect) = dialects.into_iter().find(|d| d.name() == dialect) else {
        return ExitCode::from(2);
    };
    let Ok(bytes) = fs::read(path) else { return ExitCode::from(2) };
    let start = Instant::now();
    let mut sources = SourceMap::new();
    let file = sources.add("input", &bytes);
    let options = Options { limits: plcc_frontend::common::Limits::None, ..Options::default() };
    let (program, diagnostics) =
        compile::check(&mut sources, &[file], dialect, &MemoryLoader::new(), &options);
    // The first hundred diagnostics are drawn, as the command does.
    let drawn: usize = diagnostics
        .iter()
        .take(100)
        .map(|diagnostic| plcc_diag::render::draw(&sources, diagnostic, false).len())
        .sum();
    let elapsed = start.elapsed();
    std::hint::black_box((program.is_some(), drawn));
    report(elapsed, diagnostics.len());
    ExitCode::SUCCESS
}

fn report(elapsed: Duration, diagnostics: usize) {
    println!("{} {} {diagnostics}", elapsed.as_secs_f64(), peak().unwrap_or(f64::NAN));
}

/// The peak of this process's resident memory in mebibytes, if the system tells it.
fn peak() -> Option<f64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: f64 = line.split_whitespace().next()?.parse().ok()?;
    Some(kibibytes / 1024.0)
}

fn inputs(dialect: Dialect) -> Vec<(&'static str, Vec<u8>)> {
    vec![
        ("noise", noise()),
        ("one letter", vec![b'A'; MEBIBYTE]),
        ("one line end", vec![b'\n'; MEBIBYTE]),
        ("open parentheses", vec![b'('; MEBIBYTE]),
        ("500 000 terms", terms(dialect).into_bytes()),
        ("50 000 statements", statements(dialect).into_bytes()),
        ("50 000 mistakes", mistakes(dialect).into_bytes()),
    ]
}

fn noise() -> Vec<u8> {
    let mut rng = Rng::new(1);
    (0..MEBIBYTE).map(|_| rng.below(256) as u8).collect()
}

/// One statement of half a million terms.
fn terms(dialect: Dialect) -> String {
    let row = |term: &str, between: &str| {
        let mut text = String::from(term);
        for _ in 1..500_000 {
            text.push_str(between);
            text.push_str(term);
        }
        text
    };
    match dialect {
        Dialect::Pmi => format!("$INTEGER\nA\n$END\nA = {}\n", row("A", "+")),
        Dialect::Nct => format!(":000\nJ0\n:001\n({})U000Z\nJ1\n", row("I000", "A")),
        Dialect::Pmac => format!("OPEN PLC 1 CLEAR\nP1={}\nCLOSE\n", row("P1", "+")),
    }
}

fn rows(start: &str, row: impl Fn(usize) -> String, end: &str) -> String {
    let mut text = String::from(start);
    for n in 0..50_000 {
        let _ = writeln!(text, "{}", row(n));
    }
    text + end
}

fn statements(dialect: Dialect) -> String {
    match dialect {
        Dialect::Pmi => rows(
            "$INTEGER\nA,B,C\n$LOGICAL\nX,Y,Z\n$END\n",
            |n| match n % 3 {
                0 => "A = B + C * 2".into(),
                1 => "X = Y & Z ! /X".into(),
                _ => format!("IF (A > {})\nB = 1\nENDIF", n % 1000),
            },
            "",
        ),
        Dialect::Nct => rows(
            ":000\nJ0\n:001\n",
            |n| format!("(I00{}AY00{})U01{}ED01{}Z", n % 8, n / 8 % 8, n % 7, n % 5),
            "J1\n",
        ),
        Dialect::Pmac => rows(
            "M1->Y:$FFC2,8\nOPEN PLC 1 CLEAR\n",
            |n| match n % 3 {
                0 => format!("P{}=P{}+1", n % 1000, (n + 1) % 1000),
                1 => format!("IF (M1=1 AND P{}>3) P1=0 ENDIF", n % 1000),
                _ => "Q1=SIN(P1)*2".into(),
            },
            "CLOSE\n",
        ),
    }
}

fn mistakes(dialect: Dialect) -> String {
    match dialect {
        Dialect::Pmi => rows("$INTEGER\nA\n$END\n", |n| format!("A = U{n}"), ""),
        Dialect::Nct => rows(":000\nJ0\n:001\n", |_| "L*9".into(), "J1\n"),
        Dialect::Pmac => rows("OPEN PLC 1 CLEAR\n", |n| format!("FOO{n}=BAR"), "CLOSE\n"),
    }
}
