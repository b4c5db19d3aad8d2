//! The keys of the operator's screen.

use plcc_screen::Asked;
use ratatui::crossterm::event::KeyCode;

use super::app::App;
use crate::view::{Body, Screen};
use crate::{Command, Session};

impl App {
    pub(super) fn operator_key(&mut self, session: &mut Session<'_>, code: KeyCode) {
        let Body::Operator(view) = session.view(&Screen::Operator).body else {
            self.is_left = matches!(code, KeyCode::Char('q') | KeyCode::F(10));
            return;
        };
        match self.operator.key(&view, code) {
            Asked::Nothing => {}
            Asked::Leave => self.is_left = true,
            Asked::Press { name, value } => self.apply(session, Command::Change { name, value }),
            Asked::Refused(why) => self.message = Some((why.into(), true)),
        }
    }
}
