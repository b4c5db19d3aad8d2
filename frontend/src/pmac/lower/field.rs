//! Fields of 24-bit words, as M- and L-variables name them: reading and replacing them in IR.

use plcc_abi::pmac::{Field, Format};
use plcc_ir::{Address, BinaryOp, ExtractOp, FuncBuilder, InstBuilder, Type, UnaryOp, Value};

/// The bits of a digit of a decimal field.
const DIGIT_BITS: u8 = 4;

/// The field of the word, which has 32 bits in the image.
fn place(field: Field) -> plcc_ir::Field {
    plcc_ir::Field { first: field.offset, width: field.width }
}

/// Reads a field of a word in the image, as an `i32`.
pub(crate) fn read_field(b: &mut FuncBuilder, at: Address, field: Field) -> Value {
    let word = b.load(Type::I32, at);
    field_of(b, word, field)
}

/// The value of a field of a word, as an `i32`: unsigned (U), signed (S), or of decimal digits (D,
/// and C with its bits complemented).
pub(crate) fn field_of(b: &mut FuncBuilder, word: Value, field: Field) -> Value {
    let word = match field.format {
        Format::S => return b.extract(ExtractOp::Signed, word, place(field)),
        Format::U => return b.extract(ExtractOp::Unsigned, word, place(field)),
        Format::D => word,
        Format::C => b.unary(UnaryOp::Not, word),
    };
    let mut sum = b.constant(Type::I32, 0);
    for number in (0..field.width.div_ceil(DIGIT_BITS)).rev() {
        let first = number * DIGIT_BITS;
        let width = DIGIT_BITS.min(field.width - first);
        let digit = plcc_ir::Field { first: field.offset + first, width };
        let digit = b.extract(ExtractOp::Unsigned, word, digit);
        let tens = b.binary_imm(BinaryOp::Mul, sum, 10);
        sum = b.binary(BinaryOp::Add, tens, digit);
    }
    sum
}

/// A word with a field replaced by the low bits of an `i32`.
pub(crate) fn insert_field(b: &mut FuncBuilder, word: Value, field: Field, bits: Value) -> Value {
    b.insert(word, bits, place(field))
}

/// Replaces a field of a word in the image by the low bits of an `i32`. A field of 24 bits is the
/// whole word, so the old word is not read.
pub(crate) fn write_field(b: &mut FuncBuilder, at: Address, field: Field, bits: Value) {
    let word = if field.width == 24 {
        b.extract(ExtractOp::Unsigned, bits, place(field))
    } else {
        let old = b.load(Type::I32, at);
        insert_field(b, old, field, bits)
    };
    b.store(at, word);
}
