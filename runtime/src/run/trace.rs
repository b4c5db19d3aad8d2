//! The trace: how watched variables change, as a table or as a VCD (value change dump, IEEE 1364)
//! for waveform viewers.

use std::io::{self, Write};
use std::path::Path;

use vcd::{IdCode, TimescaleUnit, VarType};

use crate::{Executive, Value};

use super::Watch;

/// How a trace is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TraceFormat {
    /// A table `tick,name,value`, with `time` a table `tick,ms,name,value`.
    Csv {
        /// Whether each row has the time at which its tick began, in milliseconds.
        time: bool,
    },
    /// A value change dump with a timescale of 1 us. A tick's values stand at the time at which it
    /// began.
    Vcd,
}

impl Default for TraceFormat {
    fn default() -> Self {
        Self::Csv { time: false }
    }
}

impl TraceFormat {
    /// The format of a trace, from the name of its file: VCD if it ends in `.vcd`, in any case of
    /// letters, else a table; `time` says whether the table has a column with times.
    pub fn of(path: &Path, time: bool) -> Self {
        match path.extension() {
            Some(ending) if ending.eq_ignore_ascii_case("vcd") => Self::Vcd,
            _ => Self::Csv { time },
        }
    }
}

/// Writes the values of the watched variables that have changed since they were last written.
#[derive(Clone, Debug)]
pub struct Trace {
    watch: Watch,
    format: TraceFormat,
    last: Vec<Option<Value>>,
    /// For a VCD: the signals of each watched variable, one for each element of an array.
    signals: Vec<Vec<IdCode>>,
    /// For a VCD: the time that was last written, in microseconds.
    written: Option<u64>,
}

impl Trace {
    /// A trace without rows.
    pub fn new(watch: Watch, format: TraceFormat) -> Self {
        let last = vec![None; watch.names().len()];
        Self { watch, format, last, signals: vec![], written: None }
    }

    /// Writes the header.
    ///
    /// # Errors
    /// When `out` can't be written.
    pub fn header(&mut self, executive: &dyn Executive, out: &mut dyn Write) -> io::Result<()> {
        match self.format {
            TraceFormat::Csv { time: false } => out.write_all(b"tick,name,value\n"),
            TraceFormat::Csv { time: true } => out.write_all(b"tick,ms,name,value\n"),
            TraceFormat::Vcd => self.declare(executive, out),
        }
    }

    /// Declares a signal for each variable, and for each element of an array.
    fn declare(&mut self, executive: &dyn Executive, out: &mut dyn Write) -> io::Result<()> {
        let mut vcd = vcd::Writer::new(out);
        vcd.version(concat!("plcc ", env!("CARGO_PKG_VERSION")))?;
        vcd.timescale(1, TimescaleUnit::US)?;
        vcd.add_module("plc")?;
        for (name, variable) in self.watch.names() {
            let logical = executive.is_logical(*variable);
            let mut add = |name: &str, value: &Value| match value {
                _ if logical => vcd.add_var(VarType::Wire, 1, name, None),
                Value::Float(_) => vcd.add_var(VarType::Real, 64, name, None),
                Value::Int(_) | Value::Array(_) => vcd.add_var(VarType::Integer, 64, name, None),
            };
            let signals = match executive.get(*variable) {
                Value::Array(values) => values
                    .iter()
                    .enumerate()
                    .map(|(index, value)| add(&format!("{name}[{index}]"), value))
                    .collect::<io::Result<_>>()?,
                value => vec![add(name, &value)?],
            };
            self.signals.push(signals);
        }
        vcd.upscope()?;
        vcd.enddefinitions()
    }

