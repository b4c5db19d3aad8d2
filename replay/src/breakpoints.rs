//! Breakpoints of all kinds, as they are set, and how often each was met.

use std::collections::{BTreeMap, HashMap};

use plcc_frontend::common::{Expression, Value};

use crate::DebugError;
use crate::hits::Hit;
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
    /// Stops only at certain hits: `5` or `=5` at the fifth, `>=5` from the fifth on, `>5` from the sixth on, `%5` at
    /// every fifth.
    pub hits: Option<String>,
    /// Does not stop, but shows this text to the user; `{EXPRESSION}` in it becomes the expression's value.
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
    /// Stops only if this expression holds after the change.
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
                "`{text}` is not a hit count: a number from 1 is expected, or >=5, >5 or %5"
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
pub(crate) enum LogPart {
    Text(String),
    Value(Expression),
}

/// A breakpoint on a statement, ready to be met.
#[derive(Clone, Debug)]
pub(crate) struct ActiveLine {
    pub(crate) id: i64,
    pub(crate) condition: Option<Expression>,
    rule: HitRule,
    pub(crate) log: Option<Vec<LogPart>>,
}

/// A data breakpoint, ready to be met.
#[derive(Clone, Debug)]
pub(crate) struct ActiveData {
    pub(crate) id: i64,
    pub(crate) name: String,
    pub(crate) value: Expression,
    pub(crate) condition: Option<Expression>,
    rule: HitRule,
}

/// What became of a breakpoint that was set.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SetBreakpoint {
    /// Its number.
    pub id: i64,
    /// The line and column (from 1) of the statement at which it stops, (0, 0) for a data breakpoint; or why it can't
    /// be set.
    pub place: Result<(u32, u32), DebugError>,
}

/// All breakpoints.
#[derive(Clone, Debug, Default)]
pub struct Breakpoints {
    /// Those on statements: by file, then by the statement's number.
    pub(crate) lines: BTreeMap<u32, HashMap<u32, Vec<ActiveLine>>>,
    pub(crate) data: Vec<ActiveData>,
    /// How often each was met since it was set.
    hits: HashMap<i64, u64>,
    next_id: i64,
    /// The breakpoints as they were set, for another version of the program: those on lines by the paths of their files.
    set_lines: BTreeMap<String, Vec<(i64, LineBreakpoint)>>,
    set_data: Vec<(i64, DataBreakpoint)>,
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
        let mut set = vec![];
        for line in wanted {
            let id = self.new_id();
            set.push((id, line.clone()));
            let place = line.prepare(program, file, id).map(|(statement, breakpoint)| {
                active.entry(statement).or_default().push(breakpoint);
                program
                    .places()
                    .place(statement)
                    .map_or((line.line, 1), |place| (place.line, place.column))
            });
            answers.push(SetBreakpoint { id, place });
        }
        self.lines.insert(file, active);
        self.set_lines.insert(program.sources().path(plcc_diag::FileId(file)).to_owned(), set);
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
        self.set_data.clear();
        for data in wanted {
            let id = self.new_id();
            self.set_data.push((id, data.clone()));
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

    /// Puts all breakpoints into another version of the program, where it has their files, lines and variables. The others
    /// are not met there, and wait for a version that has them.
    pub(crate) fn move_to(&mut self, program: &DebuggedProgram) {
        self.lines.clear();
        for (path, set) in &self.set_lines {
            let Some(file) = program.file(path) else { continue };
            let active = self.lines.entry(file.0).or_default();
            for (id, line) in set {
                if let Ok((statement, breakpoint)) = line.prepare(program, file.0, *id) {
                    active.entry(statement).or_default().push(breakpoint);
                }
            }
        }
        let data = self.set_data.iter();
        self.data = data.filter_map(|(id, data)| data.prepare(program, *id).ok()).collect();
    }

    /// Forgets the hits of breakpoints that are gone.
    fn forget_hits(&mut self) {
        let lines = self.set_lines.values().flatten().map(|(id, _)| *id);
        let known: Vec<i64> = lines.chain(self.set_data.iter().map(|(id, _)| *id)).collect();
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
        let none = || DebugError::new("no statement is in this line or after it");
        let file = plcc_diag::FileId(file);
        let (line, numbers) = program.places().statements_from(file, self.line).ok_or_else(none)?;
        let behind = |number: &&u32| {
            let column = self.column.filter(|_| line == self.line).unwrap_or(1);
            program.places().place(**number).is_some_and(|place| place.end_column > column)
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

/// The value of an expression as people read it, or the reason why it has none, in angle brackets.
pub(crate) fn shown(expression: &Expression, image: &[u8]) -> String {
    match expression.evaluate(image) {
        Ok(value) => show_value(value),
        Err(error) => format!("<{error}>"),
    }
}

/// A value as people read it: truth values are 0 and 1, as in traces.
pub fn show_value(value: Value) -> String {
    match value {
        Value::Logical(value) => u8::from(value).to_string(),
        Value::Integer(value) => value.to_string(),
        Value::Real(value) => plcc_runtime::value::number(value),
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
