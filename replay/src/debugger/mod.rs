//! Where the user stands in a run, and all ways to move.

mod event_text;
mod search;
mod steps;
mod versions;

use std::collections::BTreeMap;

use plcc_diag::FileId;
use plcc_frontend::common::StatementInterpreter;
use plcc_runtime::{Executive, Setting, Stop};

use crate::DebugError;
use crate::breakpoints::{Breakpoints, DataBreakpoint, LineBreakpoint, SetBreakpoint};
use crate::control::ControlSocket;
use crate::history::{History, TickResult};
use crate::interruption::Interruption;
use crate::program::DebuggedProgram;
use crate::trace::{Access, Step, TickTrace, cut_statements};

/// Opens a session of another version of the program that ran in the same run, by its
/// [generation](crate::Version::generation).
pub type OpenVersion = Box<dyn Fn(u16) -> Result<Session<'static>, DebugError>>;

/// What a debugger works on.
pub struct Session<'a> {
    /// The program.
    pub program: DebuggedProgram,
    /// Its run.
    pub history: Box<dyn History + 'a>,
    /// An executive of the program that runs nothing; variables are read from it.
    pub view: Box<dyn Executive + Send>,
    /// Whether variables may be set and forced.
    pub may_change: bool,
    /// The control whose record is debugged while it runs: what the user sets acts on it, and shows in the record
    /// when that has come so far. `None` where there is none, or nothing is to be set.
    pub control: Option<ControlSocket>,
    /// Opens the other versions of the program, where the run had online changes. Without it only the history's own
    /// version can be looked at.
    pub open_version: Option<OpenVersion>,
}

impl<'a> Session<'a> {
    /// A session of one program that no control runs. `view` is an executive of the program that runs nothing.
    /// Variables may be set and forced in it if the history lets them (`may_change`).
    pub fn offline(
        program: DebuggedProgram,
        history: Box<dyn History + 'a>,
        view: Box<dyn Executive + Send>,
        may_change: bool,
    ) -> Self {
        Self { program, history, view, may_change, control: None, open_version: None }
    }
}

impl std::fmt::Debug for Session<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Session").field("program", &self.program).finish_non_exhaustive()
    }
}

/// A place in a run: before a statement that is executed in a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Position {
    /// The tick.
    pub tick: u64,
    /// The number of statements that were executed in it before; all of them at its end.
    pub step: usize,
}

/// Which way to go.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// In the order of time.
    Forward,
    /// Back.
    Back,
}

/// How far one step goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StepKind {
    /// To the next statement, also into a subroutine.
    Statement,
    /// To the next statement of this subroutine, or of one of its callers.
    Over,
    /// Out of the subroutine; outside of subroutines to the next scan of the task.
    Out,
    /// To the first statement of the next or previous scan of the task.
    Scan,
}

/// Why a movement has ended.
#[derive(Clone, Debug, PartialEq)]
pub enum Stopped {
    /// The step is done.
    Step,
    /// A breakpoint on a statement: its number.
    Breakpoint(i64),
    /// A variable changes in this statement: the breakpoint's number, and what changes.
    Data(i64, String),
    /// The statement that was looked for, with what it did.
    Writer(String),
    /// A fault or message that the user wants to stop at; the text.
    Event(String),
    /// The program was stopped.
    ProgramStopped(Stop),
    /// The beginning of what is known.
    Beginning,
    /// The end of what is known.
    End,
}

/// What is stopped at besides breakpoints.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StopAt {
    /// When the control stops the program.
    pub program_stops: bool,
    /// When a fault comes.
    pub faults: bool,
    /// When a message comes, or PMAC's program sends or displays a text.
    pub messages: bool,
}

impl Default for StopAt {
    fn default() -> Self {
        Self { program_stops: true, faults: false, messages: false }
    }
}

impl Session<'_> {
    /// As [`Debugger::cut_statements`].
    pub(crate) fn cut_statements(&mut self, tick: u64) -> Result<Vec<u32>, DebugError> {
        cut_statements(&self.program, self.history.as_mut(), tick)
    }
}

/// Where the user stands, breakpoints, and all ways to move.
pub struct Debugger<'a> {
    session: Session<'a>,
    interpreter: Box<dyn StatementInterpreter>,
    /// By a statement's number: whether it has a place in the source, and so is a step.
    placed: Vec<bool>,
    position: Position,
    /// Whether a breakpoint at the position itself stops the next run, since the position was not reported to the
    /// user yet.
    is_fresh: bool,
    trace: Option<TickTrace>,
    breakpoints: Breakpoints,
    /// What is stopped at besides breakpoints.
    pub stop_at: StopAt,
    /// Texts of logpoints and events that nobody has fetched yet.
    output: Vec<String>,
    /// The first tick whose events were not shown to the user yet.
    told: u64,
    interruption: Interruption,
}

