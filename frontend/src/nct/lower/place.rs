//! Reading and writing bits and words.

use plcc_abi::nct::{FLAG_BYTES, IMAGE_BYTES, LINE_BYTES, NctHome};
use plcc_ir::{Address, BinaryOp, IntCond, Region, Type, Value};

use super::Lowerer;
use crate::nct::ast::{Bit, Space, Word};

/// Where an indirect access leads.
pub(super) struct Indirect {
    /// The byte, an i32; anything where `ok` is not.
    index: Value,
    /// Whether it leads anywhere.
    pub(super) ok: Value,
    /// Its F0080.
    pub(super) syntax: Value,
    /// Its F0082.
    pub(super) not_bcd: Value,
}

/// A BCD number of four digits, not checked.
pub(super) struct Bcd {
    /// Its value, an i32.
    pub(super) number: Value,
    /// Whether a digit is none.
    pub(super) wrong: Value,
}

impl Lowerer<'_> {
    /// The address of an offset in the image.
    pub(super) fn address(&self, offset: u32) -> Address {
        let regions = &self.layout.regions;
        let index = regions.partition_point(|region| region.offset <= offset).saturating_sub(1);
        let start = regions.get(index).map_or(0, |region| region.offset);
        Address::fixed(Region(index as u32), offset - start)
    }

    /// The address of a register, counter, timer or constant.
    pub(super) fn register(&self, word: Word) -> Address {
        self.address(self.layout.register(word).unwrap_or(0))
    }

    fn byte_address(&self, space: Space, home: NctHome) -> Address {
        let at = self.address(home.offset);
        if matches!(space, Space::P | Space::O) { at.volatile() } else { at }
    }

    fn home_bit(&mut self, space: Space, home: NctHome, bit: u8) -> Value {
        if home.unpacked {
            let at = self.address(home.offset + u32::from(bit));
            return self.builder.ins().load(Type::I1, at);
        }
        let at = self.byte_address(space, home);
        let ins = self.builder.ins();
        let byte = ins.load(Type::I8, at);
        let byte = if bit == 0 { byte } else { ins.binary_imm(BinaryOp::Lshr, byte, bit.into()) };
        ins.zextend_or_trunc(Type::I1, byte)
    }

    fn nothing(&mut self, ty: Type) -> Value {
        self.builder.ins().iconst(ty, 0)
    }

    /// A bit, as an i1.
    pub(super) fn bit(&mut self, bit: Bit) -> Value {
        let Some(home) = self.layout.home(bit.space, bit.byte) else {
            return self.nothing(Type::I1);
        };
        let now = self.home_bit(bit.space, home, bit.bit);
        if bit.space != Space::V {
            return now;
        }
        let Some(home) = self.layout.previous.get(bit.byte as usize).copied() else { return now };
        let before = self.home_bit(bit.space, home, bit.bit);
        self.builder.ins().binary(BinaryOp::Xor, now, before)
    }

    /// Writes an i1.
    pub(super) fn store_bit(&mut self, bit: Bit, value: Value) {
        self.store_bits(bit.space, bit.byte, &[(bit.bit, value)]);
    }

    /// Writes bits of one byte.
    pub(super) fn store_bits(&mut self, space: Space, byte: u16, bits: &[(u8, Value)]) {
        let Some(home) = self.layout.home(space, byte) else { return };
        if bits.is_empty() {
            return;
        }
        if home.unpacked {
            for (bit, value) in bits {
                let at = self.address(home.offset + u32::from(*bit));
                self.builder.ins().store(at, *value);
            }
            return;
        }
        let at = self.byte_address(space, home);
        let ins = self.builder.ins();
        let mask: i64 = bits.iter().map(|(bit, _)| 1 << bit).sum();
        let old = ins.load(Type::I8, at);
        let mut new = ins.binary_imm(BinaryOp::And, old, !mask);
        for (bit, value) in bits {
            let wide = ins.zextend_or_trunc(Type::I8, *value);
            let wide = ins.binary_imm(BinaryOp::Shl, wide, (*bit).into());
            new = ins.binary(BinaryOp::Or, new, wide);
        }
        ins.store(at, new);
    }

    /// The word of two bytes; behind the last byte of each kind lies one that is 0.
    fn bytes(&mut self, space: Space, byte: u16) -> Value {
        let Some(home) = self.layout.home(space, byte) else { return self.nothing(Type::I16) };
        let at = self.byte_address(space, home);
        let now = self.builder.ins().load(Type::I16, at);
        if space != Space::V {
            return now;
        }
        let Some(home) = self.layout.previous.get(byte as usize).copied() else { return now };
        let at = self.address(home.offset);
        let before = self.builder.ins().load(Type::I16, at);
        self.builder.ins().binary(BinaryOp::Xor, now, before)
    }

    /// A word that is named directly.
    pub(super) fn word(&mut self, word: Word) -> Value {
        if let Word::Bytes { space, byte } = word {
            return self.bytes(space, byte);
        }
        let at = self.register(word);
        self.builder.ins().load(Type::I16, at)
    }

    /// Writes a word that is named directly.
    pub(super) fn store_word(&mut self, word: Word, value: Value) {
        let Word::Bytes { space, byte } = word else {
            let at = self.register(word);
            self.builder.ins().store(at, value);
            return;
        };
        let Some(home) = self.layout.home(space, byte) else { return };
        let at = self.byte_address(space, home);
        let last = match space {
            Space::I | Space::V | Space::Y => IMAGE_BYTES,
            Space::P | Space::O => LINE_BYTES,
            Space::F => FLAG_BYTES,
        } - 1;
        let ty = if byte as usize == last { Type::I8 } else { Type::I16 };
        let value = self.builder.ins().zextend_or_trunc(ty, value);
        self.builder.ins().store(at, value);
    }

    /// Takes a word, as an i32, as BCD.
    pub(super) fn take_bcd(&mut self, word: Value) -> Bcd {
        let ins = self.builder.ins();
        // A digit is wrong where bit 3 is set and bit 1 or 2 too.
        let once = ins.binary_imm(BinaryOp::Shl, word, 1);
        let twice = ins.binary_imm(BinaryOp::Shl, word, 2);
        let either = ins.binary(BinaryOp::Or, once, twice);
        let wrong = ins.binary(BinaryOp::And, word, either);
        let wrong = ins.binary_imm(BinaryOp::And, wrong, 0x8888);
        let wrong = ins.icmp_imm(IntCond::Ne, wrong, 0);
        let mut number = ins.binary_imm(BinaryOp::And, word, 15);
        for (shift, weight) in [(4, 10), (8, 100), (12, 1000)] {
            let digit = ins.binary_imm(BinaryOp::Lshr, word, shift);
            let digit = ins.binary_imm(BinaryOp::And, digit, 15);
            let digit = ins.binary_imm(BinaryOp::Mul, digit, weight);
            number = ins.binary(BinaryOp::Add, number, digit);
        }
        Bcd { number, wrong }
    }

    /// Where the address at a byte of F leads.
    pub(super) fn indirect(&mut self, at: u16) -> Indirect {
        let word = self.bytes(Space::F, at);
        let word = self.builder.ins().zextend_or_trunc(Type::I32, word);
        let Bcd { number, wrong: not_bcd } = self.take_bcd(word);
        let out = self.builder.ins().icmp_imm(IntCond::Ugt, number, 999);
        let bcd = self.not(not_bcd);
        let syntax = self.both(out, bcd);
        let within = self.not(out);
        let ok = self.both(within, bcd);
        Indirect { index: number, ok, syntax, not_bcd }
    }

    /// The word that an indirect access leads to.
    pub(super) fn indirect_word(&mut self, to: &Indirect) -> Value {
        let count = FLAG_BYTES as u32;
        let at = Address::indexed(self.regions.flag_bytes, 0, to.index, 1, count);
        self.builder.ins().load(Type::I16, at)
    }

    /// Writes the word that an indirect access leads to.
    pub(super) fn store_indirect(&mut self, to: &Indirect, value: Value) {
        let count = FLAG_BYTES as u32;
        let flags = self.regions.flag_bytes;
        let ins = self.builder.ins();
        let low = ins.zextend_or_trunc(Type::I8, value);
        ins.store(Address::indexed(flags, 0, to.index, 1, count), low);
        let high = ins.binary_imm(BinaryOp::Lshr, value, 8);
        let high = ins.zextend_or_trunc(Type::I8, high);
        ins.store(Address::indexed(flags, 1, to.index, 1, count), high);
        // What went behind F999 is dropped.
        let zero = ins.iconst(Type::I8, 0);
        ins.store(Address::fixed(flags, count), zero);
    }
}
