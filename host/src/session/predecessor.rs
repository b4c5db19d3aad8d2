//! The control that ran before this one. When its supervisor was killed, it ends by itself, and for some ten milliseconds
//! it still holds its files and its socket. Whoever starts the next control at once, as systemd does, means to
//! follow it, so these are waited for.

use std::cell::Cell;
use std::thread;
use std::time::{Duration, Instant};

use crate::journal::Journal;

/// How long all that it holds is waited for.
const PATIENCE: Duration = Duration::from_secs(1);
/// Time from one attempt to the next.
const INTERVAL: Duration = Duration::from_millis(5);

/// The control that may have run before this one.
pub(super) struct Predecessor<'a> {
    /// Whether it is waited for: in real time alone.
    is_waited_for: bool,
    journal: &'a Journal,
    /// When the wait ends, once it has begun.
    until: Cell<Option<Instant>>,
}

impl<'a> Predecessor<'a> {
    pub(super) fn new(is_waited_for: bool, journal: &'a Journal) -> Self {
        Self { is_waited_for, journal, until: Cell::new(None) }
    }

    /// Attempts something, again and again for up to a second while `is_held` says of its error that another process
    /// holds what it needs. `what` names that for people.
    ///
    /// # Errors
    /// That of the last attempt.
    pub(super) fn wait<T, E>(
        &self,
        what: &str,
        mut attempt: impl FnMut() -> Result<T, E>,
        is_held: impl Fn(&E) -> bool,
    ) -> Result<T, E> {
        let mut is_told = false;
        loop {
            let result = attempt();
            if !self.is_waited_for || !result.as_ref().is_err_and(&is_held) {
                return result;
            }
            let now = Instant::now();
            let until = self.until.get().unwrap_or(now + PATIENCE);
            self.until.set(Some(until));
            if now >= until {
                return result;
            }
            if !is_told {
                is_told = true;
                self.journal.note(format!(
                    "{what} is still in use by another process; it is waited for, up to a second"
                ));
            }
            thread::sleep(INTERVAL);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::journal::{Destinations, JournalOwner};

    #[test]
    fn only_what_is_held_is_attempted_again() {
        let (owner, _) = JournalOwner::start(Destinations::default(), false).unwrap();
        let journal = owner.journal();
        let attempts = |is_waited_for: bool, is_held: bool| {
            let mut attempts = 0;
            let attempt = || {
                attempts += 1;
                if attempts == 2 { Ok(()) } else { Err("held") }
            };
            let result = Predecessor::new(is_waited_for, &journal).wait("it", attempt, |_| is_held);
            (result, attempts)
        };
        assert_eq!(attempts(true, true), (Ok(()), 2));
        assert_eq!(attempts(true, false), (Err("held"), 1));
        assert_eq!(attempts(false, true), (Err("held"), 1));
    }
}
