//! Which of the ways that come to a block are followed apart.
//!
//! Passes lead control past a test where they know how it ends, so that the ways do not come together there. As long as a way decides the
//! next test, it is followed apart here, too: so what follows is the same logic in both versions, and what happens there, as calls of the
//! host, has the same operands.

use plcc_ir::{Block, Inst, InstData, Terminator};

use super::join::joined;
use super::walk::{Context, Place, Version};
use crate::logic::FALSE;
use crate::scan::instruction::State;

/// How many blocks are looked through for the next test, and how many ways are followed apart where values are only moved.
const MOST: usize = 8;

impl Version<'_, '_> {
    /// The ways that come to a block, joined but for those that decide the next test.
    pub(super) fn apart(
        &self,
        context: &mut Context<'_>,
        block: Block,
        places: Vec<Place>,
    ) -> Vec<Place> {
        if places.len() <= MOST && self.only_moves(block) {
            return places;
        }
        let row = if places.len() > 1 { self.row_to_test(block) } else { vec![] };
        let decides = |place: &Place| self.decides(context, &row, place.clone());
        let (mut apart, open): (Vec<Place>, Vec<Place>) = places.into_iter().partition(decides);
        apart.extend(joined(&mut context.builder.graph, open));
        apart
    }

    /// The blocks from one on to the next test; none where something happens before it in the order of the program.
    fn row_to_test(&self, mut block: Block) -> Vec<Block> {
        let mut row = vec![];
        while row.len() < MOST {
            let data = self.data.block(block);
            if data.insts.iter().any(|&inst| self.is_event(inst)) {
                break;
            }
            row.push(block);
            match &data.terminator {
                Some(Terminator::Brif { .. }) => return row,
                Some(Terminator::Jump(call)) if !self.is_cut(call.block) => block = call.block,
                _ => break,
            }
        }
        vec![]
    }

    /// Whether a way that comes to the first block of a row decides the test at its end.
    fn decides(&self, context: &mut Context<'_>, row: &[Block], place: Place) -> bool {
        let Place { mut arrival, mut history, mut local } = place;
        for &block in row {
            let Some(mut state) = State::of_function(self.code, self.func, arrival) else {
                return false;
            };
            let rest = (&mut history, &mut local, &mut vec![]);
            if self.execute(context, block, &mut state, rest).is_err() {
                return false;
            }
            match &self.data.block(block).terminator {
                Some(Terminator::Brif { cond, .. }) => {
                    let test = state.bits(*cond).first().copied().unwrap_or(FALSE);
                    let (graph, cond) = (&mut context.builder.graph, state.arrival.cond);
                    return [test, !test].into_iter().any(|it| graph.and(cond, it) == FALSE);
                }
                Some(Terminator::Jump(call)) => {
                    let params = &self.data.block(call.block).params;
                    let given = params.iter().zip(&call.args);
                    let given: Vec<_> =
                        given.map(|(param, &arg)| (param.0, state.bits(arg))).collect();
                    arrival = state.arrival;
                    arrival.values.extend(given);
                }
                _ => return false,
            }
        }
        false
    }

    /// Whether a block only moves values and leads to another one.
    fn only_moves(&self, block: Block) -> bool {
        let data = self.data.block(block);
        let is_move = |&inst: &Inst| match *self.data.inst(inst) {
            InstData::Iconst { .. } | InstData::Fconst { .. } => true,
            InstData::Load { at, .. } | InstData::Store { at, .. } => {
                at.index.is_none() && !at.volatile
            }
            _ => false,
        };
        matches!(data.terminator, Some(Terminator::Jump(_))) && data.insts.iter().all(is_move)
    }

    /// Whether an instruction happens in the order of the program.
    fn is_event(&self, inst: Inst) -> bool {
        match *self.data.inst(inst) {
            InstData::HostCall { function, .. } => !function.is_pure(),
            InstData::IsLate => true,
            InstData::Load { at, .. } | InstData::Store { at, .. } => at.volatile,
            _ => false,
        }
    }
}
