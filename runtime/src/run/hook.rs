//! What is done between two ticks besides the program: saving retained data, serving the image and
//! the socket, showing progress.

use plcc_abi::Engine;

use crate::journal::ScanJournal;
use crate::{Executive, Stop};

/// Something that the thread which runs the ticks does between them.
///
/// In real time an implementation must not wait, allocate memory or make a system call, but to read the
/// clock: what needs one of these is handed to another thread.
pub trait Hook {
    /// Called when a tick begins: it is due, and neither its stimulus nor anything else of it was done.
    /// The first tick is among them.
    fn before_tick(&mut self, _now: &mut BeforeTick<'_>) {}

    /// Called when a tick has ended and was reported, also the one in which the program was stopped.
    fn after_tick(&mut self, _now: &mut AfterTick<'_>) {}
}

/// What a hook sees and may change before a tick.
pub struct BeforeTick<'a> {
    /// The tick that begins, from 0.
    pub tick: u64,
    /// The control.
    pub executive: &'a mut dyn Executive,
    /// The engine that executes its program.
    pub engine: &'a mut dyn Engine,
    /// Set by a hook that has stopped the program for now: the tick is not done, and hooks are asked
    /// again when the time of the next one has come. Its number stays the same.
    pub hold: bool,
    /// Where the hook tells what it did.
    pub journal: &'a mut ScanJournal,
}

/// What a hook sees and may change after a tick.
pub struct AfterTick<'a> {
    /// How many ticks have begun: the number of the tick that has ended, plus one.
    pub ticks: u64,
    /// The control.
    pub executive: &'a mut dyn Executive,
    /// The engine that executes its program.
    pub engine: &'a mut dyn Engine,
    /// Why the control stopped the program in this tick, if it did: this was the last tick then.
    pub stop: Option<&'a Stop>,
    /// Where the hook tells what it did.
    pub journal: &'a mut ScanJournal,
}
