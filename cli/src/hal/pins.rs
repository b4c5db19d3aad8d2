//! Which variables of a program become pins, with their types and directions.
//!
//! | language | input | output | both |
//! | --- | --- | --- | --- |
//! | PMI | inputs of the ports; variables of the executive that the program only reads | outputs of the ports; variables of the executive that it only writes | other variables of the executive: `@JGINC` |
//! | NCT | I and P lines and flags; registers RH from the NC | Y and O lines and flags; registers RH to the NC | |
//! | PMAC | M-variables in words of memory that the program only reads | those that it writes | |
//!
//! Everything else is the program's own business, and becomes a pin only by `--pin`.

use std::collections::{BTreeMap, HashMap};

use plcc_abi::nct::NctName;
use plcc_abi::pmi::Role;
use plcc_abi::{Program, Tables, natural_cmp};
use plcc_frontend::common::{CrossReference, CrossReferenceRow};
use plcc_host::image_file::SymbolTable;
use plcc_image::hal_pin_name;
use plcc_runtime::{Class, Names, Properties, Purpose};

/// The type of a pin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Type {
    Bit,
    S32,
    Float,
}

impl Type {
    /// The letter that `cfg=` of HAL's sampler and streamer has for it.
    pub(crate) fn letter(self) -> char {
        match self {
            Self::Bit => 'b',
            Self::S32 => 's',
            Self::Float => 'f',
        }
    }
}

/// Who gives a pin its value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum Direction {
    /// Something else in HAL.
    In,
    /// The program.
    Out,
    /// Both.
    Io,
}

/// A pin.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Pin {
    /// The variable, as users of the control name it.
    pub(crate) variable: String,
    /// The pin's name, without the name of the component before it.
    pub(crate) name: String,
    pub(crate) ty: Type,
    pub(crate) direction: Direction,
    /// What the variable means to the control.
    pub(crate) meaning: Option<String>,
    /// The least and the greatest value that the variable can have.
    pub(crate) range: (f64, f64),
}

/// A pin that the user asks for by `--pin NAME[=DIRECTION]`.
#[derive(Clone, Debug)]
pub(crate) struct Wanted {
    pub(crate) variable: String,
    pub(crate) direction: Option<Direction>,
}

/// How a program uses a variable, all its files together.
#[derive(Clone, Copy, Default)]
struct Uses {
    read: bool,
    written: bool,
}

impl Uses {
    fn direction(self) -> Direction {
        match self {
            Self { read: true, written: true } => Direction::Io,
            Self { written: true, .. } => Direction::Out,
            Self { .. } => Direction::In,
        }
    }
}

/// The pins of a program, in natural sort order of their variables, then those that were asked for
/// besides. `names` are those of the program.
///
/// # Errors
/// When a variable that was asked for does not exist, is an array, or when two pins get one name.
pub(crate) fn pins(
    program: &Program,
    xref: &CrossReference,
    names: &dyn Names,
    wanted: &[Wanted],
) -> Result<Vec<Pin>, String> {
    let mut uses: HashMap<String, Uses> = HashMap::new();
    let mut rows: Vec<(String, Option<&String>)> = vec![];
    for row in &xref.rows {
        let CrossReferenceRow { name, read, written, tested, meaning, .. } = row;
        let name = place(program, name);
        if !uses.contains_key(&name) {
            rows.push((name.clone(), meaning.as_ref()));
        }
        let uses = uses.entry(name).or_default();
        uses.read |= !(read.is_empty() && tested.is_empty());
        uses.written |= !written.is_empty();
    }
    rows.sort_by(|(a, _), (b, _)| natural_cmp(a, b));
    let widths = widths(program);
    let symbols = SymbolTable::new(names).symbols;
    let mut found = vec![];
    for (name, meaning) in rows {
        let uses = uses.get(&name).copied().unwrap_or_default();
        let Some(direction) = direction(program, &widths, &name, uses) else { continue };
        if wanted.iter().any(|wanted| wanted.variable == name) {
            continue;
        }
        found.extend(pin(names, &widths, &name, direction, meaning)?);
    }
    for Wanted { variable, direction } in wanted {
        let uses = uses.get(variable.as_str()).copied().unwrap_or_default();
        let direction = direction.unwrap_or(uses.direction());
        let meaning = xref.rows.iter().find(|row| row.name == *variable);
        let meaning = meaning.and_then(|row| row.meaning.as_ref());
        match pin(names, &widths, variable, direction, meaning)? {
            Some(pin) => found.push(pin),
            None => {
                return Err(format!("--pin: `{variable}` is an array; name one of its elements"));
            }
        }
    }
    for pin in &mut found {
        // An element of an array has the type of the array.
        let name = pin.variable.split('[').next().unwrap_or_default();
        let symbol = symbols.iter().find(|symbol| symbol.name == name);
        if let Some(range) = symbol.and_then(|symbol| symbol.outside().range()) {
            pin.range = (*range.start() as f64, *range.end() as f64);
        }
    }
    let mut variables = BTreeMap::new();
    for pin in &found {
        if let Some(other) = variables.insert(&pin.name, &pin.variable) {
            return Err(format!(
                "{} and {other} would both be the pin `{}`",
                pin.variable, pin.name
            ));
        }
    }
    Ok(found)
}

