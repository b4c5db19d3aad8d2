//! The state of a motor.

use std::collections::VecDeque;

use plcc_abi::pmac::motion::{AxisDefinition, JogGoal, Plant};
use serde::{Deserialize, Serialize};

use crate::rest::Seen;
use crate::units::Row;

/// How many jogs and other starts of a motor wait for the time that I12 gives. When a further one comes, the oldest
/// is dropped: it would be replaced before it got anywhere.
pub(crate) const MAX_WAITING: usize = 32;

/// How many interrupts back the filtered velocity looks.
pub(crate) const FILTER: usize = 80;

/// The state of the servo loop.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) enum Loop {
    /// The output is zero and the amplifier off.
    #[default]
    Killed,
    /// The output is this percentage.
    Open(f64),
    /// The motor follows its commands.
    Closed,
}

/// What a row of pieces is for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Purpose {
    /// A jog.
    #[default]
    Jog,
    /// The search of a homing move or of a move until a trigger.
    Search,
    /// The way from the trigger to zero.
    BehindHome,
    /// The way from the trigger of another move to its end.
    BehindTrigger,
    /// RAPID.
    Rapid,
    /// An abort deceleration, in real time.
    Abort,
}

/// A motion that begins after the time that I12 gives.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) enum Start {
    /// A jog, perhaps until a trigger.
    Jog(JogGoal, Option<f64>),
    /// A homing search.
    Home,
    /// To zero behind a home trigger.
    BehindHome,
    /// To a target behind another trigger, at this speed.
    BehindTrigger(f64, f64),
    /// RAPID to a target at a speed, perhaps until a trigger.
    Rapid(f64, f64, Option<f64>),
}

/// A [`Start`] that waits.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Waiting {
    /// Servo cycles that are left.
    pub(crate) cycles: u32,
    /// The number of the command. What is older than a motion that begins is dropped.
    pub(crate) age: u64,
    pub(crate) start: Start,
    /// Whether a motion program gave it.
    pub(crate) programmed: bool,
}

/// A search for a trigger.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Search {
    /// Whether it is a homing search.
    pub(crate) home: bool,
    /// For another one, how far behind the trigger it ends.
    pub(crate) offset: f64,
    /// The speed of the move behind it.
    pub(crate) speed: f64,
    pub(crate) age: u64,
    pub(crate) programmed: bool,
    /// Whether its time 0 was in this cycle, in which levels alone count.
    pub(crate) fresh: bool,
}

/// The inputs of a motor's channel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Inputs {
    pub(crate) home: bool,
    /// −LIM of PMAC, PLIM of Turbo PMAC: beyond the positive end.
    pub(crate) positive: bool,
    /// +LIM, MLIM: beyond the negative end.
    pub(crate) negative: bool,
    /// The level of the line, whatever is active.
    pub(crate) fault: bool,
    pub(crate) index: bool,
}

/// A motor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Motor {
    /// Whether Ix00 was not 0 in the last cycle.
    pub(crate) active: bool,
    pub(crate) mode: Loop,
    /// Commanded position in counts from the motor's zero.
    pub(crate) commanded: f64,
    /// The same before the trajectories of the last cycle.
    pub(crate) before: f64,
    pub(crate) actual: f64,
    pub(crate) actual_before: f64,
    /// The motor's zero in counts from the position at power-up.
    pub(crate) zero: f64,
    /// The physical position, and that of the cycle before.
    pub(crate) x: f64,
    pub(crate) x_before: f64,
    /// Physical positions that were commanded, for the lag.
    pub(crate) lag: VecDeque<f64>,
    pub(crate) row: Row,
    pub(crate) purpose: Purpose,
    /// Whether a motion program gave the motion of the row.
    pub(crate) programmed: bool,
    /// Whether the abort deceleration is that of a programmed move.
    pub(crate) was_programmed: bool,
    /// The age of the command whose row it is.
    pub(crate) age: u64,
    pub(crate) waiting: VecDeque<Waiting>,
    pub(crate) search: Option<Search>,
    /// Search for a trigger, from its command on.
    pub(crate) searching: bool,
    pub(crate) inputs: Inputs,
    pub(crate) inputs_before: Inputs,
    pub(crate) captured: bool,
    pub(crate) capture: f64,
    pub(crate) prejog: f64,
    pub(crate) target: f64,
    pub(crate) velocity_zero: bool,
    pub(crate) end_positive: bool,
    pub(crate) end_negative: bool,
    pub(crate) warning: bool,
    pub(crate) fatal: bool,
    pub(crate) fault: bool,
    pub(crate) in_position_now: bool,
    pub(crate) in_position: bool,
    pub(crate) in_position_count: u32,
    pub(crate) definition: Option<AxisDefinition>,
    /// The two status words as they were computed last.
    pub(crate) shown: (u32, u32),
    /// What the stimulus sets.
    pub(crate) jam: bool,
    pub(crate) faulty: bool,
    /// Actual positions at the last interrupts, the oldest first.
    pub(crate) history: VecDeque<f64>,
    #[serde(skip)]
    pub(crate) seen: Seen,
}

