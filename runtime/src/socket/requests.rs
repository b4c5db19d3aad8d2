//! What each request does: checks it, hands it to the thread that runs the ticks where that is needed,
//! and makes the reply of the answer.

use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use plcc_abi::{Engine, Program};
use plcc_image::latch::Rule;
use serde_json::{Value as Json, json};

use super::commands::{Answer, Batch, Command, Reached, SocketEnd};
use super::program::{Force, ForceChange, Named, Served};
use super::protocol::{Failure, MAX_NAMES, Permission, Request};
use crate::image_file::{Content, Publisher, State, SymbolTable};
use crate::journal::{EntryKind, Journal};
use crate::record::RecorderProgram;
use crate::swap::{Comparison, Replacement, compare};
use crate::{Executive, Peer, Purpose, Value, Variable};

/// An artifact that was read, checked and made ready to run.
pub struct Loaded {
    /// Its program.
    pub program: Program,
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
pub type Timing = Box<dyn Fn() -> Json + Send>;

/// Says which file holds the retained data, and why it can't be written, if it can't: JSON null where
/// there is no such file, else an object.
pub type RetainedStatus = Box<dyn Fn() -> Json + Send>;

/// Prepares what follows the control for a program, whose number in the record this is, and its executive: gives
/// what a recorder must know of it.
pub(crate) type MakeRecorderProgram = Box<dyn Fn(u16, &dyn Executive) -> RecorderProgram + Send>;

/// What the socket's thread needs of the run around it.
pub struct Surroundings {
    /// The program that runs at the beginning.
    pub program: Arc<Program>,
    /// What clients may do besides reading.
    pub allow: Vec<Permission>,
    /// The image file, which an online change makes anew.
    pub image: Option<PathBuf>,
    /// What the configuration says of inputs that other processes give.
    pub input_rules: Vec<(String, Rule)>,
    /// The names of the variables that the trace and the stimulus use: the first is that of the variable
    /// with the number 0, and so on. Another program must give them the same numbers.
    pub found: Vec<String>,
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
    /// Where entries are written that say who did what.
    pub journal: Journal,
}

/// What becomes of a request.
pub(super) enum Handled {
    /// It is done or refused.
    Done(Result<Json, Failure>),
    /// The thread that runs the ticks carries it out; the reply waits for its answer.
    Waits,
}

/// What is done when the thread that runs the ticks has answered a command.
enum OnAnswer {
    /// The values are put into the reply, under these names.
    Show(Vec<Named>),
    /// These entries, which say who did what, are written into the journal.
    Tell(Vec<EntryKind>),
    /// If nothing was refused, these are the forces in effect, and these entries are written.
    Force { forces: Vec<Force>, entries: Vec<EntryKind> },
    /// The online change is finished.
    Exchange(Box<Exchange>),
}

/// An online change that is under way, as the socket's thread remembers it. The other thread has the
/// [`Replacement`] meanwhile.
struct Exchange {
    /// The program that is about to run.
    next: Served,
    comparison: Comparison,
    rollback: bool,
    by: Peer,
}

/// The program that ran before the last online change, ready to run again.
struct Previous {
    served: Served,
    executive: Box<dyn Executive + Send>,
    engine: Option<Box<dyn Engine + Send>>,
}

/// Carries out requests.
pub(crate) struct Requests {
    served: Served,
    previous: Option<Previous>,
    queues: SocketEnd,
    reached: Arc<Reached>,
    /// What is done with the next answers, in the order in which they come.
    on_answers: VecDeque<OnAnswer>,
    /// Whether an online change or a force is under way.
    is_exclusive: bool,
    /// How many online changes there have been, rollbacks among them.
    generation: u64,
    surroundings: Surroundings,
    pub(super) journal: Journal,
}

fn busy() -> Failure {
    Failure::new("busy", "too many requests wait for the next tick")
}

fn refused(message: impl Into<String>) -> Failure {
    Failure::new("refused", message)
}

impl Requests {
    /// Requests to a run. `executive` is another executive of its program, which never runs: it looks up
    /// names, and checks values and forces.
    pub(crate) fn new(
        executive: Box<dyn Executive + Send>,
        queues: SocketEnd,
        reached: Arc<Reached>,
        surroundings: Surroundings,
    ) -> Self {
        let served = Served::new(Arc::clone(&surroundings.program), executive);
        let journal = surroundings.journal.clone();
        Self {
            served,
            previous: None,
            queues,
            reached,
            on_answers: VecDeque::new(),
            is_exclusive: false,
            generation: 0,
            surroundings,
            journal,
        }
    }

