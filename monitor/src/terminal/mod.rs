//! The monitor in a terminal. It draws the views of a [`Session`] and makes commands of keys, and keeps
//! nothing but which screen is shown and what is being typed.

mod app;
mod draw;
mod keys;
#[cfg(test)]
mod tests;
mod typed;

use std::io::{self, IsTerminal};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use ratatui::DefaultTerminal;
use ratatui::crossterm::event::{self, Event, KeyEventKind};
use signal_hook::consts::{SIGHUP, SIGINT, SIGQUIT, SIGTERM};
use thiserror::Error;

use crate::Session;
use app::App;

/// How often the display is drawn anew.
const PERIOD: Duration = Duration::from_millis(100);

/// Why the monitor can't show anything.
#[derive(Debug, Error)]
pub enum TerminalError {
    /// Input or output is no terminal, or one that can't place its cursor.
    #[error("{0}; the monitor needs a terminal that can place its cursor")]
    Unfit(String),
    /// The terminal has failed.
    #[error("the terminal can't be used: {0}")]
    Failed(#[from] io::Error),
}

/// Shows a session until the user leaves, or SIGINT, SIGTERM, SIGQUIT or SIGHUP comes. The terminal is as it
/// was before, also after a panic.
///
/// # Errors
/// When there is no terminal that can show it, or the terminal fails.
pub fn run(session: &mut Session<'_>) -> Result<(), TerminalError> {
    check()?;
    let ended = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM, SIGQUIT, SIGHUP] {
        signal_hook::flag::register(signal, Arc::clone(&ended))?;
    }
    let mut terminal = ratatui::try_init()?;
    let result = show(&mut terminal, session, &ended);
    let restored = ratatui::try_restore();
    result?;
    Ok(restored?)
}

/// Whether there is a terminal that can be used.
///
/// # Errors
/// When input or output is none, or `TERM` says that it can't place its cursor.
pub fn check() -> Result<(), TerminalError> {
    let unfit = |text: &str| Err(TerminalError::Unfit(text.into()));
    if !io::stdout().is_terminal() {
        return unfit("standard output is no terminal");
    }
    if !io::stdin().is_terminal() {
        return unfit("standard input is no terminal");
    }
    match std::env::var("TERM").as_deref() {
        Err(_) | Ok("") => unfit("TERM is not set"),
        Ok("dumb") => unfit("TERM is `dumb`"),
        Ok(_) => Ok(()),
    }
}

fn show(
    terminal: &mut DefaultTerminal,
    session: &mut Session<'_>,
    ended: &AtomicBool,
) -> io::Result<()> {
    let mut app = App::new(session);
    while !ended.load(Ordering::Relaxed) && !app.is_left {
        session.poll();
        terminal.draw(|frame| app.draw(session, frame))?;
        let until = Instant::now() + PERIOD;
        // All keys that have come are taken before the next drawing.
        loop {
            let rest = until.saturating_duration_since(Instant::now());
            if !event::poll(rest)? {
                break;
            }
            if let Event::Key(key) = event::read()?
                && key.kind != KeyEventKind::Release
            {
                app.key(session, key);
            }
            if app.is_left || rest.is_zero() || !event::poll(Duration::ZERO)? {
                break;
            }
        }
    }
    Ok(())
}
