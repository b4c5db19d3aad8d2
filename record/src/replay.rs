//! Runs recorded ticks again, in any engine, and compares them with what was recorded.

use std::ops::Range;

use plcc_abi::{Engine, Program};
use thiserror::Error;

use super::entry::{Action, RecordedStop, TickRecord};
use super::recording::{RecordError, RecordedRun, Recording, RunEnd, Span};
use super::state_hash::StateHash;
use plcc_runtime::checkpoint::seal;
use plcc_runtime::{CheckpointError, Event, Executive, Stop};

/// Why ticks can't be run again.
#[derive(Debug, Error)]
pub enum ReplayError {
    /// The record can't be read.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// The executive does not take the recorded state, which is of another program.
    #[error("the recorded state can't be restored: {0}")]
    Checkpoint(#[from] CheckpointError),
    /// The record has checkpoints of this program, but no tick between them.
    #[error("the record has no whole tick")]
    NoTicks,
    /// The tick is not in the record.
    #[error("tick {tick} is not in the record, which has the ticks from {first} to {last}")]
    NotKept {
        /// The tick that was asked for.
        tick: u64,
        /// The first tick that is kept.
        first: u64,
        /// The last one.
        last: u64,
    },
}

/// How a replayed tick differs from the recorded one.
#[derive(Clone, Debug, PartialEq)]
pub enum Difference {
    /// The state after it has another hash.
    State,
    /// The state before it is not that of the recorded checkpoint. This is the checkpoint's image.
    Checkpoint(Vec<u8>),
    /// It reported other events.
    Events,
    /// The program was stopped in only one of the two, or for different reasons.
    Stop,
}

/// A tick that was run again.
#[derive(Clone, Debug, PartialEq)]
pub struct Replayed {
    /// Its number.
    pub tick: u64,
    /// Whether it went as recorded.
    pub matches: bool,
    /// How it differs from the recorded one; `None` if `matches`.
    pub difference: Option<Difference>,
    /// Why the control stopped the program in it, if it did.
    pub stop: Option<Stop>,
    /// Whether the watchdog stopped one of its scans in the middle. Such a tick is not run again: the replay only
    /// does what acted on the control before it, and ends.
    pub cut: bool,
    /// Whether ticks before it are missing, so that the replay took the state from a checkpoint here.
    pub after_gap: bool,
}

/// Brings an executive into the state before any recorded tick, and runs it on from there.
///
/// The executive is made of the recorded program with the recorded options; `session::replay` does
/// that. The engine is given to each step anew, so that ticks may be skipped quickly in compiled code and the
/// interesting one run in the statement interpreter.
pub struct Replayer<'r> {
    ticks: RunTicks<'r>,
    state: ReplayState,
}

/// The ticks that a run did after `generation` online changes, in a recording.
#[derive(Clone, Copy, Debug)]
pub struct RunTicks<'r> {
    /// The recording.
    pub recording: &'r Recording,
    /// The run, one of the recording's.
    pub run: &'r RecordedRun,
    /// How many online changes there were before.
    pub generation: u16,
}

/// What a [`Replayer`] has besides the recording. So a recording that grows can be read on while its replay
/// goes on: each method is given the ticks anew.
pub struct ReplayState {
    executive: Box<dyn Executive + Send>,
    hash: StateHash,
    /// The index of the span whose ticks are in `ticks`, and its first tick.
    span: Option<(usize, u64)>,
    ticks: Vec<TickRecord>,
    /// The index in `ticks` of the next one.
    at: usize,
    /// The ticks that are missing before the next one, if the replay has passed over a gap to it.
    gap: Option<Range<u64>>,
    /// How the state before the next tick differs from the checkpoint there, if it does.
    difference: Option<Difference>,
    /// Whether the last tick was cut.
    cut: bool,
}

impl<'r> Replayer<'r> {
    /// A replay of the ticks that a run did after `generation` online changes, with the program that ran
    /// then ([`RecordedRun::program_of`]). It begins before the first one that is kept.
    pub fn new(
        recording: &'r Recording,
        run: &'r RecordedRun,
        generation: u16,
        executive: Box<dyn Executive + Send>,
    ) -> Self {
        let ticks = RunTicks { recording, run, generation };
        Self { ticks, state: ReplayState::new(executive) }
    }

    /// The executive, in the state before the next tick.
    pub fn executive(&mut self) -> &mut dyn Executive {
        self.state.executive()
    }

