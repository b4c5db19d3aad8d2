//! The trace: how watched variables change, as a table or as a VCD (value change dump, IEEE 1364)
//! for waveform viewers.

use std::io::{self, Write};
use std::path::Path;

use vcd::{IdCode, TimescaleUnit, VarType};

use plcc_control::Watch;
use plcc_runtime::{Executive, Names, Properties, Value, VariableKey};

use super::waveform_shape::WaveformShape;

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

/// The text of a trace. It knows the names of the watched variables and the values that were written
/// last, and needs no executive, so that a thread of its own can write it.
#[derive(Clone, Debug)]
pub struct TraceText {
    format: TraceFormat,
    variables: Vec<Watched>,
    /// For a VCD: the time that was last written, in microseconds.
    written: Option<u64>,
}

/// What a trace's text needs to know of a watched variable.
#[derive(Clone, Debug)]
struct Watched {
    name: String,
    /// What the trace calls it.
    shown: String,
    /// How a VCD shows it.
    shape: WaveformShape,
    /// How many elements an array has.
    elements: Option<usize>,
    last: Option<Value>,
    /// For a VCD: its signals, one for each element of an array.
    signals: Vec<IdCode>,
}

impl Watched {
    fn new(name: &str, shown: String, variable: VariableKey, names: &dyn Names) -> Self {
        let properties = names.properties(variable);
        let Properties { elements, .. } = properties;
        Self {
            name: name.into(),
            shown,
            shape: WaveformShape::of(&properties),
            elements: elements.map(|count| count as usize),
            last: None,
            signals: vec![],
        }
    }
}

impl TraceText {
    /// A trace without rows.
    pub fn new(watch: &Watch, format: TraceFormat, names: &dyn Names) -> Self {
        let watched = watch.names().iter();
        let variables = watched
            .map(|(name, variable)| Watched::new(name, watch.shown(name, names), *variable, names));
        Self { format, variables: variables.collect(), written: None }
    }

    /// Adds watched variables after the others, before the header is written: those of another version of the
    /// program, which runs after an online change. A name that is there already is not added again.
    pub fn add(&mut self, watch: &Watch, names: &dyn Names) {
        for (name, variable) in watch.names() {
            if self.names().all(|known| known != name) {
                let shown = watch.shown(name, names);
                self.variables.push(Watched::new(name, shown, *variable, names));
            }
        }
    }

