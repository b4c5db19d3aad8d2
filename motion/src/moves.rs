//! The calculation of moves: LINEAR and CIRCLE (guide, Linear Blended Moves), PVT, SPLINE, and RAPID.

use plcc_abi::pmac::arithmetic::finite;
use plcc_abi::pmac::motion::{Axis, AxisSet, Mode, MoveWord};

use crate::circle::Arc;
use crate::machine::Machine;
use crate::motor::{Start, Waiting};
use crate::sequence::{Progress, SequenceKind};
use crate::status::Latch;
use crate::system::Wait;
use crate::units::{ms, rnd, units};

/// What the words of a move say.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Words {
    pub(crate) axes: AxisSet,
    /// Where the axes were.
    pub(crate) from: [f64; 9],
    /// For each axis the new target less the old one.
    distance: [f64; 9],
    /// How far behind their triggers axes end, in user units.
    triggers: [Option<f64>; 9],
    /// In PVT the velocities at the end, in user units per Ix90.
    pub(crate) velocities: [f64; 9],
    /// The radius of an arc, and the components of the vector to its centre.
    pub(crate) radius: Option<f64>,
    pub(crate) center: [Option<f64>; 3],
}

impl Words {
    /// The words of a move whose time is known and whose targets are set.
    pub(crate) fn between(axes: AxisSet, from: [f64; 9]) -> Self {
        Self {
            axes,
            from,
            distance: [0.0; 9],
            triggers: [None; 9],
            velocities: [0.0; 9],
            radius: None,
            center: [None; 3],
        }
    }
}

/// What a LINEAR or CIRCLE move is asked to be.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Shape {
    /// The time of a DELAY in ms.
    pub(crate) time: Option<f64>,
    pub(crate) arc: Option<Arc>,
}

