//! What the simulated control of a PMI program remembers.

use serde::{Deserialize, Serialize};

use super::Seen;
use super::auxiliary::Auxiliary;
use super::jog::{AXES, Jog};
use super::program::BlockState;
use super::touch::TouchState;
use crate::positions::Positions;
use crate::setup::Setup;

/// Whether the machine is on (PMI 3.4: @MONRQ).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) enum Machine {
    #[default]
    Off,
    /// It was asked for in this step.
    Starting(u64),
    On,
}

/// What the step before has seen, for what counts by its edge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Before {
    pub(super) machine_on_request: bool,
    pub(super) control_reset: bool,
    pub(super) cycle_request: bool,
    pub(super) block_delete: bool,
    pub(super) optional_stop: bool,
}

impl Before {
    pub(super) fn of(seen: &Seen) -> Self {
        Self {
            machine_on_request: seen.machine_on_request,
            control_reset: seen.control_reset,
            cycle_request: seen.cycle_request,
            block_delete: seen.block_delete,
            optional_stop: seen.optional_stop,
        }
    }
}

/// All of it.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct State {
    pub(super) before: Before,
    pub(super) machine: Machine,
    pub(super) mode: i64,
    /// Whether block delete and optional stop are on.
    pub(super) block_delete: bool,
    pub(super) optional_stop: bool,
    /// @FHOLD.
    pub(super) hold: bool,
    /// Whether the part program is started.
    pub(super) started: bool,
    /// @PGMSE.
    pub(super) program_end: i64,
    pub(super) s_code: i64,
    pub(super) t_code: i64,
    pub(super) block: BlockState,
    pub(super) positions: Positions,
    /// For each axis whether it has way left and nothing holds it.
    pub(super) active: Vec<bool>,
    pub(super) homed: Vec<bool>,
    /// Where the coordinates of part programs begin.
    pub(super) offsets: Vec<i128>,
    pub(super) jogs: [Option<Jog>; AXES],
    /// @AXRRQ as the step before saw it.
    pub(super) requests_before: [i64; AXES],
    pub(super) auxiliary: Vec<Auxiliary>,
    /// The speed of the spindle times the nanoseconds of its ramp.
    pub(super) spindle: i128,
    pub(super) touch: TouchState,
}

impl State {
    /// The state at power-up.
    pub(super) fn new(setup: &Setup, tick_ns: u64) -> Self {
        let axes = setup.axes.len();
        let homed = setup.table.homed.unwrap_or(false);
        Self {
            block: BlockState::new(axes, setup.rules.codes.len()),
            positions: Positions::new(setup, tick_ns),
            active: vec![false; axes],
            homed: vec![homed; axes],
            offsets: vec![0; axes],
            auxiliary: vec![Auxiliary::new(setup, tick_ns); setup.table.aux.len()],
            ..Self::default()
        }
    }

    /// Whether all lists have the lengths of another state's.
    pub(crate) fn fits(&self, own: &Self) -> bool {
        self.block.fits(&own.block)
            && self.positions.fits(&own.positions)
            && self.active.len() == own.active.len()
            && self.homed.len() == own.homed.len()
            && self.offsets.len() == own.offsets.len()
            && self.auxiliary.len() == own.auxiliary.len()
            && self.auxiliary.iter().zip(&own.auxiliary).all(|(a, b)| a.fits(b))
            && self.touch.fits(&own.touch)
    }

    /// Reserves what no later step must allocate.
    pub(crate) fn reserve(&mut self, codes: usize) {
        self.block.reserve(codes);
    }

    pub(super) fn is_on(&self) -> bool {
        self.machine == Machine::On
    }

    pub(super) fn is_off(&self) -> bool {
        self.machine == Machine::Off
    }

    /// The actual positions of the axes.
    pub(crate) fn actual(&self) -> &[i128] {
        self.positions.all_actual()
    }
}
