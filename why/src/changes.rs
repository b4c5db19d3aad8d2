//! Since when variables have their values, and what changed them then.

use std::rc::Rc;

use plcc_abi::place::Direction;
use plcc_frontend::common::Value;
use plcc_replay::{Act, ActKind, DebugError};

use crate::explanation::ChangedBy;
use crate::inquiry::{Inquiry, Moment};
use crate::variable::Variable;

/// How many ticks are looked through at once at first, on the way back; each next time twice as many.
pub(crate) const SEGMENT: u64 = 64;

/// The most ticks that are looked through at once.
pub(crate) const LONGEST_SEGMENT: u64 = 4096;

/// Where a value comes from.
#[derive(Clone, Debug)]
pub(crate) struct Origin {
    /// The tick in which the variable got it.
    pub(crate) since: u64,
    pub(crate) changed_by: ChangedBy,
    /// The statement, where one has given it.
    pub(crate) statement: Option<u32>,
}

/// A variable whose last change is looked for.
struct Sought {
    variable: Rc<Variable>,
    value: f64,
    at: Moment,
    /// The last tick that is looked at.
    until: u64,
    found: Option<Found>,
}

/// Whether an act gives the variable that it names a value. A force on an output holds its lines alone.
fn gives(act: &Act, variable: &Variable) -> bool {
    !matches!(act.kind, ActKind::Force) || variable.direction != Direction::Output
}

/// When a value came.
#[derive(Clone, Copy, Debug)]
enum Found {
    /// In this tick.
    In(u64),
    /// In the middle of the tick of the moment.
    Within,
}

