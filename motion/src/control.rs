//! Coordinate systems' programs: they are chosen, run, stepped, held and stopped.

use plcc_abi::pmac::motion::{AxisSet, Jog};

use plcc_abi::pmac::Controller;

use crate::axes::Look;
use crate::events::{Error, MotionEvent, Reason, State};
use crate::halt::Pause;
use crate::machine::Machine;
use crate::motor::{Loop, Start, Waiting};
use crate::sequence::Progress;
use crate::status::{Latch, SystemLatch};
use crate::system::{Counter, Place, Wait};

impl Machine<'_> {
    /// The number of the program at which a coordinate system's counter is.
    pub(crate) fn program_number(&self, system: usize) -> u32 {
        self.look().program_number(system)
    }

    /// B: the program counter goes to a label of a program, which need not be there before it runs.
    pub(crate) fn choose(&mut self, system: usize, program: u32, label: u32) -> Result<(), Error> {
        let this = &mut self.state.systems[system];
        if this.running {
            return Err(Error::Running);
        }
        if this.is_paused() {
            this.sequence.clear();
            this.sync.clear();
        }
        this.pause = Pause::None;
        this.kept.clear();
        this.counter = Counter::Label(program, label);
        this.chosen = Some(program);
        this.stack.clear();
        this.arguments.clear();
        this.read = 0;
        (this.prelude.done, this.prelude.returned) = (0, false);
        Ok(())
    }

    /// R and S.
    pub(crate) fn run(&mut self, system: usize, step: bool) -> Result<(), Error> {
        let this = &mut self.state.systems[system];
        if this.running {
            if this.held {
                (this.held, this.returning) = (false, true);
                return Ok(());
            }
            if step {
                self.quit(system, Reason::Quit);
                return Ok(());
            }
            return Err(Error::Running);
        }
        if this.held {
            (this.held, this.returning) = (false, true);
            let dwells = this.dwells() || this.wait != Wait::None;
            if dwells || self.motors_of(system).any(|motor| self.is_busy(motor)) {
                return Ok(());
            }
        }
        let place = self.may_run(system)?;
        if let Pause::Stopped(wanted) = self.state.systems[system].pause {
            self.resume(system, wanted, step);
            return Ok(());
        }
        let continuous = !step && self.system_i(system, 92) == 0.0;
        let this = &mut self.state.systems[system];
        this.counter = Counter::At(place);
        (this.running, this.flag) = (true, true);
        (this.step, this.block, this.stepped) = (step, false, None);
        this.continuous = continuous;
        this.since_break = 0;
        this.idle = false;
        this.wait = Wait::None;
        self.system_latch(system, SystemLatch::RunError, false);
        self.system_latch(system, SystemLatch::CircleError, false);
        self.announce_start(system);
        if self.turbo() || self.i(14) == 1.0 {
            self.match_axes(system);
        }
        Ok(())
    }

    /// Tells that a coordinate system's program has started, or goes on.
    pub(crate) fn announce_start(&mut self, system: usize) {
        let program = self.program_number(system);
        self.events.push(MotionEvent::Program {
            system: system as u32 + 1,
            program,
            state: State::Started,
            reason: None,
            place: None,
        });
    }

    /// Whether a motor moves or waits to.
    pub(crate) fn is_busy(&self, motor: usize) -> bool {
        let this = &self.state.motors[motor];
        this.moves()
            || !this.waiting.is_empty()
            || this.search.is_some()
            || self.system_of(motor).is_some_and(|system| {
                let sequence = &self.state.systems[system].sequence;
                !self.state.systems[system].is_paused()
                    && sequence.progress != Progress::None
                    && sequence.member[motor]
            })
    }

    /// Why a program may not run, or where it begins (guide, appendix A).
    fn may_run(&self, system: usize) -> Result<Place, Error> {
        let mut any = false;
        let is = |test: &dyn Fn(usize) -> bool| self.motors_of(system).any(test);
        if is(&|m| self.state.motors[m].end_positive && self.state.motors[m].end_negative) {
            return Err(Error::BothLimits);
        }
        if is(&|m| self.is_busy(m)) || is(&|_| true) && self.state.systems[system].dwells() {
            return Err(Error::Moving);
        }
        if is(&|m| self.state.motors[m].active && self.state.motors[m].mode != Loop::Closed) {
            return Err(Error::OpenLoop);
        }
        if is(&|m| !self.state.motors[m].active) {
            return Err(Error::NotActivated);
        }
        any |= is(&|_| true);
        if !any {
            return Err(Error::NoMotors);
        }
        if is(&|m| self.is_elsewhere(m)) {
            return Err(Error::Elsewhere);
        }
        let (number, label) = match self.state.systems[system].counter {
            Counter::At(place) => return Ok(place),
            Counter::Label(program, label) => (program, label),
            Counter::Default => (self.system_i(system, 91) as u32, 0),
        };
        let programs = &self.tables.programs;
        let index = programs.iter().position(|program| program.number == number);
        let program = index.and_then(|index| programs.get(index)).ok_or(Error::NoProgram)?;
        if program.task.is_none() {
            return Err(Error::Structure);
        }
        let point = program.label(label).ok_or(Error::NoProgram)?;
        Ok(Place { program: index.unwrap_or(0) as u32, point })
    }

    /// The program of a coordinate system no longer runs; what is calculated is done.
    pub(crate) fn program_over(
        &mut self,
        system: usize,
        program: u32,
        state: State,
        reason: Option<Reason>,
    ) {
        let this = &mut self.state.systems[system];
        if !this.running {
            return;
        }
        (this.running, this.flag) = (false, false);
        (this.step, this.block, this.continuous, this.idle) = (false, false, false, false);
        let place = Some(this.last);
        self.events.push(MotionEvent::Program {
            system: system as u32 + 1,
            program,
            state,
            reason,
            place,
        });
    }

    /// Stops the program of a coordinate system, if one runs.
    pub(crate) fn stop_program(&mut self, system: usize, reason: Reason) {
        let program = self.program_number(system);
        self.program_over(system, program, State::Stopped, Some(reason));
    }

    /// Q and `/`: nothing further is calculated.
    pub(crate) fn quit(&mut self, system: usize, reason: Reason) {
        if self.state.systems[system].running {
            self.close_sequence(system);
            self.stop_program(system, reason);
        }
    }

    /// What was calculated and not done is lost.
    pub(crate) fn drop_calculated(&mut self, system: usize) {
        let this = &mut self.state.systems[system];
        this.sequence.clear();
        this.sync.clear();
        this.kept.clear();
        this.pause = Pause::None;
        this.wait = Wait::None;
        this.line = (0, 0);
    }

    /// A: each motor of the coordinate system decelerates from whatever it does.
    pub(crate) fn abort(&mut self, system: usize, reason: Reason) {
        self.state.rest.end();
        self.stop_program(system, reason);
        let this = &mut self.state.systems[system];
        (this.held, this.returning) = (false, this.held || this.returning);
        for motor in self.motors_of(system) {
            if self.state.motors[motor].active {
                self.decelerate(motor);
                self.state.motors[motor].close();
            }
        }
        self.drop_calculated(system);
    }

    /// A run-time error: the program stops, and its motors decelerate as by A.
    pub(crate) fn run_time_error(&mut self, system: usize, reason: Reason) {
        self.state.rest.end();
        let program = self.program_number(system);
        self.system_latch(system, SystemLatch::RunError, true);
        if reason == Reason::Circle {
            self.system_latch(system, SystemLatch::CircleError, true);
        }
        self.program_over(system, program, State::Error, Some(reason));
        for motor in self.motors_of(system) {
            if self.state.motors[motor].active {
                self.decelerate(motor);
            }
        }
        self.drop_calculated(system);
    }

    /// The amplifier of a motor goes off.
    pub(crate) fn kill(&mut self, motor: usize) {
        let moved = self.in_sequence(motor);
        let this = &mut self.state.motors[motor];
        if moved || this.moves() && (this.programmed || this.was_programmed) {
            this.prejog = this.commanded;
        }
        this.kill();
    }

    /// H: the time base goes to 0.
    pub(crate) fn hold(&mut self, system: usize) {
        self.state.systems[system].held = true;
    }

    /// HM, or HOME of a motion program.
    pub(crate) fn search_home(&mut self, motor: usize, programmed: bool) {
        let cycles = self.waiting_cycles(motor);
        let age = self.next_age();
        let this = &mut self.state.motors[motor];
        this.close();
        this.searching = true;
        this.wait(Waiting { cycles, age, start: Start::Home, programmed });
        self.latch(motor, Latch::HomeComplete, false);
        self.latch(motor, Latch::TriggerMove, false);
    }

    /// HMZ: the motor's zero is where the commanded position is.
    pub(crate) fn zero_here(&mut self, motor: usize) {
        let this = &mut self.state.motors[motor];
        let zero = this.zero + this.commanded;
        this.move_zero(zero);
        self.latch(motor, Latch::HomeComplete, true);
        self.show_zero(motor, zero);
        if let Some(system) = self.system_of(motor) {
            self.state.systems[system].rematch = true;
        }
    }

    /// A jog.
    pub(crate) fn jog(&mut self, motor: usize, jog: Jog) {
        let cycles = self.waiting_cycles(motor);
        let age = self.next_age();
        let this = &mut self.state.motors[motor];
        this.close();
        this.searching |= jog.trigger.is_some();
        let start = Start::Jog(jog.goal, jog.trigger);
        this.wait(Waiting { cycles, age, start, programmed: false });
        self.latch(motor, Latch::TriggerMove, jog.trigger.is_some());
    }

    /// ABS and INC.
    pub(crate) fn set_incremental(&mut self, system: usize, incremental: bool, axes: AxisSet) {
        let modes = &mut self.state.systems[system].modes;
        modes.incremental = match incremental {
            true => modes.incremental.and(axes),
            false => modes.incremental.without(axes),
        };
    }
}

impl Look<'_> {
    /// The number of the program at which a coordinate system's counter is.
    pub(crate) fn program_number(&self, system: usize) -> u32 {
        match self.state.systems[system].counter {
            Counter::At(Place { program, .. }) => {
                self.tables.programs.get(program as usize).map_or(0, |program| program.number)
            }
            Counter::Label(program, _) => program,
            Counter::Default => {
                let base = if self.setup.layout.controller == Controller::Turbo { 5000 } else { 0 };
                self.i(base + 100 * (system as u32 + 1) + 91) as u32
            }
        }
    }
}
