//! The state of a coordinate system.

use std::collections::VecDeque;

use plcc_abi::pmac::motion::{AxisSet, LineWord, Mode, Modes, SyncOp};
use serde::{Deserialize, Serialize};

use crate::circle::Normal;
use crate::halt::{Kept, Pause};
use crate::sequence::Sequence;

/// How deep GOSUB and CALL nest (guide, Subroutines).
pub(crate) const MAX_DEPTH: usize = 15;

/// How many synchronous assignments wait at most. Further ones are done at once.
pub(crate) const MAX_SYNC: usize = 1024;

/// A place in a motion program.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Place {
    /// The index of the program in the tables.
    pub(crate) program: u32,
    /// The resume point.
    pub(crate) point: u32,
}

/// Where the program counter is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Counter {
    /// In a program.
    At(Place),
    /// At a label of a program, which may not be there.
    Label(u32, u32),
    /// Nothing was chosen: at the beginning of the program Ix91.
    Default,
}

/// A call that has not returned.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Frame {
    /// Where the program goes on.
    pub(crate) place: Place,
    /// The first of its arguments, and the next one that READ takes.
    pub(crate) first: u32,
    pub(crate) next: u32,
    /// Up to which word of its line READ had taken the words when it was made.
    pub(crate) read: u16,
    /// Whether PRELUDE1 has made it.
    pub(crate) prelude: bool,
}

/// A word of the line of a call.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Argument {
    pub(crate) word: LineWord,
    pub(crate) value: f64,
}

/// How many moves `/` keeps at most: this many are calculated ahead.
pub(crate) const MAX_KEPT: usize = 2;

/// The calls that PRELUDE1 makes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Prelude {
    /// The call: its code, or none for CALL, and its value.
    pub(crate) call: Option<(Option<u8>, f64)>,
    /// Up to which word of the line it was called.
    pub(crate) done: u16,
    /// Its program has just returned.
    pub(crate) returned: bool,
}

/// How many arguments all calls that have not returned have at most.
pub(crate) const MAX_ARGUMENTS: usize = 64 * MAX_DEPTH;

/// What the calculation waits for before its flag is set again.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Wait {
    /// Nothing.
    #[default]
    None,
    /// The stop of the sequence.
    Stop,
    /// The stop, and then a DWELL of this time.
    StopAndDwell(i64),
    /// A DWELL: the time that has passed, and its whole time.
    Dwell(i64, i64),
    /// The moves of single motors: RAPID, HOME.
    Motors,
}

/// An assignment that waits for a move.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct SyncAssignment {
    pub(crate) op: SyncOp,
    /// The M-variable.
    pub(crate) number: u32,
    pub(crate) value: f64,
    /// The number of the move with which it is done.
    pub(crate) with: u64,
    /// Its statement: file and line.
    pub(crate) place: (u32, u32),
}

/// A coordinate system.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct System {
    /// The present time base in units a servo cycle.
    pub(crate) base: i64,
    /// Feed hold (H).
    pub(crate) held: bool,
    /// Coming back from a feed hold, by Ix95.
    pub(crate) returning: bool,
    /// The halt by `\\`.
    pub(crate) pause: Pause,
    /// The moves that `/` has kept for R.
    pub(crate) kept: Vec<Kept>,
    pub(crate) counter: Counter,
    /// The number of the chosen program; the one of Ix91 before the first B.
    pub(crate) chosen: Option<u32>,
    pub(crate) stack: Vec<Frame>,
    pub(crate) arguments: Vec<Argument>,
    /// Up to which word of its line the call that returned last has read.
    pub(crate) read: u16,
    pub(crate) prelude: Prelude,
    pub(crate) running: bool,
    /// Single step (S).
    pub(crate) step: bool,
    /// Where steps end behind a line, the line of this one.
    pub(crate) stepped: Option<(u32, u32)>,
    /// Between BLOCKSTART and BLOCKSTOP.
    pub(crate) block: bool,
    pub(crate) continuous: bool,
    /// A calculation is wanted.
    pub(crate) flag: bool,
    pub(crate) wait: Wait,
    /// An empty loop or WAIT.
    pub(crate) idle: bool,
    /// The system's time since R or the last break.
    pub(crate) since_break: i64,
    pub(crate) mode: Mode,
    pub(crate) modes: Modes,
    /// The normal of the plane of arcs.
    pub(crate) normal: Normal,
    /// The number of the selected transformation, 0 for none.
    pub(crate) transformation: u16,
    /// Moves by time (TM), not by speed.
    pub(crate) by_time: bool,
    /// The two status words as they were computed last.
    pub(crate) shown: (u32, u32),
    /// The axes' targets in user units.
    pub(crate) axes: [f64; 9],
    /// Whether the axes are matched to the motors at the next calculation.
    pub(crate) rematch: bool,
    pub(crate) sequence: Sequence,
    pub(crate) sync: VecDeque<SyncAssignment>,
    /// The number of the next move or DWELL to be calculated.
    pub(crate) next_move: u64,
    /// Synchronous assignments with this number or a lower one are due.
    pub(crate) due: u64,
    /// The same from the next cycle on: a RAPID move has its time 0 in this one.
    pub(crate) due_next: u64,
    /// The line of the move that runs: file and line.
    pub(crate) line: (u32, u32),
    /// The line of the statement of motion that was executed last.
    pub(crate) last: (u32, u32),
}

impl System {
    pub(crate) fn new(motors: usize) -> Self {
        Self {
            base: 0,
            held: false,
            returning: false,
            pause: Pause::None,
            kept: Vec::with_capacity(MAX_KEPT),
            counter: Counter::Default,
            chosen: None,
            stack: Vec::with_capacity(MAX_DEPTH),
            arguments: Vec::with_capacity(MAX_ARGUMENTS),
            read: 0,
            prelude: Prelude::default(),
            running: false,
            step: false,
            stepped: None,
            block: false,
            continuous: false,
            flag: false,
            wait: Wait::None,
            idle: false,
            since_break: 0,
            mode: Mode::Linear,
            modes: Modes { incremental: AxisSet::R, feedrate: AxisSet::XYZ },
            normal: Normal::default(),
            transformation: 0,
            by_time: false,
            shown: (0, 0),
            axes: [0.0; 9],
            rematch: false,
            sequence: Sequence::new(motors),
            sync: VecDeque::with_capacity(MAX_SYNC),
            next_move: 1,
            due: 0,
            due_next: 0,
            line: (0, 0),
            last: (0, 0),
        }
    }

    /// Whether a DWELL counts.
    pub(crate) fn dwells(&self) -> bool {
        matches!(self.wait, Wait::Dwell(..))
    }

    /// Sets the flag of the calculation, if a program runs.
    pub(crate) fn want(&mut self) {
        if self.running {
            self.flag = true;
        }
    }
}
