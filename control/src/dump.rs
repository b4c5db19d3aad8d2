//! Writes the dump (`--dump`): the state at the end of a run, as one line of JSON.

use std::io::{self, Write};

use plcc_abi::{Dialect, natural_cmp};

use plcc_runtime::{Executive, Place, Purpose, Stop, VariableKey};

use crate::Watch;

/// A string as JSON, with its quotes.
pub fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

/// Whether a program goes on, as a dump says it.
#[derive(Clone, Copy, Debug)]
pub enum State<'a> {
    /// It has not been stopped.
    Running,
    /// The control stopped it; the reason, where it is known.
    Stopped(Option<&'a Stop>),
}

impl<'a> From<Option<&'a Stop>> for State<'a> {
    fn from(stop: Option<&'a Stop>) -> Self {
        stop.map_or(Self::Running, |stop| Self::Stopped(Some(stop)))
    }
}

/// Writes the dump of a control after a number of ticks: the variables that the program declares or names and the
/// watched ones, in natural sort order, without blanks and with a line feed at the end. `stop` is why the control stopped the
/// program in the last of these ticks, if it did.
///
/// # Errors
/// When `out` can't be written.
pub fn dump(
    out: &mut dyn Write,
    dialect: Dialect,
    executive: &dyn Executive,
    watch: &Watch,
    ticks: u64,
    stop: Option<&Stop>,
) -> io::Result<()> {
    write_head(out, dialect, ticks, stop.into())?;
    write_variables(out, executive, watch)?;
    out.write_all(b"}\n")
}

/// Writes what a dump has before its variables.
///
/// # Errors
/// When `out` can't be written.
pub fn write_head(
    out: &mut dyn Write,
    dialect: Dialect,
    ticks: u64,
    state: State<'_>,
) -> io::Result<()> {
    write!(out, "{{\"dialect\":\"{}\",\"ticks\":{ticks},", dialect.name())?;
    let stop = match state {
        State::Running => return write!(out, "\"state\":\"running\",\"stop\":null,"),
        State::Stopped(None) => return write!(out, "\"state\":\"stopped\",\"stop\":null,"),
        State::Stopped(Some(stop)) => stop,
    };
    let tick = ticks.saturating_sub(1);
    let (code, message) = (quoted(&stop.code), quoted(&stop.message));
    write!(out, "\"state\":\"stopped\",\"stop\":{{\"tick\":{tick},\"code\":{code},")?;
    write!(out, "\"message\":{message}")?;
    if let Some(Place { file, line }) = &stop.place {
        write!(out, ",\"file\":{},\"line\":{line}", quoted(file))?;
    }
    write!(out, "}},")
}

/// Writes the object `variables`: the variables that the program declares or names and the watched ones, in natural
/// sort order, each once.
///
/// # Errors
/// When `out` can't be written.
pub fn write_variables(
    out: &mut dyn Write,
    executive: &dyn Executive,
    watch: &Watch,
) -> io::Result<()> {
    let names = executive.names();
    let mut variables = names.declared();
    // They are looked up again, since the program may be another one than that with which the run began.
    let found = |(name, _): &(String, VariableKey)| names.find(name, Purpose::Watch).ok();
    let watched = watch.names().iter().filter_map(found);
    variables.extend(watched.map(|key| (names.canonical(key), key)));
    variables.sort_by(|a, b| natural_cmp(&a.0, &b.0));
    variables.dedup_by(|a, b| a.0 == b.0);
    out.write_all(b"\"variables\":{")?;
    for (i, (name, variable)) in variables.into_iter().enumerate() {
        let comma = if i > 0 { "," } else { "" };
        let name = watch.shown(&name, &*names);
        write!(out, "{comma}{}:{}", quoted(&name), executive.read(variable))?;
    }
    out.write_all(b"}")
}
