//! The line that shows the progress of a long run: its text, and when it is shown.

use std::time::Duration;

/// How long a run has lasted before its progress is shown.
pub(crate) const FIRST_SHOWN_AFTER: Duration = Duration::from_secs(1);
/// Time between two updates of the line.
pub(crate) const UPDATE_INTERVAL: Duration = Duration::from_millis(200);
/// The line's text, such as `42 %, 4200000 of 10000000 ticks, 3 s left`, after `ticks` ticks of `all` in
/// the time `elapsed`. Where `all` is not known, it says how many ticks a second are done.
pub(crate) fn progress_line(ticks: u64, all: Option<u64>, elapsed: Duration) -> String {
    let rate = ticks as f64 / elapsed.as_secs_f64().max(1e-9);
    match all {
        Some(all) => {
            let percent = u128::from(ticks) * 100 / u128::from(all.max(1));
            let left = all.saturating_sub(ticks) as f64 / rate.max(1e-9);
            format!("{percent} %, {ticks} of {all} ticks, {left:.0} s left")
        }
        None => format!("{ticks} ticks, {rate:.0} a second, Ctrl-C ends"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_progress_line_says_how_long_the_run_takes() {
        let elapsed = Duration::from_secs(2);
        assert_eq!(progress_line(250, Some(1000), elapsed), "25 %, 250 of 1000 ticks, 6 s left");
        assert_eq!(progress_line(250, None, elapsed), "250 ticks, 125 a second, Ctrl-C ends");
        assert_eq!(progress_line(0, Some(0), Duration::ZERO), "0 %, 0 of 0 ticks, 0 s left");
    }
}
