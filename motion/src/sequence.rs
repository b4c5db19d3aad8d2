//! A sequence of moves that follow each other without a stop: LINEAR moves that blend, segments of LINEAR and CIRCLE
//! moves, PVT, SPLINE.
//!
//! Times count from the sequence's start. Move k of those that blend has its corner, where two lines would meet without
//! blending, at `corner`; it begins half its acceleration time before the corner of the move in front of it.

use serde::{Deserialize, Serialize};

use plcc_abi::pmac::motion::AxisSet;

use crate::circle::Arc;
use crate::units::{ms, position, velocity};

/// How many moves are kept: those before the present one, with which it blends or of which a spline is made, the
/// present one and two more.
pub(crate) const KEPT: u32 = 8;

/// What moves a sequence is made of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum SequenceKind {
    /// LINEAR moves that blend.
    #[default]
    Blended,
    /// LINEAR and CIRCLE moves that are cut into segments (I13).
    Segmented,
    Pvt,
    /// Segments of equal time.
    Spline1,
    /// Segments of any time.
    Spline2,
}

impl SequenceKind {
    /// Whether its moves have corners and blend into each other.
    pub(crate) fn blends(self) -> bool {
        matches!(self, Self::Blended | Self::Segmented)
    }
}

/// How far a sequence has come.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Progress {
    /// There is none.
    #[default]
    None,
    /// It has moves and has not begun.
    Gathering,
    /// Its time runs.
    Running,
}

/// A move.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Move {
    /// The acceleration at its beginning and the S-curve's half of it.
    pub(crate) ta: i64,
    pub(crate) ts: i64,
    /// The time between its two corners.
    pub(crate) tm: i64,
    /// When its end's corner is.
    pub(crate) corner: i64,
    pub(crate) begin: i64,
    /// For each motor the position at its end, the way and the velocity.
    pub(crate) p: Vec<f64>,
    pub(crate) d: Vec<f64>,
    pub(crate) v: Vec<f64>,
    /// The time of a spline's segment in ms; of a LINEAR or CIRCLE move the time that its words ask for.
    pub(crate) time: f64,
    /// Where the axes are at its beginning and at its end, which it names, and the arc that it goes.
    pub(crate) from: [f64; 9],
    pub(crate) to: [f64; 9],
    pub(crate) axes: AxisSet,
    pub(crate) arc: Option<Arc>,
    /// Its number, for synchronous assignments.
    pub(crate) number: u64,
    /// Its source: file and line.
    pub(crate) line: (u32, u32),
}

/// What has happened to a sequence in a cycle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Advance {
    /// How many moves have begun.
    pub(crate) begun: u32,
    /// Whether it is over.
    pub(crate) over: bool,
    /// Whether what comes next is due and was not calculated.
    pub(crate) late: bool,
}

/// A sequence of moves.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Sequence {
    pub(crate) progress: Progress,
    pub(crate) kind: SequenceKind,
    pub(super) moves: Vec<Move>,
    /// How many moves were calculated and how many have begun.
    pub(crate) calculated: u32,
    pub(crate) begun: u32,
    /// Whether its last move ends in a stop.
    pub(crate) closed: bool,
    /// The times of the stop.
    pub(super) stop: (i64, i64),
    pub(super) stop_begin: i64,
    pub(super) stopping: bool,
    pub(crate) time: i64,
    /// For each motor whether it takes part, and where it was at the start.
    pub(crate) member: Vec<bool>,
    pub(crate) start: Vec<f64>,
    /// When the present pieces began; the phase that runs, and how many there are.
    pub(super) bounds: [i64; 4],
    pub(super) phase: usize,
    pub(super) phases: usize,
    /// The present pieces of each motor.
    pub(super) pieces: Vec<[[f64; 4]; 4]>,
    /// PVT, splines and segments: the number of the next piece, from 0, and when it begins.
    pub(super) next_piece: u32,
    pub(super) next_begin: i64,
    pub(crate) segments: Segments,
}

/// What segmentation has of a sequence.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Segments {
    /// The time of a segment in units and in ms.
    pub(crate) length: i64,
    pub(crate) ms: f64,
    /// The time of the last point that was taken.
    pub(crate) taken: i64,
    /// The number of the first point that is the end.
    pub(crate) last: Option<u32>,
    /// How many moves are over at the points that were taken, where they have brought the axes, and which axes they or
    /// the present one name.
    pub(crate) done: u32,
    pub(crate) axes: [f64; 9],
    pub(crate) named: AxisSet,
    /// For each motor the last four points.
    pub(crate) points: Vec<[f64; 4]>,
}

impl Sequence {
    pub(crate) fn new(motors: usize) -> Self {
        let empty = || Move {
            p: vec![0.0; motors],
            d: vec![0.0; motors],
            v: vec![0.0; motors],
            ..Move::default()
        };
        Self {
            progress: Progress::None,
            kind: SequenceKind::Blended,
            moves: (0..KEPT).map(|_| empty()).collect(),
            calculated: 0,
            begun: 0,
            closed: false,
            stop: (0, 0),
            stop_begin: 0,
            stopping: false,
            time: 0,
            member: vec![false; motors],
            start: vec![0.0; motors],
            bounds: [0; 4],
            phase: 0,
            phases: 0,
            pieces: vec![[[0.0; 4]; 4]; motors],
            next_piece: 0,
            next_begin: 0,
            segments: Segments { points: vec![[0.0; 4]; motors], ..Segments::default() },
        }
    }

