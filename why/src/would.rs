//! Which inputs would switch a variable: the smallest sets of them with which the next scan gives it its other value, each
//! tried in the statement interpreter.

use std::collections::HashSet;
use std::rc::Rc;

use plcc_abi::place::{Direction, Type};
use plcc_frontend::common::Accessed;
use plcc_frontend::presentation::{Exchange, Uses};
use plcc_replay::DebugError;
use plcc_runtime::{Event, Executive, Setting, VariableKey};

use crate::explanation::{Number, Wish};
use crate::inquiry::{Inquiry, Moment};
use crate::texts::AskedText;
use crate::variable::Variable;

/// How many sets are looked for.
const MOST_SETS: usize = 3;

/// How many inputs a set has at most.
const MOST_INPUTS: usize = 3;

/// How many inputs, the nearest ones first, and other values of them all, are combined.
const MOST_CHOICES: usize = 48;

/// How many values of a number are tried, besides those in which one line differs.
const MOST_VALUES: usize = 8;

/// How many lines of a word are switched, each by itself.
const MOST_LINES: u8 = 8;

/// An input that can be set to another value.
#[derive(Clone, Debug)]
struct Choice {
    input: usize,
    name: String,
    key: VariableKey,
    value: f64,
}

impl Inquiry<'_> {
    /// The smallest sets of inputs with which the next scan gives a variable another value.
    pub(crate) fn would(
        &mut self,
        variable: &Rc<Variable>,
        value: f64,
        at: Moment,
    ) -> Result<Vec<Vec<Wish>>, DebugError> {
        let Some(key) = variable.key else { return Ok(vec![]) };
        let is_switched = move |executive: &mut dyn Executive, _: &[Event]| {
            executive.read(key).number().is_some_and(|number| number != value)
        };
        self.sets(at, &|inquiry| inquiry.choices(vec![Rc::clone(variable)], vec![]), &is_switched)
    }

    /// The smallest sets of inputs with which the next scan puts out a text.
    pub(crate) fn would_put_out(
        &mut self,
        asked: &AskedText,
        at: Moment,
    ) -> Result<Vec<Vec<Wish>>, DebugError> {
        if self.trace(at.tick)?.stop.is_some() {
            return Ok(vec![]);
        }
        let is_put_out = |_: &mut dyn Executive, events: &[Event]| {
            events.iter().any(|event| asked.is_put_out_by(event))
        };
        self.sets(at, &|inquiry| inquiry.choices(vec![], asked.statements.clone()), &is_put_out)
    }

    /// The smallest sets of the choices after which a tick does what is looked for, as `is_done` says of the executive and
    /// the events of the tick.
    fn sets(
        &mut self,
        at: Moment,
        choices: &dyn Fn(&mut Self) -> Result<Vec<Choice>, DebugError>,
        is_done: &dyn Fn(&mut dyn Executive, &[Event]) -> bool,
    ) -> Result<Vec<Vec<Wish>>, DebugError> {
        let round = self.round(at)?;
        // Where the tasks run in turn, one reads what another has written: all of them run twice at most before that has
        // come from the first to the last.
        let ticks = match (at.tick + 1).saturating_sub(round.first) {
            0 | 1 => 1,
            turn => 2 * turn,
        };
        self.go_behind(at.tick)?;
        let choices = choices(self)?;
        let state = self.history.executive().checkpoint();
        let mut engine = self.checked().interpreter();
        let given = self.program.given();
        let mut switches = |set: &[&Choice]| -> Result<bool, DebugError> {
            let executive = self.history.executive();
            executive.resume(&state).map_err(|error| DebugError(error.to_string()))?;
            for choice in set {
                executive.write(choice.key, setting(choice.value));
            }
            for _ in 0..ticks {
                let mut events = vec![];
                if executive.tick(engine.as_mut(), &mut events).is_err() {
                    return Ok(false);
                }
                if is_done(executive, &events) {
                    return Ok(true);
                }
            }
            Ok(false)
        };
        let mut found = vec![];
        if switches(&[])? {
            found.push(vec![]);
        } else {
            for size in 1..=MOST_INPUTS {
                let mut chosen = vec![];
                let mut inputs_found: Vec<Vec<usize>> = vec![];
                combine(&choices, size, 0, &mut chosen, &mut |set| {
                    // Other values of the same inputs are not another way.
                    let inputs: Vec<usize> = set.iter().map(|choice| choice.input).collect();
                    if !inputs_found.contains(&inputs) && switches(set)? {
                        inputs_found.push(inputs);
                        let alias = |name: &str| {
                            let said = given.said_of(name);
                            said.map(|said| said.alias.clone()).unwrap_or_default()
                        };
                        let wish = |choice: &&Choice| Wish {
                            name: choice.name.clone(),
                            alias: alias(&choice.name),
                            value: Number(choice.value),
                        };
                        found.push(set.iter().map(wish).collect());
                    }
                    Ok(found.len() < MOST_SETS)
                })?;
                if !found.is_empty() {
                    break;
                }
            }
        }
        let executive = self.history.executive();
        executive.resume(&state).map_err(|error| DebugError(error.to_string()))?;
        Ok(found)
    }

    /// The inputs on which variables depend, and whether statements are executed, the nearest ones first, each with its other
    /// values.
    fn choices(
        &mut self,
        variables: Vec<Rc<Variable>>,
        mut statements: Vec<u32>,
    ) -> Result<Vec<Choice>, DebugError> {
        let image = self.history.executive().image().to_vec();
        let mut choices: Vec<Choice> = vec![];
        let mut inputs = 0;
        let mut seen: HashSet<String> = variables.iter().map(|one| one.name.clone()).collect();
        let mut seen_statements = HashSet::new();
        let asked = seen.clone();
        let mut open: Vec<(Rc<Variable>, Vec<f64>)> =
            variables.into_iter().map(|one| (one, vec![])).collect();
        self.add_reads(&mut statements, &image, (&mut seen, &mut seen_statements), &mut open);
        while !open.is_empty() && choices.len() < MOST_CHOICES {
            let mut next = vec![];
            for (variable, numbers) in open {
                let writers = self.writers(&variable);
                // That a variable would change if it were set says nothing.
                if !asked.contains(&variable.name)
                    && self.is_input(&variable, &writers)
                    && let Some(key) = variable.key
                    && let Some(now) = self.number_now(&variable)
                {
                    let values = other_values(&variable, now, &numbers);
                    choices.extend(values.into_iter().map(|value| Choice {
                        input: inputs,
                        name: variable.name.clone(),
                        key,
                        value,
                    }));
                    inputs += 1;
                }
                let mut statements = writers;
                let parts = self.checked().parts(&variable.name, &image);
                for part in parts {
                    let part = self.named(&part.name);
                    if seen.insert(part.name.clone()) {
                        next.push((part, vec![]));
                    }
                }
                let seen = (&mut seen, &mut seen_statements);
                self.add_reads(&mut statements, &image, seen, &mut next);
            }
            open = next;
        }
        choices.truncate(MOST_CHOICES);
        Ok(choices)
    }

    /// Adds the variables that statements read, and that the conditions around these read, each with the numbers that the
    /// statement names; without those that were seen.
    fn add_reads(
        &mut self,
        statements: &mut Vec<u32>,
        image: &[u8],
        (seen, seen_statements): (&mut HashSet<String>, &mut HashSet<u32>),
        found: &mut Vec<(Rc<Variable>, Vec<f64>)>,
    ) {
        while let Some(statement) = statements.pop() {
            if !seen_statements.insert(statement) {
                continue;
            }
            let task = self.task_of(statement);
            let reads: Vec<Accessed> =
                self.effects(task, statement).reads.iter().map(|read| read.0).collect();
            let numbers = self.numbers_of(statement, image);
            for read in reads {
                if self.checked().is_handed_on(read) {
                    statements.extend(self.before_it(statement));
                    continue;
                }
                let Some(variable) = self.variable(read) else { continue };
                if seen.insert(variable.name.clone()) {
                    found.push((variable, numbers.clone()));
                }
            }
            statements.extend(self.graph.guards(statement).iter().map(|guard| guard.condition));
            statements.extend(self.graph.callers(statement));
        }
    }

    /// The statements in front of one to which a register is handed, from the one on that gives the register a value by itself.
    fn before_it(&mut self, statement: u32) -> Vec<u32> {
        let mut found = vec![];
        for before in (0..statement).rev().take(64) {
            let task = self.task_of(before);
            let effects = self.effects(task, before);
            let hands_on = |(accessed, _): &(Accessed, _)| self.checked().is_handed_on(*accessed);
            if !effects.writes.iter().any(hands_on) {
                continue;
            }
            found.push(before);
            if !effects.reads.iter().any(hands_on) {
                break;
            }
        }
        found
    }

    /// Whether the machine or the control gives a variable its value.
    fn is_input(&mut self, variable: &Variable, writers: &[u32]) -> bool {
        if !variable.can_be_set {
            return false;
        }
        let declared = match variable.direction {
            Direction::Input => return true,
            Direction::Output => Some(Exchange::Program),
            Direction::Internal => None,
        };
        let in_word = variable.place.is_some_and(|place| place.width <= 32);
        let uses = Uses { read: true, written: !writers.is_empty(), in_word, declared };
        let given = self.checked().exchange(&variable.name, uses);
        match given {
            Some(Exchange::Machine) => true,
            // The control sets it, and the program takes it back: an M function of PMI.
            Some(Exchange::Both) => writers.iter().all(|&writer| self.only_clears(writer)),
            Some(Exchange::Program) | None => false,
        }
    }

    /// Whether a statement writes nothing but 0, whatever the variables are.
    fn only_clears(&mut self, statement: u32) -> bool {
        let task = self.task_of(statement);
        let effects = self.effects(task, statement);
        effects.reads.is_empty() && effects.writes.iter().all(|(_, value)| value.number() == 0.0)
    }
}

