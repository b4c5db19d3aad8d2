//! What is done between two ticks besides the program: saving retained data, serving the image and
//! the socket, showing progress.

use std::time::{Duration, Instant};

use plcc_abi::Engine;

use super::Player;
use super::pace::Clock;
use crate::journal::ScanJournal;
use plcc_control::Watch;
use plcc_runtime::{Executive, Stop};

/// Something that the thread which runs the ticks does between them.
///
/// In real time an implementation must not wait, allocate memory or make a system call, but to read the
/// clock: what needs one of these is handed to another thread.
pub trait Hook {
    /// Called for every tick, also the first one, when it is due and nothing of it is done yet, not even its
    /// stimulus.
    fn before_tick(&mut self, _now: &mut BeforeTick<'_>) {}

    /// Called for every tick, also the one in which the program was stopped, when it has ended and its
    /// trace and events are written.
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
    /// The stimulus.
    pub player: &'a mut Player,
    /// What the trace shows.
    pub watch: &'a mut Watch,
    /// Set by a hook while the program is to stand still: the tick is not done, and hooks are called again
    /// when the next tick is due, which has the same number.
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
    /// Where ticks are paced: the clock, and when the next tick is due.
    pub next_tick: Option<(&'a dyn Clock, Instant)>,
    /// Where the hook tells what it did.
    pub journal: &'a mut ScanJournal,
}

impl AfterTick<'_> {
    /// How much time is left until the next tick is due; none where nothing paces the ticks. It reads the clock.
    pub fn idle_time(&self) -> Duration {
        self.next_tick
            .map_or(Duration::ZERO, |(clock, due)| due.saturating_duration_since(clock.now()))
    }
}
