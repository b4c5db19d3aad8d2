//! The runs whose values an editor shows: a control by its socket, and a record.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::os::unix::fs::FileTypeExt;
use std::path::{Path, PathBuf};

use plcc_abi::number;
use plcc_dap::LaunchArguments;
use plcc_lsp::{Run, Value};
use plcc_replay::{ControlSocket, DebugError, Debugger, not_as_given};
use plcc_why::{Question, explain};

use super::why;
use crate::debug_session::{attach, run_command};

/// Opens what has a path: the socket of a control, or a record. `program` is a file of its program.
pub(super) fn open(path: &Path, program: &Path) -> Result<Box<dyn Run>, String> {
    let metadata = fs::metadata(path).map_err(|error| format!("{}: {error}", path.display()))?;
    if metadata.file_type().is_socket() {
        let control = ControlSocket::new(path);
        let names = control.names().map_err(refused)?;
        return Ok(Box::new(Control { control, names, program: program.to_owned() }));
    }
    let recording = Some(path.to_string_lossy().into_owned());
    let command = run_command(&LaunchArguments { recording, ..LaunchArguments::default() })?;
    let session = attach(&command, path, false).map_err(|failure| failure.text("plcc lsp"))?;
    Ok(Box::new(Record { debugger: Debugger::new(session) }))
}

fn refused(error: DebugError) -> String {
    error.0
}

/// A control that runs.
struct Control {
    control: ControlSocket,
    /// What it knows. Another name would have each asked for alone.
    names: BTreeSet<String>,
    /// A file of its program.
    program: PathBuf,
}

impl Run for Control {
    fn ticks(&mut self) -> Result<(u64, u64), String> {
        let status = self.control.status().map_err(refused)?;
        let last = status.ticks.saturating_sub(1);
        Ok((last, last))
    }

    fn values(&mut self, _: u64, names: &[String]) -> Result<BTreeMap<String, Value>, String> {
        let known: Vec<String> =
            names.iter().filter(|name| self.names.contains(*name)).cloned().collect();
        if known.is_empty() {
            return Ok(BTreeMap::new());
        }
        let (_, values) = self.control.values(&known).map_err(refused)?;
        let status = self.control.status().map_err(refused)?;
        let single = |(name, value): (String, Vec<f64>)| {
            let &[value] = value.as_slice() else { return None };
            let force = status.forces.iter().find(|force| force.name == name);
            let forced = force.map(|force| force.value.clone());
            let note = not_as_given(&status, &name);
            Some((name, Value { text: number(value), forced, note }))
        };
        Ok(values.into_iter().filter_map(single).collect())
    }

    fn change(&mut self, name: &str, value: Option<&str>, force: bool) -> Result<u64, String> {
        self.control.change(name, value, force).map_err(refused)
    }

    /// By the program as it lies on the disk, which must be the one that the control runs.
    fn why(&mut self, _: u64, name: &str) -> Result<String, String> {
        let explanation = why::of_control(&self.control, &self.program, name);
        explanation.map(|it| it.to_string()).map_err(|failure| failure.text("plcc lsp"))
    }
}

/// A record.
struct Record {
    debugger: Debugger<'static>,
}

impl Run for Record {
    fn ticks(&mut self) -> Result<(u64, u64), String> {
        self.debugger.look_for_more().map_err(refused)?;
        let last = self.debugger.known_ticks().saturating_sub(1);
        Ok((self.debugger.first_tick(), last))
    }

    fn values(&mut self, tick: u64, names: &[String]) -> Result<BTreeMap<String, Value>, String> {
        self.debugger.go_to_end_of_tick(tick).map_err(refused)?;
        let values = self.debugger.values(names).map_err(refused)?;
        let forces = self.debugger.forces().map_err(refused)?;
        let single = values.into_iter().filter(|it| !it.value.ends_with(" elements"));
        let shown = single.map(|it| {
            let forced = forces.get(&it.name).map(ToString::to_string);
            (it.name, Value { text: it.value, forced, note: None })
        });
        Ok(shown.collect())
    }

    fn change(&mut self, _: &str, _: Option<&str>, _: bool) -> Result<u64, String> {
        Err("a record can't be changed: show a control's socket".into())
    }

    fn why(&mut self, tick: u64, name: &str) -> Result<String, String> {
        self.debugger.go_to_tick(tick).map_err(refused)?;
        let (program, history) = self.debugger.program_and_history();
        let explanation = explain(program, history, &Question::new(name, tick));
        explanation.map(|it| it.to_string()).map_err(refused)
    }
}
