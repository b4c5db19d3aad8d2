//! How late the ticks of a program begin when a clock paces them: 1 ms a tick, in native code, with the
//! priority and the locked memory that `plcrt --realtime` asks for.
//!
//! The number after `--` is how many seconds it lasts (10 without one). `scripts/full lateness` runs it
//! idle and loaded, beside cyclictest.
#![allow(clippy::unwrap_used, clippy::print_stdout, clippy::panic)]

use std::cell::RefCell;
use std::time::{Duration, Instant};

use clap::Parser;
use plcc::compile;
use plcc::disk::Disk;
use plcc_abi::Dialect;
use plcc_codegen::OptLevel;
use plcc_diag::SourceMap;
use plcc_frontend::common::Options;
use plcc_runtime::args::RunArgs;
use plcc_runtime::run::Clock;
use plcc_runtime::session;

#[derive(Parser)]
struct Args {
    #[command(flatten)]
    run: RunArgs,
}

/// The system's clock, which notes how much longer than asked for each wait took, in nanoseconds.
#[derive(Debug)]
struct Measured(RefCell<Vec<u32>>);

impl Clock for Measured {
    fn now(&self) -> Instant {
        Instant::now()
    }

    fn sleep(&self, time: Duration) {
        let before = Instant::now();
        std::thread::sleep(time);
        let late = before.elapsed().saturating_sub(time);
        let mut noted = self.0.borrow_mut();
        // No allocation while ticks are paced: what does not fit is left out.
        if noted.len() < noted.capacity() {
            noted.push(u32::try_from(late.as_nanos()).unwrap_or(u32::MAX));
        }
    }
}

fn main() {
    let seconds = std::env::args().filter_map(|word| word.parse::<usize>().ok()).next_back();
    let seconds = seconds.unwrap_or(10);
    let mut sources = SourceMap::new();
    let file = sources.add("lathe.pmi", include_bytes!("../../examples/pmi/lathe.pmi"));
    let options = Options::default();
    let (checked, _) = compile::check(&mut sources, &[file], Dialect::Pmi, &Disk, &options);
    let lowered = checked.unwrap().optimized(OptLevel::Speed).unwrap();
    let (mut engine, _) = compile::jit(&lowered).unwrap();
    let time = format!("{seconds}s");
    let words = ["run", "--realtime", "--period", "1", "--for", &time];
    let args = Args::try_parse_from(words).unwrap_or_else(|error| panic!("{error}"));
    let clock = Measured(RefCell::new(Vec::with_capacity(seconds * 1000 + 1000)));
    let status = session::run_with_clock(&lowered.program, &mut engine, &args.run, None, &clock);
    assert_eq!(status, 0, "the run did not come to its end");
    let mut late = clock.0.into_inner();
    late.sort_unstable();
    let at = |part: f64| {
        let index = ((late.len() as f64 * part) as usize).min(late.len().saturating_sub(1));
        f64::from(late.get(index).copied().unwrap_or(0)) / 1000.0
    };
    println!(
        "ticks {}, latest {:.1}, 99.9 % {:.1}, median {:.1} (µs)",
        late.len(),
        at(1.0),
        at(0.999),
        at(0.5)
    );
}
