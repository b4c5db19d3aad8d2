//! Where the bits and words of I, Y and F are in IEC 61131-3. A byte of which only bits are named is a BOOL for each of them. A word
//! whose bytes no other word shares is a UINT, and its bits are computed. All other bytes are a USINT each, and where an address
//! is computed, all of F is an array of them.

use std::collections::{BTreeMap, BTreeSet};

use plcc_iec::{Expression, Kind, Level, Names, Type, Variable};

use crate::common::Held;
use crate::nct::ast::{Bit, Program, Space, Variable as Named, Word};
use crate::nct::tables::{each_variable, tested_variable};

/// The bits and words of one kind that a program uses.
#[derive(Debug, Default)]
pub(super) struct Uses {
    bits: BTreeSet<(u16, u8)>,
    words: BTreeSet<u16>,
    /// Whether every byte can be reached.
    all: bool,
}

impl Uses {
    fn note(&mut self, variable: Named) {
        match variable {
            Named::Bit(bit) => drop(self.bits.insert((bit.byte, bit.bit))),
            Named::Word(Word::Bytes { byte, .. }) => drop(self.words.insert(byte)),
            Named::Word(_) => {}
        }
    }

    /// Whether a word has its bytes for itself.
    fn is_alone(&self, word: u16, bytes: u16) -> bool {
        // The last byte of a kind has no high byte.
        if word + 1 >= bytes {
            return false;
        }
        let beside = [word.checked_sub(1), Some(word + 1)];
        !self.all && !beside.into_iter().flatten().any(|other| self.words.contains(&other))
    }

    fn has_word_at(&self, byte: u16) -> bool {
        let below = byte.checked_sub(1).is_some_and(|below| self.words.contains(&below));
        self.all || below || self.words.contains(&byte)
    }
}

/// A part of a kind: a bit, a word or a byte.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Unit {
    /// A bit on its own.
    Bit(u16, u8),
    /// A word on its own.
    Word(u16),
    /// A byte that words share.
    Byte(u16),
}

/// One kind of bits and words.
#[derive(Debug)]
pub(super) struct Storage {
    space: Space,
    uses: Uses,
    /// What each unit is called.
    pub(super) units: BTreeMap<Unit, String>,
    /// The array of all bytes, where there is one.
    pub(super) array: Option<String>,
}

/// What a unit is called before it is made an identifier.
pub(super) fn title(space: char, width: usize, unit: Unit) -> String {
    match unit {
        Unit::Bit(byte, bit) => format!("{space}{byte:0width$}{bit}"),
        Unit::Word(byte) => format!("{space}{byte:0width$}"),
        Unit::Byte(byte) => format!("{space}B{byte:0width$}"),
    }
}

/// How many bytes the array of all bytes has. The last one is always 0, so that a word can be read at the one before.
pub(super) const ARRAY_BYTES: u32 = 1001;

impl Storage {
    /// The units of a kind. `extra` are further variables that are used.
    pub(super) fn new(
        program: &Program,
        space: Space,
        extra: &[Named],
        all: bool,
        names: &mut Names,
    ) -> Self {
        let mut uses = Uses { all, ..Uses::default() };
        let mut note = |variable: Named| {
            let of = match variable {
                Named::Bit(bit) => Some(bit.space),
                Named::Word(Word::Bytes { space, .. }) => Some(space),
                Named::Word(_) => None,
            };
            // A change of an input is found by comparing two images of it.
            let same = of == Some(space) || of == Some(Space::V) && space == Space::I;
            if same {
                uses.note(variable);
            }
        };
        program.stmts.iter().for_each(|stmt| each_variable(&stmt.op, &mut note));
        program.condition_parts.iter().filter_map(tested_variable).for_each(&mut note);
        extra.iter().copied().for_each(&mut note);
        let mut this = Self { space, uses, units: BTreeMap::new(), array: None };
        if all {
            this.array = Some(names.make(&format!("{}B", space.letter())));
            return this;
        }
        let mut units = BTreeSet::new();
        for &(byte, bit) in &this.uses.bits {
            if !this.uses.has_word_at(byte) {
                units.insert(Unit::Bit(byte, bit));
            }
        }
        for &word in &this.uses.words {
            if this.uses.is_alone(word, space.bytes()) {
                units.insert(Unit::Word(word));
            } else {
                units.extend(
                    [word, word + 1].into_iter().filter(|&it| it < space.bytes()).map(Unit::Byte),
                );
            }
        }
        let width = if space == Space::F { 3 } else { 2 };
        let named = |unit| (unit, names.make(&title(space.letter(), width, unit)));
        this.units = units.into_iter().map(named).collect();
        this
    }

    /// The declarations of the units, each with what `about` says of it.
    pub(super) fn declare(&self, list: &mut Vec<Variable>, mut about: impl FnMut(Unit) -> String) {
        let kind = |byte| match self.space {
            Space::F if byte >= plcc_abi::nct::RETAINED_FROM as u16 => Kind::Retained,
            _ => Kind::Local,
        };
        if let Some(array) = &self.array {
            let variable = Variable::local(array, Type::Usint, "all local variables, a byte each");
            list.push(Variable { elements: Some(ARRAY_BYTES), kind: Kind::Retained, ..variable });
        }
        list.extend(self.units.iter().map(|(&unit, name)| {
            let (ty, byte) = match unit {
                Unit::Bit(byte, _) => (Type::Bool, byte),
                Unit::Word(byte) => (Type::Uint, byte),
                Unit::Byte(byte) => (Type::Usint, byte),
            };
            Variable { kind: kind(byte), ..Variable::local(name, ty, about(unit)) }
        }));
    }

