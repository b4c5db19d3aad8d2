//! Conditions of a script, in the program's own language, and the values that are shown of them.

use plcc_abi::Program;
use plcc_abi::image::write_f64;
use plcc_diag::{Diagnostic, Span};
use plcc_frontend::CheckedProgram;
use plcc_frontend::common::{EvaluationError, Expression, Value};
use plcc_runtime::{Class, Executive, Names, Properties, Purpose, VariableKey};

use crate::script::Piece;

/// The code of a condition that is none.
pub(crate) const CONDITION: &str = "TEST-5";

/// A condition.
#[derive(Clone, Debug)]
pub struct Condition {
    /// As it was written.
    pub text: String,
    /// The same with the names of the language in the place of those that people gave.
    pub canonical: String,
    /// Where it stands.
    pub span: Span,
    expression: Option<Expression>,
    /// The comparison of one variable with a number, which does not need the process image.
    comparison: Option<Comparison>,
    /// The variables that it names, for people.
    shown: Vec<(String, VariableKey)>,
    /// Values that the process image does not have, such as the position of a simulated motor.
    outside: Vec<Outside>,
}

/// A value outside the process image. In the expression a variable of the control stands for it, into whose place in a copy of
/// the image it is written.
#[derive(Clone, Copy, Debug)]
struct Outside {
    key: VariableKey,
    offset: u32,
}

/// A variable, compared with a number.
#[derive(Clone, Copy, Debug)]
pub struct Comparison {
    /// The variable.
    pub key: VariableKey,
    /// How they are compared.
    pub relation: Relation,
    /// The number.
    pub number: f64,
}

/// How two numbers are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Relation {
    /// They are equal.
    Equal,
    /// They are not.
    Different,
    /// The variable is less.
    Less,
    /// It is greater.
    Greater,
    /// It is less or equal.
    AtMost,
    /// It is greater or equal.
    AtLeast,
}

/// The signs of the relations in the languages, the longer ones first.
const RELATIONS: &[(&str, Relation)] = &[
    ("<=", Relation::AtMost),
    ("!>", Relation::AtMost),
    (">=", Relation::AtLeast),
    ("!<", Relation::AtLeast),
    ("!=", Relation::Different),
    ("/=", Relation::Different),
    ("<>", Relation::Different),
    ("=", Relation::Equal),
    ("<", Relation::Less),
    (">", Relation::Greater),
];

/// What conditions are checked against.
#[derive(Clone, Copy, Debug)]
pub struct Surroundings<'p> {
    /// The program, checked.
    pub checked: &'p dyn CheckedProgram,
    /// The names of its variables.
    pub names: &'p dyn Names,
    /// Its tables.
    pub program: &'p Program,
}

impl Condition {
    /// Checks a condition against the program.
    ///
    /// # Errors
    /// What is wrong with it, at its place in the script.
    pub fn new(piece: &Piece, around: Surroundings<'_>) -> Result<Self, Diagnostic> {
        let (text, origin) = canonical(&piece.text, around);
        let (mut outside, mut named_outside) = (vec![], vec![]);
        let comparison = Comparison::parse(&text, around.names);
        // A variable and a number are compared as they are, since a language may read such a text as something else.
        let expression = match &comparison {
            Some((_, true)) => None,
            other => match (around.checked.expression(&text), other) {
                (Ok(expression), _) => Some(expression),
                (Err(_), Some(_)) => None,
                (Err(found), None) => match stood_for(&text, around) {
                    Some((expression, all)) => {
                        for (name, place) in all {
                            named_outside.push((name, place.key));
                            outside.push(place);
                        }
                        Some(expression)
                    }
                    None => return Err(moved(found, piece, &origin)),
                },
            },
        };
        let comparison = comparison.map(|(comparison, _)| comparison);
        // Whether it is a condition is known from its value on any image.
        let is_number = |expression: &Expression| {
            let image = vec![0; around.program.image_size as usize];
            matches!(expression.evaluate(&image), Ok(Value::Integer(_) | Value::Real(_)))
        };
        if expression.as_ref().is_some_and(is_number) {
            let text = format!("`{}` is a number, and a condition is needed", piece.text);
            let diagnostic = Diagnostic::error(CONDITION, piece.span, text);
            return Err(diagnostic.help("compare it with another number"));
        }
        let mut shown: Vec<(String, VariableKey)> = vec![];
        let named = expression.iter().flat_map(|expression| expression.variables());
        let hidden = |key: VariableKey| {
            let value = around.names.properties(key).value;
            value.is_some_and(|place| outside.iter().any(|own| own.offset == place.offset))
        };
        for name in named {
            if let Ok(key) = around.names.find(name, Purpose::Watch)
                && !hidden(key)
            {
                shown.push((name.clone(), key));
            }
        }
        shown.append(&mut named_outside);
        if let (true, Some(comparison)) = (shown.is_empty(), &comparison) {
            shown.push((around.names.canonical(comparison.key), comparison.key));
        }
        let canonical = text;
        let (text, span) = (piece.text.clone(), piece.span);
        Ok(Self { text, canonical, span, expression, comparison, shown, outside })
    }

