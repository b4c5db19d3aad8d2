//! The way of a block: stops, permissions, speeds (cnc-side 3.10).

use super::parts::Kind;
use super::state::{AXES, State};
use super::{Nct, Step};
use crate::event::Awaited;

impl State {
    /// I61n for each axis with way, I62n with it in rapid traverse.
    pub(super) fn request_axes(&mut self) {
        let is_way = self.block.as_ref().is_some_and(|block| block.parts.is_way());
        let with_way = |axis: &usize| is_way && self.way.moves(*axis);
        self.moves = (0..AXES).filter(with_way).fold(0, |set, axis| set | 1 << axis);
        self.moves_rapidly = if self.way.rapid { self.moves } else { 0 };
    }

    /// A stop has come to its end.
    pub(super) fn stand_still(&mut self) {
        self.stopped = true;
        (self.moves, self.moves_rapidly) = (0, 0);
    }
}

impl Nct {
    /// Whether an axis of the part is on a limit switch toward which it moves.
    fn is_at_limit(&self, state: &State, step: &Step<'_, '_>) -> bool {
        let is_way = state.block.as_ref().is_some_and(|block| block.parts.is_way());
        is_way
            && (0..AXES).any(|axis| match state.way.direction(axis) {
                1 => step.y(56, axis),
                -1 => step.y(57, axis),
                _ => false,
            })
    }

    /// Goes on with the parts of the block for a step.
    pub(super) fn go_on(&self, state: &mut State, step: &mut Step<'_, '_>) {
        let Some(executed) = &state.block else { return };
        if executed.parts_done {
            return;
        }
        let at_limit = self.is_at_limit(state, step);
        let stops = step.y(54, 2) || at_limit || !step.runs() && !state.ignores_stop;
        let tick = step.now.tick;
        let Some(executed) = &mut state.block else { return };
        if stops {
            if executed.stop_since.is_none() && at_limit {
                state.blocks_held = true;
            }
            let since = *executed.stop_since.get_or_insert(tick);
            if tick.saturating_sub(since) >= self.stop_ticks {
                state.stand_still();
            }
            self.waits_for(state, step, None);
            return;
        }
        executed.stop_since = None;
        if state.stopped {
            state.stopped = false;
            state.request_axes();
            self.waits_for(state, step, None);
            return;
        }
        let awaited = self.permission(state, step);
        if awaited.is_none() {
            self.advance(state, step);
        }
        self.waits_for(state, step, awaited);
        let Some(executed) = &mut state.block else { return };
        let parts = &mut executed.parts;
        let is_done = if parts.is_way() { state.way.is_done() } else { parts.has_dwelt() };
        if is_done && parts.next() {
            state.begin_part(&self.setup);
        } else if is_done {
            executed.parts_done = true;
            if parts.kind == Kind::Home {
                state.homed |= parts.named();
            }
            (state.stopped, state.interpolation_done) = (true, true);
            (state.ignores_stop, state.is_feed, state.is_thread) = (false, false, false);
            state.home_block = false;
            (state.moves, state.moves_rapidly) = (0, 0);
        }
    }

    /// What the part still waits for before it may move.
    fn permission(&self, state: &State, step: &Step<'_, '_>) -> Option<Awaited> {
        if state.is_feed && !step.y(65, 0) {
            return Some(Awaited::Feed);
        }
        let held = (0..AXES).find(|axis| state.moves >> axis & 1 != 0 && step.y(61, *axis));
        held.map(|axis| Awaited::Axis(axis as u8))
    }

    fn advance(&self, state: &mut State, step: &Step<'_, '_>) {
        let Some(executed) = &mut state.block else { return };
        if !executed.parts.is_way() {
            executed.parts.dwell();
            return;
        }
        let kind = executed.parts.kind;
        let (speed, percent) = self.speed(state, step, kind);
        state.way.advance(speed, percent, step.now.tick_ns);
        // Test, machine lock and axis lock: the program goes on, and the axis stays.
        let all_locked = step.y(44, 0) || step.y(44, 1);
        for axis in 0..self.setup.axes.len() {
            let is_locked = all_locked || step.y(46, axis);
            if let Some(position) = state.way.position(axis).filter(|_| !is_locked) {
                state.positions.set_command(axis, position);
            }
        }
    }
}
