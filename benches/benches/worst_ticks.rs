//! How much each extra of a control lengthens its longest tick: a PMAC with ticks of 442 us in native code, with the
//! priority and the locked memory that `plcrt --realtime` asks for, alone and with each extra.
//!
//! A tick counts from when the thread of the ticks wakes up until everything is done that belongs to it. What comes then
//! has a row of its own: a record's checkpoint, for which the program does not wait. Time is that of the thread on
//! its processor, so that other programs which take the processor away do not count; interrupts do.
//!
//! The runs take turns, 35 seconds each, so that each has a checkpoint. `cargo bench -p plcc-benches --bench worst_ticks -- TICKS` goes on until each has
//! had that many ticks (100 000 without a number; a million take 55 minutes). Names of extras after the number choose among them.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

use std::cell::{Cell, RefCell};
use std::io::Read;
use std::os::unix::net::UnixStream;
use std::time::{Duration, Instant};

use plcc_abi::Dialect;
use plcc_benches::paced;
use plcc_host::run::Clock;
use rustix::time::{ClockId, clock_gettime};

/// Stands for the image file, which is in memory, as the documentation asks for.
const IMAGE: &str = "IMAGE";

/// What a control can have besides its program.
const EXTRAS: [(&str, &[&str]); 7] = [
    ("alone", &[]),
    ("--log", &["--log", "log"]),
    ("--image", &["--image", IMAGE]),
    ("--socket", &["--socket", "socket"]),
    ("--record", &["--record", "record"]),
    ("a supervisor", &[]),
    (
        "all of these",
        &["--log", "log", "--image", IMAGE, "--socket", "socket", "--record", "record"],
    ),
];

/// Ticks of a turn: about 35 seconds, since a record has a checkpoint every 30 seconds.
const TURN: u64 = 80_000;
/// Ticks at the beginning of a run that are not counted: the first one meets cold caches, whatever the extra.
const BEGINNING: usize = 100;

fn main() {
    let words: Vec<String> = std::env::args().skip(1).filter(|word| word != "--bench").collect();
    let wanted = words.iter().find_map(|word| word.parse::<usize>().ok()).unwrap_or(100_000);
    let mut extras = EXTRAS.to_vec();
    if words.iter().any(|word| word.parse::<usize>().is_err()) {
        extras.retain(|(extra, _)| words.iter().any(|word| word == extra));
    }
    let folder = tempfile::tempdir().unwrap();
    std::env::set_current_dir(folder.path()).unwrap();
    let memory = tempfile::tempdir_in("/dev/shm").unwrap();
    let image = memory.path().join("image").to_str().unwrap().to_owned();
    let mut times: Vec<Times> = extras.iter().map(|_| Times::default()).collect();
    while times.iter().any(|times| times.ticks.len() < wanted) {
        for ((extra, options), times) in extras.iter().zip(&mut times) {
            let in_place =
                |word: &&'static str| if *word == IMAGE { image.as_str() } else { *word };
            let options: Vec<&str> = options.iter().map(in_place).collect();
            turn(&options, matches!(*extra, "a supervisor" | "all of these"), times);
        }
    }
    println!(
        "| a PMAC with | ticks | mean | 99.9 % within | 99.999 % within | longest | after a tick |"
    );
    println!("| --- | --- | --- | --- | --- | --- | --- |");
    for ((extra, _), Times { ticks, after }) in extras.iter().zip(&mut times) {
        ticks.sort_unstable();
        let at = |part: f64| {
            let index = (ticks.len() as f64 * part) as usize;
            ticks.get(index.min(ticks.len() - 1)).copied().unwrap_or(0)
        };
        let us = |ns: u32| f64::from(ns) / 1e3;
        let mean = ticks.iter().map(|&ns| f64::from(ns)).sum::<f64>() / ticks.len() as f64 / 1e3;
        println!(
            "| {extra} | {} | {mean:.1} us | {:.1} us | {:.1} us | {:.1} us | {:.1} us |",
            ticks.len(),
            us(at(0.999)),
            us(at(0.99999)),
            us(at(1.0)),
            us(*after)
        );
    }
}

/// How long ticks took, in nanoseconds.
#[derive(Debug, Default)]
struct Times {
    ticks: Vec<u32>,
    /// The longest time that was used after a tick.
    after: u32,
}

/// One run.
fn turn(options: &[&str], supervised: bool, times: &mut Times) {
    let ticks = TURN.to_string();
    let options: Vec<&str> = ["--ticks", &ticks].iter().chain(options).copied().collect();
    if supervised {
        let (control, mut supervisor) = UnixStream::pair().unwrap();
        rustix::stdio::dup2_stdin(&control).unwrap();
        // It takes every heartbeat, and hears of the end when the standard input is another one.
        std::thread::spawn(move || while supervisor.read(&mut [0; 4096]).is_ok_and(|n| n > 0) {});
    }
    let clock = BusyClock::new(TURN as usize);
    paced::run(Dialect::Pmac, "mill.pmc", &options, supervised, &clock);
    times.ticks.extend(clock.ticks.take().iter().skip(BEGINNING));
    times.after = times.after.max(clock.after.get());
}

/// After how many questions for the time since the thread has woken up a tick is done: whether it is due, its
/// beginning, its end, and how long to wait for the next one, which a record that waits for idle time asks before.
const QUESTIONS: u32 = 4;

/// The system's clock, which notes how long the thread was busy between two waits.
#[derive(Debug)]
struct BusyClock {
    ticks: RefCell<Vec<u32>>,
    after: Cell<u32>,
    /// The time of the thread when it woke up, and when the tick was done.
    woken: Cell<Duration>,
    done: Cell<Duration>,
    questions: Cell<u32>,
}

impl BusyClock {
    fn new(ticks: usize) -> Self {
        let now = own_time();
        Self {
            ticks: RefCell::new(Vec::with_capacity(ticks + 1)),
            after: Cell::new(0),
            woken: Cell::new(now),
            done: Cell::new(now),
            questions: Cell::new(0),
        }
    }
}

impl Clock for BusyClock {
    fn now(&self) -> Instant {
        self.questions.set(self.questions.get() + 1);
        if self.questions.get() == QUESTIONS {
            self.done.set(own_time());
        }
        Instant::now()
    }

    fn sleep(&self, time: Duration) {
        let ns = |time: Duration| u32::try_from(time.as_nanos()).unwrap_or(u32::MAX);
        let mut ticks = self.ticks.borrow_mut();
        // No allocation while ticks are paced: what does not fit is left out. So are ticks that came without a wait between
        // them, after which more has been asked.
        let questions = self.questions.get();
        if (QUESTIONS..=QUESTIONS + 1).contains(&questions) && ticks.len() < ticks.capacity() {
            ticks.push(ns(self.done.get().saturating_sub(self.woken.get())));
            if questions > QUESTIONS && ticks.len() > BEGINNING {
                let after = own_time().saturating_sub(self.done.get());
                self.after.set(self.after.get().max(ns(after)));
            }
        }
        drop(ticks);
        std::thread::sleep(time);
        self.questions.set(0);
        self.woken.set(own_time());
    }
}

/// How long this thread had a processor so far.
fn own_time() -> Duration {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    Duration::new(time.tv_sec.unsigned_abs(), u32::try_from(time.tv_nsec).unwrap_or(0))
}
