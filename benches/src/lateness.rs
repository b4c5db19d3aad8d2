//! How late the ticks of a program begin when a clock paces them.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::cell::RefCell;
use std::time::{Duration, Instant};

use clap::Parser;
use plcc::compile;
use plcc::disk::Disk;
use plcc_abi::Dialect;
use plcc_codegen::OptLevel;
use plcc_diag::SourceMap;
use plcc_frontend::common::Options;
use plcc_host::args::RunArgs;
use plcc_host::run::Clock;
use plcc_host::session;

#[derive(Parser)]
struct Args {
    #[command(flatten)]
    run: RunArgs,
}

/// Runs the lathe as native code for so many seconds, 1 ms a tick, with the priority and the locked memory
/// that `plcrt --realtime` asks for. `options` are further ones of `plcc run`.
///
/// # Panics
/// When the options are wrong or the run does not come to its end.
pub fn of_the_lathe(seconds: usize, options: &[&str]) -> Lateness {
    let mut sources = SourceMap::new();
    let file = sources.add("lathe.pmi", include_bytes!("../../examples/pmi/lathe.pmi"));
    let compile_options = Options::default();
    let (checked, _) = compile::check(&mut sources, &[file], Dialect::Pmi, &Disk, &compile_options);
    let lowered = checked.unwrap().optimized(OptLevel::Speed).unwrap();
    let (mut engine, _) = compile::jit(&lowered).unwrap();
    let time = format!("{seconds}s");
    let words = ["run", "--realtime", "--period", "1", "--for", &time];
    let args = Args::try_parse_from(words.iter().chain(options));
    let args = args.unwrap_or_else(|error| panic!("{error}"));
    let clock = MeasuringClock(RefCell::new(Vec::with_capacity(seconds * 1000 + 1000)));
    let status = session::run_with_clock(&lowered.program, &mut engine, &args.run, None, &clock);
    assert_eq!(status, 0, "the run did not come to its end");
    let mut nanoseconds = clock.0.into_inner();
    nanoseconds.sort_unstable();
    Lateness { nanoseconds }
}

/// The system's clock, which notes how much longer than asked for each wait took, in nanoseconds.
#[derive(Debug)]
struct MeasuringClock(RefCell<Vec<u32>>);

impl Clock for MeasuringClock {
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

/// How late the ticks of a run were.
#[derive(Debug)]
pub struct Lateness {
    /// In ascending order.
    nanoseconds: Vec<u32>,
}

impl Lateness {
    /// The number of ticks.
    pub fn ticks(&self) -> usize {
        self.nanoseconds.len()
    }

    /// The lateness in microseconds that this part of the ticks, from 0 to 1, did not exceed; 0 without
    /// ticks.
    pub fn at(&self, part: f64) -> f64 {
        let last = self.nanoseconds.len().saturating_sub(1);
        let index = ((self.nanoseconds.len() as f64 * part) as usize).min(last);
        f64::from(self.nanoseconds.get(index).copied().unwrap_or(0)) / 1000.0
    }
}
