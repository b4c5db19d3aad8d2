//! The monitor in a terminal. It draws the views of a [`Session`] and makes commands of keys, and keeps
//! nothing but which screen is shown and what is being typed.

mod app;
mod draw;
mod keys;
mod operator;
mod scope;
#[cfg(test)]
mod tests;
mod typed;
mod why;

pub use plcc_screen::{TerminalError, check};

use plcc_screen::Display;
use ratatui::Frame;
use ratatui::crossterm::event::KeyEvent;

use crate::Session;
use app::App;

/// A session with what its terminal shows of it.
struct Shown<'s, 'p> {
    app: App,
    session: &'s mut Session<'p>,
}

impl Display for Shown<'_, '_> {
    fn draw(&mut self, frame: &mut Frame<'_>) {
        self.session.poll();
        self.app.draw(self.session, frame);
    }

    fn key(&mut self, key: KeyEvent) {
        self.app.key(self.session, key);
    }

    fn is_left(&self) -> bool {
        self.app.is_left
    }
}

/// Shows a session until the user leaves, or SIGINT, SIGTERM, SIGQUIT or SIGHUP comes. The terminal is as it
/// was before, also after a panic.
///
/// # Errors
/// When there is no terminal that can show it, or the terminal fails.
pub fn run(session: &mut Session<'_>) -> Result<(), TerminalError> {
    plcc_screen::run(&mut Shown { app: App::new(session), session })
}
