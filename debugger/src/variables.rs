//! The variables of a program by class, as the manuals group them, and their values as people read
//! them.

use std::collections::{BTreeMap, HashMap};

use plcc_abi::pmi::{PmiTables, Role, Symbol};
use plcc_abi::{Tables, nct::NctName};
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
    let mut names: Vec<String> = view.declared().into_iter().map(|(name, _)| name).collect();
    if let Tables::Nct(_) = program.tables().tables {
        names.extend((0..3).map(|module| format!("OP{module}")));
    }
    let mut classes: Vec<Class> = vec![];
    let titles = Titles::new(&program.tables().tables);
    for name in names {
        let title = titles.of(&name);
        match classes.iter_mut().find(|class| class.title == title) {
            Some(class) => class.names.push(name),
            None => classes.push(Class { title: title.into(), names: vec![name] }),
        }
    }
    classes.sort_by_key(|class| ORDER.iter().position(|title| *title == class.title));
    classes
}

/// The titles of the classes that a program's variables belong to, as the manuals group them.
#[derive(Debug)]
pub enum Titles<'t> {
    /// PMI's.
    Pmi(PmiTitles<'t>),
    /// NCT's.
    Nct,
    /// PMAC's.
    Pmac,
}

/// The tables of a PMI program, arranged so that the class of a variable is found at once.
#[derive(Debug)]
pub struct PmiTitles<'t> {
    symbols: HashMap<&'t str, &'t Symbol>,
    /// What a variable is by its offset, where another one makes it more than a variable.
    by_offset: HashMap<u32, &'static str>,
}

impl<'t> Titles<'t> {
    /// Those of a program with these tables.
    pub fn new(tables: &'t Tables) -> Self {
        match tables {
            Tables::Pmi(tables) => Self::Pmi(PmiTitles::new(tables)),
            Tables::Nct(_) => Self::Nct,
            Tables::Pmac(_) => Self::Pmac,
        }
    }

    /// The title of a variable's class.
    pub fn of(&self, name: &str) -> &'static str {
        match self {
            Self::Pmi(titles) => titles.of(name),
            Self::Nct => nct_class(name),
            Self::Pmac => pmac_class(name),
        }
    }
}

/// The classes in the order in which they are shown.
const ORDER: &[&str] = &[
    "Inputs",
    "Outputs",
    "Timers",
    "Flip-flops",
    "Faults and messages",
    "Logical variables",
    "Integer variables",
    "Executive variables",
    "Constants",
    "Inputs I",
    "Outputs Y",
    "Flags F",
    "Registers RH",
    "Counters Q",
    "20 ms timers T",
    "Second timers H",
    "Minute timers M",
    "Constants RP",
    "Registers OP",
    "Physical lines P, O",
    "P-variables",
    "Q-variables",
    "M-variables",
    "L-variables",
    "I-variables",
    "Memory",
];

impl<'t> PmiTitles<'t> {
    fn new(tables: &'t PmiTables) -> Self {
        let mut by_offset = HashMap::new();
        let told = tables.faults.iter().chain(&tables.messages);
        by_offset.extend(told.map(|one| (one.offset, "Faults and messages")));
        let pins = tables.flipflops.iter().flat_map(|one| [Some(one.q), one.d]).flatten();
        by_offset.extend(pins.map(|offset| (offset, "Flip-flops")));
        by_offset.extend(tables.timers.iter().map(|timer| (timer.delayed, "Timers")));
        let symbols = tables.symbols.iter().rev().map(|symbol| (symbol.name.as_str(), symbol));
        Self { symbols: symbols.collect(), by_offset }
    }

    fn of(&self, name: &str) -> &'static str {
        let Some(symbol) = self.symbols.get(name) else { return "Logical variables" };
        match symbol.role {
            Role::Input(_) => "Inputs",
            Role::Output(_) => "Outputs",
            Role::Constant => "Constants",
            Role::TimerControl(_) => "Timers",
            Role::FlipFlopPin(_) => "Flip-flops",
            Role::Variable => match self.by_offset.get(&symbol.offset) {
                Some(title) => title,
                None if name.starts_with('@') => "Executive variables",
                None if symbol.ty == plcc_abi::pmi::Type::Logical => "Logical variables",
                None => "Integer variables",
            },
        }
    }
}

fn nct_class(name: &str) -> &'static str {
    match name.parse() {
        Ok(NctName::I { .. }) => "Inputs I",
        Ok(NctName::Y { .. }) => "Outputs Y",
        Ok(NctName::Rh(_)) => "Registers RH",
        Ok(NctName::Q(_)) => "Counters Q",
        Ok(NctName::T(_)) => "20 ms timers T",
        Ok(NctName::H(_)) => "Second timers H",
        Ok(NctName::M(_)) => "Minute timers M",
        Ok(NctName::Rp(_)) => "Constants RP",
        Ok(NctName::Op(_)) => "Registers OP",
        Ok(NctName::P { .. } | NctName::O { .. }) => "Physical lines P, O",
        Ok(NctName::F { .. }) | Err(_) => "Flags F",
    }
}