impl std::fmt::Debug for Debugger<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Debugger").field("position", &self.position).finish_non_exhaustive()
    }
}

impl<'a> Debugger<'a> {
    /// Begins before the first statement of a run.
    pub fn new(session: Session<'a>) -> Self {
        let interpreter = session.program.checked().statement_interpreter();
        let placed = session.program.places().placed();
        let position = Position { tick: session.history.first(), step: 0 };
        Self {
            session,
            interpreter,
            placed,
            position,
            is_fresh: true,
            trace: None,
            breakpoints: Breakpoints::default(),
            stop_at: StopAt::default(),
            output: vec![],
            told: 0,
            interruption: Interruption::default(),
        }
    }

    /// From now on, long movements end with an error as soon as `interruption` wants that.
    pub fn interrupt_by(&mut self, interruption: Interruption) {
        self.session.history.interrupt_by(interruption.clone());
        self.interruption = interruption;
    }

    /// The program.
    pub fn program(&self) -> &DebuggedProgram {
        &self.session.program
    }

    /// The run.
    pub fn history(&self) -> &(dyn History + 'a) {
        self.session.history.as_ref()
    }

    /// At the end of what is known, looks whether there are further ticks by now, of a control that is
    /// still being recorded.
    ///
    /// # Errors
    /// When the recording can't be read any more.
    pub fn look_for_more(&mut self) -> Result<(), DebugError> {
        if self.position.tick.saturating_add(1) < self.known_ticks() {
            return Ok(());
        }
        self.session.history.look_for_more()
    }

    /// The run, to run ticks of it or to read variables after the last of them. The user stays where he
    /// is.
    pub fn history_mut(&mut self) -> &mut (dyn History + 'a) {
        self.session.history.as_mut()
    }

    /// The program, and the executive of the run, in the state after the tick that was run last.
    pub(crate) fn program_and_executive(&mut self) -> (&DebuggedProgram, &mut dyn Executive) {
        (&self.session.program, self.session.history.executive())
    }

