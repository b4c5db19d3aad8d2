//! Threads that write files in the background, so that nobody waits for a disk, a pipe or a terminal: the rule by which
//! they all wait, try again and end.
//!
//! What is written waits in a queue of bounded length, which belongs to the job. A thread that must not make a system call
//! (the one that runs the ticks) only fills the queue, and the writer looks into it again and again; others
//! [wake](BackgroundWriter::wake) the writer. At the end the writer gets a bounded time ([`BackgroundWriter::finish`]); if that
//! does not suffice, since the thread is stuck in a system call, it is left behind.

use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, Builder, Thread};
use std::time::{Duration, Instant};

/// The pause after the first failure.
const FIRST_PAUSE: Duration = Duration::from_millis(50);
/// The longest pause; each is twice as long as the one before, up to this.
const LONGEST_PAUSE: Duration = Duration::from_secs(1);

/// Says when something that has failed is tried again: after 50 ms, then after pauses that double up to a second.
#[derive(Clone, Copy, Debug, Default)]
pub struct Retry {
    /// Since the first failure: when the next attempt is made, and the pause after it.
    next: Option<(Instant, Duration)>,
}

impl Retry {
    /// Whether an attempt may be made now: nothing has failed, or the pause is over.
    pub fn is_due(&self, now: Instant) -> bool {
        self.next.is_none_or(|(at, _)| now >= at)
    }

    /// An attempt has failed. Returns whether that is the first one since something succeeded.
    pub fn failed(&mut self, now: Instant) -> bool {
        let is_first = self.next.is_none();
        let pause = self.next.map_or(FIRST_PAUSE, |(_, pause)| pause);
        self.next = Some((now + pause, (pause * 2).min(LONGEST_PAUSE)));
        is_first
    }

    /// An attempt has succeeded. Returns whether one had failed before.
    pub fn succeeded(&mut self) -> bool {
        self.next.take().is_some()
    }

    /// Where something has failed, the next attempt is made at once and the pauses begin anew.
    pub fn begin_anew(&mut self, now: Instant) {
        self.next = self.next.map(|_| (now, FIRST_PAUSE));
    }
}

/// What a job does after a round.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Next {
    /// Another round at once.
    Continue,
    /// Nothing is left: another round after this time or when somebody wakes the thread. If the end has come, the thread
    /// ends.
    Idle(Duration),
    /// Something is left that can't be written now: another round after this time, even at the end.
    Later(Duration),
    /// The thread ends with something left; the text says why.
    Failed(String),
}

/// The time of [`Next::Idle`] for jobs whose queue is filled by threads that wake the writer.
pub const UNTIL_WOKEN: Duration = Duration::MAX;

/// Why a writer has not written everything.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Unfinished {
    /// It has not come back in time, and is left behind.
    Stuck,
    /// It has given up; the text says why.
    Failed(String),
}

/// A thread that writes in the background, as other threads hold it. Dropping it leaves the thread to itself.
#[derive(Debug)]
pub struct BackgroundWriter {
    ending: Arc<AtomicBool>,
    result: Mutex<Receiver<Result<(), String>>>,
    thread: Thread,
}

impl BackgroundWriter {
    /// Starts a thread that calls `round` again and again. Its argument says whether the end has come: nothing more will be
    /// put into the queue than is in it at the beginning of that round.
    ///
    /// # Errors
    /// When no thread can be started.
    pub fn start(
        thread: Builder,
        mut round: impl FnMut(bool) -> Next + Send + 'static,
    ) -> io::Result<Self> {
        let ending = Arc::new(AtomicBool::new(false));
        let (done, result) = sync_channel(1);
        let flag = Arc::clone(&ending);
        let thread = thread.spawn(move || {
            // A mistake in plcc must not end more than this writer.
            let end = catch_unwind(AssertUnwindSafe(|| rounds(&mut round, &flag)));
            // What it holds is given back (a lock, an open file) before anybody learns that it has ended.
            drop(catch_unwind(AssertUnwindSafe(move || drop(round))));
            // Nobody listens where the thread was left behind.
            let _ = done.send(end.unwrap_or_else(|_| Err("an internal error of plcc".into())));
        })?;
        Ok(Self { ending, result: Mutex::new(result), thread: thread.thread().clone() })
    }

    /// Has the next round begin now. It is a system call.
    pub fn wake(&self) {
        self.thread.unpark();
    }