impl Inquiry<'_> {
    /// Since when variables have the values that they have at moments, and what changed them.
    pub(crate) fn origins(
        &mut self,
        asked: &[(Rc<Variable>, f64, Moment)],
    ) -> Result<Vec<Origin>, DebugError> {
        let mut sought: Vec<Sought> = asked
            .iter()
            .map(|(variable, value, at)| Sought {
                variable: Rc::clone(variable),
                value: *value,
                at: *at,
                until: at.tick,
                found: None,
            })
            .collect();
        let first = self.history.first();
        let mut end = sought.iter().map(|one| one.until).max().unwrap_or(first);
        let mut length = SEGMENT;
        loop {
            let begin = (end + 1).saturating_sub(length).max(first);
            self.search(&mut sought, begin, end)?;
            if begin <= first || sought.iter().all(|one| one.found.is_some()) {
                break;
            }
            end = begin - 1;
            length = (length * 2).min(LONGEST_SEGMENT);
        }
        sought.iter().map(|one| self.origin(one)).collect()
    }

    /// Looks for the last changes in the ticks from `begin` to `end`.
    fn search(&mut self, sought: &mut [Sought], begin: u64, end: u64) -> Result<(), DebugError> {
        self.history.go_before(begin)?;
        let mut before: Vec<Option<f64>> = self.numbers(sought);
        // Of each variable its last change up to `until`, and the values around that tick.
        let mut last: Vec<Option<u64>> = vec![None; sought.len()];
        let mut around = vec![(None, None); sought.len()];
        for tick in begin..=end {
            let acts = self.history.acts(tick)?;
            self.history.run_unobserved(tick)?;
            let after = self.numbers(sought);
            let values = before.iter().zip(&after).enumerate();
            for (index, (before, after)) in values {
                let (Some(one), Some(last), Some(around)) =
                    (sought.get(index), last.get_mut(index), around.get_mut(index))
                else {
                    continue;
                };
                if tick > one.until {
                    continue;
                }
                // At the moment itself, what was read may be what the tick before has left.
                let is_own = tick == one.at.tick;
                if is_own {
                    *around = (*before, *after);
                }
                // What was set from outside may have been set back in the same tick.
                let was_set = acts.iter().any(|act| {
                    Some(act.variable) == one.variable.key
                        && gives(act, &one.variable)
                        && act.value.is_some_and(|value| value.number() != one.value)
                });
                if (before != after || was_set) && !(is_own && *after != Some(one.value)) {
                    *last = Some(tick);
                }
            }
            before = after;
        }
        for ((one, last), around) in sought.iter_mut().zip(last).zip(around) {
            if one.found.is_some() || one.until < begin {
                continue;
            }
            let is_own = (begin..=end).contains(&one.at.tick) && one.until == one.at.tick;
            let (before, after) = around;
            if is_own && after != Some(one.value) && before != Some(one.value) {
                one.found = Some(Found::Within);
                continue;
            }
            one.found = last.map(Found::In);
        }
        Ok(())
    }

    fn numbers(&mut self, sought: &[Sought]) -> Vec<Option<f64>> {
        let is_open = |one: &Sought| one.found.is_none();
        let numbers = sought.iter().map(|one| match is_open(one) {
            true => self.number_now(&one.variable),
            false => None,
        });
        numbers.collect()
    }

    /// The value of a variable in the state of the history's executive.
    pub(crate) fn number_now(&mut self, variable: &Variable) -> Option<f64> {
        let executive = self.history.executive();
        match variable.key {
            Some(key) => executive.read(key).number(),
            None => variable.value_in(executive.image()).map(Value::number),
        }
    }

    /// Puts the executive into the state after a tick.
    pub(crate) fn go_behind(&mut self, tick: u64) -> Result<(), DebugError> {
        self.history.go_before(tick)?;
        self.history.run_unobserved(tick)?;
        Ok(())
    }

    fn origin(&mut self, one: &Sought) -> Result<Origin, DebugError> {
        let variable = &one.variable;
        let is_held = variable.direction == Direction::Input
            && variable.key.is_some_and(|key| self.forces.iter().any(|(held, _)| *held == key));
        let first = self.history.first();
        let since = match one.found {
            Some(Found::In(tick)) => tick,
            Some(Found::Within) => one.at.tick,
            None => first,
        };
        let (changed_by, statement) = match one.found {
            None if first == 0 => (ChangedBy::PowerUp, None),
            None => (ChangedBy::BeforeRecord, None),
            Some(_) => self.changer(variable, one.value, since)?,
        };
        let changed_by = if is_held { ChangedBy::Force { by: None } } else { changed_by };
        Ok(Origin { since, changed_by, statement })
    }

    /// What gave a variable its value in a tick.
    fn changer(
        &mut self,
        variable: &Rc<Variable>,
        value: f64,
        tick: u64,
    ) -> Result<(ChangedBy, Option<u32>), DebugError> {
        let trace = self.trace(tick)?;
        for (number, step) in trace.steps.iter().enumerate().rev() {
            let mut writes = trace.accesses(number).iter().filter(|access| access.is_write);
            if !writes.any(|write| self.is_met(variable, write.variable)) {
                continue;
            }
            let before = variable.value_in(&trace.image(number)).map(Value::number);
            let after = variable.value_in(&trace.image(number + 1)).map(Value::number);
            if (before != Some(value) || before.is_none())
                && (after == Some(value) || after.is_none())
            {
                let place = self.place(step.statement);
                let by = place.map(|place| ChangedBy::Statement {
                    file: self.program.sources().path(place.file).to_owned(),
                    line: place.line,
                });
                return Ok((by.unwrap_or(ChangedBy::Control), Some(step.statement)));
            }
        }
        if let Some(by) = self.deferred_assignment(variable, tick)? {
            return Ok((by, None));
        }
        let acts = self.history.acts(tick)?;
        let of_this = |key| {
            let same = variable.key == Some(key);
            same || self.new_variable(self.names.canonical(key), None).meets(variable)
        };
        let act = acts.iter().rev().find(|act| gives(act, variable) && of_this(act.variable));
        if let Some(act) = act {
            let by = match act.kind {
                ActKind::Stimulus => ChangedBy::Stimulus,
                ActKind::Write => ChangedBy::Write,
                ActKind::Input => ChangedBy::Input,
                ActKind::Force => ChangedBy::Force { by: None },
            };
            return Ok((by, None));
        }
        let parts = self.checked().parts(&variable.name, &trace.image(0));
        let mut is_input = |name: &str| self.named(name).direction == Direction::Input;
        let comes_of_inputs = !parts.is_empty() && parts.iter().all(|part| is_input(&part.name));
        let by = if variable.direction == Direction::Input || comes_of_inputs {
            ChangedBy::Input
        } else if self.checked().counts_time(&variable.name, &trace.image(0)) {
            ChangedBy::Timer
        } else {
            ChangedBy::Control
        };
        Ok((by, None))
    }

    /// The statement of an earlier tick whose assignment the control has carried out in this one.
    fn deferred_assignment(
        &mut self,
        variable: &Rc<Variable>,
        tick: u64,
    ) -> Result<Option<ChangedBy>, DebugError> {
        self.go_behind(tick)?;
        let mut carried_out = vec![];
        self.history.executive().each_deferred_assignment(&mut |one| {
            carried_out.push((one.variable, one.file.to_owned(), one.line));
        });
        let of_this = carried_out.into_iter().rev().find(|(assigned, ..)| {
            variable.key == Some(*assigned)
                || self.new_variable(self.names.canonical(*assigned), None).meets(variable)
        });
        Ok(of_this.map(|(_, file, line)| ChangedBy::Statement { file, line }))
    }
}
