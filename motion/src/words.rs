//! Where in the image the registers are.

use plcc_abi::image::{read_u64, write_u64};
use plcc_abi::pmac::fixed;

/// The offset of a word that is not in the image.
pub(crate) const NOWHERE: u32 = u32::MAX;

/// The bits of a word.
pub(crate) const WORD: u32 = 0xFF_FFFF;

/// Writes a 48-bit integer to the X word at an offset and the Y word behind it.
#[inline]
pub(crate) fn write_double(image: &mut [u8], offset: u32, bits: u64) {
    let (x, y) = (bits >> 24 & u64::from(WORD), bits & u64::from(WORD));
    write_u64(image, offset, x | y << 32);
}

/// The words of 48 bits from the X word at an offset on: X and Y.
#[inline]
fn read_words(image: &[u8], offset: u32) -> (u32, u32) {
    let words = read_u64(image, offset);
    (words as u32 & WORD, (words >> 32) as u32 & WORD)
}

/// The 48-bit integer there.
#[inline]
pub(crate) fn read_integer(image: &[u8], offset: u32) -> f64 {
    let (x, y) = read_words(image, offset);
    fixed::sign_extend(u64::from(x) << 24 | u64::from(y), 48) as f64
}

/// The 48-bit floating-point number there.
#[inline]
pub(crate) fn read_float(image: &[u8], offset: u32) -> f64 {
    let (x, y) = read_words(image, offset);
    fixed::from_float48(x, y)
}

/// Writes a 48-bit floating-point number.
#[inline]
pub(crate) fn write_float(image: &mut [u8], offset: u32, value: f64) {
    let (x, y) = fixed::to_float48(value);
    write_u64(image, offset, u64::from(x) | u64::from(y) << 32);
}

/// Offsets in the image of a motor's registers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MotorWords {
    /// Those of 48 bits are where their X word is, with the Y word behind it.
    pub(crate) commanded: u32,
    pub(crate) actual: u32,
    pub(crate) target: u32,
    pub(crate) following_error: u32,
    pub(crate) velocity: u32,
    /// PMAC: its Y word alone.
    pub(crate) filtered: u32,
    pub(crate) home_offset: u32,
    pub(crate) bias: u32,
    pub(crate) variable_jog: u32,
    /// The first of the three scale factors.
    pub(crate) scales: u32,
    pub(crate) output: u32,
    pub(crate) status_x: u32,
    pub(crate) status_y: u32,
    pub(crate) conversion: u32,
    /// PMAC: the Y word of its DAC.
    pub(crate) dac: u32,
}

/// Offsets in the image of a coordinate system's registers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SystemWords {
    /// That of A, with those of the other axes behind it.
    pub(crate) targets: u32,
    pub(crate) commanded_base: u32,
    /// The address of that, in X memory.
    pub(crate) base_address: u32,
    pub(crate) present_base: u32,
    pub(crate) status_x: u32,
    pub(crate) status_y: u32,
}