    /// Has the thread write what is left and end, and waits for that until `deadline` at most. To be called once.
    ///
    /// # Errors
    /// When not everything is written then.
    pub fn finish(&self, deadline: Instant) -> Result<(), Unfinished> {
        self.ending.store(true, Ordering::Release);
        self.wake();
        let result = self.result.lock().unwrap_or_else(PoisonError::into_inner);
        match result.recv_timeout(deadline.saturating_duration_since(Instant::now())) {
            Ok(result) => result.map_err(Unfinished::Failed),
            Err(_) => Err(Unfinished::Stuck),
        }
    }
}

fn rounds(round: &mut impl FnMut(bool) -> Next, ending: &AtomicBool) -> Result<(), String> {
    loop {
        // Looked at before the queue, so that nothing is missed that was put there before the end.
        let ends = ending.load(Ordering::Acquire);
        match round(ends) {
            Next::Continue => {}
            Next::Idle(_) if ends => return Ok(()),
            Next::Idle(time) | Next::Later(time) => thread::park_timeout(time),
            Next::Failed(why) => return Err(why),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::{Sender, channel};

    use super::*;

    /// Longer than any test takes.
    fn far() -> Instant {
        Instant::now() + Duration::from_secs(600)
    }

    #[test]
    fn what_is_in_the_queue_at_the_end_is_written() {
        let (put, queue) = channel();
        let (write, file) = channel();
        let round = move |_| match queue.try_recv() {
            Ok(line) => {
                write.send(line).unwrap();
                Next::Continue
            }
            Err(_) => Next::Idle(UNTIL_WOKEN),
        };
        let writer = BackgroundWriter::start(Builder::new(), round).unwrap();
        put.send(1).unwrap();
        writer.wake();
        assert_eq!(file.recv(), Ok(1));
        (2..5).for_each(|line| put.send(line).unwrap());
        assert_eq!(writer.finish(far()), Ok(()));
        assert_eq!(file.iter().collect::<Vec<i32>>(), [2, 3, 4]);
    }

    #[test]
    fn a_writer_that_is_stuck_is_left_behind_and_others_say_why_they_failed() {
        let (never, stuck) = channel::<()>();
        let round = move |_| {
            let _ = stuck.recv();
            Next::Idle(UNTIL_WOKEN)
        };
        let writer = BackgroundWriter::start(Builder::new(), round).unwrap();
        assert_eq!(writer.finish(Instant::now()), Err(Unfinished::Stuck));
        drop(never);
        let full = |_| Next::Failed("the disk is full".into());
        let writer = BackgroundWriter::start(Builder::new(), full).unwrap();
        assert_eq!(writer.finish(far()), Err(Unfinished::Failed("the disk is full".into())));
        let mistake = |_| -> Next { std::panic::resume_unwind(Box::new(())) };
        let writer = BackgroundWriter::start(Builder::new(), mistake).unwrap();
        assert_eq!(
            writer.finish(far()),
            Err(Unfinished::Failed("an internal error of plcc".into()))
        );
    }

    #[test]
    fn what_a_job_holds_is_given_back_before_its_end_is_told() {
        struct Held(Sender<()>);
        impl Drop for Held {
            fn drop(&mut self) {
                let _ = self.0.send(());
            }
        }
        let (give_back, given_back) = channel();
        let held = Held(give_back);
        let round = move |_| {
            let _ = &held;
            Next::Idle(UNTIL_WOKEN)
        };
        let writer = BackgroundWriter::start(Builder::new(), round).unwrap();
        assert_eq!(writer.finish(far()), Ok(()));
        assert_eq!(given_back.try_recv(), Ok(()));
    }

    #[test]
    fn pauses_double_up_to_a_second() {
        let mut retry = Retry::default();
        let mut now = Instant::now();
        assert!(retry.is_due(now) && !retry.succeeded());
        for pause in [50, 100, 200, 400, 800, 1000, 1000] {
            assert_eq!(retry.failed(now), pause == 50);
            let after = now + Duration::from_millis(pause);
            assert!(!retry.is_due(after - Duration::from_millis(1)) && retry.is_due(after));
            now = after;
        }
        retry.begin_anew(now);
        assert!(retry.is_due(now) && !retry.failed(now));
        assert!(retry.is_due(now + FIRST_PAUSE) && retry.succeeded() && retry.is_due(now));
    }
}