    /// The expression of the program's language that it is; `None` where it only compares a variable with a number.
    pub fn expression(&self) -> Option<&Expression> {
        self.expression.as_ref()
    }

    /// The comparison of a variable with a number that it is, if it is one.
    pub fn comparison(&self) -> Option<Comparison> {
        self.comparison
    }

    /// Whether it holds after the tick that was run last.
    ///
    /// # Errors
    /// When it has no value then, as with an index outside its array.
    pub fn holds(&self, executive: &dyn Executive) -> Result<bool, String> {
        let evaluate = |expression: &Expression| {
            if self.outside.is_empty() {
                return expression.evaluate(executive.image());
            }
            let mut image = executive.image().to_vec();
            for outside in &self.outside {
                let value = executive.read(outside.key).number().unwrap_or(0.0);
                write_f64(&mut image, outside.offset, value);
            }
            expression.evaluate(&image)
        };
        let value = self.expression.as_ref().map(evaluate);
        match (value, &self.comparison) {
            (Some(Ok(value)), _) => Ok(value.is_true()),
            (None | Some(Err(EvaluationError::OutsideImage { .. })), Some(comparison)) => {
                Ok(comparison.holds(executive))
            }
            (Some(Err(error)), _) => Err(error.to_string()),
            // A condition has one of the two.
            (None, None) => Err("it has no value".into()),
        }
    }

    /// The variables that it names, with their values after the tick that was run last.
    pub fn values(&self, executive: &dyn Executive) -> Vec<(String, String)> {
        let value =
            |(name, key): &(String, VariableKey)| (name.clone(), executive.read(*key).to_string());
        self.shown.iter().map(value).collect()
    }

    /// The names of the variables that it reads.
    pub fn variables(&self) -> impl Iterator<Item = &str> {
        self.shown.iter().map(|(name, _)| name.as_str())
    }
}

impl Comparison {
    /// Reads `NAME RELATION NUMBER`, or the name of a bit alone, which means that it is 1. Returns whether there is a relation,
    /// too.
    fn parse(text: &str, names: &dyn Names) -> Option<(Self, bool)> {
        let split = RELATIONS
            .iter()
            .filter_map(|(sign, relation)| Some((text.find(sign)?, sign, relation)));
        let first = split.min_by_key(|(at, sign, _)| (*at, std::cmp::Reverse(sign.len())));
        let (name, relation, number) = match &first {
            Some((at, sign, relation)) => {
                let number = text.get(at + sign.len()..)?.trim();
                let number = match number.strip_prefix('$') {
                    Some(digits) => i64::from_str_radix(digits, 16).ok()? as f64,
                    None => number.parse().ok().filter(|number: &f64| number.is_finite())?,
                };
                (text.get(..*at)?.trim(), **relation, number)
            }
            None => (text.trim(), Relation::Different, 0.0),
        };
        let key = names.find(name, Purpose::Watch).ok()?;
        let Properties { elements, class, .. } = names.properties(key);
        let is_compared = first.is_some();
        let is_condition = elements.is_none() && (is_compared || class == Class::Logical);
        is_condition.then_some((Self { key, relation, number }, is_compared))
    }

    fn holds(self, executive: &dyn Executive) -> bool {
        let Some(value) = executive.read(self.key).number() else { return false };
        match self.relation {
            Relation::Equal => value == self.number,
            Relation::Different => value != self.number,
            Relation::Less => value < self.number,
            Relation::Greater => value > self.number,
            Relation::AtMost => value <= self.number,
            Relation::AtLeast => value >= self.number,
        }
    }
}

