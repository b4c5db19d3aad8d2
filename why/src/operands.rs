//! The operands of a statement: which of them hold what it gave, and the values that they could have instead.

use std::rc::Rc;

use plcc_frontend::common::{Accessed, Value};
use plcc_replay::DebugError;

use crate::holding::holding;
use crate::inquiry::{Inquiry, Moment};
use crate::trial::Trial;
use crate::variable::Variable;

/// How many numbers are tried at most instead of the one that an operand has.
const MOST_NUMBERS: usize = 80;

/// What a statement decides.
#[derive(Clone, Debug)]
pub(crate) enum Decided {
    /// The value of a variable.
    Value(Rc<Variable>),
    /// The value of a register that is handed to the next statement.
    HandedOn(Accessed),
    /// Which statement follows.
    Way,
}

/// A variable that holds another one's value, or keeps a statement from being executed.
#[derive(Clone, Debug)]
pub(crate) struct Operand {
    /// The place that was read.
    pub(crate) accessed: Option<Accessed>,
    /// The variable; `None` for a register that is handed on.
    pub(crate) variable: Option<Rc<Variable>>,
    pub(crate) value: Value,
    /// The statement that has read it is the step here.
    pub(crate) at: Moment,
}

/// What a trial gave.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Outcome {
    Number(f64),
    Way(Option<usize>),
    Nothing,
}

impl Inquiry<'_> {
    /// The operands of the statement at a step that hold what it has decided.
    pub(crate) fn operands(
        &mut self,
        at: Moment,
        decided: &Decided,
    ) -> Result<Vec<Operand>, DebugError> {
        let trace = self.trace(at.tick)?;
        let Some(&step) = trace.steps.get(at.step) else { return Ok(vec![]) };
        let (task, statement, image) = (step.task, step.statement, trace.image(at.step));
        let read = trace.accesses(at.step).iter().filter(|access| !access.is_write);
        let given: Vec<_> = read.map(|access| (access.variable, access.value)).collect();
        let (base, after) = self.try_statement(task, statement, &image, &given);
        let outcome = self.outcome(statement, decided, &base, &after);
        let mut operands: Vec<Operand> = vec![];
        for &(accessed, value) in &base.reads {
            if operands.iter().any(|known| known.accessed == Some(accessed)) {
                continue;
            }
            let is_handed_on = self.checked().is_handed_on(accessed);
            let variable = self.variable(accessed).filter(|_| !is_handed_on);
            let can_change = variable.as_ref().is_some_and(|variable| self.can_change(variable));
            if is_handed_on || can_change {
                operands.push(Operand { accessed: Some(accessed), variable, value, at });
            }
        }
        let numbers = self.numbers_of(statement, &image);
        let options: Vec<Vec<Value>> =
            operands.iter().map(|operand| others(operand, &operands, &numbers)).collect();
        let accessed: Vec<_> = operands.iter().map(|operand| operand.accessed).collect();
        let is_on = |value: Value| value.is_true();
        let mut holds = holding(&options, is_on, |turned| {
            let turned = turned.iter().filter_map(|(index, value)| {
                Some((accessed.get(*index).copied().flatten()?, *value))
            });
            let given: Vec<_> = turned.chain(given.iter().copied()).collect();
            let (trial, after) = self.try_statement(task, statement, &image, &given);
            self.outcome(statement, decided, &trial, &after) != outcome
        });
        if base.is_of_host && !holds.contains(&true) {
            // What the host does is not tried.
            holds = vec![true; operands.len()];
        }
        let held = operands.into_iter().zip(holds).filter(|(_, holds)| *holds);
        Ok(held.map(|(operand, _)| operand).collect())
    }

    /// Whether a variable can have another value: constants of the source can't.
    fn can_change(&self, variable: &Variable) -> bool {
        variable.can_be_set || !self.checked().parts(&variable.name, &[]).is_empty()
    }

    /// Which way the condition at a step has gone.
    pub(crate) fn way_taken(&mut self, at: Moment) -> Result<Option<usize>, DebugError> {
        let trace = self.trace(at.tick)?;
        let Some(&step) = trace.steps.get(at.step) else { return Ok(None) };
        let read = trace.accesses(at.step).iter().filter(|access| !access.is_write);
        let given: Vec<_> = read.map(|access| (access.variable, access.value)).collect();
        let image = trace.image(at.step);
        let (trial, _) = self.try_statement(step.task, step.statement, &image, &given);
        Ok(self.graph.way_to(step.statement, trial.next))
    }

    /// The value that a statement would give a variable on an image; `None` where it would not write it.
    pub(crate) fn would_write(
        &mut self,
        statement: u32,
        variable: &Variable,
        image: &[u8],
    ) -> Option<f64> {
        let task = self.task_of(statement);
        let (trial, after) = self.try_statement(task, statement, image, &[]);
        let is_handed_on = |read: &(Accessed, Value)| self.checked().is_handed_on(read.0);
        if trial.reads.iter().any(is_handed_on) || trial.is_of_host {
            // What is handed to it is not known.
            return Some(f64::NAN);
        }
        self.written(variable, &trial, &after)
    }

    /// The value that a trial has given a variable; `None` where it has not written it.
    fn written(&mut self, variable: &Variable, trial: &Trial, after: &[u8]) -> Option<f64> {
        let mut writes = trial.writes.iter().rev();
        if let Some((_, value)) = writes.find(|(written, _)| Some(*written) == variable.accessed) {
            return Some(value.number());
        }
        let is_written = trial.writes.iter().any(|(written, _)| self.is_met(variable, *written));
        if !is_written {
            return None;
        }
        variable.value_in(after).map(Value::number)
    }

    fn outcome(
        &mut self,
        statement: u32,
        decided: &Decided,
        trial: &Trial,
        after: &[u8],
    ) -> Outcome {
        let number = match decided {
            Decided::Value(variable) => self.written(variable, trial, after),
            Decided::HandedOn(register) => {
                let write = trial.writes.iter().rev().find(|(written, _)| written == register);
                write.map(|(_, value)| value.number())
            }
            Decided::Way => return Outcome::Way(self.graph.way_to(statement, trial.next)),
        };
        number.map_or(Outcome::Nothing, Outcome::Number)
    }

    /// The numbers that a statement's text names, by themselves or by a name.
    pub(crate) fn numbers_of(&mut self, statement: u32, image: &[u8]) -> Vec<f64> {
        let text = self.excerpt(statement);
        let is_part = |c: char| c.is_alphanumeric() || matches!(c, '.' | '$' | '_' | '@');
        let mut numbers = vec![];
        for word in text.split(|c| !is_part(c)).filter(|word| !word.is_empty()) {
            let digits = word.trim_start_matches(['.', '$']);
            numbers.extend(word.parse::<f64>().ok());
            numbers.extend(i64::from_str_radix(digits, 16).ok().map(|number| number as f64));
            let digits: String = word.chars().skip_while(|c| !c.is_ascii_digit()).collect();
            numbers.extend(digits.parse::<f64>().ok());
            let expression = self.checked().expression(word).ok();
            let value = expression.and_then(|expression| expression.evaluate(image).ok());
            numbers.extend(value.map(Value::number));
        }
        numbers.retain(|number| number.is_finite());
        numbers.dedup();
        numbers
    }
}

