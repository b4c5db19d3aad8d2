//! Where a function is cut, and which bytes nothing reads any more.

use plcc_ir::{Block, Func, FuncData, InstData, Label, Module, RegionId, Terminator, Value};
use rustc_hash::FxHashMap;

use super::universe::bytes;

/// The block to which control comes from another one without anything being done: the end of a row of empty blocks.
pub(super) fn end_of_row(func: &FuncData, mut block: Block) -> Block {
    for _ in 0..func.block_count() {
        let data = func.block(block);
        match &data.terminator {
            Some(Terminator::Jump(call)) if data.insts.is_empty() && call.args.is_empty() => {
                block = call.block;
            }
            _ => break,
        }
    }
    block
}

/// The label that stands for each label of a function: the first one of those that are at the same block.
pub(super) fn representatives(func: &FuncData) -> FxHashMap<Label, Label> {
    let mut first: FxHashMap<Block, Label> = FxHashMap::default();
    let mut all = FxHashMap::default();
    for &(label, block) in func.entries() {
        let first = *first.entry(end_of_row(func, block)).or_insert(label);
        all.insert(label, first);
    }
    all
}

/// A set of bits.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Bits(Vec<u64>);

impl Bits {
    fn new(len: usize, all: bool) -> Self {
        Self(vec![if all { u64::MAX } else { 0 }; len.div_ceil(64)])
    }

    fn get(&self, at: usize) -> bool {
        self.0.get(at / 64).is_some_and(|word| word >> (at % 64) & 1 == 1)
    }

    fn set(&mut self, at: usize, value: bool) {
        if let Some(word) = self.0.get_mut(at / 64) {
            let bit = 1 << (at % 64);
            *word = if value { *word | bit } else { *word & !bit };
        }
    }

    fn fill(&mut self, all: bool) {
        self.0.fill(if all { u64::MAX } else { 0 });
    }

    fn and(&mut self, other: &Self) {
        for (word, other) in self.0.iter_mut().zip(&other.0) {
            *word &= other;
        }
    }
}

/// For each label of a module the bytes of the image that are surely overwritten before anything can read them.
#[derive(Debug)]
pub(super) struct Dead {
    /// The bytes that are stored at fixed addresses, with their numbers.
    numbers: FxHashMap<usize, usize>,
    labels: FxHashMap<Label, Bits>,
}

impl Dead {
    /// Those of a module as the front end made it.
    pub(super) fn of(module: &Module) -> Self {
        let mut numbers = FxHashMap::default();
        for (_, func) in module.funcs() {
            for (_, data) in func.blocks() {
                for &inst in &data.insts {
                    if let Some(range) = fixed_store(module, func, func.inst(inst)) {
                        for byte in range {
                            let next = numbers.len();
                            numbers.entry(byte).or_insert(next);
                        }
                    }
                }
            }
        }
        let mut search = Search::new(module, &numbers);
        while search.round() {}
        let labels = search.labels;
        Self { numbers, labels }
    }

    /// Whether a byte is dead where control comes to a label.
    pub(super) fn contains(&self, label: Label, byte: usize) -> bool {
        let number = self.numbers.get(&byte);
        number.is_some_and(|&number| self.labels.get(&label).is_some_and(|it| it.get(number)))
    }
}

/// The bytes that a store at a fixed address writes.
fn fixed_store(
    module: &Module,
    func: &FuncData,
    inst: &InstData,
) -> Option<std::ops::Range<usize>> {
    match inst {
        InstData::Store { at, value }
            if !at.volatile && at.index.is_none() && at.region != RegionId::LOCAL_BITS =>
        {
            Some(bytes(module, at, func.ty(*value)))
        }
        _ => None,
    }
}

/// The search for dead bytes: at first all are, and no value is needed.
struct Search<'m> {
    module: &'m Module,
    numbers: &'m FxHashMap<usize, usize>,
    labels: FxHashMap<Label, Bits>,
    blocks: Vec<Vec<Bits>>,
    needed: Vec<Vec<bool>>,
    changed: bool,
}

