//! What each request does: checks it, hands it to the thread that runs the ticks where that is needed,
//! and makes the reply of the answer.

mod online_change;
mod operator;
mod waiting_change;

use std::collections::{BTreeMap, VecDeque};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use plcc_abi::{Engine, OperatorPanel, Program};
use plcc_image::latch::Rule;
use serde::Serialize;
use serde_json::Value as Json;

use self::online_change::{PendingChange, Previous};
use self::waiting_change::ChangeUnderWay;
use super::commands::{Answer, Batch, Command, RunProgress, SocketEnd};
use super::program::{ForceChange, Holder, Named, NewForce, ServedProgram};
use crate::Peer;
use crate::journal::{EntryKind, Journal};
use crate::replacement::Progress;
use plcc_protocol::{
    Done, ErrorCode, Failure, MAX_NAMES, Permission, Request, Retained, Stat, Status,
    TimingSummary, Values,
};
use plcc_record::RecorderProgram;
use plcc_runtime::variable::MAX_FORCES;
use plcc_runtime::{Executive, Value};

/// An artifact that was read, checked and made ready to run.
pub struct Loaded {
    /// Its program.
    pub program: Program,
    /// What an operator sees of the control's panels.
    pub operator: Option<Arc<OperatorPanel>>,
    /// Its engine.
    pub engine: Box<dyn Engine + Send>,
    /// Puts it into the record of the run, when it is really to run, and gives its number there.
    pub put_into_record: Box<dyn FnOnce() -> u16 + Send>,
}

/// Reads artifacts for online changes.
pub type Load = Box<dyn Fn(&Path) -> Result<Loaded, String> + Send>;
/// Makes the executive of a program as the options of the run say.
pub type MakeExecutive = Box<dyn Fn(&Program) -> Result<Box<dyn Executive + Send>, String> + Send>;
/// Gives the timing of the ticks so far.
pub type Timing = Box<dyn Fn() -> TimingSummary + Send>;

/// Says which file holds the retained data, and why it can't be written, if it can't: nothing where
/// there is no such file.
pub type RetainedStatus = Box<dyn Fn() -> Option<Retained> + Send>;

/// Prepares what follows the control for a program, whose number in the record this is, and its executive: gives
/// what a recorder must know of it.
pub(crate) type MakeRecorderProgram = Box<dyn Fn(u16, &dyn Executive) -> RecorderProgram + Send>;

/// What the socket's thread needs of the run around it.
pub struct RunServices {
    /// The program that runs at the beginning.
    pub program: Arc<Program>,
    /// What an operator sees of its control's panels.
    pub operator: Option<Arc<OperatorPanel>>,
    /// What clients may do besides reading.
    pub allow: Vec<Permission>,
    /// The image file, which an online change makes anew.
    pub image: Option<PathBuf>,
    /// What the configuration says of inputs that other processes give.
    pub input_rules: Vec<(String, Rule)>,
    /// The canonical names of the variables that the stimulus sets, which another program must have too.
    pub set: Vec<String>,
    /// Those of the variables that the trace shows.
    pub watched: Vec<String>,
    /// Reads artifacts.
    pub load: Load,
    /// Makes executives.
    pub make_executive: MakeExecutive,
    /// Gives the timing.
    pub timing: Timing,
    /// Prepares what follows the control for the executive of another program.
    pub(crate) recorder_program: MakeRecorderProgram,
    /// Says how the retained file is.
    pub retained: RetainedStatus,
    /// The file in which the run is recorded.
    pub record: Option<PathBuf>,
    /// Where entries are written that say who did what.
    pub journal: Journal,
}

/// What becomes of a request.
pub(super) enum RequestState {
    /// It is done or refused.
    Done(Result<Json, Failure>),
    /// The thread that runs the ticks carries it out; the reply waits for its answer.
    Pending,
    /// An online change is under way, which may wait for longer.
    Changing,
}

