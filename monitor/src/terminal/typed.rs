//! Lines that are typed: answers to questions, and commands of the PMAC terminal.

use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyModifiers};

use super::app::{App, Page, Prompt};
use super::keys::Action;
use crate::{Command, Edge, ExportFormat, Session, Trigger};

impl App {
    /// A key while a line is being typed.
    pub(super) fn typed(&mut self, session: &mut Session<'_>, key: KeyEvent) {
        let Some(prompt) = &mut self.prompt else { return };
        match key.code {
            KeyCode::Esc => self.prompt = None,
            KeyCode::Backspace => drop(prompt.text.pop()),
            KeyCode::Char(c) if !key.modifiers.contains(KeyModifiers::CONTROL) => {
                prompt.text.push(c);
            }
            KeyCode::Enter => {
                if let Some(Prompt { text, action, .. }) = self.prompt.take() {
                    self.answered(session, action, text.trim());
                }
            }
            _ => {}
        }
    }

    fn answered(&mut self, session: &mut Session<'_>, action: Action, text: &str) {
        let names = || -> Vec<String> {
            let words = text.split([',', ' ']).filter(|word| !word.is_empty());
            words.map(str::to_owned).collect()
        };
        let number = || text.parse::<u64>().ok();
        let wrong = Some(("this is not a number".to_owned(), true));
        let name = text.to_owned();
        let command = match action {
            Action::AskName => Command::FindNames { names: names(), uses: false, all: false },
            Action::AskAll => Command::FindNames { names: names(), uses: true, all: true },
            Action::AskReferences => {
                self.references = name;
                return self.go(Page::References);
            }
            Action::AskSearch => Command::Search { text: name, up: false },
            Action::AskSearchUp => Command::Search { text: name, up: true },
            Action::AskWatch => Command::Watch { names: names() },
            Action::AskChange => match text.split_once('=') {
                Some((name, value)) => {
                    Command::Change { name: name.trim().to_owned(), value: value.trim().to_owned() }
                }
                None => {
                    self.message = Some(("write NAME=VALUE".into(), true));
                    return;
                }
            },
            Action::AskRollback if matches!(text, "y" | "yes") => Command::Rollback,
            Action::AskList => Command::ChooseList { list: name },
            Action::AskForce => return self.force(session, text),
            Action::AskCell => match self.cell(session).and_then(|cell| cell.variable) {
                Some(variable) => Command::Change { name: variable, value: name },
                None => {
                    self.message = Some(("nothing can be set here".into(), true));
                    return;
                }
            },
            Action::AskScope => Command::ScopeAdd { names: names() },
            Action::AskScopeRemove => Command::ScopeRemove { name },
            Action::AskTrigger => Command::ScopeTrigger { trigger: trigger(text) },
            Action::AskExport => return self.export(session, text),
            Action::AskKeep => Command::ScopeSave { name },
            Action::AskOpen => Command::ScopeLoad { name },
            Action::AskWhy => return self.why(session, name, None),
            Action::AskPreviousChange => Command::PreviousChange { name },
            Action::AskSpeed => match text.parse() {
                Ok(speed) => Command::SetSpeed { speed },
                Err(_) => return self.message = wrong,
            },
            Action::AskTick | Action::AskWidth => match number() {
                Some(tick) if action == Action::AskTick => Command::GoToTick { tick },
                Some(ticks) => Command::ScopeWidth { ticks },
                None => return self.message = wrong,
            },
            _ => return,
        };
        self.apply(session, command);
    }

    fn export(&mut self, session: &mut Session<'_>, path: &str) {
        let format = match path.rsplit_once('.').map(|(_, ending)| ending) {
            Some("csv") => ExportFormat::Csv,
            Some("svg") => ExportFormat::Svg,
            _ => {
                self.message = Some(("the name ends in .csv or .svg".into(), true));
                return;
            }
        };
        let text = match session.apply(Command::ScopeExport { format }) {
            Ok(reply) => reply.text.unwrap_or_default(),
            Err(refusal) => {
                self.message = Some((refusal.message, true));
                return;
            }
        };
        let created = std::fs::File::create_new(path);
        let written = created.and_then(|mut file| {
            use std::io::Write;
            file.write_all(text.as_bytes())
        });
        self.message = Some(match written {
            Ok(()) => (format!("{path} was written"), false),
            Err(error) => (format!("{path} can't be written: {error}"), true),
        });
    }

    /// A key of the PMAC terminal; whether it was one.
    pub(super) fn terminal_key(&mut self, session: &mut Session<'_>, key: KeyEvent) -> bool {
        match key.code {
            KeyCode::Char(c) if key.modifiers.contains(KeyModifiers::CONTROL) => {
                // Control characters act at once.
                self.apply(
                    session,
                    Command::Online { line: format!("^{}", c.to_ascii_uppercase()) },
                );
            }
            KeyCode::Char(c) => self.line.push(c),
            KeyCode::Backspace => drop(self.line.pop()),
            KeyCode::Enter => {
                let line = std::mem::take(&mut self.line);
                self.apply(session, Command::Online { line });
            }
            _ => return false,
        }
        true
    }
}

/// A trigger as it is typed: an expression, and which edge.
fn trigger(text: &str) -> Option<Trigger> {
    let text = text.trim();
    if text.is_empty() {
        return None;
    }
    let (expression, edge) = match text.rsplit_once(' ') {
        Some((expression, "rising")) => (expression, Edge::Rising),
        Some((expression, "falling")) => (expression, Edge::Falling),
        Some((expression, "both")) => (expression, Edge::Both),
        _ => (text, Edge::Rising),
    };
    Some(Trigger { expression: expression.trim().into(), edge, before: 50 })
}
