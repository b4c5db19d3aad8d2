//! LINEAR moves that blend into each other (guide, Linear Blended Moves).

use crate::sequence::{KEPT, Sequence};
use crate::units::{ms, ramp};

impl Sequence {
    pub(super) fn begin_move(&mut self, k: u32) {
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

    pub(super) fn begin_stop(&mut self) {
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
