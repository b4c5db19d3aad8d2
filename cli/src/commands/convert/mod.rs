//! `plcc convert`: the values of a recorded run as a table, a VCD or an FST. A record holds no values of
//! variables but what a replay needs, so the values come from a replay.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use fst_writer::{
    FstBodyWriter, FstFileType, FstInfo, FstScopeType, FstSignalId, FstSignalType, FstVarDirection,
    FstVarType, FstWriteError, open_fst,
};
use plcc_runtime::files::why_not_written;
use plcc_runtime::record::{RecordedRun, Recording, ReplayError};
use plcc_runtime::run::{TraceFormat, TraceText, Watch};
use plcc_runtime::session::replay::recorded_executive;
use plcc_runtime::{Executive, NameError, Purpose, Value, Variable};

use crate::args::{ConvertArgs, ConvertFormat};
use crate::failure::{DONE, ERRORS, Failure};
use crate::output;
use crate::recorded::Found;
use crate::replay_input::{
    check_outputs, chosen_run, engine_of, program, replayer, tell_damage, tell_unwritten,
};
use crate::report::Report;

/// The values of an FST are collected in memory, and written when they have so many bytes.
const PORTION: usize = 32 << 20;

pub(crate) fn convert(args: &ConvertArgs, report: &Report) -> Result<u8, Failure> {
    let path = &args.record;
    let recording = Recording::open(path).map_err(|error| Failure::usage(error.to_string()))?;
    if let (Some(from), Some(until)) = (args.from, args.until)
        && from > until
    {
        return Err(Failure::usage(format!("--from {from} is after --until {until}")));
    }
    let to = args.output.clone().unwrap_or_else(|| named(path, args.to));
    overwrites_nothing(&to, args)?;
    let run = chosen_run(&recording, args.run, path)?;
    tell_damage(&recording, run, report);
    let failed = |error: &dyn std::fmt::Display| Failure::file(path, error);
    let mut programs = programs_of(run, args, report)?;
    let (mut first, mut last) = (u64::MAX, 0);
    for program in &mut programs {
        let replayer = replayer(path, &recording, run, program.generation, &program.found)?;
        let range = match replayer.range() {
            Ok(range) => range,
            // Of this version not a whole tick is kept.
            Err(ReplayError::NoTicks) => continue,
            Err(error) => return Err(failed(&error)),
        };
        (first, last) = (first.min(range.0), last.max(range.1));
        program.range = Some(range);
    }
    programs.retain(|program| program.range.is_some());
    if programs.is_empty() {
        return Err(failed(&ReplayError::NoTicks));
    }
    let watches = watches(&mut programs, args, run)?;
    let from = args.from.unwrap_or(first).max(first);
    let until = args.until.unwrap_or(last);
    let not_written = |error: io::Error| Failure::file(&to, why_not_written(&error));
    let mut out = Waveform::create(&to, args.to, &watches).map_err(not_written)?;
    let (mut next, mut status) = (from, DONE);
    let mut time_ns = None;
    let mut events = vec![];
    let beyond = programs.iter().all(|program| program.range.is_none_or(|(_, end)| from > end));
    for program in &programs {
        let (begin, end) = program.range.unwrap_or((0, 0));
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
        for name in out.program_begins(replayer.executive()) {
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
                    "tick {} differs from the recorded one; the values end before it (`plcc replay` tells \
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
            out.tick(replayed.tick, *time, replayer.executive()).map_err(not_written)?;
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
    range: Option<(u64, u64)>,
}

/// The versions of the program, in the order in which they ran.
fn programs_of(
    run: &RecordedRun,
    args: &ConvertArgs,
    report: &Report,
) -> Result<Vec<RanProgram>, Failure> {
    let path = &args.record;
    let mut programs: Vec<RanProgram> = vec![];
    for generation in run.spans.iter().map(|span| span.generation) {
        if programs.iter().any(|program| program.generation == generation) {
            continue;
        }
        let recorded = run
            .program_of(generation)
            .ok_or_else(|| Failure::file(path, "its program is missing"))?;
        // Files that are named are the first program; what an online change brought is in the record.
        let files: &[PathBuf] = if programs.is_empty() { &args.files } else { &[] };
        let found = program(path, recorded, files, &args.source, report)?;
        programs.push(RanProgram { generation, found, range: None });
    }
    Ok(programs)
}

/// The variables that are asked for, of each program that has any of them, with an executive of it.
type Watches = Vec<(Watch, Box<dyn Executive + Send>)>;

/// Finds the variables. A name that no program has is an error.
fn watches(
    programs: &mut [RanProgram],
    args: &ConvertArgs,
    run: &RecordedRun,
) -> Result<Watches, Failure> {
    let all = ["*".to_owned()];
    let lists = if args.watch.is_empty() { &all[..] } else { &args.watch };
    let mut found: Watches = vec![];
    let mut missing: Option<Vec<NameError>> = None;
    for program in programs {
        let executive = recorded_executive(&run.header, &program.found.program);
        let mut executive = executive.map_err(|error| Failure::file(&args.record, error))?;
        let mut watch = Watch::default();
        let mut errors = vec![];
        for list in lists {
            match Watch::parse(std::slice::from_ref(list), executive.as_mut()) {
                Ok(more) => watch.append(more),
                Err(more) => errors.extend(more),
            }
        }
        found.push((watch, executive));
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
    };
    PathBuf::from(record.file_name().unwrap_or_default()).with_extension(ending)
}

/// The file that is written.
struct Waveform {
    text: TraceText,
    /// For each variable of the text the one of the program that runs; `None` if that has none.
    variables: Vec<Option<Variable>>,
    form: Form,
}

/// What the file is.
enum Form {
    /// A table or a VCD.
    Text(Box<dyn Write>),
    /// An FST.
    Fst(Box<Fst>),
}

impl Waveform {
    fn create(path: &Path, format: ConvertFormat, watches: &Watches) -> io::Result<Self> {
        let text_format = match format {
            ConvertFormat::Csv => TraceFormat::Csv { time: true },
            ConvertFormat::Vcd | ConvertFormat::Fst => TraceFormat::Vcd,
        };
        let mut programs = watches.iter();
        let mut text = match programs.next() {
            Some((watch, executive)) => TraceText::new(watch, text_format, executive.as_ref()),
            None => return Err(io::ErrorKind::InvalidInput.into()),
        };
        for (watch, executive) in programs {
            text.add(watch, executive.as_ref());
        }
        let form = match format {
            ConvertFormat::Fst => Form::Fst(Box::new(Fst::create(path, &text, watches)?)),
            ConvertFormat::Csv | ConvertFormat::Vcd => {
                let mut out: Box<dyn Write> = if output::is_stdout(path) {
                    Box::new(BufWriter::new(io::stdout()))
                } else {
                    Box::new(BufWriter::new(File::create(path)?))
                };
                text.header(&mut out)?;
                Form::Text(out)
            }
        };
        Ok(Self { text, variables: vec![], form })
    }

    /// A version of the program begins to run. Gives the names that it has not, or has as another kind of variable; they
    /// keep the values that they had.
    fn program_begins(&mut self, executive: &mut dyn Executive) -> Vec<String> {
        let names: Vec<String> = self.text.names().map(str::to_owned).collect();
        let found = names.iter().enumerate().map(|(index, name)| {
            let variable = executive.find(name, Purpose::Watch).ok()?;
            self.text.takes(index, variable, executive).then_some(variable)
        });
        self.variables = found.collect();
        let named = names.into_iter().zip(&self.variables);
        named.filter(|(_, variable)| variable.is_none()).map(|(name, _)| name).collect()
    }

    /// Writes what has changed in a tick, which began `time_ns` nanoseconds after the first one.
    fn tick(&mut self, tick: u64, time_ns: u64, executive: &dyn Executive) -> io::Result<()> {
        match &mut self.form {
            Form::Text(out) => {
                for (index, variable) in self.variables.iter().enumerate() {
                    if let Some(variable) = variable {
                        self.text.row((tick, time_ns), index, executive.get(*variable), out)?;
                    }
                }
                Ok(())
            }
            Form::Fst(fst) => fst.tick(time_ns, &self.variables, executive),
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
        }
    }
}

/// How an FST shows a value.
#[derive(Clone, Copy, PartialEq)]
enum Shape {
    Bit,
    Integer,
    Real,
}

/// An FST.
struct Fst {
    out: FstBodyWriter<BufWriter<File>>,
    /// For each variable of the text the signals of its elements.
    signals: Vec<(Shape, Vec<FstSignalId>)>,
}

fn io_error(error: FstWriteError) -> io::Error {
    match error {
        FstWriteError::Io(error) => error,
        error => io::Error::other(error),
    }
}

impl Fst {
    fn create(path: &Path, text: &TraceText, watches: &Watches) -> io::Result<Self> {
        let info = FstInfo {
            start_time: 0,
            timescale_exponent: -6,
            version: concat!("plcc ", env!("CARGO_PKG_VERSION")).into(),
            date: String::new(),
            file_type: FstFileType::Verilog,
        };
        let mut head = open_fst(path, &info).map_err(io_error)?;
        head.scope("plc", "plc", FstScopeType::Module).map_err(io_error)?;
        let mut signals = vec![];
        for name in text.names() {
            // The first program that has it says of what kind it is.
            let of_program = |(watch, executive): &(Watch, Box<dyn Executive + Send>)| {
                let (_, variable) = watch.names().iter().find(|(known, _)| known == name)?;
                Some((executive.get(*variable), executive.is_logical(*variable)))
            };
            let Some((value, is_logical)) = watches.iter().find_map(of_program) else { continue };
            let (elements, float) = match &value {
                Value::Array(values) => (Some(values.len()), false),
                value => (None, matches!(value, Value::Float(_))),
            };
            let shape = match (is_logical, float) {
                (true, _) => Shape::Bit,
                (false, true) => Shape::Real,
                (false, false) => Shape::Integer,
            };
            let (signal, ty) = match shape {
                Shape::Bit => (FstSignalType::bit_vec(1), FstVarType::Wire),
                Shape::Integer => (FstSignalType::bit_vec(64), FstVarType::Integer),
                Shape::Real => (FstSignalType::real(), FstVarType::Real),
            };
            let mut add = |name: &str| {
                head.var(name, signal, ty, FstVarDirection::Implicit, None).map_err(io_error)
            };
            let ids = match elements {
                None => vec![add(name)?],
                Some(count) => (0..count)
                    .map(|index| add(&format!("{name}[{index}]")))
                    .collect::<io::Result<_>>()?,
            };
            signals.push((shape, ids));
        }
        head.up_scope().map_err(io_error)?;
        Ok(Self { out: head.finish().map_err(io_error)?, signals })
    }

    fn tick(
        &mut self,
        time_ns: u64,
        variables: &[Option<Variable>],
        executive: &dyn Executive,
    ) -> io::Result<()> {
        if self.out.size() >= PORTION {
            self.out.flush().map_err(io_error)?;
        }
        self.out.time_change(time_ns / 1000).map_err(io_error)?;
        for ((shape, ids), variable) in self.signals.iter().zip(variables) {
            let Some(variable) = variable else { continue };
            let value = executive.get(*variable);
            let values = match &value {
                Value::Array(values) => values.as_slice(),
                single => std::slice::from_ref(single),
            };
            for (id, value) in ids.iter().zip(values) {
                let bytes = encoded(*shape, value);
                self.out.signal_change(*id, &bytes).map_err(io_error)?;
            }
        }
        Ok(())
    }

    fn finish(mut self, time_ns: u64) -> io::Result<()> {
        self.out.time_change(time_ns / 1000).map_err(io_error)?;
        let mut file = self.out.finish().map_err(io_error)?;
        file.flush()
    }
}

/// A value as an FST has it: its bits as the characters 0 and 1, or the eight bytes of a double.
fn encoded(shape: Shape, value: &Value) -> Vec<u8> {
    let integer = match value {
        Value::Int(value) => *value,
        Value::Float(value) => *value as i64,
        Value::Array(_) => 0,
    };
    match (shape, value) {
        (Shape::Real, Value::Float(value)) => value.to_le_bytes().to_vec(),
        (Shape::Real, _) => (integer as f64).to_le_bytes().to_vec(),
        (Shape::Bit, _) => vec![if integer == 0 { b'0' } else { b'1' }],
        (Shape::Integer, _) => format!("{integer:064b}").into_bytes(),
    }
}
