//! `/` and `\\`: how a program with segmented moves (I13) is halted so that R goes on in it (guide, appendix C).

use plcc_abi::pmac::motion::AxisSet;
use serde::{Deserialize, Serialize};

use crate::circle::Arc;
use crate::events::{Reason, State};
use crate::machine::Machine;
use crate::moves::{Shape, Words};
use crate::sequence::SequenceKind;
use crate::system::System;

/// A move that was calculated and not begun when `/` came.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Kept {
    named: AxisSet,
    from: [f64; 9],
    to: [f64; 9],
    arc: Option<Arc>,
    /// The time that its words ask for, in ms.
    time: f64,
    number: u64,
    line: (u32, u32),
}

/// How far the halt by `\\` has come.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Pause {
    /// There is none.
    #[default]
    None,
    /// The time base goes to 0.
    Slowing,
    /// The program has stopped in its move; whether a calculation was wanted then.
    Stopped(bool),
    /// R has ended it, and the time base comes back.
    Returning,
}

impl System {
    /// Whether the moves stand still after `\\`.
    pub(crate) fn is_paused(&self) -> bool {
        matches!(self.pause, Pause::Stopped(_))
    }
}

impl Machine<'_> {
    /// `/`: as Q; of segmented moves the one that is being made is the last, and the next stays calculated for R.
    pub(crate) fn halt(&mut self, system: usize) {
        let this = &mut self.state.systems[system];
        let sequence = &mut this.sequence;
        if this.running
            && sequence.runs()
            && sequence.kind == SequenceKind::Segmented
            && !sequence.closed
        {
            // What the points that were taken lie on has begun.
            let now = sequence.now();
            let begun = |k: u32, sequence: &crate::sequence::Sequence| {
                k <= sequence.begun || sequence.at(k).begin < now
            };
            let last = (1..=sequence.calculated).rev().find(|&k| begun(k, sequence)).unwrap_or(1);
            for k in last + 1..=sequence.calculated {
                let this_move = sequence.at(k);
                this.kept.push(Kept {
                    named: this_move.axes,
                    from: this_move.from,
                    to: this_move.to,
                    arc: this_move.arc,
                    time: this_move.time,
                    number: this_move.number,
                    line: this_move.line,
                });
            }
            sequence.calculated = last;
        }
        self.quit(system, Reason::Quit);
    }

    /// Goes on with the moves that `/` has kept. Says whether the calculation is over by that.
    pub(crate) fn go_on_with_kept(&mut self, system: usize) -> bool {
        let mut over = false;
        while !over && let Some(kept) = self.state.systems[system].kept.first().copied() {
            let this = &mut self.state.systems[system];
            this.kept.remove(0);
            this.axes = kept.to;
            this.next_move = kept.number;
            this.last = kept.line;
            let words = Words::between(kept.named, kept.from);
            let shape = Shape { time: Some(kept.time), arc: kept.arc };
            over = self.linear_move(system, &words, shape);
        }
        over
    }

    /// `\\`: segmented moves come to a halt by I52; all else is held as by H.
    pub(crate) fn hold_program(&mut self, system: usize) {
        let this = &mut self.state.systems[system];
        let segmented = this.sequence.runs() && this.sequence.kind == SequenceKind::Segmented;
        if this.running && segmented && this.pause == Pause::None && !this.held {
            this.pause = Pause::Slowing;
        }
        if !this.is_paused() {
            self.hold(system);
        }
    }

    /// How fast the time base goes to a hold and back: by I52 for `\\`, by Ix95 for H, and by that on a Turbo PMAC, whose I52 is
    /// something else.
    pub(crate) fn hold_rate(&self, system: usize) -> f64 {
        match self.state.systems[system].pause {
            Pause::Slowing | Pause::Returning if !self.turbo() => self.i(52),
            _ => self.system_i(system, 95),
        }
    }

    /// The time base has reached its goal.
    pub(crate) fn base_reached(&mut self, system: usize) {
        let number = self.program_number(system);
        let this = &mut self.state.systems[system];
        match this.pause {
            Pause::Slowing if this.held => {
                let wanted = this.flag;
                (this.held, this.returning) = (false, false);
                this.pause = Pause::Stopped(wanted);
                self.program_over(system, number, State::Stopped, Some(Reason::ProgramHold));
            }
            Pause::Slowing | Pause::Returning => this.pause = Pause::None,
            Pause::None | Pause::Stopped(_) => {}
        }
    }

    /// Whether a motor is not where `\\` has left it.
    pub(crate) fn is_elsewhere(&self, motor: usize) -> bool {
        self.system_of(motor).is_some_and(|system| {
            let system = &self.state.systems[system];
            let sequence = &system.sequence;
            system.is_paused()
                && sequence.member[motor]
                && sequence.position(motor) != self.state.motors[motor].commanded
        })
    }

    /// R or S after `\\`: the moves go on where they stood.
    pub(crate) fn resume(&mut self, system: usize, wanted: bool, step: bool) {
        let this = &mut self.state.systems[system];
        (this.running, this.flag, this.step) = (true, wanted, step);
        this.base = 0;
        this.returning = true;
        this.pause = Pause::Returning;
        self.announce_start(system);
    }
}
