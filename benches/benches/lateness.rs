//! How late the ticks of a program begin when a clock paces them: 1 ms a tick, in native code, with the
//! priority and the locked memory that `plcrt --realtime` asks for.
//!
//! The number after `--` is how many seconds it lasts (10 without one). `scripts/full lateness` runs it
//! idle and loaded, beside cyclictest.
#![allow(clippy::print_stdout)]

use plcc_benches::lateness;

fn main() {
    let seconds = std::env::args().filter_map(|word| word.parse::<usize>().ok()).next_back();
    let late = lateness::of_the_lathe(seconds.unwrap_or(10), &[]);
    println!(
        "ticks {}, latest {:.1}, 99.9 % {:.1}, median {:.1} (µs)",
        late.ticks(),
        late.at(1.0),
        late.at(0.999),
        late.at(0.5)
    );
}
