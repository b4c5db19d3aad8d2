//! LINEAR and CIRCLE moves that are cut into segments (I13; guide, Circular Interpolation): points of the path, one a
//! segment, and splines between them.

use plcc_abi::pmac::motion::{Axis, AxisSet};

use crate::machine::Machine;
use crate::pieces::{between, waypoint};
use crate::sequence::{Advance, Move, Sequence};
use crate::system::Wait;
use crate::units::{ms, ramp};

/// The position of a ramp after a time.
fn on_ramp(p0: f64, v0: f64, v1: f64, times: (i64, i64), time: i64) -> f64 {
    let (mut left, mut found, mut last) = (time, None, p0);
    ramp(p0, v0, v1, times, |duration, a| {
        let at = |t: f64| ((a[3] * t + a[2]) * t + a[1]) * t + a[0];
        if found.is_none() && left < duration {
            found = Some(at(ms(left)));
        }
        left -= duration;
        last = at(ms(duration));
    });
    found.unwrap_or(last)
}

impl Move {
    /// The place on its path after a part of it, from 0 to 1.
    fn place(&self, axis: usize, s: f64) -> f64 {
        if let Some(arc) = &self.arc {
            let ([first, second], at) = (arc.plane(), arc.at(s));
            if axis == first {
                return at[0];
            }
            if axis == second {
                return at[1];
            }
        }
        self.from[axis] + (self.to[axis] - self.from[axis]) * s
    }

    /// How far it has come at a part of it from its beginning.
    fn way(&self, axis: usize, s: f64) -> f64 {
        self.place(axis, s) - self.place(axis, 0.0)
    }
}

impl Sequence {
    /// When move k begins to give way to what follows it, and the times of that; `None` where that is not calculated.
    fn leaves(&self, k: u32) -> Option<(i64, (i64, i64))> {
        if k < self.calculated {
            let next = self.at(k + 1);
            return Some((next.begin, (next.ta, next.ts)));
        }
        self.closed.then_some((self.stop_begin, self.stop))
    }

    /// The part of move k that is done at a time.
    fn progress_of(&self, k: u32, time: i64) -> f64 {
        let this = self.at(k);
        let v = 1.0 / ms(this.tm);
        if time < this.begin + this.ta {
            return on_ramp(0.0, 0.0, v, (this.ta, this.ts), time - this.begin);
        }
        if let Some((begin, times)) = self.leaves(k)
            && time >= begin
        {
            if time >= begin + times.0 {
                return 1.0;
            }
            return on_ramp(1.0 - v * ms(times.0 / 2), v, 0.0, times, time - begin);
        }
        let since = ms(time - (this.begin + this.ta));
        v * since + (1.0 - v * ms(this.corner - (this.begin + this.ta)))
    }

    /// The time of its end; `None` while it is open.
    fn end(&self) -> Option<i64> {
        self.closed.then(|| self.stop_begin + self.stop.0)
    }

    /// Where the axes are at a time, which does not go back.
    fn axes_at(&mut self, time: i64) -> [f64; 9] {
        while self.segments.done < self.calculated
            && let Some((begin, times)) = self.leaves(self.segments.done + 1)
            && time >= begin + times.0
        {
            self.segments.done += 1;
            let this = self.at(self.segments.done);
            let axes = std::array::from_fn(|axis| self.segments.axes[axis] + this.way(axis, 1.0));
            let named = this.axes;
            self.segments.axes = axes;
            self.segments.named = self.segments.named.and(named);
        }
        let mut axes = self.segments.axes;
        for k in self.segments.done + 1..=self.calculated {
            let this = self.at(k);
            if this.begin > time {
                break;
            }
            let s = self.progress_of(k, time);
            for axis in Axis::ALL {
                axes[axis as usize] += self.at(k).way(axis as usize, s);
            }
            self.segments.named = self.segments.named.and(self.at(k).axes);
        }
        axes
    }

