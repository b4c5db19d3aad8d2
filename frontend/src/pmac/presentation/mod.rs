//! What is shown of a PMAC program: the names of its variables, and their classes.

mod classes;
mod facts;
mod io;
mod motors;
mod panels;
mod terminal;
mod text;
mod timers;
mod watch;

use plcc_abi::pmac::motion::MotionName;
use plcc_abi::pmac::{PmacName, Text};
use plcc_diag::SourceMap;

use super::ast::{Stmt, StmtKind};
use super::{Program, access, outputs, tasks};
use crate::common::Accessed;
use crate::presentation::{
    Announced, Exchange, Fact, IoPoint, PanelDraft, Presentation, Read, Row, StatementPlaces,
    Terminal, TextStatement, Uses, WatchRow,
};

pub(super) use classes::{CLASSES, title};
pub(super) use terminal::PmacTerminal;
pub(super) use text::opened_plc;

impl Presentation for Program {
    fn name(&self, accessed: Accessed) -> Option<String> {
        access::name(accessed).map(|name| name.to_string())
    }

    /// Statements enable and disable PLCs, but no observer is told that as a write. An on-line command is not a variable.
    fn accessed(&self, name: &str) -> Option<Accessed> {
        let name = PmacName::parse(name, &self.loaded.layout).ok()?;
        let is_told =
            !matches!(name, PmacName::Plc { .. } | PmacName::Motion(MotionName::Online(_)));
        is_told.then(|| access::accessed(name))
    }

    fn canonical(&self, name: &str) -> Option<String> {
        let name = PmacName::parse(name, &self.loaded.layout).ok()?;
        Some(name.to_string())
    }

    fn is_outside_image(&self, accessed: Accessed) -> bool {
        access::is_memory(accessed)
    }

    fn text(&self, sources: &SourceMap, places: &StatementPlaces) -> Vec<Row> {
        let words = super::words::words(sources, &self.names, &self.download, self.loaded.layout);
        text::text(sources, &words, places)
    }

    /// A Q-variable has its coordinate system in front of it.
    fn is_written_as(&self, accessed: &str, piece: &str) -> bool {
        let in_system = |rest: &str| rest.trim_start_matches(char::is_numeric) == piece;
        accessed == piece || accessed.strip_prefix('&').is_some_and(in_system)
    }

    fn waits_in(&self, rows: &[Row], row: usize) -> usize {
        text::open_while(rows, row).unwrap_or(row)
    }

    /// The PLC whose OPEN stands before the row.
    fn task_of(&self, rows: &[Row], row: usize) -> Option<String> {
        rows.get(..=row)?.iter().rev().find_map(|row| opened_plc(&row.text()))
    }

    /// The statements of COMMANDs are tasks for the engine.
    fn is_users_task(&self, name: &str) -> bool {
        !name.starts_with("COMMAND")
    }

    fn facts(&self, tasks: &[String], tick_ns: u64, read: Read<'_>) -> Result<Vec<Fact>, String> {
        facts::facts(tasks, tick_ns, read)
    }

    fn watch_rows(&self, entry: &str) -> Result<Vec<WatchRow>, String> {
        watch::rows(entry, &|word| watch::defined_name(self, word))
    }

    fn defined_name(&self, word: &str) -> Option<String> {
        watch::defined_name(self, word)
    }

    /// SEND, DISPLAY of a text, COMMAND, and writes to the MACRO ring.
    fn text_statements(&self) -> Vec<TextStatement> {
        let tasks = tasks::tasks(&self.download, &self.loaded);
        let all = (0..).zip(tasks.iter().flat_map(|(_, code)| code.iter()));
        let of = |(statement, stmt): (u32, &Stmt)| {
            let StmtKind::Text(index, _) = stmt.kind else { return None };
            let text = match self.download.texts.get(index as usize)? {
                Text::Send { text, .. }
                | Text::Show { text, .. }
                | Text::Command { text, .. }
                | Text::Macro { text } => text.clone(),
                Text::Value { .. } => return None,
            };
            Some(TextStatement { statement, text })
        };
        all.filter_map(of).collect()
    }

    fn io_points(&self, declared: &[String], image: &[u8]) -> Vec<IoPoint> {
        let tasks = tasks::tasks(&self.download, &self.loaded);
        let code = tasks.iter().map(|(_, code)| *code);
        let outputs = outputs::outputs(&self.download, &self.loaded, code);
        io::points(&self.loaded.layout, &outputs, declared, image)
    }

    fn panels(&self, _: &[Announced], read: Read<'_>) -> Result<Vec<PanelDraft>, String> {
        panels::panels(self.loaded.layout.controller, read)
    }

    fn terminal(&self) -> Option<Box<dyn Terminal>> {
        Some(Box::new(PmacTerminal::new(Some(self.loaded.layout.controller))))
    }

    fn counts_time(&self, name: &str, image: &[u8]) -> bool {
        timers::counts_time(&self.loaded.layout, name, image)
    }

    /// M-variables in words of memory, each of which may be another one's: the gate array's, or the dual-ported RAM's.
    fn exchange(&self, name: &str, uses: Uses) -> Option<Exchange> {
        let given = if uses.written { Exchange::Program } else { Exchange::Machine };
        (name.starts_with('M') && uses.in_word).then_some(given)
    }
}
