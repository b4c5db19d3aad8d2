//! Breakpoints of all kinds, and the observer that finds where a tick meets them.

use std::collections::{BTreeMap, HashMap};

use plcc_frontend::common::{Accessed, Expression, Observer, Value};

use crate::DebugError;
use crate::names::Target;
use crate::observers::TickObserver;
use crate::program::DebuggedProgram;

/// A breakpoint on a line of a file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LineBreakpoint {
    /// The line, from 1.
    pub line: u32,
    /// The column of one of several statements of the line, from 1; without it the first one.
    pub column: Option<u32>,
    /// Stops only if this expression of the program's language holds.
    pub condition: Option<String>,
    /// Stops only at certain hits: `5` or `=5` at the fifth, `>=5` from it on, `%5` at every fifth.
    pub hits: Option<String>,
    /// Does not stop, but tells this text, in which `{NAME}` stands for a value.
    pub log: Option<String>,
}

impl LineBreakpoint {
    /// A breakpoint without conditions on a line.
    pub fn at(line: u32) -> Self {
        Self { line, ..Self::default() }
    }
}

/// Stops at the statement that changes a variable.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DataBreakpoint {
    /// The variable, or any expression of the program's language.
    pub name: String,
    /// Stops only if this expression holds behind the change.
    pub condition: Option<String>,
    /// Stops only at certain hits, as for [lines](LineBreakpoint::hits).
    pub hits: Option<String>,
}

/// At which hits a breakpoint stops.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum HitRule {
    Always,
    Exactly(u64),
    From(u64),
    Every(u64),
}

impl HitRule {
    fn parse(text: Option<&str>) -> Result<Self, DebugError> {
        let Some(text) = text.map(str::trim).filter(|text| !text.is_empty()) else {
            return Ok(Self::Always);
        };
        let (rule, digits): (fn(u64) -> Self, &str) = if let Some(rest) = text.strip_prefix(">=") {
            (Self::From, rest)
        } else if let Some(rest) = text.strip_prefix('>') {
            (|count| Self::From(count.saturating_add(1)), rest)
        } else if let Some(rest) = text.strip_prefix('%') {
            (Self::Every, rest)
        } else {
            (Self::Exactly, text.trim_start_matches('='))
        };
        match digits.trim().parse() {
            Ok(count) if count > 0 => Ok(rule(count)),
            _ => Err(DebugError(format!(
                "`{text}` is no hit count: a number from 1 is expected, or >=5, >5 or %5"
            ))),
        }
    }

    fn stops_at(self, hits: u64) -> bool {
        match self {
            Self::Always => true,
            Self::Exactly(count) => hits == count,
            Self::From(count) => hits >= count,
            Self::Every(count) => hits.is_multiple_of(count),
        }
    }
}

/// A part of a logpoint's text.
#[derive(Clone, Debug)]
enum LogPart {
    Text(String),
    Value(Expression),
}

/// A breakpoint on a statement, ready to be met.
#[derive(Clone, Debug)]
struct ActiveLine {
    id: i64,
    condition: Option<Expression>,
    rule: HitRule,
    log: Option<Vec<LogPart>>,
}

/// A data breakpoint, ready to be met.
#[derive(Clone, Debug)]
struct ActiveData {
    id: i64,
    name: String,
    value: Expression,
    condition: Option<Expression>,
    rule: HitRule,
}

/// What became of a breakpoint that was set.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SetBreakpoint {
    /// Its number.
    pub id: i64,
    /// The line and column of the statement at which it stops; or why it can't.
    pub place: Result<(u32, u32), DebugError>,
}

/// All breakpoints.
#[derive(Clone, Debug, Default)]
pub struct Breakpoints {
    /// Those on statements: by file, then by the statement's number.
    lines: BTreeMap<u32, HashMap<u32, Vec<ActiveLine>>>,
    data: Vec<ActiveData>,
    /// How often each was met since it was set.
    hits: HashMap<i64, u64>,
    next_id: i64,
}

impl Breakpoints {
    fn new_id(&mut self) -> i64 {
        self.next_id += 1;
        self.next_id
    }