fn pmac_class(name: &str) -> &'static str {
    let name = name.trim_start_matches(|c: char| c == '&' || c.is_ascii_digit());
    match name.chars().next() {
        _ if name.contains(':') => "Memory",
        Some('P') => "P-variables",
        Some('Q') => "Q-variables",
        Some('M') => "M-variables",
        Some('L') => "L-variables",
        _ => "I-variables",
    }
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
            Some((name.clone(), number(value_of(program, view, &image, name)?)?))
        });
        Ok(values.collect())
    }

    /// The values of single variables after the tick that the history has run last, as numbers. What has
    /// no value is left out.
    pub fn numbers_now(&mut self, names: &[String]) -> BTreeMap<String, f64> {
        let (program, executive) = self.program_and_executive();
        let image = executive.image().to_vec();
        let values = names.iter().filter_map(|name| {
            Some((name.clone(), number(value_of(program, executive, &image, name)?)?))
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
        let (hex, bits) = formats(program, number);
        let mut parts = vec![part("hex", hex), part("bits", bits)];
        // The bits of a word of flags have names of their own.
        if let Ok(name) = name.parse::<NctName>()
            && let Tables::Nct(_) = program.tables().tables
        {
            let bits: Vec<_> = bit_names(name);
            parts.extend(self.values(&bits)?);
        }
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
        let is_counter = program.tables().dialect() == plcc_abi::Dialect::Pmi && text.contains('#');
        let wrong = match program.expression(text) {
            Ok(_) if is_counter => DebugError(format!("nothing has the name `{text}`")),
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

    /// A shown value in hexadecimal, as its language writes it; `None` if it is no integer.
    pub fn hexadecimal(&self, value: &str) -> Option<String> {
        let number: f64 = value.parse().ok()?;
        (number.fract() == 0.0).then(|| formats(self.program(), number as i64).0)
    }
}

/// The number of a single value.
fn number(value: Value) -> Option<f64> {
    match value {
        Value::Int(number) => Some(number as f64),
        Value::Float(number) => Some(number),
        Value::Array(_) => None,
    }
}

/// The value of a variable; `None` if there is none of that name. A name that is also an expression is evaluated
/// on `image`, which has what the running module of NCT sees. Whole arrays, and names that are no expression,
/// are read from the executive.
fn value_of(
    program: &DebuggedProgram,
    view: &mut dyn Executive,
    image: &[u8],
    name: &str,
) -> Option<Value> {
    // `TC#COUNT` is the counter of a timer; in an expression `#` would begin a comment.
    let is_counter = program.tables().dialect() == plcc_abi::Dialect::Pmi && name.contains('#');
    if !is_counter
        && let Ok(expression) = program.expression(name)
        && let Ok(value) = expression.evaluate(image)
    {
        return Some(match value {
            ExpressionValue::Logical(value) => Value::Int(value.into()),
            ExpressionValue::Integer(value) => Value::Int(value),
            ExpressionValue::Real(value) => Value::Float(value),
        });
    }
    let variable = view.find(name, Purpose::Watch).ok()?;
    Some(view.get(variable))
}

/// A number as its language writes it in hexadecimal, and its bits in groups of four.
fn formats(program: &DebuggedProgram, number: i64) -> (String, String) {
    let wide = number.unsigned_abs() > 0xFFFF || number < -0x8000;
    let (digits, hex) = match &program.tables().tables {
        Tables::Pmi(_) if wide => (8, format!("{:08X}h", number as u32)),
        Tables::Pmi(_) => (4, format!("{:04X}h", number as u16)),
        Tables::Nct(_) => (4, format!(".{:04X}", number as u16)),
        Tables::Pmac(_) if !(-0x80_0000..=0xFF_FFFF).contains(&number) => {
            (12, format!("${:012X}", number & 0xFFFF_FFFF_FFFF))
        }
        Tables::Pmac(_) => (6, format!("${:06X}", number & 0xFF_FFFF)),
    };
    let group = |at: u32| format!("{:04b}", number >> (4 * at) & 0xF);
    let bits: Vec<_> = (0..digits).rev().map(group).collect();
    (hex, bits.join(" "))
}

/// The names of the 16 bits of a word of flags.
fn bit_names(word: NctName) -> Vec<String> {
    let of = |make: &dyn Fn(u16, u8) -> NctName, byte: u16| {
        (0..16).map(|bit| make(byte + bit / 8, (bit % 8) as u8).to_string()).collect()
    };
    let low = |byte: u16| u8::try_from(byte).unwrap_or(u8::MAX);
    match word {
        NctName::F { byte, bit: None } => {
            of(&|byte, bit| NctName::F { byte, bit: Some(bit) }, byte)
        }
        NctName::I { byte, bit: None } => {
            of(&|byte, bit| NctName::I { byte: low(byte), bit: Some(bit) }, byte.into())
        }
        NctName::Y { byte, bit: None } => {
            of(&|byte, bit| NctName::Y { byte: low(byte), bit: Some(bit) }, byte.into())
        }
        _ => vec![],
    }
}
