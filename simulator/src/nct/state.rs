//! What the simulated control of an NCT program remembers.

use serde::{Deserialize, Serialize};

use super::Step;
use super::block::Executed;
use super::hand::Hand;
use super::plc_axis::PlcAxis;
use super::serial::Serial;
use crate::event::Awaited;
use crate::history::History;
use crate::length::ticks;
use crate::modal::Modal;
use crate::positions::Positions;
use crate::setup::Setup;
use crate::way::Way;

/// How many axes an NCT control has.
pub(super) const AXES: usize = 8;

/// A fault of a drive, by which the machine goes off until the end of the run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Fault {
    /// SERVO of the axis with this number, from 1.
    Servo(u8),
    /// ENCODER.
    Encoder(u8),
    /// FEEDBACK.
    Feedback(u8),
}

/// What the step before has seen, for what counts by its edge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Before {
    pub(super) reset_key: bool,
    pub(super) reset_request: bool,
    /// Y430 to Y437 and Y410 to Y417.
    pub(super) buttons: u8,
    pub(super) selected: u8,
    /// Y900 to Y977, a byte for each axis.
    pub(super) axes: [u8; AXES],
    /// Y675.
    pub(super) chops: bool,
}

impl Before {
    pub(super) fn of(step: &Step<'_, '_>) -> Self {
        Self {
            reset_key: step.reset_key,
            reset_request: step.y(47, 7) && step.y(53, 7),
            buttons: step.y.byte(43),
            selected: step.y.byte(41),
            axes: std::array::from_fn(|axis| step.y.byte(90 + axis)),
            chops: step.y(67, 5),
        }
    }
}

/// A spindle.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct SpindleState {
    /// RH011 or RH016.
    pub(super) commanded: u16,
    pub(super) target: i64,
    /// The command times the nanoseconds of the ramp.
    pub(super) command: i128,
    pub(super) history: History,
    /// The actual speed.
    pub(super) actual: i64,
    /// I650: the command has its target.
    pub(super) has_command: bool,
    /// I651.
    pub(super) is_oriented: bool,
    /// I652.
    pub(super) is_positioned: bool,
    /// I656.
    pub(super) is_at_speed: bool,
    /// I657.
    pub(super) stands: bool,
    /// I663 of spindle 1, I664 of spindle 2.
    pub(super) is_synchronous: bool,
    /// What it was asked for in the step before: to be oriented, or to follow the other one.
    pub(super) orients: bool,
    pub(super) follows: bool,
    /// The first tick in which orientation had a speed, or synchronism the speed of the other spindle.
    pub(super) turns_since: Option<u64>,
    /// The tick in which orientation or synchronism was reached.
    pub(super) reached_in: Option<u64>,
}

/// How far the return from an interruption is (NCT 2.2.1, I511).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) enum Return {
    /// START has not come.
    #[default]
    No,
    /// START has come, and is to be let go.
    Asked,
    /// Message 3549 is shown.
    Message,
    /// The operator has answered it.
    Answered,
}

/// For what the block waits, and for how long.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Waits {
    pub(super) now: Option<(Awaited, u64)>,
    told: [Option<Awaited>; 4],
}

impl Waits {
    pub(super) fn first(&self) -> Option<Awaited> {
        self.now.map(|(awaited, _)| awaited)
    }

    /// The block waits for this in this step, or for nothing. Gives what has to be told.
    pub(super) fn note(&mut self, awaited: Option<Awaited>, tick: u64) -> Option<Awaited> {
        let Some(awaited) = awaited else {
            self.now = None;
            return None;
        };
        let since = match self.now {
            Some((before, since)) if before == awaited => since,
            _ => tick,
        };
        self.now = Some((awaited, since));
        if tick.saturating_sub(since) + 1 < super::block::PATIENCE
            || self.told.contains(&Some(awaited))
        {
            return None;
        }
        if let Some(slot) = self.told.iter_mut().find(|told| told.is_none()) {
            *slot = Some(awaited);
        }
        Some(awaited)
    }
}

