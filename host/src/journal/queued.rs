//! The journal in real time: a thread collects the entries of all others and hands their lines to the
//! threads that write them.

use std::collections::VecDeque;
use std::fs::File;
use std::io;
use std::sync::atomic::Ordering;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant, SystemTime};

use super::progress_line::{FIRST_SHOWN_AFTER, UPDATE_INTERVAL, progress_line};
use super::sink::Sink;
use super::{Destinations, Entry, EntryKind, Journal, LossCounter, Mode, NO_TICK, line, sentence};
use crate::patient_writer::WriteOutcome;
use plcc_runtime::small_thread::small_thread;

/// How many entries of other threads than the one that runs the ticks wait at most.
const MAX_ENTRIES: usize = 4096;
/// Time between two looks at the queue of the thread that runs the ticks. That thread wakes nobody, since
/// that would be a system call.
const INTERVAL: Duration = Duration::from_millis(20);
/// Time between two sentences on standard error about overruns, or about losses of one output.
const SELDOM: Duration = Duration::from_secs(1);
/// How many faults and messages of the program standard error shows within that time.
const MOST_ANNOUNCED: u32 = 20;

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
    /// How many entries found no room since the last entry about that.
    lost: u64,
    losses: Vec<Losses>,
    /// Whether the run has ended, so that the collecting thread is to end.
    closing: bool,
    /// Whether it has handed all lines on.
    finished: bool,
}

