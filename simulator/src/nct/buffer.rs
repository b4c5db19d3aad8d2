//! The buffer: whether a block is ready (NCT 1.4, I546; cnc-side 3.5).

use super::state::State;
use super::{Nct, Step};

impl Nct {
    pub(super) fn buffer(&self, state: &mut State, step: &Step<'_, '_>) {
        // After M2 or M30 the program stands at its first block when START has been let go.
        if state.ended.is_some_and(|ended| ended != step.now.tick) && !step.y(47, 0) {
            (state.ended, state.next) = (None, 0);
        }
        if state.block.is_some() {
            return;
        }
        state.buffer_full = if step.is_automatic() {
            state.interrupted || self.setup.program.is_some() && state.ended.is_none()
        } else {
            state.entered.is_some()
        };
    }
}