/// The variable that a name of a cross-reference stands for: `V012` of NCT asks whether `I012` has changed.
fn place(program: &Program, name: &str) -> String {
    match (&program.tables, name.strip_prefix('V')) {
        (Tables::Nct(_), Some(rest)) => format!("I{rest}"),
        _ => name.to_owned(),
    }
}

/// How many bits the M-variables of a PMAC have that lie in words of memory.
fn widths(program: &Program) -> HashMap<String, u8> {
    match &program.tables {
        Tables::Pmac(_) => {
            let fields = program.tables.bit_fields().into_iter();
            fields.map(|field| (field.name, field.width)).collect()
        }
        Tables::Pmi(_) | Tables::Nct(_) => HashMap::new(),
    }
}

/// The direction of a variable that is a pin without being asked for; `None` if it is none.
fn direction(
    program: &Program,
    widths: &HashMap<String, u8>,
    name: &str,
    uses: Uses,
) -> Option<Direction> {
    match &program.tables {
        Tables::Pmi(tables) => {
            let role = tables.symbols.iter().find(|symbol| symbol.name == name).map(|s| s.role);
            match role {
                Some(Role::Input(_)) => Some(Direction::In),
                Some(Role::Output(_)) => Some(Direction::Out),
                // The control itself sets it in the first scan.
                _ if name == "@IPL" => None,
                _ => name.starts_with('@').then(|| uses.direction()),
            }
        }
        Tables::Nct(_) => match name.parse().ok()? {
            NctName::I { .. } | NctName::P { .. } => Some(Direction::In),
            NctName::Y { .. } | NctName::O { .. } => Some(Direction::Out),
            NctName::Rh(number) if number % 100 < 50 => Some(Direction::In),
            NctName::Rh(_) => Some(Direction::Out),
            _ => None,
        },
        Tables::Pmac(_) => {
            let is_field = name.starts_with('M') && widths.contains_key(name);
            is_field.then_some(if uses.written { Direction::Out } else { Direction::In })
        }
    }
}

/// The pin of a variable; `None` for an array.
///
/// # Errors
/// When there is no such variable.
fn pin(
    names: &dyn Names,
    widths: &HashMap<String, u8>,
    variable: &str,
    direction: Direction,
    meaning: Option<&String>,
) -> Result<Option<Pin>, String> {
    let purpose = match direction {
        Direction::In | Direction::Io => Purpose::Stimulus,
        Direction::Out => Purpose::Watch,
    };
    let found = names.find(variable, Purpose::Watch).map_err(|error| error.to_string())?;
    let Properties { class, elements, .. } = names.properties(found);
    if elements.is_some() {
        return Ok(None);
    }
    names.find(variable, purpose).map_err(|error| error.to_string())?;
    let ty = match (class, widths.get(variable)) {
        (Class::Logical, _) | (_, Some(1)) => Type::Bit,
        (Class::Integer, _) | (_, Some(2..=24)) => Type::S32,
        (Class::Fraction, _) => Type::Float,
    };
    let (variable, name) = (variable.to_owned(), hal_pin_name(variable));
    let range = match ty {
        Type::Bit => (0.0, 1.0),
        Type::S32 => (i32::MIN.into(), i32::MAX.into()),
        Type::Float => (f64::MIN, f64::MAX),
    };
    Ok(Some(Pin { variable, name, ty, direction, meaning: meaning.cloned(), range }))
}
