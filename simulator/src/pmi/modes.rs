//! Modes, the operator's options, feed hold and cycle start (cnc-side 2.6, 2.8, 2.9).

use super::state::State;
use super::{Pmi, Seen};
use crate::context::Context;
use crate::event::{Refusal, Requested, Told};

impl Pmi {
    /// @MODRQ is a level, since programs leave it standing.
    pub(super) fn mode(&self, state: &mut State, seen: &Seen) {
        if !state.is_on() {
            state.mode = 0;
            return;
        }
        match seen.mode_request {
            0 if !state.block.is_executed() => state.enter_manual(),
            mode @ (1 | 2) => state.mode = mode,
            // While a block is executed it waits for its end.
            _ => {}
        }
    }

    pub(super) fn options(&self, state: &mut State, seen: &Seen) {
        if !self.setup.table.option_keys_toggle.unwrap_or(false) {
            state.block_delete = seen.block_delete;
            state.optional_stop = seen.optional_stop;
            return;
        }
        // The text of PMI 3.4: a falling edge.
        state.block_delete ^= state.before.block_delete && !seen.block_delete;
        state.optional_stop ^= state.before.optional_stop && !seen.optional_stop;
    }

    pub(super) fn hold_and_start(&self, state: &mut State, seen: &Seen, now: &mut Context<'_>) {
        let is_automatic = matches!(state.mode, 1 | 2);
        if seen.feed_hold_request && is_automatic && state.started && !state.hold {
            state.hold = true;
        }
        if !seen.cycle_request || state.before.cycle_request {
            return;
        }
        let refusal = if !state.is_on() {
            Refusal::EStop
        } else if !is_automatic {
            Refusal::Manual
        } else if seen.feed_hold_request {
            Refusal::FeedHoldRequest
        } else if state.hold {
            state.hold = false;
            return;
        } else if state.started {
            Refusal::Running
        } else if self.setup.program.is_none() {
            Refusal::NoProgram
        } else {
            state.started = true;
            state.program_end = 0;
            return;
        };
        now.tell(Told::Refused(Requested::CycleStart, refusal));
    }
}

impl State {
    /// Manual mode: a hold ends with it, and so does a started program that waits between two blocks.
    pub(super) fn enter_manual(&mut self) {
        self.mode = 0;
        self.hold = false;
        self.started = false;
    }
}
