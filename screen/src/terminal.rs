//! The terminal: a display is drawn into it some times a second and gets its keys, until the user leaves or a signal comes.

use std::io::{self, IsTerminal};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use ratatui::crossterm::event::{self, Event, KeyCode, KeyEvent, KeyEventKind, KeyModifiers};
use ratatui::{DefaultTerminal, Frame};
use rustix::event::{PollFd, PollFlags, Timespec};
use signal_hook::consts::{SIGHUP, SIGINT, SIGQUIT, SIGTERM};
use signal_hook::iterator::Signals;
use thiserror::Error;

/// How often the display is drawn anew.
const PERIOD: Duration = Duration::from_millis(100);

/// How long after a signal the process may take to end by itself.
const GRACE: Duration = Duration::from_secs(2);

/// Why nothing can be shown.
#[derive(Debug, Error)]
pub enum TerminalError {
    /// Input or output is not a terminal, or one that can't place its cursor.
    #[error("{0}; a terminal that can place its cursor is needed")]
    Unfit(String),
    /// The terminal has failed.
    #[error("the terminal can't be used: {0}")]
    Failed(#[from] io::Error),
}

/// What is shown in a terminal.
pub trait Display {
    /// Draws it as it is now. This is called some times a second.
    fn draw(&mut self, frame: &mut Frame<'_>);

    /// Takes a key.
    fn key(&mut self, key: KeyEvent);

    /// Whether the user has left.
    fn is_left(&self) -> bool;
}

/// Shows a display until the user leaves, or SIGINT, SIGTERM, SIGQUIT or SIGHUP comes. The terminal is as it
/// was before, also after a panic.
///
/// # Errors
/// When there is no terminal that can show it, or the terminal fails.
pub fn run(display: &mut dyn Display) -> Result<(), TerminalError> {
    check()?;
    let ended = Arc::new(AtomicBool::new(false));
    end_by_signals(Arc::clone(&ended))?;
    let mut terminal = ratatui::try_init()?;
    let result = show(&mut terminal, display, &ended);
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
        return unfit("standard output is not a terminal");
    }
    if !io::stdin().is_terminal() {
        return unfit("standard input is not a terminal");
    }
    match std::env::var("TERM").as_deref() {
        Err(_) | Ok("") => unfit("TERM is not set"),
        Ok("dumb") => unfit("TERM is `dumb`"),
        Ok(_) => Ok(()),
    }
}

/// Sets `ended` when a signal comes that ends programs. When the thread that shows the display does not see
/// it, because it is busy or because the library that reads the keys does not return, the process is ended
/// with exit status 130, with the terminal as it was before.
fn end_by_signals(ended: Arc<AtomicBool>) -> io::Result<()> {
    let mut signals = Signals::new([SIGINT, SIGTERM, SIGQUIT, SIGHUP])?;
    let body = move || {
        if signals.forever().next().is_some() {
            ended.store(true, Ordering::Relaxed);
            thread::sleep(GRACE);
            let _ = ratatui::try_restore();
            std::process::exit(130);
        }
    };
    thread::Builder::new().name("signals".into()).spawn(body)?;
    Ok(())
}

/// What came while input was waited for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Waited {
    Nothing,
    Input,
    /// The terminal is gone. The library that reads the keys must not be called any more: it would read
    /// the end of the input again and again, without end.
    HungUp,
}

/// Waits for input at most for `rest`.
fn wait(rest: Duration) -> io::Result<Waited> {
    let stdin = io::stdin();
    let mut polled = [PollFd::new(&stdin, PollFlags::IN)];
    let timeout =
        Timespec { tv_sec: 0, tv_nsec: rest.min(PERIOD).as_nanos().try_into().unwrap_or(0) };
    match rustix::event::poll(&mut polled, Some(&timeout)) {
        Err(rustix::io::Errno::INTR) => return Ok(Waited::Nothing),
        result => result?,
    };
    let [polled] = polled;
    let came = polled.revents();
    Ok(if came.intersects(PollFlags::HUP | PollFlags::ERR | PollFlags::NVAL) {
        Waited::HungUp
    } else if came.contains(PollFlags::IN) {
        Waited::Input
    } else {
        Waited::Nothing
    })
}

fn show(
    terminal: &mut DefaultTerminal,
    display: &mut dyn Display,
    ended: &AtomicBool,
) -> io::Result<()> {
    while !ended.load(Ordering::Relaxed) && !display.is_left() {
        terminal.draw(|frame| display.draw(frame))?;
        let until = Instant::now() + PERIOD;
        // All keys that have come are taken before the next drawing. The library keeps what it has read with
        // a key, so it is asked for more before the terminal is.
        let mut more = false;
        loop {
            let rest = until.saturating_duration_since(Instant::now());
            if !more {
                match wait(rest)? {
                    Waited::HungUp => return Ok(()),
                    Waited::Nothing => break,
                    Waited::Input => {}
                }
            }
            if event::poll(Duration::ZERO)?
                && let Event::Key(key) = event::read()?
                && key.kind != KeyEventKind::Release
            {
                // What other programs have written over the display.
                if key.modifiers.contains(KeyModifiers::CONTROL) && key.code == KeyCode::Char('l') {
                    terminal.clear()?;
                }
                display.key(key);
            }
            if display.is_left() || rest.is_zero() {
                break;
            }
            if wait(Duration::ZERO)? == Waited::HungUp {
                return Ok(());
            }
            more = event::poll(Duration::ZERO)?;
        }
    }
    Ok(())
}
