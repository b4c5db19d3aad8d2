//! Why a statement has put out its text, or has not: `SEND`, `DISPLAY` and `COMMAND` of a PMAC. The answer is about the statement: which
//! conditions led to it, or kept it from being executed.

use std::rc::Rc;

use plcc_replay::DebugError;
use plcc_runtime::{Event, EventBody};

use crate::Question;
use crate::changes::{LONGEST_SEGMENT, Origin, SEGMENT};
use crate::explanation::{ChangedBy, Explanation};
use crate::inquiry::{Inquiry, Moment};
use crate::reasons::Reasons;
use crate::tree::Root;

/// The step at which a statement was executed, and the statement.
type Execution = (Moment, u32);

/// The statements that put out a text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct AskedText {
    pub(crate) text: String,
    pub(crate) statements: Vec<u32>,
}

impl AskedText {
    /// Whether an event is the text that is put out.
    pub(crate) fn is_put_out_by(&self, event: &Event) -> bool {
        match &event.body {
            EventBody::Send { text, .. }
            | EventBody::Command { text, .. }
            | EventBody::Macro { text } => **text == *self.text,
            EventBody::Display { text, .. } => text.to_string() == self.text,
            EventBody::Fault { .. }
            | EventBody::Message { .. }
            | EventBody::Simulator(_)
            | EventBody::Stop { .. }
            | EventBody::Motion(_) => false,
        }
    }
}

impl Inquiry<'_> {
    /// The answer for a text at a moment.
    pub(crate) fn text(
        mut self,
        asked: &AskedText,
        at: Moment,
        question: &Question,
    ) -> Result<Explanation, DebugError> {
        let mut at = at;
        let mut executed = self.last_execution(asked, at)?;
        let mut earlier = None;
        if executed.is_none() {
            earlier = self.put_out_before(asked, at.tick)?;
            if let Some(found) = earlier.filter(|_| question.looks_back) {
                let tick = found.0.tick;
                let step = self.trace(tick)?.steps.len();
                (at, executed) = (Moment { tick, step }, Some(found));
            }
        }
        let Some(&first) = asked.statements.first() else {
            return Err(DebugError::new("no statement puts out this text"));
        };
        let statement = match (executed, earlier) {
            (Some((_, statement)), _) | (None, Some((_, statement))) => statement,
            (None, None) => first,
        };
        let reasons = match executed {
            Some((step, statement)) => self.reasons_of_execution(step, statement, at)?,
            None => self.reasons_against(asked, at)?,
        };
        let changed_by = self.place(statement).map(|place| ChangedBy::Statement {
            file: self.program.sources().path(place.file).to_owned(),
            line: place.line,
        });
        let changed_by = changed_by.unwrap_or(ChangedBy::Control);
        let first = self.history.first();
        let (since, changed_by) = match (executed, earlier) {
            (Some((step, _)), _) => (step.tick, changed_by),
            (None, Some((step, _))) => (step.tick, changed_by),
            (None, None) if first == 0 => (0, ChangedBy::PowerUp),
            (None, None) => (first, ChangedBy::BeforeRecord),
        };
        let origin = Origin { since, changed_by, statement: Some(statement) };
        let variable = Rc::new(self.new_variable(self.excerpt(statement), None));
        let value = if executed.is_some() { 1.0 } else { 0.0 };
        let root = Root { variable, value, at, reasons, origin: Some(origin) };
        let would = match executed {
            None if question.would => Some(self.would_put_out(asked, at)?),
            _ => None,
        };
        self.answer(root, would)
    }

    /// The last execution of one of the statements in the last scans before a moment.
    fn last_execution(
        &mut self,
        asked: &AskedText,
        at: Moment,
    ) -> Result<Option<Execution>, DebugError> {
        let round = self.round(at)?;
        let executed = asked.statements.iter();
        let executed = executed.filter_map(|one| Some((*round.latest.get(one)?, *one)));
        Ok(executed.max_by_key(|(at, _)| *at))
    }

    /// The last execution of one of the statements in the ticks before one.
    fn put_out_before(
        &mut self,
        asked: &AskedText,
        before: u64,
    ) -> Result<Option<Execution>, DebugError> {
        let first = self.history.first();
        let mut end = before;
        let mut length = SEGMENT;
        while end > first {
            let begin = end.saturating_sub(length).max(first);
            self.history.go_before(begin)?;
            let mut ticks = vec![];
            for tick in begin..end {
                let result = self.history.run_unobserved(tick)?;
                if result.events.iter().any(|event| asked.is_put_out_by(event)) {
                    ticks.push(tick);
                }
            }
            // Another statement may have put out the same text.
            for tick in ticks.into_iter().rev() {
                let trace = self.trace(tick)?;
                let mut steps = trace.steps.iter().enumerate().rev();
                let found = steps.find(|(_, step)| asked.statements.contains(&step.statement));
                if let Some((number, step)) = found {
                    return Ok(Some((Moment { tick, step: number }, step.statement)));
                }
            }
            end = begin;
            length = (length * 2).min(LONGEST_SEGMENT);
        }
        Ok(None)
    }

    /// What has led to a statement that was executed at a step.
    fn reasons_of_execution(
        &mut self,
        step: Moment,
        statement: u32,
        at: Moment,
    ) -> Result<Reasons, DebugError> {
        let round = self.round(at)?;
        let mut reasons = Reasons { written: Some((step, statement)), ..Reasons::default() };
        self.add_guards(None, (step, statement), &round, &mut reasons)?;
        Ok(reasons)
    }

    /// What has kept all of the statements from being executed.
    fn reasons_against(&mut self, asked: &AskedText, at: Moment) -> Result<Reasons, DebugError> {
        let round = self.round(at)?;
        let mut reasons = Reasons::default();
        for &statement in &asked.statements {
            self.add_blockers(None, statement, &round, &mut reasons)?;
        }
        Ok(reasons)
    }
}
