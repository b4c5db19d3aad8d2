//! What the user is asked before a command acts on the machine of a control: a force or a value that is set while the past is shown acts on the
//! present; an output that is set moves the machine.

use std::time::{Duration, SystemTime};

use plcc_abi::place::Direction;
use plcc_runtime::Purpose;

use super::Session;
use crate::Refusal;
use crate::view::TargetKind;

/// What was asked and confirmed.
#[derive(Debug, Default)]
pub(super) struct Confirm {
    /// Whether the last refusal was such a question.
    pub(super) is_asked: bool,
    /// Whether it was confirmed, for the next command.
    pub(super) is_confirmed: bool,
}

impl Session<'_> {
    /// Whether a tick is shown that is not the present one.
    pub(super) fn is_past(&self) -> bool {
        let is_older = self.time.shown + 1 < self.time.run_until;
        let stays = !self.time.following && self.debugger.is_some();
        stays && (is_older || self.kind == TargetKind::Control)
    }

    /// When tick 0 began, in nanoseconds since 1970; `None` where nothing says it.
    pub(super) fn began_ns(&self) -> Option<u64> {
        self.debugger.as_ref()?.history().began_ms()?.checked_mul(1_000_000)
    }

    /// The time of day at which a tick began; `None` where nothing says it.
    pub(super) fn time_of(&self, tick: u64) -> Option<String> {
        let debugger = self.debugger.as_ref()?;
        let began = Duration::from_millis(debugger.history().began_ms()?);
        let since = Duration::from_nanos(tick.saturating_mul(debugger.tick_ns()));
        let time = SystemTime::UNIX_EPOCH.checked_add(began.checked_add(since)?)?;
        let text = humantime::format_rfc3339_seconds(time).to_string();
        Some(text.replace('T', " ").replace('Z', " UTC"))
    }

    /// Asks before a variable is set, forced (`force`) or released (without a value).
    ///
    /// # Errors
    /// The question, until it is confirmed.
    pub(super) fn ask_before(
        &mut self,
        name: &str,
        value: Option<&str>,
        force: bool,
    ) -> Result<(), Refusal> {
        // A program that the monitor runs itself moves no machine.
        if self.link.is_none() || std::mem::take(&mut self.confirm.is_confirmed) {
            return Ok(());
        }
        let what = match (value, force) {
            (Some(value), true) => format!("Force {name} to {value}?"),
            (Some(value), false) => format!("Set {name} to {value}?"),
            (None, _) => format!("End the force of {name}?"),
        };
        let mut reasons = vec![];
        if self.is_past() {
            let tick = self.time.shown;
            reasons.push(format!(
                "This screen shows the PAST, tick {tick}. What you do acts on the machine as it is NOW, which may be in \
                 another state."
            ));
        }
        if !force && value.is_some() && self.is_output(name) {
            reasons.push(format!(
                "{name} is an output: the machine may move at once. It stays so until the program assigns it, which may \
                 be in the next scan; to hold it, force it."
            ));
        }
        if reasons.is_empty() {
            return Ok(());
        }
        self.confirm.is_asked = true;
        let message = format!("this is not done before it is confirmed: {what}");
        Err(Refusal { message, warning: Some(format!("{what}\n\n{}", reasons.join("\n\n"))) })
    }

    /// Whether a variable is an output of the machine.
    fn is_output(&mut self, name: &str) -> bool {
        let Some(debugger) = &mut self.debugger else { return false };
        let names = debugger.history_mut().executive().names();
        let key = names.find(name, Purpose::Watch);
        key.is_ok_and(|key| names.properties(key).direction == Direction::Output)
    }
}

/// The time of day (UTC) of a moment in nanoseconds since 1970, with its milliseconds or without.
pub(super) fn clock(ns: u64, with_milliseconds: bool) -> String {
    let time = SystemTime::UNIX_EPOCH.checked_add(Duration::from_nanos(ns));
    let text = time.map(|time| humantime::format_rfc3339_millis(time).to_string());
    let range = if with_milliseconds { 11..23 } else { 11..19 };
    text.and_then(|text| text.get(range).map(str::to_owned)).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::clock;

    #[test]
    fn a_moment_has_a_time_of_day() {
        let ns = 1_764_354_570_250_000_000;
        assert_eq!(
            (clock(ns, true).as_str(), clock(ns, false).as_str()),
            ("18:29:30.250", "18:29:30")
        );
    }
}
