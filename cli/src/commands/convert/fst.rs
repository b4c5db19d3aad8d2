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
use plcc_host::run::{TraceText, WaveformShape};
use plcc_runtime::{Executive, Names, Value, VariableKey};

use super::Watches;

/// The values of an FST are collected in memory, and written when they have so many bytes.
const PORTION: usize = 32 << 20;

/// An FST.
pub(super) struct Fst {
    out: FstBodyWriter<BufWriter<File>>,
    /// For each variable of the text the signals of its elements.
    signals: Vec<(WaveformShape, Vec<FstSignalId>)>,
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
            let Some(properties) = watches.iter().find_map(of_program) else { continue };
            let shape = WaveformShape::of(&properties);
            let (signal, ty) = match shape {
                WaveformShape::Line => (FstSignalType::bit_vec(1), FstVarType::Wire),
                WaveformShape::Bits { width, signed } => {
                    let ty = if signed { FstVarType::Integer } else { FstVarType::Wire };
                    (FstSignalType::bit_vec(width), ty)
                }
                WaveformShape::Real => (FstSignalType::real(), FstVarType::Real),
            };
            let mut add = |name: &str| {
                head.var(name, signal, ty, FstVarDirection::Implicit, None).map_err(io_error)
            };
            let ids = match properties.elements {
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

/// A value as an FST has it: its bits as the characters 0 and 1, x for each where they do not hold it, or the eight bytes of a
/// double.
fn encoded(shape: WaveformShape, value: &Value) -> Vec<u8> {
    let Some(width) = shape.width() else {
        return WaveformShape::real(value).to_le_bytes().to_vec();
    };
    match shape.bits(value) {
        Some(bits) => format!("{bits:0width$b}", width = width as usize).into_bytes(),
        None => vec![b'x'; width as usize],
    }
}