/// An answer of the thread that runs the ticks.
pub(super) enum Answered {
    /// The reply to the request that has waited longest.
    Request(Result<Json, Failure>),
    /// The reply to the request for an online change.
    Change(Result<Json, Failure>),
    /// The online change was not carried out yet.
    ChangeWaits,
}

/// What is done when the thread that runs the ticks has answered a command.
enum Continuation {
    /// The values are put into the reply, under these names.
    Show(Vec<Named>),
    /// The values are shown on the operator's screen.
    Operator,
    /// These entries, which say who did what, are written into the journal.
    Tell(Vec<EntryKind>),
    /// The same for variables that were set: an entry for each item of the batch.
    Set(Vec<EntryKind>),
    /// If nothing was refused, the forces are listed anew, and these entries are written.
    Force { new: Vec<NewForce>, entries: Vec<EntryKind>, by: String },
    /// The online change is finished.
    OnlineChange(Box<PendingChange>),
}

/// Carries out requests.
pub(crate) struct Requests {
    current: ServedProgram,
    previous: Option<Previous>,
    queues: SocketEnd,
    progress: Arc<RunProgress>,
    /// What is done with the next answers, in the order in which they come.
    continuations: VecDeque<Continuation>,
    /// The keys of the operator's screen that are pressed, and by whom.
    pressed: Vec<(String, Peer)>,
    /// Whether the other thread has an online change or a force.
    is_exclusive: bool,
    /// The online change that was asked and is not answered.
    under_way: Option<ChangeUnderWay>,
    /// How many online changes there have been, rollbacks among them.
    generation: u64,
    services: RunServices,
    pub(super) journal: Journal,
}

/// The result of a reply.
fn json(answer: &impl Serialize) -> Result<Json, Failure> {
    serde_json::to_value(answer)
        .map_err(|error| Failure::new(ErrorCode::Internal, error.to_string()))
}

/// A request that is carried out, with its answer.
fn done(answer: &impl Serialize) -> Result<RequestState, Failure> {
    Ok(RequestState::Done(json(answer)))
}

fn busy() -> Failure {
    Failure::new(ErrorCode::Busy, "too many requests wait for the next tick")
}

fn refused(message: impl Into<String>) -> Failure {
    Failure::new(ErrorCode::Refused, message)
}

impl Requests {
    /// Requests to a run. `executive` is the one that will run, or another one of its program.
    pub(crate) fn new(
        executive: &dyn Executive,
        queues: SocketEnd,
        progress: Arc<RunProgress>,
        services: RunServices,
    ) -> Self {
        let panel = services.operator.as_deref();
        let current = ServedProgram::new(Arc::clone(&services.program), panel, executive);
        let journal = services.journal.clone();
        Self {
            current,
            previous: None,
            queues,
            progress,
            continuations: VecDeque::new(),
            pressed: vec![],
            is_exclusive: false,
            under_way: None,
            generation: 0,
            services,
            journal,
        }
    }

    /// Whether the thread that runs the ticks has an online change or a force. Until it has answered no request is
    /// taken, so that each one knows which program runs and what is forced.
    #[cfg(test)]
    pub(super) fn is_exclusive(&self) -> bool {
        self.is_exclusive
    }

    /// Carries out a request, or has it carried out.
    pub(super) fn handle(&mut self, request: Request, by: &Peer) -> RequestState {
        if let Some(needed) = request.needs()
            && !needed.is_in(&self.services.allow)
        {
            let what = needed.name();
            let kind =
                EntryKind::Refused { what: format!("a request that needs {what}"), by: by.clone() };
            self.journal.write(kind);
            let text = format!("the control was started without --allow {what}");
            return RequestState::Done(Err(Failure::new(ErrorCode::Denied, text)));
        }
        self.carry_out(request, by).unwrap_or_else(|failure| RequestState::Done(Err(failure)))
    }

