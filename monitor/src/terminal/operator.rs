//! The keys of the operator's screen: arrows choose a key of the program, Enter or a space presses or releases it.

use ratatui::crossterm::event::KeyCode;

use super::app::App;
use crate::view::{Body, PanelCell, Screen};
use crate::{Command, Session};

/// What the keys do, for the last row of the screen.
pub(super) const KEYS: &str = "arrows: choose a key  Enter: press or release it  q: leave";

impl App {
    pub(super) fn operator_key(&mut self, session: &mut Session<'_>, code: KeyCode) {
        let move_by = |at: usize, by: isize| at.saturating_add_signed(by);
        match code {
            KeyCode::Char('q') | KeyCode::F(10) => self.is_left = true,
            KeyCode::Left => self.selected = move_by(self.selected, -1),
            // Drawing keeps it among the keys.
            KeyCode::Right => self.selected = move_by(self.selected, 1),
            KeyCode::Up => self.selected = move_by(self.selected, -(self.columns as isize)),
            KeyCode::Down => self.selected = move_by(self.selected, self.columns as isize),
            KeyCode::Enter | KeyCode::Char(' ') => self.press_key(session),
            _ => {}
        }
    }

    fn press_key(&mut self, session: &mut Session<'_>) {
        let Body::Operator(view) = session.view(&Screen::Operator).body else { return };
        match view.keys.get(self.selected).and_then(PanelCell::press) {
            Some((name, value)) => self.apply(session, Command::Change { name, value }),
            None => self.message = Some(("this is a lamp, which can't be pressed".into(), true)),
        }
    }
}
