//! Bytes of flags that the executive reads together in every slice: those that drive the physical
//! lines, and those whose bits are messages.
//!
//! Most programs keep most of them as bytes, side by side. So a row is read by one copy of all bytes, to
//! which those are added that are kept elsewhere, as a byte for each bit.

use plcc_abi::nct::FlagLocation;

/// Where `N` bytes of flags lie in the image.
#[derive(Clone, Debug)]
pub(super) struct FlagRow<const N: usize> {
    /// The offset in the image of the first byte, where all that are kept as bytes lie side by side with
    /// gaps for the others.
    packed: Option<u32>,
    /// The others, each with its place in the row.
    others: Vec<(usize, FlagLocation)>,
}

impl<const N: usize> FlagRow<N> {
    /// The first `N` of some locations, in an image of this size.
    pub(super) fn new(locations: &[FlagLocation], image_size: usize) -> Self {
        let row = || locations.iter().copied().take(N).enumerate();
        let base = |(at, location): (usize, FlagLocation)| {
            if location.unpacked { None } else { location.offset.checked_sub(at as u32) }
        };
        let packed = row().find_map(base).filter(|base| *base as usize + N <= image_size);
        let is_other = |entry: &(usize, FlagLocation)| packed.is_none() || base(*entry) != packed;
        Self { packed, others: row().filter(is_other).collect() }
    }

    /// Reads them.
    pub(super) fn read(&self, image: &[u8]) -> [u8; N] {
        let packed = self.packed.and_then(|base| image.get(base as usize..)?.first_chunk());
        let mut row = packed.copied().unwrap_or([0; N]);
        for (at, location) in &self.others {
            if let Some(byte) = row.get_mut(*at) {
                *byte = location.read(image);
            }
        }
        row
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_reads_what_its_locations_read() {
        let image: Vec<u8> = (0..100).map(|at: u8| at.wrapping_mul(37)).collect();
        let packed = |offset| FlagLocation { offset, unpacked: false };
        let unpacked = |offset| FlagLocation { offset, unpacked: true };
        let rows = [
            [packed(10), packed(11), packed(12), packed(13)],
            [packed(10), unpacked(40), packed(12), unpacked(48)],
            [unpacked(40), packed(11), unpacked(56), packed(13)],
            // Byte 3 does not follow, byte 0 has no place before it, the last row ends with the image.
            [packed(10), packed(11), packed(12), packed(60)],
            [unpacked(8), packed(0), packed(1), packed(2)],
            [packed(98), packed(99), unpacked(0), unpacked(8)],
            [unpacked(0), unpacked(8), unpacked(16), unpacked(24)],
        ];
        for locations in rows {
            let row = FlagRow::<4>::new(&locations, image.len());
            assert_eq!(row.read(&image), locations.map(|location| location.read(&image)));
        }
    }
}