    fn carry_out(&mut self, request: Request, by: &Peer) -> Result<RequestState, Failure> {
        match request {
            Request::Status {} => done(&self.status()),
            Request::Stat {} => done(&self.stat()),
            Request::List { pattern, after } => {
                let (pattern, after) = (pattern.as_deref(), after.as_deref());
                done(&self.current.list(pattern, after, MAX_NAMES))
            }
            Request::Get { names } => {
                let (named, items) = self.current.items_to_read(&names)?;
                self.ask(Command::Read(Box::new(Batch::new(items))), Continuation::Show(named))
            }
            Request::Set { values } => {
                let items = self.current.items_to_write(&values)?;
                let entries = values.into_iter().map(|assignment| {
                    let value = assignment.text();
                    EntryKind::Write { name: assignment.name, value, by: by.clone() }
                });
                let continuation = Continuation::Set(entries.collect());
                self.ask(Command::Write(Box::new(Batch::new(items))), continuation)
            }
            Request::Force { values } => {
                let change = self.current.force(&values)?;
                let entries = values.into_iter().map(|assignment| {
                    let value = Some(assignment.text());
                    EntryKind::Force { name: assignment.name, value, by: by.clone() }
                });
                self.ask_to_force(change, entries.collect(), by)
            }
            Request::Unforce { names, all } => {
                let (names, change) = self.current.unforce(&names, all)?;
                let entries = names.into_iter();
                let entries =
                    entries.map(|name| EntryKind::Force { name, value: None, by: by.clone() });
                self.ask_to_force(change, entries.collect(), by)
            }
            Request::Operator {} => self.operator(),
            Request::Press { name, on } => self.press(name, on, by),
            Request::Stop {} => {
                let entry = EntryKind::Control { request: "stop", by: by.clone() };
                self.ask(Command::Stop, Continuation::Tell(vec![entry]))
            }
            Request::Start {} => {
                let entry = EntryKind::Control { request: "start", by: by.clone() };
                self.ask(Command::Start, Continuation::Tell(vec![entry]))
            }
            Request::Swap { path, accept, dry_run, wait } => {
                self.swap(&path, &accept, dry_run, wait, by)
            }
            Request::Rollback { wait } => self.rollback(wait, by),
            Request::Cancel {} => {
                if self.under_way.is_none() {
                    return Err(refused("no online change waits"));
                }
                self.give_up_change(format!("{by} has cancelled it"));
                let entry = EntryKind::Control { request: "cancel", by: by.clone() };
                done(&self.tell(vec![entry], self.progress.ticks()))
            }
        }
    }

    fn ask_to_force(
        &mut self,
        ForceChange { items, new }: ForceChange,
        entries: Vec<EntryKind>,
        by: &Peer,
    ) -> Result<RequestState, Failure> {
        // The other thread allocates nothing.
        let batch = Batch { forces: Vec::with_capacity(MAX_FORCES), ..Batch::new(items) };
        let continuation = Continuation::Force { new, entries, by: by.to_string() };
        let asked = self.ask(Command::Force(Box::new(batch)), continuation)?;
        self.is_exclusive = true;
        Ok(asked)
    }

    /// Hands a command to the thread that runs the ticks.
    fn ask(
        &mut self,
        command: Command,
        continuation: Continuation,
    ) -> Result<RequestState, Failure> {
        self.queues.commands.push(command).map_err(|_| busy())?;
        self.continuations.push_back(continuation);
        Ok(RequestState::Pending)
    }

    /// Refuses a request that needs room in the queue when there is none.
    fn check_room(&self) -> Result<(), Failure> {
        if self.queues.commands.slots() == 0 { Err(busy()) } else { Ok(()) }
    }

    fn status(&self) -> Status {
        Status {
            state: self.progress.state().name().to_owned(),
            ticks: self.progress.ticks(),
            dialect: self.current.program.dialect().name().to_owned(),
            program: self.current.title.clone(),
            fingerprint: format!("{:016x}", self.current.fingerprint),
            generation: self.generation,
            rollback_to: self.previous.as_ref().map(|previous| previous.program.title.clone()),
            waiting_change: self.shown_waiting_change(Instant::now()),
            process: std::process::id(),
            forces: self.current.shown_forces(),
            forced_by: self.current.holders(),
            allow: self.services.allow.iter().map(|one| one.name().to_owned()).collect(),
            retained: (self.services.retained)(),
            record: self.services.record.as_ref().map(|path| path.display().to_string()),
        }
    }

