//! The bytes of the process image that two versions of a function access, and what the executive and the program keep up in them.

use std::ops::Range;

use plcc_ir::{Address, Block, FuncData, InstData, Module, RegionId, Type};

use crate::logic::{FALSE, Graph, Lit, Memory};

/// What is kept up in some bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Kind {
    /// Nothing.
    Plain,
    /// Each byte is 0 or 1.
    Bits,
    /// Words of four bytes, the highest of which is 0.
    Word,
    /// Doubles that are finite and not -0.
    Double,
}

/// Bytes of one kind: a byte, a word or a double.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cell {
    pub(super) offset: usize,
    pub(super) kind: Kind,
}

impl Cell {
    /// How many bits of it can be chosen.
    pub(super) fn width(self) -> usize {
        match self.kind {
            Kind::Plain => 8,
            Kind::Bits => 1,
            Kind::Word => 24,
            Kind::Double => 64,
        }
    }

    fn bytes(self) -> usize {
        match self.kind {
            Kind::Plain | Kind::Bits => 1,
            Kind::Word => 4,
            Kind::Double => 8,
        }
    }

    /// Its bytes in the image.
    pub(super) fn range(self) -> Range<usize> {
        self.offset..self.offset + self.bytes()
    }
}

/// The bytes that functions access.
#[derive(Debug)]
pub(super) struct Universe {
    pub(super) cells: Vec<Cell>,
    size: usize,
}

/// The bytes of the image that an access may touch.
pub(super) fn bytes(module: &Module, at: &Address, ty: Type) -> Range<usize> {
    let Some(region) = module.region(at.region) else { return 0..0 };
    let Range { start, end } = at.extent(ty);
    let base = u64::from(region.offset);
    (base + start) as usize..(base + end) as usize
}

/// The bytes that an instruction may touch.
fn touched(module: &Module, func: &FuncData, inst: &InstData) -> Range<usize> {
    match inst {
        InstData::Load { ty, at } => bytes(module, at, *ty),
        InstData::Store { at, value } => bytes(module, at, func.ty(*value)),
        _ => 0..0,
    }
}

/// What is kept up in a region.
fn kind_of(module: &Module, region: RegionId) -> Kind {
    if module.finite_regions.contains(&region) {
        Kind::Double
    } else if module.word_regions.contains(&region) {
        Kind::Word
    } else if module.region(region).is_some_and(|region| region.bits) {
        Kind::Bits
    } else {
        Kind::Plain
    }
}

impl Universe {
    /// The bytes that some blocks of functions of a module access.
    pub(super) fn of(module: &Module, funcs: &[(&FuncData, Vec<Block>)]) -> Self {
        let size = module.image_size as usize;
        let mut touches = vec![false; size];
        for (func, blocks) in funcs {
            for &block in blocks {
                for &inst in &func.block(block).insts {
                    let range = touched(module, func, func.inst(inst));
                    let range = range.start.min(size)..range.end.min(size);
                    if let Some(slots) = touches.get_mut(range) {
                        slots.fill(true);
                    }
                }
            }
        }
        let mut cells = vec![];
        let mut known = vec![false; size];
        for (index, region) in module.regions.iter().enumerate() {
            let kind = kind_of(module, RegionId(index as u32));
            let step = Cell { offset: 0, kind }.bytes();
            let (start, end) = (region.offset as usize, (region.offset + region.size) as usize);
            for offset in (start..end.min(size)).step_by(step) {
                let all = offset..(offset + step).min(size);
                let is_touched = touches.get(all.clone()).is_some_and(|it| it.contains(&true));
                if is_touched {
                    cells.push(Cell { offset, kind });
                    if let Some(slots) = known.get_mut(all) {
                        slots.fill(true);
                    }
                }
            }
        }
        let rest = touches.iter().zip(&known).enumerate();
        cells.extend(
            rest.filter(|(_, (touched, known))| **touched && !**known)
                .map(|(offset, _)| Cell { offset, kind: Kind::Plain }),
        );
        Self { cells, size }
    }

    /// How many bits can be chosen.
    pub(super) fn width(&self) -> usize {
        self.cells.iter().map(|cell| cell.width()).sum()
    }

    /// An image of which nothing is chosen.
    pub(super) fn empty(&self) -> Memory {
        let mut memory = Memory::of_bytes(&[]);
        memory.grow(self.size);
        memory
    }

    /// Puts bits that may be anything into an image, so that what is kept up holds of them.
    pub(super) fn fill(&self, graph: &mut Graph, memory: &mut Memory, mut raw: &[Lit]) {
        for cell in &self.cells {
            let (own, rest) = raw.split_at(cell.width().min(raw.len()));
            raw = rest;
            let bits = match cell.kind {
                Kind::Plain | Kind::Bits => own.to_vec(),
                Kind::Word => graph.resize(own, 32, FALSE),
                Kind::Double => finite(graph, own, false),
            };
            memory.store(cell.offset, &bits);
        }
    }

    /// The bytes that [`fill`](Self::fill) puts where the bits have values.
    pub(super) fn concrete(&self, bit: &dyn Fn(usize) -> bool) -> Vec<(usize, u8)> {
        let (mut at, mut all) = (0, vec![]);
        for cell in &self.cells {
            let width = cell.width();
            let number = (0..width).fold(0, |all, place| all | u64::from(bit(at + place)) << place);
            at += width;
            let number = match cell.kind {
                Kind::Double => finite_number(number as i64, false) as u64,
                _ => number,
            };
            all.extend(cell.range().zip(number.to_le_bytes()));
        }
        all
    }

    /// All bits of an image, of the bytes that are accessed.
    pub(super) fn bits(&self, memory: &Memory) -> Vec<Lit> {
        let bytes = |cell: &Cell| memory.load(cell.offset, cell.bytes());
        self.cells.iter().flat_map(bytes).collect()
    }
}

/// The bits of a double, changed so that it is finite and, unless `minus_zero`, not -0. Those of each such double stay as they are.
pub(super) fn finite(graph: &mut Graph, raw: &[Lit], minus_zero: bool) -> Vec<Lit> {
    let mut bits = raw.to_vec();
    let is_special = graph.all(raw.iter().copied().skip(52).take(11));
    if let Some(lowest) = bits.get_mut(52) {
        *lowest = graph.and(*lowest, !is_special);
    }
    if !minus_zero {
        let size = graph.any(bits.iter().copied().take(63));
        if let Some(sign) = bits.last_mut() {
            *sign = graph.and(*sign, size);
        }
    }
    bits
}

/// What [`finite`] makes of a double.
pub(super) fn finite_number(bits: i64, minus_zero: bool) -> i64 {
    const EXPONENT: i64 = 0x7FF << 52;
    let bits = if bits & EXPONENT == EXPONENT { bits & !(1 << 52) } else { bits };
    if !minus_zero && bits << 1 == 0 { 0 } else { bits }
}