    /// The recorded tick that [`step`](Self::step) runs next. `None` at the end of a span, whose successor only
    /// `step` reads, and before [`go_to`](Self::go_to) or `step` was called for the first time.
    pub fn next(&self) -> Option<&TickRecord> {
        self.state.next()
    }

    /// The ticks that are missing before the [next](Self::next) one, if the replay has passed over a gap to it. After
    /// [`go_to`](Self::go_to) has refused a tick that is missing, these are the ticks around it.
    pub fn missing(&self) -> Option<Range<u64>> {
        self.state.missing()
    }

    /// The first and the last tick that are kept of this generation; without any, the first one that would be.
    ///
    /// # Errors
    /// When the record can't be read.
    pub fn range(&self) -> Result<(u64, u64), ReplayError> {
        self.ticks.range()
    }

    /// Brings the executive into the state before a tick; if that tick was skipped, before the next one that was
    /// run. The replay starts at the last checkpoint before the tick, or at the present state if that is nearer.
    /// `engine` runs the ticks in between.
    ///
    /// # Errors
    /// When the tick is not in the record, the record can't be read, or belongs to another program. If the tick lies
    /// in a gap, the executive is then in the state before the first tick after the gap.
    pub fn go_to(&mut self, tick: u64, engine: &mut dyn Engine) -> Result<(), ReplayError> {
        self.state.go_to(self.ticks, tick, engine)
    }

    /// Does what acted on the control before the next tick, and runs the tick. Its events are appended to
    /// `events`. `None` after the last tick.
    ///
    /// # Errors
    /// When the record can't be read, or belongs to another program.
    pub fn step(
        &mut self,
        engine: &mut dyn Engine,
        events: &mut Vec<Event>,
    ) -> Result<Option<Replayed>, ReplayError> {
        self.state.step(self.ticks, engine, events)
    }

    /// After the last tick: does what acted on the control then. Gives how the run ended, and whether the
    /// replay came to the recorded hash; that is also `true` where the two can't be compared, since the
    /// last tick was cut or ticks before the end are missing. `None` where the record has no end.
    pub fn end(&mut self) -> Option<(&'r RunEnd, bool)> {
        let end = self.ticks.run.end.as_ref()?;
        for action in &end.actions {
            act(self.state.executive.as_mut(), action);
        }
        let is_comparable =
            !self.state.cut && self.state.end_of_ticks(self.ticks) == Some(end.ticks);
        Some((end, !is_comparable || self.state.hash.value() == end.hash))
    }
}

impl RunTicks<'_> {
    /// The first and the last tick that are kept of this generation; without any, the first one that would be.
    ///
    /// # Errors
    /// When the record can't be read.
    pub fn range(&self) -> Result<(u64, u64), ReplayError> {
        let Range { start, end } = self.kept()?;
        Ok((start, end.saturating_sub(1).max(start)))
    }

    /// The ticks that are kept of this generation, from the first one to the last; an empty range where there are none.
    ///
    /// # Errors
    /// When the record can't be read.
    pub fn kept(&self) -> Result<Range<u64>, ReplayError> {
        let mut spans = self.run.spans.iter().filter(|span| span.generation == self.generation);
        let checkpoint = spans.clone().next().map_or(0, |span| span.first);
        // Of a span in which the file is damaged, the checkpoint alone may be left.
        let Some(first) = spans.find(|span| span.has_ticks()) else {
            return Ok(checkpoint..checkpoint);
        };
        let last = spans.rfind(|span| span.has_ticks()).unwrap_or(first);
        Ok(first.first..self.recording.end_of(last)?)
    }

    fn not_kept(&self, tick: u64) -> Result<ReplayError, ReplayError> {
        let kept = self.kept()?;
        if kept.is_empty() {
            return Ok(ReplayError::NoTicks);
        }
        let (first, last) = (kept.start, kept.end.saturating_sub(1));
        Ok(ReplayError::NotKept { tick, first, last })
    }
}

impl ReplayState {
    /// A replay that begins before the first tick that is kept, with an executive of the program that ran then.
    pub fn new(executive: Box<dyn Executive + Send>) -> Self {
        let hash = StateHash::new(executive.as_ref());
        Self {
            executive,
            hash,
            span: None,
            ticks: vec![],
            at: 0,
            gap: None,
            difference: None,
            cut: false,
        }
    }

    /// The executive, in the state before the next tick.
    pub fn executive(&mut self) -> &mut dyn Executive {
        self.executive.as_mut()
    }

    /// As [`Replayer::next`].
    pub fn next(&self) -> Option<&TickRecord> {
        self.ticks.get(self.at)
    }