    /// Whether an online change or a force is under way. Until it has ended no request is taken, so that each
    /// one knows which program runs and what is forced.
    pub(super) fn is_exclusive(&self) -> bool {
        self.is_exclusive
    }

    /// Carries out a request, or has it carried out.
    pub(super) fn handle(&mut self, request: Request, by: &Peer) -> Handled {
        if let Some(needed) = request.needs()
            && !self.surroundings.allow.contains(&needed)
        {
            let what = needed.name();
            let kind =
                EntryKind::Refused { what: format!("a request that needs {what}"), by: by.clone() };
            self.journal.write(kind);
            let text = format!("the control was started without --allow {what}");
            return Handled::Done(Err(Failure::new("denied", text)));
        }
        self.carry_out(request, by).unwrap_or_else(|failure| Handled::Done(Err(failure)))
    }

    fn carry_out(&mut self, request: Request, by: &Peer) -> Result<Handled, Failure> {
        match request {
            Request::Status => Ok(Handled::Done(Ok(self.status()))),
            Request::Stat => Ok(Handled::Done(Ok(self.stat()))),
            Request::List { pattern, after } => {
                let (pattern, after) = (pattern.as_deref(), after.as_deref());
                let (variables, more) = self.served.list(pattern, after, MAX_NAMES);
                Ok(Handled::Done(Ok(json!({"variables": variables, "more": more}))))
            }
            Request::Get { names } => {
                let (named, items) = self.served.items_to_read(&names)?;
                self.ask(Command::Read(Box::new(Batch::new(items))), OnAnswer::Show(named))
            }
            Request::Set { values } => {
                let items = self.served.items_to_write(&values)?;
                let entries = values.into_iter().map(|assignment| {
                    let value = assignment.text();
                    EntryKind::Write { name: assignment.name, value, by: by.clone() }
                });
                let on_answer = OnAnswer::Tell(entries.collect());
                self.ask(Command::Write(Box::new(Batch::new(items))), on_answer)
            }
            Request::Force { values } => {
                let change = self.served.force(&values)?;
                let entries = values.into_iter().map(|assignment| {
                    let value = Some(assignment.text());
                    EntryKind::Force { name: assignment.name, value, by: by.clone() }
                });
                self.ask_to_force(change, entries.collect())
            }
            Request::Unforce { names, all } => {
                let (names, change) = self.served.unforce(&names, all)?;
                let entries = names.into_iter();
                let entries =
                    entries.map(|name| EntryKind::Force { name, value: None, by: by.clone() });
                self.ask_to_force(change, entries.collect())
            }
            Request::Stop => {
                let entry = EntryKind::Control { request: "stop", by: by.clone() };
                self.ask(Command::Stop, OnAnswer::Tell(vec![entry]))
            }
            Request::Start => {
                let entry = EntryKind::Control { request: "start", by: by.clone() };
                self.ask(Command::Start, OnAnswer::Tell(vec![entry]))
            }
            Request::Swap { path, accept, dry_run } => self.swap(&path, &accept, dry_run, by),
            Request::Rollback => self.rollback(by),
        }
    }

    fn ask_to_force(
        &mut self,
        ForceChange { items, forces }: ForceChange,
        entries: Vec<EntryKind>,
    ) -> Result<Handled, Failure> {
        let batch = Batch { forces: forces.len() as u64, ..Batch::new(items) };
        let on_answer = OnAnswer::Force { forces, entries };
        let asked = self.ask(Command::Force(Box::new(batch)), on_answer)?;
        self.is_exclusive = true;
        Ok(asked)
    }

    /// Hands a command to the thread that runs the ticks.
    fn ask(&mut self, command: Command, on_answer: OnAnswer) -> Result<Handled, Failure> {
        self.queues.commands.push(command).map_err(|_| busy())?;
        self.on_answers.push_back(on_answer);
        Ok(Handled::Waits)
    }

    /// Refuses a request that needs room in the queue when there is none.
    fn check_room(&self) -> Result<(), Failure> {
        if self.queues.commands.slots() == 0 { Err(busy()) } else { Ok(()) }
    }

    fn status(&self) -> Json {
        let allow: Vec<&str> = self.surroundings.allow.iter().map(|one| one.name()).collect();
        json!({
            "state": self.reached.state().name(),
            "ticks": self.reached.ticks(),
            "dialect": self.served.program.dialect().name(),
            "program": self.served.title,
            "fingerprint": format!("{:016x}", self.served.executive.fingerprint()),
            "generation": self.generation,
            "rollback_to": self.previous.as_ref().map(|previous| &previous.served.title),
            "process": std::process::id(),
            "forces": self.served.forces_json(),
            "allow": allow,
            "retained": (self.surroundings.retained)(),
        })
    }

