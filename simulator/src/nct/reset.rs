//! What drops a block: I540 falls, RESET, automatic mode is left (cnc-side 3.13).

use super::state::{Return, State};
use super::{Nct, Step};

impl Nct {
    /// The first that fits of I540 falling, RESET, leaving AUTO.
    pub(super) fn drops(&self, state: &mut State, step: &mut Step<'_, '_>, falls: bool) {
        let request = step.y(47, 7) && step.y(53, 7);
        let resets =
            step.reset_key && !state.before.reset_key || request && !state.before.reset_request;
        if falls {
            self.drop_block(state, step, false);
        } else if resets {
            state.modal = Default::default();
            if state.block.is_some() {
                // The question 3549 may be there beside an entered block; the next START asks it anew.
                if state.returns == Return::Message {
                    state.returns = Return::No;
                }
                self.drop_block(state, step, false);
            } else {
                (state.blocks_held, state.interrupted) = (false, false);
                (state.ignores_stop, state.is_feed, state.is_thread) = (false, false, false);
                (state.entered, state.next, state.ended) = (None, 0, None);
                (state.aside, state.returns) = (None, Default::default());
            }
        } else if !step.is_automatic()
            && state.block.as_ref().is_some_and(|block| !block.is_entered())
        {
            self.drop_block(state, step, true);
        }
    }

    /// Drops the block: nothing moves from this step on. It is over when the axes have stopped.
    fn drop_block(&self, state: &mut State, step: &mut Step<'_, '_>, left_automatic: bool) {
        let tick = step.now.tick;
        let Some(block) = &mut state.block else { return };
        state.blocks_held = false;
        block.dropped.get_or_insert((tick, left_automatic));
        state.waits = Default::default();
    }

    /// Ends a dropped block, if the time for it has come.
    pub(super) fn end_drop(&self, state: &mut State, step: &Step<'_, '_>) {
        let Some(block) = &state.block else { return };
        let Some((since, left_automatic)) = block.dropped else { return };
        let has_stopped = step.now.tick.saturating_sub(since) >= self.stop_ticks;
        if !(has_stopped || state.stopped || !state.machine_on) {
            return;
        }
        let is_entered = block.is_entered();
        let dropped = state.block.take();
        state.stopped = true;
        state.interpolation_done |= !left_automatic;
        (state.ignores_stop, state.is_feed, state.is_thread) = (false, false, false);
        (state.home_block, state.buffer_full) = (false, false);
        (state.moves, state.moves_rapidly) = (0, 0);
        if is_entered {
            state.entered = None;
        } else {
            state.interrupted = true;
            state.put_aside(dropped);
        }
    }
}
