//! Which variables of a program become pins, with their types and directions.
//!
//! | language | input | output | both |
//! | --- | --- | --- | --- |
//! | PMI | inputs of the ports; variables of the executive that the program only reads | outputs of the ports; variables of the executive that it only writes | other variables of the executive: `@JGINC` |
//! | NCT | I and P lines and flags; registers RH from the NC | Y and O lines and flags; registers RH to the NC | |
//! | PMAC | M-variables in words of memory that the program only reads | those that it writes | |
//!
//! Everything else is the program's own business, and becomes a pin only by `--pin`.

use std::collections::{BTreeMap, HashMap, HashSet};

use plcc_abi::natural_cmp;
use plcc_abi::place::{Place, Type as PlaceType};
use plcc_frontend::CheckedProgram;
use plcc_frontend::common::CrossReferenceRow;
use plcc_frontend::presentation::{Exchange, Uses};
use plcc_image::hal_pin_name;
use plcc_runtime::{Class, Names, Properties, Purpose, VariableKey};

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

impl From<Exchange> for Direction {
    fn from(exchange: Exchange) -> Self {
        match exchange {
            Exchange::Machine => Self::In,
            Exchange::Program => Self::Out,
            Exchange::Both => Self::Io,
        }
    }
}

/// The pins of a program, in natural sort order of their variables, then those that were asked for
/// besides. `names` are those of the program.
///
/// # Errors
/// When a variable that was asked for does not exist, is an array, or when two pins get one name.
pub(crate) fn pins(
    program: &dyn CheckedProgram,
    names: &dyn Names,
    wanted: &[Wanted],
) -> Result<Vec<Pin>, String> {
    let xref = program.cross_reference();
    let mut uses: HashMap<String, Uses> = HashMap::new();
    let mut rows: Vec<(String, Option<&String>)> = vec![];
    for row in &xref.rows {
        let CrossReferenceRow { name, read, written, tested, meaning, .. } = row;
        let name = program.stands_for(name);
        if !uses.contains_key(&name) {
            rows.push((name.clone(), meaning.as_ref()));
        }
        let uses = uses.entry(name).or_default();
        uses.read |= !(read.is_empty() && tested.is_empty());
        uses.written |= !written.is_empty();
    }
    rows.sort_by(|(a, _), (b, _)| natural_cmp(a, b));
    let table = Table { names, in_image: names.shown_in_image().into_iter().collect() };
    let mut found = vec![];
    for (name, meaning) in rows {
        let uses = uses.get(&name).copied().unwrap_or_default();
        let Some(direction) = direction(program, &table, &name, uses) else { continue };
        if wanted.iter().any(|wanted| wanted.variable == name) {
            continue;
        }
        found.extend(pin(&table, &name, direction, meaning)?);
    }
    for Wanted { variable, direction } in wanted {
        let uses = uses.get(variable.as_str()).copied().unwrap_or_default();
        let direction = direction.unwrap_or(uses.exchange().into());
        let meaning = xref.rows.iter().find(|row| row.name == *variable);
        let meaning = meaning.and_then(|row| row.meaning.as_ref());
        match pin(&table, variable, direction, meaning)? {
            Some(pin) => found.push(pin),
            None => {
                return Err(format!("--pin: `{variable}` is an array; name one of its elements"));
            }
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

/// The names of the program, and which variables lie in the process image as the image file shows it.
struct Table<'a> {
    names: &'a dyn Names,
    in_image: HashSet<VariableKey>,
}

impl Table<'_> {
    /// Where drivers read or give a variable that an image file shows, of an element of an array also: its lines, or its
    /// value.
    fn place(&self, key: VariableKey) -> Option<Place> {
        let Properties { value, line, class, .. } = self.names.properties(key);
        // Words of a PMAC's memory that are named by their address are not shown.
        let is_shown = class != Class::Fraction || self.in_image.contains(&key);
        line.or(value).filter(|_| is_shown)
    }
}

/// The direction of a variable that is a pin without being asked for; `None` if it is none.
fn direction(
    program: &dyn CheckedProgram,
    table: &Table<'_>,
    name: &str,
    uses: Uses,
) -> Option<Direction> {
    let key = table.names.find(name, Purpose::Watch).ok()?;
    let declared = match table.names.properties(key).direction {
        plcc_abi::place::Direction::Input => Some(Exchange::Machine),
        plcc_abi::place::Direction::Output => Some(Exchange::Program),
        plcc_abi::place::Direction::Internal => None,
    };
    let in_word = table.place(key).is_some_and(|place| place.ty != PlaceType::Double);
    program.exchange(name, Uses { declared, in_word, ..uses }).map(Direction::from)
}

/// The pin of a variable; `None` for an array.
///
/// # Errors
/// When there is no such variable.
fn pin(
    table: &Table<'_>,
    variable: &str,
    direction: Direction,
    meaning: Option<&String>,
) -> Result<Option<Pin>, String> {
    let purpose = match direction {
        Direction::In | Direction::Io => Purpose::Stimulus,
        Direction::Out => Purpose::Watch,
    };
    let names = table.names;
    let key = names.find(variable, Purpose::Watch).map_err(|error| error.to_string())?;
    let Properties { class, elements, .. } = names.properties(key);
    if elements.is_some() {
        return Ok(None);
    }
    names.find(variable, purpose).map_err(|error| error.to_string())?;
    let place = table.place(key);
    let is_field = |place: &Place| matches!(place.ty, PlaceType::Bits | PlaceType::SignedBits);
    let width = place.filter(is_field).map(|place| place.width);
    let ty = match (class, width) {
        (Class::Logical, _) | (Class::Fraction, Some(1)) => Type::Bit,
        (Class::Integer, _) | (_, Some(2..=24)) => Type::S32,
        (Class::Fraction, _) => Type::Float,
    };
    let (variable, name) = (variable.to_owned(), hal_pin_name(variable));
    let range = match (place.and_then(Place::range), ty) {
        (Some(range), _) => (*range.start() as f64, *range.end() as f64),
        (None, Type::Bit) => (0.0, 1.0),
        (None, Type::S32) => (i32::MIN.into(), i32::MAX.into()),
        (None, Type::Float) => (f64::MIN, f64::MAX),
    };
    Ok(Some(Pin { variable, name, ty, direction, meaning: meaning.cloned(), range }))
}
