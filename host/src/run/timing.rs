//! How long ticks and scans take, and how late ticks begin, as users of a control know it: the last value,
//! the mean, the maximum, and a histogram.
//!
//! The thread that runs the ticks records; any thread may read meanwhile ([`Timing::summary`]). All
//! memory is allocated at the start, and recording makes no system call. That is why the histogram is not that of the
//! crate hdrhistogram: there, who records allocates a new one and sends the old one by a channel whenever somebody reads.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use crate::journal::{EntryKind, ScanJournal};
use plcc_abi::{Engine, Outcome, Program, ResumePoint, Scan};
use plcc_protocol::{TaskSummary, TimesSummary, TimingSummary};

/// The binary logarithm of how many buckets a histogram has for each doubling of the time: there are
/// eight, so that a percentile is exact to one eighth.
const SPLIT: u32 = 3;
/// The binary logarithm of the time, in nanoseconds, from which on all times share the last bucket: 2^40 ns
/// are 18 minutes.
const LARGEST: u32 = 40;
/// Time between two warnings of ticks that need most of their time.
const BUDGET_INTERVAL: Duration = Duration::from_secs(60);
/// How many buckets a histogram has.
const BUCKETS: usize = ((LARGEST - SPLIT + 2) << SPLIT) as usize;

/// The times that one thing took. One thread records.
#[derive(Debug)]
pub struct Times {
    count: AtomicU64,
    sum_ns: AtomicU64,
    last_ns: AtomicU64,
    max_ns: AtomicU64,
    buckets: Box<[AtomicU64]>,
}

impl Default for Times {
    fn default() -> Self {
        let zero = || AtomicU64::new(0);
        Self {
            count: zero(),
            sum_ns: zero(),
            last_ns: zero(),
            max_ns: zero(),
            buckets: (0..BUCKETS).map(|_| zero()).collect(),
        }
    }
}

/// The bucket to which a time in nanoseconds belongs, from 0.
fn bucket(ns: u64) -> usize {
    let highest = ns.checked_ilog2().unwrap_or(0);
    if highest < SPLIT {
        return ns as usize;
    }
    if highest >= LARGEST {
        return BUCKETS - 1;
    }
    let part = (ns >> (highest - SPLIT)) as u32 & ((1 << SPLIT) - 1);
    (((highest - SPLIT + 1) << SPLIT) + part) as usize
}

/// The largest time that belongs to a bucket, in nanoseconds.
fn largest_in(bucket: usize) -> u64 {
    let bucket = bucket as u64;
    let (doubling, part) = (bucket >> SPLIT, bucket & ((1 << SPLIT) - 1));
    match doubling.checked_sub(1) {
        None => part,
        Some(shift) => (((1 << SPLIT) + part + 1) << shift) - 1,
    }
}

/// Adds to a number that only one thread changes, so that no other value can come between reading and
/// writing.
fn add(to: &AtomicU64, value: u64) {
    to.store(to.load(Ordering::Relaxed).wrapping_add(value), Ordering::Relaxed);
}

fn microseconds(ns: u64) -> f64 {
    ns as f64 / 1000.0
}

impl Times {
    /// Records a time. Called by one thread only.
    #[inline]
    pub fn record(&self, time: Duration) {
        let ns = u64::try_from(time.as_nanos()).unwrap_or(u64::MAX);
        add(&self.count, 1);
        add(&self.sum_ns, ns);
        self.last_ns.store(ns, Ordering::Relaxed);
        if ns > self.max_ns.load(Ordering::Relaxed) {
            self.max_ns.store(ns, Ordering::Relaxed);
        }
        if let Some(bucket) = self.buckets.get(bucket(ns)) {
            add(bucket, 1);
        }
    }

    /// What was recorded so far.
    pub fn summary(&self) -> TimesSummary {
        let counts: Vec<u64> =
            self.buckets.iter().map(|bucket| bucket.load(Ordering::Relaxed)).collect();
        let count: u64 = counts.iter().sum();
        let max_ns = self.max_ns.load(Ordering::Relaxed);
        let percentile = |per_mille: u64| {
            let wanted = count.saturating_mul(per_mille).div_ceil(1000);
            let mut seen = 0;
            let within = counts.iter().position(|count| {
                seen += count;
                seen >= wanted.max(1)
            });
            microseconds(within.map_or(0, largest_in).min(max_ns))
        };
        let mean = self.sum_ns.load(Ordering::Relaxed).checked_div(count).unwrap_or(0);
        TimesSummary {
            count,
            last_us: microseconds(self.last_ns.load(Ordering::Relaxed)),
            mean_us: microseconds(mean),
            p50_us: percentile(500),
            p99_us: percentile(990),
            p999_us: percentile(999),
            max_us: microseconds(max_ns),
        }
    }

    /// The histogram: for each bucket that holds any, its largest time in microseconds and its count.
    pub fn histogram(&self) -> Vec<(f64, u64)> {
        let counts = self.buckets.iter().map(|bucket| bucket.load(Ordering::Relaxed));
        let filled = counts.enumerate().filter(|&(_, count)| count > 0);
        filled.map(|(bucket, count)| (microseconds(largest_in(bucket)), count)).collect()
    }
}

