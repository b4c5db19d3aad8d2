//! Movement by hand: JOG, INCR and REF (NCT 2.2.2, Y430; cnc-side 3.20 to 3.22).

use serde::{Deserialize, Serialize};

use super::reference::Search;
use super::speed::{feed_override, rapid_override};
use super::state::State;
use super::{Nct, Step};
use crate::way::SCALE;

/// Increments of INCR, by Y420 to Y423.
const INCREMENTS: [i128; 4] = [1, 10, 100, 1000];

/// The modes in which axes are moved by hand.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
enum Mode {
    Jog,
    Increments,
    Reference,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
enum Kind {
    /// In rapid traverse or not.
    Jog(bool),
    /// By this way.
    Increment(i128),
    Reference(Search),
}

impl Kind {
    fn mode(self) -> Mode {
        match self {
            Self::Jog(_) => Mode::Jog,
            Self::Increment(_) => Mode::Increments,
            Self::Reference(_) => Mode::Reference,
        }
    }
}

/// The movement of an axis by hand.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Hand {
    kind: Kind,
    positive: bool,
    start: i128,
    progress: i128,
    /// The first tick of its stop, which nothing ends any more.
    stops_since: Option<u64>,
}

/// Whether an axis is asked for in the positive and in the negative direction, by Y43 and Y41.
fn directions(buttons: u8, selected: u8, axis: usize) -> [bool; 2] {
    let is_on = |bit: usize| buttons >> bit & 1 != 0;
    let is_selected = selected >> axis & 1 != 0;
    let asked =
        |own: usize, common: usize| axis < 3 && is_on(own + axis) || is_selected && is_on(common);
    [asked(0, 3), asked(4, 7)]
}

impl Nct {
    fn mode_by_hand(step: &Step<'_, '_>) -> Option<Mode> {
        let modes = [(3, Mode::Jog), (2, Mode::Increments), (0, Mode::Reference)];
        modes.into_iter().find_map(|(bit, mode)| step.y(40, bit).then_some(mode))
    }

    /// Does a step of all movements by hand.
    pub(super) fn by_hand(&self, state: &mut State, step: &Step<'_, '_>) {
        let mode = Self::mode_by_hand(step);
        let is_idle = state.hands.iter().all(Option::is_none);
        if is_idle && (mode.is_none() || step.y.byte(43) == 0) {
            return;
        }
        for axis in 0..self.setup.axes.len().min(state.hands.len()) {
            match state.hands.get(axis).copied().flatten() {
                // A block takes the axes over.
                Some(_) if state.block.is_some() => set(state, axis, None),
                Some(hand) => self.go_on_by_hand(state, step, axis, hand, mode),
                None => self.begin_by_hand(state, step, axis, mode),
            }
        }
    }

    fn begin_by_hand(
        &self,
        state: &mut State,
        step: &Step<'_, '_>,
        axis: usize,
        mode: Option<Mode>,
    ) {
        let Some((entry, mode)) = self.setup.axes.get(axis).zip(mode) else { return };
        let is_free = state.block.is_none() && state.machine_on && !step.y(63, axis);
        let asked = directions(step.y.byte(43), step.y.byte(41), axis);
        let before = directions(state.before.buttons, state.before.selected, axis);
        let (positive, was_asked) = match (asked, before) {
            ([true, false], [was, _]) => (true, was),
            ([false, true], [_, was]) => (false, was),
            // Both buttons at once are none.
            _ => return,
        };
        let at_limit = step.y(if positive { 56 } else { 57 }, axis);
        if !is_free || at_limit || was_asked && mode != Mode::Jog {
            return;
        }
        let start = state.positions.command(axis);
        let kind = match mode {
            Mode::Jog => Kind::Jog(step.y(42, 7)),
            Mode::Increments => {
                let chosen = INCREMENTS.iter().zip(0..).find(|(_, bit)| step.y(42, *bit));
                let Some((increments, _)) = chosen else { return };
                Kind::Increment(increments * entry.unit / i128::from(entry.counts.max(1)))
            }
            Mode::Reference => Kind::Reference(Search::from(start)),
        };
        set(state, axis, Some(Hand { kind, positive, start, progress: 0, stops_since: None }));
        (state.stopped, state.interpolation_done, state.is_feed) = (false, false, false);
    }

    fn go_on_by_hand(
        &self,
        state: &mut State,
        step: &Step<'_, '_>,
        axis: usize,
        mut hand: Hand,
        mode: Option<Mode>,
    ) {
        let tick = step.now.tick;
        let [plus, minus] = directions(step.y.byte(43), step.y.byte(41), axis);
        let own = hand.kind.mode();
        let let_go = own != Mode::Increments && !(if hand.positive { plus } else { minus });
        let at_limit = step.y(if hand.positive { 56 } else { 57 }, axis);
        if let_go || at_limit || mode != Some(own) || !state.machine_on {
            hand.stops_since.get_or_insert(tick);
        }
        let is_over = match hand.stops_since {
            Some(since) => !state.machine_on || tick.saturating_sub(since) >= self.stop_ticks,
            None if step.y(54, 2) || step.y(61, axis) => false,
            None => self.move_by_hand(state, step, axis, &mut hand),
        };
        set(state, axis, Some(hand).filter(|_| !is_over));
        if is_over && state.hands.iter().all(Option::is_none) {
            (state.stopped, state.interpolation_done) = (true, true);
        }
    }

    /// Moves an axis for a tick. Returns whether that was the last one.
    fn move_by_hand(
        &self,
        state: &mut State,
        step: &Step<'_, '_>,
        axis: usize,
        hand: &mut Hand,
    ) -> bool {
        let Some(entry) = self.setup.axes.get(axis) else { return true };
        let (speed, percent) = match &mut hand.kind {
            Kind::Reference(search) => {
                return self.search(state, step, axis, search, hand.positive);
            }
            Kind::Jog(true) => (entry.rapid, rapid_override(&self.setup, step)),
            Kind::Jog(false) | Kind::Increment(_) => {
                let [jog, ..] = entry.jog;
                (jog, feed_override(step))
            }
        };
        let added = speed * i128::from(percent) * i128::from(step.now.tick_ns);
        hand.progress = hand.progress.saturating_add(added);
        let way = hand.progress / SCALE;
        let (way, is_there) = match hand.kind {
            Kind::Increment(all) => (way.min(all), way >= all),
            _ => (way, false),
        };
        let position = if hand.positive { hand.start + way } else { hand.start - way };
        state.positions.set_command(axis, position);
        is_there
    }
}

fn set(state: &mut State, axis: usize, hand: Option<Hand>) {
    if let Some(slot) = state.hands.get_mut(axis) {
        *slot = hand;
    }
}

impl State {
    /// The axes that are moved by hand, and those of them in rapid traverse, a bit each.
    pub(super) fn moved_by_hand(&self) -> [u8; 2] {
        let bit = |axis: usize, is_on: bool| u8::from(is_on) << (axis & 7);
        let mut moved = [0, 0];
        for (axis, hand) in self.hands.iter().enumerate() {
            let Some(hand) = hand else { continue };
            let [all, rapid] = &mut moved;
            *all |= bit(axis, true);
            *rapid |= bit(axis, hand.kind == Kind::Jog(true));
        }
        moved
    }
}
