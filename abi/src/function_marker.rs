//! The marker in front of each function in the code: it binds the code to the tables beside it.
//!
//! Labels, the places of functions and the size of the process image are in tables, not in the
//! code. With the tables of another program an engine would enter the code in the middle of an
//! instruction, or give it an image that is too short for its accesses. So the compiler writes what
//! belongs to a function in front of it too, and whoever loads the code compares.
//!
//! | offset | bytes | holds |
//! | --- | --- | --- |
//! | 0 | 4 | [`MAGIC`] |
//! | 4 | 4 | the function's length in bytes |
//! | 8 | 4 | the size of the process image in bytes |
//! | 12 | 4 | CRC-32 of the function's labels: their numbers, rising, four bytes each |
//!
//! All numbers are little endian.

use alloc::vec::Vec;

use crate::CodeParts;

/// The length of a marker in bytes. Functions begin at multiples of it.
pub const LENGTH: usize = 16;

/// The bytes with which every marker begins.
pub const MAGIC: [u8; 4] = *b"plcF";

/// The markers of the functions, in their order, as the tables of `code` say they must be.
pub fn markers(code: &CodeParts) -> Vec<[u8; LENGTH]> {
    let mut labels: Vec<crc32fast::Hasher> = Vec::new();
    labels.resize_with(code.functions.len(), crc32fast::Hasher::new);
    for (label, offset) in (0_u32..).zip(&code.labels) {
        let found = code.functions.binary_search_by_key(offset, |function| function.offset);
        if let Some(function) = found.ok().and_then(|index| labels.get_mut(index)) {
            function.update(&label.to_le_bytes());
        }
    }
    let marker = |(labels, len): (crc32fast::Hasher, u32)| {
        let mut bytes = [0; LENGTH];
        let words = [
            MAGIC,
            len.to_le_bytes(),
            code.image_size.to_le_bytes(),
            labels.finalize().to_le_bytes(),
        ];
        for (place, byte) in bytes.iter_mut().zip(words.into_iter().flatten()) {
            *place = byte;
        }
        bytes
    };
    labels.into_iter().zip(code.functions.iter().map(|function| function.len)).map(marker).collect()
}

/// Writes the markers in front of the functions. Functions without room in front of them get none.
pub fn write(code: &mut CodeParts) {
    let markers = markers(code);
    for (function, marker) in code.functions.iter().zip(markers) {
        let start = (function.offset as usize).checked_sub(LENGTH);
        let room = start.and_then(|start| code.bytes.get_mut(start..start + LENGTH));
        if let Some(room) = room {
            room.copy_from_slice(&marker);
        }
    }
}

/// Whether every function has its marker in front of it.
pub(crate) fn are_right(code: &CodeParts) -> bool {
    code.functions.iter().zip(markers(code)).all(|(function, marker)| {
        let start = (function.offset as usize).checked_sub(LENGTH);
        start.and_then(|start| code.bytes.get(start..start + LENGTH)) == Some(&marker[..])
    })
}
