//! How calls of subroutines are recognised in IR: by stores of labels to the stack of return labels, or
//! to the place of a pending label ([`ReturnStack`](plcc_frontend::common::ReturnStack)).

use std::collections::HashMap;

use plcc_ir::{Address, Block, Func, InstData, Label, PrimaryMap};

use super::{Analysis, Edges, Node};

impl Analysis<'_> {
    /// The nodes to which calls return, of all calls.
    pub(super) fn behind_calls(&mut self) -> Vec<usize> {
        let module = self.module;
        let mut labels: Vec<u32> = vec![];
        for (_, func) in module.funcs() {
            for (_, block) in func.blocks() {
                let stores = block.insts.iter().filter_map(|&inst| match func.inst(inst) {
                    InstData::Store { at, value }
                        if self.is_push(at) || self.is_pending_label(at) =>
                    {
                        func.constant(*value)
                    }
                    _ => None,
                });
                labels.extend(stores.map(|label| label as u32));
            }
        }
        labels.sort_unstable();
        labels.dedup();
        labels.into_iter().filter_map(|label| self.start(Label(label))).collect()
    }

    /// Whether a store to this address pushes a return label.
    fn is_push(&self, at: &Address) -> bool {
        self.returns.is_some_and(|stack| {
            // A pass that has found out how many calls are open has made a fixed address of the indexed
            // one, which may then be that of any element.
            let end = stack.offset.saturating_add(stack.depth.saturating_mul(4));
            at.region == stack.region && (stack.offset..end).contains(&at.offset)
        })
    }

    /// Whether an access to this address is one of the pending label.
    fn is_pending_label(&self, at: &Address) -> bool {
        let pending = self.returns.and_then(|stack| stack.pending);
        pending == Some((at.region, at.offset)) && at.index.is_none()
    }

    /// Finds out from which blocks on code may push a label that was stored as pending before them.
    pub(super) fn find_pending(&mut self) {
        let module = self.module;
        let mut wants: PrimaryMap<Func, PrimaryMap<Block, bool>> =
            module.funcs().map(|(_, func)| vec![false; func.block_count()].into()).collect();
        let mut before: HashMap<(Func, Block), Vec<(Func, Block)>> = HashMap::new();
        let mut work = vec![];
        for (id, func) in module.funcs() {
            for (block, data) in func.blocks() {
                let first = data.insts.iter().find_map(|&inst| match func.inst(inst) {
                    InstData::Load { at, .. } if self.is_pending_label(at) => Some(true),
                    InstData::Store { at, .. } if self.is_pending_label(at) => Some(false),
                    _ => None,
                });
                if first == Some(true) {
                    wants[id][block] = true;
                    work.push((id, block));
                }
                // Code that stores another pending label does not need the one before.
                if first != Some(false) {
                    for next in self.successors(id, block) {
                        before.entry(next).or_default().push((id, block));
                    }
                }
            }
        }
        while let Some(place) = work.pop() {
            for &(func, block) in before.get(&place).map_or(&[][..], Vec::as_slice) {
                if !std::mem::replace(&mut wants[func][block], true) {
                    work.push((func, block));
                }
            }
        }
        self.wants_pending = wants;
    }

    /// What a node leads to, as far as that can be seen in its block.
    pub(super) fn edges_of(&self, (func, block, mut pending): Node) -> Edges {
        let Some(data) = self.module.funcs.get(func.index()) else { return Edges::default() };
        let mut labels = vec![];
        for &inst in &data.block(block).insts {
            let InstData::Store { at, value } = data.inst(inst) else { continue };
            let label = data.constant(*value).map(|label| label as u32);
            if self.is_pending_label(at) {
                pending = label;
            } else if self.is_push(at) {
                labels = label.or(pending).into_iter().collect();
            }
        }
        let next = self.successors(func, block).into_iter();
        let wants = |(func, block): (Func, Block)| {
            self.wants_pending.get(func).is_some_and(|func| func[block])
        };
        let node = |place: (Func, Block)| (place.0, place.1, pending.filter(|_| wants(place)));
        let target = |label: u32| self.targets.get(Label(label)).copied().flatten();
        Edges {
            successors: next.map(node).collect(),
            returns_to: labels.into_iter().filter_map(target).map(|(f, b)| (f, b, None)).collect(),
        }
    }
}
