//! Axes that the PLC moves (NCT 2.2.2, Y630, Y900; cnc-side 3.23).

use serde::{Deserialize, Serialize};

use super::reference::Search;
use super::speed::{feed_override, rapid_override};
use super::state::State;
use super::{Nct, Step};
use crate::length::scaled;
use crate::way::SCALE;

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
enum Kind {
    Reference(Search),
    /// To a position, at a feed or (`None`) in rapid traverse.
    Position {
        start: i128,
        end: i128,
        feed: Option<i128>,
        progress: i128,
    },
}

/// A command that the axis has taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct Command {
    kind: Kind,
    /// Whether it was told to move and has not stopped (I9x0 is 0).
    moves: bool,
    /// The first tick of its stop.
    stops_since: Option<u64>,
    /// Whether Y9x5 has ended it.
    reset: bool,
}

/// An axis of the PLC.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct PlcAxis(Option<Command>);

impl PlcAxis {
    /// I9x0: it stands.
    pub(super) fn stands(&self) -> bool {
        self.0.is_none_or(|command| !command.moves)
    }

    /// I9x1: it has no command.
    pub(super) fn is_empty(&self) -> bool {
        self.0.is_none()
    }

    /// Whether it moves, and in rapid traverse.
    pub(super) fn moves(&self) -> [bool; 2] {
        let rapid = |kind| matches!(kind, Kind::Position { feed: None, .. });
        let moving = self.0.filter(|command| command.moves);
        [moving.is_some(), moving.is_some_and(|command| rapid(command.kind))]
    }
}

/// A number of 32 bits from two registers.
fn long(low: i64, high: i64) -> u32 {
    u32::from(low as u16) | u32::from(high as u16) << 16
}

impl Nct {
    /// Does a step of all axes of the PLC.
    pub(super) fn plc_axes(&self, state: &mut State, step: &Step<'_, '_>) {
        for axis in 0..self.setup.axes.len().min(state.plc_axes.len()) {
            let Some(mut own) = state.plc_axes.get(axis).copied() else { continue };
            if !step.y(63, axis) || !state.machine_on {
                own = PlcAxis::default();
            } else if own.0.is_some() || step.y.byte(90 + axis) != 0 {
                own.0 = self.plc_axis(state, step, axis, own.0);
            }
            if let Some(slot) = state.plc_axes.get_mut(axis) {
                *slot = own;
            }
        }
    }

    fn plc_axis(
        &self,
        state: &mut State,
        step: &Step<'_, '_>,
        axis: usize,
        command: Option<Command>,
    ) -> Option<Command> {
        let (now, before) = (step.y.byte(90 + axis), state.before.axes.get(axis).copied());
        let before = before.unwrap_or(0);
        let is_on = |bit: u8| now >> bit & 1 != 0;
        let rises = |bits: u8| now & bits == bits && before & bits != bits;
        let tick = step.now.tick;
        // Y9x1, or Y9x4 with Y9x0.
        let mut command = match command {
            None if rises(0b10) || rises(0b1_0001) => self.take_command(state, step, axis),
            taken => {
                let mut taken = taken?;
                if rises(0b10_0000) {
                    taken.reset = true;
                    taken.stops_since.get_or_insert(tick);
                }
                taken
            }
        };
        let has_stopped =
            |since: Option<u64>| tick.saturating_sub(since.unwrap_or(tick)) >= self.stop_ticks;
        if command.reset {
            let is_over = !command.moves || has_stopped(command.stops_since);
            return Some(command).filter(|_| !is_over);
        }
        if !is_on(0) {
            if command.moves {
                command.stops_since.get_or_insert(tick);
                if has_stopped(command.stops_since) {
                    (command.moves, command.stops_since) = (false, None);
                }
            }
            return Some(command);
        }
        command.stops_since = None;
        if !command.moves {
            command.moves = true;
            return Some(command);
        }
        if step.y(54, 2) || step.y(61, axis) {
            return Some(command);
        }
        let is_there = self.move_plc_axis(state, step, axis, &mut command.kind);
        Some(command).filter(|_| !is_there)
    }

    /// Takes a command: what the flags and registers say.
    fn take_command(&self, state: &mut State, step: &Step<'_, '_>, axis: usize) -> Command {
        let start = state.positions.command(axis);
        let kind = if step.y(90 + axis, 4) {
            state.homed &= !1_u8.checked_shl(axis as u32).unwrap_or(0);
            Kind::Reference(Search::from(start))
        } else {
            let [low, high, slow, fast] = self.variables.plc_axis(axis, step.now.access);
            let (unit, counts) = self
                .setup
                .axes
                .get(axis)
                .map_or((1, 1), |entry| (entry.unit, i128::from(entry.counts.max(1))));
            let given = i128::from(long(low, high) as i32) * unit / counts;
            let is_feed = step.y(90 + axis, 2);
            let feed = i128::from(long(slow, fast)) * unit / (5 * counts);
            Kind::Position {
                start,
                end: if step.y(90 + axis, 3) { start.saturating_add(given) } else { given },
                feed: is_feed.then_some(feed),
                progress: 0,
            }
        };
        Command { kind, moves: false, stops_since: None, reset: false }
    }

    /// Moves an axis for a tick. Returns whether that was the last one.
    fn move_plc_axis(
        &self,
        state: &mut State,
        step: &Step<'_, '_>,
        axis: usize,
        kind: &mut Kind,
    ) -> bool {
        let Some(entry) = self.setup.axes.get(axis) else { return true };
        let (start, end, feed, progress) = match kind {
            Kind::Reference(search) => {
                return self.search(state, step, axis, search, entry.reference_positive);
            }
            Kind::Position { start, end, feed, progress } => (*start, *end, *feed, progress),
        };
        let speed = match feed {
            Some(feed) => (feed * i128::from(feed_override(step))).min(self.setup.feed_max * 100),
            None => entry.rapid * i128::from(rapid_override(&self.setup, step)),
        };
        *progress = progress.saturating_add(speed * i128::from(step.now.tick_ns));
        let total = (end - start).abs().saturating_mul(SCALE);
        state.positions.set_command(axis, start + scaled(end - start, *progress, total));
        *progress >= total
    }
}