    /// Writes the values that differ, at the end of a tick, from the last ones written; gives whether
    /// there were any. The tick began `time_ns` nanoseconds after the first one.
    ///
    /// # Errors
    /// When `out` can't be written.
    pub fn rows(
        &mut self,
        tick: u64,
        time_ns: u64,
        executive: &dyn Executive,
        out: &mut dyn Write,
    ) -> io::Result<bool> {
        let mut any = false;
        for (index, (name, variable)) in self.watch.names().iter().enumerate() {
            let value = executive.get(*variable);
            let Some(last) = self.last.get_mut(index) else { continue };
            if last.as_ref() == Some(&value) {
                continue;
            }
            any = true;
            match self.format {
                TraceFormat::Csv { time } => row(out, tick, time.then_some(time_ns), name, &value)?,
                TraceFormat::Vcd => {
                    let mut vcd = vcd::Writer::new(&mut *out);
                    let time = time_ns / 1000;
                    if self.written != Some(time) {
                        vcd.timestamp(time)?;
                        self.written = Some(time);
                    }
                    let signals = self.signals.get(index).map_or(&[][..], Vec::as_slice);
                    let logical = executive.is_logical(*variable);
                    change(&mut vcd, signals, logical, last.as_ref(), &value)?;
                }
            }
            *last = Some(value);
        }
        Ok(any)
    }

    /// Writes the time at which the trace ends, `time_ns` nanoseconds after the first tick began. Only
    /// a VCD has it, so that viewers also show the time after the last change.
    ///
    /// # Errors
    /// When `out` can't be written.
    pub fn end(&self, time_ns: u64, out: &mut dyn Write) -> io::Result<()> {
        match self.format {
            TraceFormat::Vcd => vcd::Writer::new(out).timestamp(time_ns / 1000),
            TraceFormat::Csv { .. } => Ok(()),
        }
    }
}

/// Writes a row of a table. Arrays are in quotes, since they hold commas.
fn row(
    out: &mut dyn Write,
    tick: u64,
    time_ns: Option<u64>,
    name: &str,
    value: &Value,
) -> io::Result<()> {
    write!(out, "{tick},")?;
    if let Some(ns) = time_ns {
        write!(out, "{},", milliseconds(ns))?;
    }
    match value {
        Value::Array(_) => writeln!(out, "{name},\"{value}\""),
        Value::Int(_) | Value::Float(_) => writeln!(out, "{name},{value}"),
    }
}

/// Nanoseconds as milliseconds, exactly: `20`, `0.442`.
fn milliseconds(ns: u64) -> String {
    let text = format!("{}.{:06}", ns / 1_000_000, ns % 1_000_000);
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// Writes the new value of a variable to a VCD; of an array only the elements that have changed.
fn change<W: Write>(
    vcd: &mut vcd::Writer<W>,
    signals: &[IdCode],
    logical: bool,
    last: Option<&Value>,
    value: &Value,
) -> io::Result<()> {
    if let Value::Array(values) = value {
        let before: &[Value] = match last {
            Some(Value::Array(before)) => before,
            _ => &[],
        };
        for (index, (signal, value)) in signals.iter().zip(values).enumerate() {
            if before.get(index) != Some(value) {
                change_one(vcd, *signal, logical, value)?;
            }
        }
        return Ok(());
    }
    match signals {
        [signal, ..] => change_one(vcd, *signal, logical, value),
        [] => Ok(()),
    }
}

/// Writes the new value of one signal.
fn change_one<W: Write>(
    vcd: &mut vcd::Writer<W>,
    signal: IdCode,
    logical: bool,
    value: &Value,
) -> io::Result<()> {
    match value {
        Value::Int(value) if logical => vcd.change_scalar(signal, *value != 0),
        Value::Int(value) => {
            // The highest bit comes first. Leading zeros are left out, since viewers fill them in.
            let bits = 64 - value.leading_zeros().min(63);
            let bit = |at: u32| vcd::Value::from(value >> at & 1 != 0);
            vcd.change_vector(signal, (0..bits).rev().map(bit))
        }
        Value::Float(value) => vcd.change_real(signal, *value),
        Value::Array(_) => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn milliseconds_are_exact() {
        for (ns, text) in [(0, "0"), (20_000_000, "20"), (442_128, "0.442128"), (1_500_000, "1.5")]
        {
            assert_eq!(milliseconds(ns), text);
        }
    }

    #[test]
    fn the_file_name_extension_chooses_the_format() {
        assert_eq!(TraceFormat::of(Path::new("a.VCD"), false), TraceFormat::Vcd);
        assert_eq!(TraceFormat::of(Path::new("-"), true), TraceFormat::Csv { time: true });
        assert_eq!(TraceFormat::of(Path::new("a.csv"), false), TraceFormat::default());
    }
}