    /// The program and the run, for questions that run ticks again. The user stays where he is.
    pub fn program_and_history(&mut self) -> (&DebuggedProgram, &mut (dyn History + 'a)) {
        (&self.session.program, self.session.history.as_mut())
    }

    /// The length of a tick in nanoseconds.
    pub fn tick_ns(&self) -> u64 {
        self.session.view.tick_ns()
    }

    /// Whether variables may be set and forced.
    pub fn may_change(&self) -> bool {
        self.session.may_change
    }

    /// The program, and the executive from which variables are read.
    pub(crate) fn program_and_view(&mut self) -> (&DebuggedProgram, &mut dyn Executive) {
        (&self.session.program, self.session.view.as_mut())
    }

    /// Where the user stands.
    pub fn position(&self) -> Position {
        self.position
    }

    /// Replaces the breakpoints on statements of a file.
    pub fn set_line_breakpoints(
        &mut self,
        file: u32,
        wanted: &[LineBreakpoint],
    ) -> Vec<SetBreakpoint> {
        self.breakpoints.replace_lines(&self.session.program, file, wanted)
    }

    /// Replaces the data breakpoints.
    pub fn set_data_breakpoints(&mut self, wanted: &[DataBreakpoint]) -> Vec<SetBreakpoint> {
        self.breakpoints.replace_data(&self.session.program, wanted)
    }

    /// Says that the user has seen the position, so that breakpoints at it do not stop the next run.
    pub fn stay(&mut self) {
        self.is_fresh = false;
    }

    /// Texts of logpoints and events since the last call.
    pub fn take_output(&mut self) -> Vec<String> {
        std::mem::take(&mut self.output)
    }

    /// The trace of the tick where the user stands.
    ///
    /// # Errors
    /// When the tick can't be run.
    pub fn trace(&mut self) -> Result<&TickTrace, DebugError> {
        let tick = self.position.tick;
        let trace = match self.trace.take().filter(|trace| trace.tick == tick) {
            Some(trace) => trace,
            None => self.record(tick)?,
        };
        Ok(self.trace.insert(trace))
    }

    /// Runs a tick and records it.
    fn record(&mut self, tick: u64) -> Result<TickTrace, DebugError> {
        let Session { program, history, .. } = &mut self.session;
        let interpreter = self.interpreter.as_mut();
        let (trace, result) =
            TickTrace::record(program, &self.placed, interpreter, history.as_mut(), tick)?;
        self.tell(tick, &result);
        Ok(trace)
    }

    /// Notes the events of a tick for the user, once.
    fn tell(&mut self, tick: u64, result: &TickResult) {
        if tick >= self.told {
            self.told = tick + 1;
            self.output.extend(result.events.iter().map(event_text::shown));
            self.output.extend(result.note.clone());
        }
    }

    /// The step at which the user stands; `None` at the end of a tick.
    ///
    /// # Errors
    /// When the tick can't be run.
    pub fn step_here(&mut self) -> Result<Option<Step>, DebugError> {
        let at = self.position.step;
        Ok(self.trace()?.steps.get(at).copied())
    }

    /// The task of the statement at the position, or at the end of a tick of its last statement.
    pub fn task_here(&mut self) -> Option<usize> {
        let at = self.position.step;
        let steps = &self.trace().ok()?.steps;
        steps.get(at).or(steps.last()).map(|step| step.task)
    }

    /// The process image at the position.
    ///
    /// # Errors
    /// When the tick can't be run.
    pub fn image(&mut self) -> Result<Vec<u8>, DebugError> {
        let at = self.position.step;
        Ok(self.trace()?.image(at))
    }

    /// What the statement at the position reads and writes.
    ///
    /// # Errors
    /// When the tick can't be run.
    pub fn accesses(&mut self) -> Result<Vec<Access>, DebugError> {
        let at = self.position.step;
        Ok(self.trace()?.accesses(at).to_vec())
    }

    /// The forces in effect at the end of the tick where the user stands, by the names of their variables.
    ///
    /// # Errors
    /// When the tick can't be run.
    pub fn forces(&mut self) -> Result<BTreeMap<String, Setting>, DebugError> {
        let forces = self.trace()?.forces.clone();
        let names = self.session.history.executive().names();
        Ok(forces.into_iter().map(|(key, value)| (names.canonical(key), value)).collect())
    }

    /// An executive whose variables have the values at the position.
    ///
    /// # Errors
    /// When the tick can't be run.
    pub fn view(&mut self) -> Result<&mut dyn Executive, DebugError> {
        let at = self.position.step;
        let trace = self.trace()?;
        let (image, before) = (trace.image(at), trace.before.clone());
        let writes: Vec<Access> =
            trace.accesses_before(at).iter().filter(|access| access.is_write).copied().collect();
        let Session { view, program, .. } = &mut self.session;
        view.resume(&before).map_err(|error| DebugError(error.to_string()))?;
        // What lies outside the image (PMAC's sparse memory, NCT's registers OP) is written again.
        for access in writes {
            let is_outside = program.checked().is_outside_image(access.variable);
            let Some(name) = program.name(access.variable).filter(|_| is_outside) else { continue };
            let Ok(variable) = view.names().find(&name, plcc_runtime::Purpose::Stimulus) else {
                continue;
            };
            view.write(variable, plcc_runtime::Setting::Float(access.value.number()));
        }
        view.set_image(&image);
        Ok(view.as_mut())
    }

    /// Whether what is set acts on a control that runs, and not on the ticks that are debugged.
    pub fn changes_control(&self) -> bool {
        self.session.control.is_some()
    }

    /// Of a tick in which the watchdog stopped a scan: the statements of the line at which it stood. Empty for other
    /// ticks, and where that line is not known.
    ///
    /// # Errors
    /// When there is no such tick.
    pub fn cut_statements(&mut self, tick: u64) -> Result<Vec<u32>, DebugError> {
        self.session.cut_statements(tick)
    }

    /// Sets a variable as the operator would, once. With `force` the variable is held at the value instead; `force`
    /// without a value ends that. The change happens before the tick of the position if none of its statements was
    /// executed yet, otherwise before the next tick. Later ticks are forgotten and run anew. Gives the number of
    /// the tick before which the change happens.
    ///
    /// # Errors
    /// When nothing can be changed here, or not this variable.
    pub fn change(
        &mut self,
        name: &str,
        value: Option<&str>,
        force: bool,
    ) -> Result<u64, DebugError> {
        if let Some(control) = &self.session.control {
            return control.change(name, value, force);
        }
        if !self.session.may_change {
            return Err(DebugError::new(
                "a recording can't be changed; launch the program to set variables, or attach to the control's socket too",
            ));
        }
        let Position { tick, step } = self.position;
        let tick = if step == 0 { tick } else { tick + 1 };
        self.session.history.change(tick, name, value, force)?;
        self.told = self.told.min(tick);
        if tick == self.position.tick {
            self.trace = None;
        }
        Ok(tick)
    }

    /// The file of a path, as the user or an editor writes it.
    pub fn file(&self, path: &str) -> Option<FileId> {
        self.session.program.file(path)
    }
}
