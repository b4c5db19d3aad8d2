//! What the socket's thread asks of the thread that runs the ticks, and how it is answered.
//!
//! Both go through queues of fixed length. All memory is allocated and freed by the socket's thread:
//! a command comes back with its answer, and whatever a command has replaced comes back in it.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use rtrb::{Consumer, Producer, RingBuffer};

use crate::image_file::State;
use crate::replacement::Replacement;
use plcc_runtime::{Setting, Value, VariableKey};

/// How many commands and how many answers wait at most.
const QUEUE: usize = 64;

/// One variable of a command.
#[derive(Clone, Debug)]
pub(crate) struct Item {
    /// Which.
    pub(crate) key: VariableKey,
    /// What it is set or forced to; nothing for reading and for ending a force.
    pub(crate) setting: Option<Setting>,
    /// What it was forced to before, in a batch that forces.
    pub(crate) before: Option<Setting>,
    /// The value that was read.
    pub(crate) value: Value,
}

impl Item {
    /// A variable that is read, set to a value, or whose force ends.
    pub(crate) fn new(key: VariableKey, setting: Option<Setting>) -> Self {
        Self { key, setting, before: None, value: Value::Int(0) }
    }
}

/// Some variables that are read, set or forced. All are done in one tick where they are at most
/// [`VALUES_PER_TICK`](plcc_protocol::VALUES_PER_TICK), else in as many as it takes. Forces are never more than that.
#[derive(Clone, Debug)]
pub(crate) struct Batch {
    pub(crate) items: Vec<Item>,
    /// How many are done.
    pub(crate) done: usize,
    /// The forces in effect afterwards, for a batch that forces, which has room for as many as there can be.
    pub(crate) forces: Vec<(VariableKey, Setting)>,
    /// Which item could not be set or forced, and why. Then none of them is; of a batch that takes several ticks none of
    /// that item's tick and of later ones.
    pub(crate) refused: Option<(usize, &'static str)>,
    /// The tick before which the first item was done.
    pub(crate) first_tick: u64,
    /// The process image when the last item is read, for a batch that has room for it: as many bytes as the image has.
    pub(crate) image: Vec<u8>,
}

impl Batch {
    pub(crate) fn new(items: Vec<Item>) -> Self {
        Self { items, done: 0, forces: vec![], refused: None, first_tick: 0, image: vec![] }
    }
}

/// What the socket's thread asks for.
#[derive(Debug)]
pub(crate) enum Command {
    /// Read variables.
    Read(Box<Batch>),
    /// Set variables.
    Write(Box<Batch>),
    /// Force variables, or end their forces.
    Force(Box<Batch>),
    /// Do no more ticks, and give outputs their safe values.
    Stop,
    /// Go on with ticks.
    Start,
    /// Run another program from now on, or from the first tick on in which that can be done. It is answered when it is
    /// done, or can't be, or is withdrawn.
    Replace(Box<Replacement>),
    /// Give a replacement back that waits. It has no answer of its own: the replacement has one in any case.
    Withdraw,
}

/// A command that was carried out.
#[derive(Debug)]
pub(crate) struct Answer {
    /// The command, with what it read or replaced.
    pub(crate) command: Command,
    /// The tick before which it was carried out.
    pub(crate) tick: u64,
    /// How long it took.
    pub(crate) took: Duration,
}

/// The end of both queues that belongs to the thread that runs the ticks.
#[derive(Debug)]
pub(crate) struct ScanEnd {
    pub(crate) commands: Consumer<Command>,
    pub(crate) answers: Producer<Answer>,
}

/// The end of both queues that belongs to the socket's thread.
#[derive(Debug)]
pub(crate) struct SocketEnd {
    pub(crate) commands: Producer<Command>,
    pub(crate) answers: Consumer<Answer>,
}

/// Makes both queues.
pub(crate) fn queues() -> (ScanEnd, SocketEnd) {
    let (to_scan, commands) = RingBuffer::new(QUEUE);
    let (answers, from_scan) = RingBuffer::new(QUEUE);
    (ScanEnd { commands, answers }, SocketEnd { commands: to_scan, answers: from_scan })
}

/// How far the run has come, for the socket's thread to look at while ticks run. The two numbers are
/// stored one after the other, so that a reader may get the state of one tick and the number of the
/// next.
#[derive(Debug, Default)]
pub(crate) struct RunProgress {
    ticks: AtomicU64,
    state: AtomicU64,
}

impl RunProgress {
    /// Notes how far the run has come.
    pub(crate) fn set(&self, ticks: u64, state: State) {
        self.ticks.store(ticks, Ordering::Relaxed);
        self.state.store(state.number(), Ordering::Relaxed);
    }

    /// How many ticks have been done.
    pub(crate) fn ticks(&self) -> u64 {
        self.ticks.load(Ordering::Relaxed)
    }

    /// What the control is doing.
    pub(crate) fn state(&self) -> State {
        State::from_number(self.state.load(Ordering::Relaxed)).unwrap_or(State::Prepared)
    }
}