impl<'m> Search<'m> {
    fn new(module: &'m Module, numbers: &'m FxHashMap<usize, usize>) -> Self {
        let all = Bits::new(numbers.len(), true);
        let labels = (0..module.label_count).map(|label| (Label(label), all.clone())).collect();
        let blocks =
            module.funcs.iter().map(|func| vec![all.clone(); func.block_count()]).collect();
        let needed = module.funcs.iter().map(|func| vec![false; func.value_count()]).collect();
        Self { module, numbers, labels, blocks, needed, changed: false }
    }

    /// Looks at all blocks once; says whether something was found.
    fn round(&mut self) -> bool {
        self.changed = false;
        for (func, data) in self.module.funcs() {
            let blocks: Vec<Block> = data.blocks().map(|(block, _)| block).collect();
            for &block in blocks.iter().rev() {
                let dead = self.block(func, data, block);
                let slot =
                    self.blocks.get_mut(func.index()).and_then(|it| it.get_mut(block.index()));
                if let Some(slot) = slot.filter(|slot| **slot != dead) {
                    *slot = dead;
                    self.changed = true;
                }
            }
            for &(label, block) in data.entries() {
                let dead = self.blocks.get(func.index()).and_then(|it| it.get(block.index()));
                if let (Some(dead), Some(slot)) = (dead, self.labels.get_mut(&label)) {
                    slot.clone_from(dead);
                }
            }
        }
        self.changed
    }

    fn need(&mut self, func: Func, value: Value) {
        let slot = self.needed.get_mut(func.index()).and_then(|it| it.get_mut(value.index()));
        if let Some(slot) = slot.filter(|slot| !**slot) {
            *slot = true;
            self.changed = true;
        }
    }

    /// The bytes that are dead at the beginning of a block.
    fn block(&mut self, func: Func, data: &FuncData, block: Block) -> Bits {
        let none = Bits::new(self.numbers.len(), false);
        let Some(terminator) = &data.block(block).terminator else { return none };
        let mut dead = match terminator {
            Terminator::Goto(label) => self.labels.get(label).cloned().unwrap_or(none),
            Terminator::Jump(_) | Terminator::Brif { .. } | Terminator::Switch { .. } => {
                let mut dead = Bits::new(self.numbers.len(), true);
                let own = self.blocks.get(func.index());
                terminator.for_each_block(|to, _| {
                    if let Some(other) = own.and_then(|own| own.get(to.index())) {
                        dead.and(other);
                    }
                });
                dead
            }
            Terminator::GotoIndirect(_)
            | Terminator::Suspend(_)
            | Terminator::Return
            | Terminator::Trap(_)
            | Terminator::TrapAt { .. } => none,
        };
        let mut uses = vec![];
        terminator.for_each_arg(|value| uses.push(value));
        uses.into_iter().for_each(|value| self.need(func, value));
        for &inst in data.block(block).insts.iter().rev() {
            let own = data.inst(inst);
            if let Some(range) = fixed_store(self.module, data, own) {
                let numbers = range.filter_map(|byte| self.numbers.get(&byte).copied());
                let numbers: Vec<usize> = numbers.collect();
                if numbers.iter().all(|&number| dead.get(number)) {
                    continue;
                }
                numbers.iter().for_each(|&number| dead.set(number, true));
            } else {
                let is_needed = data.result(inst).is_some_and(|value| {
                    let own = self.needed.get(func.index());
                    own.and_then(|it| it.get(value.index())) == Some(&true)
                });
                if !is_needed && !own.has_effect() {
                    continue;
                }
                match own {
                    InstData::Load { ty, at } if !at.volatile => {
                        for byte in bytes(self.module, at, *ty) {
                            if let Some(&number) = self.numbers.get(&byte) {
                                dead.set(number, false);
                            }
                        }
                    }
                    InstData::Store { at, .. } if !at.volatile => {}
                    _ if own.has_effect() => dead.fill(false),
                    _ => {}
                }
            }
            let mut uses = vec![];
            own.for_each_arg(|value| uses.push(value));
            uses.into_iter().for_each(|value| self.need(func, value));
        }
        dead
    }
}
