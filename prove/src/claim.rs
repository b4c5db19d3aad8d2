//! What is asked of all ticks as logic: the condition that a tick breaks it.

use plcc_frontend::CheckedProgram;
use plcc_plctest::{Claim, Condition};
use plcc_runtime::Names;

use crate::condition::literal;
use crate::logic::{FALSE, Lit, TRUE};
use crate::system::{Elapse, First, System, Time};

/// The longest time of a response that is counted tick by tick where time is abstracted.
const FEW_TICKS: u64 = 24;

/// What claims are made of.
#[derive(Clone, Copy)]
pub(crate) struct Around<'p> {
    pub(crate) checked: &'p dyn CheckedProgram,
    pub(crate) names: &'p dyn Names,
    /// How long a tick is in nanoseconds.
    pub(crate) tick_ns: u64,
}

/// The literal that a tick breaks a claim. What is remembered from tick to tick becomes a part of the system.
pub(crate) fn broken(system: &mut System, claim: &Claim, around: Around<'_>, time: Time) -> Lit {
    let memory = system.memory.clone();
    let holds = |system: &mut System, condition: &Condition| {
        literal(&mut system.builder, &memory, condition, around.checked, around.names)
    };
    match claim {
        Claim::Each { holds: wanted, conditions } => {
            let mut bad = FALSE;
            for condition in conditions {
                let found = holds(system, condition);
                bad = system.graph().or(bad, found.complement_if(*wanted));
            }
            bad
        }
        Claim::Response { after, then, within } => {
            let after = holds(system, after);
            let mut answered = TRUE;
            for condition in then {
                let found = holds(system, condition);
                answered = system.graph().and(answered, found);
            }
            let within = within.ticks(around.tick_ns);
            let before = system.latch();
            system.becomes(before, after);
            let begins = system.graph().and(after, !before);
            let open = system.graph().and(begins, !answered);
            match within {
                0 => open,
                _ => {
                    let possible = possible(system, open, answered, within);
                    let is_long = time == Time::Abstract && within > FEW_TICKS;
                    let count = if is_long { left_open } else { counted };
                    let late = count(system, open, answered, within);
                    system.graph().and(late, possible)
                }
            }
        }
    }
}

/// Whether the time of a response can be up, as far as the times that are abstracted say: one that is shorter, and runs from
/// before on, is over by then.
fn possible(system: &mut System, open: Lit, answered: Lit, within: u64) -> Lit {
    let waits = system.latch();
    let due = system.graph().or(waits, open);
    let due = system.graph().and(due, !answered);
    system.becomes(waits, due);
    let mut possible = TRUE;
    for elapse in system.elapses.clone().into_iter().filter(|elapse| elapse.ticks <= within) {
        let since = system.latch();
        let graph = system.graph();
        let stays = graph.all([since, elapse.running, !elapse.expires, !elapse.starts]);
        let stays = graph.choose(waits, stays, TRUE);
        let stays = graph.and(stays, elapse.runs_on);
        let contradicts = match elapse.ticks == within {
            true => graph.and(since, !elapse.expires),
            false => since,
        };
        possible = graph.and(possible, !contradicts);
        system.becomes(since, stays);
    }
    possible
}

/// Counts the ticks since a response was due; `open` says that it is due from this tick on. The literal says that it comes too late.
fn counted(system: &mut System, open: Lit, answered: Lit, within: u64) -> Lit {
    let width = (u64::BITS - within.leading_zeros()) as usize;
    let count: Vec<Lit> = (0..width).map(|_| system.latch()).collect();
    let graph = system.graph();
    let waits = graph.is_not_zero(&count);
    let last = graph.number(width, within as i64);
    let is_last = graph.equal(&count, &last);
    let one = graph.number(width, 1);
    let more = graph.add(&count, &one);
    let more = graph.choose_bits(is_last, &count, &more);
    let begun: Vec<Lit> = one.iter().map(|&bit| graph.and(bit, open)).collect();
    let next = graph.choose_bits(waits, &more, &begun);
    let late = graph.and(is_last, !answered);
    for (&latch, next) in count.iter().zip(next) {
        let next = system.graph().and(next, !answered);
        system.becomes(latch, next);
    }
    late
}

/// Leaves open when the time of a response is up, as the times of the program are.
fn left_open(system: &mut System, open: Lit, answered: Lit, within: u64) -> Lit {
    let waits = system.latch();
    let expires = system.graph().input();
    let graph = system.graph();
    let late = graph.and(waits, expires);
    let goes_on = graph.and(waits, !expires);
    let goes_on = graph.or(goes_on, open);
    let next = graph.and(goes_on, !answered);
    system.becomes(waits, next);
    let starts = system.graph().and(open, !waits);
    let starts = system.graph().and(starts, next);
    let elapse = Elapse { running: waits, expires: late, runs_on: next, starts, ticks: within };
    system.elapses.push(elapse);
    system.graph().and(late, !answered)
}

impl System {
    /// A bit that is remembered beside what the control keeps; it is 0 at power-up.
    fn latch(&mut self) -> Lit {
        let lit = self.graph().input();
        let first = First::Constant(false);
        self.latches.push(crate::system::Latch { lit, first, next: lit, place: None });
        lit
    }

    /// Says what the bit becomes.
    fn becomes(&mut self, latch: Lit, next: Lit) {
        if let Some(latch) = self.latches.iter_mut().rev().find(|it| it.lit == latch) {
            latch.next = next;
        }
    }
}