/// The times of a run that a clock paces.
#[derive(Debug)]
pub struct Timing {
    /// How late ticks began.
    pub lateness: Times,
    /// How long ticks took, with all that the executive does.
    pub ticks: Times,
    /// How long each scan of a task took, in the order of the program's tasks.
    pub tasks: Vec<(String, Times)>,
    overruns: AtomicU64,
    skipped: AtomicU64,
    /// When the process began, where that is known.
    started: Option<Instant>,
    /// How long after that the first tick began, in nanoseconds; 0 before.
    start_ns: AtomicU64,
}

impl Timing {
    /// Nothing is recorded yet. `started` is when the process began.
    pub fn new(program: &Program, started: Option<Instant>) -> Self {
        let tasks = program.tasks.iter().map(|task| (task.name.clone(), Times::default()));
        Self {
            lateness: Times::default(),
            ticks: Times::default(),
            tasks: tasks.collect(),
            overruns: AtomicU64::new(0),
            skipped: AtomicU64::new(0),
            started,
            start_ns: AtomicU64::new(0),
        }
    }

    /// A tick begins at this time.
    #[inline]
    pub(super) fn tick_begins(&self, now: Instant) {
        if self.start_ns.load(Ordering::Relaxed) == 0
            && let Some(started) = self.started
        {
            let time = now.saturating_duration_since(started).as_nanos();
            self.start_ns.store(u64::try_from(time).unwrap_or(u64::MAX).max(1), Ordering::Relaxed);
        }
    }

    /// Counts an overrun for which so many ticks are skipped.
    pub(super) fn count_overrun(&self, skipped: u64) {
        add(&self.overruns, 1);
        add(&self.skipped, skipped);
    }

    /// What was recorded so far.
    pub fn summary(&self) -> TimingSummary {
        let tasks = self.tasks.iter().map(|(name, times)| {
            let (name, times) = (name.clone(), times.summary());
            TaskSummary { name, times }
        });
        TimingSummary {
            start_us: microseconds(self.start_ns.load(Ordering::Relaxed)),
            overruns: self.overruns.load(Ordering::Relaxed),
            skipped: self.skipped.load(Ordering::Relaxed),
            lateness: self.lateness.summary(),
            ticks: self.ticks.summary(),
            tasks: tasks.filter(|task| task.times.count > 0).collect(),
        }
    }
}

/// Writes entries about ticks that need more than four fifths of their time: about the first one at once,
/// then at most one a minute.
#[derive(Debug, Default)]
pub(super) struct Budget {
    /// When the last entry was written.
    reported_at: Option<Instant>,
    /// How many such ticks there were since then, and the longest.
    count: u64,
    longest: Duration,
}

impl Budget {
    /// Looks at a tick that took the time `taken` of `period`, at the time `now`.
    pub(super) fn check(
        &mut self,
        tick: u64,
        taken: Duration,
        period: Duration,
        now: Instant,
        journal: &mut ScanJournal,
    ) {
        if taken <= period / 5 * 4 {
            return;
        }
        self.count += 1;
        self.longest = self.longest.max(taken);
        let since = self.reported_at.map(|at| now.saturating_duration_since(at));
        if since.is_none_or(|since| since >= BUDGET_INTERVAL) {
            let Self { count, longest, .. } = *self;
            journal.write(tick, EntryKind::Budget { taken: longest, period, count });
            *self = Self { reported_at: Some(now), ..Self::default() };
        }
    }
}

/// An engine that records how long each scan of a task takes.
pub struct TimedEngine<'a> {
    engine: &'a mut dyn Engine,
    timing: &'a Timing,
}

impl<'a> TimedEngine<'a> {
    /// Records the scans of an engine.
    pub fn new(engine: &'a mut dyn Engine, timing: &'a Timing) -> Self {
        Self { engine, timing }
    }

    /// The engine itself, for a run whose times are not recorded.
    pub fn engine(&mut self) -> &mut dyn Engine {
        self.engine
    }
}

impl Engine for TimedEngine<'_> {
    fn call(&mut self, task: usize, from: Option<ResumePoint>, scan: &mut Scan<'_>) -> Outcome {
        let start = Instant::now();
        let outcome = self.engine.call(task, from, scan);
        if let Some((_, times)) = self.timing.tasks.get(task) {
            times.record(start.elapsed());
        }
        outcome
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_time_lies_in_its_bucket() {
        let mut last = 0;
        for ns in (0..200_000).chain((18..40).map(|power| 1 << power)) {
            let bucket = bucket(ns);
            assert!(bucket >= last && bucket < BUCKETS, "{ns}");
            assert!(ns <= largest_in(bucket) && largest_in(bucket) <= ns + ns / 8 + 1, "{ns}");
            last = bucket;
        }
        assert_eq!(bucket(u64::MAX), BUCKETS - 1);
    }

    #[test]
    fn a_summary_has_the_shares_of_the_times() {
        let times = Times::default();
        assert_eq!(times.summary(), TimesSummary::default());
        for us in 1..=1000 {
            times.record(Duration::from_micros(us));
        }
        let summary = times.summary();
        assert_eq!((summary.count, summary.last_us, summary.max_us), (1000, 1000.0, 1000.0));
        assert_eq!(summary.mean_us, 500.5);
        for (found, exact) in
            [(summary.p50_us, 500.0), (summary.p99_us, 990.0), (summary.p999_us, 999.0)]
        {
            assert!(found >= exact && found <= exact * 1.125, "{found} for {exact}");
        }
        assert_eq!(times.histogram().iter().map(|(_, count)| count).sum::<u64>(), 1000);
    }
}