    /// Replaces the breakpoints of a file. A line without a statement means the next that has one.
    pub fn replace_lines(
        &mut self,
        program: &DebuggedProgram,
        file: u32,
        wanted: &[LineBreakpoint],
    ) -> Vec<SetBreakpoint> {
        let mut active: HashMap<u32, Vec<ActiveLine>> = HashMap::new();
        let mut answers = vec![];
        for line in wanted {
            let id = self.new_id();
            let place = line.prepare(program, file, id).map(|(statement, breakpoint)| {
                active.entry(statement).or_default().push(breakpoint);
                program.place(statement).map_or((line.line, 1), |place| (place.line, place.column))
            });
            answers.push(SetBreakpoint { id, place });
        }
        self.lines.insert(file, active);
        self.forget_hits();
        answers
    }

    /// Replaces all data breakpoints.
    pub fn replace_data(
        &mut self,
        program: &DebuggedProgram,
        wanted: &[DataBreakpoint],
    ) -> Vec<SetBreakpoint> {
        let mut answers = vec![];
        let mut active = vec![];
        for data in wanted {
            let id = self.new_id();
            let place = data.prepare(program, id).map(|data| {
                active.push(data);
                (0, 0)
            });
            answers.push(SetBreakpoint { id, place });
        }
        self.data = active;
        self.forget_hits();
        answers
    }

    /// Forgets the hits of breakpoints that are gone.
    fn forget_hits(&mut self) {
        let lines = self.lines.values().flat_map(HashMap::values).flatten().map(|line| line.id);
        let known: Vec<i64> = lines.chain(self.data.iter().map(|data| data.id)).collect();
        self.hits.retain(|id, _| known.contains(id));
    }

    /// Whether there are data breakpoints.
    pub(crate) fn have_data(&self) -> bool {
        !self.data.is_empty()
    }

    /// Counts a hit, and says whether it stops.
    pub(crate) fn counts(&mut self, hit: &Hit) -> bool {
        let Some(id) = hit.what.id() else { return true };
        let hits = self.hits.entry(id).or_default();
        *hits += 1;
        let lines = self.lines.values().flat_map(HashMap::values).flatten();
        let lines = lines.map(|line| (line.id, line.rule));
        let mut rules = lines.chain(self.data.iter().map(|data| (data.id, data.rule)));
        rules.find(|(of, _)| *of == id).is_none_or(|(_, rule)| rule.stops_at(*hits))
    }
}

fn optional(
    program: &DebuggedProgram,
    text: Option<&str>,
) -> Result<Option<Expression>, DebugError> {
    let text = text.map(str::trim).filter(|text| !text.is_empty());
    text.map(|text| program.expression(text)).transpose()
}

impl LineBreakpoint {
    fn prepare(
        &self,
        program: &DebuggedProgram,
        file: u32,
        id: i64,
    ) -> Result<(u32, ActiveLine), DebugError> {
        let none = || DebugError::new("no statement stands in this line or behind it");
        let file = plcc_diag::FileId(file);
        let (line, numbers) = program.statements_from(file, self.line).ok_or_else(none)?;
        let behind = |number: &&u32| {
            let column = self.column.filter(|_| line == self.line).unwrap_or(1);
            program.place(**number).is_some_and(|place| place.end_column > column)
        };
        let statement = numbers.iter().find(behind).or(numbers.first()).ok_or_else(none)?;
        let condition = optional(program, self.condition.as_deref())?;
        let rule = HitRule::parse(self.hits.as_deref())?;
        let log = self.log.as_deref().filter(|text| !text.is_empty());
        let log = log.map(|text| log_parts(program, text)).transpose()?;
        Ok((*statement, ActiveLine { id, condition, rule, log }))
    }
}

impl DataBreakpoint {
    fn prepare(&self, program: &DebuggedProgram, id: i64) -> Result<ActiveData, DebugError> {
        Ok(ActiveData {
            id,
            name: self.name.clone(),
            value: program.expression(&self.name)?,
            condition: optional(program, self.condition.as_deref())?,
            rule: HitRule::parse(self.hits.as_deref())?,
        })
    }
}

/// The parts of a logpoint's text.
fn log_parts(program: &DebuggedProgram, text: &str) -> Result<Vec<LogPart>, DebugError> {
    let mut parts = vec![];
    let mut rest = text;
    while let Some((before, behind)) = rest.split_once('{') {
        let (name, behind) = behind
            .split_once('}')
            .ok_or_else(|| DebugError(format!("`{text}` has a `{{` without its `}}`")))?;
        parts.push(LogPart::Text(before.to_owned()));
        parts.push(LogPart::Value(program.expression(name)?));
        rest = behind;
    }
    parts.push(LogPart::Text(rest.to_owned()));
    Ok(parts)
}

