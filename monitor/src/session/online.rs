//! The terminal of a control that has one: what is typed goes to the language's terminal, which asks the session for values
//! and has it set variables.

use std::collections::BTreeMap;
use std::time::Instant;

use plcc_frontend::LANGUAGES;
use plcc_frontend::presentation::{Desk, Row, Terminal};
use plcc_runtime::{Event, EventBody};

use super::Session;
use crate::view::{TerminalLine, TerminalView};
use crate::{Command, Refusal, Reply};

/// How many lines the terminal keeps.
const MAX_LINES: usize = 1000;

/// What was typed and answered.
#[derive(Debug, Default)]
pub(super) struct OnlineState {
    lines: Vec<TerminalLine>,
    /// What takes the commands, from the first one on.
    terminal: Option<Box<dyn Terminal>>,
}

impl OnlineState {
    fn add(&mut self, typed: bool, text: &str) {
        self.lines.extend(text.lines().map(|line| TerminalLine { typed, text: line.into() }));
        let over = self.lines.len().saturating_sub(MAX_LINES);
        self.lines.drain(..over);
    }
}

/// Why a control has no terminal.
pub(crate) fn no_terminal() -> String {
    let with = LANGUAGES.iter().filter(|language| language.terminal().is_some());
    let titles: Vec<&str> = with.map(|language| language.title()).collect();
    format!("only a {} has a terminal", titles.join(" or a "))
}

impl Session<'_> {
    pub(super) fn terminal_view(&mut self) -> Result<TerminalView, Refusal> {
        self.require_terminal()?;
        Ok(TerminalView { lines: self.online.lines.clone() })
    }

    /// Refuses a control that has none. Nothing is known of one that has not answered yet.
    fn require_terminal(&self) -> Result<(), Refusal> {
        match self.language() {
            Some(language) if language.terminal().is_none() => Err(Refusal::new(no_terminal())),
            Some(_) | None => Ok(()),
        }
    }

    /// Has `work` done with the terminal. `None` if there is no terminal.
    fn with_terminal<T>(
        &mut self,
        work: impl FnOnce(&mut dyn Terminal, &mut Self) -> T,
    ) -> Option<T> {
        let mut terminal = match (self.online.terminal.take(), &self.debugger) {
            (Some(terminal), _) => terminal,
            (None, Some(debugger)) => debugger.program().checked().terminal()?,
            (None, None) => self.language()?.terminal()?,
        };
        let done = work(terminal.as_mut(), self);
        self.online.terminal = Some(terminal);
        Some(done)
    }

    pub(super) fn online(&mut self, line: &str) -> Result<Reply, Refusal> {
        if let (None, Some(link)) = (self.language(), &mut self.link) {
            link.ask_status()?;
        }
        self.require_terminal()?;
        self.online.add(true, line);
        let answer = self.with_terminal(|terminal, desk| terminal.answer(line.trim(), desk));
        let answer = answer.unwrap_or_else(|| Err("the control is not known yet".into()));
        match &answer {
            Ok(text) | Err(text) => self.online.add(false, text),
        }
        answer.map(|text| Reply { message: None, text: Some(text) }).map_err(Refusal::new)
    }

    /// Shows in the terminal, once it is used, what the control sends to it: texts of SEND, and what came of commands for motors.
    pub(super) fn show_in_terminal(&mut self, events: &[Event]) {
        if self.online.terminal.is_none() {
            return;
        }
        for event in events {
            match &event.body {
                EventBody::Send { text, .. } => self.online.add(false, &plcc_abi::printable(text)),
                EventBody::Motion(report) => self.online.add(false, &report.to_string()),
                _ => {}
            }
        }
    }

    /// Shows further lines of a long answer, until a moment. Gives whether there was anything to do.
    pub(super) fn continue_answer(&mut self, until: Instant) -> bool {
        if self.online.terminal.is_none() {
            return false;
        }
        let lines = self.with_terminal(|terminal, desk| terminal.further_lines(until, desk));
        let Some(lines) = lines.flatten() else { return false };
        lines.iter().for_each(|line| self.online.add(false, line));
        true
    }
}

impl Desk for Session<'_> {
    fn read(&mut self, names: &[String]) -> Result<BTreeMap<String, f64>, String> {
        self.read_values(names)
    }

    fn set(&mut self, name: &str, value: &str) -> Result<String, String> {
        let reply = self.change(name, value).map_err(|refusal| refusal.message)?;
        Ok(reply.message.unwrap_or_default())
    }

    fn unknown(&mut self, name: &str) -> String {
        Session::unknown(self, name).message
    }

    fn defined_name(&self, name: &str) -> Option<String> {
        Session::defined_name(self, name)
    }

    fn image(&mut self) -> Result<Vec<u8>, String> {
        let debugger = self.debugger().map_err(|refusal| refusal.message)?;
        Ok(debugger.history_mut().executive().image().to_vec())
    }

    fn tasks(&mut self) -> Result<Vec<String>, String> {
        let tasks = &self.debugger().map_err(|refusal| refusal.message)?.program().tables().tasks;
        Ok(tasks.iter().map(|task| task.name.clone()).collect())
    }

    fn rows(&self) -> &[Row] {
        &self.text.rows
    }

    fn next_tick(&self) -> u64 {
        self.time.run_until
    }

    fn values_after(&mut self, tick: u64, names: &[String]) -> Result<Vec<f64>, String> {
        Session::values_after(self, tick, names).map_err(|refusal| refusal.message)
    }

    fn show_on_scope(&mut self, names: &[String], from: u64, to: u64) -> Result<(), String> {
        let commands =
            [Command::ScopeAdd { names: names.to_vec() }, Command::ScopeRange { from, to }];
        for command in commands {
            self.apply(command).map_err(|refusal| refusal.message)?;
        }
        Ok(())
    }
}
