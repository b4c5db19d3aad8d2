//! What people read: texts of statements, remarks, and the answer as a tree of text.

use std::fmt;

use crate::explanation::{Announcing, Cause, ChangedBy, Explanation, Number, Said, Wish};
use crate::inquiry::Inquiry;
use crate::variable::Variable;

/// The longest text of a statement that is shown, in characters.
const LONGEST_STATEMENT: usize = 72;

/// How many lines of the tree are shown at most.
const MOST_LINES: usize = 60;

impl Inquiry<'_> {
    /// The text of a statement in one line.
    pub(crate) fn excerpt(&self, statement: u32) -> String {
        let Some(place) = self.place(statement) else { return String::new() };
        let text = self.program.sources().text(place.file);
        let mut lines = text.lines().skip(place.line.saturating_sub(1) as usize);
        let count = place.end_line.saturating_sub(place.line) + 1;
        let mut excerpt = String::new();
        for (number, line) in (0..count).zip(&mut lines) {
            let from = if number == 0 { place.column.saturating_sub(1) as usize } else { 0 };
            let to = match number + 1 == count {
                true => place.end_column.saturating_sub(1) as usize,
                false => usize::MAX,
            };
            let part: String = line.chars().take(to).skip(from).collect();
            excerpt.push_str(part.trim());
            excerpt.push(' ');
        }
        excerpt.trim().to_owned()
    }

    /// What a value means to people, beside the number: the time that a timer has left.
    pub(crate) fn remark(&self, variable: &Variable, value: f64, image: &[u8]) -> String {
        if value <= 0.0 || !self.checked().counts_time(&variable.name, image) || variable.is_logical
        {
            return String::new();
        }
        let unit = match variable.unit {
            "20 ms" => 0.02,
            "s" => 1.0,
            "min" => 60.0,
            _ => self.tick_ns as f64 / 1e9,
        };
        format!("{:.2} s left", value * unit)
    }
}

/// A line of an answer, for people.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Line {
    /// Its text in pieces.
    pub pieces: Vec<Piece>,
    /// What can be asked next: the variable of the line, and the tick.
    pub next: Option<(String, u64)>,
}

/// A piece of a line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Piece {
    /// Its text.
    pub text: String,
    /// What it is.
    pub kind: PieceKind,
}

/// What a piece of a line is, to give it a colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PieceKind {
    /// Words, and the branches of the tree.
    Plain,
    /// A variable.
    Name,
    /// Its value.
    Value,
    /// That it is forced.
    Forced,
    /// A statement with its place.
    Place,
    /// What would switch it.
    Wish,
}

impl Line {
    fn add(&mut self, kind: PieceKind, text: impl Into<String>) {
        let text = text.into();
        if !text.is_empty() {
            self.pieces.push(Piece { text, kind });
        }
    }

    fn plain(text: impl Into<String>) -> Self {
        let mut line = Self::default();
        line.add(PieceKind::Plain, text);
        line
    }
}

impl fmt::Display for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.pieces.iter().try_for_each(|piece| f.write_str(&piece.text))
    }
}

/// The value of a variable, and since when it has it.
struct Since<'a> {
    name: &'a str,
    said: &'a Said,
    value: Number,
    remark: &'a str,
    since: u64,
    changed_by: &'a ChangedBy,
}

/// A name with its alias: `I012 (DOOR)`.
fn with_alias(name: &str, alias: &str) -> String {
    if alias.is_empty() { name.to_owned() } else { format!("{name} ({alias})") }
}

impl Explanation {
    /// The time at which a tick begins.
    fn seconds(&self, tick: u64) -> String {
        // Ticks shorter than 10 ms need further digits.
        let digits = if self.for_people.tick_ns < 10_000_000 { 4 } else { 2 };
        format!("{:.digits$} s", tick as f64 * self.for_people.tick_ns as f64 / 1e9)
    }

    /// `tick 260 (5.20 s)`
    fn tick(&self, tick: u64) -> String {
        format!("tick {tick} ({})", self.seconds(tick))
    }

    /// `CW has been 0 since tick 260 (5.20 s)`
    fn since(&self, of: &Since<'_>, line: &mut Line) {
        let Since { name, said, value, remark, since, changed_by } = of;
        line.add(PieceKind::Name, *name);
        if !said.line.is_empty() {
            line.add(PieceKind::Plain, format!(" ({})", said.line));
        }
        let is_known = !matches!(changed_by, ChangedBy::Unknown);
        line.add(PieceKind::Plain, if is_known { " has been " } else { " is " });
        line.add(PieceKind::Value, value.to_string());
        let remark = if remark.is_empty() { String::new() } else { format!(" ({remark})") };
        let since = match changed_by {
            ChangedBy::PowerUp => "since power-up".into(),
            ChangedBy::BeforeRecord => "since before the record begins".into(),
            ChangedBy::Unknown => "now".into(),
            _ => format!("since {}", self.tick(*since)),
        };
        line.add(PieceKind::Plain, format!("{remark} {since}"));
    }

