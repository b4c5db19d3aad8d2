//! Memory for the process images of PMI and NCT, which are small.

use memmap2::MmapMut;
use thiserror::Error;

/// Why there is no process image.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("the system gives no memory for a process image of {size} bytes: {reason}")]
pub struct ImageMemoryError {
    size: u32,
    reason: String,
}

/// An image of zeros in pages of its own, as code has. Linux maps new pages beside those that it has mapped last, so
/// code and image of a short program share a line of the page tables, for which a tick waits when it comes after much other work.
pub(crate) fn image_memory(size: u32) -> Result<MmapMut, ImageMemoryError> {
    MmapMut::map_anon(size as usize)
        .map_err(|error| ImageMemoryError { size, reason: error.to_string() })
}

#[cfg(test)]
mod tests {
    use super::image_memory;

    #[test]
    fn an_image_has_its_size_and_is_zero() {
        for size in [0, 1, 4096, 8184] {
            assert_eq!(&*image_memory(size).unwrap(), vec![0; size as usize]);
        }
    }
}
