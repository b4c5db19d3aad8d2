//! Finds rows of selects that choose a number by the last truth value of a row that is 1 ([`Chain`]).

use plcc_ir::passes::thresholds::vectors::MIN_CHAIN;
use plcc_ir::tables::{FastMap, FastSet};
use plcc_ir::{Inst, InstData, Type, Value};

use super::plan::{Planner, Window};
use super::row::{Chain, Format, StoredRow};

const MAX_CHAIN: usize = 32;

impl Planner<'_> {
    /// The rows of selects that choose a constant by the last truth value of a row that is 1, each with
    /// the last of these instructions.
    pub(super) fn chains(
        &self,
        insts: &[Inst],
        windows: &[Window],
        rows: &[(Inst, StoredRow)],
    ) -> Vec<(Inst, Chain)> {
        // Each row of truth values by its first lane.
        let mut by_first: FastMap<Value, (&Window, usize)> = FastMap::default();
        for (window, (_, row)) in windows.iter().zip(rows) {
            if let (Format::Truths(_), Some(first)) = (window.format, window.stores.first()) {
                by_first.insert(first.value, (window, row.node));
            }
        }
        let (mut chains, mut taken) = (vec![], FastSet::default());
        for &inst in insts.iter().rev() {
            if !taken.contains(&inst)
                && let Some((chain, selects)) = self.chain(inst, &by_first)
            {
                taken.extend(selects);
                chains.push((inst, chain));
            }
        }
        chains
    }

    /// The chain of selects that ends with an instruction, and these selects.
    fn chain(
        &self,
        end: Inst,
        by_first: &FastMap<Value, (&Window, usize)>,
    ) -> Option<(Chain, Vec<Inst>)> {
        let (mut selects, mut next) = (vec![], end);
        let otherwise = loop {
            let InstData::Select { cond, args: [chosen, other] } = *self.func.inst(next) else {
                return None;
            };
            let chosen = self.func.constant(chosen)?;
            selects.push((next, cond, chosen));
            let before = self.func.definition(other).filter(|before| {
                let is_here = self.positions[*before] != u32::MAX;
                let is_select = matches!(self.func.inst(*before), InstData::Select { args: [a, _], .. }
                    if self.func.constant(*a).is_some());
                is_here && is_select && self.uses[other] == 1
            });
            match before {
                Some(before) if selects.len() < MAX_CHAIN => next = before,
                _ => break other,
            }
        };
        selects.reverse();
        let ty = self.func.ty(otherwise);
        let &[(_, _, start), (_, _, second), ..] = selects.as_slice() else { return None };
        let step = second.wrapping_sub(start);
        let is_regular = selects.windows(2).all(|pair| pair[1].2.wrapping_sub(pair[0].2) == step);
        if selects.len() < MIN_CHAIN
            || !is_regular
            || !matches!(ty, Type::I8 | Type::I16 | Type::I32)
        {
            return None;
        }
        let end = self.positions[end];
        let (mut rows, mut rest) = (vec![], selects.as_slice());
        while let Some((_, cond, _)) = rest.first() {
            let (window, node) = by_first.get(cond)?;
            let lanes = window.stores.iter().map(|store| store.value);
            let (these, following) = rest.split_at_checked(window.stores.len())?;
            if window.end() > end || !lanes.eq(these.iter().map(|select| select.1)) {
                return None;
            }
            rows.push((*node, window.stores.len()));
            rest = following;
        }
        let selects = selects.iter().map(|select| select.0).collect();
        Some((Chain { rows, start, step, otherwise, ty }, selects))
    }
}
