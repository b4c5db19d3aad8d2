//! Writes the dump of a control that can't write one any more, from its image file: that of a process
//! that was killed, or that still runs.

use std::io::{self, Write};

use plcc_abi::{Dialect, natural_cmp};
use plcc_control::Watch;
use plcc_control::dump::{self, quoted, write_head, write_variables};
use plcc_image::{Direction, ImageReader, Number, Place, Snapshot, State, Symbol};

use plcc_runtime::value::number;
use plcc_runtime::{Executive, Names, Purpose};

/// What becomes of the file's last tick where the process died while it wrote it.
const TORN: &str = "the control died while it wrote a tick into it; nothing whole is left";

/// Why the image can't be used.
fn wrong(what: &str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, what)
}

/// Writes what a dump has before its variables. The image does not say why a program was stopped.
fn write_image_head(
    out: &mut dyn Write,
    reader: &ImageReader,
    snapshot: &Snapshot,
) -> io::Result<()> {
    let state = match snapshot.state {
        Some(State::Stopped) => dump::State::Stopped(None),
        _ => dump::State::Running,
    };
    write_head(out, dialect(reader)?, snapshot.ticks, state)
}

/// Writes the dump with an executive of the image's program. It is the dump of a run
/// ([`dump`](plcc_control::dump())), but for `stop`, which is null also where the program is stopped, and with a
/// further object `outputs`: what drivers see of the outputs, by their names.
///
/// # Errors
/// When the image is that of another program, holds no whole tick, or `out` can't be written.
pub fn dump_image(
    out: &mut dyn Write,
    reader: &ImageReader,
    executive: &mut dyn Executive,
    watch: &Watch,
) -> io::Result<()> {
    if reader.fingerprint() != executive.fingerprint() {
        return Err(wrong("it is the image of another program than the artifact's"));
    }
    let snapshot = reader.read().ok_or_else(|| wrong(TORN))?;
    executive.set_image(&snapshot.image);
    write_image_head(out, reader, &snapshot)?;
    write_variables(out, executive, watch)?;
    let mut symbols = sorted_symbols(reader);
    symbols.retain(|symbol| !is_spare_line(executive.names().as_ref(), &symbol.name));
    write_outputs(out, &symbols, &snapshot)
}

/// Whether a name is that of a single line which is none of the program's outputs. The file shows such lines so that they can
/// be wired and forced.
fn is_spare_line(names: &dyn Names, name: &str) -> bool {
    let Ok(key) = names.find(name, Purpose::Watch) else { return false };
    names.lines(key) == [key] && names.outputs().iter().all(|(_, output)| *output != key)
}

/// The symbols of the file's table in natural sort order.
fn sorted_symbols(reader: &ImageReader) -> Vec<Symbol> {
    let mut symbols = reader.symbols();
    symbols.sort_by(|a, b| natural_cmp(&a.name, &b.name));
    symbols.dedup_by(|a, b| a.name == b.name);
    symbols
}

/// Writes the object `outputs` and the end of the dump: what is on the physical lines of outputs, or their
/// values where they have no lines of their own.
fn write_outputs(out: &mut dyn Write, symbols: &[Symbol], snapshot: &Snapshot) -> io::Result<()> {
    out.write_all(b",\"outputs\":{")?;
    let outputs = symbols.iter().filter(|symbol| symbol.direction == Direction::Output);
    write_pairs(out, outputs.filter_map(|symbol| Some((symbol, shown(snapshot.output(symbol)?)))))?;
    out.write_all(b"}}\n")
}

/// The language of the image's program.
fn dialect(reader: &ImageReader) -> io::Result<Dialect> {
    let dialect = Dialect::ALL.get(reader.dialect() as usize).copied();
    dialect.ok_or_else(|| wrong("its language is not known"))
}

/// Writes such a dump with nothing but the image file: its variables are those that the file's table names.
///
/// # Errors
/// When the image holds no whole tick, or `out` can't be written.
pub fn dump_image_alone(out: &mut dyn Write, reader: &ImageReader) -> io::Result<()> {
    let snapshot = reader.read().ok_or_else(|| wrong(TORN))?;
    write_image_head(out, reader, &snapshot)?;
    let symbols = sorted_symbols(reader);
    let values = symbols.iter().filter_map(|symbol| Some((symbol, value(symbol, &snapshot)?)));
    out.write_all(b"\"variables\":{")?;
    write_pairs(out, values)?;
    out.write_all(b"}")?;
    write_outputs(out, &symbols, &snapshot)
}

fn write_pairs<'a>(
    out: &mut dyn Write,
    pairs: impl Iterator<Item = (&'a Symbol, String)>,
) -> io::Result<()> {
    for (index, (symbol, value)) in pairs.enumerate() {
        let comma = if index > 0 { "," } else { "" };
        write!(out, "{comma}{}:{value}", quoted(&symbol.name))?;
    }
    Ok(())
}

/// A number as JSON.
fn shown(value: Number) -> String {
    match value {
        Number::Int(value) => value.to_string(),
        Number::Float(value) => number(value),
    }
}

/// The value of a symbol as JSON, an array as a list; `None` where it lies outside the image.
fn value(symbol: &Symbol, snapshot: &Snapshot) -> Option<String> {
    if symbol.elements == 1 {
        return snapshot.value(symbol).map(shown);
    }
    let Place { offset, width, .. } = symbol.value;
    let element = |index: u32| {
        let offset = index.checked_mul(u32::from(width) / 8)?.checked_add(offset)?;
        Place { offset, ..symbol.value }.read(&snapshot.image).map(shown)
    };
    let mut elements = vec![];
    for index in 0..symbol.elements {
        // A table that names more elements than the image has is wrong.
        elements.push(element(index)?);
    }
    Some(format!("[{}]", elements.join(",")))
}
