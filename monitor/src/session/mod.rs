//! One user's view of one program.

mod statements;
#[cfg(test)]
mod tests;
mod time;
mod values;

use std::fmt;

use plcc_debugger::Debugger;
use plcc_runtime::Event;

use crate::flow::{Flow, Traces};
use crate::text::ProgramText;
use crate::view::{Body, Screen, Status, TargetKind, View};
use crate::{Command, Refusal, Reply};
use statements::StatementState;
use time::Time;

/// What a session monitors.
pub struct Opened<'a> {
    /// What kind of thing it is.
    pub kind: TargetKind,
    /// Its name, for people.
    pub name: String,
    /// The program with its run or recording. Without it there are neither statements nor the past.
    pub run: Option<plcc_debugger::Session<'a>>,
    /// How fast a program runs that the session runs itself: 1 is real time, 0 as fast as possible.
    pub speed: f64,
}

impl fmt::Debug for Opened<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Opened").field("kind", &self.kind).field("name", &self.name).finish()
    }
}

/// One user's view of one program: what is shown, and what the user may do.
pub struct Session<'a> {
    kind: TargetKind,
    name: String,
    debugger: Option<Debugger<'a>>,
    text: ProgramText,
    time: Time,
    traces: Traces,
    /// The flow that was computed last, with its tick.
    flow: Option<(u64, Flow)>,
    events: Vec<Event>,
    statements: StatementState,
}

impl fmt::Debug for Session<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Session").field("name", &self.name).field("time", &self.time).finish()
    }
}

impl<'a> Session<'a> {
    /// A session that shows the newest tick: of a recording its last one, of a program the first.
    pub fn open(opened: Opened<'a>) -> Self {
        let Opened { kind, name, run, speed } = opened;
        let debugger = run.map(Debugger::new);
        let text = debugger.as_ref().map(|debugger| ProgramText::new(debugger.program()));
        let text = text.unwrap_or_default();
        let time = Time::new(debugger.as_ref(), speed);
        let statements = StatementState::new(&text);
        Self {
            kind,
            name,
            debugger,
            text,
            time,
            traces: Traces::default(),
            flow: None,
            events: vec![],
            statements,
        }
    }

    /// What is shown of a screen.
    pub fn view(&mut self, screen: &Screen) -> View {
        let body = self
            .body(screen)
            .unwrap_or_else(|refusal| Body::Status { reason: Some(refusal.message) });
        View { status: self.status(), body }
    }

    fn body(&mut self, screen: &Screen) -> Result<Body, Refusal> {
        Ok(match screen {
            Screen::Status => Body::Status { reason: None },
            Screen::Statements { first, count } => {
                Body::Statements(self.statements_view(*first, *count)?)
            }
            Screen::Directory => Body::Directory(self.directory()?),
            Screen::References { name } => Body::References(self.references(name)?),
            _ => return Err(Refusal::new("this screen is not available yet")),
        })
    }

    /// Does what the user wants.
    ///
    /// # Errors
    /// When it can't be done, or is not allowed.
    pub fn apply(&mut self, command: Command) -> Result<Reply, Refusal> {
        match command {
            Command::Follow => self.follow(),
            Command::Pause => self.pause(),
            Command::GoToTick { tick } => self.go_to_tick(tick),
            Command::MoveTicks { by } => self.move_ticks(by),
            Command::MoveScans { by } => self.move_scans(by),
            Command::PreviousChange { name } => self.previous_change(&name),
            Command::SetSpeed { speed } => self.set_speed(speed),
            Command::ShowProgram => self.show_program(),
            Command::ClearStatements => self.clear_statements(),
            Command::ChooseStatements { rows } => self.choose_statements(&rows),
            Command::FindNames { names, uses, all } => self.find_names(names, uses, all),
            Command::FindNext => self.find_next(),
            Command::NextStatement => self.next_statement(),
            Command::PreviousStatement => self.previous_statement(),
            Command::MoveCursor { by } => self.move_cursor(by),
            Command::PutCursor { row } => self.put_cursor(row),
            Command::Module { down } => self.module(down),
            Command::Condition => self.condition(),
            Command::Search { text, up } => self.search(&text, up),
            Command::ToggleValues => self.toggle_values(),
            _ => Err(Refusal::new("this can't be done yet")),
        }
    }

    /// What stands around every screen.
    pub fn status(&self) -> Status {
        let tick_ns = self.debugger.as_ref().map_or(0, Debugger::tick_ns);
        let tick = self.time.shown;
        let program = self.debugger.as_ref().map(Debugger::program);
        let first = self.debugger.as_ref().map_or(0, |debugger| debugger.history().first());
        let may_change = self.debugger.as_ref().is_some_and(Debugger::may_change);
        Status {
            kind: self.kind,
            name: self.name.clone(),
            program: program
                .and_then(|program| program.tables().files.first().cloned())
                .unwrap_or_default(),
            dialect: program
                .map_or_else(String::new, |program| program.tables().dialect().name().into()),
            state: self.state().into(),
            reason: self.time.stopped.clone(),
            tick,
            seconds: tick as f64 * tick_ns as f64 / 1e9,
            following: self.time.following,
            first_tick: first,
            last_tick: self.time.seen.saturating_sub(1).max(first),
            tick_ns,
            forces: vec![],
            may_write: may_change,
            may_force: may_change,
            note: self.time.note.clone(),
        }
    }

    fn debugger(&mut self) -> Result<&mut Debugger<'a>, Refusal> {
        self.debugger.as_mut().ok_or_else(|| {
            Refusal::new(
                "there is no record of this control, so that its statements and its past are not \
                 known; start it with --record, and name the program's source behind the socket",
            )
        })
    }
}
