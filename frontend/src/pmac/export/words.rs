//! Memory words, and the M- and L-variables that are fields of them. A variable whose bits no other one has is a variable of its own;
//! the others are computed from their word.

use std::collections::{BTreeMap, BTreeSet};

use plcc_abi::image::{read_u32, read_u64};
use plcc_abi::pmac::{Controller, Definition, Field, Format, Kind, Place, Space, fixed};
use plcc_iec::{Expression, Level, Names, Type, Variable, literal};

use crate::pmac::analyse::load::Loaded;
use crate::pmac::ast::Download;

/// A word of memory: whether it is in Y, and its address.
pub(super) type Address = (bool, u32);

/// A variable by its letter and number, and its field.
type NumberedField = ((char, u16), Field);

/// What a variable is.
#[derive(Clone, Debug)]
pub(super) enum Held {
    /// A variable of its own.
    Own(String),
    /// A field of the word with this name.
    OfWord(String),
}

/// A field that a variable means.
#[derive(Clone, Debug)]
pub(super) struct FieldVariable {
    pub(super) field: Field,
    pub(super) held: Held,
    address: Address,
}

/// All of them.
#[derive(Debug, Default)]
pub(super) struct Words {
    pub(super) fields: BTreeMap<(char, u16), FieldVariable>,
    /// The words that are variables.
    pub(super) words: BTreeMap<Address, String>,
}

fn letter(kind: Kind) -> char {
    if kind == Kind::L { 'L' } else { 'M' }
}

/// The words that the control itself counts in.
pub(super) fn counted(controller: Controller) -> Vec<Address> {
    let mut words = vec![(false, 0), (false, 0x700), (true, 0x700), (false, 0x701), (true, 0x701)];
    if controller == Controller::Pmac {
        words.push((true, 0x1F));
    }
    words
}

/// The field of a word that a variable means after load; `None` if it means anything else.
pub(super) fn field_of(
    download: &Download,
    loaded: &Loaded,
    kind: Kind,
    number: u16,
) -> Option<(Address, Field)> {
    let definition = match kind {
        Kind::L => *download.l_defs.get(&number)?,
        _ => {
            let offset = loaded.layout.mdef + 8 * u32::from(number);
            Definition::decode(read_u64(&loaded.image, offset))
        }
    };
    let (space, address, field) = match definition {
        Definition::X { address, field } => (Space::X, address, field),
        Definition::Y { address, field } => (Space::Y, address, field),
        _ => return None,
    };
    let is_plain = matches!(loaded.layout.place(space, address), Place::Word(_));
    let is_binary = field.width == 1 || matches!(field.format, Format::U | Format::S);
    (is_plain && is_binary).then_some(((space == Space::Y, address), field))
}

impl Words {
    pub(super) fn new(
        download: &Download,
        loaded: &Loaded,
        used: &BTreeSet<(char, u16)>,
        names: &mut Names,
    ) -> Self {
        let mut by_word: BTreeMap<Address, Vec<NumberedField>> = BTreeMap::new();
        for &(kind, number) in used.iter().filter(|(kind, _)| matches!(kind, 'M' | 'L')) {
            let of = if kind == 'L' { Kind::L } else { Kind::M };
            if let Some((address, field)) = field_of(download, loaded, of, number) {
                by_word.entry(address).or_default().push(((kind, number), field));
            }
        }
        let mut this = Self::default();
        let counted = counted(loaded.layout.controller);
        for (address, fields) in by_word {
            let mask = |field: &Field| ((1_u64 << field.width) - 1) << field.offset;
            let all: u64 = fields.iter().fold(0, |all, (_, field)| all | mask(field));
            let sum: u64 = fields.iter().map(|(_, field)| u64::from(field.width)).sum();
            let is_apart = u64::from(all.count_ones()) == sum && !counted.contains(&address);
            let word = if is_apart {
                String::new()
            } else {
                let letter = if address.0 { 'Y' } else { 'X' };
                let name = names.make(&format!("{letter}_{:04X}", address.1));
                this.words.insert(address, name.clone());
                name
            };
            for (variable, field) in fields {
                let held = match is_apart {
                    true => Held::Own(names.make(&format!("{}{}", variable.0, variable.1))),
                    false => Held::OfWord(word.clone()),
                };
                this.fields.insert(variable, FieldVariable { field, held, address });
            }
        }
        this
    }

