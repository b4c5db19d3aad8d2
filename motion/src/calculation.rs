//! The calculation of motion programs: what their statements do, and when a calculation stops (guide, How PMAC
//! Executes a Motion Program). The statements themselves are run by an engine, which asks here at each of them that
//! concerns motion.

use plcc_abi::pmac::motion::{Mode, MotionKind, TimeWord};

use crate::circle::Normal;
use crate::events::{MotionEvent, Reason};
use crate::machine::{Machine, State};
use crate::moves::Shape;
use crate::sequence::Progress;
use crate::system::{Counter, Frame, MAX_SYNC, Place, SyncAssignment, System, Wait};
use crate::units::units;

/// The most statements of a calculation.
const MAX_STATEMENTS: u64 = 1_000_000;

/// How many values a statement has at most.
const MAX_VALUES: usize = 64;

/// Where a program goes on after a jump.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) enum Jump {
    /// Behind the statement.
    #[default]
    None,
    To(Place),
    Into(Place),
    Back,
}

/// A calculation that is under way.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Calculation {
    system: usize,
    /// The index of the program that runs, and the resume point at which it was entered.
    pub(crate) at: Place,
    values: Vec<f64>,
    /// Backward jumps in this calculation.
    pub(crate) jumps: u32,
    /// Statements that were passed.
    statements: u64,
    pub(crate) jump: Jump,
    /// The first argument of the call that is made.
    pub(crate) first_argument: u32,
    /// It is made by PRELUDE1, so that it returns in front of its statement.
    pub(crate) by_prelude: bool,
    /// It is over.
    pub(crate) stop: bool,
    /// The program has ended or stopped, and its counter is set.
    pub(crate) placed: bool,
}

/// What an engine does next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Next {
    /// It runs a task from a resume point.
    Run {
        /// The task.
        task: u32,
        /// The resume point.
        point: u32,
    },
    /// Nothing: the calculation is over.
    Done,
}

impl State {
    /// The first coordinate system from a number on, from 1, of which a calculation is wanted.
    pub fn wanted_calculation(&self, from: u32) -> Option<u32> {
        let wants = |system: &System| system.flag && system.running;
        let first = from.saturating_sub(1);
        let index = self.systems.get(first as usize..)?.iter().position(wants)?;
        Some(first + index as u32 + 1)
    }
}