    /// `SEND"DOOR" was executed in tick 260 (5.20 s)`
    fn executed(&self, line: &mut Line) {
        line.add(PieceKind::Name, &*self.name);
        let is_executed = self.value.0 != 0.0;
        line.add(
            PieceKind::Plain,
            match (&self.changed_by, is_executed) {
                (ChangedBy::Unknown, true) => " is executed now".to_owned(),
                (ChangedBy::Unknown, false) => " is not executed now".to_owned(),
                (_, true) => format!(" was executed in {}", self.tick(self.since)),
                (ChangedBy::PowerUp, false) => " has not been executed since power-up".to_owned(),
                (ChangedBy::BeforeRecord, false) => {
                    " has not been executed since the record begins".to_owned()
                }
                (_, false) => {
                    let since = self.tick(self.since);
                    format!(
                        " is not executed in {}, and was executed last in {since}",
                        self.tick(self.tick)
                    )
                }
            },
        );
    }

    /// The first sentence: the value, and what holds it.
    fn sentence(&self) -> Line {
        let mut line = Line::default();
        let of = Since {
            name: &self.name,
            said: &self.said,
            value: self.value,
            remark: &self.for_people.remark,
            since: self.since,
            changed_by: &self.changed_by,
        };
        match self.for_people.is_of_text {
            true => self.executed(&mut line),
            false => self.since(&of, &mut line),
        }
        let causes = self.because.iter();
        let causes: Vec<String> = causes
            .map(|cause| {
                format!("{} is {}", with_alias(&cause.name, &cause.said.alias), cause.value)
            })
            .collect();
        let text = match listed(&causes, "and") {
            text if text.is_empty() => self.reason_without_operands().unwrap_or_default(),
            text => format!(", because {text}"),
        };
        let is_forced = matches!(self.changed_by, ChangedBy::Force { .. });
        let kind = if is_forced { PieceKind::Forced } else { PieceKind::Plain };
        line.add(kind, text);
        line.add(PieceKind::Plain, ".");
        line
    }

    /// Why it has its value where no operand holds it.
    fn reason_without_operands(&self) -> Option<String> {
        if self.for_people.is_of_text {
            return None;
        }
        Some(match &self.changed_by {
            ChangedBy::Input => ": the machine gives it this value".into(),
            ChangedBy::Stimulus => ": the stimulus has set it".into(),
            ChangedBy::Force { by: None } => ": it is forced to this value".into(),
            ChangedBy::Force { by: Some(by) } => format!(": it is forced to this value by {by}"),
            ChangedBy::Write => ": somebody has set it".into(),
            ChangedBy::Timer => ": time has changed it".into(),
            ChangedBy::Control => ": the control has changed it".into(),
            ChangedBy::Statement { file, line } => format!(", when {file}:{line} set it"),
            ChangedBy::PowerUp | ChangedBy::BeforeRecord | ChangedBy::Unknown => return None,
        })
    }

    /// What the variable of a fault or message announces.
    fn announcement(&self) -> Option<Line> {
        let (what, text) = self.for_people.announces.as_ref()?;
        let what = match what {
            Announcing::Fault => "fault",
            Announcing::Message => "message",
        };
        Some(Line::plain(match self.value.0 == 0.0 {
            true => format!("  While it is 1, the control shows the {what} \"{text}\"."),
            false => format!("  The control shows the {what} \"{text}\"."),
        }))
    }
}

/// What a cause comes from, where nothing further holds it.
fn origin(cause: &Cause) -> String {
    match &cause.changed_by {
        ChangedBy::Input => "input".into(),
        ChangedBy::Stimulus => "set by the stimulus".into(),
        ChangedBy::Force { by: None } => "forced".into(),
        ChangedBy::Force { by: Some(by) } => format!("forced by {by}"),
        ChangedBy::Write => "set by somebody".into(),
        ChangedBy::Timer => "time".into(),
        ChangedBy::Control => "from the control".into(),
        ChangedBy::Statement { .. } => "value of an earlier scan".into(),
        ChangedBy::PowerUp | ChangedBy::BeforeRecord | ChangedBy::Unknown => String::new(),
    }
}

/// Texts in a row: `A`, `A and B`, `A, B and C`.
fn listed(texts: &[String], word: &str) -> String {
    match texts {
        [] => String::new(),
        [one] => one.clone(),
        [first @ .., last] => format!("{} {word} {last}", first.join(", ")),
    }
}

/// A statement with its place, in the tree without the folder of the file.
fn placed(file: &Option<String>, line: Option<u32>, statement: &str) -> Option<String> {
    let (file, line) = (file.as_ref()?, line?);
    let file = file.rsplit(['/', '\\']).next().unwrap_or(file);
    let mut text: String = statement.chars().take(LONGEST_STATEMENT).collect();
    if text.len() < statement.len() {
        text.push('…');
    }
    Some(format!("{file}:{line}  {text}"))
}