    /// The names of the variables, in the order of their indexes.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.variables.iter().map(|variable| variable.name.as_str())
    }

    /// The same with what the trace calls them.
    pub fn shown_names(&self) -> impl Iterator<Item = (&str, &str)> {
        self.variables.iter().map(|variable| (variable.name.as_str(), variable.shown.as_str()))
    }

    /// Whether a variable of another version of the program is shown as the one with an index is: of the same kind,
    /// with as many elements.
    pub fn takes(&self, index: usize, variable: VariableKey, names: &dyn Names) -> bool {
        let other = Watched::new("", String::new(), variable, names);
        self.variables
            .get(index)
            .is_some_and(|own| (own.shape, own.elements) == (other.shape, other.elements))
    }

    /// Writes the header.
    ///
    /// # Errors
    /// When `out` can't be written.
    pub fn header(&mut self, out: &mut dyn Write) -> io::Result<()> {
        match self.format {
            TraceFormat::Csv { time: false } => out.write_all(b"tick,name,value\n"),
            TraceFormat::Csv { time: true } => out.write_all(b"tick,ms,name,value\n"),
            TraceFormat::Vcd => self.declare(out),
        }
    }

    /// Declares a signal for each variable, and for each element of an array.
    fn declare(&mut self, out: &mut dyn Write) -> io::Result<()> {
        let mut vcd = vcd::Writer::new(out);
        vcd.version(concat!("plcc ", env!("CARGO_PKG_VERSION")))?;
        vcd.timescale(1, TimescaleUnit::US)?;
        vcd.add_module("plc")?;
        for variable in &mut self.variables {
            let Watched { shown: name, shape, elements, signals, .. } = variable;
            let mut add = |name: &str| match *shape {
                WaveformShape::Real => vcd.add_var(VarType::Real, 64, name, None),
                WaveformShape::Line => vcd.add_var(VarType::Wire, 1, name, None),
                WaveformShape::Bits { width, signed: false } => {
                    vcd.add_var(VarType::Wire, width, name, None)
                }
                WaveformShape::Bits { width, signed: true } => {
                    vcd.add_var(VarType::Integer, width, name, None)
                }
            };
            *signals = match *elements {
                Some(count) => {
                    let names = (0..count).map(|index| format!("{name}[{index}]"));
                    names.map(|name| add(&name)).collect::<io::Result<_>>()?
                }
                None => vec![add(name)?],
            };
        }
        vcd.upscope()?;
        vcd.enddefinitions()
    }

    /// Writes the value that the watched variable `index` has at the end of a tick, unless it is the one
    /// that was written last; gives whether it was written. The tick began `time_ns` nanoseconds after
    /// the first one.
    ///
    /// # Errors
    /// When `out` can't be written.
    pub fn row(
        &mut self,
        (tick, time_ns): (u64, u64),
        index: usize,
        value: Value,
        out: &mut dyn Write,
    ) -> io::Result<bool> {
        let Some(variable) = self.variables.get_mut(index) else { return Ok(false) };
        if variable.last.as_ref() == Some(&value) {
            return Ok(false);
        }
        match self.format {
            TraceFormat::Csv { time } => {
                row(out, tick, time.then_some(time_ns), &variable.shown, &value)?;
            }
            TraceFormat::Vcd => {
                let mut vcd = vcd::Writer::new(&mut *out);
                let time = time_ns / 1000;
                if self.written != Some(time) {
                    vcd.timestamp(time)?;
                    self.written = Some(time);
                }
                let Watched { signals, shape, last, .. } = variable;
                change(&mut vcd, signals, *shape, last.as_ref(), &value)?;
            }
        }
        variable.last = Some(value);
        Ok(true)
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

/// Writes the values of the watched variables that have changed since they were last written.
#[derive(Clone, Debug)]
pub struct Trace {
    text: TraceText,
}

impl Trace {
    /// A trace without rows.
    pub fn new(watch: &Watch, format: TraceFormat, names: &dyn Names) -> Self {
        Self { text: TraceText::new(watch, format, names) }
    }

    /// Writes the header.
    ///
    /// # Errors
    /// When `out` can't be written.
    pub fn header(&mut self, out: &mut dyn Write) -> io::Result<()> {
        self.text.header(out)
    }

    /// Writes the values of the variables of `watch`, with which the trace was made, that differ at the end of a tick
    /// from the last ones written; gives whether there were any. The tick began `time_ns` nanoseconds after the first one.
    ///
    /// # Errors
    /// When `out` can't be written.
    pub fn rows(
        &mut self,
        (tick, time_ns): (u64, u64),
        watch: &Watch,
        executive: &dyn Executive,
        out: &mut dyn Write,
    ) -> io::Result<bool> {
        let mut any = false;
        for (index, (_, variable)) in watch.names().iter().enumerate() {
            any |= self.text.row((tick, time_ns), index, executive.read(*variable), out)?;
        }
        Ok(any)
    }

    /// Writes the time at which the trace ends; see [`TraceText::end`].
    ///
    /// # Errors
    /// When `out` can't be written.
    pub fn end(&self, time_ns: u64, out: &mut dyn Write) -> io::Result<()> {
        self.text.end(time_ns, out)
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
    // The name of bits of a word, as in `Y:$FFC2,8`.
    let quoted = if name.contains(',') { "\"" } else { "" };
    write!(out, "{quoted}{name}{quoted},")?;
    match value {
        Value::Array(_) => writeln!(out, "\"{value}\""),
        Value::Int(_) | Value::Float(_) => writeln!(out, "{value}"),
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
    shape: WaveformShape,
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
                change_one(vcd, *signal, shape, value)?;
            }
        }
        return Ok(());
    }
    match signals {
        [signal, ..] => change_one(vcd, *signal, shape, value),
        [] => Ok(()),
    }
}

/// Writes the new value of one signal.
fn change_one<W: Write>(
    vcd: &mut vcd::Writer<W>,
    signal: IdCode,
    shape: WaveformShape,
    value: &Value,
) -> io::Result<()> {
    let Some(width) = shape.width() else {
        return vcd.change_real(signal, WaveformShape::real(value));
    };
    match (shape.bits(value), width) {
        (None, 1) => vcd.change_scalar(signal, vcd::Value::X),
        (None, _) => vcd.change_vector(signal, [vcd::Value::X]),
        (Some(bits), 1) => vcd.change_scalar(signal, bits != 0),
        (Some(bits), _) => {
            // The highest bit comes first. Leading zeros are left out, since viewers fill them in.
            let length = 64 - bits.leading_zeros().min(63);
            let bit = |at: u32| vcd::Value::from(bits >> at & 1 != 0);
            vcd.change_vector(signal, (0..length).rev().map(bit))
        }
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
