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
use plcc_runtime::record::Recording;
use plcc_runtime::run::{Trace, TraceFormat, Watch};
use plcc_runtime::{Executive, Value, Variable};

use crate::args::{ConvertArgs, ConvertFormat};
use crate::failure::{DONE, ERRORS, Failure};
use crate::output;
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
    let generation = run.spans.first().map_or(0, |span| span.generation);
    let recorded =
        run.program_of(generation).ok_or_else(|| Failure::file(path, "its program is missing"))?;
    let found = program(path, recorded, &args.files, &args.source, report)?;
    let mut engine =
        found.engine(engine_of(&found, None)).map_err(|why| Failure::file(path, why))?;
    let mut replayer = replayer(path, &recording, run, generation, &found)?;
    let all = ["*".to_owned()];
    let names = if args.watch.is_empty() { &all[..] } else { &args.watch };
    let watch = Watch::parse(names, replayer.executive()).map_err(|errors| {
        let errors: Vec<String> = errors.iter().map(|e| format!("--watch: {e}")).collect();
        Failure::usage(errors.join("\nerror: "))
    })?;
    let (first, last) = replayer.range().map_err(|error| failed(&error))?;
    let from = args.from.unwrap_or(first).max(first);
    let until = args.until.unwrap_or(last);
    replayer.go_to(from, engine.as_mut()).map_err(|error| failed(&error))?;
    let not_written = |error: io::Error| Failure::file(&to, why_not_written(&error));
    let mut out =
        Waveform::create(&to, args.to, watch, replayer.executive()).map_err(not_written)?;
    let mut time_ns = replayer.executive().tick_ns().saturating_mul(from);
    let (mut next, mut status) = (from, DONE);
    let mut events = vec![];
    while next <= until {
        let tick_ns = replayer.executive().tick_ns();
        events.clear();
        let replayed = replayer.step(engine.as_mut(), &mut events);
        let Some(replayed) = replayed.map_err(|error| failed(&error))? else { break };
        tell_unwritten(run, &replayed, report);
        let skipped = replayed.tick.saturating_sub(next);
        time_ns = time_ns.saturating_add(tick_ns.saturating_mul(skipped));
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
        out.tick(replayed.tick, time_ns, replayer.executive()).map_err(not_written)?;
        time_ns = time_ns.saturating_add(tick_ns);
    }
    out.finish(time_ns).map_err(not_written)?;
    let has_further_programs = run.spans.iter().any(|span| span.generation != generation);
    if status == DONE && has_further_programs && args.until.is_none_or(|until| until > last) {
        report.warn(&format!("an online change followed; the values end before tick {next}"));
    }
    Ok(status)
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
enum Waveform {
    /// A table or a VCD.
    Text(Box<Trace>, Box<dyn Write>),
    /// An FST.
    Fst(Box<Fst>),
}

impl Waveform {
    fn create(
        path: &Path,
        format: ConvertFormat,
        watch: Watch,
        executive: &dyn Executive,
    ) -> io::Result<Self> {
        let format = match format {
            ConvertFormat::Fst => {
                return Ok(Self::Fst(Box::new(Fst::create(path, &watch, executive)?)));
            }
            ConvertFormat::Vcd => TraceFormat::Vcd,
            ConvertFormat::Csv => TraceFormat::Csv { time: true },
        };
        let mut out: Box<dyn Write> = if output::is_stdout(path) {
            Box::new(BufWriter::new(io::stdout()))
        } else {
            Box::new(BufWriter::new(File::create(path)?))
        };
        let mut trace = Trace::new(watch, format, executive);
        trace.header(&mut out)?;
        Ok(Self::Text(Box::new(trace), out))
    }

    /// Writes what has changed in a tick, which began `time_ns` nanoseconds after the first one.
    fn tick(&mut self, tick: u64, time_ns: u64, executive: &dyn Executive) -> io::Result<()> {
        match self {
            Self::Text(trace, out) => trace.rows(tick, time_ns, executive, out).map(|_| ()),
            Self::Fst(fst) => fst.tick(time_ns, executive),
        }
    }

    /// Writes the end of the file; `time_ns` is the time after the last tick.
    fn finish(self, time_ns: u64) -> io::Result<()> {
        match self {
            Self::Text(trace, mut out) => {
                trace.end(time_ns, &mut out)?;
                out.flush()
            }
            Self::Fst(fst) => fst.finish(time_ns),
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
    /// Each variable with the signals of its elements.
    signals: Vec<(Variable, Shape, Vec<FstSignalId>)>,
}

fn io_error(error: FstWriteError) -> io::Error {
    match error {
        FstWriteError::Io(error) => error,
        error => io::Error::other(error),
    }
}

impl Fst {
    fn create(path: &Path, watch: &Watch, executive: &dyn Executive) -> io::Result<Self> {
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
        for (name, variable) in watch.names() {
            let value = executive.get(*variable);
            let (elements, float) = match &value {
                Value::Array(values) => (Some(values.len()), false),
                value => (None, matches!(value, Value::Float(_))),
            };
            let shape = match (executive.is_logical(*variable), float) {
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
            signals.push((*variable, shape, ids));
        }
        head.up_scope().map_err(io_error)?;
        Ok(Self { out: head.finish().map_err(io_error)?, signals })
    }

    fn tick(&mut self, time_ns: u64, executive: &dyn Executive) -> io::Result<()> {
        if self.out.size() >= PORTION {
            self.out.flush().map_err(io_error)?;
        }
        self.out.time_change(time_ns / 1000).map_err(io_error)?;
        for (variable, shape, ids) in &self.signals {
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
