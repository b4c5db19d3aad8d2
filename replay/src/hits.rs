//! The observer that finds the statements of a tick at which breakpoints stop, or which write a variable.

use std::collections::HashMap;

use plcc_frontend::common::{Accessed, Expression, Observer, Value};

use crate::breakpoints::{ActiveData, ActiveLine, Breakpoints, LogPart, show_value, shown};
use crate::observers::TickObserver;

/// What was found at a statement.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum What {
    /// A breakpoint on a statement.
    Line(i64),
    /// A logpoint: its breakpoint's number, and the text for the user.
    Log(i64, String),
    /// A variable that changes: the breakpoint's number, the variable, its old and new value.
    Data(i64, String, String, String),
    /// A fault or message was reported: its text.
    Event(String),
    /// The variable whose writer is looked for is written.
    Write,
}

impl What {
    /// The breakpoint's number.
    pub(crate) fn id(&self) -> Option<i64> {
        match self {
            Self::Line(id) | Self::Log(id, _) | Self::Data(id, ..) => Some(*id),
            Self::Event(_) | Self::Write => None,
        }
    }
}

/// A place in a tick at which something was met.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Hit {
    /// The index of the step; at the end of the tick the number of steps.
    pub(crate) step: usize,
    pub(crate) what: What,
}

/// What was found in a tick.
#[derive(Clone, Debug, Default)]
pub(crate) struct Found {
    /// How many steps the tick had.
    pub(crate) steps: usize,
    /// What was met, in order.
    pub(crate) hits: Vec<Hit>,
    /// The steps that have sent a text, in order.
    pub(crate) texts: Vec<usize>,
}

/// An expression whose changes are looked for.
struct Watched<'a> {
    expression: &'a Expression,
    /// The data breakpoint; `None` if the expression is the variable whose writer is looked for.
    breakpoint: Option<&'a ActiveData>,
    last: Option<Value>,
}

/// Finds where a tick meets breakpoints, or writes a variable.
pub(crate) struct HitFinder<'a> {
    /// By a statement's number: whether it has a place in the source, and so is a step.
    placed: &'a [bool],
    lines: HashMap<u32, Vec<&'a ActiveLine>>,
    watched: Vec<Watched<'a>>,
    target: Option<Accessed>,
    /// The last value of `target`, if only writes that change it are looked for.
    last_value: Option<f64>,
    /// The steps that have sent a text, in order.
    pub(crate) texts: Vec<usize>,
    /// How many steps there were.
    steps: usize,
    /// Whether the statement that runs is a step.
    in_step: bool,
    pub(crate) hits: Vec<Hit>,
}

impl<'a> HitFinder<'a> {
    /// Looks for breakpoints. `image` is the one before the tick.
    pub(crate) fn of(breakpoints: &'a Breakpoints, placed: &'a [bool], image: &[u8]) -> Self {
        let mut lines: HashMap<u32, Vec<&ActiveLine>> = HashMap::new();
        for (statement, all) in breakpoints.lines.values().flatten() {
            lines.entry(*statement).or_default().extend(all);
        }
        let watched = breakpoints.data.iter().map(|data| Watched {
            expression: &data.value,
            breakpoint: Some(data),
            last: data.value.evaluate(image).ok(),
        });
        let watched = watched.collect();
        Self {
            placed,
            lines,
            watched,
            target: None,
            last_value: None,
            texts: vec![],
            steps: 0,
            in_step: false,
            hits: vec![],
        }
    }

    /// Looks for the statements that write the variable `target`, and for those that change the value of an
    /// expression. Either may be missing.
    pub(crate) fn of_writes(
        target: Option<Accessed>,
        value: Option<&'a Expression>,
        placed: &'a [bool],
        image: &[u8],
    ) -> Self {
        let watched = value.map(|expression| Watched {
            expression,
            breakpoint: None,
            last: expression.evaluate(image).ok(),
        });
        Self {
            placed,
            lines: HashMap::new(),
            watched: watched.into_iter().collect(),
            target,
            last_value: None,
            texts: vec![],
            steps: 0,
            in_step: false,
            hits: vec![],
        }
    }

    /// Of the writes to `target`, only counts those that change its value, which is `last_value` before the tick.
    /// With `None` all writes count.
    pub(crate) fn changing(self, last_value: Option<f64>) -> Self {
        Self { last_value, ..self }
    }

    /// What was found, given the image at the end of the tick.
    pub(crate) fn finish(mut self, image: &[u8]) -> Found {
        self.see(image, self.steps);
        Found { steps: self.steps, hits: self.hits, texts: self.texts }
    }

    /// Compares the watched values; a change is attributed to `step`.
    fn see(&mut self, image: &[u8], step: usize) {
        for watched in &mut self.watched {
            let now = watched.expression.evaluate(image).ok();
            if now == watched.last {
                continue;
            }
            let show = |value: Option<Value>| value.map_or_else(|| "?".into(), show_value);
            let (old, new) = (show(watched.last), show(now));
            watched.last = now;
            let what = match watched.breakpoint {
                Some(data) => {
                    let holds = |condition: &Expression| {
                        condition.evaluate(image).is_ok_and(Value::is_true)
                    };
                    if !data.condition.as_ref().is_none_or(holds) {
                        continue;
                    }
                    What::Data(data.id, data.name.clone(), old, new)
                }
                None => What::Write,
            };
            self.hits.push(Hit { step, what });
        }
    }

    /// The step that runs, or, between scans, the one that comes next.
    fn current(&self) -> usize {
        self.steps.saturating_sub(usize::from(self.in_step))
    }
}

impl Observer for HitFinder<'_> {
    fn statement(&mut self, statement: u32, image: &[u8]) {
        let is_placed = self.placed.get(statement as usize).copied().unwrap_or(false);
        if !self.watched.is_empty() {
            self.see(image, self.current());
        }
        self.in_step = is_placed;
        if !is_placed {
            return;
        }
        let step = self.steps;
        self.steps += 1;
        let Some(lines) = self.lines.get(&statement) else { return };
        for line in lines {
            let holds =
                |condition: &Expression| condition.evaluate(image).is_ok_and(Value::is_true);
            if !line.condition.as_ref().is_none_or(holds) {
                continue;
            }
            let what = match &line.log {
                None => What::Line(line.id),
                Some(parts) => {
                    let part = |part: &LogPart| match part {
                        LogPart::Text(text) => text.clone(),
                        LogPart::Value(value) => shown(value, image),
                    };
                    What::Log(line.id, parts.iter().map(part).collect())
                }
            };
            self.hits.push(Hit { step, what });
        }
    }

    fn read(&mut self, _: Accessed, _: Value) {}

    fn write(&mut self, variable: Accessed, value: Value) {
        if self.in_step && self.target.is_some_and(|target| target.meets(variable)) {
            if let Some(last) = &mut self.last_value {
                if *last == value.number() {
                    return;
                }
                *last = value.number();
            }
            self.hits.push(Hit { step: self.current(), what: What::Write });
        }
    }
}

impl TickObserver for HitFinder<'_> {
    fn call_begins(&mut self, _: usize, _: bool, image: &[u8]) {
        self.in_step = false;
        self.see(image, self.steps);
    }

    fn text_sent(&mut self) {
        self.texts.push(self.current());
    }

    fn call_ends(&mut self, _: bool, image: &[u8]) {
        self.see(image, self.current());
        self.in_step = false;
    }
}