impl Machine<'_> {
    /// Begins the calculation of a coordinate system, from 1, if its flag is set.
    pub fn begin_calculation(&mut self, system: u32) -> Next {
        let index = system as usize - 1;
        let this = &mut self.state.systems[index];
        if !this.flag || !this.running {
            return Next::Done;
        }
        this.idle = false;
        self.state.rest.end();
        let this = &self.state.systems[index];
        if this.rematch {
            self.match_axes(index);
            if !self.state.systems[index].running {
                return Next::Done;
            }
        }
        if self.go_on_with_kept(index) {
            return Next::Done;
        }
        let Counter::At(at) = self.state.systems[index].counter else { return Next::Done };
        let calculation = &mut self.state.calculation;
        calculation.values.reserve(MAX_VALUES);
        calculation.values.clear();
        *calculation = Calculation {
            system: index,
            at,
            values: std::mem::take(&mut calculation.values),
            ..Calculation::default()
        };
        self.enter(at)
    }

    fn enter(&mut self, at: Place) -> Next {
        let program = self.tables.programs.get(at.program as usize);
        match program.and_then(|program| program.task) {
            Some(task) => {
                self.state.calculation.at = at;
                Next::Run { task, point: at.point }
            }
            None => Next::Done,
        }
    }

    /// The engine has suspended the program's task in front of a resume point. Says where it goes on.
    pub fn after(&mut self, point: u32) -> Next {
        let calculation = &mut self.state.calculation;
        let system = calculation.system;
        let here = Place { program: calculation.at.program, point };
        calculation.statements += u64::from(point.abs_diff(calculation.at.point)) + 1;
        let this = &mut self.state.systems[system];
        let mut backward = false;
        let next = match std::mem::take(&mut calculation.jump) {
            Jump::None => here,
            Jump::To(place) => {
                // A jump to the GOTO's own line or to one in front of it.
                backward = place.point < point;
                place
            }
            Jump::Into(place) => {
                let (first, read) = (calculation.first_argument, this.read);
                let prelude = std::mem::take(&mut calculation.by_prelude);
                let point = here.point - u32::from(prelude && here.point > 0);
                let back = Place { point, ..here };
                this.stack.push(Frame { place: back, first, next: first, read, prelude });
                place
            }
            Jump::Back => match this.stack.pop() {
                Some(frame) => {
                    let last = this.arguments.get(frame.first as usize..frame.next as usize);
                    let last = last.and_then(<[_]>::last);
                    this.read = last.map_or(frame.read, |last| last.word.ordinal);
                    this.prelude.returned = frame.prelude;
                    this.arguments.truncate(frame.first as usize);
                    frame.place
                }
                None => here,
            },
        };
        if !calculation.placed {
            this.counter = Counter::At(next);
        }
        let too_long = calculation.statements >= MAX_STATEMENTS;
        if backward {
            self.backward(system);
        }
        if self.state.calculation.stop {
            return Next::Done;
        }
        if too_long {
            self.idle_calculation(system);
            return Next::Done;
        }
        self.enter(next)
    }

    /// The calculation stops and its flag stays set: the next interrupt goes on.
    pub(crate) fn idle_calculation(&mut self, system: usize) {
        self.close_sequence(system);
        self.state.systems[system].idle = true;
        self.state.calculation.stop = true;
    }

    /// A value of the statement that comes next.
    pub fn value(&mut self, value: f64) {
        let values = &mut self.state.calculation.values;
        if values.len() < MAX_VALUES {
            values.push(plcc_abi::pmac::arithmetic::finite(value));
        }
    }

    /// Whether a statement that may have to wait for a stop can be calculated now. If not, the calculation is over,
    /// and the statement is calculated anew after the stop, with its expressions.
    pub fn ready(&mut self, statement: u32) -> bool {
        let Some(statement) = self.tables.statements.get(statement as usize) else { return true };
        let system = self.state.calculation.system;
        self.state.calculation.values.clear();
        let line = (statement.file, statement.line);
        if self.steps_by_line(system) {
            let stepped = self.state.systems[system].stepped.get_or_insert(line);
            if *stepped != line {
                self.end_step(system);
                return false;
            }
        }
        self.state.systems[system].last = line;
        if statement.kind == MotionKind::BeforeWord {
            return true;
        }
        if self.words_read(system, statement) == Some(statement.words.len()) {
            return true;
        }
        let kind = match &statement.kind {
            MotionKind::Delay => Some(self.kind_of_lines(system)),
            MotionKind::Move(_) => self.kind_of_moves(system),
            MotionKind::Home(_) | MotionKind::HomeZero(_) | MotionKind::Set(_) => None,
            _ => return true,
        };
        let sequence = &self.state.systems[system].sequence;
        let free = match sequence.progress {
            Progress::None => true,
            Progress::Gathering | Progress::Running => {
                !sequence.closed && kind == Some(sequence.kind) && !self.ends_spline(system)
            }
        };
        if free {
            return true;
        }
        self.close_sequence(system);
        let this = &mut self.state.systems[system];
        this.wait = Wait::Stop;
        this.flag = false;
        self.state.calculation.stop = true;
        false
    }

    /// Carries out a statement with the values that were given. Says whether the program's task is suspended
    /// behind it.
    pub fn execute(&mut self, statement: u32) -> bool {
        let tables = self.tables;
        let Some(statement) = tables.statements.get(statement as usize) else { return false };
        let system = self.state.calculation.system;
        self.state.systems[system].last = (statement.file, statement.line);
        let mut values = std::mem::take(&mut self.state.calculation.values);
        let read = match statement.kind {
            MotionKind::BeforeWord => None,
            _ => self.words_read(system, statement),
        };
        let suspended = match read {
            None if statement.kind == MotionKind::BeforeWord => {
                self.before_word(system, statement, &values)
            }
            Some(read) if read == statement.words.len() => false,
            Some(read) => self.rest_of_words(system, statement, read, &values),
            None => {
                let calls = matches!(
                    statement.kind,
                    MotionKind::Code(_) | MotionKind::Call | MotionKind::Gosub
                );
                if calls {
                    let first = self.keep_arguments(system, statement, &values);
                    self.state.calculation.first_argument = first;
                }
                let suspended = self.statement(system, &statement.kind, &values);
                if calls && !matches!(self.state.calculation.jump, Jump::Into(_)) {
                    let first = self.state.calculation.first_argument as usize;
                    self.state.systems[system].arguments.truncate(first);
                }
                suspended
            }
        };
        values.clear();
        self.state.calculation.values = values;
        suspended
    }

    fn statement(&mut self, system: usize, kind: &MotionKind, values: &[f64]) -> bool {
        let value = values.first().copied().unwrap_or(0.0);
        match kind {
            MotionKind::Move(words) => {
                let words = self.take_words(system, words, values);
                self.programmed_move(system, &words)
            }
            MotionKind::Delay => {
                let words = self.no_words(system);
                let time = Some(value.max(0.0));
                self.linear_move(system, &words, Shape { time, arc: None })
            }
            MotionKind::Mode(mode) => {
                let continues = self.state.systems[system].mode == *mode
                    || is_linear(*mode) && is_linear(self.state.systems[system].mode);
                if !continues {
                    self.close_sequence(system);
                }
                self.state.systems[system].mode = *mode;
                if let (Mode::Pvt, Some(time)) = (mode, values.first()) {
                    self.set_time(system, TimeWord::Pvt, *time);
                }
                false
            }
            MotionKind::Time(word) => {
                self.set_time(system, *word, value);
                false
            }
            MotionKind::Incremental(incremental, axes) => {
                self.set_incremental(system, *incremental, *axes);
                false
            }
            MotionKind::FeedrateAxes(axes) => {
                self.state.systems[system].modes.feedrate = *axes;
                false
            }
            MotionKind::Normal(components) => {
                let ([component], true) = (components.as_slice(), value != 0.0) else {
                    return self.stop_with_error(system, Reason::Unsupported);
                };
                let (component, negative) = (*component, value < 0.0);
                self.state.systems[system].normal = Normal { component, negative };
                false
            }
            MotionKind::Dwell => self.dwell(system, value),
            MotionKind::Home(motors) => self.home_motors(system, *motors),
            MotionKind::HomeZero(motors) => self.home_zero_motors(system, *motors),
            MotionKind::Set(axes) => {
                for (axis, value) in axes.iter().zip(values) {
                    self.set_axis(system, *axis, *value);
                }
                self.state.systems[system].since_break = 0;
                false
            }
            MotionKind::Wait => {
                self.idle_calculation(system);
                self.state.systems[system].since_break = 0;
                true
            }
            MotionKind::Stop => self.end_program(system, Some(Reason::Stop)),
            MotionKind::Goto => {
                let program = self.state.calculation.at.program;
                self.jump(system, program, value, Jump::To)
            }
            MotionKind::Gosub => {
                let program = self.state.calculation.at.program;
                self.jump(system, program, value, Jump::Into)
            }
            MotionKind::Call => self.call(system, value),
            MotionKind::Return => {
                if self.state.systems[system].stack.is_empty() {
                    return self.end_program(system, None);
                }
                self.state.calculation.jump = Jump::Back;
                true
            }
            MotionKind::EndWhile => self.backward(system),
            MotionKind::Sync(op, number) => {
                let this = &self.state.systems[system];
                let (with, place) = (this.next_move, this.last);
                let assignment = SyncAssignment { op: *op, number: *number, value, with, place };
                if this.sync.len() < MAX_SYNC {
                    self.state.systems[system].sync.push_back(assignment);
                } else {
                    self.events.push(MotionEvent::SyncOverflow { system: system as u32 + 1 });
                    self.assign(assignment);
                }
                false
            }
            MotionKind::BlockStart => {
                self.state.systems[system].block = true;
                false
            }
            MotionKind::BlockStop => {
                self.state.systems[system].block = false;
                self.state.systems[system].step && self.end_step(system)
            }
            MotionKind::Code(code) => self.code(system, *code, value),
            MotionKind::Read(letters) => {
                self.read_arguments(system, *letters);
                false
            }
            // Where PRELUDE1 may call is seen before this.
            MotionKind::Argument | MotionKind::BeforeWord => false,
            MotionKind::Prelude(code) => {
                self.state.systems[system].prelude.call = Some((*code, value));
                false
            }
            MotionKind::PreludeOff => {
                self.state.systems[system].prelude.call = None;
                false
            }
            MotionKind::Spindle => {
                self.write_q(system, 127, value);
                false
            }
            MotionKind::Transformation(word) => self.transform(system, *word, value),
            MotionKind::Unsupported => self.stop_with_error(system, Reason::Unsupported),
        }
    }

    pub(crate) fn stop_with_error(&mut self, system: usize, reason: Reason) -> bool {
        self.run_time_error(system, reason);
        self.state.calculation.stop = true;
        true
    }

    /// TA, TS, TM and F assign the I-variables that they stand for.
    fn set_time(&mut self, system: usize, word: TimeWord, value: f64) {
        let number = match word {
            TimeWord::Ta => 87,
            TimeWord::Ts => 88,
            TimeWord::Tm | TimeWord::Feed => 89,
            TimeWord::Pvt if self.turbo() && self.i(42) == 0.0 => 89,
            TimeWord::Pvt => 87,
        };
        let value = match word {
            TimeWord::Ta | TimeWord::Ts => value.max(0.0).round(),
            TimeWord::Pvt if number == 87 => value.max(0.0).round(),
            TimeWord::Tm | TimeWord::Feed | TimeWord::Pvt => value,
        };
        match word {
            TimeWord::Tm => self.state.systems[system].by_time = true,
            TimeWord::Feed => self.state.systems[system].by_time = false,
            TimeWord::Ta | TimeWord::Ts | TimeWord::Pvt => {}
        }
        let number = self.system_number(system, number);
        self.write_i(number, value);
    }

    fn dwell(&mut self, system: usize, value: f64) -> bool {
        self.close_sequence(system);
        let time = units(value.max(0.0));
        let this = &mut self.state.systems[system];
        this.next_move += 1;
        let moving = this.sequence.progress != Progress::None;
        if moving {
            this.wait = Wait::StopAndDwell(time);
        } else {
            self.begin_dwell(system, time);
            self.synchronous(system);
        }
        if self.ends_step(system) {
            return self.end_step(system);
        }
        if !moving && time == 0 {
            return false;
        }
        self.state.systems[system].flag = false;
        self.state.calculation.stop = true;
        true
    }

    /// HOME: all of them search at once.
    fn home_motors(&mut self, system: usize, motors: u32) -> bool {
        let listed = |motor: &usize| motors & 1 << motor != 0;
        let bad = (0..self.motor_count()).filter(listed).any(|motor| {
            self.system_of(motor).is_some_and(|own| own != system)
                || !self.state.motors[motor].active
        });
        if bad {
            return self.stop_with_error(system, Reason::Motor);
        }
        let mut any = false;
        for motor in (0..self.motor_count()).filter(listed) {
            self.search_home(motor, true);
            any = true;
        }
        if !any {
            return false;
        }
        let this = &mut self.state.systems[system];
        this.rematch = true;
        this.wait = Wait::Motors;
        this.line = this.last;
        if self.ends_step(system) {
            return self.end_step(system);
        }
        self.state.systems[system].flag = false;
        self.state.calculation.stop = true;
        true
    }

    fn home_zero_motors(&mut self, system: usize, motors: u32) -> bool {
        for motor in (0..self.motor_count()).filter(|motor| motors & 1 << motor != 0) {
            if self.system_of(motor).is_some_and(|own| own != system) {
                return self.stop_with_error(system, Reason::Motor);
            }
            self.zero_here(motor);
        }
        self.state.systems[system].rematch = true;
        false
    }
}

/// LINEAR and CIRCLE moves blend into each other.
fn is_linear(mode: Mode) -> bool {
    matches!(mode, Mode::Linear | Mode::Circle1 | Mode::Circle2)
}
