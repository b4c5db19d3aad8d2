//! Writes to a file that may fail or be full for a while, and never loses its place.
//!
//! In real time no trouble with an output may end the run, so what writes an output has to go on
//! after an error. [`PatientWriter`] keeps the bytes that could not be written and continues at the
//! very byte at which the file stopped taking them, so that no line is torn when a full disk has
//! room again.

use std::io::{self, ErrorKind, Write};
use std::time::{Duration, Instant};

use plcc_files::{BackgroundWriter, Next, Retry};
use plcc_runtime::small_thread::small_thread;

/// How long a background writer waits before it looks again whether the file takes bytes.
const LOOK_AGAIN: Duration = Duration::from_millis(5);

/// What became of an attempt to write.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum WriteOutcome {
    /// Everything is written.
    Done,
    /// Everything is written, for the first time after an error.
    Recovered,
    /// The file took nothing or only a part; the rest is kept for a later attempt.
    Waiting,
    /// As `Waiting`, and this error is the first one since everything was last written.
    Failed(ErrorKind, String),
    /// Nobody will ever read it again (a pipe whose reader has left). All bytes are thrown away,
    /// now and from now on.
    Closed,
}

/// Bytes for a file, and how far they are written.
#[derive(Debug)]
pub(crate) struct PatientWriter<W> {
    to: W,
    /// The bytes that are to be written, those that are written already among them.
    pending: Vec<u8>,
    /// How many of them are written.
    written: usize,
    /// When the next attempt is made after an error.
    retry: Retry,
    /// Whether the reader has left.
    closed: bool,
}

impl<W: Write> PatientWriter<W> {
    /// Nothing is written yet.
    pub(crate) fn new(to: W) -> Self {
        Self { to, pending: Vec::new(), written: 0, retry: Retry::default(), closed: false }
    }

    /// Whether all bytes are written.
    pub(crate) fn is_empty(&self) -> bool {
        self.pending.is_empty()
    }

    /// Whether the reader has left.
    pub(crate) fn is_closed(&self) -> bool {
        self.closed
    }

    /// Where bytes are added, after those that wait.
    pub(crate) fn buffer(&mut self) -> &mut Vec<u8> {
        &mut self.pending
    }

    /// Tries to write everything that waits. After an error nothing is tried until its retry time
    /// has come; `now` is the present time.
    pub(crate) fn write(&mut self, now: Instant) -> WriteOutcome {
        if self.closed {
            self.pending.clear();
            return WriteOutcome::Closed;
        }
        if !self.retry.is_due(now) {
            return WriteOutcome::Waiting;
        }
        while let Some(rest) = self.pending.get(self.written..).filter(|rest| !rest.is_empty()) {
            let error = match self.to.write(rest) {
                Ok(0) => ErrorKind::WriteZero.into(),
                Ok(count) => {
                    self.written += count;
                    continue;
                }
                Err(error) if error.kind() == ErrorKind::Interrupted => continue,
                Err(error) => error,
            };
            return self.failed(&error, now);
        }
        self.pending.clear();
        self.written = 0;
        if self.retry.succeeded() { WriteOutcome::Recovered } else { WriteOutcome::Done }
    }

    fn failed(&mut self, error: &io::Error, now: Instant) -> WriteOutcome {
        if error.kind() == ErrorKind::BrokenPipe {
            self.closed = true;
            self.pending.clear();
            return WriteOutcome::Closed;
        }
        // Another process may have set the open file, which both share, to refuse bytes rather than to
        // wait (`O_NONBLOCK`). Then this error says that there is no room at present.
        if error.kind() == ErrorKind::WouldBlock {
            std::thread::sleep(Duration::from_millis(1));
            return WriteOutcome::Waiting;
        }
        if self.retry.failed(now) {
            WriteOutcome::Failed(error.kind(), plcc_files::why_not_written(error))
        } else {
            WriteOutcome::Waiting
        }
    }
}

/// Starts a thread of this name that writes, again and again, what `fill` appends to an empty buffer, after
/// what `writer` holds already. `fill` appends nothing where its queue is empty; it is looked into again after the time
/// `idle`. `report` is told of every outcome but `Done` and `Waiting`, of `Closed` once.
///
/// # Errors
/// When no thread can be started.
pub(crate) fn write_in_background(
    name: &str,
    mut writer: PatientWriter<impl Write + Send + 'static>,
    idle: Duration,
    mut fill: impl FnMut(&mut Vec<u8>) + Send + 'static,
    mut report: impl FnMut(WriteOutcome) + Send + 'static,
) -> io::Result<BackgroundWriter> {
    BackgroundWriter::start(small_thread(name), move |_| {
        // More is taken only when all before is written: what waits here is then never more than the queue holds.
        if writer.is_empty() {
            fill(writer.buffer());
            if writer.is_empty() {
                return Next::Idle(idle);
            }
        }
        let was_closed = writer.is_closed();
        match writer.write(Instant::now()) {
            WriteOutcome::Done => {}
            WriteOutcome::Waiting => return Next::Later(LOOK_AGAIN),
            WriteOutcome::Closed if was_closed => {}
            outcome => report(outcome),
        }
        Next::Continue
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The first pause of [`Retry`].
    const FIRST_RETRY: Duration = Duration::from_millis(50);

    /// Takes five bytes, then is full until `room` is made.
    struct Disk {
        taken: Vec<u8>,
        room: usize,
    }

    impl Write for &mut Disk {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            let count = bytes.len().min(self.room);
            if count == 0 {
                return Err(ErrorKind::StorageFull.into());
            }
            self.room -= count;
            self.taken.extend(&bytes[..count]);
            Ok(count)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn a_full_disk_tears_no_line() {
        let mut disk = Disk { taken: vec![], room: 5 };
        let now = Instant::now();
        let mut writer = PatientWriter::new(&mut disk);
        writer.buffer().extend(b"first line\n");
        assert!(matches!(writer.write(now), WriteOutcome::Failed(ErrorKind::StorageFull, _)));
        writer.buffer().extend(b"second line\n");
        assert_eq!(writer.write(now), WriteOutcome::Waiting, "the retry time has not come");
        let later = now + FIRST_RETRY;
        assert_eq!(writer.write(later), WriteOutcome::Waiting, "an error is told once");
        writer.to.room = 1000;
        assert_eq!(writer.write(later + FIRST_RETRY * 2), WriteOutcome::Recovered);
        assert!(writer.is_empty());
        writer.buffer().extend(b"third line\n");
        assert_eq!(writer.write(later + FIRST_RETRY * 2), WriteOutcome::Done);
        assert_eq!(disk.taken, b"first line\nsecond line\nthird line\n");
    }

    #[test]
    fn a_reader_that_has_left_is_written_to_no_more() {
        let (reader, to) = io::pipe().unwrap();
        drop(reader);
        let mut writer = PatientWriter::new(to);
        writer.buffer().extend(b"line\n");
        assert_eq!(writer.write(Instant::now()), WriteOutcome::Closed);
        assert!(writer.is_closed() && writer.is_empty());
    }
}