/// A condition in which names such as `#1.CMD` stand, which no language has: the expression with the last P-variables of the
/// control in their place, and the values for these. `None` where there is no such name.
fn stood_for(text: &str, around: Surroundings<'_>) -> Option<(Expression, Vec<(String, Outside)>)> {
    let last = ["P8191", "P1023"].into_iter().find(|name| place_of(name, around).is_some())?;
    let last: u32 = last.get(1..)?.parse().ok()?;
    let (mut out, mut found) = (String::new(), Vec::<(String, Outside)>::new());
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let is_name = |c: char| c.is_ascii_alphanumeric() || c == '.';
        let behind = rest.get(1..).unwrap_or_default();
        let length = 1 + behind.find(|c| !is_name(c)).unwrap_or(behind.len());
        let name = rest.get(..length).unwrap_or_default();
        let key = match first {
            '#' | '&' if name.contains('.') => around.names.find(name, Purpose::Watch).ok(),
            _ => None,
        };
        let Some(key) = key else {
            out.push(first);
            rest = rest.get(first.len_utf8()..).unwrap_or_default();
            continue;
        };
        let index = found.iter().position(|(_, own)| own.key == key).unwrap_or(found.len());
        let variable = format!("P{}", last.checked_sub(u32::try_from(index).ok()?)?);
        if index == found.len() {
            found.push((name.to_owned(), Outside { key, offset: place_of(&variable, around)? }));
        }
        out.push_str(&variable);
        rest = rest.get(length..).unwrap_or_default();
    }
    let expression = around.checked.expression(&out).ok().filter(|_| !found.is_empty())?;
    Some((expression, found))
}

/// Where a variable's value lies in the process image.
fn place_of(name: &str, around: Surroundings<'_>) -> Option<u32> {
    let key = around.names.find(name, Purpose::Watch).ok()?;
    around.names.properties(key).value.map(|place| place.offset)
}

/// Where a part of the canonical text comes from: its start there, and that in the text as it was written.
type Origin = Vec<(usize, usize)>;

/// A condition in which the names that people gave stand as the program's own.
fn canonical(text: &str, around: Surroundings<'_>) -> (String, Origin) {
    let is_letter = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let mut out = String::with_capacity(text.len());
    let mut origin = vec![(0, 0)];
    let mut rest = text;
    let mut at = 0;
    while let Some(first) = rest.chars().next() {
        let length = rest.find(|c: char| !is_letter(c)).unwrap_or(rest.len());
        if length == 0 {
            out.push(first);
            at += first.len_utf8();
            rest = rest.get(first.len_utf8()..).unwrap_or_default();
            continue;
        }
        let (word, behind) = rest.split_at_checked(length).unwrap_or((rest, ""));
        match around.names.given().replaced(word) {
            Some(name) => {
                out.push_str(&name);
                origin.push((out.len(), at + word.len()));
            }
            None => out.push_str(word),
        }
        at += word.len();
        rest = behind;
    }
    (out, origin)
}

/// The diagnostic of a condition, at its place in the script.
fn moved(found: Vec<Diagnostic>, piece: &Piece, origin: &Origin) -> Diagnostic {
    let first = found.into_iter().next();
    let begin = piece.span.range().start;
    let end = piece.span.range().end;
    let place = |offset: u32| {
        let offset = offset as usize;
        let known = origin.iter().rev().find(|(canonical, _)| *canonical <= offset);
        let (canonical, written) = known.copied().unwrap_or((0, 0));
        (begin + written + (offset - canonical)).min(end)
    };
    let Some(first) = first else {
        let text = format!("`{}` is not a condition of the program's language", piece.text);
        return Diagnostic::error(CONDITION, piece.span, text).help("write it as in the program");
    };
    let (start, stop) = (place(first.span.start), place(first.span.end));
    let span = Span::new(piece.span.file, start.min(stop), stop.max(start));
    let mut diagnostic = Diagnostic::error(first.code, span, first.message.clone());
    for note in first.notes() {
        diagnostic.add_note(note.clone());
    }
    let help = first.help.clone();
    diagnostic.help(help.unwrap_or_else(|| "write the condition as in the program".into()))
}
