//! Local variables as operands: bytes at their flag locations, register areas, the flags that a
//! statement writes.

use plcc_abi::nct::arithmetic::{from_bcd, sign_extend};
use plcc_abi::nct::{FLAG_BYTES, FlagLocation};

/// Flags that statements with a register area write, as byte and bit of F.
pub(super) mod flag {
    /// The result is zero.
    pub(crate) const ZERO: (u16, u8) = (4, 6);
    /// The result is negative.
    pub(crate) const SIGN: (u16, u8) = (4, 7);
    /// The result does not fit.
    pub(crate) const OVERFLOW: (u16, u8) = (5, 3);
    /// A register of the area holds what it can't.
    pub(crate) const SYNTAX: (u16, u8) = (8, 0);
    /// A search found nothing.
    pub(crate) const NOT_FOUND: (u16, u8) = (8, 1);
    /// A register of the area is not BCD.
    pub(crate) const NOT_BCD: (u16, u8) = (8, 2);
}

/// The local variables F000 to F999 in the image.
pub(super) struct Locals<'a> {
    image: &'a mut [u8],
    locations: &'a [FlagLocation],
}

impl<'a> Locals<'a> {
    pub(super) fn new(image: &'a mut [u8], locations: &'a [FlagLocation]) -> Self {
        Self { image, locations }
    }

    /// A byte; 0 beyond F999.
    pub(super) fn byte(&self, n: u16) -> u8 {
        self.locations.get(usize::from(n)).map_or(0, |location| location.read(self.image))
    }

    /// Writes a byte; nothing beyond F999.
    pub(super) fn set_byte(&mut self, n: u16, value: u8) {
        if let Some(location) = self.locations.get(usize::from(n)) {
            location.write(self.image, value);
        }
    }

    /// A word, low byte first.
    pub(super) fn word(&self, n: u16) -> u16 {
        u16::from_le_bytes([self.byte(n), self.byte(n.saturating_add(1))])
    }

    /// Writes a word.
    pub(super) fn set_word(&mut self, n: u16, value: u16) {
        let [low, high] = value.to_le_bytes();
        self.set_byte(n, low);
        self.set_byte(n.saturating_add(1), high);
    }

    /// Writes a flag.
    pub(super) fn set_flag(&mut self, (byte, bit): (u16, u8), value: bool) {
        if let Some(location) = self.locations.get(usize::from(byte)) {
            location.set_bit(self.image, bit, value);
        }
    }

    /// A signed number of `size` bytes, at most 8.
    pub(super) fn number(&self, n: u16, size: u16) -> i64 {
        let mut value = 0_i64;
        for i in (0..size).rev() {
            value = value << 8 | i64::from(self.byte(n.saturating_add(i)));
        }
        sign_extend(value, size)
    }

    /// Writes the low `size` bytes of a number.
    pub(super) fn set_number(&mut self, n: u16, size: u16, value: i64) {
        for (i, byte) in (0..size).zip(value.to_le_bytes()) {
            self.set_byte(n.saturating_add(i), byte);
        }
    }
}

/// What is wrong with a register area, collected before anything is done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Fault {
    /// A range violation, F0080.
    pub(super) syntax: bool,
    /// A register that is not BCD, F0082.
    pub(super) not_bcd: bool,
}

impl Fault {
    /// A check of the area itself, which begins at a local variable and has some bytes.
    pub(super) fn of_area(start: u16, size: u16) -> Self {
        Self { syntax: !fits(start, size), not_bcd: false }
    }

    /// The address in a register, of an operand of `size` bytes.
    pub(super) fn address(&mut self, register: u16, size: u16) -> u16 {
        let Some(address) = from_bcd(register) else {
            self.not_bcd = true;
            return 0;
        };
        self.syntax |= !fits(address, size);
        address
    }

    /// Whether anything is wrong.
    pub(super) fn any(self) -> bool {
        self.syntax || self.not_bcd
    }

    /// Writes F0080 and F0082 as found.
    pub(super) fn write(self, locals: &mut Locals<'_>) {
        locals.set_flag(flag::SYNTAX, self.syntax);
        locals.set_flag(flag::NOT_BCD, self.not_bcd);
    }
}

/// Whether bytes from a local variable on are all there.
fn fits(start: u16, size: u16) -> bool {
    let (start, size) = (usize::from(start), usize::from(size));
    start < FLAG_BYTES && start + size <= FLAG_BYTES
}
