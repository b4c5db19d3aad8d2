//! Chopping, as far as its flags tell of it (NCT 2.1, I675; cnc-side 3.24).

use super::state::State;
use super::{Nct, Step};

impl Nct {
    pub(super) fn chopping(&self, state: &mut State, step: &Step<'_, '_>) {
        let (asked, before) = (step.y(67, 5), state.before.chops);
        let tick = step.now.tick;
        if asked != before {
            // It begins to chop, or goes to point R.
            *(if asked { &mut state.stands_at_r } else { &mut state.is_chopping }) = false;
            state.chops_since = Some(tick);
        }
        let is_over = |since: u64| tick.saturating_sub(since) >= self.chop_ticks;
        if state.chops_since.is_some_and(is_over) {
            *(if asked { &mut state.is_chopping } else { &mut state.stands_at_r }) = true;
            state.chops_since = None;
        }
    }
}
