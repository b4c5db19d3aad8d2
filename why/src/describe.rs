//! What people read: texts of statements, remarks, and the answer as a tree of text.

use std::fmt;

use crate::explanation::{Cause, ChangedBy, Explanation, Number, Wish};
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

/// The value of a variable, and since when it has it.
struct Since<'a> {
    name: &'a str,
    value: Number,
    remark: &'a str,
    since: u64,
    changed_by: &'a ChangedBy,
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

    /// `CW is 0 since tick 260 (5.20 s)`
    fn since(&self, of: &Since<'_>) -> String {
        let Since { name, value, remark, since, changed_by } = of;
        let remark = if remark.is_empty() { String::new() } else { format!(" ({remark})") };
        match changed_by {
            ChangedBy::PowerUp => format!("{name} is {value}{remark} since power-up"),
            ChangedBy::BeforeRecord => {
                format!("{name} is {value}{remark} since before the record begins")
            }
            _ => format!("{name} is {value}{remark} since {}", self.tick(*since)),
        }
    }

    /// The first sentence: the value, and what holds it.
    fn sentence(&self) -> String {
        let since = self.since(&Since {
            name: &self.name,
            value: self.value,
            remark: &self.for_people.remark,
            since: self.since,
            changed_by: &self.changed_by,
        });
        let causes: Vec<String> =
            self.because.iter().map(|cause| format!("{} is {}", cause.name, cause.value)).collect();
        match listed(&causes, "and") {
            text if text.is_empty() => match self.reason_without_operands() {
                Some(reason) => format!("{since}{reason}."),
                None => format!("{since}."),
            },
            text => format!("{since}, because {text}."),
        }
    }

    /// Why it has its value where no operand holds it.
    fn reason_without_operands(&self) -> Option<String> {
        Some(match &self.changed_by {
            ChangedBy::Input => ": the machine gives it this value".into(),
            ChangedBy::Stimulus => ": the stimulus has set it".into(),
            ChangedBy::Force => ": it is forced to this value".into(),
            ChangedBy::Write => ": somebody has set it".into(),
            ChangedBy::Timer => ": time has changed it".into(),
            ChangedBy::Control => ": the control has changed it".into(),
            ChangedBy::Statement { file, line } => format!(", when {file}:{line} set it"),
            ChangedBy::PowerUp | ChangedBy::BeforeRecord => return None,
        })
    }
}

/// What a cause comes from, where nothing further holds it.
fn origin(cause: &Cause) -> String {
    match &cause.changed_by {
        ChangedBy::Input => "input".into(),
        ChangedBy::Stimulus => "set by the stimulus".into(),
        ChangedBy::Force => "forced".into(),
        ChangedBy::Write => "set by somebody".into(),
        ChangedBy::Timer => "time".into(),
        ChangedBy::Control => "from the control".into(),
        ChangedBy::Statement { .. } => "value of an earlier scan".into(),
        ChangedBy::PowerUp | ChangedBy::BeforeRecord => String::new(),
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
    lines: Vec<String>,
    left_out: usize,
}

impl Lines<'_> {
    fn add(&mut self, cause: &Cause, indent: &str, is_last: bool) {
        if self.lines.len() >= MOST_LINES {
            self.left_out += 1 + count(&cause.because);
            return;
        }
        let (branch, below) = if is_last { ("└─ ", "   ") } else { ("├─ ", "│  ") };
        let mut line = self.of.since(&Since {
            name: &cause.name,
            value: cause.value,
            remark: &cause.remark,
            since: cause.since,
            changed_by: &cause.changed_by,
        });
        let place = placed(&cause.file, cause.line, &cause.statement);
        let origin = if cause.because.is_empty() { origin(cause) } else { String::new() };
        for text in [place, Some(origin).filter(|text| !text.is_empty())].into_iter().flatten() {
            line.push_str("   ");
            line.push_str(&text);
        }
        self.lines.push(format!("{indent}{branch}{line}"));
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
        writeln!(f, "{}", self.sentence())?;
        if let Some(place) = placed(&self.file, self.line, &self.for_people.statement) {
            writeln!(f, "  {place}")?;
        }
        let mut lines = Lines { of: self, lines: vec![], left_out: 0 };
        for (number, cause) in self.because.iter().enumerate() {
            lines.add(cause, "  ", number + 1 == self.because.len());
        }
        for line in &lines.lines {
            writeln!(f, "{line}")?;
        }
        if lines.left_out > 0 {
            writeln!(f, "  {} more variables; --message-format json has all", lines.left_out)?;
        }
        for task in &self.for_people.idle {
            writeln!(f, "{task} would give it another value, and does not run.")?;
        }
        if let ChangedBy::Statement { file, line } = &self.changed_by
            && (Some(file), Some(*line)) != (self.file.as_ref(), self.line)
            && !self.because.is_empty()
        {
            let at = self.tick(self.since);
            writeln!(f, "It got the value in {at} from {file}:{line}.")?;
        }
        self.write_wishes(f)
    }
}

impl Explanation {
    fn write_wishes(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(code) = &self.for_people.stopped {
            return writeln!(f, "The program was stopped in this tick: {code}.");
        }
        if !self.for_people.was_tried {
            return Ok(());
        }
        let other = if self.value.0 == 0.0 { 1 } else { 0 };
        let name = &self.name;
        let set = |set: &Vec<Wish>| {
            let wishes: Vec<String> =
                set.iter().map(|wish| format!("{} = {}", wish.name, wish.value)).collect();
            listed(&wishes, "and")
        };
        match self.would.as_slice() {
            [] => {
                writeln!(f, "No three inputs or fewer would make {name} {other} in the next scan.")
            }
            [only] if only.is_empty() => {
                writeln!(f, "The next scan makes {name} {other} by itself.")
            }
            sets => {
                let sets: Vec<String> = sets.iter().map(set).collect();
                writeln!(
                    f,
                    "The next scan would make {name} {other} with {}.",
                    sets.join("; or with ")
                )
            }
        }
    }
}
