//! A session: what is monitored, what is shown of it, and what the user does. `Session` holds all state; the other
//! files of this folder add the methods for one screen each. What a method does that carries out a command is said at
//! that [`Command`].

mod confirm;
mod costs;
mod events;
mod export;
mod io;
mod machine;
mod online;
mod panels;
mod read;
mod samples;
mod scope;
mod statements;
pub(crate) mod store;
mod tasks;
#[cfg(test)]
mod tests;
mod time;
mod timing;
mod values;
mod versions;
mod watch;
mod why;

use std::collections::BTreeSet;
use std::fmt;
use std::path::PathBuf;

use plcc_frontend::common::StatementInterpreter;
use plcc_replay::Debugger;
use plcc_runtime::Event;

use crate::flow::{Flow, Traces};
use crate::link::Link;
use crate::text::ProgramText;
use crate::view::{Body, Screen, Status, TargetKind, View, WhyView};
use crate::{Command, Rebuilder, Refusal, Reply};
use confirm::Confirm;
use costs::Costs;
use io::IoState;
use machine::MachineState;
pub(crate) use machine::no_machine;
use online::OnlineState;
pub(crate) use online::no_terminal;
use scope::ScopeState;
use statements::StatementState;
use store::Store;
pub(crate) use time::ShownTick;
use time::Time;
use timing::Skipped;
use watch::WatchState;

/// What a session monitors: a control, a recording or a program.
pub struct Target<'a> {
    /// What kind of thing it is.
    pub kind: TargetKind,
    /// Its name, for people.
    pub name: String,
    /// The program with its run or recording. Without it there are neither statements nor the past.
    pub run: Option<plcc_replay::Session<'a>>,
    /// The socket of a control.
    pub socket: Option<PathBuf>,
    /// The folder in which watch lists and the like are kept; nothing is kept without it. See
    /// [`state_folder`](crate::state_folder).
    pub state_folder: Option<PathBuf>,
    /// How fast a program runs that the session runs itself: 1 is real time, 0 as fast as possible.
    pub speed: f64,
    /// Whether an operator uses it, who sees messages, keys and lamps, and presses keys.
    pub operator: bool,
    /// Builds the program of a control with a changed delay or constant; without it these can't be changed.
    pub rebuilder: Option<Box<dyn Rebuilder>>,
}

impl fmt::Debug for Target<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Target").field("kind", &self.kind).field("name", &self.name).finish()
    }
}

/// One user's view of one program: what is shown, and what the user may do.
pub struct Session<'a> {
    kind: TargetKind,
    name: String,
    debugger: Option<Debugger<'a>>,
    interpreter: Option<Box<dyn StatementInterpreter>>,
    /// By a statement's number, whether it has a place in the source; others are not shown.
    placed: Vec<bool>,
    /// The tick that the executive of the run has run last, if that is known. Variables after this tick can be read
    /// from it without running anything again.
    executive_tick: Option<u64>,
    text: ProgramText,
    time: Time,
    traces: Traces,
    /// The flow that was computed last, with its tick.
    flow: Option<(u64, Flow)>,
    events: Vec<Event>,
    /// Ticks that the clock left out.
    skipped: Vec<Skipped>,
    link: Option<Link>,
    rebuilder: Option<Box<dyn Rebuilder>>,
    /// The version of the program that is shown: the number of online changes before it.
    generation: u16,
    /// Names that the control can't read.
    unreadable: BTreeSet<String>,
    store: Store,
    statements: StatementState,
    watch: WatchState,
    io: IoState,
    scope: ScopeState,
    online: OnlineState,
    machine: MachineState,
    /// What lines have cost.
    costs: Costs,
    /// The answer to the last question why.
    why: Option<WhyView>,
    confirm: Confirm,
    /// Whether an operator uses it.
    pub(crate) operator: bool,
}

impl fmt::Debug for Session<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Session").field("name", &self.name).field("time", &self.time).finish()
    }
}

