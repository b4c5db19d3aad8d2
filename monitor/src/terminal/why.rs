//! The question why a variable has its value: which variable is meant, and going on from an answer.

use super::app::{App, Page};
use super::keys::Action;
use crate::view::{Body, Screen};
use crate::{Command, Session};

impl App {
    /// The variable that is selected on the page; of a statement the one to which it gives a value.
    pub(super) fn selected_name(&mut self, session: &mut Session<'_>) -> Option<String> {
        match self.page {
            Page::Variables => self.watched(session).map(|row| row.1),
            Page::Io => self.io_row(session).map(|row| row.name),
            Page::Panels => self.cell(session)?.variable,
            Page::Events => {
                let Body::Events(view) = session.view(&Screen::Events).body else { return None };
                let active = view.active.into_iter().map(|one| Some(one.name));
                let log = view.log.into_iter().rev().map(|event| event.asked);
                active.chain(log).nth(self.selected).flatten()
            }
            Page::Statements => {
                let screen = Screen::Statements { first: None, count: self.height.max(1) };
                let Body::Statements(view) = session.view(&screen).body else { return None };
                let line = view.lines.get(view.cursor.checked_sub(view.first)?)?;
                let written = line.values.iter().find(|value| value.written);
                let named = || line.tokens.iter().find_map(|token| token.name.clone());
                written.map(|value| value.name.clone()).or_else(named)
            }
            _ => None,
        }
    }

    /// The tick of the selected row of the log of events.
    fn selected_tick(&mut self, session: &mut Session<'_>) -> Option<u64> {
        let Page::Events = self.page else { return None };
        let Body::Events(view) = session.view(&Screen::Events).body else { return None };
        let row = self.selected.checked_sub(view.active.len())?;
        view.log.iter().rev().nth(row).map(|event| event.tick)
    }

    /// Asks for the variable that is selected. Of a statement, and where none is selected, the user says which is meant.
    pub(super) fn ask_why(&mut self, session: &mut Session<'_>) {
        let name = self.selected_name(session);
        match name.filter(|_| self.page != Page::Statements) {
            Some(name) => {
                let tick = self.selected_tick(session);
                self.why(session, name, tick);
            }
            None => {
                let name = self.selected_name(session).unwrap_or_default();
                self.ask("why (a variable, or the text of a message)", name, Action::AskWhy);
            }
        }
    }

    /// Asks, and shows the answer.
    pub(super) fn why(&mut self, session: &mut Session<'_>, name: String, tick: Option<u64>) {
        self.apply(session, Command::Why { name, tick });
        if !matches!(self.message, Some((_, true))) {
            self.go(Page::Why);
            self.selected = 0;
        }
    }

    /// Asks for the variable of the selected line of the answer.
    pub(super) fn why_next(&mut self, session: &mut Session<'_>) {
        let Body::Why(view) = session.view(&Screen::Why).body else { return };
        let mut lines = view.lines.into_iter().filter(|line| line.name.is_some());
        if let Some((Some(name), tick)) =
            lines.nth(self.selected).map(|line| (line.name, line.tick))
        {
            self.why(session, name, tick);
        }
    }
}