/// The values that an operand could have instead of its own.
fn others(operand: &Operand, beside: &[Operand], numbers: &[f64]) -> Vec<Value> {
    if let Value::Logical(value) = operand.value {
        return vec![Value::Logical(!value)];
    }
    let now = operand.value.number();
    let is_logical = operand.variable.as_ref().is_some_and(|variable| variable.is_logical);
    let mut all: Vec<f64> = vec![];
    if is_logical {
        all.push(if now == 0.0 { 1.0 } else { 0.0 });
    } else {
        all.extend([0.0, 1.0]);
        let near = |number: f64| [number, number + 1.0, number - 1.0];
        all.extend(numbers.iter().copied().flat_map(near));
        all.extend(beside.iter().map(|other| other.value.number()).flat_map(near));
        all.extend([-1.0, 32767.0, -32768.0, 65535.0, 8_388_607.0, -8_388_608.0]);
        if now.fract() == 0.0 && (0.0..16_777_216.0).contains(&now) {
            all.extend((0..24).map(|bit| f64::from(now as u32 ^ 1 << bit)));
        }
    }
    let mut seen: Vec<f64> = vec![now];
    all.retain(|&number| {
        let is_new = !seen.contains(&number);
        seen.push(number);
        is_new
    });
    all.truncate(MOST_NUMBERS);
    let value = |number: f64| match operand.value {
        Value::Integer(_) => Value::Integer(number as i64),
        Value::Logical(_) | Value::Real(_) => Value::Real(number),
    };
    all.into_iter().map(value).collect()
}
