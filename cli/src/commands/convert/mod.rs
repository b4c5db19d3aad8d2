//! `plcc convert`: the values of a recorded run as a table, a VCD, an FST or an MCAP file. A record holds no values of
//! variables but what a replay needs, so the values come from a replay.

mod fst;
#[cfg_attr(not(feature = "mcap"), path = "without_mcap.rs")]
mod mcap;

use std::collections::HashMap;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use plcc_control::Watch;
use plcc_files::{open_output, why_not_written};
use plcc_host::run::{TraceFormat, TraceText};
use plcc_record::{RecordedRun, Recording};
use plcc_runtime::{Event, Executive, NameError, Names, Purpose, VariableKey, names_of};

use crate::args::{ConvertArgs, ConvertFormat};
use crate::failure::{DONE, ERRORS, Failure};
use crate::output;
use crate::recorded::Found;
use crate::replay_input::{
    check_outputs, chosen_run, engine_of, program, replayer, tell_damage, tell_unwritten,
};
use crate::report::Report;
use fst::Fst;
use mcap::Mcap;

pub(crate) fn convert(args: &ConvertArgs, report: &Report) -> Result<u8, Failure> {
    let path = &args.record;
    let recording = Recording::open(path).map_err(|error| Failure::usage(error.to_string()))?;
    if let (Some(from), Some(until)) = (args.from, args.until)
        && from > until
    {
        return Err(Failure::usage(format!("--from {from} is after --until {until}")));
    }
    let to = args.output.clone().unwrap_or_else(|| named(path, args.to));
    if output::is_stdout(&to) && !matches!(args.to, ConvertFormat::Vcd | ConvertFormat::Csv) {
        let what = "this format is not written to standard output; name a file with -o";
        return Err(Failure::usage(what));
    }
    overwrites_nothing(&to, args)?;
    let run = chosen_run(&recording, args.run, path, report)?;
    tell_damage(&recording, run, report);
    let failed = |error: &dyn std::fmt::Display| Failure::file(path, error);
    let programs = programs_of(&recording, run, args, report)?;
    let first = programs.iter().map(|program| program.range.0).min().unwrap_or(0);
    let last = programs.iter().map(|program| program.range.1).max().unwrap_or(0);
    let watches = watches(&programs, args)?;
    let from = args.from.unwrap_or(first).max(first);
    let until = args.until.unwrap_or(last);
    let not_written = |error: io::Error| Failure::file(&to, why_not_written(&error));
    let mut out = Waveform::create(&to, args.to, &watches, &programs, run).map_err(not_written)?;
    let (mut next, mut status) = (from, DONE);
    let mut time_ns = None;
    let mut events = vec![];
    let beyond = programs.iter().all(|program| from > program.range.1);
    for (program, (watch, names)) in programs.iter().zip(&watches) {
        let (begin, end) = program.range;
        // A tick that is not there is refused by the first replay.
        if (end < next && !beyond) || begin > until {
            continue;
        }
        let mut engine = program
            .found
            .engine(engine_of(&program.found, None))
            .map_err(|why| Failure::file(path, why))?;
        let mut replayer = replayer(path, &recording, run, program.generation, &program.found)?;
        let tick = next.max(begin);
        replayer.go_to(tick, engine.as_mut()).map_err(|error| failed(&error))?;
        for name in out.program_begins(&*replayer.executive().names()) {
            report.warn(&format!(
                "{name} is not in the program, or is another kind of variable, from tick {tick} on"
            ));
        }
        while next <= until {
            let tick_ns = replayer.executive().tick_ns();
            let time = time_ns.get_or_insert(tick_ns.saturating_mul(next));
            events.clear();
            let replayed = replayer.step(engine.as_mut(), &mut events);
            let Some(replayed) = replayed.map_err(|error| failed(&error))? else { break };
            tell_unwritten(run, &replayed, report);
            let skipped = replayed.tick.saturating_sub(next);
            *time = time.saturating_add(tick_ns.saturating_mul(skipped));
            next = replayed.tick.saturating_add(1);
            if !replayed.matches {
                report.message(&format!(
                    "tick {} differs from the recorded one; the values end before it (`plcc replay` says \
                     more)",
                    replayed.tick
                ));
                status = ERRORS;
                break;
            }
            if replayed.cut {
                // It was not run again, so that there are no values of its end.
                break;
            }
            let executive = replayer.executive();
            for event in events.iter_mut().filter(|_| args.aliases) {
                *event = watch.shown_event(event, &**names).into_owned();
            }
            out.tick(replayed.tick, *time, executive, &events).map_err(not_written)?;
            *time = time.saturating_add(tick_ns);
        }
        if status != DONE {
            break;
        }
    }
    out.finish(time_ns.unwrap_or(0)).map_err(not_written)?;
    Ok(status)
}

