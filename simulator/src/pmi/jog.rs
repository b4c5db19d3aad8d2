//! Movement by hand: jogs, home, zero set, limits (PMI 3.4: @AXRRQ, @JGINC; cnc-side 2.13 to 2.15).

use serde::{Deserialize, Serialize};

use super::state::State;
use super::{Pmi, Seen};
use crate::context::Context;
use crate::event::{Refusal, Requested, Told};
use crate::length::ticks;
use crate::way::SCALE;

/// How many axes can be moved by hand.
pub(super) const AXES: usize = 6;
/// Increments in tenths of thousandths of a unit: of inches from 10 on, of millimetres from 100 on.
const INCREMENTS: [i128; 6] = [100_000, 10_000, 1000, 100, 10, 1];

/// What kind of a movement it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
enum Kind {
    /// As long as the request stays, which is this one.
    Continuous(i64),
    /// To its end.
    Increment,
    /// To the reference point.
    Home,
}

/// The movement of an axis by hand.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Jog {
    kind: Kind,
    start: i128,
    /// Where it ends; without one it has none.
    end: Option<i128>,
    positive: bool,
    speed: i128,
    /// How far it is, in the unit of progress; of a search for the reference point in ticks.
    progress: i128,
    /// Whether its end is a limit.
    to_limit: bool,
}

impl Jog {
    /// Where the axis is.
    fn position(&self, home_ticks: i128) -> i128 {
        if self.kind == Kind::Home {
            let way = self.end.unwrap_or(self.start) - self.start;
            return self.start + crate::length::scaled(way, self.progress, home_ticks);
        }
        let way = self.progress / SCALE;
        let position = if self.positive { self.start + way } else { self.start - way };
        match self.end {
            Some(end) if self.positive => position.min(end),
            Some(end) => position.max(end),
            None => position,
        }
    }
}

impl Pmi {
    /// Does a step of all movements by hand.
    pub(super) fn jog(&self, state: &mut State, seen: &Seen, now: &mut Context<'_>) {
        let may = state.is_on() && state.mode == 0 && !seen.feed_hold_request;
        if !may {
            state.jogs = [None; AXES];
        }
        let home_ticks = ticks(self.setup.home_ns, now.tick_ns);
        for axis in 0..AXES.min(self.setup.axes.len()) {
            let request = seen.axis_requests.get(axis).copied().unwrap_or(0);
            let before = state.requests_before.get(axis).copied().unwrap_or(0);
            let jog = state.jogs.get(axis).copied().flatten();
            match jog {
                Some(jog) => self.go_on_jogging(state, axis, jog, request, seen, home_ticks, now),
                None if may && request != 0 && before == 0 => {
                    self.begin_jog(state, axis, request, now);
                }
                None => {}
            }
        }
        state.requests_before = seen.axis_requests;
    }

    #[allow(clippy::too_many_arguments, reason = "all that a movement depends on")]
    fn go_on_jogging(
        &self,
        state: &mut State,
        axis: usize,
        mut jog: Jog,
        request: i64,
        seen: &Seen,
        home_ticks: u64,
        now: &mut Context<'_>,
    ) {
        if matches!(jog.kind, Kind::Continuous(asked) if asked != request) {
            self.set_jog(state, axis, None);
            return;
        }
        if !seen.move_hold {
            jog.progress = match jog.kind {
                Kind::Home => jog.progress.saturating_add(1),
                _ => jog.progress.saturating_add(jog.speed * 100 * i128::from(now.tick_ns)),
            };
            let position = jog.position(home_ticks.into());
            state.positions.set_command(axis, position);
            let is_there = match jog.kind {
                Kind::Home => jog.progress >= home_ticks.into(),
                _ => jog.end == Some(position),
            };
            if is_there {
                if jog.kind == Kind::Home
                    && let Some(homed) = state.homed.get_mut(axis)
                {
                    *homed = true;
                }
                if jog.to_limit {
                    now.tell(Told::Limit(axis as u8, jog.positive));
                }
                self.set_jog(state, axis, None);
                return;
            }
        }
        self.set_jog(state, axis, Some(jog));
        if let Some(active) = state.active.get_mut(axis) {
            *active = !seen.move_hold;
        }
    }

