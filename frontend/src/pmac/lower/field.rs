//! Fields of 24-bit words, as M- and L-variables name them: reading and replacing them in IR.

use plcc_abi::pmac::Field;
use plcc_ir::{Address, BinaryOp, FuncBuilder, Type, Value};

/// Reads a field of a word in the image, as an `i32`.
pub(crate) fn read_field(b: &mut FuncBuilder, at: Address, field: Field) -> Value {
    let word = b.load(Type::I32, at);
    field_of(b, word, field)
}

/// The value of a field of a word, as an `i32`: unsigned (U), signed (S), or of decimal digits (D,
/// and C with its bits complemented).
pub(crate) fn field_of(b: &mut FuncBuilder, word: Value, field: Field) -> Value {
    use plcc_abi::pmac::Format;
    let (offset, width) = (i64::from(field.offset), i64::from(field.width));
    match field.format {
        Format::S => {
            let left = b.binary_imm(BinaryOp::Shl, word, 32 - offset - width);
            b.binary_imm(BinaryOp::Ashr, left, 32 - width)
        }
        Format::U => {
            let low = if offset == 0 { word } else { b.binary_imm(BinaryOp::Lshr, word, offset) };
            b.binary_imm(BinaryOp::And, low, (1 << width) - 1)
        }
        Format::D | Format::C => {
            let low = b.binary_imm(BinaryOp::Lshr, word, offset);
            let low = match field.format {
                Format::C => b.binary_imm(BinaryOp::Xor, low, -1),
                _ => low,
            };
            let bits = b.binary_imm(BinaryOp::And, low, (1 << width) - 1);
            let mut sum = b.iconst(Type::I32, 0);
            for digit in (0..6).rev() {
                let tens = b.binary_imm(BinaryOp::Mul, sum, 10);
                let nibble = b.binary_imm(BinaryOp::Lshr, bits, 4 * digit);
                let nibble = b.binary_imm(BinaryOp::And, nibble, 15);
                sum = b.binary(BinaryOp::Add, tens, nibble);
            }
            sum
        }
    }
}

/// A word with a field replaced by the low bits of an `i32`.
pub(crate) fn insert_field(b: &mut FuncBuilder, word: Value, field: Field, bits: Value) -> Value {
    let mask = ((1i64 << field.width) - 1) << field.offset;
    let shifted = match field.offset {
        0 => bits,
        offset => b.binary_imm(BinaryOp::Shl, bits, i64::from(offset)),
    };
    let new = b.binary_imm(BinaryOp::And, shifted, mask);
    let old = b.binary_imm(BinaryOp::And, word, 0xFF_FFFF & !mask);
    b.binary(BinaryOp::Or, old, new)
}

/// Replaces a field of a word in the image by the low bits of an `i32`. A field of 24 bits is the
/// whole word, so the old word is not read.
pub(crate) fn write_field(b: &mut FuncBuilder, at: Address, field: Field, bits: Value) {
    let word = if field.width == 24 {
        b.binary_imm(BinaryOp::And, bits, 0xFF_FFFF)
    } else {
        let old = b.load(Type::I32, at);
        insert_field(b, old, field, bits)
    };
    b.store(at, word);
}