    pub(super) fn get(&self, kind: Kind, number: u16) -> Option<&FieldVariable> {
        self.fields.get(&(letter(kind), number))
    }

    pub(super) fn declare(
        &self,
        loaded: &Loaded,
        list: &mut Vec<Variable>,
        about: impl Fn(&str) -> String,
    ) {
        let word = |(is_y, address): Address| {
            let space = if is_y { Space::Y } else { Space::X };
            match loaded.layout.place(space, address) {
                Place::Word(offset) => read_u32(&loaded.image, offset) & 0xFF_FFFF,
                _ => 0,
            }
        };
        for (address, name) in &self.words {
            let initial = vec![word(*address).to_string()];
            let letter = if address.0 { 'Y' } else { 'X' };
            let variable =
                Variable::local(name, Type::Dint, format!("{letter}:${:04X}", address.1));
            list.push(Variable { initial, ..variable });
        }
        for ((kind, number), variable) in &self.fields {
            let Held::Own(name) = &variable.held else { continue };
            let FieldVariable { field, address, .. } = variable;
            let value = fixed::read_field(word(*address), plain(*field));
            let letter = if address.0 { 'Y' } else { 'X' };
            let place = format!("{letter}:${:04X},{},{}", address.1, field.offset, field.width);
            let about = match about(&format!("{kind}{number}")) {
                text if text.is_empty() => place,
                text => format!("{place}: {text}"),
            };
            let initial = vec![literal(value.into()).into_text()];
            list.push(Variable { initial, ..Variable::local(name, Type::Dint, about) });
        }
    }
}

/// A field of one bit has no sign.
fn plain(field: Field) -> Field {
    if field.width == 1 { Field { format: Format::U, ..field } } else { field }
}

impl FieldVariable {
    fn is_signed(&self) -> bool {
        plain(self.field).format == Format::S
    }

    /// How many values the field has.
    fn count(&self) -> u32 {
        1 << self.field.width
    }

    /// Its value, a DINT.
    pub(super) fn read(&self) -> Expression {
        let word = match &self.held {
            Held::Own(name) => return Expression::name(name),
            Held::OfWord(word) => Expression::name(word),
        };
        let number = |value: u32| Expression::name(value.to_string());
        let mut value = word;
        if self.field.offset > 0 {
            value = value.infix("/", Level::Product, number(1 << self.field.offset));
        }
        if self.field.offset + self.field.width < 24 {
            value = value.infix("MOD", Level::Product, number(self.count()));
        }
        if self.is_signed() {
            value.call_with("SIGNED_FIELD(", number(self.count()))
        } else {
            value
        }
    }

    /// The statement that gives it a value: a number, or an expression in floating point.
    pub(super) fn write(&self, value: Result<f64, String>) -> String {
        let count = self.count();
        let bits = match value {
            Ok(value) => (fixed::bits(value) as u32 & (count - 1)).to_string(),
            Err(text) => format!("FLOAT_FIELD({text}, {count}.0)"),
        };
        match &self.held {
            Held::Own(name) if self.is_signed() => {
                format!("{name} := SIGNED_FIELD({bits}, {count});")
            }
            Held::Own(name) => format!("{name} := {bits};"),
            Held::OfWord(word) => {
                let weight = 1_u32 << self.field.offset;
                format!(
                    "{word} := {word} - {word} / {weight} MOD {count} * {weight} + {bits} * {weight};"
                )
            }
        }
    }
}
