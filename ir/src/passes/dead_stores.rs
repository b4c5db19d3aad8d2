//! Drops stores whose bytes are all written again in the same block before anything could look
//! at them: a load, a call of the host, a volatile access, or the block's end, behind which the
//! program may be stopped, suspended or gone elsewhere.

use super::places::Places;
use crate::{FuncData, InstData};

/// A load through an index that may touch more bytes than this counts as one that touches all.
const LOOKED_THROUGH: usize = 64;

/// Runs the pass.
pub(super) fn run(func: &mut FuncData, places: &mut Places) {
    for index in 0..func.blocks.len() {
        let mut insts = std::mem::take(&mut func.blocks[index].insts);
        // A byte with this note is written again before anything looks at it.
        let mut again = places.fresh(1);
        let mut kept = insts.len();
        for at in (0..insts.len()).rev() {
            let inst = insts[at];
            let mut dead = false;
            match func.inst(inst) {
                InstData::Store { at, value } if !at.volatile && at.index.is_none() => {
                    let bytes = places.bytes(at, func.ty(*value));
                    let notes = places.notes_mut(bytes);
                    dead = !notes.is_empty() && notes.iter().all(|&note| note == again);
                    notes.fill(again);
                }
                // Which bytes it writes is not known, and it looks at none.
                InstData::Store { at, value: _ } if !at.volatile => {}
                InstData::Load { ty, at } if !at.volatile => {
                    let bytes = places.bytes(at, *ty);
                    if bytes.len() > LOOKED_THROUGH {
                        again = places.fresh(1);
                    } else {
                        places.notes_mut(bytes).fill(0);
                    }
                }
                data if data.has_effect() => again = places.fresh(1),
                _ => {}
            }
            if !dead {
                kept -= 1;
                insts[kept] = inst;
            }
        }
        insts.drain(..kept);
        func.blocks[index].insts = insts;
    }
}
