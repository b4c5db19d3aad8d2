//! Writes the dump (`--dump`): the state at the end of a run, as one line of JSON.

use std::io::{self, Write};

use plcc_abi::{Dialect, natural_cmp};

use plcc_runtime::{Executive, Place, Purpose, VariableKey};

use super::{End, Watch};

/// A string as JSON, with its quotes.
pub(super) fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

/// Writes the dump of a run that has ended: the variables that the program declares or names and the
/// watched ones, in natural sort order, without blanks and with a line feed at the end.
///
/// # Errors
/// When `out` can't be written.
pub fn dump(
    out: &mut dyn Write,
    dialect: Dialect,
    executive: &dyn Executive,
    watch: &Watch,
    end: &End,
) -> io::Result<()> {
    head(out, dialect.name(), end, false)?;
    write_variables(out, executive, watch)?;
    out.write_all(b"}\n")
}

/// Writes what stands before the variables. `stopped` says that the program was stopped where `end` does
/// not know why.
pub(super) fn head(out: &mut dyn Write, dialect: &str, end: &End, stopped: bool) -> io::Result<()> {
    write!(out, "{{\"dialect\":\"{dialect}\",\"ticks\":{},", end.ticks)?;
    match &end.stop {
        None if stopped => write!(out, "\"state\":\"stopped\",\"stop\":null,")?,
        None => write!(out, "\"state\":\"running\",\"stop\":null,")?,
        Some(stop) => {
            let tick = end.ticks.saturating_sub(1);
            let (code, message) = (quoted(&stop.code), quoted(&stop.message));
            write!(out, "\"state\":\"stopped\",\"stop\":{{\"tick\":{tick},\"code\":{code},")?;
            write!(out, "\"message\":{message}")?;
            if let Some(Place { file, line }) = &stop.place {
                write!(out, ",\"file\":{},\"line\":{line}", quoted(file))?;
            }
            write!(out, "}},")?;
        }
    }
    Ok(())
}

/// Writes the object `variables`: the variables that the program declares or names and the watched ones, in natural
/// sort order, each once.
pub(super) fn write_variables(
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
