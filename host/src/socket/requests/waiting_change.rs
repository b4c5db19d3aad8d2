//! An online change on its way to the thread that runs the ticks, and back as long as it can't be carried out.
//!
//! What is asked meanwhile names variables of the program that runs, so the change must not be carried out before that
//! is answered. So the other thread has the change while nothing is asked, and tries it before each tick. When somebody
//! asks something, the change is withdrawn first, and handed over again afterwards.

use std::time::{Duration, Instant};

use plcc_protocol::{DEFAULT_WAIT, ErrorCode, Failure, MAX_WAIT, WaitingChange};
use serde_json::Value as Json;

use super::online_change::PendingChange;
use super::{Continuation, Requests, refused};
use crate::replacement::{Progress, Replacement};
use crate::socket::commands::Command;

/// An online change that was asked and is not answered.
pub(super) struct ChangeUnderWay {
    /// How long it may wait.
    wait: Duration,
    /// Until when that is.
    ends: Instant,
    /// Why it is given up, if so.
    given_up: Option<String>,
    place: Place,
}

/// Who has an online change.
enum Place {
    /// The thread that runs the ticks.
    Handed {
        /// Whether it was asked to give the change back.
        withdrawn: bool,
    },
    /// This thread.
    SetAside(Box<Replacement>, Box<PendingChange>),
}

/// How long a change may wait.
///
/// # Errors
/// When the request says something else than a number of seconds.
pub(super) fn duration(wait: Option<f64>) -> Result<Duration, Failure> {
    let wait = wait.unwrap_or(DEFAULT_WAIT);
    let duration = Duration::try_from_secs_f64(wait).ok().filter(|_| wait <= MAX_WAIT);
    duration.ok_or_else(|| {
        let text = format!("wait is a number of seconds from 0 to {MAX_WAIT}");
        Failure::new(ErrorCode::BadValue, text)
    })
}

impl Requests {
    /// Hands a change to the thread that runs the ticks. There must be room in the queue.
    pub(super) fn hand_over(
        &mut self,
        replacement: Box<Replacement>,
        change: Box<PendingChange>,
        wait: Duration,
        ends: Instant,
    ) -> Result<(), Failure> {
        self.ask(Command::Replace(replacement), Continuation::OnlineChange(change))?;
        let place = Place::Handed { withdrawn: false };
        self.under_way = Some(ChangeUnderWay { wait, ends, given_up: None, place });
        self.is_exclusive = true;
        Ok(())
    }

    /// Refuses a further online change while one waits.
    pub(super) fn check_none_waits(&self) -> Result<(), Failure> {
        match &self.under_way {
            None => Ok(()),
            Some(_) => Err(refused("another online change waits; cancel it first (cancel)")),
        }
    }

    /// Whether a request can be taken now. To be asked when there is one: a change that waits is withdrawn for it.
    pub(in crate::socket) fn takes_requests(&mut self) -> bool {
        self.withdraw();
        !self.is_exclusive
    }

    /// Has the other thread give a change back.
    fn withdraw(&mut self) {
        if let Some(ChangeUnderWay { place: Place::Handed { withdrawn }, .. }) = &mut self.under_way
            && !*withdrawn
        {
            // Without room it is tried again.
            *withdrawn = self.queues.commands.push(Command::Withdraw).is_ok();
        }
    }

    /// Keeps a change that has come back without having been carried out.
    pub(super) fn set_aside(&mut self, replacement: Box<Replacement>, change: Box<PendingChange>) {
        if let Some(under_way) = &mut self.under_way {
            under_way.place = Place::SetAside(replacement, change);
        }
    }

    /// Gives up the change that is under way, unless it is carried out before it comes back.
    pub(in crate::socket) fn give_up_change(&mut self, why: impl Into<String>) {
        if let Some(under_way) = &mut self.under_way {
            under_way.given_up.get_or_insert_with(|| why.into());
        }
    }

    /// Goes on with a change that waits: hands it over again, or ends it when its time is over. Gives the answer to its
    /// request in the latter case.
    pub(in crate::socket) fn continue_change(
        &mut self,
        now: Instant,
    ) -> Option<Result<Json, Failure>> {
        let under_way = self.under_way.as_ref()?;
        let is_over = under_way.given_up.is_some() || now >= under_way.ends;
        if let Place::Handed { .. } = under_way.place {
            if is_over {
                self.withdraw();
            }
            return None;
        }
        // A force that is under way comes first, since the new program has to have it too.
        if !is_over && (self.is_exclusive || self.check_room().is_err()) {
            return None;
        }
        let ChangeUnderWay { wait, ends, given_up, place } = self.under_way.take()?;
        let Place::SetAside(mut replacement, mut change) = place else { return None };
        let failure = match given_up {
            Some(why) => refused(format!("the online change was given up: {why}")),
            None if is_over => refused(overdue(&replacement, wait)),
            None => match self.take_forces(&mut change, replacement.executive.as_mut()) {
                Ok(()) => match self.hand_over(replacement, change, wait, ends) {
                    Ok(()) => return None,
                    Err(failure) => return Some(Err(failure)),
                },
                Err(failure) => failure,
            },
        };
        self.abandon(*replacement, *change);
        Some(Err(failure))
    }

    /// The change that waits, as a part of the status.
    pub(super) fn shown_waiting_change(&self, now: Instant) -> Option<WaitingChange> {
        let ChangeUnderWay { ends, place, .. } = self.under_way.as_ref()?;
        let Place::SetAside(replacement, change) = place else { return None };
        Some(WaitingChange {
            program: change.next.title.clone(),
            why: obstacle(replacement).to_owned(),
            by: change.by.to_string(),
            seconds_left: ends.saturating_duration_since(now).as_secs_f64(),
        })
    }
}

/// What a change waits for.
fn obstacle(replacement: &Replacement) -> &'static str {
    match replacement.progress {
        Progress::Waits(why) => why,
        _ => "",
    }
}

/// What is said of a change whose time is over.
fn overdue(replacement: &Replacement, wait: Duration) -> String {
    let (why, wait) = (obstacle(replacement), wait.as_secs_f64());
    format!(
        "{why}; the online change has waited {wait} s for its end. Ask again when it has ended, or let the change wait \
         longer (wait)"
    )
}
