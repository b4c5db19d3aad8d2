//! The log: a line of JSON for each event, and a sentence on standard error.

use std::fs::{File, OpenOptions};
use std::io::Write;
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::SystemTime;

use plcc_abi::printable;
use serde_json::{Map, Value};

/// Where events go. All drivers have a copy.
#[derive(Clone, Debug)]
pub(crate) struct Events(Arc<Mutex<Option<File>>>);

impl Events {
    /// Appends to a log, if there is one.
    ///
    /// # Errors
    /// Why the file can't be opened.
    pub(crate) fn open(log: Option<&Path>) -> Result<Self, String> {
        let open = |path: &Path| {
            // Nothing waits for whoever reads a pipe.
            let nonblock = rustix::fs::OFlags::NONBLOCK.bits() as i32;
            let mut options = OpenOptions::new();
            let file = options.create(true).append(true).custom_flags(nonblock).open(path);
            file.map_err(|error| format!("{}: {error}", path.display()))
        };
        Ok(Self(Arc::new(Mutex::new(log.map(open).transpose()?))))
    }

    /// Writes an event: its kind, and what belongs to it.
    pub(crate) fn write(&self, kind: &str, about: &[(&str, Value)]) {
        let mut line = Map::new();
        let now = humantime::format_rfc3339_micros(SystemTime::now()).to_string();
        line.insert("time".into(), now.into());
        line.insert("kind".into(), kind.into());
        let mut sentence = format!("{kind}:");
        for (key, value) in about {
            let shown = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
            sentence.push_str(&format!(" {key} {shown};"));
            line.insert((*key).into(), value.clone());
        }
        let sentence = printable(sentence.trim_end_matches([';', ':']));
        append(&mut std::io::stderr(), sentence.to_string());
        let mut log = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(log) = log.as_mut() {
            append(log, Value::Object(line).to_string());
        }
    }
}

/// Writes a line at once, so that nobody reads half of it, and none is left when `plcio` is killed. What can't be
/// written is lost: there is nowhere else to say it.
fn append(to: &mut impl Write, mut line: String) {
    line.push('\n');
    let _ = to.write_all(line.as_bytes());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_written_at_once() {
        struct Writes(Vec<Vec<u8>>);
        impl Write for Writes {
            fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
                self.0.push(bytes.to_vec());
                Ok(bytes.len())
            }

            fn flush(&mut self) -> std::io::Result<()> {
                Ok(())
            }
        }
        let mut writes = Writes(vec![]);
        append(&mut writes, "{\"kind\":\"lost\"}".into());
        assert_eq!(writes.0, [b"{\"kind\":\"lost\"}\n"]);
    }
}
