//! A sequence of LINEAR moves that blend into each other (guide, Linear Blended Moves).
//!
//! Times count from the sequence's start. Move k has its corner, where two lines would meet without blending, at
//! `corner`; it begins half its acceleration time before the corner of the move in front of it.

use serde::{Deserialize, Serialize};

use crate::units::{ms, position, ramp, velocity};

/// How many moves are kept: the one before the present one, which it blends with, the present one and two more.
const KEPT: u32 = 4;

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
}

/// A sequence of moves.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Sequence {
    pub(crate) progress: Progress,
    moves: Vec<Move>,
    /// How many moves were calculated and how many have begun.
    pub(crate) calculated: u32,
    pub(crate) begun: u32,
    /// Whether its last move ends in a stop.
    pub(crate) closed: bool,
    /// The times of the stop.
    stop: (i64, i64),
    stop_begin: i64,
    stopping: bool,
    pub(crate) time: i64,
    /// For each motor whether it takes part, and where it was at the start.
    pub(crate) member: Vec<bool>,
    pub(crate) start: Vec<f64>,
    /// When the present pieces began; the phase that runs, and how many there are.
    bounds: [i64; 4],
    phase: usize,
    phases: usize,
    /// The present pieces of each motor.
    pieces: Vec<[[f64; 4]; 4]>,
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
        }
    }

    /// Whether the state fits a number of motors.
    pub(crate) fn fits(&self, motors: usize) -> bool {
        self.moves.len() == KEPT as usize
            && self.moves.iter().all(|m| [&m.p, &m.d, &m.v].iter().all(|v| v.len() == motors))
            && self.member.len() == motors
            && self.start.len() == motors
            && self.pieces.len() == motors
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
    pub(crate) fn open(&mut self) {
        self.progress = Progress::Gathering;
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

    /// Closes the sequence by a stop with these times.
    pub(crate) fn close(&mut self, stop: (i64, i64)) {
        self.closed = true;
        self.stop = stop;
        self.stop_begin = self.last().corner - stop.0 / 2;
    }

    /// Lets a time pass.
    pub(crate) fn advance(&mut self, by: i64) -> Advance {
        self.time = self.time.saturating_add(by);
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

    fn begin_move(&mut self, k: u32) {
        let Self { moves, member, start, pieces, bounds, .. } = self;
        let this = &moves[(k % KEPT) as usize];
        let before = (k > 1).then(|| &moves[((k - 1) % KEPT) as usize]);
        self.phases = phase_bounds(bounds, this.begin, (this.ta, this.ts));
        bounds[self.phases] = this.begin + this.ta;
        self.phase = 0;
        let half = ms(this.ta / 2);
        let left = ms(this.corner - (this.begin + this.ta));
        for (motor, pieces) in pieces.iter_mut().enumerate().filter(|(motor, _)| member[*motor]) {
            let (p0, v0) = before.map_or((start[motor], 0.0), |m| (m.p[motor], m.v[motor]));
            let v = this.v[motor];
            let mut at = 0;
            ramp(p0 - v0 * half, v0, v, (this.ta, this.ts), |_, a| {
                pieces[at] = a;
                at += 1;
            });
            pieces[at] = [this.p[motor] - v * left, v, 0.0, 0.0];
        }
        self.phases += 1;
    }

    fn begin_stop(&mut self) {
        self.stopping = true;
        let Self { moves, member, pieces, bounds, stop, stop_begin, calculated, .. } = self;
        let this = &moves[(*calculated % KEPT) as usize];
        self.phases = phase_bounds(bounds, *stop_begin, *stop);
        self.phase = 0;
        let half = ms(stop.0 / 2);
        for (motor, pieces) in pieces.iter_mut().enumerate().filter(|(motor, _)| member[*motor]) {
            let (p, v) = (this.p[motor], this.v[motor]);
            let mut at = 0;
            ramp(p - v * half, v, 0.0, *stop, |_, a| {
                pieces[at] = a;
                at += 1;
            });
        }
    }

    /// The position of a motor now.
    pub(crate) fn position(&self, motor: usize) -> f64 {
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

/// When the pieces of a ramp begin; gives how many there are.
fn phase_bounds(bounds: &mut [i64; 4], begin: i64, (ta, ts): (i64, i64)) -> usize {
    let mut at = 0;
    let mut next = begin;
    for duration in [ts, ta - 2 * ts, ts] {
        if duration > 0 {
            bounds[at] = next;
            at += 1;
            next = next.saturating_add(duration);
        }
    }
    at
}
