//! The search for a reference point, by hand or by a PLC axis (cnc-side 3.22).

use serde::{Deserialize, Serialize};

use super::state::State;
use super::{Nct, Step};
use crate::length::{scaled, ticks};
use crate::way::SCALE;

/// A search. It is at the axis's own speed, without overrides.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Search {
    start: i128,
    /// How many ticks it has lasted, where it is done after a time.
    ticks: u64,
    progress: i128,
    /// Whether it has found the switch and goes back from it.
    back: bool,
}

impl Search {
    pub(super) fn from(start: i128) -> Self {
        Self { start, ..Self::default() }
    }
}

impl Nct {
    /// Goes on with a search for a tick. Returns whether the point is found.
    pub(super) fn search(
        &self,
        state: &mut State,
        step: &Step<'_, '_>,
        axis: usize,
        search: &mut Search,
        positive: bool,
    ) -> bool {
        let Some(entry) = self.setup.axes.get(axis) else { return true };
        let tick_ns = step.now.tick_ns;
        let mut found = || state.homed |= 1_u8.checked_shl(axis as u32).unwrap_or(0);
        if !entry.reference_by_switch {
            search.ticks = search.ticks.saturating_add(1);
            let all = ticks(self.setup.home_ns, tick_ns);
            let way = scaled(entry.home - search.start, search.ticks.into(), all.into());
            let is_there = search.ticks >= all;
            if is_there {
                found();
            }
            let position = if is_there { entry.home } else { search.start + way };
            state.positions.set_command(axis, position);
            return is_there;
        }
        let on_switch = step.y(55, axis);
        if search.back && !on_switch {
            found();
            state.positions.put(axis, entry.home);
            return true;
        }
        if !search.back && on_switch {
            *search = Search { back: true, ..Search::from(state.positions.command(axis)) };
            return false;
        }
        // A tenth of the speed on the way back.
        let percent = if search.back { 10 } else { 100 };
        let added = entry.reference_speed * percent * i128::from(tick_ns);
        search.progress = search.progress.saturating_add(added);
        let way = search.progress / SCALE;
        let way = if positive != search.back { way } else { -way };
        state.positions.set_command(axis, search.start + way);
        false
    }
}