/// What one output has lost.
#[derive(Clone, Debug)]
struct Losses {
    output: &'static str,
    counter: LossCounter,
    /// What the counter was when an entry was last written about it, and when that was.
    reported: u64,
    reported_at: Option<Instant>,
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
        let reported = counter.total();
        self.lock().losses.push(Losses { output, counter, reported, reported_at: None });
    }

    /// Adds an entry; never waits for a file.
    pub(super) fn put(&self, entry: Entry) {
        let mut state = self.lock();
        // The collecting thread waits for nobody, so there is no room only where entries are made faster
        // than they can be formatted.
        if state.entries.len() < MAX_ENTRIES {
            state.entries.push_back(entry);
        } else {
            state.lost += 1;
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
            let (count, outcomes) = log.take_reports();
            let lost = (count > 0).then_some(EntryKind::Lost { output, count });
            let stuck = (!complete).then_some(EntryKind::OutputStuck { output });
            let troubles = outcomes.into_iter().filter_map(|outcome| trouble(output, outcome));
            for kind in troubles.chain(lost).chain(stuck) {
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
        if let Some(log) = self.log.as_ref().filter(|_| entry.kind.is_logged()) {
            log.push(line(entry));
        }
    }
}

/// Starts the thread that collects entries.
pub(super) fn start(
    journal: &Journal,
    scan: rtrb::Consumer<Entry>,
    terminal: Terminal,
) -> io::Result<()> {
    let mut collector = Collector {
        journal: journal.clone(),
        scan,
        overruns: Overruns::default(),
        announced: Announced::default(),
        terminal,
    };
    small_thread("journal").spawn(move || collector.run())?;
    Ok(())
}

/// What the collecting thread works on.
struct Collector {
    journal: Journal,
    scan: rtrb::Consumer<Entry>,
    overruns: Overruns,
    announced: Announced,
    terminal: Terminal,
}

/// What is to be known of the console where that is a terminal.
#[derive(Debug)]
pub(super) struct Terminal {
    /// The line that shows the progress of the run.
    progress: Option<ProgressLine>,
    /// As in [`Destinations::removes_progress`].
    removes_progress: bool,
}

impl Terminal {
    pub(super) fn new(to: &Destinations) -> Self {
        let progress = to.progress.map(ProgressLine::new);
        Self { progress, removes_progress: to.removes_progress }
    }
}

/// How many faults and messages of the program were printed lately.
#[derive(Debug, Default)]
struct Announced {
    /// When the first of them was.
    since: Option<Instant>,
    printed: u32,
    /// How many came too soon after them.
    left_out: u64,
}

/// Overruns about which no sentence was printed yet.
#[derive(Debug, Default)]
struct Overruns {
    reported_at: Option<Instant>,
    /// How many there were since the last sentence, and the longest.
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
            let lost = std::mem::take(&mut state.lost);
            drop(state);
            if lost > 0 {
                entries.push(self.entry(EntryKind::Lost { output: "log", count: lost }));
            }
            while let Ok(entry) = self.scan.pop() {
                entries.push(entry);
            }
            entries.sort_by_key(|entry| entry.time);
            self.collect_troubles(&mut entries);
            self.collect_losses(&mut entries, closing);
            for entry in entries {
                self.hand_on(&entry);
            }
            self.print_overruns(closing);
            self.print_left_out(closing);
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

    /// Adds entries on what has kept the writing threads from writing.
    fn collect_troubles(&self, entries: &mut Vec<Entry>) {
        let Mode::Queued(queued) = &self.journal.shared.mode else { return };
        for sink in [&queued.log, &queued.console].into_iter().flatten() {
            let output = sink.name();
            let (lost, outcomes) = sink.take_reports();
            for outcome in outcomes {
                if let Some(kind) = trouble(output, outcome) {
                    entries.push(self.entry(kind));
                }
            }
            if lost > 0 {
                entries.push(self.entry(EntryKind::Lost { output, count: lost }));
            }
        }
    }

    /// Adds entries on what outputs have lost, as their counters say.
    fn collect_losses(&self, entries: &mut Vec<Entry>, closing: bool) {
        let Mode::Queued(queued) = &self.journal.shared.mode else { return };
        let now = Instant::now();
        for losses in &mut queued.lock().losses {
            let total = losses.counter.total();
            let recent = losses.reported_at.is_some_and(|at| now.duration_since(at) < SELDOM);
            if total != losses.reported && (closing || !recent) {
                let count = total.wrapping_sub(losses.reported);
                entries.push(self.entry(EntryKind::Lost { output: losses.output, count }));
                (losses.reported, losses.reported_at) = (total, Some(now));
            }
        }
    }

    /// Hands an entry on to the threads that write, as a line of the log and as a sentence. Of overruns
    /// that follow each other too soon no sentence is made at once.
    fn hand_on(&mut self, entry: &Entry) {
        let Mode::Queued(queued) = &self.journal.shared.mode else { return };
        queued.write_log(entry);
        if let EntryKind::Overrun { late, .. } = entry.kind {
            let now = Instant::now();
            if self.overruns.reported_at.is_some_and(|at| now.duration_since(at) < SELDOM) {
                self.overruns.count += 1;
                self.overruns.longest = self.overruns.longest.max(late);
                return;
            }
            self.overruns.reported_at = Some(now);
        }
        if matches!(entry.kind, EntryKind::Announced { .. }) {
            self.print_left_out(false);
            let announced = &mut self.announced;
            announced.since.get_or_insert_with(Instant::now);
            if announced.printed >= MOST_ANNOUNCED {
                announced.left_out += 1;
                return;
            }
            announced.printed += 1;
        }
        self.print(sentence(entry));
    }

    /// Prints a sentence about the overruns that came too soon after one that was printed.
    fn print_overruns(&mut self, closing: bool) {
        let Overruns { reported_at, count, longest } = self.overruns;
        let recent = reported_at.is_some_and(|at| at.elapsed() < SELDOM);
        if count == 0 || (recent && !closing) {
            return;
        }
        self.overruns = Overruns { reported_at: Some(Instant::now()), ..Overruns::default() };
        let late = longest.as_secs_f64() * 1000.0;
        let more = if count == 1 { "overrun" } else { "overruns" };
        self.print(format!("warning: {count} more {more}, the longest of {late:.1} ms\n"));
    }

    /// Says how many faults and messages were left out, and has further ones printed again, once the time for that has come.
    fn print_left_out(&mut self, closing: bool) {
        let Announced { since, left_out, .. } = self.announced;
        let recent = since.is_none_or(|since| since.elapsed() < SELDOM);
        if recent && !closing {
            return;
        }
        self.announced = Announced::default();
        if left_out > 0 {
            self.print(format!(
                "note: {left_out} more faults and messages came and went; --events FILE writes all of them\n"
            ));
        }
    }

    fn print(&mut self, text: String) {
        let Mode::Queued(queued) = &self.journal.shared.mode else { return };
        let Some(console) = &queued.console else { return };
        let Terminal { progress, removes_progress } = &mut self.terminal;
        let visible = progress.as_mut().is_some_and(|line| std::mem::take(&mut line.visible));
        console.push(if visible || *removes_progress { format!("\r\x1b[K{text}") } else { text });
    }

    fn show_progress(&mut self, closing: bool) {
        let Mode::Queued(queued) = &self.journal.shared.mode else { return };
        let (Some(console), Some(line)) = (&queued.console, &mut self.terminal.progress) else {
            return;
        };
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

/// The entry that tells how an attempt to write an output went, where that is worth one.
pub(crate) fn trouble(output: &'static str, outcome: WriteOutcome) -> Option<EntryKind> {
    match outcome {
        WriteOutcome::Done | WriteOutcome::Waiting => None,
        WriteOutcome::Recovered => Some(EntryKind::OutputRecovered { output }),
        WriteOutcome::Failed(_, error) => Some(EntryKind::OutputFailed { output, error }),
        WriteOutcome::Closed => Some(EntryKind::OutputClosed { output }),
    }
}

/// The line on a terminal that says how many ticks have run.
#[derive(Debug)]
struct ProgressLine {
    /// How many ticks the whole run has, if that is known.
    ticks: Option<u64>,
    start: Instant,
    /// When the line is shown or updated next.
    next: Instant,
    /// Whether the line is shown.
    visible: bool,
}

impl ProgressLine {
    fn new(ticks: Option<u64>) -> Self {
        let start = Instant::now();
        Self { ticks, start, next: start + FIRST_SHOWN_AFTER, visible: false }
    }

    /// The line, if it is time to show it.
    fn update(&mut self, ticks: u64) -> Option<String> {
        let now = Instant::now();
        if now < self.next {
            return None;
        }
        self.next = now + UPDATE_INTERVAL;
        self.visible = true;
        let line = progress_line(ticks, self.ticks, now.duration_since(self.start));
        Some(format!("\r{line}\x1b[K"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_that_find_no_room_are_counted() {
        let queued = Queued::new(None, None).unwrap();
        for _ in 0..MAX_ENTRIES + 3 {
            let kind = EntryKind::Note { text: "note".into() };
            queued.put(Entry { time: SystemTime::now(), tick: None, kind });
        }
        let state = queued.lock();
        assert_eq!((state.entries.len(), state.lost), (MAX_ENTRIES, 3));
    }
}