    fn set_jog(&self, state: &mut State, axis: usize, jog: Option<Jog>) {
        if let Some(slot) = state.jogs.get_mut(axis) {
            *slot = jog;
        }
    }

    /// Whether a homed axis stands at its limit in a direction.
    fn is_at_limit(&self, state: &State, axis: usize, positive: bool) -> bool {
        let homed = state.homed.get(axis).copied().unwrap_or(false);
        let position = state.positions.command(axis);
        homed
            && self.setup.axes.get(axis).is_some_and(|entry| {
                let [min, max] = entry.limits;
                if positive { position >= max } else { position <= min }
            })
    }

    fn begin_jog(&self, state: &mut State, axis: usize, request: i64, now: &mut Context<'_>) {
        let Some(entry) = self.setup.axes.get(axis) else { return };
        let start = state.positions.command(axis);
        let [high, medium, _] = entry.jog;
        let (kind, end, positive, speed) = match request {
            1 | 2 => {
                let positive = request == 1;
                let increment = self.variables.jog_increment.read(now.access);
                let way = match usize::try_from(increment) {
                    Ok(speed @ 0..=2) => {
                        let speed = entry.jog.get(speed).copied().unwrap_or(high);
                        self.begin(
                            state,
                            axis,
                            Kind::Continuous(request),
                            None,
                            positive,
                            speed,
                            now,
                        );
                        return;
                    }
                    Ok(size @ 3..=8) => {
                        let tenths = INCREMENTS.get(size - 3).copied().unwrap_or(1);
                        let of_millimetres = if self.setup.rules.is_inch { 1 } else { 10 };
                        entry.unit * tenths * of_millimetres / 10_000
                    }
                    _ => entry.unit / i128::from(entry.counts.max(1)),
                };
                let end = if positive { start + way } else { start - way };
                (Kind::Increment, end, positive, medium)
            }
            3 => (Kind::Home, entry.home, entry.home >= start, high),
            6 => {
                let goals = self.variables.axes.get(axis).map(|axis| axis.jog_position);
                let counts = goals.map_or(0, |goal| goal.read(now.access));
                let end = i128::from(counts) * entry.unit / i128::from(entry.counts.max(1));
                (Kind::Increment, end, end >= start, high)
            }
            4 | 5 => {
                if state.jogs.iter().all(Option::is_none)
                    && let Some(offset) = state.offsets.get_mut(axis)
                {
                    *offset = start;
                }
                return;
            }
            _ => return,
        };
        self.begin(state, axis, kind, Some(end), positive, speed, now);
    }

    #[allow(clippy::too_many_arguments, reason = "all that a movement consists of")]
    fn begin(
        &self,
        state: &mut State,
        axis: usize,
        kind: Kind,
        end: Option<i128>,
        positive: bool,
        speed: i128,
        now: &mut Context<'_>,
    ) {
        let start = state.positions.command(axis);
        let homed = state.homed.get(axis).copied().unwrap_or(false);
        let limits = self.setup.axes.get(axis).map(|entry| entry.limits).filter(|_| homed);
        let (mut end, mut to_limit) = (end, false);
        if kind != Kind::Home {
            let others = (0..AXES).filter(|other| *other != axis);
            let stands = |axis: usize, positive| self.is_at_limit(state, axis, positive);
            let other_stands =
                others.into_iter().any(|other| stands(other, true) || stands(other, false));
            if stands(axis, positive) || other_stands {
                now.tell(Told::Refused(Requested::Jog(axis as u8), Refusal::Limit));
                return;
            }
            if let Some([min, max]) = limits {
                let limit = if positive { max } else { min };
                let beyond =
                    end.is_none_or(|end| if positive { end >= limit } else { end <= limit });
                if beyond {
                    (end, to_limit) = (Some(limit), true);
                }
            }
        }
        let jog = Jog { kind, start, end, positive, speed, progress: 0, to_limit };
        self.set_jog(state, axis, Some(jog));
        // As in a block: there is way left, and nothing holds it (cnc-side 2.11).
        let has_way = kind == Kind::Home || end != Some(start);
        if let Some(active) = state.active.get_mut(axis) {
            *active = has_way && !self.variables.move_hold.is_on(now.access);
        }
    }
}
