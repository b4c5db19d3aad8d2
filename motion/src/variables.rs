//! The I-variables of motors.

use plcc_abi::image::read_f64;
use plcc_abi::pmac::Layout;

/// How many bytes those of one motor take.
const SIZE: usize = 800;

/// Where there are none, they are 0.
static NONE: [u8; SIZE] = [0; SIZE];

/// The hundred I-variables of a motor.
#[derive(Clone, Copy)]
pub(crate) struct Variables<'a>(&'a [u8; SIZE]);

impl<'a> Variables<'a> {
    /// Those of a motor, by its index from 0.
    #[inline]
    pub(crate) fn of(image: &'a [u8], layout: &Layout, motor: usize) -> Self {
        let start = layout.i as usize + SIZE * (motor + 1);
        Self(image.get(start..start + SIZE).and_then(<[u8]>::first_chunk).unwrap_or(&NONE))
    }

    /// Ix00 to Ix99.
    #[inline]
    pub(crate) fn i(self, number: u32) -> f64 {
        read_f64(self.0, 8 * number)
    }

    /// Whether one is not 0.
    #[inline]
    pub(crate) fn is_set(self, number: u32) -> bool {
        self.i(number) != 0.0
    }

    /// The bits of some of them, so that it can be seen whether one of them has changed.
    #[inline]
    pub(crate) fn bits<const N: usize>(self, numbers: [u32; N]) -> [u64; N] {
        numbers.map(|number| self.i(number).to_bits())
    }

    /// Whether some of them have these bits.
    #[inline]
    pub(crate) fn are<const N: usize>(self, numbers: [u32; N], bits: &[u64; N]) -> bool {
        let differing = |all, (number, bits)| all | (self.i(number).to_bits() ^ bits);
        numbers.into_iter().zip(bits).fold(0, differing) == 0
    }
}