    /// Whether the state fits a number of motors.
    pub(crate) fn fits(&self, motors: usize) -> bool {
        self.moves.len() == KEPT as usize
            && self.moves.iter().all(|m| [&m.p, &m.d, &m.v].iter().all(|v| v.len() == motors))
            && self.member.len() == motors
            && self.start.len() == motors
            && self.pieces.len() == motors
            && self.segments.points.len() == motors
            && self.segments.length >= 0
            && self.phase < 4
            && self.phases <= 4
            && self.begun <= self.calculated
    }

    /// Move k, from 1.
    pub(crate) fn at(&self, k: u32) -> &Move {
        &self.moves[(k % KEPT) as usize]
    }

    pub(crate) fn at_mut(&mut self, k: u32) -> &mut Move {
        &mut self.moves[(k % KEPT) as usize]
    }

    /// The last move that was calculated.
    pub(crate) fn last(&self) -> &Move {
        self.at(self.calculated)
    }

    /// The end of the last move of a motor that takes part.
    pub(crate) fn goal(&self, motor: usize) -> Option<f64> {
        if self.progress == Progress::None || !self.member[motor] {
            return None;
        }
        Some(if self.calculated == 0 { self.start[motor] } else { self.last().p[motor] })
    }

    /// Begins an empty sequence.
    pub(crate) fn open(&mut self, kind: SequenceKind) {
        self.progress = Progress::Gathering;
        self.kind = kind;
        (self.next_piece, self.next_begin) = (0, 0);
        self.calculated = 0;
        self.begun = 0;
        self.closed = false;
        self.stopping = false;
        self.time = 0;
        self.phases = 0;
        self.phase = 0;
        self.member.fill(false);
    }

    /// Forgets all of it.
    pub(crate) fn clear(&mut self) {
        self.progress = Progress::None;
        self.member.fill(false);
    }

    pub(crate) fn runs(&self) -> bool {
        self.progress == Progress::Running
    }

    /// The corner in front of move k.
    pub(crate) fn corner_before(&self, k: u32) -> i64 {
        match k {
            0 | 1 => self.at(1).ta / 2,
            _ => self.at(k - 1).corner,
        }
    }

    /// Sets the times of move k after its TA, TS and TM.
    pub(crate) fn place(&mut self, k: u32) {
        let before = self.corner_before(k);
        let this = self.at_mut(k);
        this.corner = before.saturating_add(this.tm);
        this.begin = before - this.ta / 2;
    }

    /// Whether the moves that were calculated are as many as have begun.
    pub(crate) fn is_at_its_last(&self) -> bool {
        self.begun == self.calculated
    }

    /// The time up to which its course is fixed.
    pub(crate) fn now(&self) -> i64 {
        match self.kind {
            SequenceKind::Segmented => self.segments.taken,
            _ => self.time,
        }
    }

    /// Closes the sequence by a stop with these times.
    pub(crate) fn close(&mut self, stop: (i64, i64)) {
        self.closed = true;
        self.stop = stop;
        self.stop_begin = self.last().corner - stop.0 / 2;
    }

    /// Lets a time pass for moves that blend, without segments.
    pub(crate) fn advance_blended(&mut self) -> Advance {
        let mut advance = Advance::default();
        loop {
            if self.stopping {
                advance.over = self.time >= self.stop_begin.saturating_add(self.stop.0);
                break;
            }
            if self.begun < self.calculated && self.time >= self.at(self.begun + 1).begin {
                self.begun += 1;
                advance.begun += 1;
                self.begin_move(self.begun);
            } else if self.closed && self.is_at_its_last() && self.time >= self.stop_begin {
                self.begin_stop();
            } else {
                break;
            }
        }
        while self.phase + 1 < self.phases && self.time >= self.bounds[self.phase + 1] {
            self.phase += 1;
        }
        advance
    }

    /// The position of each motor that takes part now, by index.
    pub(crate) fn positions(&self, mut put: impl FnMut(usize, f64)) {
        if self.phases == 0 {
            return self.members().for_each(|motor| put(motor, self.start[motor]));
        }
        let t = ms(self.time - self.bounds[self.phase]);
        for (motor, (pieces, _)) in
            self.pieces.iter().zip(&self.member).enumerate().filter(|(_, (_, member))| **member)
        {
            put(motor, position(&pieces[self.phase], t));
        }
    }

    /// The end of the last move of each motor that takes part, by index.
    pub(crate) fn goals(&self, mut put: impl FnMut(usize, f64)) {
        let last = self.last();
        self.members().for_each(|motor| put(motor, last.p[motor]));
    }

    /// The indices of the motors that take part.
    fn members(&self) -> impl Iterator<Item = usize> + '_ {
        self.member.iter().enumerate().filter(|(_, member)| **member).map(|(motor, _)| motor)
    }

    /// The position of a motor now.
    pub(crate) fn position(&self, motor: usize) -> f64 {
        if self.phases == 0 {
            return self.start[motor];
        }
        let t = ms(self.time - self.bounds[self.phase]);
        position(&self.pieces[motor][self.phase], t)
    }

    /// The velocity of a motor now, in counts/ms of the system's time.
    pub(crate) fn velocity(&self, motor: usize) -> f64 {
        if !self.runs() || self.phases == 0 || !self.member[motor] {
            return 0.0;
        }
        let t = ms(self.time - self.bounds[self.phase]);
        velocity(&self.pieces[motor][self.phase], t)
    }
}
