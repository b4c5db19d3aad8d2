//! What the clock alone decides about a tick: where a module of NCT is suspended because its time is
//! used up, whether a real-time interrupt of PMAC took too long, where a watchdog stops a scan.
//!
//! Everything else in a tick follows from the state before it and from what acts on it from outside.
//! So an executive notes these decisions, the flight recorder keeps them, and an
//! executive that replays the tick follows them instead of its clock.

use serde::{Deserialize, Serialize};

/// How many decisions of one tick are noted without allocating memory. A tick has one for each call of a
/// module at most, and NCT's `:002` is called up to twenty times.
const ROOM: usize = 32;

/// One decision. Calls of modules and background steps are counted from 0 in each tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ClockDecision {
    /// NCT: a call of a module was suspended at its safepoint of this number, counted from 1.
    Suspended {
        /// Which call.
        call: u32,
        /// How many safepoints it passed.
        safepoints: u32,
    },
    /// NCT: a call of a module was stopped at its safepoint of this number, counted from 1, since its
    /// time was used up (PLC TIMEOUT).
    Stopped {
        /// Which call.
        call: u32,
        /// How many safepoints it passed.
        safepoints: u32,
    },
    /// PMAC: PLC0 and PLCC0 took longer than until the next real-time interrupt.
    Overdue,
    /// PMAC: the watchdog tripped at the real-time interrupt, and this is why.
    InterruptTripped(Trip),
    /// PMAC: the watchdog tripped after this background step.
    BackgroundTripped {
        /// Which background step.
        step: u32,
    },
    /// The watchdog stopped a scan in its middle. How far the scan had come can't be told by counting,
    /// so a replay of the tick is not exact; nothing follows it.
    Cut,
}

/// Why PMAC's watchdog tripped at a real-time interrupt.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Trip {
    /// Interrupts came less than 50 times a second.
    Slow,
    /// Background was not done for too many interrupts.
    Starved,
}

/// The decisions of a tick: those that were made, or those that are to be followed.
#[derive(Clone, Debug)]
pub(crate) struct ClockDecisions {
    /// Those of this tick, made or followed.
    list: Vec<ClockDecision>,
    /// Those that this tick follows; `None` where the clock decides.
    followed: Option<Vec<ClockDecision>>,
}

impl Default for ClockDecisions {
    fn default() -> Self {
        Self { list: Vec::with_capacity(ROOM), followed: None }
    }
}

impl ClockDecisions {
    /// Another tick begins.
    pub(crate) fn begin_tick(&mut self) {
        self.list.clear();
    }

    /// Notes a decision.
    pub(crate) fn note(&mut self, decision: ClockDecision) {
        self.list.push(decision);
    }

    /// The decisions of the last tick.
    pub(crate) fn noted(&self) -> &[ClockDecision] {
        &self.list
    }

    /// Sets what the next tick follows.
    pub(crate) fn follow(&mut self, decisions: Option<&[ClockDecision]>) {
        self.followed = decisions.map(<[_]>::to_vec);
    }

    /// The decisions that this tick follows, if it does not ask the clock.
    pub(crate) fn followed(&self) -> Option<&[ClockDecision]> {
        self.followed.as_deref()
    }

    /// Whether this tick follows decisions, and this one is among them.
    pub(crate) fn follows(&self, decision: ClockDecision) -> bool {
        self.followed.as_ref().is_some_and(|list| list.contains(&decision))
    }
}