    /// As [`Replayer::missing`].
    pub fn missing(&self) -> Option<Range<u64>> {
        self.gap.clone()
    }

    /// After the recording was read on or opened again: goes on with the ticks that the present span has now. If
    /// the span is gone, the next movement begins with a checkpoint.
    ///
    /// # Errors
    /// When the record can't be read.
    pub fn read_on(&mut self, from: RunTicks<'_>) -> Result<(), ReplayError> {
        let Some((_, first)) = self.span.take() else { return Ok(()) };
        let mut spans = from.run.spans.iter().enumerate();
        let is_it = |span: &Span| span.first == first && span.generation == from.generation;
        match spans.find(|(_, span)| is_it(span)) {
            Some((index, span)) => {
                self.ticks = from.recording.ticks(span)?;
                self.span = Some((index, first));
            }
            None => (self.ticks, self.at) = (vec![], 0),
        }
        Ok(())
    }

    /// As [`Replayer::go_to`].
    ///
    /// # Errors
    /// As there.
    pub fn go_to(
        &mut self,
        from: RunTicks<'_>,
        tick: u64,
        engine: &mut dyn Engine,
    ) -> Result<(), ReplayError> {
        let spans = from.run.spans.iter().enumerate();
        let mut spans = spans.filter(|(_, span)| span.generation == from.generation);
        let nearest = spans.rfind(|(_, span)| span.first <= tick).map(|(index, _)| index);
        let Some(nearest) = nearest else { return Err(from.not_kept(tick)?) };
        let is_near = self.span.is_some_and(|(index, _)| index == nearest)
            && self.next().is_some_and(|it| it.tick <= tick);
        if !is_near {
            self.restore(from, nearest)?;
        }
        let mut events = vec![];
        loop {
            match self.next().map(|next| next.tick) {
                Some(next) if next >= tick => return Ok(()),
                Some(_) => {}
                None if self.enter_next_span(from)? => {
                    // The tick is one of those that are missing.
                    if self.gap.is_some() && self.next().is_some_and(|next| next.tick > tick) {
                        return Err(from.not_kept(tick)?);
                    }
                    continue;
                }
                None => return Err(from.not_kept(tick)?),
            }
            self.step(from, engine, &mut events)?;
            events.clear();
        }
    }

    /// Restores the checkpoint with which a span begins.
    fn restore(&mut self, from: RunTicks<'_>, index: usize) -> Result<(), ReplayError> {
        let Some(span) = from.run.spans.get(index) else { return Ok(()) };
        let stored = from.recording.checkpoint(span)?;
        self.executive.resume(&seal(span.fingerprint, &stored.image, &stored.state))?;
        self.hash.set(span.hash);
        self.ticks = from.recording.ticks(span)?;
        (self.at, self.span, self.cut) = (0, Some((index, span.first)), false);
        (self.gap, self.difference) = (None, None);
        Ok(())
    }

    /// Goes on with the ticks of the next span; gives whether there is one.
    fn enter_next_span(&mut self, from: RunTicks<'_>) -> Result<bool, ReplayError> {
        let next = self.span.map_or(0, |(index, _)| index + 1);
        let spans = from.run.spans.iter().enumerate().skip(next);
        let found = spans.into_iter().find(|(_, span)| span.generation == from.generation);
        let Some((index, span)) = found else { return Ok(false) };
        // The thread that writes drops ticks while the file can't be written, and need not leave a mark.
        let is_next = index == next && span.follows && self.end_of_ticks(from) == Some(span.first);
        if !is_next {
            let before = self.gap.take().filter(|_| self.ticks.is_empty());
            let earlier = before.map(|gap| gap.start).or(self.end_of_ticks(from));
            self.restore(from, index)?;
            self.gap = earlier.map(|tick| tick..span.first);
            return Ok(true);
        }
        // Nothing is restored: the state that the replay has come to must be that of the checkpoint.
        let stored = from.recording.checkpoint(span)?;
        if !self.is_in_state(&stored.image, &stored.state) || self.hash.value() != span.hash {
            self.difference = Some(Difference::Checkpoint(stored.image));
        }
        self.ticks = from.recording.ticks(span)?;
        (self.at, self.span) = (0, Some((index, span.first)));
        Ok(true)
    }

    /// The number of the tick after the last one that was read; `None` before anything was restored.
    fn end_of_ticks(&self, from: RunTicks<'_>) -> Option<u64> {
        let span = from.run.spans.get(self.span?.0)?;
        Some(self.ticks.last().map_or(span.first, |last| last.tick.saturating_add(1)))
    }

