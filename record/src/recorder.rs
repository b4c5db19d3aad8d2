//! The recorder, which runs in the thread that runs the ticks. It notes what acts on the control, takes
//! checkpoints, and hands both over as frames to be written.

use std::borrow::Cow;
use std::io::{self, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant, SystemTime};

use rtrb::Producer;

use super::MAX_TICKS;
use super::entry::{self, Action, Entry, RecordedStop};
use super::file::{FrameKind, RecordFile};
use super::queue::{FRAME_HEADER, LargerQueue, frame_header};
use super::state_hash::StateHash;
use plcc_runtime::{Event, Executive, Stop};

/// Time of the machine from one checkpoint to the next.
const CHECKPOINT_INTERVAL: Duration = Duration::from_secs(30);
/// In real time the checkpoint that is then due is taken in the idle time after a tick. Where a computer has too
/// little of it for so many ticks of the interval in a row, one in this many, it is taken before a tick.
const PATIENCE: u64 = 4;
/// Bytes that are reserved for what is recorded of one tick, so that no tick allocates memory for it.
const TICK_ROOM: usize = 1 << 16;

/// Where a recorder puts what it records.
enum Sink {
    /// Into the file itself, in simulated time.
    File(Box<RecordFile>),
    /// Into the queue of the thread that writes, in real time.
    Queue(Producer<u8>),
}

/// What a recorder keeps for the program that runs. Making it allocates memory, so for an online change
/// it is made beforehand, in another thread.
#[derive(Debug)]
pub struct RecorderProgram {
    /// The program's number in the record: 0 for the one with which the run began, else what
    /// [`RecordedPrograms::add`](super::RecordedPrograms::add) gave.
    number: u16,
    hash: StateHash,
    /// A buffer for the state outside the image.
    state: Vec<u8>,
    /// A queue that has room for the program's checkpoints, where the one of the run has none.
    queue: Option<LargerQueue>,
}

impl RecorderProgram {
    /// `executive` is the program's.
    pub fn new(number: u16, executive: &dyn Executive, queue: Option<LargerQueue>) -> Self {
        let mut state = vec![];
        executive.state_into(&mut state);
        // Queues and sparse memory may grow.
        state.reserve(state.len() + TICK_ROOM);
        Self { number, hash: StateHash::new(executive), state, queue }
    }
}

/// Records a run. A [`ReplaceableExecutive`](crate::ReplaceableExecutive) has one where its run is
/// recorded, and tells it everything that acts on the control.
pub struct Recorder {
    sink: Sink,
    /// Why the file could not be written, which ends the record in simulated time.
    failure: Option<io::Error>,
    program: RecorderProgram,
    /// The number of the next tick; `skipped` ticks come before it that are not run.
    next_tick: u64,
    skipped: u64,
    /// How many online changes there were.
    generation: u16,
    /// What was noted of the next tick so far.
    entries: Vec<u8>,
    /// Whether a checkpoint is to be taken before anything of the next tick is noted. As long as the queue has no
    /// room for it, ticks are lost.
    due: bool,
    /// How many ticks may still pass until it is due, while it is to be taken in the idle time after one of them.
    patience: Option<u64>,
    /// How long the last checkpoint took, in real time. (One that was interrupted makes the next one wait, and no other.)
    cost: Duration,
    /// How many ticks were lost since the last frame that was handed over.
    lost: u64,
    /// How many ticks lie between two checkpoints.
    interval: u64,
    /// How many ticks there were since the last checkpoint.
    since_checkpoint: u64,
    wants_checkpoint: Arc<AtomicBool>,
    /// Whether the program was stopped in a tick that is recorded.
    stopped: bool,
}

impl std::fmt::Debug for Recorder {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Recorder").field("next_tick", &self.next_tick).finish_non_exhaustive()
    }
}

impl Recorder {
    /// Records into a file that this thread itself writes, for simulated time. `executive` is the one
    /// that will run, at power-up.
    pub fn to_file(file: RecordFile, executive: &dyn Executive) -> Self {
        let wants_checkpoint = file.wants_checkpoint();
        Self::new(Sink::File(Box::new(file)), wants_checkpoint, executive)
    }

