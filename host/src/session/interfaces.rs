//! What acts on a run from outside and shows it to the outside: the image file (`--image`) and the
//! socket (`--socket`).

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use plcc_abi::machine::Machine;
use plcc_abi::{Engine, Outcome, Program, ResumePoint, Scan};

use crate::args::RunArgs;
use crate::image_file::{Content, ImageFileError, Publisher, SymbolTable};
use crate::journal::Journal;
use crate::run::{Stimulus, Timing};
use crate::socket::{
    Admitted, InterfaceHook, Loaded, Requests, RunProgress, RunServices, Server, is_in_use, queues,
};
use plcc_control::Watch;
use plcc_load::Artifact;
use plcc_load::signature::PublicKey;
use plcc_record::{RecordedProgram, RecordedPrograms, RecorderProgram};
use plcc_runtime::{Executive, NativeEngine, VariableKey};
use plcc_simulator::Strictness;

use super::SessionError;
use super::predecessor::Predecessor;
use super::retained_data::RetainedData;
use plcc_control::executive;

/// The image file and the socket of a run, as far as it has them.
pub(super) struct Interfaces {
    /// What the thread that runs the ticks does for them.
    pub(super) hook: InterfaceHook,
    /// Ends the socket's thread when it is dropped.
    _server: Option<Server>,
}

/// Makes the executive of a program as all options of a run say.
fn configured(
    program: &Program,
    args: &RunArgs,
    machine: Option<&Machine>,
    journal: &Journal,
) -> Result<Box<dyn Executive + Send>, String> {
    let made = executive(program, &args.control, args.realtime, machine);
    let mut executive = made.map_err(|error| error.to_string())?;
    if let Some(simulation) = &args.simulation {
        let made =
            simulation.beside(executive, program, &args.control, machine, Strictness::SwitchOff);
        let made = made.map_err(|errors| errors.join("; "))?;
        made.notes.into_iter().for_each(|note| journal.note(note));
        executive = Box::new(made.executive);
    }
    let lines = executive.names().safe_lines(&args.safe).map_err(|errors| {
        let errors: Vec<String> = errors.iter().map(|e| format!("--safe: {e}")).collect();
        errors.join("; ")
    })?;
    executive.set_safe_lines(lines);
    Ok(executive)
}

/// The engine of a program that takes another one's place. The times of its scans are recorded for the
/// tasks of the same names in the first program; those of further tasks are not recorded.
struct TimedByName {
    engine: NativeEngine,
    timing: Arc<Timing>,
    /// For each task its number among those that are recorded.
    numbers: Vec<Option<usize>>,
}

impl TimedByName {
    fn new(engine: NativeEngine, program: &Program, timing: &Arc<Timing>) -> Self {
        let number = |name: &str| timing.tasks.iter().position(|(recorded, _)| recorded == name);
        let numbers = program.tasks.iter().map(|task| number(&task.name)).collect();
        Self { engine, timing: Arc::clone(timing), numbers }
    }
}

impl Engine for TimedByName {
    fn call(&mut self, task: usize, from: Option<ResumePoint>, scan: &mut Scan<'_>) -> Outcome {
        let start = Instant::now();
        let outcome = self.engine.call(task, from, scan);
        let number = self.numbers.get(task).copied().flatten();
        if let Some((_, times)) = number.and_then(|number| self.timing.tasks.get(number)) {
            times.record(start.elapsed());
        }
        outcome
    }
}

/// Reads an artifact for an online change. With a key it must be signed, as the artifact that the run
/// began with. With `gdb` its code is shown to gdb.
fn load(
    path: &Path,
    key: Option<&PublicKey>,
    gdb: bool,
    timing: &Arc<Timing>,
    record: Option<&RecordedPrograms>,
) -> Result<Loaded, String> {
    let named = |error: &dyn std::fmt::Display| format!("{}: {error}", path.display());
    let opened = Artifact::open_with_bytes(path, key);
    let (artifact, bytes) = opened.map_err(|error| error.with_path(path))?;
    let engine = NativeEngine::new(&artifact.code, &artifact.program);
    let mut engine = engine.map_err(|error| named(&error))?;
    if gdb {
        artifact.show_to_gdb(&mut engine).map_err(|error| named(&error))?;
    }
    let engine = Box::new(TimedByName::new(engine, &artifact.program, timing));
    let record = record.cloned();
    let put_into_record =
        Box::new(move || record.map_or(0, |record| record.add(RecordedProgram::Artifact(bytes))));
    let operator = artifact.operator.map(Arc::new);
    Ok(Loaded { program: artifact.program, operator, engine, put_into_record })
}