impl<'a> Session<'a> {
    /// A session that shows the newest tick: of a recording its last one, of a program the first.
    pub fn open(target: Target<'a>) -> Self {
        let Target { kind, name, run, socket, state_folder, speed, operator, rebuilder } = target;
        let mut debugger = run.map(Debugger::new);
        let names = debugger.as_mut().map(|debugger| debugger.history_mut().executive().names());
        let machine = names.map_or_else(MachineState::default, |names| MachineState::new(&*names));
        let text = debugger.as_ref().map(|debugger| ProgramText::new(debugger.program()));
        let text = text.unwrap_or_default();
        let program = debugger.as_ref().map(Debugger::program);
        let interpreter = program.map(|program| program.checked().statement_interpreter());
        let placed = program.map_or(vec![], |program| program.places().placed());
        let time = Time::new(debugger.as_ref(), speed);
        let generation = debugger.as_ref().map_or(0, Debugger::generation);
        let files = debugger.as_ref().map(|debugger| &debugger.program().tables().files);
        let program = files.and_then(|files| files.first()).unwrap_or(&name);
        let store = Store::open(state_folder.as_deref(), program);
        let statements = StatementState::new(&text, store.statements());
        Self {
            kind,
            name,
            debugger,
            interpreter,
            placed,
            executive_tick: None,
            text,
            time,
            traces: Traces::default(),
            flow: None,
            events: vec![],
            skipped: vec![],
            link: socket.as_deref().map(Link::new),
            rebuilder,
            generation,
            unreadable: BTreeSet::new(),
            store,
            statements,
            watch: WatchState::default(),
            io: IoState::default(),
            scope: ScopeState::default(),
            online: OnlineState::default(),
            machine,
            costs: Costs::default(),
            why: None,
            confirm: Confirm::default(),
            operator,
        }
    }

    /// What is shown of a screen.
    pub fn view(&mut self, screen: &Screen) -> View {
        let body = self
            .enter_version_of(self.time.shown)
            .and_then(|()| self.body(screen))
            .unwrap_or_else(|refusal| Body::Status { reason: Some(refusal.message) });
        View { status: self.status(), body }
    }

    fn body(&mut self, screen: &Screen) -> Result<Body, Refusal> {
        if self.operator && !matches!(screen, Screen::Operator | Screen::Status) {
            return Err(Refusal::new("an operator sees the operator's screen alone"));
        }
        Ok(match screen {
            Screen::Status => Body::Status { reason: None },
            Screen::Statements { first, count } => {
                Body::Statements(self.statements_view(*first, *count)?)
            }
            Screen::Directory => Body::Directory(self.directory()?),
            Screen::References { name } => Body::References(self.references(name)?),
            Screen::Why => Body::Why(self.why_view()?),
            Screen::Tasks => Body::Tasks(self.tasks_view()?),
            Screen::Variables => Body::Variables(self.variables_view()?),
            Screen::Io => Body::Io(self.io_view()?),
            Screen::Events => Body::Events(self.events_view()?),
            Screen::Timing => Body::Timing(self.timing_view()?),
            Screen::Terminal => Body::Terminal(self.terminal_view()?),
            Screen::Operator => Body::Operator(self.operator_view()?),
            Screen::Panels => Body::Panels(self.panels_view()?),
            Screen::Machine => Body::Machine(self.machine_view()?),
            Screen::Scope { samples } => Body::Scope(self.scope_view(*samples)?),
        })
    }

    /// Does what the user wants.
    ///
    /// # Errors
    /// When it can't be done, or is not allowed.
    pub fn apply(&mut self, command: Command) -> Result<Reply, Refusal> {
        self.time.note = None;
        // What was confirmed counts for the next command alone.
        let is_confirmation = command == Command::ConfirmWarning;
        self.confirm.is_asked &= is_confirmation;
        let reply = self.carry_out(command);
        self.confirm.is_confirmed &= is_confirmation;
        self.keep_statements();
        reply
    }

