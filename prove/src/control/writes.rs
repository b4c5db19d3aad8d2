//! Which bytes of the process image the code of a program writes, and whether it only clears them.

use std::ops::Range;

use plcc_ir::{BinaryOp, InstData, Module, RegionId};

/// A store.
struct Write {
    bytes: Range<u32>,
    /// Whether it makes no bit 1 that was 0.
    only_clears: bool,
}

/// The stores of a program.
pub(super) struct Writes {
    all: Vec<Write>,
}

impl Writes {
    pub(super) fn of(module: &Module) -> Self {
        let mut all = vec![];
        for (_, func) in module.funcs() {
            for (_, block) in func.blocks() {
                for &inst in &block.insts {
                    let InstData::Store { at, value } = func.inst(inst) else { continue };
                    if at.region == RegionId::LOCAL_BITS {
                        continue;
                    }
                    let base = module.region(at.region).map_or(0, |region| region.offset);
                    let extent = at.extent(func.ty(*value));
                    let bytes = base + extent.start as u32..base + extent.end as u32;
                    // A reset-only variable is assigned what it was and the value.
                    let keeps = |value: &plcc_ir::Value| matches!(func.def_inst(*value), Some(InstData::Load { at: from, .. }) if from == at);
                    let only_clears = match func.def_inst(*value) {
                        Some(InstData::Iconst { value: 0, .. }) => true,
                        Some(InstData::Binary { op: BinaryOp::And, args }) => {
                            args.iter().any(keeps)
                        }
                        _ => false,
                    };
                    all.push(Write { bytes, only_clears });
                }
            }
        }
        Self { all }
    }

    fn of_range(&self, range: Range<u32>) -> impl Iterator<Item = &Write> {
        self.all.iter().filter(move |it| it.bytes.start < range.end && range.start < it.bytes.end)
    }

    /// Whether anything is written there.
    pub(super) fn any(&self, range: Range<u32>) -> bool {
        self.of_range(range).next().is_some()
    }

    /// Whether whatever is written there clears it, or nothing is written.
    pub(super) fn only_clear(&self, range: Range<u32>) -> bool {
        self.of_range(range).all(|write| write.only_clears)
    }

    /// The bytes that are written, each once.
    pub(super) fn bytes(&self) -> Vec<u32> {
        let mut bytes: Vec<u32> = self.all.iter().flat_map(|it| it.bytes.clone()).collect();
        bytes.sort_unstable();
        bytes.dedup();
        bytes
    }
}