/// What the socket shows of a run besides the control and its variables.
pub(super) struct StatusSources<'a> {
    /// Where the retained data is kept, and whether that works.
    pub(super) retained: &'a RetainedData,
    /// How long ticks take.
    pub(super) timing: &'a Arc<Timing>,
    /// Where the record of the run is told the programs of online changes.
    pub(super) recorded: Option<RecordedPrograms>,
}

impl Interfaces {
    /// Makes what the options ask for; `None` where they ask for neither. `executive` is the one that
    /// will run; `stimulus` and `watch` are what sets and shows variables, which must be there after an online change
    /// too.
    pub(super) fn start(
        program: &Program,
        args: &RunArgs,
        machine: Option<&Machine>,
        executive: &dyn Executive,
        (stimulus, watch): (&Stimulus, &Watch),
        sources: StatusSources<'_>,
        (predecessor, journal): (&Predecessor<'_>, &Journal),
    ) -> Result<Option<Self>, SessionError> {
        if args.image.is_none() && args.socket.is_none() {
            return Ok(None);
        }
        let error = |error: &dyn std::fmt::Display| SessionError(error.to_string());
        let publisher = match &args.image {
            None => None,
            Some(path) => {
                let content = Content {
                    program,
                    fingerprint: executive.fingerprint(),
                    image: executive.image(),
                    used: &executive.used_ranges(),
                    tick_ns: executive.tick_ns(),
                    generation: 0,
                    safe_outputs: executive.safe_lines().bytes(),
                    symbols: &SymbolTable::new(&*executive.names()),
                    rules: &args.input_rules,
                };
                let what = format!("the image file {}", path.display());
                let create = || Publisher::create(path, &content);
                let is_held = |error: &ImageFileError| matches!(error, ImageFileError::InUse(..));
                let publisher = predecessor.wait(&what, create, is_held).map_err(|e| error(&e))?;
                if args.realtime && !publisher.is_in_memory() {
                    let path = path.display();
                    journal.note(format!(
                        "the image file {path} is on a disk, for which a tick may have to wait; put \
                         it below /dev/shm or /run"
                    ));
                }
                Some(publisher)
            }
        };
        let progress = Arc::new(RunProgress::default());
        let (mut scan_end, mut server) = (None, None);
        if let Some(path) = &args.socket {
            let names = executive.names();
            let canonical = |key: VariableKey| names.canonical(key);
            let (for_scan, for_socket) = queues();
            let (options, machine, told) = (args.clone(), machine.cloned(), journal.clone());
            let (timing, timing_of_swapped) =
                (Arc::clone(sources.timing), Arc::clone(sources.timing));
            let key = args.public_key().map_err(SessionError)?;
            let recorded = sources.recorded;
            let (queues_of_record, buffer_size) =
                (recorded.clone(), sources.retained.buffer_size());
            let gdb = args.gdb;
            let services = RunServices {
                program: Arc::new(program.clone()),
                operator: args.operator.clone(),
                allow: args.allow.clone(),
                image: args.image.clone(),
                input_rules: args.input_rules.clone(),
                set: stimulus.variables().iter().copied().map(canonical).collect(),
                watched: watch.variables().map(canonical).collect(),
                load: Box::new(move |path| {
                    load(path, key.as_ref(), gdb, &timing_of_swapped, recorded.as_ref())
                }),
                make_executive: Box::new(move |program| {
                    configured(program, &options, machine.as_ref(), &told)
                }),
                timing: Box::new(move || timing.summary()),
                recorder_program: Box::new(move |number, executive| {
                    if let Some(size) = &buffer_size {
                        size.make_room(executive);
                    }
                    let queue = queues_of_record.as_ref().and_then(|r| r.larger_queue(executive));
                    RecorderProgram::new(number, executive, queue)
                }),
                retained: sources.retained.status(args),
                // Clients may be in another folder.
                record: args.record.as_ref().and_then(|path| std::path::absolute(path).ok()),
                journal: journal.clone(),
            };
            let what = format!("the socket {}", path.display());
            let is_free = || if is_in_use(path) { Err(()) } else { Ok(()) };
            // If it is in use even then, the server says so.
            let _ = predecessor.wait(&what, is_free, |()| true);
            let requests = Requests::new(executive, for_socket, Arc::clone(&progress), services);
            let admitted = Admitted::new(&args.allow_user, &args.allow_group);
            server = Some(Server::start(path, admitted, requests).map_err(|e| error(&e))?);
            scan_end = Some(for_scan);
        }
        let hook = InterfaceHook::new(scan_end, publisher, progress, args.stimulus.is_some());
        Ok(Some(Self { hook, _server: server }))
    }
}