/// All of it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct State {
    pub(super) before: Before,
    /// I540.
    pub(super) machine_on: bool,
    pub(super) fault: Option<Fault>,
    /// I546.
    pub(super) buffer_full: bool,
    /// I547.
    pub(super) blocks_held: bool,
    /// I550.
    pub(super) stopped: bool,
    /// I551.
    pub(super) interpolation_done: bool,
    /// I552.
    pub(super) ignores_stop: bool,
    /// I553.
    pub(super) is_feed: bool,
    /// I554.
    pub(super) is_thread: bool,
    /// I545.
    pub(super) home_block: bool,
    /// I511.
    pub(super) interrupted: bool,
    /// I61n and I62n, a bit for each axis.
    pub(super) moves: u8,
    pub(super) moves_rapidly: u8,
    /// I9n3.
    pub(super) homed: u8,
    /// RH000 to RH009.
    pub(super) registers: [u16; 10],
    /// The block that is executed.
    pub(super) block: Option<Executed>,
    pub(super) waits: Waits,
    pub(super) way: Way,
    /// The block that an interruption has put aside.
    pub(super) aside: Option<Executed>,
    pub(super) returns: Return,
    /// The index of the entered block that waits.
    pub(super) entered: Option<u32>,
    /// The index of the next block of the part program.
    pub(super) next: u32,
    /// The tick in which the part program ended, until START has been let go.
    pub(super) ended: Option<u64>,
    pub(super) modal: Modal,
    pub(super) positions: Positions,
    /// The movements by hand.
    pub(super) hands: [Option<Hand>; AXES],
    pub(super) plc_axes: [PlcAxis; AXES],
    /// I675.
    pub(super) chopping: bool,
    /// I676.
    pub(super) is_chopping: bool,
    /// I677.
    pub(super) stands_at_r: bool,
    /// The tick in which chopping began or ended, until that is reached.
    pub(super) chops_since: Option<u64>,
    pub(super) serial: Serial,
    /// Records that were sent and not told yet.
    pub(super) sent: Vec<Vec<u8>>,
    pub(super) spindles: [SpindleState; 2],
    /// RH020.
    pub(super) message: Option<u16>,
    /// The message flag of the program that is active, by its number from Y700 on.
    pub(super) active: Option<usize>,
    /// The one whose flag is shown, and the one that was in the step before.
    pub(super) shown: Option<usize>,
    pub(super) shown_before: Option<usize>,
}

impl State {
    /// The state at power-up.
    pub(super) fn new(setup: &Setup, tick_ns: u64) -> Self {
        let spindle = |spindle: &crate::setup::Spindle| SpindleState {
            history: History::new(&[0], ticks(spindle.lag_ns, tick_ns)),
            ..SpindleState::default()
        };
        Self {
            before: Before::default(),
            machine_on: false,
            fault: None,
            buffer_full: false,
            blocks_held: false,
            stopped: true,
            interpolation_done: true,
            ignores_stop: false,
            is_feed: false,
            is_thread: false,
            home_block: false,
            interrupted: false,
            moves: 0,
            moves_rapidly: 0,
            homed: if setup.table.homed.unwrap_or(false) { u8::MAX } else { 0 },
            registers: [0; 10],
            block: None,
            waits: Waits::default(),
            way: Way::new(setup.axes.len()),
            aside: None,
            returns: Return::No,
            entered: None,
            next: 0,
            ended: None,
            modal: Modal::default(),
            positions: Positions::new(setup, tick_ns),
            hands: [None; AXES],
            plc_axes: [PlcAxis::default(); AXES],
            chopping: false,
            is_chopping: false,
            stands_at_r: true,
            chops_since: None,
            serial: Serial::default(),
            sent: vec![],
            spindles: setup.spindles.each_ref().map(spindle),
            message: None,
            active: None,
            shown: None,
            shown_before: None,
        }
    }

    /// Whether all lists have the lengths of another state's.
    pub(crate) fn fits(&self, own: &Self) -> bool {
        let histories = |state: &Self| state.spindles.each_ref().map(|s| s.history.clone());
        let [a, b] = histories(self);
        let [own_a, own_b] = histories(own);
        a.fits(&own_a)
            && b.fits(&own_b)
            && self.way.fits(own.positions.commands().len())
            && self.positions.fits(&own.positions)
    }

    /// The actual positions of the axes.
    pub(crate) fn actual(&self) -> &[i128] {
        self.positions.all_actual()
    }

    /// What the serial line has sent.
    pub(crate) fn take_sent(&mut self) -> Vec<Vec<u8>> {
        std::mem::take(&mut self.sent)
    }

    /// Whether the machine is on.
    pub(crate) fn is_machine_on(&self) -> bool {
        self.machine_on
    }

    /// A drive has failed.
    pub(crate) fn fail(&mut self, fault: Fault) {
        self.fault.get_or_insert(fault);
    }

    /// The operator enters a block, which is not possible while one is executed.
    pub(crate) fn enter(&mut self, entry: u32) {
        if self.block.is_none() {
            self.entered = Some(entry);
        }
    }

    /// The operator answers the message 3549.
    pub(crate) fn answer(&mut self) {
        if self.returns == Return::Message {
            self.returns = Return::Answered;
        }
    }

    /// The message flag that is shown, and the one that was.
    pub(super) fn shown_flag(&self) -> (Option<usize>, Option<usize>) {
        (self.shown, self.shown_before)
    }
}
