//! Accesses as byte addresses in the process image, and a mark for each of its bytes.
//!
//! `forward` and `dead_stores` ask of each access which bytes it touches and what is known of
//! them. An image has up to some megabytes, and a program many functions, so the marks cannot be
//! cleared for each function. Instead a mark counts only if it is not below a *stamp*: a pass asks
//! for fresh stamps, larger than all before, and thereby forgets every mark at once.

use std::ops::Range;

use crate::{Address, Module, Type};

/// Where the regions are in the image, and the marks.
pub(super) struct ImageBytes {
    /// For each region the address of its first byte.
    bases: Vec<u64>,
    /// For each byte of the image its mark; those below the stamps of a pass mean nothing to it.
    marks: Vec<u32>,
    /// The largest stamp so far.
    stamp: u32,
}

impl ImageBytes {
    /// The bytes of a module's image, without marks.
    pub(super) fn new(module: &Module) -> Self {
        Self {
            bases: module.regions.iter().map(|region| region.offset.into()).collect(),
            marks: vec![0; module.image_size as usize],
            stamp: 0,
        }
    }

    /// The addresses of the bytes that an access may touch.
    pub(super) fn bytes(&self, at: &Address, ty: Type) -> Range<usize> {
        let base = self.bases.get(at.region.index()).copied().unwrap_or(0);
        let (start, end) = at.extent(ty);
        (base + start) as usize..(base + end) as usize
    }

    /// The marks of some bytes; those outside the image have none.
    pub(super) fn marks(&self, bytes: Range<usize>) -> &[u32] {
        let end = bytes.end.min(self.marks.len());
        self.marks.get(bytes.start.min(end)..end).unwrap_or(&[])
    }

    /// The marks of some bytes, to be changed.
    pub(super) fn marks_mut(&mut self, bytes: Range<usize>) -> &mut [u32] {
        let end = bytes.end.min(self.marks.len());
        self.marks.get_mut(bytes.start.min(end)..end).unwrap_or(&mut [])
    }

    /// The first of `count` stamps in a row that no mark has.
    pub(super) fn fresh_stamps(&mut self, count: u32) -> u32 {
        if self.stamp.checked_add(count).is_none_or(|next| next == u32::MAX) {
            self.marks.fill(0);
            self.stamp = 0;
        }
        let first = self.stamp + 1;
        self.stamp += count;
        first
    }
}
