//! The reasons for the value of a variable at a moment: the operands of the statement that has written it, of the conditions
//! that have led there, and of those that kept other statements from being executed.

use std::rc::Rc;

use plcc_frontend::common::{Accessed, Value};
use plcc_replay::DebugError;

use crate::inquiry::{Inquiry, Moment};
use crate::operands::{Decided, Operand};
use crate::round::{Round, SharedRound};
use crate::variable::Variable;

/// How often statements of one scan are followed back that each give a variable a value that they make of its own.
const MOST_FOLLOWED: usize = 50;

/// Why a variable has its value.
#[derive(Clone, Debug, Default)]
pub(crate) struct Reasons {
    /// The statement that has written it in the last scans: the step, and the statement's number.
    pub(crate) written: Option<(Moment, u32)>,
    /// What holds the value.
    pub(crate) operands: Vec<Operand>,
    /// The tasks with a statement that would give it another value, none of which runs.
    pub(crate) idle: Vec<usize>,
}

impl Reasons {
    fn add(&mut self, operands: Vec<Operand>) {
        for operand in operands {
            let is_known = |known: &Operand| known.accessed == operand.accessed;
            if !self.operands.iter().any(is_known) {
                self.operands.push(operand);
            }
        }
    }
}

impl Inquiry<'_> {
    /// The reasons for the value that a variable has at a moment.
    pub(crate) fn reasons(
        &mut self,
        variable: &Rc<Variable>,
        value: f64,
        at: Moment,
    ) -> Result<Reasons, DebugError> {
        let round = self.round(at)?;
        let image = self.image(at)?;
        let written = self.last_write(variable, &round)?;
        let mut reasons = Reasons { written, ..Reasons::default() };
        let parts = self.checked().parts(&variable.name, &image);
        if !parts.is_empty() {
            for part in parts.iter().filter(|part| part.holds) {
                let variable = self.named(&part.name);
                let Some(value) = variable.value_in(&image) else { continue };
                let accessed = variable.accessed;
                let operand = Operand { accessed, variable: Some(variable), value, at };
                reasons.add(vec![operand]);
            }
            return Ok(reasons);
        }
        if self.checked().counts_time(&variable.name, &image) {
            // A statement may have started it; what it is now, time has made of it.
            reasons.written = None;
            return Ok(reasons);
        }
        if let Some((step, statement)) = written {
            let decided = Decided::Value(Rc::clone(variable));
            let operands = self.operands(step, &decided)?;
            self.add_followed(Some(variable), operands, &mut reasons)?;
            let of = Some((variable, value));
            self.add_guards(of, (step, statement), &round, &mut reasons)?;
        }
        self.add_others(variable, value, (&image, &round), &mut reasons)?;
        // A statement that gives a constant which was there already holds it nevertheless: what would give another one before it, it
        // would overwrite.
        if let Some(written) = reasons.written.filter(|_| reasons.operands.is_empty()) {
            self.add_guards(None, written, &round, &mut reasons)?;
        }
        Ok(reasons)
    }

    /// Adds operands. Registers that are handed on, and what the variable itself was before, are followed to what
    /// holds those.
    fn add_followed(
        &mut self,
        of: Option<&Rc<Variable>>,
        operands: Vec<Operand>,
        reasons: &mut Reasons,
    ) -> Result<(), DebugError> {
        let mut open = operands;
        open.reverse();
        while let Some(operand) = open.pop() {
            match (&operand.variable, operand.accessed) {
                (None, Some(register)) => {
                    let mut found = self.handed_on(register, operand.at)?;
                    found.reverse();
                    open.extend(found);
                }
                (Some(variable), _) if of.is_some_and(|of| variable.name == of.name) => {
                    // What an earlier scan has left is not a reason.
                    let Some(of) = of else { continue };
                    if self.followed < MOST_FOLLOWED && self.is_written_before(of, operand.at)? {
                        self.followed += 1;
                        let value = operand.value.number();
                        let earlier = self.reasons(of, value, operand.at);
                        self.followed -= 1;
                        reasons.add(earlier?.operands);
                    }
                }
                _ => reasons.add(vec![operand]),
            }
        }
        Ok(())
    }

    /// Whether a variable was written in the same tick before a step.
    fn is_written_before(&mut self, variable: &Variable, at: Moment) -> Result<bool, DebugError> {
        let round = self.round(at)?;
        let written = self.last_write(variable, &round)?;
        Ok(written.is_some_and(|(step, _)| step.tick == at.tick))
    }

    /// The operands that hold a register that was handed to the statement at a step.
    fn handed_on(&mut self, register: Accessed, at: Moment) -> Result<Vec<Operand>, DebugError> {
        let trace = self.trace(at.tick)?;
        let Some(&reader) = trace.steps.get(at.step) else { return Ok(vec![]) };
        for number in (0..at.step).rev() {
            let Some(&step) = trace.steps.get(number) else { break };
            if step.call != reader.call {
                break;
            }
            let effects = self.effects(step.task, step.statement);
            if effects.writes.iter().any(|(written, _)| *written == register) {
                let step = Moment { tick: at.tick, step: number };
                return self.operands(step, &Decided::HandedOn(register));
            }
        }
        Ok(vec![])
    }

    /// The last statement of a round that has written a variable.
    fn last_write(
        &mut self,
        variable: &Variable,
        round: &Round,
    ) -> Result<Option<(Moment, u32)>, DebugError> {
        for &at in &round.steps {
            let trace = self.trace(at.tick)?;
            let mut writes = trace.accesses(at.step).iter().filter(|access| access.is_write);
            if writes.any(|write| self.is_met(variable, write.variable)) {
                let statement = trace.steps.get(at.step).map(|step| step.statement);
                return Ok(statement.map(|statement| (at, statement)));
            }
        }
        Ok(None)
    }

    /// Adds what holds the conditions on the way to a statement; of one that has written a variable, those before which the
    /// variable had another value.
    pub(crate) fn add_guards(
        &mut self,
        of: Option<(&Rc<Variable>, f64)>,
        (step, statement): (Moment, u32),
        round: &Round,
        reasons: &mut Reasons,
    ) -> Result<(), DebugError> {
        let mut seen = vec![];
        let mut open = vec![statement];
        while let Some(at) = open.pop() {
            if seen.contains(&at) {
                continue;
            }
            seen.push(at);
            for guard in self.graph.guards(at).to_vec() {
                let Some(execution) = round.execution(guard.condition, step) else { continue };
                if self.way_taken(execution)? != Some(guard.way) {
                    continue;
                }
                let counts = match of {
                    Some((variable, value)) => {
                        let image = self.image(execution)?;
                        variable.value_in(&image).map(Value::number) != Some(value)
                    }
                    None => true,
                };
                if counts {
                    let operands = self.operands(execution, &Decided::Way)?;
                    self.add_followed(of.map(|of| of.0), operands, reasons)?;
                }
                open.push(guard.condition);
            }
            let callers = self.graph.callers(at).to_vec();
            let called = callers.into_iter().filter(|&call| round.execution(call, step).is_some());
            open.extend(called);
        }
        Ok(())
    }

    /// Adds what kept statements from being executed that would have given the variable another value.
    fn add_others(
        &mut self,
        variable: &Rc<Variable>,
        value: f64,
        (image, round): (&[u8], &SharedRound),
        reasons: &mut Reasons,
    ) -> Result<(), DebugError> {
        for writer in self.writers(variable) {
            if round.latest.contains_key(&writer) {
                continue;
            }
            if self.would_write(writer, variable, image).is_none_or(|other| other == value) {
                continue;
            }
            self.add_blockers(Some(variable), writer, round, reasons)?;
        }
        Ok(())
    }

    /// Adds what kept a statement from being executed; `of` is the variable that it would have written.
    pub(crate) fn add_blockers(
        &mut self,
        of: Option<&Rc<Variable>>,
        statement: u32,
        round: &Round,
        reasons: &mut Reasons,
    ) -> Result<(), DebugError> {
        let task = self.task_of(statement);
        let (blockers, is_reached) = self.blockers(statement, round)?;
        if blockers.is_empty() && !is_reached && !round.tasks.contains(&task) {
            reasons.idle.push(task);
        }
        for (at, condition) in blockers {
            // What stands before the statement that has written it would be overwritten.
            let is_overwritten = reasons
                .written
                .is_some_and(|(_, last)| statement < last && !self.graph.depends(last, condition));
            if !is_overwritten {
                let operands = self.operands(at, &Decided::Way)?;
                self.add_followed(of, operands, reasons)?;
            }
        }
        Ok(())
    }

    /// The conditions that went another way than that to a statement, each with the step, and whether anything on the way was
    /// executed at all.
    fn blockers(
        &mut self,
        statement: u32,
        round: &Round,
    ) -> Result<(Vec<(Moment, u32)>, bool), DebugError> {
        let mut found: Vec<(Moment, u32)> = vec![];
        let mut is_reached = false;
        let mut seen = vec![];
        let mut open = vec![statement];
        while let Some(at) = open.pop() {
            if seen.contains(&at) {
                continue;
            }
            seen.push(at);
            for guard in self.graph.guards(at).to_vec() {
                match round.latest.get(&guard.condition) {
                    Some(&step) => {
                        is_reached = true;
                        if self.way_taken(step)?.is_some_and(|way| way != guard.way)
                            && !found.iter().any(|(_, condition)| *condition == guard.condition)
                        {
                            found.push((step, guard.condition));
                        }
                    }
                    None => open.push(guard.condition),
                }
            }
            let callers = self.graph.callers(at).to_vec();
            for call in callers {
                is_reached |= round.latest.contains_key(&call);
                if !round.latest.contains_key(&call) {
                    open.push(call);
                }
            }
        }
        Ok((found, is_reached))
    }
}