    fn stat(&self) -> Json {
        let mut timing = (self.surroundings.timing)();
        if let Some(map) = timing.as_object_mut() {
            map.insert("ticks_done".into(), self.reached.ticks().into());
            map.insert("forces".into(), self.served.forces_json());
        }
        timing
    }

    /// The reply to the request that has waited longest; `None` as long as its answer has not come.
    pub(super) fn next_answer(&mut self) -> Option<Result<Json, Failure>> {
        let Answer { command, tick, took } = self.queues.answers.pop().ok()?;
        let on_answer = self.on_answers.pop_front()?;
        Some(match (command, on_answer) {
            (Command::Read(batch), OnAnswer::Show(named)) => Ok(values(&named, &batch, tick)),
            (Command::Replace(replacement), OnAnswer::Exchange(exchange)) => {
                self.is_exclusive = false;
                self.exchange(*replacement, *exchange, tick, took)
            }
            (Command::Force(batch), OnAnswer::Force { forces, entries }) => {
                self.is_exclusive = false;
                if let Some((number, why)) = batch.refused {
                    let key = batch.items.get(number).map(|item| item.key);
                    let force = forces.iter().find(|force| Some(force.key) == key);
                    let name = force.map_or("", |force| force.name.as_str());
                    return Some(Err(refused(format!("`{name}` {why}"))));
                }
                self.served.forces = forces;
                Ok(self.tell(entries, tick))
            }
            (_, OnAnswer::Tell(entries)) => Ok(self.tell(entries, tick)),
            // Answers come in the order of the commands.
            _ => Err(Failure::new("internal", "the answer belongs to another request")),
        })
    }

    /// Writes entries into the journal, and gives the reply that a command was carried out before a tick.
    fn tell(&self, entries: Vec<EntryKind>, tick: u64) -> Json {
        let count = entries.len();
        entries.into_iter().for_each(|entry| self.journal.write(entry));
        json!({"ticks": tick, "count": count, "forces": self.served.forces_json()})
    }

    /// Compares another artifact with the program that runs, and has it take its place.
    fn swap(
        &mut self,
        path: &Path,
        accept: &[String],
        dry_run: bool,
        by: &Peer,
    ) -> Result<Handled, Failure> {
        let Loaded { program, engine, put_into_record } =
            (self.surroundings.load)(path).map_err(refused)?;
        let comparison = compare(&self.served.program, &program).map_err(refused)?;
        if dry_run {
            return Ok(Handled::Done(Ok(comparison_json(&comparison))));
        }
        let names: Vec<&str> = comparison.refused(accept).map(|row| row.name.as_str()).collect();
        if !names.is_empty() {
            let text = format!(
                "these changes are refused unless they are accepted by their names: {}",
                names.join(", ")
            );
            let mut failure = refused(text);
            if let Json::Object(details) = comparison_json(&comparison) {
                failure.details = details;
            }
            return Err(failure);
        }
        let make = &self.surroundings.make_executive;
        let executive = make(&program).map_err(refused)?;
        let own = make(&program).map_err(refused)?;
        let mut next = Served::new(Arc::new(program), own);
        next.title = path.display().to_string();
        next.recorded = put_into_record();
        let exchange = Exchange { next, comparison, rollback: false, by: by.clone() };
        self.replace(exchange, executive, Some(engine))
    }

    /// Has the program run again that the last online change replaced. Changes need not be accepted.
    fn rollback(&mut self, by: &Peer) -> Result<Handled, Failure> {
        let Some(Previous { served: next, mut executive, engine }) = self.previous.take() else {
            return Err(refused("there was no online change that could be taken back"));
        };
        // It still has the forces that were in effect when it was replaced. It gets those of now later.
        for force in &next.forces {
            // Ending a force never fails.
            let _ = executive.force(force.key, None);
        }
        let comparison = compare(&self.served.program, &next.program).map_err(refused)?;
        let exchange = Exchange { next, comparison, rollback: true, by: by.clone() };
        self.replace(exchange, executive, engine)
    }

    /// Prepares a program to take the place of the one that runs, and has it do so.
    fn replace(
        &mut self,
        mut exchange: Exchange,
        mut executive: Box<dyn Executive + Send>,
        engine: Option<Box<dyn Engine + Send>>,
    ) -> Result<Handled, Failure> {
        let allowed = self.served.check_forces(&exchange.comparison).map_err(refused);
        let prepared = allowed.and_then(|()| self.prepare(&mut exchange.next, executive.as_mut()));
        let publisher = match prepared {
            Ok(publisher) => publisher,
            Err(failure) => {
                self.keep_previous(exchange, executive, engine);
                return Err(failure);
            }
        };
        let plan = exchange.comparison.plan.clone();
        let recorder_program =
            (self.surroundings.recorder_program)(exchange.next.recorded, executive.as_ref());
        let replacement =
            Replacement { executive, engine, plan, recorder_program, publisher, failure: None };
        let on_answer = OnAnswer::Exchange(Box::new(exchange));
        let asked = self.ask(Command::Replace(Box::new(replacement)), on_answer)?;
        self.is_exclusive = true;
        Ok(asked)
    }

