//! Bounded search with k-induction: whether something can come about in one of the first ticks, and whether it cannot after as
//! many ticks in which it did not.

use super::sat::{Answer, Deadline};
use super::unroll::{Start, Trace, Unrolling};
use crate::logic::Lit;
use crate::system::System;

/// What a search has found.
#[derive(Clone, Debug)]
pub enum Found {
    /// It comes about: in the last tick of this run.
    Run(Trace),
    /// It never does; this many ticks were looked at.
    Never(usize),
    /// The time or the number of ticks was up; it does not come about in this many ticks.
    Open(usize),
}

/// Searches up to `most` ticks for one in which a literal of a system is true.
pub fn search(system: &System, bad: Lit, most: usize, induct: bool, deadline: Deadline) -> Found {
    let mut from_start = Unrolling::new(system, Start::PowerUp, deadline);
    let mut anywhere = Unrolling::new(system, Start::Anywhere, deadline);
    for tick in 0..most {
        match from_start.can_be(tick, bad) {
            Answer::Yes => return Found::Run(from_start.trace(tick)),
            Answer::No => from_start.require(tick, !bad),
            Answer::Unknown => return Found::Open(tick),
        }
        if induct && worth(tick) {
            match anywhere.can_be(tick, bad) {
                Answer::No => return Found::Never(tick + 1),
                Answer::Yes => {}
                Answer::Unknown => return Found::Open(tick),
            }
        }
        if induct {
            anywhere.require(tick, !bad);
        }
        if deadline.is_over() {
            return Found::Open(tick + 1);
        }
    }
    Found::Open(most)
}

/// Whether induction is tried after this number of ticks: after each of the first ones, and then ever more seldom.
fn worth(tick: usize) -> bool {
    tick < 8 || tick.is_power_of_two() || tick.is_multiple_of(16)
}
