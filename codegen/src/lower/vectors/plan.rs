//! Finds the rows of a function, block by block.
//!
//! The stores of a row are done where the last of them stands, and what they store is computed there.
//! That gives the same result if nothing between a store and that place reads or writes the store's bytes, if
//! nothing between a load and that place writes what it loads, and if nothing else in between has an effect.
//! A store that belongs to the same row or to a later one is delayed itself and does not count. So all stores
//! that may be rows are first supposed to be rows; if some turn out not to be, the others are examined again.
//! The rows of a block are entered in the order in which they are written, so that a row can use what rows
//! before it have computed.

use std::ops::Range;

use plcc_ir::passes::thresholds::vectors::MIN_STORES;
use plcc_ir::tables::{FastMap, FastSet};
use plcc_ir::{
    Address, Block, FuncData, Inst, InstData, Module, PrimaryMap, SecondaryMap, Type, Value,
};

use super::super::memory;
use super::row::{Chain, Format, Node, StoredRow, Vectors};

/// Operations are followed to this depth from a store.
const MAX_DEPTH: u32 = 8;
/// Whether stores may be lanes of one row is first decided by operations to this depth.
pub(super) const SHAPE_DEPTH: u32 = 3;
/// If the stores of a block are not rows after this many attempts, each with fewer of them, the block has none.
const MAX_ROUNDS: usize = 4;
/// A store moves over at most this many instructions.
const MAX_DISTANCE: u32 = 4000;

/// A store to a fixed address.
#[derive(Clone, Copy)]
pub(super) struct Store {
    pub(super) inst: Inst,
    /// Its place in the block.
    pub(super) position: u32,
    pub(super) at: Address,
    /// Its [place](memory).
    pub(super) offset: i64,
    pub(super) ty: Type,
    pub(super) value: Value,
    /// Equal for values that are computed by the same operations.
    pub(super) shape: u64,
}

/// Finds the rows of a function.
pub(in super::super) fn plan(module: &Module, func: &FuncData) -> Vectors {
    let mut planner = Planner {
        module,
        func,
        positions: PrimaryMap::new(),
        uses: SecondaryMap::new(),
        accesses: FastMap::default(),
        indexed: vec![],
        effects: vec![],
        known: FastMap::default(),
        added: vec![],
        end: 0,
        delayed: FastMap::default(),
        vectors: Vectors::default(),
    };
    for (block, _) in func.blocks() {
        planner.block(block);
    }
    planner.vectors.written = vec![None; planner.vectors.nodes.len()];
    planner.vectors
}

/// Stores to neighbouring bytes, in the order of addresses, that may be a row.
pub(super) struct Window {
    pub(super) stores: Vec<Store>,
    pub(super) format: Format,
}

impl Window {
    /// The position of the last store, in whose place the row is written.
    pub(super) fn end(&self) -> u32 {
        self.stores.iter().map(|store| store.position).max().unwrap_or(0)
    }
}

/// Finds rows in the blocks of a function.
pub(super) struct Planner<'a> {
    pub(super) module: &'a Module,
    pub(super) func: &'a FuncData,
    /// For each instruction its place in the current block; that of an instruction in another block is
    /// `u32::MAX`. Empty as long as no block was examined closely.
    pub(super) positions: PrimaryMap<Inst, u32>,
    /// How often each value is used by what is not left out.
    pub(super) uses: SecondaryMap<Value, u32>,
    /// For each [place](memory) the positions of the block's accesses, and whether they are stores.
    pub(super) accesses: FastMap<i64, Vec<(u32, bool)>>,
    /// The block's accesses through an index: their positions, their bytes, and whether they are stores.
    pub(super) indexed: Vec<(u32, Range<i64>, bool)>,
    /// The positions of instructions that have other effects, or may see the effects of others.
    pub(super) effects: Vec<u32>,
    /// The rows of the block that are computed already, or will be for the row that is being entered.
    pub(super) known: FastMap<(Vec<Value>, Format), usize>,
    /// What was added to `known` for the row that is being entered.
    pub(super) added: Vec<(Vec<Value>, Format)>,
    /// The position at which that row is written.
    pub(super) end: u32,
    /// For the stores of rows where those are written, by the stores' positions.
    pub(super) delayed: FastMap<u32, u32>,
    pub(super) vectors: Vectors,
}

