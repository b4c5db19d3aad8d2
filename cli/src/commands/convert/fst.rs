//! An FST, GTKWave's fast signal trace.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;
use std::sync::Arc;

use fst_writer::{
    FstBodyWriter, FstFileType, FstHeaderWriter, FstInfo, FstScopeType, FstSignalId, FstSignalType,
    FstVarDirection, FstVarType, FstWriteError,
};
use plcc_control::Watch;
use plcc_files::open_output;
use plcc_host::run::TraceText;
use plcc_runtime::{Class, Executive, Names, Properties, Value, VariableKey};

use super::Watches;

/// The values of an FST are collected in memory, and written when they have so many bytes.
const PORTION: usize = 32 << 20;

/// How an FST shows a value.
#[derive(Clone, Copy, PartialEq)]
enum Shape {
    Bit,
    Integer,
    Real,
}

/// An FST.
pub(super) struct Fst {
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
    pub(super) fn create(path: &Path, text: &TraceText, watches: &Watches) -> io::Result<Self> {
        let info = FstInfo {
            start_time: 0,
            timescale_exponent: -6,
            version: concat!("plcc ", env!("CARGO_PKG_VERSION")).into(),
            date: String::new(),
            file_type: FstFileType::Verilog,
        };
        let file = open_output(path, false)?;
        if !file.metadata()?.is_file() {
            // The head is written last, when the file's length is known.
            let what = "an FST is written to a regular file";
            return Err(io::Error::new(io::ErrorKind::InvalidInput, what));
        }
        let file = BufWriter::new(file);
        let mut head = FstHeaderWriter::new(file, &info).map_err(io_error)?;
        head.scope("plc", "plc", FstScopeType::Module).map_err(io_error)?;
        let mut signals = vec![];
        for (name, shown) in text.shown_names() {
            // The first program that has it says of what kind it is.
            let of_program = |(watch, names): &(Watch, Arc<dyn Names>)| {
                let (_, variable) = watch.names().iter().find(|(known, _)| known == name)?;
                Some(names.properties(*variable))
            };
            let Some(Properties { class, elements, .. }) = watches.iter().find_map(of_program)
            else {
                continue;
            };
            let shape = match class {
                Class::Logical => Shape::Bit,
                Class::Fraction => Shape::Real,
                Class::Integer => Shape::Integer,
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
                None => vec![add(shown)?],
                Some(count) => (0..count)
                    .map(|index| add(&format!("{shown}[{index}]")))
                    .collect::<io::Result<_>>()?,
            };
            signals.push((shape, ids));
        }
        head.up_scope().map_err(io_error)?;
        Ok(Self { out: head.finish().map_err(io_error)?, signals })
    }

    pub(super) fn tick(
        &mut self,
        time_ns: u64,
        variables: &[Option<VariableKey>],
        executive: &dyn Executive,
    ) -> io::Result<()> {
        if self.out.size() >= PORTION {
            self.out.flush().map_err(io_error)?;
        }
        self.out.time_change(time_ns / 1000).map_err(io_error)?;
        for ((shape, ids), variable) in self.signals.iter().zip(variables) {
            let Some(variable) = variable else { continue };
            let value = executive.read(*variable);
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

    pub(super) fn finish(mut self, time_ns: u64) -> io::Result<()> {
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
