//! The bytes that accesses touch in the process image, and a mark for each byte.
//!
//! `forward` and `dead_stores` keep what they know of a byte in its mark, which is a number. An
//! image may have some megabytes, and a program many functions, so clearing all marks for each
//! function would take too long. Instead a pass asks for fresh *stamps*, which are numbers greater
//! than all marks so far, and writes only these as marks. Any smaller mark means nothing to it.

use std::ops::Range;

use crate::func::MAX_LOCAL_BITS;
use crate::{Address, BitGroups, Module, PrimaryMap, RegionId, Type};

/// Where the regions are in the image, and the marks.
pub(super) struct ImageBytes {
    /// For each region the address of its first byte.
    bases: PrimaryMap<RegionId, u64>,
    /// The address of the first of the local bits, which lie after the image.
    local_base: u64,
    /// For each byte of the image its mark; those below the stamps of a pass mean nothing to it.
    marks: Vec<u32>,
    /// The largest stamp so far.
    stamp: u32,
}

impl ImageBytes {
    /// The bytes of a module's image, without marks.
    pub(super) fn new(module: &Module) -> Self {
        let end = module.image_size.saturating_add(MAX_LOCAL_BITS);
        Self {
            bases: module.regions.iter().map(|region| region.offset.into()).collect(),
            local_base: module.image_size.into(),
            marks: vec![0; end as usize],
            stamp: 0,
        }
    }

    /// The addresses in the image of the bytes that an access of a type may touch.
    pub(super) fn bytes(&self, at: &Address, ty: Type) -> Range<usize> {
        let base = match at.region {
            RegionId::LOCAL_BITS => self.local_base,
            region => self.bases[region],
        };
        let Range { start, end } = at.extent(ty);
        (base + start) as usize..(base + end) as usize
    }

    /// The addresses of the bytes of the local bits of a group.
    pub(super) fn group(&self, groups: BitGroups, group: u32) -> Range<usize> {
        let Range { start, end } = groups.bits(group);
        (self.local_base + start) as usize..(self.local_base + end) as usize
    }

    /// The marks of some bytes. Bytes outside the image have none and are left out.
    pub(super) fn marks(&self, bytes: Range<usize>) -> &[u32] {
        let end = bytes.end.min(self.marks.len());
        self.marks.get(bytes.start.min(end)..end).unwrap_or(&[])
    }

    /// The marks of some bytes, to be changed.
    pub(super) fn marks_mut(&mut self, bytes: Range<usize>) -> &mut [u32] {
        let end = bytes.end.min(self.marks.len());
        self.marks.get_mut(bytes.start.min(end)..end).unwrap_or(&mut [])
    }

    /// The first of `count` consecutive stamps that are greater than every mark.
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
