//! How late the ticks of a program begin when a clock paces them.

use std::cell::RefCell;
use std::time::{Duration, Instant};

use plcc_abi::Dialect;
use plcc_host::run::Clock;

use crate::paced;

/// Runs the lathe as native code for so many seconds, 1 ms a tick, with the priority and the locked memory
/// that `plcrt --realtime` asks for. `options` are further ones of `plcc run`.
///
/// # Panics
/// When the options are wrong or the run does not come to its end.
pub fn of_the_lathe(seconds: usize, options: &[&str]) -> Lateness {
    let time = format!("{seconds}s");
    let words = ["--period", "1", "--for", &time];
    let options: Vec<&str> = words.iter().chain(options).copied().collect();
    let clock = MeasuringClock(RefCell::new(Vec::with_capacity(seconds * 1000 + 1000)));
    paced::run(Dialect::Pmi, "lathe.pmi", &options, false, &clock);
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