    /// Puts a program that was to run again back to where it waited.
    fn keep_previous(
        &mut self,
        exchange: Exchange,
        executive: Box<dyn Executive + Send>,
        engine: Option<Box<dyn Engine + Send>>,
    ) {
        if exchange.rollback {
            self.previous = Some(Previous { served: exchange.next, executive, engine });
        }
    }

    /// Makes everything ready that does not depend on the state of the program that runs: forces, the
    /// numbers of variables, the image file.
    fn prepare(
        &mut self,
        next: &mut Served,
        executive: &mut (dyn Executive + Send),
    ) -> Result<Option<Publisher>, Failure> {
        self.check_room()?;
        let force = |key, setting| executive.force(key, Some(setting));
        next.take_forces(&self.served, force).map_err(refused)?;
        for (name, number) in self.surroundings.found.iter().zip(0..) {
            let found = executive.find(name, Purpose::Watch);
            if found != Ok(Variable(number)) {
                return Err(refused(format!(
                    "the trace or the stimulus of this run uses {name}, which the new program can't \
                     provide"
                )));
            }
        }
        let Some(path) = &self.surroundings.image else { return Ok(None) };
        let own = (self.surroundings.make_executive)(&next.program);
        let mut own = own.map_err(refused)?;
        let content = Content {
            program: &next.program,
            fingerprint: executive.fingerprint(),
            image: executive.image(),
            used: &executive.used_ranges(),
            tick_ns: executive.tick_ns(),
            generation: self.generation + 1,
            safe_outputs: executive.safe_lines().bytes(),
            symbols: &SymbolTable::new(&next.program, own.as_mut()),
            rules: &self.surroundings.input_rules,
        };
        Publisher::prepare(path, &content).map(Some).map_err(|error| refused(error.to_string()))
    }

    /// Ends an online change, when the thread that runs the ticks has carried it out.
    fn exchange(
        &mut self,
        replacement: Replacement,
        exchange: Exchange,
        tick: u64,
        took: Duration,
    ) -> Result<Json, Failure> {
        let Replacement { executive, engine, publisher, failure, .. } = replacement;
        if let Some(why) = failure {
            if let Some(path) = &self.surroundings.image {
                Publisher::discard(path);
            }
            self.keep_previous(exchange, executive, engine);
            return Err(refused(why));
        }
        if let Some(path) = &self.surroundings.image
            && let Err(error) = Publisher::put_in_place(path)
        {
            self.journal.error(error.to_string());
        }
        if let Some(mut publisher) = publisher {
            publisher.end(State::Replaced);
        }
        let Exchange { next, comparison, rollback, by } = exchange;
        let served = std::mem::replace(&mut self.served, next);
        self.previous = Some(Previous { served, executive, engine });
        self.generation += 1;
        let artifact = self.served.title.clone();
        self.journal.write(EntryKind::Swap { artifact, rollback, took, by });
        let mut json = comparison_json(&comparison);
        if let Some(map) = json.as_object_mut() {
            map.insert("ticks".into(), tick.into());
            map.insert("took_us".into(), (took.as_nanos() as f64 / 1000.0).into());
            map.insert("generation".into(), self.generation.into());
        }
        Ok(json)
    }
}

/// A comparison as a part of a reply.
fn comparison_json(comparison: &Comparison) -> Json {
    json!({"kept": comparison.kept, "changes": comparison.rows})
}

/// The values of a batch as a reply.
fn values(named: &[Named], batch: &Batch, tick: u64) -> Json {
    let json = |value: &Value| serde_json::from_str(&value.to_string()).unwrap_or(Json::Null);
    let mut items = batch.items.iter().map(|item| json(&item.value));
    let mut values = serde_json::Map::new();
    for Named { name, elements } in named {
        let value = match elements {
            None => items.next().unwrap_or(Json::Null),
            Some(count) => Json::Array(items.by_ref().take(*count).collect()),
        };
        values.insert(name.clone(), value);
    }
    let mut reply = json!({"ticks": tick, "values": values});
    if batch.first_tick != tick
        && let Some(map) = reply.as_object_mut()
    {
        map.insert("first_ticks".into(), batch.first_tick.into());
    }
    reply
}
