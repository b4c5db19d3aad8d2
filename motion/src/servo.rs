//! The servo cycle: time bases, trajectories, plant, registers, synchronous assignments.

use plcc_abi::pmac::fixed;
use plcc_abi::pmac::motion::JogGoal;
use plcc_abi::pmac::motion::SyncOp;

use crate::events::{MotionEvent, Reason};
use crate::machine::{Machine, State};
use crate::motor::{Loop, Purpose, Search, Start, Waiting};
use crate::sequence::{Advance, Progress, SequenceKind};
use crate::shape::Shape;
use crate::status::Latch;
use crate::system::{SyncAssignment, System, Wait};
use crate::units::{Row, rnd};
use crate::words::read_float;

impl Machine<'_> {
    /// The first part of a servo cycle, up to the inputs, which forces may then change.
    pub fn servo(&mut self) {
        self.state.carried_out.clear();
        if self.servo_at_rest() {
            return;
        }
        let units = self.servo_units();
        self.time_bases();
        self.activate();
        for motor in &mut self.state.motors {
            motor.before = motor.commanded;
            motor.actual_before = motor.actual;
        }
        for system in 0..self.system_count() {
            let this = &mut self.state.systems[system];
            this.since_break = this.since_break.saturating_add(this.base);
            this.due = this.due.max(this.due_next);
            if this.sequence.progress != Progress::None || this.dwells() {
                self.system_trajectory(system, units);
            }
        }
        for motor in 0..self.motor_count() {
            self.motor_trajectory(motor, units);
        }
        for system in 0..self.system_count() {
            if self.state.systems[system].wait == Wait::Motors {
                self.await_motors(system);
            }
        }
        self.plant(units);
        self.write_inputs();
    }

    /// The second part of a servo cycle.
    pub fn finish_servo(&mut self) {
        if self.finish_at_rest() {
            return;
        }
        self.read_inputs();
        for motor in 0..self.motor_count() {
            self.look_for_trigger(motor);
        }
        self.state.overlays.clear();
        self.registers();
        for system in 0..self.system_count() {
            if !self.state.systems[system].sync.is_empty() {
                self.synchronous(system);
            }
        }
        self.write_status();
        self.settle();
    }

    /// A motor that Ix00 activates later is killed; one that is no longer active stays where it is.
    fn activate(&mut self) {
        for index in 0..self.motor_count() {
            let active = self.motor_i(index, 0) != 0.0;
            let motor = &mut self.state.motors[index];
            if active != motor.active {
                motor.active = active;
                motor.kill();
            }
        }
    }

    /// Whether a motor moves in its system's sequence.
    pub(crate) fn in_sequence(&self, motor: usize) -> bool {
        self.sequence_of(motor).is_some()
    }

    /// The coordinate system whose sequence moves a motor.
    pub(crate) fn sequence_of(&self, motor: usize) -> Option<usize> {
        let systems = self.state.systems.iter();
        let moves = |s: &System| !s.is_paused() && s.sequence.runs();
        systems.into_iter().position(|s| moves(s) && s.sequence.member[motor])
    }

    fn system_trajectory(&mut self, system: usize, units: i64) {
        let this = &mut self.state.systems[system];
        if let Wait::Dwell(passed, whole) = this.wait {
            let passed = passed + units;
            this.wait = Wait::Dwell(passed, whole);
            if passed >= whole {
                this.wait = Wait::None;
                this.since_break = 0;
                this.want();
            }
        }
        if !this.sequence.runs() {
            self.start_sequence(system);
            return;
        }
        if this.is_paused() {
            return;
        }
        let base = this.base;
        this.sequence.time = this.sequence.time.saturating_add(base);
        let advance = match this.sequence.kind {
            SequenceKind::Blended => this.sequence.advance_blended(),
            SequenceKind::Segmented => self.advance_segments(system),
            _ => this.sequence.advance_pieces(),
        };
        let this = &mut self.state.systems[system];
        if advance.begun > 0 {
            let present = this.sequence.at(this.sequence.begun);
            this.due = present.number;
            this.line = present.line;
            if this.wait == Wait::None {
                this.want();
            }
            for motor in 0..self.motor_count() {
                if self.state.systems[system].sequence.member[motor] {
                    self.latch(motor, Latch::DataError, false);
                    self.latch(motor, Latch::StoppedOnLimit, false);
                }
            }
        }
        let State { motors, systems, .. } = &mut *self.state;
        let sequence = &systems[system].sequence;
        match advance.over {
            true => sequence.goals(|motor, position| motors[motor].commanded = position),
            false => sequence.positions(|motor, position| motors[motor].commanded = position),
        }
        if advance.over {
            self.end_sequence(system);
        } else {
            self.check_late(system, advance);
        }
    }

    /// A sequence has come to its stop.
    fn end_sequence(&mut self, system: usize) {
        for motor in 0..self.motor_count() {
            if self.state.systems[system].sequence.member[motor] {
                let motor = &mut self.state.motors[motor];
                motor.prejog = motor.commanded;
            }
        }
        let this = &mut self.state.systems[system];
        this.sequence.clear();
        this.line = (0, 0);
        this.since_break = 0;
        match this.wait {
            Wait::Stop => {
                this.wait = Wait::None;
                this.want();
            }
            Wait::StopAndDwell(time) => self.begin_dwell(system, time),
            Wait::None | Wait::Dwell(..) | Wait::Motors => {}
        }
    }

    /// A DWELL begins; one of no time is over at once.
    pub(crate) fn begin_dwell(&mut self, system: usize, time: i64) {
        let this = &mut self.state.systems[system];
        this.due = this.next_move.saturating_sub(1);
        if time > 0 {
            this.wait = Wait::Dwell(0, time);
        } else {
            this.wait = Wait::None;
            this.since_break = 0;
            this.want();
        }
    }

    /// The last move has to begin its stop, and the next was not calculated although no interrupt has come: a
    /// run-time error (guide, How PMAC Executes a Motion Program).
    fn check_late(&mut self, system: usize, advance: Advance) {
        let this = &self.state.systems[system];
        let sequence = &this.sequence;
        if sequence.closed || !this.flag || this.wait != Wait::None {
            return;
        }
        let late = match sequence.kind {
            SequenceKind::Blended if !sequence.is_at_its_last() => false,
            SequenceKind::Blended => {
                let stop = self.stop_times(system);
                let sequence = &self.state.systems[system].sequence;
                sequence.time >= sequence.last().corner - stop.0 / 2
            }
            _ => advance.late,
        };
        if late {
            for motor in self.motors_of(system) {
                self.latch(motor, Latch::DataError, true);
            }
            self.run_time_error(system, Reason::Late);
        }
    }

    /// Whether RAPID or HOME of a system is done.
    fn await_motors(&mut self, system: usize) {
        if self.motors_of(system).any(|motor| self.state.motors[motor].has_programmed()) {
            return;
        }
        let this = &mut self.state.systems[system];
        this.wait = Wait::None;
        this.line = (0, 0);
        this.since_break = 0;
        this.want();
    }

    /// The trajectory of a motor that is not in a sequence.
    fn motor_trajectory(&mut self, motor: usize, units: i64) {
        if self.state.motors[motor].moves() {
            let base = match self.state.motors[motor].purpose {
                Purpose::Abort => units,
                _ => self.base_of(motor),
            };
            let this = &mut self.state.motors[motor];
            let (position, over) = this.row.advance(base);
            this.commanded = position;
            if over {
                self.end_row(motor);
            }
        } else if let Loop::Open(_) = self.state.motors[motor].mode {
            let this = &mut self.state.motors[motor];
            this.commanded = this.actual;
        }
        if self.state.motors[motor].waiting.is_empty() {
            return;
        }
        for waiting in &mut self.state.motors[motor].waiting {
            waiting.cycles = waiting.cycles.saturating_sub(1);
        }
        while let Some(due) =
            self.state.motors[motor].waiting.iter().position(|waiting| waiting.cycles == 0)
        {
            let Some(waiting) = self.state.motors[motor].waiting.remove(due) else { break };
            self.begin(motor, waiting);
        }
    }

    /// A row is over.
    fn end_row(&mut self, index: usize) {
        let motor = &mut self.state.motors[index];
        let purpose = motor.purpose;
        if motor.programmed || motor.was_programmed {
            motor.prejog = motor.commanded;
        }
        motor.row = Row::default();
        (motor.programmed, motor.was_programmed) = (false, false);
        match purpose {
            Purpose::BehindHome => {
                self.events.push(MotionEvent::Home { motor: index as u32 + 1 });
            }
            Purpose::BehindTrigger => self.latch(index, Latch::TriggerMove, false),
            Purpose::Search => {
                motor.search = None;
                motor.searching = false;
            }
            Purpose::Jog | Purpose::Rapid | Purpose::Abort => {}
        }
    }

    /// The shape of a motor's own moves, as its I-variables are now.
    pub(crate) fn shape(&self, motor: usize) -> Shape {
        let i = |number| self.motor_i(motor, number);
        Shape::new(i(19), i(20), i(21))
    }

    /// A motion that has waited has its time 0.
    fn begin(&mut self, index: usize, waiting: Waiting) {
        self.latch(index, Latch::StoppedOnLimit, false);
        self.latch(index, Latch::DataError, false);
        let shape = self.shape(index);
        let speed = self.motor_i(index, 22);
        let homing = self.motor_i(index, 23);
        let variable = self.variable_jog(index);
        let motor = &mut self.state.motors[index];
        motor.waiting.retain(|other| other.age >= waiting.age);
        let (p, v0) = (motor.commanded, motor.row.velocity());
        let behind = matches!(waiting.start, Start::BehindHome | Start::BehindTrigger(..));
        if !behind {
            motor.search = None;
            motor.searching = false;
        }
        motor.row = Row::default();
        (motor.programmed, motor.was_programmed) = (waiting.programmed, false);
        motor.age = waiting.age;
        let mut row = Row::default();
        let mut goal = None;
        let mut search = None;
        motor.purpose = match waiting.start {
            Start::Jog(JogGoal::Positive, _) => {
                shape.endless(&mut row, p, v0, speed);
                Purpose::Jog
            }
            Start::Jog(JogGoal::Negative, _) => {
                shape.endless(&mut row, p, v0, -speed);
                Purpose::Jog
            }
            Start::Jog(JogGoal::Stop, _) => {
                if v0 != 0.0 {
                    let end = shape.stop(&mut row, p, v0);
                    row.end_at(end);
                }
                Purpose::Jog
            }
            Start::Jog(kind, trigger) => {
                let target = match kind {
                    JogGoal::To(c) | JogGoal::ToAndKeep(c) => c,
                    JogGoal::ToVariable => variable,
                    JogGoal::By(c) => p + c,
                    JogGoal::ByVariable => p + variable,
                    JogGoal::FromActual(c) => motor.actual + c,
                    JogGoal::FromActualVariable => motor.actual + variable,
                    _ => motor.prejog,
                };
                if let JogGoal::ToAndKeep(c) = kind {
                    motor.prejog = c;
                }
                goal = Some((target, speed.abs()));
                search = trigger.map(|offset| (false, offset, speed.abs()));
                if trigger.is_some() { Purpose::Search } else { Purpose::Jog }
            }
            Start::Home => {
                shape.endless(&mut row, p, v0, homing);
                search = Some((true, 0.0, homing.abs()));
                Purpose::Search
            }
            Start::BehindHome => {
                goal = Some((0.0, homing.abs()));
                Purpose::BehindHome
            }
            Start::BehindTrigger(target, speed) => {
                goal = Some((target, speed));
                Purpose::BehindTrigger
            }
            Start::Rapid(target, speed, trigger) => {
                goal = Some((target, speed));
                search = trigger.map(|offset| (false, offset, speed));
                if trigger.is_some() { Purpose::Search } else { Purpose::Rapid }
            }
        };
        if let Some((target, speed)) = goal {
            shape.to(&mut row, p, v0, target, speed);
            motor.target = target;
        }
        motor.row = row;
        if waiting.programmed
            && matches!(waiting.start, Start::Rapid(..))
            && let Some(definition) = motor.definition
            && let Some(system) = self.state.systems.get_mut(usize::from(definition.system) - 1)
        {
            system.due_next = system.next_move - 1;
        }
        let motor = &mut self.state.motors[index];
        if let Some((home, offset, speed)) = search {
            let (age, programmed) = (waiting.age, waiting.programmed);
            motor.search = Some(Search { home, offset, speed, age, programmed, fresh: true });
            motor.searching = true;
            motor.captured = false;
        }
        if goal.is_some() && self.state.motors[index].row.is_empty() {
            self.end_row(index);
        }
        if goal.is_some() {
            self.show_target(index);
        }
    }

    /// The value of the register for variable jogs.
    fn variable_jog(&self, motor: usize) -> f64 {
        read_float(self.memory.image, self.setup.motors[motor].variable_jog)
    }

    /// The cycles that a motor's jog waits (guide, appendix B, I12; Turbo PMAC has Ixx92).
    pub(crate) fn waiting_cycles(&self, motor: usize) -> u32 {
        let time = if self.turbo() { self.motor_i(motor, 92) } else { self.i(12) };
        let cycles = (time * 8_388_608.0 / self.servo_units() as f64).ceil();
        cycles.clamp(1.0, f64::from(u32::MAX)) as u32
    }

    /// Synchronous assignments whose move has begun in this cycle.
    pub(crate) fn synchronous(&mut self, system: usize) {
        while let Some(&next) = self.state.systems[system].sync.front()
            && next.with <= self.state.systems[system].due
        {
            self.state.systems[system].sync.pop_front();
            self.assign(next);
        }
    }

    /// Carries out a synchronous assignment: reads the variable, combines it and writes it.
    pub(crate) fn assign(&mut self, assignment: SyncAssignment) {
        let SyncAssignment { op, number, value, place, .. } = assignment;
        self.state.carried_out.note(number, place);
        let value = match op {
            SyncOp::Set => value,
            SyncOp::And | SyncOp::Or | SyncOp::Xor => {
                use plcc_abi::pmac::arithmetic;
                let old = self.memory.read_m(number);
                match op {
                    SyncOp::And => arithmetic::and(old, value),
                    SyncOp::Or => arithmetic::or(old, value),
                    _ => arithmetic::xor(old, value),
                }
            }
        };
        self.write_m(number, value);
    }

    /// The register of the target of a motor.
    pub(crate) fn show_target(&mut self, motor: usize) {
        let scale = self.motor_i(motor, 8) * 32.0;
        let bits = fixed::bits(self.state.motors[motor].target * scale);
        self.set_double(self.setup.motors[motor].target, bits);
    }

    /// The abort deceleration of a motor from whatever it does, in real time.
    pub(crate) fn decelerate(&mut self, motor: usize) {
        if self.state.motors[motor].decelerates() {
            self.state.motors[motor].waiting.clear();
            return;
        }
        let units = self.servo_units();
        let own = match self.sequence_of(motor) {
            Some(system) => self.state.systems[system].sequence.velocity(motor),
            None => self.state.motors[motor].row.velocity(),
        };
        let base = self.base_of(motor);
        let w = own * (base as f64 / units as f64);
        let rate = self.motor_i(motor, 15);
        let programmed = self.in_sequence(motor) || self.state.motors[motor].programmed;
        let this = &mut self.state.motors[motor];
        this.drop_motion();
        if w == 0.0 || rate <= 0.0 {
            if programmed {
                this.prejog = this.commanded;
            }
            return;
        }
        let p = this.commanded;
        let time = w.abs() / rate;
        let duration = rnd(time * 8_388_608.0).max(1);
        let mut row = Row::default();
        row.push(duration, [p, w, -w.signum() * rate / 2.0, 0.0]);
        row.end_at(p + w * w.abs() / (2.0 * rate));
        this.row = row;
        this.purpose = Purpose::Abort;
        this.was_programmed = programmed;
    }
}
