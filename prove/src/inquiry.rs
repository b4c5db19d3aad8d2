//! How questions about a program are answered, one after the other.
//!
//! The program is followed once for all of them. What a question adds to the logic, as counters of a response, it adds to a copy.

use std::cell::OnceCell;
use std::collections::BTreeSet;
use std::time::{Duration, Instant};

use crate::question::{Answer, Question, Subject};
use crate::scan::Reason;
use crate::solve::{Deadline, Effort, Found, correspond, invariant, search};
use crate::stimulus;
use crate::system::{System, Time};

/// How many ticks are looked at at most.
const MOST_TICKS: usize = 100_000;

/// How many ticks are looked at before invariants are looked for with all the time that there is.
const FIRST_TICKS: usize = 24;

/// How many ticks are looked at before invariants are looked for that are found soon.
const SOON: usize = 6;

/// Some questions about a program.
#[expect(missing_debug_implementations, reason = "a station has none")]
pub struct Inquiry<'p> {
    subject: Subject<'p>,
    named: BTreeSet<String>,
    timed: OnceCell<Result<System, String>>,
    exact: OnceCell<Result<System, String>>,
}

impl<'p> Inquiry<'p> {
    /// What is needed to answer these questions. Nothing is done yet.
    pub fn new(subject: Subject<'p>, questions: &[Question]) -> Self {
        let named = questions.iter().flat_map(Question::variables).collect();
        Self { subject, named, timed: OnceCell::new(), exact: OnceCell::new() }
    }

    /// The program as logic, without any question.
    fn system(&self, time: Time) -> Result<&System, String> {
        let cell = match time {
            Time::Abstract => &self.timed,
            Time::Exact => &self.exact,
        };
        let system = cell.get_or_init(|| self.subject.source.system(time, &self.named));
        system.as_ref().map_err(Clone::clone)
    }

    /// The bits that the program gives to the control, flags and outputs, by their names.
    pub fn given(&self) -> Vec<String> {
        let Ok(system) = self.system(Time::Abstract) else { return vec![] };
        let bits = system.observed.iter().filter(|it| !it.is_retained && it.bits.len() == 1);
        bits.map(|it| it.name.clone()).collect()
    }

    /// Answers one of the questions within a time.
    ///
    /// # Errors
    /// When programs of the language can't be taken.
    pub fn answer(&self, question: &Question, time: Duration) -> Result<Answer, String> {
        let begin = Instant::now();
        let until = |part: f64| Deadline(Some(begin + time.mul_f64(part)));
        let exact_only = question.claim.conditions().any(|it| it.canonical.contains('#'));
        let mut known = 0;
        let mut exact = None;
        if !exact_only {
            let mut system = self.system(Time::Abstract)?.clone();
            let bad = self.subject.bad(&mut system, question, Time::Abstract);
            if !system.elapses.is_empty() {
                match search(&system, bad, 2 * FIRST_TICKS, true, until(0.25)) {
                    Found::Never(scans) => return Ok(Answer::Proved { scans: scans as u64 }),
                    Found::Run(trace) => {
                        if let Some(ticks) = stimulus::schedule(&system, &trace)
                            && let Some(answer) =
                                self.subject.tried(&system, &trace, &ticks, question)
                        {
                            return Ok(answer);
                        }
                    }
                    Found::Open(_) => {
                        if let Found::Never(scans) =
                            invariant(&system, bad, Effort::All, until(0.4))
                        {
                            return Ok(Answer::Proved { scans: scans as u64 });
                        }
                    }
                }
            } else {
                // Nothing is left open, so that it is the same.
                exact = Some((system, bad));
            }
        }
        let (mut system, bad) = match exact {
            Some(exact) => exact,
            None => {
                let mut system = self.system(Time::Exact)?.clone();
                let bad = self.subject.bad(&mut system, question, Time::Exact);
                (system, bad)
            }
        };
        let soon = || match search(&system, bad, SOON, true, until(0.3)) {
            Found::Open(SOON) => match invariant(&system, bad, Effort::Little, until(0.3)) {
                Found::Open(_) => search(&system, bad, FIRST_TICKS, true, until(0.7)),
                found => found,
            },
            found => found,
        };
        let found = match soon() {
            Found::Open(ticks) if ticks == FIRST_TICKS => {
                known = ticks;
                correspond(&mut system, &[bad], until(0.5));
                match invariant(&system, bad, Effort::All, until(0.7)) {
                    Found::Open(_) => search(&system, bad, MOST_TICKS, true, until(1.0)),
                    found => found,
                }
            }
            found => found,
        };
        match found {
            Found::Never(scans) => Ok(Answer::Proved { scans: scans as u64 }),
            Found::Open(ticks) => {
                let scans = ticks.max(known) as u64;
                let text = "the time was up".to_owned();
                Ok(Answer::Undecided { scans, reason: Reason { text, place: None } })
            }
            Found::Run(trace) => Ok(self.subject.after_run(&system, &trace, question)),
        }
    }
}