    /// The name of the word that has a byte for itself, and whether it is the high one.
    fn word_of(&self, byte: u16) -> Option<(&str, bool)> {
        let low = self.units.get(&Unit::Word(byte)).map(|name| (name.as_str(), false));
        low.or_else(|| Some((self.units.get(&Unit::Word(byte.checked_sub(1)?))?.as_str(), true)))
    }

    /// A byte on its own, or in the array.
    fn byte(&self, byte: u16) -> Option<String> {
        match &self.array {
            Some(array) => Some(format!("{array}[{byte}]")),
            None => self.units.get(&Unit::Byte(byte)).cloned(),
        }
    }

    /// Whether a bit is kept. Status flags that nothing reads are not.
    pub(super) fn has_bit(&self, bit: Bit) -> bool {
        self.uses.bits.contains(&(bit.byte, bit.bit)) || self.uses.has_word_at(bit.byte)
    }

    /// The unit that a byte is, or is a half of, and whether it is the high half.
    fn unit_of(&self, byte: u16) -> Option<(Unit, bool)> {
        let word = byte.checked_sub(1).map(|low| (Unit::Word(low), true));
        let units = [Some((Unit::Word(byte), false)), word, Some((Unit::Byte(byte), false))];
        units.into_iter().flatten().find(|(unit, _)| self.units.contains_key(unit))
    }

    /// Reads a bit.
    pub(super) fn read_bit(&self, bit: Bit) -> Expression {
        if let Some(array) = &self.array {
            return has_weight(&format!("{array}[{}]", bit.byte), 1 << bit.bit);
        }
        self.read_bit_of(bit, |unit| self.units.get(&unit).map_or("", String::as_str))
    }

    /// Reads a bit of units that have other names.
    pub(super) fn read_bit_of<'n>(&self, bit: Bit, name: impl Fn(Unit) -> &'n str) -> Expression {
        let unit = Unit::Bit(bit.byte, bit.bit);
        if self.units.contains_key(&unit) {
            return Expression::name(name(unit));
        }
        let weight = 1_u32 << bit.bit;
        match self.unit_of(bit.byte) {
            Some((unit, high)) => has_weight(name(unit), if high { weight * 256 } else { weight }),
            None => Expression::name("FALSE"),
        }
    }

    /// The statement that writes a bit.
    pub(super) fn write_bit(&self, bit: Bit, value: &str) -> String {
        if let Some(name) = self.units.get(&Unit::Bit(bit.byte, bit.bit)) {
            return format!("{name} := {value};");
        }
        let weight = 1_u32 << bit.bit;
        if let Some((word, high)) = self.word_of(bit.byte) {
            let weight = if high { weight * 256 } else { weight };
            return format!("{word} := WORD_WITH({word}, {weight}, {value});");
        }
        match self.byte(bit.byte) {
            Some(byte) => format!("{byte} := BYTE_WITH({byte}, {weight}, {value});"),
            None => ";".into(),
        }
    }

    /// Reads a word.
    pub(super) fn read_word(&self, byte: u16) -> Expression {
        if let Some(name) = self.units.get(&Unit::Word(byte)) {
            return Expression::name(name);
        }
        let part = |byte| self.byte(byte).unwrap_or_else(|| "0".into());
        Expression::name(part(byte)).call_with("WORD_OF_BYTES(", Expression::name(part(byte + 1)))
    }

    /// Reads a word of units that have other names.
    pub(super) fn read_word_of<'n>(&self, byte: u16, name: impl Fn(Unit) -> &'n str) -> Expression {
        if self.units.contains_key(&Unit::Word(byte)) {
            return Expression::name(name(Unit::Word(byte)));
        }
        let part = |byte| match self.units.contains_key(&Unit::Byte(byte)) {
            true => Expression::name(name(Unit::Byte(byte))),
            false => Expression::name("0"),
        };
        part(byte).call_with("WORD_OF_BYTES(", part(byte + 1))
    }

    /// Where a variable is kept.
    pub(super) fn held(&self, byte: u16, bit: Option<u8>) -> Option<Held> {
        let Some(bit) = bit else {
            if let Some(name) = self.units.get(&Unit::Word(byte)) {
                return Some(Held::Variable(name.clone()));
            }
            return Some(Held::Bytes(self.byte(byte)?, self.byte(byte + 1)));
        };
        if let Some(name) = self.units.get(&Unit::Bit(byte, bit)) {
            return Some(Held::Variable(name.clone()));
        }
        let weight = 1_u32 << bit;
        if self.array.is_some() {
            return Some(Held::Bit(self.byte(byte)?, weight));
        }
        let (unit, high) = self.unit_of(byte)?;
        let name = self.units.get(&unit)?.clone();
        Some(Held::Bit(name, if high { weight * 256 } else { weight }))
    }

    /// The statements that write a word.
    pub(super) fn write_word(&self, byte: u16, value: &str) -> Vec<String> {
        if let Some(name) = self.units.get(&Unit::Word(byte)) {
            return vec![format!("{name} := {value};")];
        }
        let parts = [(byte, "LOW_BYTE"), (byte + 1, "HIGH_BYTE")];
        let parts = parts.into_iter().filter(|(byte, _)| *byte < self.space.bytes());
        let line = |(byte, function): (u16, &str)| {
            Some(format!("{} := {function}({value});", self.byte(byte)?))
        };
        parts.filter_map(line).collect()
    }
}

/// Whether a number has the bit of a weight.
pub(super) fn has_weight(number: &str, weight: u32) -> Expression {
    let number = Expression::name(number);
    let shifted = match weight {
        1 => number,
        weight => number.infix("/", Level::Product, Expression::name(weight.to_string())),
    };
    let low = shifted.infix("MOD", Level::Product, Expression::name("2"));
    low.infix("=", Level::Relation, Expression::name("1")).of_unsigned()
}
