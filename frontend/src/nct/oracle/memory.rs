//! How the interpreter reads and writes bits and words of the image (NCT 4.6).

use plcc_abi::image::{read_u16, write_u16};
use plcc_abi::nct::arithmetic::from_bcd;

use super::run::Run;
use crate::common::{Accessed, Observer, Value};
use crate::nct::{
    access,
    ast::{Bit, Operand, Space, Variable, Word},
    status_flags::{NOT_BCD, SYNTAX},
    tables::name,
};

impl<O: Observer> Run<'_, O> {
    /// Reads a bit.
    #[inline]
    pub(super) fn bit(&mut self, bit: Bit) -> bool {
        let value = self.value_of_bit(bit);
        if self.observer.is_active() {
            let (variable, told) = (access::accessed_bit(bit), Value::Logical(value));
            self.observer.read(variable, told);
            return self.observer.instead(variable, told).is_true();
        }
        value
    }

    /// The value of a bit. A bit of V says whether the input has changed since the module ran before.
    #[inline]
    fn value_of_bit(&self, bit: Bit) -> bool {
        let Some(location) = self.layout.location(bit.space, bit.byte) else { return false };
        let now = location.bit(self.image, bit.bit);
        if bit.space != Space::V {
            return now;
        }
        let before = self.layout.previous.get(bit.byte as usize);
        before.is_some_and(|location| location.bit(self.image, bit.bit)) != now
    }

    /// Writes a bit.
    #[inline]
    pub(super) fn set(&mut self, bit: Bit, value: bool) {
        if let Some(location) = self.layout.location(bit.space, bit.byte) {
            location.set_bit(self.image, bit.bit, value);
            if self.observer.is_active() {
                self.observe(Observer::write, Variable::Bit(bit), Value::Logical(value));
            }
        }
    }

    /// Reads a byte.
    pub(super) fn byte(&self, space: Space, byte: u16) -> u8 {
        let Some(location) = self.layout.location(space, byte) else { return 0 };
        let now = location.read(self.image);
        if space != Space::V {
            return now;
        }
        let before = self.layout.previous.get(byte as usize);
        before.map_or(now, |location| location.read(self.image) ^ now)
    }

    /// The word to which an indirect access leads. The word at byte `at` of F has its address.
    ///
    /// # Errors
    /// If the address is not valid: the values for the flags F0080 (there is no such address) and F0082 (a
    /// digit is not decimal).
    pub(super) fn indirect(&mut self, at: u16) -> Result<Word, (bool, bool)> {
        let address = self.word(Word::Bytes { space: Space::F, byte: at });
        match from_bcd(address) {
            Some(byte @ 0..=999) => Ok(Word::Bytes { space: Space::F, byte }),
            Some(_) => Err((true, false)),
            None => Err((false, true)),
        }
    }

    /// Reads a word, which must not be `Word::Indirect`.
    #[inline]
    pub(super) fn word(&mut self, word: Word) -> u16 {
        let value = self.value_of_word(word);
        if self.observer.is_active()
            && let Some(name) = name(Variable::Word(word))
        {
            let (variable, told) = (access::accessed(name), Value::Integer(value.into()));
            self.observer.read(variable, told);
            return self.observer.instead(variable, told).number() as u16;
        }
        value
    }

    fn value_of_word(&self, word: Word) -> u16 {
        if let Word::Bytes { space, byte } = word {
            return u16::from_le_bytes([self.byte(space, byte), self.byte(space, byte + 1)]);
        }
        self.layout.register(word).map_or(0, |offset| read_u16(self.image, offset))
    }

    /// Tells the observer of a variable that is read or written, if the variable has a name.
    pub(super) fn observe(
        &mut self,
        tell: fn(&mut O, Accessed, Value),
        variable: Variable,
        value: Value,
    ) {
        if let Some(name) = name(variable) {
            tell(&mut self.observer, access::accessed(name), value);
        }
    }

    /// Writes a word, which must not be `Word::Indirect`.
    pub(super) fn set_word(&mut self, word: Word, value: u16) {
        if let Word::Bytes { space, byte } = word {
            for (byte, value) in [byte, byte + 1].into_iter().zip(value.to_le_bytes()) {
                if let Some(location) = self.layout.location(space, byte) {
                    location.write(self.image, value);
                }
            }
        } else if let Some(offset) = self.layout.register(word) {
            write_u16(self.image, offset, value);
        }
        if self.observer.is_active() {
            self.observe(Observer::write, Variable::Word(word), Value::Integer(value.into()));
        }
    }

    /// Writes F0080 and F0082 of an indirect access.
    pub(super) fn set_address_flags(&mut self, syntax: bool, not_bcd: bool) {
        self.set(SYNTAX, syntax);
        self.set(NOT_BCD, not_bcd);
    }

    /// The value of an operand; `None` if the address of an indirect one is not valid.
    pub(super) fn operand(&mut self, operand: Operand) -> Option<u16> {
        let (negate, variable) = match operand {
            Operand::Const(value) => return Some(value),
            Operand::Load { negate, place: variable } => (negate, variable),
        };
        let value = match variable {
            Variable::Bit(bit) => return Some(u16::from(self.bit(bit) != negate)),
            Variable::Word(Word::Indirect(at)) => match self.indirect(at) {
                Ok(word) => {
                    let value = self.word(word);
                    self.set_address_flags(false, false);
                    value
                }
                Err((syntax, not_bcd)) => {
                    self.set_address_flags(syntax, not_bcd);
                    return None;
                }
            },
            Variable::Word(word) => self.word(word),
        };
        Some(if negate { !value } else { value })
    }

    /// Gives a variable the value `change(old value, OP)`. If `change` also gives a carry, the flags
    /// of arithmetic are written. The flags of an indirect access are written after every such access. `reads`
    /// says whether `change` uses the old value, so that the observer is told of a read.
    pub(super) fn update(
        &mut self,
        variable: Variable,
        reads: bool,
        change: impl FnOnce(u16, u16) -> (u16, Option<bool>),
    ) {
        match variable {
            Variable::Bit(bit) => {
                let old = if reads { self.bit(bit) } else { self.value_of_bit(bit) };
                let (value, _) = change(old.into(), self.op & 1);
                self.set(bit, value & 1 != 0);
            }
            Variable::Word(word) => {
                let (word, indirect) = match word {
                    Word::Indirect(at) => match self.indirect(at) {
                        Ok(word) => (word, true),
                        Err((syntax, not_bcd)) => return self.set_address_flags(syntax, not_bcd),
                    },
                    word => (word, false),
                };
                let old = if reads { self.word(word) } else { self.value_of_word(word) };
                let (value, carry) = change(old, self.op);
                self.set_word(word, value);
                if indirect {
                    self.set_address_flags(false, false);
                }
                if let Some(carry) = carry {
                    self.result_flags(carry, value);
                }
            }
        }
    }
}
