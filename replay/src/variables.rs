//! The variables of a program by class, as the manuals group them, and their values as people read
//! them.

use std::collections::BTreeMap;

use plcc_frontend::common::Value as ExpressionValue;
use plcc_runtime::{Executive, Purpose, Value};

use crate::DebugError;
use crate::breakpoints::show_value;
use crate::debugger::Debugger;
use crate::program::DebuggedProgram;

/// A class of variables.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Class {
    /// Its title.
    pub title: String,
    /// The names of its variables, in natural order.
    pub names: Vec<String>,
}

/// A variable with its value at the position, or a part of it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Shown {
    /// The name that is shown in front of the value.
    pub name: String,
    /// The value.
    pub value: String,
    /// The name by which it can be evaluated, watched and set; `None` for a part such as `hex`.
    pub full_name: Option<String>,
    /// Whether it can be unfolded.
    pub has_parts: bool,
}

/// The variables that a program declares or names, by class.
pub(crate) fn classes(program: &DebuggedProgram, view: &mut dyn Executive) -> Vec<Class> {
    let mut names: Vec<String> =
        view.names().declared().into_iter().map(|(name, _)| name).collect();
    names.extend(program.checked().further_names());
    let mut classes: Vec<Class> = vec![];
    let titles = program.language().titles(&program.tables().tables);
    for name in names {
        let title = titles(&name);
        match classes.iter_mut().find(|class| class.title == title) {
            Some(class) => class.names.push(name),
            None => classes.push(Class { title: title.into(), names: vec![name] }),
        }
    }
    let order = program.language().classes();
    classes.sort_by_key(|class| order.iter().position(|title| *title == class.title));
    classes
}

impl Debugger<'_> {
    /// The variables that the program declares or names, by class.
    ///
    /// # Errors
    /// When the tick at the position can't be run.
    pub fn classes(&mut self) -> Result<Vec<Class>, DebugError> {
        self.view()?;
        let (program, view) = self.program_and_view();
        Ok(classes(program, view))
    }

    /// The values of variables at the position. Names that have no value there are left out.
    ///
    /// # Errors
    /// When the tick at the position can't be run.
    pub fn values(&mut self, names: &[String]) -> Result<Vec<Shown>, DebugError> {
        let image = self.image()?;
        self.view()?;
        let (program, view) = self.program_and_view();
        let shown = names.iter().filter_map(|name| {
            let value = value_of(program, view, &image, name)?;
            let (value, has_parts) = match value {
                Value::Array(elements) => (format!("{} elements", elements.len()), true),
                Value::Int(number) => (number.to_string(), !(0..=1).contains(&number)),
                Value::Float(number) => {
                    let is_integer = number.fract() == 0.0 && !(0.0..=1.0).contains(&number);
                    (plcc_runtime::value::number(number), is_integer)
                }
            };
            let full_name = Some(name.clone());
            Some(Shown { name: name.clone(), value, full_name, has_parts })
        });
        Ok(shown.collect())
    }

    /// The values of single variables at the position, as numbers. What has no value is left out.
    ///
    /// # Errors
    /// When the tick at the position can't be run.
    pub fn numbers(&mut self, names: &[String]) -> Result<BTreeMap<String, f64>, DebugError> {
        let image = self.image()?;
        self.view()?;
        let (program, view) = self.program_and_view();
        let values = names.iter().filter_map(|name| {
            Some((name.clone(), value_of(program, view, &image, name)?.number()?))
        });
        Ok(values.collect())
    }

    /// The values of single variables after the tick that the history has run last, as numbers. What has
    /// no value is left out.
    pub fn numbers_now(&mut self, names: &[String]) -> BTreeMap<String, f64> {
        let (program, executive) = self.program_and_executive();
        let image = executive.image().to_vec();
        let values = names.iter().filter_map(|name| {
            Some((name.clone(), value_of(program, executive, &image, name)?.number()?))
        });
        values.collect()
    }

    /// The parts of a variable: the elements of an array, and of a number its hexadecimal digits and
    /// its bits.
    ///
    /// # Errors
    /// When the tick at the position can't be run.
    pub fn parts(&mut self, name: &str) -> Result<Vec<Shown>, DebugError> {
        let image = self.image()?;
        self.view()?;
        let (program, view) = self.program_and_view();
        let number = match value_of(program, view, &image, name) {
            Some(Value::Array(elements)) => {
                let names: Vec<_> = (0..elements.len()).map(|at| format!("{name}[{at}]")).collect();
                return self.values(&names);
            }
            Some(Value::Int(number)) => number,
            Some(Value::Float(number)) if number.fract() == 0.0 => number as i64,
            _ => return Ok(vec![]),
        };
        let part = |name: &str, value: String| Shown {
            name: name.into(),
            value,
            full_name: None,
            has_parts: false,
        };
        let numbers = program.language().numbers();
        let (hex, bits) = (numbers.hexadecimal(number), numbers.binary(number));
        let mut parts = vec![part("hex", hex), part("bits", bits)];
        // The bits of a word of flags have names of their own.
        let bits = program.checked().bit_names(name);
        parts.extend(self.values(&bits)?);
        Ok(parts)
    }

    /// The value of an expression of the program's language, or of a variable, at the position.
    ///
    /// # Errors
    /// When it is neither.
    pub fn evaluate(&mut self, text: &str) -> Result<String, DebugError> {
        let image = self.image()?;
        self.view()?;
        let (program, view) = self.program_and_view();
        let is_only_a_name = program.checked().is_only_a_name(text);
        let wrong = match program.expression(text) {
            Ok(_) if is_only_a_name => DebugError(format!("nothing has the name `{text}`")),
            Ok(expression) => match expression.evaluate(&image) {
                Ok(value) => return Ok(show_value(value)),
                Err(error) => DebugError(error.to_string()),
            },
            Err(error) => error,
        };
        match value_of(program, view, &image, text) {
            Some(value) => Ok(value.to_string()),
            None => Err(wrong),
        }
    }

    /// A shown value in hexadecimal, as its language writes it; `None` if it is not an integer.
    pub fn hexadecimal(&self, value: &str) -> Option<String> {
        let number: f64 = value.parse().ok()?;
        (number.fract() == 0.0)
            .then(|| self.program().language().numbers().hexadecimal(number as i64))
    }
}

/// The value of a variable; `None` if there is none of that name. A name that is also an expression is evaluated
/// on `image`, which has what the running module of NCT sees. Whole arrays, and names that are not an expression,
/// are read from the executive.
fn value_of(
    program: &DebuggedProgram,
    view: &mut dyn Executive,
    image: &[u8],
    name: &str,
) -> Option<Value> {
    if !program.checked().is_only_a_name(name)
        && let Ok(expression) = program.expression(name)
        && let Ok(value) = expression.evaluate(image)
    {
        return Some(match value {
            ExpressionValue::Logical(value) => Value::Int(value.into()),
            ExpressionValue::Integer(value) => Value::Int(value),
            ExpressionValue::Real(value) => Value::Float(value),
        });
    }
    let variable = view.names().find(name, Purpose::Watch).ok()?;
    Some(view.read(variable))
}