    /// Whether the executive has this state outside the image, and this image but for the places that engines use
    /// in their own way.
    fn is_in_state(&self, image: &[u8], state: &[u8]) -> bool {
        let mut own = vec![];
        self.executive.state_into(&mut own);
        let here = self.executive.image();
        let same = |range: &Range<u32>| {
            let range = range.start as usize..range.end as usize;
            here.get(range.clone()) == image.get(range)
        };
        own == state
            && here.len() == image.len()
            && self.executive.compared_ranges().iter().all(same)
    }

    /// As [`Replayer::step`].
    ///
    /// # Errors
    /// As there.
    pub fn step(
        &mut self,
        from: RunTicks<'_>,
        engine: &mut dyn Engine,
        events: &mut Vec<Event>,
    ) -> Result<Option<Replayed>, ReplayError> {
        self.step_with(from, engine, events, false)
    }

    /// As [`step`](Self::step), but a tick in which the watchdog stopped a scan is run, too. `engine` must stop that scan, as
    /// the watchdog does: nobody else knows where. The state is then not the one in which the control was.
    ///
    /// # Errors
    /// As there.
    pub fn step_into_cut(
        &mut self,
        from: RunTicks<'_>,
        engine: &mut dyn Engine,
        events: &mut Vec<Event>,
    ) -> Result<Option<Replayed>, ReplayError> {
        self.step_with(from, engine, events, true)
    }

    fn step_with(
        &mut self,
        from: RunTicks<'_>,
        engine: &mut dyn Engine,
        events: &mut Vec<Event>,
        into_cut: bool,
    ) -> Result<Option<Replayed>, ReplayError> {
        while self.at >= self.ticks.len() {
            if self.cut || !self.enter_next_span(from)? {
                return Ok(None);
            }
        }
        let Some(record) = self.ticks.get(self.at) else { return Ok(None) };
        self.at += 1;
        for action in &record.actions {
            act(self.executive.as_mut(), action);
        }
        let after_gap = self.gap.take().is_some();
        if record.is_cut() {
            self.cut = true;
            if into_cut {
                if from.run.header.clocked {
                    self.executive.follow_clock(Some(&record.decisions));
                }
                // How it ends is known from the record.
                let _ = self.executive.tick(engine, events);
            }
            return Ok(Some(Replayed {
                tick: record.tick,
                matches: true,
                difference: None,
                stop: record.stop.clone().map(Stop::from),
                cut: true,
                after_gap,
            }));
        }
        if from.run.header.clocked {
            self.executive.follow_clock(Some(&record.decisions));
        }
        let earlier = events.len();
        let stop = self.executive.tick(engine, events).err();
        let hash = self.hash.add(self.executive.image());
        let difference = self.difference.take().or_else(|| {
            if stop.as_ref().map(RecordedStop::from) != record.stop {
                Some(Difference::Stop)
            } else if events.get(earlier..) != Some(&record.events) {
                Some(Difference::Events)
            } else {
                (hash != record.hash).then_some(Difference::State)
            }
        });
        let (tick, matches) = (record.tick, difference.is_none());
        Ok(Some(Replayed { tick, matches, difference, stop, cut: false, after_gap }))
    }
}

/// Does to a control what acted on it when it was recorded.
fn act(executive: &mut dyn Executive, action: &Action) {
    match *action {
        Action::Write(key, value) => executive.write(key, value),
        // A force that is refused now was refused when it was recorded, too.
        Action::Force(key, value) => drop(executive.force(key, value)),
        Action::Skip(count) => executive.skip_ticks(count),
        Action::SafeOutputs => executive.drive_safe_outputs(),
    }
}

/// The variables of a program that differ between two images, in the order of the program's symbols. Each has
/// its name (of an array each element that differs, as `A[3]`), its bytes in `a` and its bytes in `b`.
pub fn differing_variables(
    program: &Program,
    a: &[u8],
    b: &[u8],
) -> Vec<(String, Vec<u8>, Vec<u8>)> {
    let mut found = vec![];
    for symbol in program.tables.symbols() {
        for element in 0..symbol.elements {
            let size = symbol.ty.size();
            let from = (symbol.offset + element * size) as usize;
            let range = from..from + size as usize;
            let (Some(one), Some(other)) = (a.get(range.clone()), b.get(range)) else { continue };
            if one != other {
                let index =
                    if symbol.elements > 1 { format!("[{element}]") } else { String::new() };
                found.push((format!("{}{index}", symbol.name), one.to_vec(), other.to_vec()));
            }
        }
    }
    found
}