    fn carry_out(&mut self, command: Command) -> Result<Reply, Refusal> {
        self.enter_version_of(self.time.shown)?;
        if self.operator {
            self.check_operator(&command)?;
        }
        match command {
            Command::Follow => self.follow(),
            Command::Pause => self.pause(),
            Command::GoToTick { tick } => self.go_to_tick(tick),
            Command::MoveTicks { by } => self.move_ticks(by),
            Command::MoveScans { by } => self.move_scans(by),
            Command::PreviousChange { name } => self.previous_change(&name),
            Command::Why { name, tick } => self.ask_why(&name, tick),
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
            Command::Watch { names } => self.watch(&names),
            Command::Unwatch { name } => self.unwatch(&name),
            Command::ClearWatch => self.clear_watch(),
            Command::SetFormat { name, format } => self.set_format(&name, format),
            Command::ChooseList { list } => self.choose_list(&list),
            Command::RemoveList { list } => self.remove_list(&list),
            Command::Change { name, value } => self.change(&name, &value),
            Command::Rollback => self.rollback(),
            Command::ConfirmWarning => self.confirm_warning(),
            Command::Force { name, value } => self.force(&name, &value),
            Command::Release { name } => self.release(&name),
            Command::ReleaseAll => self.release_all(),
            Command::Online { line } => self.online(&line),
            Command::ScopeAdd { names } => self.scope_add(&names),
            Command::ScopeRemove { name } => self.scope_remove(&name),
            Command::ScopeRange { from, to } => self.scope_show(from, to),
            Command::ScopeWidth { ticks } => self.scope_width(ticks),
            Command::ScopeTrigger { trigger } => self.scope_trigger(trigger),
            Command::ScopeNextTrigger => self.scope_next_trigger(),
            Command::ScopeCursor { cursor, tick } => self.scope_cursor(cursor, tick),
            Command::ScopeSave { name } => self.scope_save(&name),
            Command::ScopeLoad { name } => self.scope_load(&name),
            Command::ScopeExport { format } => self.scope_export(format),
        }
    }

    /// What stands around every screen.
    pub fn status(&self) -> Status {
        let tick_ns = self.debugger.as_ref().map_or(0, Debugger::tick_ns);
        let tick = self.time.shown;
        let program = self.debugger.as_ref().map(Debugger::program);
        let first = self.first();
        let language = self.language();
        let control = self.link.as_ref().and_then(|link| link.status());
        let unreachable = self.link.as_ref().and_then(|link| link.error());
        Status {
            kind: self.kind,
            name: self.name.clone(),
            program: program
                .and_then(|program| program.tables().files.first().cloned())
                .or_else(|| Some(control?.program.clone()))
                .unwrap_or_default(),
            dialect: language.map_or("", |language| language.dialect().name()).into(),
            chooses_statements: language.is_some_and(|language| language.chooses_statements()),
            part_title: language.map_or("", |language| language.part_title()).into(),
            has_terminal: language.is_some_and(|language| language.terminal().is_some()),
            has_machine: self.machine.exists(),
            state: self.state(),
            reason: unreachable.map(str::to_owned).or_else(|| self.time.stopped.clone()),
            tick,
            seconds: tick as f64 * tick_ns as f64 / 1e9,
            following: self.time.following,
            first_tick: first,
            last_tick: self.time.run_until.saturating_sub(1).max(first),
            tick_ns,
            operator: self.operator,
            past: self.is_past(),
            time: self.time_of(tick),
            forces: self.forces(),
            announced: self.announced(),
            may_write: self.allows("write"),
            may_force: self.allows("force"),
            may_swap: self.allows("swap"),
            control_ticks: control.map(|status| status.ticks),
            note: self.note(),
        }
    }

    /// Saves the chosen statements for the next session, if others are chosen than before.
    fn keep_statements(&mut self) {
        let numbers = self.statements.chosen_numbers(&self.text);
        if self.store.keep_statements(numbers) {
            // A failure is shown when a watch list is saved; the statements are chosen all the same.
            let _ = self.save();
        }
    }

    /// What the user should know.
    fn note(&self) -> Option<String> {
        let status = self.link.as_ref().and_then(|link| link.status());
        let newest = self.debugger.as_ref().map(|debugger| debugger.newest_generation());
        if let (Some(status), Some(newest)) = (status, newest)
            && status.generation > u64::from(newest)
        {
            let what = "the control's program was replaced; its record will show the new one";
            return Some(what.into());
        }
        self.time.note.clone()
    }

    fn debugger(&mut self) -> Result<&mut Debugger<'a>, Refusal> {
        self.debugger.as_mut().ok_or_else(|| {
            Refusal::new(
                "there is no record of this control, so that its statements and its past are not \
                 known; start it with --record, and name the program's source after the socket",
            )
        })
    }
}