    /// Records into the queue of a [`RecordThread`](super::RecordThread).
    pub(super) fn to_queue(
        queue: Producer<u8>,
        wants_checkpoint: Arc<AtomicBool>,
        executive: &dyn Executive,
    ) -> Self {
        Self::new(Sink::Queue(queue), wants_checkpoint, executive)
    }

    fn new(sink: Sink, wants_checkpoint: Arc<AtomicBool>, executive: &dyn Executive) -> Self {
        let tick_ns = executive.tick_ns().max(1);
        let interval = CHECKPOINT_INTERVAL.as_nanos() as u64 / tick_ns;
        Self {
            sink,
            failure: None,
            program: RecorderProgram::new(0, executive, None),
            next_tick: 0,
            skipped: 0,
            generation: 0,
            entries: Vec::with_capacity(TICK_ROOM),
            due: true,
            patience: None,
            cost: Duration::ZERO,
            lost: 0,
            interval: interval.clamp(1, MAX_TICKS),
            since_checkpoint: 0,
            wants_checkpoint,
            stopped: false,
        }
    }

    /// Takes a checkpoint if one is due. This is called before each tick and before everything that acts
    /// on the control. Once something was noted of the next tick, the checkpoint waits until that tick is
    /// over: what was noted has changed the state already, and a replay would do it again.
    pub(crate) fn checkpoint_if_due(&mut self, executive: &dyn Executive) {
        if !self.entries.is_empty() {
            return;
        }
        if self.wants_checkpoint.load(Ordering::Relaxed) {
            self.wants_checkpoint.store(false, Ordering::Relaxed);
            // Until it comes, the writing thread can keep no tick.
            self.due = true;
        }
        if self.due {
            self.take_checkpoint(executive);
        }
    }

    /// Takes the checkpoint that is wanted, if `idle` is time enough for it. This is called after a tick, when its
    /// outputs are out: a checkpoint of a PMAC copies some hundred kilobytes, for which the program would otherwise wait.
    pub(crate) fn checkpoint_in_idle_time(&mut self, executive: &dyn Executive, idle: Duration) {
        // Twice the time that it took is left: the caches may be colder, and the next tick must begin in time.
        if self.patience.is_some() && self.entries.is_empty() && idle > self.cost * 2 {
            self.take_checkpoint(executive);
        }
    }

    /// Whether a checkpoint is to be taken in idle time.
    pub(crate) fn waits_for_idle_time(&self) -> bool {
        self.patience.is_some()
    }

    /// Notes something that is about to act on the control.
    pub(crate) fn act(&mut self, executive: &dyn Executive, action: Action) {
        self.checkpoint_if_due(executive);
        if let Action::Skip(count) = action {
            self.skipped = self.skipped.saturating_add(count);
        }
        if !self.due {
            Entry::Action(action).write(&mut self.entries);
        }
    }

    /// Records a tick that has ended, with its events and why the program was stopped in it, if it was.
    /// `executive` is in the state after it.
    pub(crate) fn end_tick(
        &mut self,
        executive: &dyn Executive,
        events: &[Event],
        result: Result<(), &Stop>,
    ) {
        let first = self.next_tick;
        let ticks = self.skipped.saturating_add(1);
        self.next_tick = self.next_tick.saturating_add(ticks);
        self.skipped = 0;
        if self.due {
            self.entries.clear();
            self.lost = self.lost.saturating_add(ticks);
            return;
        }
        for decision in executive.clock_decisions() {
            Entry::Clock(*decision).write(&mut self.entries);
        }
        for event in events {
            Entry::Event((&event.body).into()).write(&mut self.entries);
        }
        if let Err(stop) = result {
            Entry::Stop(Cow::Owned(RecordedStop::from(stop))).write(&mut self.entries);
            self.stopped = true;
        }
        entry::end_tick(self.program.hash.add(executive.image()), &mut self.entries);
        let entries = std::mem::take(&mut self.entries);
        let written = self.push(FrameKind::Tick, first, &[&entries]);
        self.entries = entries;
        self.entries.clear();
        if !written {
            (self.due, self.lost) = (true, ticks);
            return;
        }
        self.since_checkpoint = self.since_checkpoint.saturating_add(ticks);
        match &mut self.patience {
            Some(ticks) => {
                *ticks = ticks.saturating_sub(1);
                self.due |= *ticks == 0;
            }
            None if self.since_checkpoint >= self.interval => match &self.sink {
                Sink::File(_) => self.due = true,
                Sink::Queue(_) => self.patience = Some(self.interval / PATIENCE),
            },
            None => {}
        }
    }