    fn stat(&self) -> Stat {
        Stat {
            timing: (self.services.timing)(),
            ticks_done: self.progress.ticks(),
            forces: self.current.shown_forces(),
        }
    }

    /// The next answer; `None` as long as it has not come. Answers come in the order of the commands.
    pub(super) fn next_answer(&mut self) -> Option<Answered> {
        let Answer { command, tick, took } = self.queues.answers.pop().ok()?;
        let continuation = self.continuations.pop_front()?;
        match (command, continuation) {
            (Command::Replace(replacement), Continuation::OnlineChange(change)) => {
                self.is_exclusive = false;
                if let Progress::Waits(_) = replacement.progress {
                    self.set_aside(replacement, change);
                    return Some(Answered::ChangeWaits);
                }
                Some(Answered::Change(self.change(*replacement, *change, tick, took)))
            }
            (command, continuation) => {
                Some(Answered::Request(self.reply(command, continuation, tick)))
            }
        }
    }

    /// The reply to a request whose command was carried out before a tick.
    fn reply(
        &mut self,
        command: Command,
        continuation: Continuation,
        tick: u64,
    ) -> Result<Json, Failure> {
        match (command, continuation) {
            (Command::Read(batch), Continuation::Show(named)) => {
                json(&values(&named, &batch, tick))
            }
            (Command::Read(batch), Continuation::Operator) => {
                json(&self.operator_screen(&batch, tick)?)
            }
            (Command::Force(batch), Continuation::Force { mut new, entries, by }) => {
                self.is_exclusive = false;
                if let Some((number, why)) = batch.refused {
                    let item = batch.items.get(number);
                    let name = item
                        .map_or_else(String::new, |item| self.current.names.canonical(item.key));
                    return Err(refused(format!("`{name}` {why}")));
                }
                for force in &mut new {
                    force.holder = Some(Holder { by: by.clone(), tick });
                }
                self.current.set_forces(batch.forces, &new);
                json(&self.tell(entries, tick))
            }
            (Command::Write(batch), Continuation::Set(mut entries)) => match batch.refused {
                None => json(&self.tell(entries, tick)),
                Some((number, why)) => {
                    let name = match entries.get(number) {
                        Some(EntryKind::Write { name, .. }) => name.clone(),
                        _ => String::new(),
                    };
                    // What was set in earlier ticks has happened.
                    entries.truncate(batch.done);
                    self.tell(entries, tick);
                    Err(refused(format!("`{name}` {why}")))
                }
            },
            (_, Continuation::Tell(entries)) => json(&self.tell(entries, tick)),
            // Answers come in the order of the commands.
            _ => Err(Failure::new(ErrorCode::Internal, "the answer belongs to another request")),
        }
    }

    /// Writes entries into the journal, and gives the reply that a command was carried out before a tick.
    fn tell(&self, entries: Vec<EntryKind>, tick: u64) -> Done {
        let count = entries.len();
        entries.into_iter().for_each(|entry| self.journal.write(entry));
        Done { ticks: tick, count, forces: self.current.shown_forces() }
    }
}

/// The values of a batch as a reply.
fn values(named: &[Named], batch: &Batch, tick: u64) -> Values {
    let json = |value: &Value| serde_json::from_str(&value.to_string()).unwrap_or(Json::Null);
    let mut items = batch.items.iter().map(|item| json(&item.value));
    let mut values = BTreeMap::new();
    for Named { name, elements } in named {
        let value = match elements {
            None => items.next().unwrap_or(Json::Null),
            Some(count) => Json::Array(items.by_ref().take(*count).collect()),
        };
        values.insert(name.clone(), value);
    }
    let first_ticks = Some(batch.first_tick).filter(|&first| first != tick);
    Values { ticks: tick, first_ticks, values }
}
