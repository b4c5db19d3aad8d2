//! The journal in real time: a thread collects the entries of all others and hands their lines to the
//! threads that write them.

use std::collections::VecDeque;
use std::fs::File;
use std::io;
use std::sync::atomic::Ordering;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant, SystemTime};

use super::sink::Sink;
use super::{Entry, EntryKind, Journal, LossCounter, Mode, NO_TICK, line, sentence};
use crate::patient_writer::Progress;

/// How many entries of other threads wait at most.
const MAX_ENTRIES: usize = 4096;
/// Time between two looks at the queue of the scan's thread, which wakes nobody, since that would be
/// a system call.
const INTERVAL: Duration = Duration::from_millis(20);
/// Time between two sentences on standard error about overruns, or about losses of one output.
const SELDOM: Duration = Duration::from_secs(1);

/// What the threads of a journal share.
#[derive(Debug)]
pub(super) struct Queued {
    state: Mutex<State>,
    changed: Condvar,
    log: Option<Sink>,
    console: Option<Sink>,
}

#[derive(Debug, Default)]
struct State {
    entries: VecDeque<Entry>,
    losses: Vec<Losses>,
    closing: bool,
    finished: bool,
}

/// What one output has lost.
#[derive(Clone, Debug)]
struct Losses {
    output: &'static str,
    counter: LossCounter,
    told: u64,
    told_at: Option<Instant>,
}

