//! Paces ticks by a clock (`--realtime`). The time at which each tick is due is counted from the start
//! of the run, so that a late tick does not delay all that follow.

use std::fmt::{self, Debug};
use std::str::FromStr;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

/// The longest time between two looks at the flag that Ctrl-C sets.
const MAX_SLEEP: Duration = Duration::from_millis(50);

/// The time that a run in real time is paced by. A test gives a clock that does not really wait.
pub trait Clock: Debug {
    /// The time now. It never goes backwards.
    fn now(&self) -> Instant;

    /// Waits for this long, or longer.
    fn sleep(&self, time: Duration);
}

/// The operating system's monotonic clock.
#[derive(Clone, Copy, Debug, Default)]
pub struct SystemClock;

impl Clock for SystemClock {
    fn now(&self) -> Instant {
        Instant::now()
    }

    fn sleep(&self, time: Duration) {
        thread::sleep(time);
    }
}

/// What is done about an overrun: a tick that begins only when a later one is already due, because an
/// earlier tick took too long or the computer did not run the process.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum OverrunPolicy {
    /// The ticks whose time has passed are skipped. They count as ticks, and timers go down by all of them.
    #[default]
    Skip,
    /// The program is stopped (`OVERRUN`).
    Stop,
    /// At most so many ticks are made up for, one after the other without a pause; those before them are
    /// skipped.
    CatchUp(u64),
}

impl FromStr for OverrunPolicy {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let ticks = |text: &str| text.parse().ok().filter(|&ticks| ticks > 0);
        match (text, text.strip_prefix("catch-up=").and_then(ticks)) {
            ("skip", _) => Ok(Self::Skip),
            ("stop", _) => Ok(Self::Stop),
            (_, Some(ticks)) => Ok(Self::CatchUp(ticks)),
            _ => Err("skip, stop or catch-up=N is expected, as in catch-up=5"),
        }
    }
}

impl fmt::Display for OverrunPolicy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Skip => f.write_str("skip"),
            Self::Stop => f.write_str("stop"),
            Self::CatchUp(ticks) => write!(f, "catch-up={ticks}"),
        }
    }
}

/// How late the ticks of a run began.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Punctuality {
    /// How often a tick began only when a later one was already due. The ticks that make up for it are
    /// not counted again.
    pub overruns: u64,
    /// How many ticks were skipped.
    pub skipped: u64,
    /// How late the latest tick began.
    pub latest: Duration,
}

/// How a tick begins.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Beginning {
    /// The time from when the tick was due until it began.
    pub late: Duration,
    /// Whether this is an overrun: another tick was due by then, and this one does not make up for an
    /// earlier overrun.
    pub overrun: bool,
    /// How many ticks are skipped: this one and those after it, so that a later one begins.
    pub skip: u64,
    /// Whether the program is to be stopped for it.
    pub stop: bool,
}

/// Waits for the time of each tick, and decides what is done about those that begin late.
#[derive(Clone, Debug)]
pub struct Pacer {
    policy: OverrunPolicy,
    /// When the next tick is due; `None` before the first one, which is due at once.
    due: Option<Instant>,
    /// How late the tick before began, less the time of the ticks that were skipped for it.
    last_late: Duration,
    punctuality: Punctuality,
}

impl Pacer {
    /// A pacer whose first tick is due when it is waited for.
    pub fn new(policy: OverrunPolicy) -> Self {
        Self { policy, due: None, last_late: Duration::ZERO, punctuality: Punctuality::default() }
    }

    /// Waits until the next tick is due. `tick` is the time from that tick to the one after it, and
    /// `left` how many ticks the run still has, this one among them, if that is known: the last one is
    /// never skipped. Gives `None` when the flag `interrupt` is set meanwhile.
    pub fn wait(
        &mut self,
        clock: &dyn Clock,
        tick: Duration,
        left: Option<u64>,
        interrupt: Option<&AtomicBool>,
    ) -> Option<Beginning> {
        loop {
            let now = clock.now();
            let due = *self.due.get_or_insert(now);
            let time = due.saturating_duration_since(now);
            if interrupt.is_some_and(|flag| flag.load(Ordering::Relaxed)) {
                return None;
            }
            if time.is_zero() {
                return Some(self.begin(now, due, tick, left));
            }
            clock.sleep(time.min(MAX_SLEEP));
        }
    }

