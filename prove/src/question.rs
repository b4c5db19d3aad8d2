//! Questions about a program, and how they are answered.

use std::time::Duration;

use plcc_frontend::CheckedProgram;
use plcc_plctest::{Claim, Progress};
use plcc_runtime::{Executive, Names};

use crate::aiger::{self, Coding};
use crate::claim::{Around, broken};
use crate::control::Source;
use crate::inquiry::Inquiry;
use crate::logic::Lit;
use crate::scan::Reason;
use crate::solve::Trace;
use crate::stimulus::{self, Row, Station};
use crate::system::{System, Time};

/// What is asked: that something is so in all ticks.
#[derive(Clone, Debug)]
pub struct Question {
    /// The question as it was asked.
    pub text: String,
    /// What it says of all ticks.
    pub claim: Claim,
}

impl Question {
    /// The names of the variables that it reads.
    pub(crate) fn variables(&self) -> impl Iterator<Item = String> {
        let conditions = self.claim.conditions();
        conditions.flat_map(|condition| condition.variables().map(str::to_owned))
    }

    /// Says of each tick that is run, one after the other, whether it is one that must not be.
    fn watch(&self) -> impl FnMut(&dyn Executive) -> bool {
        let mut progress = Progress::default();
        move |executive| {
            let breach = self.claim.breach(&mut progress, executive);
            breach.is_some_and(|breach| !breach.has_no_value)
        }
    }
}

/// The answer.
#[derive(Clone, Debug)]
pub enum Answer {
    /// It is so in every tick.
    Proved {
        /// How many ticks were looked at.
        scans: u64,
    },
    /// It is not so.
    Refuted {
        /// After how many ticks.
        scans: u64,
        /// A stimulus with which the interpreter has come to such a tick.
        stimulus: String,
    },
    /// It is not known whether it is.
    Undecided {
        /// In how many ticks it is so.
        scans: u64,
        /// Why more is not known.
        reason: Reason,
    },
}

/// The program that is asked about.
#[derive(Clone, Copy)]
#[expect(missing_debug_implementations, reason = "a station has none")]
pub struct Subject<'p> {
    /// The program, checked.
    pub checked: &'p dyn CheckedProgram,
    /// The same, as it is made into logic.
    pub source: Source<'p>,
    /// The names of its variables.
    pub names: &'p dyn Names,
    /// Where runs are tried.
    pub station: &'p dyn Station,
}

impl Subject<'_> {
    /// Answers a question within a time.
    ///
    /// # Errors
    /// When programs of the language can't be taken.
    pub fn answer(&self, question: &Question, time: Duration) -> Result<Answer, String> {
        Inquiry::new(*self, std::slice::from_ref(question)).answer(question, time)
    }

    /// The program and some questions as an AIGER file, in which time is followed tick by tick. Whether a question is broken is a
    /// property `bad` of it; so is that the logic does not follow the program.
    ///
    /// # Errors
    /// When programs of the language can't be taken.
    pub fn aiger(&self, questions: &[Question], coding: Coding) -> Result<aiger::File, String> {
        let named = questions.iter().flat_map(Question::variables).collect();
        let mut system = self.source.system(Time::Exact, &named)?;
        let mut bad = vec![];
        for question in questions {
            bad.push((question.text.clone(), self.bad(&mut system, question, Time::Exact)));
        }
        let called = aiger::bits_of(self.names);
        let called = |offset, bit| called.get(&(offset, bit)).cloned();
        Ok(aiger::write(&system, &bad, &called, coding))
    }

    /// The literal that a tick is one that must not be, or one in which the logic does not follow the program.
    pub(crate) fn bad(&self, system: &mut System, question: &Question, time: Time) -> Lit {
        let tick_ns = self.station.executive().tick_ns();
        let around = Around { checked: self.checked, names: self.names, tick_ns };
        let bad = broken(system, &question.claim, around, time);
        let running = system.running;
        let bad = system.graph().and(bad, running);
        let escape = system.escape();
        system.graph().or(bad, escape)
    }

    /// The answer where the interpreter comes to a tick that must not be, with the inputs of a run.
    pub(crate) fn tried(
        &self,
        system: &System,
        trace: &Trace,
        ticks: &[u64],
        question: &Question,
    ) -> Option<Answer> {
        let rows = stimulus::rows(system, trace, ticks);
        let last = *ticks.last()?;
        let run = |rows: &[Row], last| {
            stimulus::run(self.station, &stimulus::csv(rows), last, &mut question.watch())
        };
        let found = run(&rows, last)?;
        let (rows, last) = stimulus::without_needless(rows, found, &run);
        Some(Answer::Refuted { scans: last + 1, stimulus: stimulus::csv(&rows) })
    }

    /// The answer after a run of the logic that follows time exactly.
    pub(crate) fn after_run(&self, system: &System, trace: &Trace, question: &Question) -> Answer {
        let ticks: Vec<u64> = (0..trace.ticks.len() as u64).collect();
        if let Some(answer) = self.tried(system, trace, &ticks, question) {
            return answer;
        }
        let scans = ticks.len().saturating_sub(1) as u64;
        Answer::Undecided { scans, reason: reason(system, trace) }
    }
}

/// Why a run of the logic is not one of the program.
pub(crate) fn reason(system: &System, trace: &Trace) -> Reason {
    let builder = &system.builder;
    let last = trace.ticks.len().saturating_sub(1);
    let escaped = builder.escapes.iter().find(|(lit, _)| {
        (0..=last).any(|tick| stimulus::evaluate(system, trace, tick, *lit) == Some(true))
    });
    let unknown = || {
        let nodes = trace.ticks.iter().flat_map(|tick| tick.keys());
        nodes.filter_map(|node| builder.unknown.get(node)).min()
    };
    let number = escaped.map(|(_, reason)| reason).or_else(unknown);
    number.and_then(|&number| builder.reasons.get(number as usize)).cloned().unwrap_or_else(|| {
        let text =
            "the run that was found does not come about in the interpreter; please report this";
        Reason { text: text.into(), place: None }
    })
}
