//! Lowers the reading and writing of bits and words.

use plcc_abi::nct::{FLAG_BYTES, FlagLocation, IMAGE_BYTES, LINE_BYTES};
use plcc_ir::{Address, BinaryOp, InstBuilder, IntCond, RegionId, Type, Value};

use super::{Lowerer, Result};
use crate::common::OrMissing;
use crate::nct::ast::{Bit, Space, Word};

/// Where an indirect access leads.
pub(super) struct Indirect {
    /// The byte of F, an i32; it means nothing unless `ok`.
    index: Value,
    /// Whether the address is valid, an i1.
    pub(super) ok: Value,
    /// What F0080 becomes, an i1: the address is beyond F999.
    pub(super) syntax: Value,
    /// What F0082 becomes, an i1: a digit of the address is not decimal.
    pub(super) not_bcd: Value,
}

/// What a word is as a BCD number of four digits.
pub(super) struct Bcd {
    /// Its value, an i32; it means nothing if `wrong`.
    pub(super) number: Value,
    /// Whether a digit is not decimal, an i1.
    pub(super) wrong: Value,
}

impl Lowerer<'_> {
    /// The address of an offset in the image.
    pub(super) fn address(&self, offset: u32) -> Result<Address> {
        let regions = &self.layout.regions;
        let index = regions.partition_point(|region| region.offset <= offset).checked_sub(1);
        let found = index.and_then(|index| Some((index, regions.get(index)?)));
        let (index, region) = found.or_missing(|| format!("a region at offset {offset}"))?;
        Ok(Address::fixed(RegionId(index as u32), offset - region.offset))
    }

    /// Where a byte of flags lies.
    fn location(&self, space: Space, byte: u16) -> Result<FlagLocation> {
        let location = self.layout.location(space, byte);
        location.or_missing(|| format!("the location of {}{byte:02}", space.letter()))
    }

    /// Where a byte of the input image of the module's run before lies, for V.
    fn previous(&self, byte: u16) -> Result<FlagLocation> {
        let location = self.layout.previous.get(byte as usize).copied();
        location.or_missing(|| format!("the location of V{byte:02}"))
    }

    /// The address of a register, counter, timer or constant.
    pub(super) fn register(&self, word: Word) -> Result<Address> {
        let offset = self.layout.register(word);
        self.address(offset.or_missing(|| format!("the place of {word}"))?)
    }

    /// The address of a byte that is not unpacked. Physical lines are volatile.
    fn byte_address(&self, space: Space, location: FlagLocation) -> Result<Address> {
        let at = self.address(location.offset)?;
        Ok(if matches!(space, Space::P | Space::O) { at.volatile() } else { at })
    }

    /// Reads a bit of the byte at a location, as an i1.
    fn bit_at(&mut self, space: Space, location: FlagLocation, bit: u8) -> Result<Value> {
        if location.unpacked {
            let at = self.address(location.offset + u32::from(bit))?;
            return Ok(self.builder.func().load(Type::I1, at));
        }
        let at = self.byte_address(space, location)?;
        let func = self.builder.func();
        let byte = func.load(Type::I8, at);
        Ok(func.bit(byte, bit))
    }

    /// Reads a bit, as an i1.
    pub(super) fn bit(&mut self, bit: Bit) -> Result<Value> {
        let location = self.location(bit.space, bit.byte)?;
        let now = self.bit_at(bit.space, location, bit.bit)?;
        if bit.space != Space::V {
            return Ok(now);
        }
        let location = self.previous(bit.byte)?;
        let before = self.bit_at(bit.space, location, bit.bit)?;
        Ok(self.builder.func().binary(BinaryOp::Xor, now, before))
    }

    /// Writes an i1 to a bit.
    pub(super) fn store_bit(&mut self, bit: Bit, value: Value) -> Result {
        self.store_bits(bit.space, bit.byte, &[(bit.bit, value)])
    }

    /// Writes bits of one byte: each with its number and its value, an i1.
    pub(super) fn store_bits(&mut self, space: Space, byte: u16, bits: &[(u8, Value)]) -> Result {
        let location = self.location(space, byte)?;
        if bits.is_empty() {
            return Ok(());
        }
        if location.unpacked {
            for (bit, value) in bits {
                let at = self.address(location.offset + u32::from(*bit))?;
                self.builder.func().store(at, *value);
            }
            return Ok(());
        }
        let at = self.byte_address(space, location)?;
        let func = self.builder.func();
        let mask: i64 = bits.iter().map(|(bit, _)| 1 << bit).sum();
        let old = func.load(Type::I8, at);
        let mut new = func.binary_imm(BinaryOp::And, old, !mask);
        for (bit, value) in bits {
            let wide = func.zextend_or_trunc(Type::I8, *value);
            let wide = func.binary_imm(BinaryOp::Shl, wide, (*bit).into());
            new = func.binary(BinaryOp::Or, new, wide);
        }
        func.store(at, new);
        Ok(())
    }

    /// Reads the word at a byte, an i16. At the last byte this is possible too, since a byte that
    /// is always 0 lies after it.
    fn bytes(&mut self, space: Space, byte: u16) -> Result<Value> {
        let location = self.location(space, byte)?;
        let at = self.byte_address(space, location)?;
        let now = self.builder.func().load(Type::I16, at);
        if space != Space::V {
            return Ok(now);
        }
        let location = self.previous(byte)?;
        let at = self.address(location.offset)?;
        let before = self.builder.func().load(Type::I16, at);
        Ok(self.builder.func().binary(BinaryOp::Xor, now, before))
    }

    /// Reads a word, an i16. It is none that is accessed indirectly.
    pub(super) fn word(&mut self, word: Word) -> Result<Value> {
        if let Word::Bytes { space, byte } = word {
            return self.bytes(space, byte);
        }
        let at = self.register(word)?;
        Ok(self.builder.func().load(Type::I16, at))
    }

    /// Writes an i16 to a word. It is none that is accessed indirectly.
    pub(super) fn store_word(&mut self, word: Word, value: Value) -> Result {
        let Word::Bytes { space, byte } = word else {
            let at = self.register(word)?;
            self.builder.func().store(at, value);
            return Ok(());
        };
        let location = self.location(space, byte)?;
        let at = self.byte_address(space, location)?;
        let last = match space {
            Space::I | Space::V | Space::Y => IMAGE_BYTES,
            Space::P | Space::O => LINE_BYTES,
            Space::F => FLAG_BYTES,
        } - 1;
        let ty = if byte as usize == last { Type::I8 } else { Type::I16 };
        let value = self.builder.func().zextend_or_trunc(ty, value);
        self.builder.func().store(at, value);
        Ok(())
    }

    /// Decodes a word, an i32, as BCD.
    pub(super) fn take_bcd(&mut self, word: Value) -> Bcd {
        let func = self.builder.func();
        // A digit is above 9 if its bit 3 is set and bit 1 or 2 too.
        let once = func.binary_imm(BinaryOp::Shl, word, 1);
        let twice = func.binary_imm(BinaryOp::Shl, word, 2);
        let either = func.binary(BinaryOp::Or, once, twice);
        let wrong = func.binary(BinaryOp::And, word, either);
        let wrong = func.binary_imm(BinaryOp::And, wrong, 0x8888);
        let wrong = func.icmp_imm(IntCond::Ne, wrong, 0);
        let mut number = func.binary_imm(BinaryOp::And, word, 15);
        for (shift, weight) in [(4, 10), (8, 100), (12, 1000)] {
            let digit = func.binary_imm(BinaryOp::Lshr, word, shift);
            let digit = func.binary_imm(BinaryOp::And, digit, 15);
            let digit = func.binary_imm(BinaryOp::Mul, digit, weight);
            number = func.binary(BinaryOp::Add, number, digit);
        }
        Bcd { number, wrong }
    }

    /// Where the address at a byte of F leads.
    pub(super) fn indirect(&mut self, at: u16) -> Result<Indirect> {
        let word = self.bytes(Space::F, at)?;
        let word = self.builder.func().zextend_or_trunc(Type::I32, word);
        let Bcd { number, wrong: not_bcd } = self.take_bcd(word);
        let out = self.builder.func().icmp_imm(IntCond::Ugt, number, 999);
        let bcd = self.not(not_bcd);
        let syntax = self.both(out, bcd);
        let within = self.not(out);
        let ok = self.both(within, bcd);
        Ok(Indirect { index: number, ok, syntax, not_bcd })
    }

    /// The word that an indirect access leads to.
    pub(super) fn indirect_word(&mut self, to: &Indirect) -> Value {
        let count = FLAG_BYTES as u32;
        let at = Address::indexed(self.regions.flag_bytes, 0, to.index, 1, count);
        self.builder.func().load(Type::I16, at)
    }

    /// Writes the word that an indirect access leads to.
    pub(super) fn store_indirect(&mut self, to: &Indirect, value: Value) {
        let count = FLAG_BYTES as u32;
        let flags = self.regions.flag_bytes;
        let func = self.builder.func();
        let low = func.zextend_or_trunc(Type::I8, value);
        func.store(Address::indexed(flags, 0, to.index, 1, count), low);
        let high = func.binary_imm(BinaryOp::Lshr, value, 8);
        let high = func.zextend_or_trunc(Type::I8, high);
        func.store(Address::indexed(flags, 1, to.index, 1, count), high);
        // The high byte of a word at F999 is dropped: the byte after F999 is always 0.
        let zero = func.constant(Type::I8, 0);
        func.store(Address::fixed(flags, count), zero);
    }
}
