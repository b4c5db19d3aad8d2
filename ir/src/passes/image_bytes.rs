//! Where in the image accesses go, as plain byte numbers.

use std::ops::Range;

use crate::{Address, Module, Type};

/// The regions' places in the image, and a number for each byte of it.
pub(super) struct Places {
    bases: Vec<u64>,
    /// A pass's own note on each byte. What an earlier pass or function left is told apart by
    /// the pass: clearing them all would cost more than the pass.
    notes: Vec<u32>,
    /// Rises; larger than any note of an earlier use.
    stamp: u32,
}

impl Places {
    /// The places of a module.
    pub(super) fn new(module: &Module) -> Self {
        Self {
            bases: module.regions.iter().map(|region| region.offset.into()).collect(),
            notes: vec![0; module.image_size as usize],
            stamp: 0,
        }
    }

    /// The bytes that an access may touch.
    pub(super) fn bytes(&self, at: &Address, ty: Type) -> Range<usize> {
        let base = self.bases.get(at.region.index()).copied().unwrap_or(0);
        let (start, end) = at.extent(ty);
        (base + start) as usize..(base + end) as usize
    }

    /// The notes on some bytes.
    pub(super) fn notes(&self, bytes: Range<usize>) -> &[u32] {
        let end = bytes.end.min(self.notes.len());
        self.notes.get(bytes.start.min(end)..end).unwrap_or(&[])
    }

    /// The notes on some bytes, to change.
    pub(super) fn notes_mut(&mut self, bytes: Range<usize>) -> &mut [u32] {
        let end = bytes.end.min(self.notes.len());
        self.notes.get_mut(bytes.start.min(end)..end).unwrap_or(&mut [])
    }

    /// `count` numbers in a row that no note has.
    pub(super) fn fresh(&mut self, count: u32) -> u32 {
        if self.stamp.checked_add(count).is_none_or(|next| next == u32::MAX) {
            self.notes.fill(0);
            self.stamp = 0;
        }
        let first = self.stamp + 1;
        self.stamp += count;
        first
    }
}
