//! Where everything stands in the image.
//!
//! One region a type, so that two accesses of different types never touch the same byte:
//! `logical` (bits: one byte a LOGICAL), `integer`, `long` (timers' counters too) and `port`, the
//! physical lines, one byte a port.

use plcc_abi::{Region, pmi::Type};

use super::ast::{Checked, Meaning, SymbolId};

/// The number of ports: 16 MAX boards of 128.
const PORTS: u32 = 2048;

/// The image's layout.
#[derive(Clone, Debug, Default)]
pub(super) struct Layout {
    /// By rising offset: `logical`, `integer`, `long`, `port`.
    pub(super) regions: Vec<Region>,
    /// The image's size in bytes.
    pub(super) size: u32,
    /// Offset of each timer's counter.
    pub(super) counters: Vec<u32>,
    /// Offset of each flip-flop's last clock.
    pub(super) last_clocks: Vec<u32>,
    /// Offset of the lines.
    pub(super) ports: u32,
    /// Offset of each symbol.
    places: Vec<u32>,
}

/// The region of a type's variables.
pub(super) fn region_name(ty: Type) -> &'static str {
    match ty {
        Type::Logical => "logical",
        Type::Integer => "integer",
        Type::Long => "long",
    }
}

impl Layout {
    /// Lays out a program's variables.
    pub(super) fn new(checked: &Checked) -> Self {
        let mut this = Self { places: vec![0; checked.symbols.len()], ..Self::default() };
        for ty in [Type::Logical, Type::Integer, Type::Long] {
            let start = this.size;
            for (place, symbol) in this.places.iter_mut().zip(&checked.symbols) {
                if symbol.ty == ty && !matches!(symbol.meaning, Meaning::Label(_)) {
                    *place = this.size;
                    this.size += symbol.elements.unwrap_or(1) * ty.size();
                }
            }
            match ty {
                Type::Logical => this.last_clocks = this.row(checked.flipflops.len(), 1),
                Type::Integer => {}
                Type::Long => this.counters = this.row(checked.timers.len(), 4),
            }
            this.region(region_name(ty), start, ty == Type::Logical);
        }
        this.ports = this.size;
        this.size += PORTS;
        this.region("port", this.ports, false);
        this
    }

    fn row(&mut self, count: usize, size: u32) -> Vec<u32> {
        let start = self.size;
        self.size += count as u32 * size;
        (0..count as u32).map(|i| start + i * size).collect()
    }

    /// Ends a region that started at `start`.
    fn region(&mut self, name: &str, start: u32, bits: bool) {
        let size = self.size - start;
        self.regions.push(Region { name: name.to_owned(), offset: start, size, bits });
        self.size = self.size.next_multiple_of(8);
    }

    /// A symbol's offset in the image.
    pub(super) fn place(&self, id: SymbolId) -> u32 {
        self.places.get(id.0 as usize).copied().unwrap_or(0)
    }

    /// The offset of a type's region.
    pub(super) fn base(&self, ty: Type) -> u32 {
        let index = match ty {
            Type::Logical => 0,
            Type::Integer => 1,
            Type::Long => 2,
        };
        self.regions.get(index).map_or(0, |region: &Region| region.offset)
    }
}