/// A version of the program that ran, from its start or an online change on.
struct RanProgram {
    generation: u16,
    found: Found,
    /// The first and the last tick of it that are kept.
    range: (u64, u64),
}

/// The versions of the program of which ticks are kept, in the order in which they ran.
fn programs_of(
    recording: &Recording,
    run: &RecordedRun,
    args: &ConvertArgs,
    report: &Report,
) -> Result<Vec<RanProgram>, Failure> {
    let path = &args.record;
    let mut programs: Vec<RanProgram> = vec![];
    for generation in run.generations() {
        let recorded = run
            .program_of(generation)
            .ok_or_else(|| Failure::file(path, "its program is missing"))?;
        // Files that are named are the first program; what an online change brought is in the record.
        let files: &[PathBuf] = if programs.is_empty() { &args.files } else { &[] };
        let found = program(path, recorded, files, &args.source, report)?;
        let range = replayer(path, recording, run, generation, &found)?.range();
        let range = range.map_err(|error| Failure::file(path, error))?;
        programs.push(RanProgram { generation, found, range });
    }
    Ok(programs)
}

/// The variables that are asked for, of each program that has any of them, with its names.
type Watches = Vec<(Watch, Arc<dyn Names>)>;

/// Finds the variables. A name that no program has is an error.
fn watches(programs: &[RanProgram], args: &ConvertArgs) -> Result<Watches, Failure> {
    let all = ["*".to_owned()];
    let lists = if args.watch.is_empty() { &all[..] } else { &args.watch };
    let mut found: Watches = vec![];
    let mut missing: Option<Vec<NameError>> = None;
    for program in programs {
        let names = names_of(&program.found.program);
        let mut watch = Watch::default();
        let mut errors = vec![];
        for list in lists {
            match Watch::parse(std::slice::from_ref(list), &*names) {
                Ok(more) => watch.append(more),
                Err(more) => errors.extend(more),
            }
        }
        found.push((watch.with_aliases(args.aliases), names));
        missing = Some(match missing {
            None => errors,
            Some(before) => before.into_iter().filter(|error| errors.contains(error)).collect(),
        });
    }
    match missing {
        Some(errors) if !errors.is_empty() => {
            let errors: Vec<String> = errors.iter().map(|e| format!("--watch: {e}")).collect();
            Err(Failure::usage(errors.join("\nerror: ")))
        }
        _ => Ok(found),
    }
}

/// Refuses an output that would overwrite the record, the older part of its ring or the program. A
/// table that is not named is not written over a file that is there: the stimulus of `lathe.pmi` is
/// usually called `lathe.csv`, as is the table of `lathe.plcrec`.
fn overwrites_nothing(to: &Path, args: &ConvertArgs) -> Result<(), Failure> {
    if output::is_stdout(to) {
        return Ok(());
    }
    check_outputs(&args.record, &args.files, [to])?;
    if args.output.is_none() && args.to == ConvertFormat::Csv && to.exists() {
        return Err(Failure::file(
            to,
            "it exists already, perhaps as a stimulus; -o names another file, or this one to \
             overwrite it",
        ));
    }
    Ok(())
}

/// The output file where none is named.
fn named(record: &Path, format: ConvertFormat) -> PathBuf {
    let ending = match format {
        ConvertFormat::Vcd => "vcd",
        ConvertFormat::Fst => "fst",
        ConvertFormat::Csv => "csv",
        ConvertFormat::Mcap => "mcap",
    };
    PathBuf::from(record.file_name().unwrap_or_default()).with_extension(ending)
}

