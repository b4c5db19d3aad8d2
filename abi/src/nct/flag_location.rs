//! Where a byte of flags lies in the image: eight bits in one byte, or unpacked, a byte for each bit.
//! The compiler unpacks the bytes whose bits a program uses singly, since a byte of 0 or 1 is read and
//! written by one instruction.

use serde::{Deserialize, Serialize};

use crate::image;

/// The place in the image of one byte of flags.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct FlagLocation {
    /// The offset in the image of the byte; if it is unpacked, of bit 0, which bits 1 to 7 follow.
    pub offset: u32,
    /// Whether it is kept as eight bytes of 0 or 1, one for each bit.
    pub unpacked: bool,
}

impl FlagLocation {
    /// Reads the byte.
    #[inline]
    pub fn read(self, image: &[u8]) -> u8 {
        if !self.unpacked {
            return image::read_u8(image, self.offset);
        }
        // Each byte's lowest bit is moved to the top byte by one multiplication: bit i of byte i.
        let bits = image::read_u64(image, self.offset) & 0x0101_0101_0101_0101;
        (bits.wrapping_mul(0x0102_0408_1020_4080) >> 56) as u8
    }

    /// Writes the byte.
    #[inline]
    pub fn write(self, image: &mut [u8], value: u8) {
        if !self.unpacked {
            return image::write_u8(image, self.offset, value);
        }
        let spread = u64::from(value).wrapping_mul(0x0101_0101_0101_0101) & 0x8040_2010_0804_0201;
        // A byte that is not zero carries into its own highest bit, never beyond.
        let bits = (((spread & 0x7F7F_7F7F_7F7F_7F7F) + 0x7F7F_7F7F_7F7F_7F7F) | spread) >> 7;
        image::write_u64(image, self.offset, bits & 0x0101_0101_0101_0101);
    }

    /// Reads bit 0 to 7; a bit of any other number is false.
    #[inline]
    pub fn bit(self, image: &[u8], bit: u8) -> bool {
        if bit > 7 {
            false
        } else if self.unpacked {
            image::read_u8(image, self.offset + u32::from(bit)) & 1 != 0
        } else {
            image::read_u8(image, self.offset) >> bit & 1 != 0
        }
    }

    /// Writes bit 0 to 7; a bit of any other number is not written.
    #[inline]
    pub fn set_bit(self, image: &mut [u8], bit: u8, value: bool) {
        if bit > 7 {
            return;
        }
        if self.unpacked {
            image::write_u8(image, self.offset + u32::from(bit), u8::from(value));
        } else {
            let byte = image::read_u8(image, self.offset) & !(1 << bit);
            image::write_u8(image, self.offset, byte | u8::from(value) << bit);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::FlagLocation;

    #[test]
    fn every_byte_reads_back_packed_and_unpacked() {
        for unpacked in [false, true] {
            let location = FlagLocation { offset: 1, unpacked };
            for value in 0..=255 {
                let mut image = [0; 10];
                location.write(&mut image, value);
                assert_eq!(location.read(&image), value);
                assert_eq!((image[0], image[9]), (0, 0));
                for bit in 0..8 {
                    assert_eq!(location.bit(&image, bit), value >> bit & 1 != 0);
                    let mut other = image;
                    location.set_bit(&mut other, bit, value >> bit & 1 == 0);
                    assert_eq!(location.read(&other), value ^ 1 << bit);
                }
                if unpacked {
                    assert!(image.iter().all(|&byte| byte <= 1));
                }
            }
        }
    }
}