impl Queued {
    pub(super) fn new(log: Option<File>, console: Option<File>) -> io::Result<Self> {
        Ok(Self {
            state: Mutex::default(),
            changed: Condvar::new(),
            log: log.map(|file| Sink::start("log", file)).transpose()?,
            console: console.map(|file| Sink::start("standard error", file)).transpose()?,
        })
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn tell_losses(&self, output: &'static str, counter: LossCounter) {
        let told = counter.total();
        self.lock().losses.push(Losses { output, counter, told, told_at: None });
    }

    /// Adds an entry; never waits for a file.
    pub(super) fn put(&self, entry: Entry) {
        let mut state = self.lock();
        // The collecting thread waits for nobody, so this happens only where entries are made
        // faster than they can be formatted.
        if state.entries.len() < MAX_ENTRIES {
            state.entries.push_back(entry);
        }
        drop(state);
        self.changed.notify_all();
    }

    /// How many entries wait to be collected.
    #[cfg(test)]
    pub(super) fn backlog(&self) -> usize {
        self.lock().entries.len()
    }

    /// Writes what waits, for at most `wait` for each destination.
    pub(super) fn finish(&self, wait: Duration) {
        let deadline = Instant::now() + wait;
        let mut state = self.lock();
        state.closing = true;
        self.changed.notify_all();
        while !state.finished && Instant::now() < deadline {
            let waited = self.changed.wait_timeout(state, INTERVAL);
            state = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
        drop(state);
        if let (Some(log), complete) = (&self.log, self.finish_log(wait))
            && let Some(console) = &self.console
        {
            let output = log.name();
            let (_, news) = log.news();
            let stuck = (!complete).then_some(EntryKind::OutputStuck { output });
            let troubles = news.into_iter().filter_map(|progress| kind_of(output, progress));
            for kind in troubles.chain(stuck) {
                console.push(sentence(&Entry { time: SystemTime::now(), tick: None, kind }));
            }
        }
        if let Some(console) = &self.console {
            // Where it is stuck, nobody is left to tell.
            let _ = console.finish(Instant::now() + wait);
        }
    }

    /// Writes the rest of the log; gives whether all of it is written.
    fn finish_log(&self, wait: Duration) -> bool {
        self.log.as_ref().is_none_or(|log| log.finish(Instant::now() + wait))
    }

    fn write_log(&self, entry: &Entry) {
        if let Some(log) = &self.log {
            log.push(line(entry));
        }
    }
}

/// Starts the thread that collects entries.
pub(super) fn start(
    journal: &Journal,
    scan: rtrb::Consumer<Entry>,
    progress: Option<Option<u64>>,
) -> io::Result<()> {
    let mut collector = Collector {
        journal: journal.clone(),
        scan,
        overruns: Overruns::default(),
        progress: progress.map(ProgressLine::new),
    };
    thread::Builder::new().name("journal".into()).spawn(move || collector.run())?;
    Ok(())
}

struct Collector {
    journal: Journal,
    scan: rtrb::Consumer<Entry>,
    overruns: Overruns,
    progress: Option<ProgressLine>,
}

/// Overruns that were not yet told on standard error.
#[derive(Debug, Default)]
struct Overruns {
    told_at: Option<Instant>,
    /// How many there were since then, and the longest.
    count: u64,
    longest: Duration,
}

impl Collector {
    fn run(&mut self) {
        loop {
            let Mode::Queued(queued) = &self.journal.shared.mode else { return };
            let mut state = queued.lock();
            if state.entries.is_empty() && !state.closing {
                let waited = queued.changed.wait_timeout(state, INTERVAL);
                state = waited.unwrap_or_else(PoisonError::into_inner).0;
            }
            let closing = state.closing;
            let mut entries: Vec<Entry> = state.entries.drain(..).collect();
            drop(state);
            while let Ok(entry) = self.scan.pop() {
                entries.push(entry);
            }
            entries.sort_by_key(|entry| entry.time);
            self.collect_troubles(&mut entries);
            self.collect_losses(&mut entries, closing);
            for entry in entries {
                self.tell(&entry);
            }
            self.tell_overruns(closing);
            self.show_progress(closing);
            if closing {
                let Mode::Queued(queued) = &self.journal.shared.mode else { return };
                queued.lock().finished = true;
                queued.changed.notify_all();
                return;
            }
        }
    }

    fn entry(&self, kind: EntryKind) -> Entry {
        let tick = Some(self.journal.shared.tick.load(Ordering::Relaxed));
        Entry { time: SystemTime::now(), tick: tick.filter(|&tick| tick != NO_TICK), kind }
    }

    /// What the threads that write have met with.
    fn collect_troubles(&self, entries: &mut Vec<Entry>) {
        let Mode::Queued(queued) = &self.journal.shared.mode else { return };
        for sink in [&queued.log, &queued.console].into_iter().flatten() {
            let output = sink.name();
            let (lost, news) = sink.news();
            for progress in news {
                if let Some(kind) = kind_of(output, progress) {
                    entries.push(self.entry(kind));
                }
            }
            if lost > 0 {
                entries.push(self.entry(EntryKind::Lost { output, count: lost }));
            }
        }
    }

    /// What counters say that outputs have lost.
    fn collect_losses(&self, entries: &mut Vec<Entry>, closing: bool) {
        let Mode::Queued(queued) = &self.journal.shared.mode else { return };
        let now = Instant::now();
        for losses in &mut queued.lock().losses {
            let total = losses.counter.total();
            let recent = losses.told_at.is_some_and(|at| now.duration_since(at) < SELDOM);
            if total != losses.told && (closing || !recent) {
                let count = total.wrapping_sub(losses.told);
                entries.push(self.entry(EntryKind::Lost { output: losses.output, count }));
                (losses.told, losses.told_at) = (total, Some(now));
            }
        }
    }

    fn tell(&mut self, entry: &Entry) {
        let Mode::Queued(queued) = &self.journal.shared.mode else { return };
        queued.write_log(entry);
        if let EntryKind::Overrun { late, .. } = entry.kind {
            let now = Instant::now();
            if self.overruns.told_at.is_some_and(|at| now.duration_since(at) < SELDOM) {
                self.overruns.count += 1;
                self.overruns.longest = self.overruns.longest.max(late);
                return;
            }
            self.overruns.told_at = Some(now);
        }
        self.print(sentence(entry));
    }

    /// Tells of the overruns that came too soon after one that was told.
    fn tell_overruns(&mut self, closing: bool) {
        let Overruns { told_at, count, longest } = self.overruns;
        let recent = told_at.is_some_and(|at| at.elapsed() < SELDOM);
        if count == 0 || (recent && !closing) {
            return;
        }
        self.overruns = Overruns { told_at: Some(Instant::now()), ..Overruns::default() };
        let late = longest.as_secs_f64() * 1000.0;
        let more = if count == 1 { "overrun" } else { "overruns" };
        self.print(format!("warning: {count} more {more}, the longest of {late:.1} ms\n"));
    }

    fn print(&mut self, text: String) {
        let Mode::Queued(queued) = &self.journal.shared.mode else { return };
        let Some(console) = &queued.console else { return };
        let erased = self.progress.as_mut().is_some_and(|line| std::mem::take(&mut line.visible));
        console.push(if erased { format!("\r\x1b[K{text}") } else { text });
    }

    fn show_progress(&mut self, closing: bool) {
        let Mode::Queued(queued) = &self.journal.shared.mode else { return };
        let (Some(console), Some(line)) = (&queued.console, &mut self.progress) else { return };
        let tick = self.journal.shared.tick.load(Ordering::Relaxed);
        if closing {
            if line.visible {
                console.push("\r\x1b[K".into());
            }
        } else if tick != NO_TICK
            && let Some(text) = line.update(tick.saturating_add(1))
        {
            console.push(text);
        }
    }
}

/// What an entry says of how writing an output went.
fn kind_of(output: &'static str, progress: Progress) -> Option<EntryKind> {
    match progress {
        Progress::Done | Progress::Waiting => None,
        Progress::Recovered => Some(EntryKind::OutputRecovered { output }),
        Progress::Failed(_, error) => Some(EntryKind::OutputFailed { output, error }),
        Progress::Closed => Some(EntryKind::OutputClosed { output }),
    }
}

/// The line on a terminal that says how many ticks have run.
#[derive(Debug)]
struct ProgressLine {
    ticks: Option<u64>,
    start: Instant,
    next: Instant,
    visible: bool,
}

impl ProgressLine {
    fn new(ticks: Option<u64>) -> Self {
        let start = Instant::now();
        Self { ticks, start, next: start + crate::progress::FIRST_SHOWN_AFTER, visible: false }
    }

    /// The line, if it is time to show it.
    fn update(&mut self, ticks: u64) -> Option<String> {
        let now = Instant::now();
        if now < self.next {
            return None;
        }
        self.next = now + crate::progress::UPDATE_INTERVAL;
        self.visible = true;
        let line = crate::progress::line(ticks, self.ticks, now.duration_since(self.start));
        Some(format!("\r{line}\x1b[K"))
    }
}
