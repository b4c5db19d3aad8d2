//! `plcc replay`: runs recorded ticks again, and compares each with what was recorded.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use plcc_control::{Watch, dump};
use plcc_host::run::{End, Trace, TraceFormat};
use plcc_record::{
    Difference, RecordedRun, Recording, ReplayError, Replayed, Replayer, differing_variables,
};
use plcc_runtime::{Event, EventBody};

use crate::args::ReplayArgs;
use crate::failure::{DONE, ERRORS, Failure};
use crate::output;
use crate::recorded::{Found, ReplayEngine};
use crate::replay_input::{
    check_outputs, chosen_run, engine_of, program, replayer, tell_damage, tell_unwritten,
};
use crate::report::Report;

/// A message names at most so many variables that differ.
const MAX_SHOWN: usize = 5;

pub(crate) fn replay(args: &ReplayArgs, report: &Report) -> Result<u8, Failure> {
    let path = &args.record;
    let recording = Recording::open(path).map_err(|error| Failure::usage(error.to_string()))?;
    let outputs = [&args.trace, &args.events, &args.dump];
    check_outputs(path, &args.files, outputs.into_iter().flatten().map(PathBuf::as_path))?;
    if let (Some(from), Some(to)) = (args.from, args.until)
        && from > to
    {
        return Err(Failure::usage(format!("--from {from} is after --until {to}")));
    }
    let run = chosen_run(&recording, args.run, path, report)?;
    tell_damage(&recording, run, report);
    let mut status = DONE;
    let generations = run.generations();
    if generations.len() > 1 && !args.files.is_empty() {
        let what = "the run has online changes; its programs are taken from the record alone";
        return Err(Failure::file(path, what));
    }
    let mut outputs = Outputs::open(args)?;
    for generation in asked_for(args, run, generations) {
        let recorded = run
            .program_of(generation)
            .ok_or_else(|| Failure::file(path, "its program is missing"))?;
        let found = program(path, recorded, &args.files, &args.source, report)?;
        let engine = engine_of(&found, args.engine);
        let replay = Replay { args, report, recording: &recording, run, generation, found, engine };
        status = replay.run(&mut outputs)?;
        if status != DONE {
            break;
        }
    }
    Ok(status)
}

/// The generations that have ticks between `--from` and `--until`; if none has, the nearest one.
fn asked_for(args: &ReplayArgs, run: &RecordedRun, mut generations: Vec<u16>) -> Vec<u16> {
    let first = |generation: &u16| {
        let span = run.spans.iter().find(|span| span.generation == *generation);
        span.map_or(0, |span| span.first)
    };
    let (from, to) = (args.from.unwrap_or(0), args.until.unwrap_or(u64::MAX));
    let begins = generations.iter().rposition(|generation| first(generation) <= from);
    generations.drain(..begins.unwrap_or(0));
    let wanted = generations.iter().filter(|generation| first(generation) <= to).count();
    generations.truncate(wanted.max(1));
    generations
}

/// Where trace and events go.
struct Outputs {
    trace: Option<Box<dyn Write>>,
    events: Option<Box<dyn Write>>,
    header: bool,
}

impl Outputs {
    fn open(args: &ReplayArgs) -> Result<Self, Failure> {
        let open = |path: &Path| -> Result<Box<dyn Write>, Failure> {
            if output::is_stdout(path) {
                return Ok(Box::new(BufWriter::new(io::stdout())));
            }
            let file = File::create(path).map_err(|error| not_written(path, &error))?;
            Ok(Box::new(BufWriter::new(file)))
        };
        let trace = args.trace.as_deref().or_else(|| {
            let printed = [&args.events, &args.dump];
            let taken = printed.into_iter().flatten().any(|path| output::is_stdout(path));
            (!args.watch.is_empty() && !taken).then_some(Path::new("-"))
        });
        Ok(Self {
            trace: trace.map(open).transpose()?,
            events: args.events.as_deref().map(open).transpose()?,
            header: false,
        })
    }
}

fn not_written(path: &Path, error: &io::Error) -> Failure {
    let why = plcc_files::why_not_written(error);
    Failure::file(path, format!("it can't be written: {why}"))
}

/// A replay of the ticks of one program.
struct Replay<'a> {
    args: &'a ReplayArgs,
    report: &'a Report,
    recording: &'a Recording,
    run: &'a RecordedRun,
    generation: u16,
    found: Found,
    engine: ReplayEngine,
}