/// Writes the lines of the tree.
struct Lines<'a> {
    of: &'a Explanation,
    lines: Vec<Line>,
    left_out: usize,
}

impl Lines<'_> {
    fn add(&mut self, cause: &Cause, indent: &str, is_last: bool) {
        if self.lines.len() >= MOST_LINES {
            self.left_out += 1 + count(&cause.because);
            return;
        }
        let (branch, below) = if is_last { ("└─ ", "   ") } else { ("├─ ", "│  ") };
        let mut line = Line::plain(format!("{indent}{branch}"));
        let of = Since {
            name: &cause.name,
            said: &cause.said,
            value: cause.value,
            remark: &cause.remark,
            since: cause.since,
            changed_by: &cause.changed_by,
        };
        self.of.since(&of, &mut line);
        if let Some(place) = placed(&cause.file, cause.line, &cause.statement) {
            line.add(PieceKind::Place, format!("   {place}"));
        }
        let origin = if cause.because.is_empty() { origin(cause) } else { String::new() };
        if !origin.is_empty() {
            let is_forced = matches!(cause.changed_by, ChangedBy::Force { .. });
            let kind = if is_forced { PieceKind::Forced } else { PieceKind::Plain };
            line.add(kind, format!("   {origin}"));
        }
        // The value of an earlier scan is explained in that scan.
        let is_of_then = cause.because.is_empty()
            && matches!(cause.changed_by, ChangedBy::Statement { .. } | ChangedBy::Write);
        let tick = if is_of_then { cause.since } else { self.of.tick };
        line.next = Some((cause.name.clone(), tick));
        self.lines.push(line);
        let indent = format!("{indent}{below}");
        for (number, inner) in cause.because.iter().enumerate() {
            self.add(inner, &indent, number + 1 == cause.because.len());
        }
    }
}

fn count(causes: &[Cause]) -> usize {
    causes.iter().map(|cause| 1 + count(&cause.because)).sum()
}

impl fmt::Display for Explanation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.lines().iter().try_for_each(|line| writeln!(f, "{line}"))
    }
}

impl Explanation {
    /// The answer for people, line by line.
    pub fn lines(&self) -> Vec<Line> {
        let mut found = vec![self.sentence()];
        if let Some(place) = placed(&self.file, self.line, &self.for_people.statement) {
            let mut line = Line::default();
            line.add(PieceKind::Place, format!("  {place}"));
            found.push(line);
        }
        found.extend(self.announcement());
        let mut lines = Lines { of: self, lines: vec![], left_out: 0 };
        for (number, cause) in self.because.iter().enumerate() {
            lines.add(cause, "  ", number + 1 == self.because.len());
        }
        found.append(&mut lines.lines);
        if lines.left_out > 0 {
            let text =
                format!("  {} more variables; --message-format json has all", lines.left_out);
            found.push(Line::plain(text));
        }
        for task in &self.for_people.idle {
            found.push(Line::plain(match self.for_people.is_of_text {
                true => format!("It is in {task}, which does not run."),
                false => format!("{task} would give it another value, and does not run."),
            }));
        }
        if let ChangedBy::Statement { file, line } = &self.changed_by
            && (Some(file), Some(*line)) != (self.file.as_ref(), self.line)
            && !self.because.is_empty()
        {
            let at = self.tick(self.since);
            found.push(Line::plain(format!("It got the value in {at} from {file}:{line}.")));
        }
        found.extend(self.wishes());
        found
    }

    /// What would switch it.
    fn wishes(&self) -> Option<Line> {
        if let Some(code) = &self.for_people.stopped {
            return Some(Line::plain(format!("The program was stopped in this tick: {code}.")));
        }
        if !self.for_people.was_tried {
            return None;
        }
        let other = if self.value.0 == 0.0 { 1 } else { 0 };
        let name = &self.name;
        let set = |set: &Vec<Wish>| {
            let wishes = set.iter();
            let wishes: Vec<String> = wishes
                .map(|wish| format!("{} = {}", with_alias(&wish.name, &wish.alias), wish.value))
                .collect();
            listed(&wishes, "and")
        };
        let sets = |sets: &[Vec<Wish>]| {
            let sets: Vec<String> = sets.iter().map(set).collect();
            sets.join("; or with ")
        };
        let text = match self.would.as_slice() {
            [] if self.for_people.is_of_text => {
                "No three inputs or fewer would have the next scan execute it.".to_owned()
            }
            [only] if only.is_empty() && self.for_people.is_of_text => {
                "The next scan executes it by itself.".to_owned()
            }
            wishes if self.for_people.is_of_text => {
                format!("The next scan would execute it with {}.", sets(wishes))
            }
            [] => format!("No three inputs or fewer would make {name} {other} in the next scan."),
            [only] if only.is_empty() => {
                format!("The next scan makes {name} {other} by itself.")
            }
            wishes => {
                format!("The next scan would make {name} {other} with {}.", sets(wishes))
            }
        };
        let mut line = Line::default();
        line.add(PieceKind::Wish, text);
        Some(line)
    }
}