impl Planner<'_> {
    /// Enters the rows of a block.
    fn block(&mut self, block: Block) {
        let insts = &self.func.block(block).insts;
        let mut windows = self.windows(insts);
        if windows.is_empty() {
            return;
        }
        self.note(insts);
        // In the order in which they are written.
        windows.sort_by_key(Window::end);
        let first_node = self.vectors.nodes.len();
        let mut rows = vec![];
        for _ in 0..MAX_ROUNDS {
            self.vectors.nodes.truncate(first_node);
            self.known.clear();
            self.delayed.clear();
            for window in &windows {
                let positions = window.stores.iter().map(|store| store.position);
                self.delayed.extend(positions.map(|position| (position, window.end())));
            }
            let found: Vec<Option<StoredRow>> =
                windows.iter().map(|window| self.row_of_stores(window)).collect();
            let all_are_rows = found.iter().all(Option::is_some);
            let mut is_row = found.iter().map(Option::is_some);
            windows.retain(|_| is_row.next().unwrap_or(false));
            if all_are_rows {
                let last =
                    |window: &Window| window.stores.iter().max_by_key(|s| s.position).copied();
                let lasts = windows.iter().filter_map(last).map(|store| store.inst);
                rows = lasts.zip(found.into_iter().flatten()).collect();
                break;
            }
        }
        if rows.is_empty() {
            self.vectors.nodes.truncate(first_node);
        } else {
            let stores: Vec<Store> =
                windows.iter().flat_map(|window| window.stores.clone()).collect();
            let chains = self.chains(insts, &windows, &rows);
            let cost: usize = self.vectors.nodes[first_node..].iter().map(Node::cost).sum();
            let cost = cost + rows.iter().map(|(_, row)| row.cost()).sum::<usize>();
            let cost = cost + chains.iter().map(|(_, chain)| chain.cost()).sum::<usize>();
            let left_out = self.left_out(insts, &stores, &chains, first_node);
            let is_constant =
                |inst: &&Inst| matches!(self.func.inst(**inst), InstData::Iconst { .. });
            if cost + left_out.iter().filter(is_constant).count() < left_out.len() {
                self.vectors.left_out.resize(self.func.inst_count());
                for inst in left_out {
                    self.vectors.left_out[inst] = true;
                }
                self.vectors.rows.extend(rows);
                self.vectors.chains.extend(chains);
            } else {
                for inst in left_out {
                    self.func.inst(inst).for_each_arg(|arg| self.uses[arg] += 1);
                }
            }
        }
        for &inst in insts {
            self.positions[inst] = u32::MAX;
        }
    }

    /// The groups of stores of a block that may be rows.
    fn windows(&self, insts: &[Inst]) -> Vec<Window> {
        let mut stores = vec![];
        for (&inst, position) in insts.iter().zip(0..) {
            if let InstData::Store { at, value } = *self.func.inst(inst)
                && at.index.is_none()
                && !at.volatile
                && let ty = self.func.ty(value)
                && matches!(ty, Type::I1 | Type::I8 | Type::I16 | Type::I32)
                && let Some(offset) = self.offset(&at)
            {
                stores.push(Store { inst, position, at, offset, ty, value, shape: 0 });
            }
        }
        if stores.len() < MIN_STORES {
            return vec![];
        }
        stores.sort_by_key(|store| (store.offset, store.position));
        let mut windows = vec![];
        // Bytes that are stored more than once are none of a row.
        let mut runs: Vec<Vec<Store>> = vec![];
        for (index, store) in stores.iter().enumerate() {
            let overlaps = |other: Option<&Store>| {
                other.is_some_and(|other| {
                    other.offset < store.offset + i64::from(store.ty.bytes())
                        && store.offset < other.offset + i64::from(other.ty.bytes())
                })
            };
            if overlaps(stores.get(index + 1)) || overlaps(stores.get(index.wrapping_sub(1))) {
                continue;
            }
            match runs.last_mut() {
                Some(run)
                    if run.last().is_some_and(|last| {
                        last.ty == store.ty
                            && last.at.region == store.at.region
                            && last.offset + i64::from(last.ty.bytes()) == store.offset
                    }) =>
                {
                    run.push(*store);
                }
                _ => runs.push(vec![*store]),
            }
        }
        for mut run in runs {
            if run.len() < MIN_STORES {
                continue;
            }
            for store in &mut run {
                store.shape = self.shape(store.value, SHAPE_DEPTH);
            }
            let mut rest = run.as_slice();
            while let Some(first) = rest.first() {
                let same = rest.iter().take(16).take_while(|s| s.shape == first.shape).count();
                match self.formats(first).find(|format| format.lanes() <= same) {
                    Some(format) => {
                        let (window, following) = rest.split_at(format.lanes());
                        windows.push(Window { stores: window.to_vec(), format });
                        rest = following;
                    }
                    None => rest = &rest[1..],
                }
            }
        }
        windows
    }

    /// The formats of a row that begins with a store; better ones come first.
    fn formats(&self, store: &Store) -> impl Iterator<Item = Format> + use<> {
        let integer = match store.ty {
            Type::I1 => self.compared_type(store.value, MAX_DEPTH),
            ty => Some(ty),
        };
        let formats = match integer {
            Some(ty) if ty.bits() <= 32 => [Some(Format::Integers(ty)), None],
            Some(_) => [None, None],
            None => [Some(Format::Truths(16)), Some(Format::Truths(8))],
        };
        formats.into_iter().flatten()
    }

    /// The type of integers that are compared to compute a truth value; `None` if none are.
    fn compared_type(&self, value: Value, depth: u32) -> Option<Type> {
        let depth = depth.checked_sub(1)?;
        match *self.func.def_inst(value)? {
            InstData::Icmp { cond: _, args: [a, _] } if self.func.ty(a) != Type::I1 => {
                Some(self.func.ty(a))
            }
            InstData::Unary { op: _, arg } if self.func.ty(arg) == Type::I1 => {
                self.compared_type(arg, depth)
            }
            InstData::Binary { op: _, args: [a, b] } => {
                self.compared_type(a, depth).or_else(|| self.compared_type(b, depth))
            }
            InstData::Select { cond, args: [a, b] } => {
                [cond, a, b].into_iter().find_map(|value| self.compared_type(value, depth))
            }
            _ => None,
        }
    }

    /// A number that is equal for values that are computed by the same operations, to a depth. Operands of
    /// operations may be exchanged.
    pub(super) fn shape(&self, value: Value, depth: u32) -> u64 {
        let Some(data) = self.func.def_inst(value) else { return 1 };
        let Some(depth) = depth.checked_sub(1) else { return 2 };
        let mix = |kind: u64, args: &[Value]| {
            let sum = args.iter().fold(0u64, |sum, &arg| sum.wrapping_add(self.shape(arg, depth)));
            (sum ^ kind << 8 ^ args.len() as u64)
                .wrapping_mul(0x9E37_79B9_7F4A_7C15)
                .rotate_left(23)
        };
        match *data {
            InstData::Iconst { .. } => 3,
            InstData::Load { .. } => 4,
            InstData::Unary { op, arg } => mix(0x100 + op as u64, &[arg]),
            InstData::Binary { op, args } => mix(0x200 + op as u64, &args),
            InstData::Icmp { cond, args } => mix(0x300 + cond as u64, &args),
            InstData::Select { cond, args: [a, b] } => mix(0x400, &[cond, a, b]),
            InstData::Convert { op, to: _, arg } => mix(0x500 + op as u64, &[arg]),
            _ => 5,
        }
    }

    /// Enters the positions, accesses and effects of a block's instructions.
    fn note(&mut self, insts: &[Inst]) {
        if self.positions.is_empty() {
            self.positions = vec![u32::MAX; self.func.inst_count()].into();
            self.uses = self.func.use_counts();
        }
        self.accesses.clear();
        self.indexed.clear();
        self.effects.clear();
        self.known.clear();
        for (&inst, position) in insts.iter().zip(0..) {
            self.positions[inst] = position;
            let data = *self.func.inst(inst);
            let (at, ty, is_store) = match data {
                InstData::Load { ty, at } => (at, ty, false),
                InstData::Store { at, value } => (at, self.func.ty(value), true),
                _ => {
                    if data.has_effect()
                        || matches!(data, InstData::HostCall { .. } | InstData::Pack { .. })
                    {
                        self.effects.push(position);
                    }
                    continue;
                }
            };
            match self.bytes(&at, ty) {
                Some(bytes) if !at.volatile => match at.index {
                    Some(_) => self.indexed.push((position, bytes, is_store)),
                    None => {
                        for byte in bytes {
                            self.accesses.entry(byte).or_default().push((position, is_store));
                        }
                    }
                },
                _ => self.effects.push(position),
            }
        }
    }

    /// The [place](memory) of an address.
    fn offset(&self, at: &Address) -> Option<i64> {
        memory::place(self.module, *at)
    }

    /// The places that an access may touch.
    pub(super) fn bytes(&self, at: &Address, ty: Type) -> Option<Range<i64>> {
        let start = memory::place(self.module, *at)?;
        let extent = at.extent(ty);
        Some(start..start.checked_add_unsigned(extent.end - extent.start)?)
    }

    /// Enters a row of stores, if it is one.
    fn row_of_stores(&mut self, Window { stores: window, format }: &Window) -> Option<StoredRow> {
        let format = *format;
        let positions = || window.iter().map(|store| store.position);
        let (start, end) = (positions().min()?, positions().max()?);
        if end - start > MAX_DISTANCE || self.has_effect_between(start, end) {
            return None;
        }
        for store in window {
            for byte in self.bytes(&store.at, store.ty)? {
                let mut accesses = self.accesses.get(&byte).into_iter().flatten();
                if accesses.any(|&(position, _)| store.position < position && position <= end) {
                    return None;
                }
            }
            let bytes = self.bytes(&store.at, store.ty)?;
            if self.indexed_between(store.position, end, &bytes, false) {
                return None;
            }
        }
        self.end = end;
        let (count, first) = (self.vectors.nodes.len(), window.first()?);
        let lanes: Vec<Value> = window.iter().map(|store| store.value).collect();
        self.added.clear();
        let node = self.row(&lanes, format, MAX_DEPTH);
        if node.is_none() {
            // What was entered for it is not written before another row.
            self.vectors.nodes.truncate(count);
            for key in self.added.drain(..) {
                self.known.remove(&key);
            }
        }
        Some(StoredRow { at: first.at, ty: first.ty, format, node: node? })
    }

    /// Whether something between two positions has an effect that is not a store.
    pub(super) fn has_effect_between(&self, start: u32, end: u32) -> bool {
        self.effects.iter().any(|position| (start..end).contains(position))
    }

    /// Whether an access through an index that lies between two positions may touch some bytes; perhaps
    /// only stores count.
    pub(super) fn indexed_between(
        &self,
        start: u32,
        end: u32,
        bytes: &Range<i64>,
        stores: bool,
    ) -> bool {
        self.indexed.iter().any(|(position, touched, is_store)| {
            start < *position
                && *position <= end
                && touched.start < bytes.end
                && bytes.start < touched.end
                && (*is_store || !stores)
        })
    }

    /// The instructions of a block that nothing needs if some stores are done by rows: these stores, and what
    /// is computed only for what is left out. They are no longer counted as uses of their operands.
    fn left_out(
        &mut self,
        insts: &[Inst],
        stores: &[Store],
        chains: &[(Inst, Chain)],
        first_node: usize,
    ) -> Vec<Inst> {
        // Values that rows take from scalars are needed.
        for node in &self.vectors.nodes[first_node..] {
            if let Node::Splat(value, _) = node {
                self.uses[*value] += 1;
            }
        }
        for (_, chain) in chains {
            self.uses[chain.otherwise] += 1;
        }
        let written_otherwise: FastSet<Inst> =
            stores.iter().map(|store| store.inst).chain(chains.iter().map(|c| c.0)).collect();
        let mut left_out = vec![];
        for &inst in insts.iter().rev() {
            let data = self.func.inst(inst);
            let is_unused = self.func.result(inst).is_some_and(|value| self.uses[value] == 0)
                && !data.has_effect()
                && !matches!(data, InstData::HostCall { .. });
            if is_unused || written_otherwise.contains(&inst) {
                data.for_each_arg(|arg| self.uses[arg] -= 1);
                left_out.push(inst);
            }
        }
        left_out
    }
}