impl Machine<'_> {
    /// Sets the axes' targets by the words of a move.
    pub(crate) fn take_words(
        &mut self,
        system: usize,
        words: &[MoveWord],
        values: &[f64],
    ) -> Words {
        if self.state.systems[system].rematch {
            self.match_axes(system);
        }
        let mut out = Words::between(AxisSet::NONE, self.state.systems[system].axes);
        for (word, &value) in words.iter().zip(values) {
            match *word {
                MoveWord::Axis(axis) => {
                    let this = &self.state.systems[system];
                    let old = this.axes[axis as usize];
                    let new = match this.modes.incremental.has(axis) {
                        true => old + value,
                        false => self.shortest_way(system, axis, old, value),
                    };
                    let this = &mut self.state.systems[system];
                    let new = finite(new);
                    this.axes[axis as usize] = new;
                    out.axes = out.axes.with(axis);
                    out.distance[axis as usize] = new - old;
                    self.show_axis(system, axis);
                }
                MoveWord::Trigger(axis) => out.triggers[axis as usize] = Some(value),
                MoveWord::Velocity(axis) => out.velocities[axis as usize] = value,
                MoveWord::R => out.radius = Some(value),
                MoveWord::Center(component) => {
                    out.center[usize::from(component.min(2))] = Some(value);
                }
            }
        }
        out
    }

    /// The words of a move without axes: DELAY.
    pub(crate) fn no_words(&mut self, system: usize) -> Words {
        self.take_words(system, &[], &[])
    }

    /// Where an axis goes in absolute mode: A, B and C whose motor's Ix27 is above 0 the shortest way round.
    fn shortest_way(&self, system: usize, axis: Axis, old: f64, value: f64) -> f64 {
        if !matches!(axis, Axis::A | Axis::B | Axis::C) {
            return value;
        }
        let found = self.motors_of(system).find_map(|motor| {
            let (scale, round) = (self.scale(motor, axis), self.motor_i(motor, 27));
            (scale != 0.0 && round > 0.0).then_some(round / scale.abs())
        });
        let Some(round) = found else { return value };
        let turns = ((value - old) / round).round();
        value - turns * round
    }

    /// Whether Ix16 and Ix17 hold for LINEAR and CIRCLE: not with segmentation (I13, Isx13), unless Turbo PMAC looks
    /// ahead.
    fn has_limits(&self, system: usize) -> bool {
        self.segmentation(system) <= 0.0 || self.looks_ahead(system)
    }

    fn looks_ahead(&self, system: usize) -> bool {
        self.turbo() && self.system_i(system, 20) > 0.0
    }

    /// How many moves a sequence needs before it begins, unless it is closed.
    pub(crate) fn ahead(&self, system: usize) -> u32 {
        match self.state.systems[system].sequence.kind {
            SequenceKind::Blended | SequenceKind::Spline1 | SequenceKind::Spline2 => 2,
            SequenceKind::Segmented if self.looks_ahead(system) => 2,
            SequenceKind::Segmented | SequenceKind::Pvt => 1,
        }
    }

    /// The kind of sequence that moves of the present mode make; `None` where they make none.
    pub(crate) fn kind_of_moves(&self, system: usize) -> Option<SequenceKind> {
        Some(match self.state.systems[system].mode {
            Mode::Linear | Mode::Circle1 | Mode::Circle2 => self.kind_of_lines(system),
            Mode::Pvt => SequenceKind::Pvt,
            Mode::Spline1 => SequenceKind::Spline1,
            Mode::Spline2 => SequenceKind::Spline2,
            Mode::Rapid => return None,
        })
    }

    /// The kind of sequence that LINEAR and CIRCLE moves make.
    pub(crate) fn kind_of_lines(&self, system: usize) -> SequenceKind {
        match self.segmentation(system) > 0.0 {
            true => SequenceKind::Segmented,
            false => SequenceKind::Blended,
        }
    }

    /// The acceleration that the I-variables ask for: its time and the S-curve's half, in ms. `room` is what the move
    /// in front leaves for it.
    fn acceleration(&self, system: usize, room: Option<f64>) -> (f64, f64) {
        let (ta, ts) = (self.system_i(system, 87), self.system_i(system, 88));
        let ta = ta.max(2.0 * ts);
        let ta = if ta == 0.0 { 0.5 } else { ta };
        let ts = ts.min(ta / 2.0);
        match room {
            Some(room) if ta > room => (room, ts.min(room / 2.0)),
            _ => (ta, ts),
        }
    }

    /// The times of the stop of a sequence, if it is closed now.
    pub(crate) fn stop_times(&mut self, system: usize) -> (i64, i64) {
        let sequence = &self.state.systems[system].sequence;
        // The program may have changed I13 since the moves were calculated.
        let limits = sequence.kind == SequenceKind::Blended || self.looks_ahead(system);
        let last = sequence.last();
        let room = 2 * last.tm - last.ta;
        let (ta, ts) = self.acceleration(system, Some(ms(room)));
        let rho = ta / (ta - ts);
        let mut n = ta;
        if limits {
            for motor in 0..self.motor_count() {
                if let Some(limit) = self.limit_of(system, motor, 17) {
                    let last = self.state.systems[system].sequence.last();
                    n = n.max(rho * last.v[motor].abs() / limit);
                }
            }
        }
        let ts = n * ts / ta;
        let whole = (2 * rnd(n * 8_388_608.0 / 2.0)).min(room);
        (whole, units(ts).min(whole / 2))
    }

    /// Closes the sequence of a system, if it has one that is open: its last move ends in a stop.
    pub(crate) fn close_sequence(&mut self, system: usize) {
        let sequence = &self.state.systems[system].sequence;
        if sequence.progress == Progress::None || sequence.closed {
            return;
        }
        if !sequence.kind.blends() {
            self.state.systems[system].sequence.closed = true;
            return self.start_sequence(system);
        }
        let (mut whole, mut half) = self.stop_times(system);
        let sequence = &mut self.state.systems[system].sequence;
        let corner = sequence.last().corner;
        if sequence.runs() && corner - whole / 2 < sequence.now() {
            whole = (2 * (corner - sequence.now())).max(0);
            half = half.min(whole / 2);
        }
        sequence.close((whole, half));
        self.start_sequence(system);
    }

    /// Starts a sequence that has enough moves, once the time of I11 has passed.
    pub(crate) fn start_sequence(&mut self, system: usize) {
        let sequence = &self.state.systems[system].sequence;
        if sequence.progress != Progress::Gathering
            || !sequence.closed && sequence.calculated < self.ahead(system)
        {
            return;
        }
        let delay = units(self.i(11));
        let this = &mut self.state.systems[system];
        if this.since_break >= delay {
            this.sequence.progress = Progress::Running;
        }
    }

    /// The limit of a motor that is in a sequence: Ix16 or Ix17. Those that are not above 0 are none.
    fn limit_of(&self, system: usize, motor: usize, number: u32) -> Option<f64> {
        if !self.state.systems[system].sequence.member[motor] {
            return None;
        }
        Some(self.motor_i(motor, number)).filter(|limit| *limit > 0.0)
    }

    /// Begins the calculation of a move of a sequence, with its targets. Gives its number in the sequence.
    pub(crate) fn open_move(&mut self, system: usize, words: &Words, kind: SequenceKind) -> u32 {
        if self.state.systems[system].sequence.progress == Progress::None {
            self.state.systems[system].sequence.open(kind);
            if kind == SequenceKind::Segmented {
                let length = self.segmentation(system);
                self.state.systems[system].sequence.open_segments(length, words.from);
            }
        }
        let this = &mut self.state.systems[system];
        let number = this.next_move;
        this.next_move += 1;
        let (axes, line) = (this.axes, this.last);
        let k = this.sequence.calculated + 1;
        self.move_targets(system, words, &axes, k, kind);
        let moved = self.look().moved_axes(system, words.axes);
        let this = self.state.systems[system].sequence.at_mut(k);
        (this.number, this.line) = (number, line);
        (this.from, this.to, this.axes, this.arc) = (words.from, axes, moved, None);
        k
    }

    /// The move k is calculated: the targets of its motors are shown.
    pub(crate) fn show_targets(&mut self, system: usize, k: u32) {
        self.state.systems[system].sequence.calculated = k;
        for motor in 0..self.motor_count() {
            let sequence = &self.state.systems[system].sequence;
            if sequence.member[motor] {
                self.state.motors[motor].target = sequence.last().p[motor];
                self.show_target(motor);
            }
        }
    }

    /// Calculates a LINEAR or CIRCLE move.
    pub(crate) fn linear(&mut self, system: usize, words: &Words, shape: Shape) {
        let kind = self.kind_of_lines(system);
        let limits = self.has_limits(system);
        let k = self.open_move(system, words, kind);
        self.state.systems[system].sequence.at_mut(k).arc = shape.arc;
        let room = (k > 1).then(|| {
            let before = self.state.systems[system].sequence.at(k - 1);
            ms(2 * before.tm - before.ta)
        });
        let (mut ta, mut ts) = self.acceleration(system, room);
        let asked = shape.time.unwrap_or_else(|| self.move_time(system, words, shape.arc));
        let mut t = asked.min(8_388_607.0).max(ta);
        let rho = ta / (ta - ts);
        if limits {
            let way =
                |this: &Self, motor: usize| this.state.systems[system].sequence.at(k).d[motor];
            for motor in 0..self.motor_count() {
                if let Some(limit) = self.limit_of(system, motor, 16) {
                    t = t.max(way(self, motor).abs() / limit);
                }
            }
            for motor in 0..self.motor_count() {
                if let Some(limit) = self.limit_of(system, motor, 17) {
                    t = t.max((rho * way(self, motor).abs() / limit).sqrt());
                }
            }
            let mut n = ta;
            for motor in 0..self.motor_count() {
                if let Some(limit) = self.limit_of(system, motor, 17) {
                    let w = way(self, motor) / t;
                    let sequence = &self.state.systems[system].sequence;
                    let u = if k > 1 { sequence.at(k - 1).v[motor] } else { 0.0 };
                    n = n.max(rho * w.abs() / limit).max(rho * (w - u).abs() / limit);
                }
            }
            ts = n * ts / ta;
            ta = n;
        }
        t = t.max(ta);
        let mut whole = 2 * rnd(ta * 8_388_608.0 / 2.0);
        let mut half = units(ts).min(whole / 2);
        let tm = units(t).max(whole);
        let sequence = &mut self.state.systems[system].sequence;
        if k > 1 {
            let (before_ta, before_tm) = (sequence.at(k - 1).ta, sequence.at(k - 1).tm);
            if whole > 2 * before_tm - before_ta {
                if sequence.begun < k - 1 && sequence.at(k - 1).begin >= sequence.now() {
                    let before = sequence.at_mut(k - 1);
                    before.tm = (before_ta + whole) / 2;
                    for motor in 0..before.d.len() {
                        before.v[motor] = before.d[motor] / ms(before.tm);
                    }
                    sequence.place(k - 1);
                } else {
                    whole = 2 * before_tm - before_ta;
                    half = half.min(whole / 2);
                }
            }
            let corner = sequence.corner_before(k);
            if sequence.runs() && corner - whole / 2 < sequence.now() {
                whole = (2 * (corner - sequence.now())).max(0);
                half = half.min(whole / 2);
            }
        }
        let this = sequence.at_mut(k);
        (this.ta, this.ts, this.tm, this.time) = (whole, half, tm, asked);
        for motor in 0..this.d.len() {
            this.v[motor] = this.d[motor] / ms(tm);
        }
        sequence.place(k);
        self.show_targets(system, k);
    }

    /// The positions at the end of move k and the ways to them.
    fn move_targets(
        &mut self,
        system: usize,
        words: &Words,
        axes: &[f64; 9],
        k: u32,
        kind: SequenceKind,
    ) {
        let moved = self.look().moved_axes(system, words.axes);
        // With segmentation the points of the path are what the motors follow.
        let velocities = Some(&words.velocities).filter(|_| kind == SequenceKind::Pvt);
        let kinematic = kind != SequenceKind::Segmented
            && moved != AxisSet::NONE
            && self.inverse(system, axes, velocities);
        let base = self.look().base_axes(system, axes);
        for motor in 0..self.motor_count() {
            let own = self.system_of(motor) == Some(system) && self.state.motors[motor].active;
            let commanded = self.state.motors[motor].commanded;
            let sequence = &mut self.state.systems[system].sequence;
            if own && !sequence.member[motor] {
                sequence.member[motor] = true;
                sequence.start[motor] = commanded;
                if k > 1 {
                    let before = sequence.at_mut(k - 1);
                    (before.p[motor], before.d[motor], before.v[motor]) = (commanded, 0.0, 0.0);
                }
            }
            let sequence = &self.state.systems[system].sequence;
            let last = if k > 1 { sequence.at(k - 1).p[motor] } else { sequence.start[motor] };
            let target = if own && kinematic && self.state.is_kinematic(motor) {
                self.kinematic_position(motor)
            } else if own {
                let target = self.look().moved_target(system, motor, moved, (&base, axes));
                target.unwrap_or(last)
            } else {
                last
            };
            let this = self.state.systems[system].sequence.at_mut(k);
            this.p[motor] = finite(target);
            this.d[motor] = this.p[motor] - last;
        }
    }

    /// The time that a move's words and modes ask for, in ms.
    fn move_time(&self, system: usize, words: &Words, arc: Option<Arc>) -> f64 {
        let value = self.system_i(system, 89);
        if self.state.systems[system].by_time {
            return value;
        }
        let feedrate_axes = self.state.systems[system].modes.feedrate;
        let (mut sum, mut others) = (0.0, false);
        for axis in Axis::ALL {
            let on_arc = arc.is_some_and(|arc| arc.plane().contains(&(axis as usize)));
            if words.axes.has(axis) && feedrate_axes.has(axis) && !on_arc {
                others = true;
                let way = words.distance[axis as usize];
                sum += way * way;
            }
        }
        let highest = self.system_i(system, 98);
        let mut feed = value.abs();
        if highest > 0.0 {
            feed = feed.min(highest);
        }
        let way = match arc.map(|arc| arc.length()) {
            None => sum.sqrt(),
            Some(length) if others => (length * length + sum).sqrt(),
            Some(length) => length,
        };
        if feed == 0.0 || way == 0.0 {
            return 0.0;
        }
        way / feed * self.system_i(system, 90)
    }

    /// Calculates a RAPID move. Returns whether a motor moves.
    pub(crate) fn rapid(&mut self, system: usize, words: &Words) -> bool {
        let axes = self.state.systems[system].axes;
        let number = self.state.systems[system].next_move;
        let moved = self.look().moved_axes(system, words.axes);
        let mut ratio: f64 = 0.0;
        let kinematic = moved != AxisSet::NONE && self.inverse(system, &axes, None);
        let base = self.look().base_axes(system, &axes);
        let way = |this: &Self, motor: usize| {
            let target = if kinematic && this.state.is_kinematic(motor) {
                this.kinematic_position(motor)
            } else {
                this.look().moved_target(system, motor, moved, (&base, &axes))?
            };
            let way = target - this.state.motors[motor].commanded;
            this.state.motors[motor].active.then_some((target, way))
        };
        for motor in self.motors_of(system) {
            let Some((_, way)) = way(self, motor) else { continue };
            ratio = ratio.max(way.abs() / self.rapid_speed(motor));
        }
        if ratio == 0.0 {
            return false;
        }
        self.state.systems[system].next_move = number + 1;
        let age = self.next_age();
        for motor in self.motors_of(system) {
            let Some((target, way)) = way(self, motor) else { continue };
            if way == 0.0 {
                continue;
            }
            let trigger = Axis::ALL.into_iter().find_map(|axis| {
                let scale = self.scale(motor, axis);
                words.triggers[axis as usize].filter(|_| scale != 0.0).map(|c| c * scale)
            });
            let cycles = self.waiting_cycles(motor);
            let start = Start::Rapid(target, way.abs() / ratio, trigger);
            let this = &mut self.state.motors[motor];
            this.searching = trigger.is_some();
            this.target = target;
            this.wait(Waiting { cycles, age, start, programmed: true });
            self.show_target(motor);
            self.latch(motor, Latch::TriggerMove, trigger.is_some());
        }
        if words.triggers.iter().any(Option::is_some) {
            self.state.systems[system].rematch = true;
        }
        let this = &mut self.state.systems[system];
        this.wait = Wait::Motors;
        this.line = this.last;
        true
    }

    /// The highest speed of a motor in RAPID.
    fn rapid_speed(&self, motor: usize) -> f64 {
        let by_highest = if self.turbo() { self.motor_i(motor, 90) } else { self.i(50) };
        let speed = self.motor_i(motor, if by_highest == 1.0 { 16 } else { 22 });
        if speed <= 0.0 { 32.0 } else { speed }
    }

    /// The number of a new command.
    pub(crate) fn next_age(&mut self) -> u64 {
        self.state.age += 1;
        self.state.age
    }
}