    /// Goes on with another program, which has taken the place of the one that ran. `program` is what the recorder
    /// keeps for the new one, and becomes what it kept for the former one.
    pub(super) fn replaced(&mut self, program: &mut RecorderProgram) {
        // What acted on the control since the last tick is in the state that was taken over.
        self.entries.clear();
        self.next_tick = self.next_tick.saturating_add(self.skipped);
        (self.skipped, self.due) = (0, true);
        self.generation = self.generation.wrapping_add(1);
        program.hash.set(self.program.hash.value());
        if let (Some(larger), Sink::Queue(queue)) = (&mut program.queue, &mut self.sink) {
            larger.put_in_use(queue);
        }
        std::mem::swap(&mut self.program, program);
    }

    /// The run has ended. `stop` is why the control stopped the program, if it did.
    ///
    /// # Errors
    /// Why the record could not be written, in simulated time.
    pub(crate) fn end(mut self, stop: Option<&Stop>) -> io::Result<()> {
        if let Some(stop) = stop.filter(|_| !self.stopped) {
            Entry::Stop(Cow::Owned(RecordedStop::from(stop))).write(&mut self.entries);
        }
        if self.lost > 0 {
            self.push(FrameKind::Gap, self.next_tick, &[&self.lost.to_le_bytes()]);
        }
        let hash = self.program.hash.value().to_le_bytes();
        let entries = std::mem::take(&mut self.entries);
        self.push(FrameKind::End, self.next_tick, &[&hash, &entries]);
        self.failure.map_or(Ok(()), Err)
    }

    /// Takes a checkpoint and hands it over, if there is room for it.
    fn take_checkpoint(&mut self, executive: &dyn Executive) {
        // Ticks that were skipped while no checkpoint could be taken are part of the state, and count as lost.
        self.next_tick = self.next_tick.saturating_add(self.skipped);
        self.lost = self.lost.saturating_add(self.skipped);
        self.skipped = 0;
        let begun = matches!(self.sink, Sink::Queue(_)).then(Instant::now);
        let image = executive.image();
        self.program.state.clear();
        executive.state_into(&mut self.program.state);
        let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
        let mut head = [0; 32];
        let numbers = [
            u64::from(self.program.number)
                | u64::from(self.generation) << 16
                | (image.len() as u64) << 32,
            self.program.hash.value(),
            now.as_millis() as u64,
            executive.fingerprint(),
        ];
        for (place, number) in head.chunks_exact_mut(8).zip(numbers) {
            place.copy_from_slice(&number.to_le_bytes());
        }
        if let Sink::Queue(queue) = &self.sink {
            // The ticks after it need some room, too.
            let needed = head.len() + image.len() + self.program.state.len() + TICK_ROOM;
            if queue.slots() < needed {
                return;
            }
        }
        if self.lost > 0 {
            self.push(FrameKind::Gap, self.next_tick, &[&self.lost.to_le_bytes()]);
        }
        let state = std::mem::take(&mut self.program.state);
        let written = self.push(FrameKind::Checkpoint, self.next_tick, &[&head, image, &state]);
        self.program.state = state;
        if written {
            (self.due, self.patience) = (false, None);
            (self.lost, self.since_checkpoint) = (0, 0);
        }
        if let Some(begun) = begun {
            self.cost = begun.elapsed();
        }
    }

    /// Hands a frame over; gives whether there was room for it, or in simulated time whether it was written.
    fn push(&mut self, kind: FrameKind, tick: u64, parts: &[&[u8]]) -> bool {
        match &mut self.sink {
            Sink::File(file) => {
                if self.failure.is_none() {
                    self.failure = file.take(kind, tick, parts).err();
                }
                self.failure.is_none()
            }
            Sink::Queue(queue) => {
                let length = parts.iter().map(|part| part.len()).sum::<usize>();
                if queue.slots() < FRAME_HEADER + length {
                    return false;
                }
                let header = frame_header(kind, length, tick);
                // There is room for all of it, and nobody else puts anything in.
                let written = queue.write_all(&header);
                written.is_ok() && parts.iter().all(|part| queue.write_all(part).is_ok())
            }
        }
    }
}