    /// Opens the segmentation at the beginning of the first move.
    pub(crate) fn open_segments(&mut self, length: f64, axes: [f64; 9]) {
        let segments = &mut self.segments;
        segments.ms = length;
        segments.length = crate::units::units(length).max(1);
        (segments.taken, segments.last, segments.done) = (0, None, 0);
        (segments.axes, segments.named) = (axes, AxisSet::NONE);
    }
}

impl Machine<'_> {
    /// Takes all segments that are over.
    pub(crate) fn advance_segments(&mut self, system: usize) -> Advance {
        let mut advance = Advance::default();
        loop {
            let sequence = &mut self.state.systems[system].sequence;
            let begin = sequence.next_begin;
            if sequence.time < begin {
                break;
            }
            let j = sequence.next_piece;
            if sequence.segments.last.is_some_and(|last| j > last + 1) {
                advance.over = true;
                break;
            }
            while sequence.begun < sequence.calculated
                && sequence.at(sequence.begun + 1).begin <= begin
            {
                sequence.begun += 1;
                advance.begun += 1;
            }
            let point = begin.saturating_add(sequence.segments.length);
            if self.is_beyond(system, point, advance.begun > 0) {
                self.state.systems[system].sequence.time = begin;
                advance.late = true;
                break;
            }
            self.take_point(system, j, point);
            // A kinematic program has not ended.
            if !self.state.systems[system].sequence.runs() {
                break;
            }
        }
        advance
    }

    /// Whether a point lies beyond the beginning of the stop that the sequence would have to make now, since the next move
    /// was not calculated.
    fn is_beyond(&mut self, system: usize, point: i64, begins: bool) -> bool {
        let this = &self.state.systems[system];
        let waits = this.wait == Wait::None && this.running && (this.flag || begins);
        if this.sequence.closed || !waits {
            return false;
        }
        let stop = self.stop_times(system);
        point > self.state.systems[system].sequence.last().corner - stop.0 / 2
    }

    /// Takes the point at the end of segment j, and makes the piece of that segment.
    fn take_point(&mut self, system: usize, j: u32, point: i64) {
        let sequence = &mut self.state.systems[system].sequence;
        let at_end = sequence.end().is_some_and(|end| point >= end);
        let axes = sequence.axes_at(point);
        if at_end && sequence.segments.last.is_none() {
            sequence.segments.last = Some(j + 1);
        }
        let is_last = sequence.segments.last.is_some_and(|last| j == last + 1);
        sequence.segments.taken = point;
        let (length, time) = (sequence.segments.length, sequence.segments.ms);
        let named = sequence.segments.named;
        let kinematic = named != AxisSet::NONE && self.inverse(system, &axes, None);
        let sequence = &mut self.state.systems[system].sequence;
        if !sequence.runs() {
            return;
        }
        sequence.begin_piece(length);
        sequence.next_piece += 1;
        let base = self.look().base_axes(system, &axes);
        for motor in 0..self.motor_count() {
            let sequence = &self.state.systems[system].sequence;
            if !sequence.member[motor] {
                continue;
            }
            let (start, mut end) = (sequence.start[motor], sequence.last().p[motor]);
            let kinematic = kinematic && self.state.is_kinematic(motor);
            if kinematic && at_end {
                // The goal is known only now.
                end = plcc_abi::pmac::arithmetic::finite(self.kinematic_position(motor));
                let sequence = &mut self.state.systems[system].sequence;
                let last = sequence.calculated;
                sequence.at_mut(last).p[motor] = end;
            }
            let new = match at_end {
                true => end,
                false if kinematic => self.kinematic_position(motor),
                false => {
                    let target = self.look().moved_target(system, motor, named, (&base, &axes));
                    target.unwrap_or(start)
                }
            };
            let sequence = &mut self.state.systems[system].sequence;
            let points = &mut sequence.segments.points[motor];
            if j == 0 {
                *points = [start; 4];
            }
            *points = [points[1], points[2], points[3], new];
            let [a, b, c, d] = *points;
            let from = if j == 0 { (start, 0.0) } else { waypoint(a, b, c, time) };
            let to = if is_last { (end, 0.0) } else { waypoint(b, c, d, time) };
            sequence.pieces[motor][0] = between(from, to, ms(length));
        }
    }
}
