//! The return from an interruption: the block that was put aside goes on (NCT 2.2.1, I511; cnc-side 3.15).

use super::block::Executed;
use super::state::{Return, State};
use super::{Nct, Step};
use crate::event::Told;

impl State {
    /// Keeps a dropped block of the part program.
    pub(super) fn put_aside(&mut self, dropped: Option<Executed>) {
        self.returns = Return::No;
        self.aside =
            dropped.map(|executed| Executed { dropped: None, stop_since: None, ..executed });
    }
}

impl Nct {
    /// I547 goes where START is let go; after the first START of a return it makes room for the message 3549.
    pub(super) fn release(&self, state: &mut State, step: &Step<'_, '_>) {
        if !step.y(47, 0) {
            if state.blocks_held && state.returns == Return::Asked {
                state.returns = Return::Message;
            }
            state.blocks_held = false;
        } else if state.interrupted
            && step.is_automatic()
            && step.runs()
            && state.block.is_none()
            && !state.blocks_held
            && state.returns == Return::No
        {
            (state.blocks_held, state.returns) = (true, Return::Asked);
        }
    }

    /// Lets the block go on that was put aside, when the operator has asked for it and answered. Returns whether it does.
    pub(super) fn go_back(&self, state: &mut State, step: &mut Step<'_, '_>) -> bool {
        match state.returns {
            Return::No | Return::Asked | Return::Message => false,
            Return::Answered => {
                state.returns = Return::No;
                state.interrupted = false;
                let Some(aside) = state.aside.take() else { return false };
                self.begin_again(state, step, aside);
                state.block.is_some()
            }
        }
    }

    fn begin_again(&self, state: &mut State, step: &mut Step<'_, '_>, mut executed: Executed) {
        // Y443: with strobes and all parts; else the rest of its parts.
        let from_start = step.y(44, 3);
        let Some(block) = executed.block(&self.setup) else { return };
        step.now.tell(Told::Block(block.line));
        state.waits = Default::default();
        if from_start {
            super::block::strobe(state, step, block);
            executed.parts.restart();
            executed.parts_done = executed.parts.is_empty();
        }
        (executed.began, executed.fin_was_off) = (step.now.tick, false);
        let parts_done = executed.parts_done;
        state.block = Some(executed);
        if parts_done {
            (state.stopped, state.interpolation_done) = (true, true);
        } else {
            state.begin_part(&self.setup);
        }
    }
}