impl Motor {
    pub(crate) fn new(plant: &Plant) -> Self {
        let lag = usize::from(plant.lag);
        let mut ring = VecDeque::with_capacity(lag + 1);
        ring.extend(std::iter::repeat_n(0.0, lag));
        Self {
            active: false,
            mode: Loop::Killed,
            commanded: 0.0,
            before: 0.0,
            actual: 0.0,
            actual_before: 0.0,
            zero: 0.0,
            x: 0.0,
            x_before: 0.0,
            lag: ring,
            row: Row::default(),
            purpose: Purpose::Jog,
            programmed: false,
            was_programmed: false,
            age: 0,
            waiting: VecDeque::with_capacity(MAX_WAITING + 1),
            search: None,
            searching: false,
            inputs: Inputs::default(),
            inputs_before: Inputs::default(),
            captured: false,
            capture: 0.0,
            prejog: 0.0,
            target: 0.0,
            velocity_zero: true,
            end_positive: false,
            end_negative: false,
            warning: false,
            fatal: false,
            fault: false,
            in_position_now: false,
            in_position: false,
            in_position_count: 0,
            definition: None,
            shown: (0, 0),
            jam: false,
            faulty: false,
            history: VecDeque::with_capacity(FILTER + 1),
            seen: Seen::default(),
        }
    }

    pub(crate) fn closed(&self) -> bool {
        self.mode == Loop::Closed
    }

    /// The following error; none in open loop.
    pub(crate) fn following_error(&self) -> f64 {
        match self.mode {
            Loop::Open(_) => 0.0,
            Loop::Killed | Loop::Closed => self.commanded - self.actual,
        }
    }

    /// Whether a row of its own moves it.
    pub(crate) fn moves(&self) -> bool {
        !self.row.is_empty()
    }

    /// Whether something of a motion program is still to be done by it alone.
    pub(crate) fn has_programmed(&self) -> bool {
        self.moves() && self.programmed
            || self.waiting.iter().any(|waiting| waiting.programmed)
            || self.search.is_some_and(|search| search.programmed)
    }

    /// Drops rows, waiting commands and searches.
    pub(crate) fn drop_motion(&mut self) {
        self.row = Row::default();
        self.waiting.clear();
        self.search = None;
        self.searching = false;
        self.programmed = false;
    }

    /// The amplifier goes off (K).
    pub(crate) fn kill(&mut self) {
        self.drop_motion();
        self.mode = Loop::Killed;
        self.commanded = self.actual;
        self.before = self.actual;
    }

    /// The loop is closed where the motor is.
    pub(crate) fn close(&mut self) {
        if !self.closed() {
            self.mode = Loop::Closed;
            self.commanded = self.actual;
            self.before = self.actual;
            (self.fatal, self.warning, self.fault) = (false, false, false);
        }
    }

    /// Appends a start; the oldest is dropped where there is no room.
    pub(crate) fn wait(&mut self, waiting: Waiting) {
        if self.waiting.len() >= MAX_WAITING {
            self.waiting.pop_front();
        }
        self.waiting.push_back(waiting);
    }

    /// Whether the abort deceleration is under way.
    pub(crate) fn decelerates(&self) -> bool {
        self.moves() && self.purpose == Purpose::Abort
    }

    /// Moves zero to a physical position: all that is counted from it shifts.
    pub(crate) fn move_zero(&mut self, zero: f64) {
        let by = self.zero - zero;
        self.zero = zero;
        for value in
            [&mut self.commanded, &mut self.actual, &mut self.before, &mut self.actual_before]
        {
            *value += by;
        }
        for position in &mut self.history {
            *position += by;
        }
        self.row.shift(by);
    }
}