/// The value of an expression as people read it; what is wrong, where it has none.
pub(crate) fn shown(expression: &Expression, image: &[u8]) -> String {
    match expression.evaluate(image) {
        Ok(value) => show_value(value),
        Err(error) => format!("<{error}>"),
    }
}

/// A value as people read it: truth values are 0 and 1, as in traces.
pub(crate) fn show_value(value: Value) -> String {
    match value {
        Value::Logical(value) => u8::from(value).to_string(),
        Value::Integer(value) => value.to_string(),
        Value::Real(value) => plcc_runtime::value::number(value),
    }
}

/// What was met.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum What {
    /// A breakpoint on a statement.
    Line(i64),
    /// A logpoint: the text to be told.
    Log(i64, String),
    /// A variable that changes: the breakpoint, the variable, its old and new value.
    Data(i64, String, String, String),
    /// A fault or message came: its text.
    Event(String),
    /// The variable whose writer is looked for is written.
    Write,
}

impl What {
    /// The breakpoint's number.
    fn id(&self) -> Option<i64> {
        match self {
            Self::Line(id) | Self::Log(id, _) | Self::Data(id, ..) => Some(*id),
            Self::Event(_) | Self::Write => None,
        }
    }
}

/// A place in a tick at which something was met.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Hit {
    /// The step; the number of steps for the end of the tick.
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

/// The value that an expression is watched for.
struct Watched<'a> {
    expression: &'a Expression,
    /// The breakpoint; `None` for the variable whose writer is looked for.
    breakpoint: Option<&'a ActiveData>,
    last: Option<Value>,
}

/// Finds where a tick meets breakpoints, or writes a variable.
pub(crate) struct HitFinder<'a> {
    placed: &'a [bool],
    lines: HashMap<u32, Vec<&'a ActiveLine>>,
    watched: Vec<Watched<'a>>,
    target: Option<&'a Target>,
    /// The value that it has, where only changes of it are looked for.
    value: Option<f64>,
    /// The steps that have sent a text, in order.
    pub(crate) texts: Vec<usize>,
    /// How many steps there were.
    steps: usize,
    /// Whether a statement of the trace runs.
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
            value: None,
            texts: vec![],
            steps: 0,
            in_step: false,
            hits: vec![],
        }
    }

    /// Looks for the statements that write a variable; without `target` for those that change it.
    pub(crate) fn of_writes(
        target: Option<&'a Target>,
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
            value: None,
            texts: vec![],
            steps: 0,
            in_step: false,
            hits: vec![],
        }
    }

    /// The same, but of the writes to the variable only those that change this value of it count.
    pub(crate) fn changing(self, value: Option<f64>) -> Self {
        Self { value, ..self }
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
        if self.in_step && self.target.is_some_and(|target| target.concerns(variable)) {
            if let Some(last) = &mut self.value {
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
    fn call_begins(&mut self, _: usize, image: &[u8]) {
        self.in_step = false;
        self.see(image, self.steps);
    }

    fn text_sent(&mut self) {
        self.texts.push(self.current());
    }

    fn call_ends(&mut self, image: &[u8]) {
        self.see(image, self.current());
        self.in_step = false;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hit_counts_are_read_in_all_their_forms() {
        let stops = |text, hits: std::ops::RangeInclusive<u64>| {
            let rule = HitRule::parse(Some(text)).unwrap();
            hits.filter(|&hit| rule.stops_at(hit)).collect::<Vec<_>>()
        };
        assert_eq!(stops("3", 1..=6), [3]);
        assert_eq!(stops("= 3", 1..=6), [3]);
        assert_eq!(stops(">=5", 1..=6), [5, 6]);
        assert_eq!(stops(">5", 1..=6), [6]);
        assert_eq!(stops("% 2", 1..=6), [2, 4, 6]);
        assert_eq!(HitRule::parse(Some(" ")), Ok(HitRule::Always));
        for wrong in ["0", "-1", "x", ">=", "%0", "1.5"] {
            assert!(HitRule::parse(Some(wrong)).is_err(), "{wrong}");
        }
    }
}