impl Replay<'_> {
    fn replayer(&self) -> Result<Replayer<'_>, Failure> {
        let Self { args, recording, run, generation, found, .. } = self;
        replayer(&args.record, recording, run, *generation, found)
    }

    fn failed(&self, error: impl std::fmt::Display) -> Failure {
        Failure::file(&self.args.record, error)
    }

    fn run(&self, outputs: &mut Outputs) -> Result<u8, Failure> {
        let args = self.args;
        let mut engine = self.found.engine(self.engine).map_err(|why| self.failed(why))?;
        let mut replayer = self.replayer()?;
        let watch =
            Watch::parse(&args.watch, &*replayer.executive().names()).map_err(|errors| {
                let errors: Vec<String> = errors.iter().map(|e| format!("--watch: {e}")).collect();
                Failure::usage(errors.join("\nerror: "))
            })?;
        let watch = watch.with_aliases(args.aliases);
        let names = replayer.executive().names();
        let (first, _) = replayer.range().map_err(|error| self.failed(error))?;
        let from = args.from.unwrap_or(first).max(first);
        replayer.go_to(from, engine.as_mut()).map_err(|error| self.failed(error))?;
        let format = args
            .trace
            .as_deref()
            .map_or_else(TraceFormat::default, |path| TraceFormat::of(path, args.time));
        let mut trace = Trace::new(&watch, format, &*replayer.executive().names());
        let mut time_ns = replayer.executive().tick_ns().saturating_mul(from);
        let written =
            |error: io::Error| self.failed(format!("an output can't be written: {error}"));
        if let Some(out) = outputs.trace.as_mut().filter(|_| !outputs.header) {
            trace.header(out).map_err(written)?;
        }
        outputs.header = true;
        let mut end = End { ticks: from, ..End::default() };
        let mut events: Vec<Event> = vec![];
        let (mut checked, mut complete) = (0_u64, true);
        while let Some(next) = replayer.next().map(|next| next.tick).or(Some(end.ticks)) {
            if args.until.is_some_and(|to| next > to) {
                complete = false;
                break;
            }
            let tick_ns = replayer.executive().tick_ns();
            events.clear();
            let replayed = replayer.step(engine.as_mut(), &mut events);
            let Some(replayed) = replayed.map_err(|error| self.failed(error))? else { break };
            tell_unwritten(self.run, &replayed, self.report);
            time_ns = time_ns
                .saturating_add(tick_ns.saturating_mul(replayed.tick.saturating_sub(end.ticks)));
            end.ticks = replayed.tick.saturating_add(1);
            if let Some(stop) = &replayed.stop {
                let (file, line) = stop.place.clone().map(|place| (place.file, place.line)).unzip();
                let body = EventBody::Stop { code: stop.code.clone(), file, line };
                events.push(Event { tick: replayed.tick, body });
                end.stop = Some(stop.clone());
            }
            if let Some(out) = &mut outputs.events {
                for event in &events {
                    let event = watch.shown_event(event, &*names);
                    serde_json::to_writer(&mut *out, &*event)
                        .map_err(io::Error::from)
                        .and_then(|()| out.write_all(b"\n"))
                        .map_err(written)?;
                }
            }
            if let Some(out) = &mut outputs.trace {
                let executive = replayer.executive();
                trace.rows((replayed.tick, time_ns), &watch, executive, out).map_err(written)?;
            }
            time_ns = time_ns.saturating_add(tick_ns);
            if !replayed.matches {
                return self.tell_difference(&replayed, &mut replayer);
            }
            checked += u64::from(!replayed.cut);
            if replayed.cut {
                self.tell_cut(&replayed);
            }
        }
        // The end belongs to the last version of the program, even if no tick of that is kept.
        let ends = self.run.spans.last().is_some_and(|span| span.generation == self.generation);
        if complete && ends && !self.end(&mut replayer, &mut end) {
            return Ok(ERRORS);
        }
        for out in [&mut outputs.trace, &mut outputs.events].into_iter().flatten() {
            out.flush().map_err(written)?;
        }
        let is_last = self.run.generations().last() == Some(&self.generation);
        if let Some(path) = args.dump.as_deref().filter(|_| is_last || !complete) {
            let mut text = vec![];
            // Writing to memory does not fail.
            let dialect = self.found.program.dialect();
            let _ = dump(
                &mut text,
                dialect,
                replayer.executive(),
                &watch,
                end.ticks,
                end.stop.as_ref(),
            );
            plcc_host::session::write_whole(path, &text).map_err(|e| not_written(path, &e))?;
        }
        let shown = (from, end.ticks.saturating_sub(1));
        self.report.message(&format!(
            "{checked} ticks, {} to {}, went as they were recorded",
            shown.0, shown.1
        ));
        Ok(DONE)
    }

    /// Replays the end of the run, after the last tick, and completes `end`. Gives whether the state at the end is
    /// the recorded one, as far as it can be compared.
    fn end(&self, replayer: &mut Replayer<'_>, end: &mut End) -> bool {
        let Some((recorded, matches)) = replayer.end() else {
            self.report.note(
                "the record has no end: the process died, or the run goes on; it was replayed up \
                 to the last tick that is there",
            );
            return true;
        };
        end.ticks = end.ticks.max(recorded.ticks);
        if let Some(stop) = recorded.stop.clone() {
            end.ticks = end.ticks.max(recorded.ticks.saturating_add(1));
            end.stop.get_or_insert(stop.into());
        }
        if !matches {
            self.report.message("the state after the last tick is not the recorded one");
        }
        matches
    }

    fn tell_cut(&self, replayed: &Replayed) {
        let why = replayed.stop.as_ref().map_or("", |stop| stop.message.as_str());
        let place = replayed.stop.as_ref().and_then(|stop| stop.place.as_ref());
        let at = place.map_or_else(String::new, |place| format!(", at {place}"));
        self.report.note(&format!(
            "tick {} was stopped in its middle{at} ({why}); it was replayed up to its beginning",
            replayed.tick
        ));
    }

    /// Says how a tick differs, and which variables do.
    fn tell_difference(
        &self,
        replayed: &Replayed,
        replayer: &mut Replayer<'_>,
    ) -> Result<u8, Failure> {
        let tick = replayed.tick;
        let what = match &replayed.difference {
            Some(Difference::State) | None => "the state after it is not the recorded one",
            Some(Difference::Checkpoint(_)) => "the state before it is not that of the checkpoint",
            Some(Difference::Events) => "it reports something else",
            Some(Difference::Stop) => "it does not end as it did",
        };
        self.report.message(&format!("tick {tick} differs from the recorded one: {what}"));
        let program = &self.found.program;
        if let Some(Difference::Checkpoint(image)) = &replayed.difference {
            let own = replayer.executive().image().to_vec();
            self.tell_variables(&differing_variables(program, &own, image), "recorded");
            return Ok(ERRORS);
        }
        let Some(other) = self.found.other_engine(self.engine) else { return Ok(ERRORS) };
        let image = self.image_behind(tick, other).map_err(|error| self.failed(error))?;
        let own = replayer.executive().image().to_vec();
        let name = match other {
            ReplayEngine::Interpreter => "in the statement interpreter",
            ReplayEngine::Jit => "in compiled code",
            ReplayEngine::Aot => "in the artifact",
        };
        let differing = differing_variables(program, &own, &image);
        if differing.is_empty() {
            self.report.message(
                "another engine comes to the same state as this one: it is the recorded run that went \
                 otherwise",
            );
        }
        self.tell_variables(&differing, name);
        Ok(ERRORS)
    }

    fn tell_variables(&self, differing: &[(String, Vec<u8>, Vec<u8>)], other: &str) {
        for (name, own, theirs) in differing.iter().take(MAX_SHOWN) {
            let text = |bytes: &[u8]| {
                let digits: Vec<String> = bytes.iter().rev().map(|b| format!("{b:02x}")).collect();
                format!("${}", digits.concat())
            };
            self.report.message(&format!(
                "  {name} is {} here and {} {other}",
                text(own),
                text(theirs)
            ));
        }
        if differing.len() > MAX_SHOWN {
            self.report.message(&format!("  and {} more", differing.len() - MAX_SHOWN));
        }
    }

    /// The process image after a tick in another engine.
    fn image_behind(&self, tick: u64, engine: ReplayEngine) -> Result<Vec<u8>, ReplayError> {
        let (Ok(mut engine), Ok(mut replayer)) = (self.found.engine(engine), self.replayer())
        else {
            return Ok(vec![]);
        };
        replayer.go_to(tick, engine.as_mut())?;
        replayer.step(engine.as_mut(), &mut vec![])?;
        Ok(replayer.executive().image().to_vec())
    }
}