    /// Decides about a tick that was due at `due` and begins at `now`, and sets when the next one is due.
    fn begin(
        &mut self,
        now: Instant,
        due: Instant,
        tick: Duration,
        left: Option<u64>,
    ) -> Beginning {
        let late = now.saturating_duration_since(due);
        let missed = late.as_nanos() / tick.as_nanos().max(1);
        let missed = u64::try_from(missed).unwrap_or(u64::MAX);
        let most = left.map_or(u64::MAX, |left| left.saturating_sub(1));
        let skip = match self.policy {
            OverrunPolicy::Skip => missed,
            OverrunPolicy::CatchUp(ticks) => missed.saturating_sub(ticks),
            OverrunPolicy::Stop => 0,
        };
        let skip = skip.min(most);
        // While an overrun is made up for, each tick begins less late than the one before.
        let overrun = missed > 0 && (late >= self.last_late || skip > 0);
        let Punctuality { overruns, skipped, latest } = &mut self.punctuality;
        *overruns += u64::from(overrun);
        *skipped += skip;
        *latest = late.max(*latest);
        let ticks = |count: u64| {
            let time = tick.as_nanos().saturating_mul(count.into());
            Duration::from_nanos(u64::try_from(time).unwrap_or(u64::MAX))
        };
        self.due = Some(due.checked_add(ticks(skip.saturating_add(1))).unwrap_or(now));
        self.last_late = late.saturating_sub(ticks(skip));
        Beginning { late, overrun, skip, stop: missed > 0 && self.policy == OverrunPolicy::Stop }
    }

    /// Goes back to what was counted before, where the tick that was waited for is none of the program.
    pub fn set_punctuality(&mut self, punctuality: Punctuality) {
        self.punctuality = punctuality;
    }

    /// When the next tick is due; `None` before the first one.
    pub fn due(&self) -> Option<Instant> {
        self.due
    }

    /// How late ticks have begun so far.
    pub fn punctuality(&self) -> Punctuality {
        self.punctuality
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TICK: Duration = Duration::from_millis(20);

    /// Ticks that begin at these times, in milliseconds after the start: what is skipped before each, and
    /// whether it is an overrun.
    fn begin(pacer: &mut Pacer, left: Option<u64>, times: &[u64]) -> Vec<(u64, bool)> {
        let start = Instant::now();
        let mut begin = |ms| {
            let now = start + Duration::from_millis(ms);
            let due = *pacer.due.get_or_insert(now);
            let Beginning { skip, overrun, .. } = pacer.begin(now, due, TICK, left);
            (skip, overrun)
        };
        times.iter().map(|&ms| begin(ms)).collect()
    }

    #[test]
    fn ticks_whose_time_has_passed_are_skipped() {
        let mut pacer = Pacer::new(OverrunPolicy::Skip);
        // The tick that is due at 20 is late but within its time. The one due at 40 begins at 110: those
        // due at 60, 80 and 100 are due too, and the last of them begins.
        let begun = begin(&mut pacer, None, &[0, 25, 110, 120, 5000]);
        assert_eq!(begun, [(0, false), (0, false), (3, true), (0, false), (243, true)]);
        let latest = Duration::from_millis(5000 - 140);
        assert_eq!(pacer.punctuality, Punctuality { overruns: 2, skipped: 246, latest });
    }

    #[test]
    fn the_last_tick_of_a_run_is_not_skipped() {
        let mut pacer = Pacer::new(OverrunPolicy::Skip);
        assert_eq!(begin(&mut pacer, Some(3), &[0, 1000]), [(0, false), (2, true)]);
    }

    #[test]
    fn a_number_of_ticks_can_be_made_up_for() {
        let mut pacer = Pacer::new(OverrunPolicy::CatchUp(2));
        // Due at 20, begun at 105: four more are due, two of them are skipped. That due at 60 begins at
        // once, those due at 80 and 100 after it.
        let begun = begin(&mut pacer, None, &[0, 105, 106, 107, 120, 185]);
        let expected = [(0, false), (2, true), (0, false), (0, false), (0, false), (0, true)];
        assert_eq!(begun, expected);
        assert_eq!(pacer.punctuality.overruns, 2);
    }

    #[test]
    fn policies_are_written_as_they_are_read() {
        for (text, policy) in [
            ("skip", OverrunPolicy::Skip),
            ("stop", OverrunPolicy::Stop),
            ("catch-up=5", OverrunPolicy::CatchUp(5)),
        ] {
            assert_eq!(text.parse(), Ok(policy));
            assert_eq!(policy.to_string(), text);
        }
        for text in ["", "Skip", "catch-up", "catch-up=0", "catch-up=x", "catch-up=-1"] {
            assert!(text.parse::<OverrunPolicy>().is_err(), "{text}");
        }
    }

    #[test]
    fn the_interrupt_flag_ends_the_waiting() {
        /// A clock that stands, and on which nobody may wait.
        #[derive(Debug)]
        struct Standing(Instant);

        impl Clock for Standing {
            fn now(&self) -> Instant {
                self.0
            }

            fn sleep(&self, time: Duration) {
                panic!("waits for {time:?}, though the flag is set");
            }
        }

        let clock = Standing(Instant::now());
        let mut pacer = Pacer::new(OverrunPolicy::Skip);
        let hour = Duration::from_secs(3600);
        assert_eq!(pacer.wait(&clock, hour, None, None), Some(Beginning::default()));
        assert_eq!(pacer.wait(&clock, hour, None, Some(&AtomicBool::new(true))), None);
    }
}
