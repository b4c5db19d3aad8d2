//! Shows compiled code to gdb (`--gdb`), so that it stops at lines of the program's source and prints its
//! variables.
//!
//! The compiler makes an ELF file that describes the code for debuggers: symbols, lines, unwind
//! information, the type of the process image. It is made for code at address 0, and holds none. When the
//! code has been mapped, [`set_addresses`] adds its address, and [`interface::register`] tells gdb of the result. gdb
//! never has to forget code: all code that it knows of stays mapped until the process ends.
//!
//! | section | its address in the file | becomes |
//! | --- | --- | --- |
//! | allocated, cannot be written | an offset from the beginning of the code | that offset from where the code is mapped |
//! | allocated, can be written | 0 | where the pointer to the scan context is kept, for the variable `context` |

mod interface;

use std::ptr;
use std::sync::atomic::AtomicPtr;

use plcc_abi::ScanContext;

/// Code that gdb has been told of.
pub(crate) struct ShownCode {
    /// gdb's variable `context` is here, for as long as the process lives.
    context: &'static AtomicPtr<ScanContext>,
}

impl ShownCode {
    /// Tells gdb of code that is mapped at an address, where it stays until the process ends. `debug` is what
    /// the compiler made for it.
    ///
    /// # Errors
    /// What is wrong with `debug`.
    pub(crate) fn new(debug: &[u8], code: usize) -> Result<Self, &'static str> {
        let mut file = debug.to_vec();
        let context = Box::leak(Box::new(AtomicPtr::new(ptr::null_mut())));
        set_addresses(&mut file, code as u64, (&raw const *context) as u64)?;
        interface::register(file);
        Ok(Self { context })
    }

    /// Where to store with which context the code is executed from now on, for gdb's variable `context`.
    /// This process never reads it.
    pub(crate) fn context(&self) -> &'static AtomicPtr<ScanContext> {
        self.context
    }
}

/// Sets the addresses of an ELF file's allocated sections, as the table at the head of this file says. `code` is
/// where the code is mapped, `context` where the pointer to the scan context is kept.
///
/// # Errors
/// When it is not an ELF file of 64 bits, little endian, or ends too early.
fn set_addresses(file: &mut [u8], code: u64, context: u64) -> Result<(), &'static str> {
    const DAMAGED: &str = "its debug part is damaged";
    /// `\x7FELF`, 64 bits, little endian.
    const MAGIC: &[u8] = b"\x7FELF\x02\x01";
    /// Where the file's header has the offset of the sections' headers, and their number.
    const SECTIONS: usize = 0x28;
    const COUNT: usize = 0x3C;
    /// The length of a section's header, and where it has flags and address.
    const HEADER: usize = 64;
    const FLAGS: usize = 8;
    const ADDRESS: usize = 16;
    /// Bits of the flags.
    const WRITE: u64 = 1;
    const ALLOCATED: u64 = 2;
    let word = |file: &[u8], at: usize| {
        let bytes = file.get(at..).and_then(|rest| rest.first_chunk());
        bytes.map(|bytes| u64::from_le_bytes(*bytes)).ok_or(DAMAGED)
    };
    if !file.starts_with(MAGIC) {
        return Err(DAMAGED);
    }
    let start = usize::try_from(word(file, SECTIONS)?).map_err(|_| DAMAGED)?;
    let count = (word(file, COUNT - 4)? >> 32) as usize & 0xFFFF;
    for header in (0..count).map(|number| number * HEADER) {
        let header = start.checked_add(header).ok_or(DAMAGED)?;
        let flags = word(file, header.saturating_add(FLAGS))?;
        if flags & ALLOCATED == 0 {
            continue;
        }
        let at = header.saturating_add(ADDRESS);
        let address = match flags & WRITE {
            0 => word(file, at)?.wrapping_add(code),
            _ => context,
        };
        let place = file.get_mut(at..).and_then(|rest| rest.first_chunk_mut());
        *place.ok_or(DAMAGED)? = address.to_le_bytes();
    }
    Ok(())
}

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::indexing_slicing)]
mod tests {
    use super::set_addresses;

    /// A header, and those of three sections: code, unwind information and a context.
    fn file() -> Vec<u8> {
        let mut file = vec![0; 64];
        file[..6].copy_from_slice(b"\x7FELF\x02\x01");
        file[0x28] = 64;
        file[0x3C] = 4;
        for (flags, address) in [(0, 0), (6, 0), (2, 0x40), (3, 0_u8)] {
            let mut header = [0; 64];
            (header[8], header[16]) = (flags, address);
            file.extend(header);
        }
        file
    }

    #[test]
    fn allocated_sections_get_addresses() {
        let mut placed = file();
        set_addresses(&mut placed, 0x1000, 0x7FFF_0000_1234).unwrap();
        let address = |section: usize| {
            u64::from_le_bytes(placed[64 + section * 64 + 16..][..8].try_into().unwrap())
        };
        assert_eq!([0, 1, 2, 3].map(address), [0, 0x1000, 0x1040, 0x7FFF_0000_1234]);
    }

    #[test]
    fn damaged_files_are_refused() {
        let whole = file();
        for length in 0..whole.len() {
            // Nothing after the last address is read.
            let mut cut = whole[..length].to_vec();
            assert_eq!(
                set_addresses(&mut cut, 1, 2).is_ok(),
                length >= whole.len() - 40,
                "{length}"
            );
        }
        for at in [0, 4, 5, 0x28 + 7] {
            let mut changed = whole.clone();
            changed[at] ^= 0xFF;
            assert!(set_addresses(&mut changed, 1, 2).is_err(), "{at}");
        }
    }
}