fn setting(value: f64) -> Setting {
    if value.fract() == 0.0 { Setting::Int(value as i64) } else { Setting::Float(value) }
}

/// The other values of an input that are tried: of several lines that are a word, first those in which one line differs, since
/// they are mostly switches and keys; then those that statements compare with.
fn other_values(variable: &Variable, now: f64, numbers: &[f64]) -> Vec<f64> {
    if variable.is_logical {
        return vec![if now == 0.0 { 1.0 } else { 0.0 }];
    }
    let lines = variable.place.filter(|place| place.ty == Type::Bits).map_or(0, |it| it.width);
    let one_line = (0..lines.min(MOST_LINES)).map(|line| ((now as i64) ^ (1 << line)) as f64);
    let near = |number: f64| [number, number + 1.0, number - 1.0];
    let mut values: Vec<f64> = one_line.collect();
    let most = values.len() + MOST_VALUES;
    for value in numbers.iter().copied().flat_map(near).chain([0.0, 1.0]) {
        let fits = variable.place.and_then(|place| place.range());
        let fits = fits.is_none_or(|range| value.fract() == 0.0 && range.contains(&(value as i64)));
        if value != now && fits && !values.contains(&value) {
            values.push(value);
        }
    }
    values.truncate(most);
    values
}

/// Shows sets of `size` choices of different inputs, until `show` wants no more.
fn combine<'c>(
    choices: &'c [Choice],
    size: usize,
    from: usize,
    chosen: &mut Vec<&'c Choice>,
    show: &mut dyn FnMut(&[&'c Choice]) -> Result<bool, DebugError>,
) -> Result<bool, DebugError> {
    if chosen.len() == size {
        return show(chosen);
    }
    for (at, choice) in choices.iter().enumerate().skip(from) {
        if chosen.last().is_some_and(|last| last.input == choice.input) {
            continue;
        }
        chosen.push(choice);
        let goes_on = combine(choices, size, at + 1, chosen, show)?;
        chosen.pop();
        if !goes_on {
            return Ok(false);
        }
    }
    Ok(true)
}