/// The file that is written.
struct Waveform {
    text: TraceText,
    /// For each variable of the text the one of the program that runs; `None` if that has none.
    variables: Vec<Option<VariableKey>>,
    form: Form,
}

/// What the file is.
enum Form {
    /// A table or a VCD.
    Text(Box<dyn Write>),
    /// An FST.
    Fst(Box<Fst>),
    /// An MCAP file.
    Mcap(Box<Mcap>),
}

impl Waveform {
    /// Creates the file. `programs` are those of `watches`, of the versions that `run` had.
    fn create(
        path: &Path,
        format: ConvertFormat,
        watches: &Watches,
        programs: &[RanProgram],
        run: &RecordedRun,
    ) -> io::Result<Self> {
        let text_format = match format {
            ConvertFormat::Csv => TraceFormat::Csv { time: true },
            _ => TraceFormat::Vcd,
        };
        let mut of_programs = watches.iter();
        let mut text = match of_programs.next() {
            Some((watch, names)) => TraceText::new(watch, text_format, &**names),
            None => return Err(io::ErrorKind::InvalidInput.into()),
        };
        for (watch, names) in of_programs {
            text.add(watch, &**names);
        }
        let form = match format {
            ConvertFormat::Fst => Form::Fst(Box::new(Fst::create(path, &text, watches)?)),
            ConvertFormat::Mcap => {
                Form::Mcap(Box::new(Mcap::create(path, &text, watches, programs, run)?))
            }
            ConvertFormat::Csv | ConvertFormat::Vcd => {
                let mut out: Box<dyn Write> = if output::is_stdout(path) {
                    Box::new(BufWriter::new(io::stdout()))
                } else {
                    Box::new(BufWriter::new(open_output(path, false)?))
                };
                text.header(&mut out)?;
                Form::Text(out)
            }
        };
        Ok(Self { text, variables: vec![], form })
    }

    /// A version of the program begins to run. Gives the names that it has not, or has as another kind of variable; they
    /// keep the values that they had.
    fn program_begins(&mut self, program: &dyn Names) -> Vec<String> {
        let names: Vec<String> = self.text.names().map(str::to_owned).collect();
        // Constants of PMI are declared, but are not variables that a name could choose.
        let declared: HashMap<String, VariableKey> = program.declared().into_iter().collect();
        let found = names.iter().enumerate().map(|(index, name)| {
            let declared = declared.get(name).copied();
            let variable = declared.or_else(|| program.find(name, Purpose::Watch).ok())?;
            self.text.takes(index, variable, program).then_some(variable)
        });
        self.variables = found.collect();
        let named = names.into_iter().zip(&self.variables);
        named.filter(|(_, variable)| variable.is_none()).map(|(name, _)| name).collect()
    }

    /// Writes what has changed in a tick, which began `time_ns` nanoseconds after the first one of the run, and its events
    /// where the file has them.
    fn tick(
        &mut self,
        tick: u64,
        time_ns: u64,
        executive: &dyn Executive,
        events: &[Event],
    ) -> io::Result<()> {
        match &mut self.form {
            Form::Text(out) => {
                for (index, variable) in self.variables.iter().enumerate() {
                    if let Some(variable) = variable {
                        self.text.row((tick, time_ns), index, executive.read(*variable), out)?;
                    }
                }
                Ok(())
            }
            Form::Fst(fst) => fst.tick(time_ns, &self.variables, executive),
            Form::Mcap(mcap) => mcap.tick((tick, time_ns), &self.variables, executive, events),
        }
    }

    /// Writes the end of the file; `time_ns` is the time after the last tick.
    fn finish(self, time_ns: u64) -> io::Result<()> {
        match self.form {
            Form::Text(mut out) => {
                self.text.end(time_ns, &mut out)?;
                out.flush()
            }
            Form::Fst(fst) => fst.finish(time_ns),
            Form::Mcap(mcap) => mcap.finish(),
        }
    }
}
