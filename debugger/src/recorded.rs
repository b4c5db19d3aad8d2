//! The ticks of a recording, as the debugger runs them again. Ticks that are missing in it have no statements.

use std::ops::Range;

use plcc_abi::Engine;
use plcc_runtime::record::{ReplayError, Replayed, Replayer};
use plcc_runtime::{Event, Executive};

use crate::DebugError;
use crate::history::{History, TickResult};

/// Reads a recording again and makes a replayer of it; `None` if nothing was added since the last call.
pub type Reopen<'r> = Box<dyn Fn() -> Result<Option<Replayer<'r>>, DebugError> + 'r>;

/// The ticks of a recording.
pub struct Recorded<'r> {
    replayer: Replayer<'r>,
    /// Runs the ticks that nobody looks at.
    engine: Box<dyn Engine>,
    reopen: Reopen<'r>,
    first: u64,
    /// The tick behind the last one.
    end: u64,
    /// The gap that was found last: ticks that are missing in the recording.
    missing: Range<u64>,
    /// Whether the user is still to be told of that gap.
    tells_missing: bool,
}

impl std::fmt::Debug for Recorded<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Recorded").field("first", &self.first).field("end", &self.end).finish()
    }
}

fn failed(error: ReplayError) -> DebugError {
    DebugError(error.to_string())
}

impl<'r> Recorded<'r> {
    /// The recording of which `reopen` makes a replayer. `engine`, any engine of the recorded program, runs the ticks
    /// on the way to the one that is looked at.
    ///
    /// # Errors
    /// When the recording can't be read.
    pub fn new(engine: Box<dyn Engine>, reopen: Reopen<'r>) -> Result<Self, DebugError> {
        let replayer = reopen()?.ok_or_else(|| DebugError::new("the recording is empty"))?;
        let (first, last) = replayer.range().map_err(failed)?;
        let end = last.saturating_add(1);
        Ok(Self { replayer, engine, reopen, first, end, missing: 0..0, tells_missing: false })
    }

    /// What a tick gives that was skipped after an overrun, or is missing in the recording: nothing, since there is
    /// nothing to run again. `None` for any other tick.
    fn skipped(&mut self, tick: u64) -> Option<TickResult> {
        let is_skipped = self.replayer.next().is_some_and(|next| next.tick > tick);
        let Range { start, end } = self.missing;
        let tells = is_skipped && std::mem::take(&mut self.tells_missing);
        let note = tells.then(|| {
            format!("ticks {start} to {} are missing in the recording", end.saturating_sub(1))
        });
        is_skipped.then(|| TickResult { skipped: true, note, ..TickResult::default() })
    }
}

/// What a replayed tick gave.
fn result_of(
    tick: u64,
    replayed: Option<Replayed>,
    events: Vec<Event>,
) -> Result<TickResult, DebugError> {
    let mut result = TickResult { events, ..TickResult::default() };
    let Some(replayed) = replayed else {
        return Err(DebugError(format!("tick {tick} is not in the recording")));
    };
    result.stop = replayed.stop;
    result.cut = replayed.cut;
    if replayed.cut {
        result.note = Some(format!(
            "tick {tick} was stopped in its middle by the watchdog; it is not run again"
        ));
    } else if !replayed.matches {
        result.note = Some(format!(
            "tick {tick} differs from the recorded one; `plcc replay` says in which variable"
        ));
    }
    Ok(result)
}

impl History for Recorded<'_> {
    fn first(&self) -> u64 {
        self.first
    }

    fn known(&self) -> u64 {
        self.end
    }

    fn goes_on(&self) -> bool {
        false
    }

    fn go_before(&mut self, tick: u64) -> Result<(), DebugError> {
        let known = self.missing.contains(&tick).then_some(self.missing.end);
        let gone = self.replayer.go_to(known.unwrap_or(tick), self.engine.as_mut());
        // A tick that is missing is like one that was skipped: the state is that after the gap.
        if let Err(ReplayError::NotKept { .. }) = gone
            && let Some(missing) = self.replayer.missing().filter(|gap| gap.contains(&tick))
        {
            (self.missing, self.tells_missing) = (missing, true);
            return Ok(());
        }
        gone.map_err(failed)
    }

    fn run(&mut self, tick: u64, engine: &mut dyn Engine) -> Result<TickResult, DebugError> {
        self.go_before(tick)?;
        if let Some(skipped) = self.skipped(tick) {
            return Ok(skipped);
        }
        let mut events = vec![];
        let replayed = self.replayer.step(engine, &mut events).map_err(failed)?;
        result_of(tick, replayed, events)
    }

    fn run_unobserved(&mut self, tick: u64) -> Result<TickResult, DebugError> {
        self.go_before(tick)?;
        if let Some(skipped) = self.skipped(tick) {
            return Ok(skipped);
        }
        let mut events = vec![];
        let replayed = self.replayer.step(self.engine.as_mut(), &mut events).map_err(failed)?;
        result_of(tick, replayed, events)
    }

    fn executive(&mut self) -> &mut dyn Executive {
        self.replayer.executive()
    }

    fn look_for_more(&mut self) -> Result<(), DebugError> {
        if let Some(replayer) = (self.reopen)()? {
            let (first, last) = replayer.range().map_err(failed)?;
            (self.first, self.end) = (first, last.saturating_add(1));
            (self.replayer, self.missing) = (replayer, 0..0);
        }
        Ok(())
    }

    fn change(&mut self, _: u64, _: &str, _: Option<&str>, _: bool) -> Result<(), DebugError> {
        Err(DebugError::new("a recording can't be changed"))
    }
}
