//! What instructions do to bytes: those of the process image, and a function's local bits. Interpreters of IR share it.

use plcc_abi::image;

use crate::{Address, BitGroups, Module, Type, Value};

/// The value of a type at an offset.
pub fn read(bytes: &[u8], offset: u32, ty: Type) -> i64 {
    match ty {
        Type::I1 => i64::from(image::read_u8(bytes, offset) & 1),
        Type::I8 => i64::from(image::read_u8(bytes, offset) as i8),
        Type::I16 => i64::from(image::read_i16(bytes, offset)),
        Type::I32 => i64::from(image::read_i32(bytes, offset)),
        Type::I64 | Type::F64 => image::read_i64(bytes, offset),
    }
}

/// Gives the bytes at an offset a value of a type.
pub fn write(bytes: &mut [u8], offset: u32, ty: Type, value: i64) {
    match ty {
        Type::I1 => image::write_u8(bytes, offset, value as u8 & 1),
        Type::I8 => image::write_u8(bytes, offset, value as u8),
        Type::I16 => image::write_i16(bytes, offset, value as i16),
        Type::I32 => image::write_i32(bytes, offset, value as i32),
        Type::I64 | Type::F64 => image::write_i64(bytes, offset, value),
    }
}

/// Gives local bits those of a word.
pub fn unpack(local_bits: &mut [u8], word: i64, to: &BitGroups) {
    for group in to.iter() {
        for (bit, number) in to.bits(group).zip(8 * group..) {
            write(local_bits, bit as u32, Type::I1, word >> number & 1);
        }
    }
}

/// The word of local bits.
pub fn pack(local_bits: &[u8], from: &BitGroups) -> i64 {
    let bits = from.iter().flat_map(|group| from.bits(group).zip(8 * group..));
    let bit = |(bit, number)| read(local_bits, bit as u32, Type::I1) << number;
    Type::I32.wrap(bits.map(bit).fold(0, |word, bit| word | bit))
}

impl Module {
    /// The offset of an address in the process image. An index outside its bounds, which the bounds check before has caught, counts
    /// as 0.
    pub fn image_offset(&self, at: &Address, get: impl Fn(Value) -> i64) -> u32 {
        let region = self.region(at.region).map_or(0, |region| region.offset);
        let moved = at.index.map_or(0, |index| {
            let number = get(index.value) as u32;
            if number < index.count { number.wrapping_mul(index.scale) } else { 0 }
        });
        region.wrapping_add(at.offset).wrapping_add(moved)
    }
}
