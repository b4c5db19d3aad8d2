//! Running on, or back, until something is met; and the search for the statement that wrote a
//! variable.

use std::time::{Duration, Instant};

use plcc_frontend::common::Accessed;
use plcc_runtime::{Event, EventBody, Executive, Purpose};

use super::event_text::shown;
use super::{Debugger, Direction, Position, Session, StopAt, Stopped};
use crate::DebugError;
use crate::history::TickResult;
use crate::hits::{Found, Hit, HitFinder, What};
use crate::observers::Observed;

/// On the way back so many ticks are searched at once, each of these segments in the order of time.
const SEGMENT: u64 = 64;

impl Debugger<'_> {
    /// Runs forwards or backwards until something stops the run, which is given. If nothing does, it ends with `None`
    /// after `ticks` ticks, or backwards after as many segments of up to 64 ticks; the next call goes on from
    /// there.
    ///
    /// # Errors
    /// When a tick can't be run.
    pub fn run(&mut self, direction: Direction, ticks: u64) -> Result<Option<Stopped>, DebugError> {
        self.run_for(direction, ticks, Duration::MAX)
    }

    /// As [`run`](Self::run), but it also ends with `None` when `time` has passed.
    ///
    /// # Errors
    /// When a tick can't be run.
    pub fn run_for(
        &mut self,
        direction: Direction,
        ticks: u64,
        time: Duration,
    ) -> Result<Option<Stopped>, DebugError> {
        let begun = Instant::now();
        for _ in 0..ticks {
            let stopped = match direction {
                Direction::Forward => self.run_tick()?,
                Direction::Back => self.search_back()?,
            };
            if stopped.is_some() {
                return Ok(stopped);
            }
            if begun.elapsed() >= time {
                break;
            }
        }
        Ok(None)
    }

    /// Runs the rest of the tick.
    fn run_tick(&mut self) -> Result<Option<Stopped>, DebugError> {
        let Position { tick, step } = self.position;
        if tick >= self.history().known() && !self.history().goes_on() {
            return self.run_on_in_next_version(Stopped::End);
        }
        let from = step + usize::from(!self.is_fresh);
        let (found, result) = self.find_hits(tick)?;
        let count = found.steps;
        self.is_fresh = false;
        for hit in found.hits.iter().filter(|hit| hit.step >= from) {
            if let Some(stopped) = self.reason_to_stop(hit, true) {
                self.position = Position { tick, step: hit.step };
                return Ok(Some(stopped));
            }
        }
        if let Some(stop) = result.stop {
            let step = count.saturating_sub(usize::from(stop.place.is_some()));
            self.position = Position { tick, step };
            return Ok(Some(match self.stop_at.program_stops && step >= from {
                true => Stopped::ProgramStopped(stop),
                false => Stopped::End,
            }));
        }
        if tick + 1 >= self.history().known() && !self.history().goes_on() {
            self.position = Position { tick, step: count };
            return self.run_on_in_next_version(Stopped::End);
        }
        self.position = Position { tick: tick + 1, step: 0 };
        self.is_fresh = true;
        Ok(None)
    }

    /// At the end of a version: goes to the first tick of the next one, or stops where there is none.
    fn run_on_in_next_version(&mut self, end: Stopped) -> Result<Option<Stopped>, DebugError> {
        let Some(version) = self.enter_neighbour_version(false)? else { return Ok(Some(end)) };
        self.position = Position { tick: version.first, step: 0 };
        self.is_fresh = true;
        Ok(None)
    }

    /// Looks for the last statement before the position that stops the run, in this tick or in up to [`SEGMENT`]
    /// ticks before it.
    fn search_back(&mut self) -> Result<Option<Stopped>, DebugError> {
        self.is_fresh = false;
        let Some((begin, found)) =
            self.segment_before(self.position, |this, tick| Ok(this.find_hits(tick)?.0.hits))?
        else {
            let Some(version) = self.enter_neighbour_version(true)? else {
                return Ok(Some(Stopped::Beginning));
            };
            self.position = Position { tick: version.end.saturating_sub(1), step: 0 };
            self.position.step = self.trace()?.steps.len();
            return Ok(None);
        };
        for (tick, hit) in found.into_iter().rev() {
            if let Some(stopped) = self.reason_to_stop(&hit, false) {
                self.position = Position { tick, step: hit.step };
                return Ok(Some(stopped));
            }
        }
        self.position = Position { tick: begin, step: 0 };
        Ok(None)
    }

    /// Looks through the ticks of a segment that ends at a position, in the order of time, and gives
    /// the tick with which it begins and the hits before the position, in their order. `None` at the
    /// beginning of the history.
    #[expect(clippy::type_complexity, reason = "a tick, and ticks with hits")]
    fn segment_before(
        &mut self,
        end: Position,
        mut find: impl FnMut(&mut Self, u64) -> Result<Vec<Hit>, DebugError>,
    ) -> Result<Option<(u64, Vec<(u64, Hit)>)>, DebugError> {
        let first = self.history().first();
        let begin = match end.step {
            0 if end.tick <= first => return Ok(None),
            0 => end.tick.saturating_sub(SEGMENT).max(first),
            _ => end.tick,
        };
        let mut found = vec![];
        for tick in begin..=end.tick {
            let before = if tick == end.tick { end.step } else { usize::MAX };
            if before > 0 {
                let hits = find(self, tick)?;
                found.extend(
                    hits.into_iter().filter(|hit| hit.step < before).map(|hit| (tick, hit)),
                );
            }
        }
        Ok(Some((begin, found)))
    }

    /// Runs a tick and finds what it meets.
    fn find_hits(&mut self, tick: u64) -> Result<(Found, TickResult), DebugError> {
        let cut = self.session.cut_statements(tick)?;
        let Session { history, .. } = &mut self.session;
        history.go_before(tick)?;
        // Only data breakpoints compare values with those before the tick.
        let image = match self.breakpoints.have_data() {
            true => history.executive().image().to_vec(),
            false => vec![],
        };
        let mut finder = HitFinder::of(&self.breakpoints, &self.placed, &image);
        let mut engine = Observed::new(self.interpreter.as_mut(), &mut finder).cut_at(cut);
        let result = history.run(tick, &mut engine)?;
        let mut found = finder.finish(history.executive().image());
        self.tell(tick, &result);
        if let Some(hit) = self.event_to_stop_at(tick, &found, &result.events)? {
            found.hits.push(hit);
            found.hits.sort_by_key(|hit| hit.step);
        }
        Ok((found, result))
    }

    /// Counts a hit of a breakpoint, and gives why the run stops there, if it does. With `show_logs`, the text of a
    /// logpoint is shown to the user.
    fn reason_to_stop(&mut self, hit: &Hit, show_logs: bool) -> Option<Stopped> {
        if !self.breakpoints.counts(hit) {
            return None;
        }
        match &hit.what {
            What::Line(id) => Some(Stopped::Breakpoint(*id)),
            What::Data(id, name, old, new) => {
                Some(Stopped::Data(*id, format!("{name} changes from {old} to {new}")))
            }
            What::Event(text) => Some(Stopped::Event(text.clone())),
            What::Log(_, text) => {
                if show_logs {
                    self.output.push(text.clone());
                }
                None
            }
            What::Write => None,
        }
    }

    /// The hit of the first event of a tick at which the user wants to stop, if there is one: at the statement that
    /// switched the fault or message on or sent the text, or without such a statement at the end of the tick.
    fn event_to_stop_at(
        &mut self,
        tick: u64,
        found: &Found,
        events: &[Event],
    ) -> Result<Option<Hit>, DebugError> {
        let StopAt { faults, messages, .. } = self.stop_at;
        let mut texts = found.texts.iter();
        for event in events {
            let step = match &event.body {
                EventBody::Fault { name, state: "on", .. } if faults => {
                    self.last_change_in(tick, name)?
                }
                EventBody::Message { name, flag, state: "on", .. } if messages => {
                    match name.as_ref().or(flag.as_ref()) {
                        Some(name) => self.last_change_in(tick, name)?,
                        None => None,
                    }
                }
                EventBody::Send { .. } | EventBody::Display { .. } if messages => {
                    texts.next().copied()
                }
                EventBody::Send { .. }
                | EventBody::Display { .. }
                | EventBody::Command { .. }
                | EventBody::Macro { .. } => {
                    texts.next();
                    continue;
                }
                _ => continue,
            };
            let step = step.unwrap_or(found.steps);
            return Ok(Some(Hit { step, what: What::Event(shown(event)) }));
        }
        Ok(None)
    }

    /// The last step of a tick that changed the value of a variable; `None` if there is none.
    fn last_change_in(&mut self, tick: u64, name: &str) -> Result<Option<usize>, DebugError> {
        let changes = self.writes(tick, name, true)?;
        Ok(changes.last().map(|hit| hit.step))
    }

    /// The steps of a tick that write a variable or change what it shows; with `changes_only` only the
    /// latter.
    fn writes(
        &mut self,
        tick: u64,
        name: &str,
        changes_only: bool,
    ) -> Result<Vec<Hit>, DebugError> {
        let value = self.session.program.expression(name).ok();
        // What an expression shows has changed when its value has. Other names have writes alone.
        let by_value = changes_only && value.is_some();
        let target = if by_value { None } else { Some(self.target(name)?) };
        let cut = self.session.cut_statements(tick)?;
        let Session { history, .. } = &mut self.session;
        history.go_before(tick)?;
        let image = history.executive().image().to_vec();
        let before = match changes_only && !by_value {
            true => number_of(history.executive(), name),
            false => None,
        };
        let finder = HitFinder::of_writes(target, value.as_ref(), &self.placed, &image);
        let mut finder = finder.changing(before);
        let mut engine = Observed::new(self.interpreter.as_mut(), &mut finder).cut_at(cut);
        history.run(tick, &mut engine)?;
        Ok(finder.finish(history.executive().image()).hits)
    }

    fn target(&self, name: &str) -> Result<Accessed, DebugError> {
        let program = &self.session.program;
        program.accessed(name).ok_or_else(|| DebugError(format!("`{name}` names no variable")))
    }

    /// Goes back to the last statement before the position that wrote a variable. If the value was changed from
    /// outside since then (by latching an input, for example), goes to the first statement after that change.
    ///
    /// # Errors
    /// When nothing has that name, or nothing has written it.
    pub fn go_to_last_writer(&mut self, name: &str) -> Result<Stopped, DebugError> {
        self.go_back_to(name, false)
    }

    /// Goes back to the last statement before the position that changed a variable's value. Statements that wrote
    /// the value that it had already do not count.
    ///
    /// # Errors
    /// When nothing has that name, or nothing has changed it.
    pub fn go_to_last_change(&mut self, name: &str) -> Result<Stopped, DebugError> {
        self.go_back_to(name, true)
    }

    fn go_back_to(&mut self, name: &str, changes_only: bool) -> Result<Stopped, DebugError> {
        let found = self.search_back_for(name, changes_only);
        if found.is_err() {
            // The search may have come to an older version of the program.
            self.enter_version_of(self.position.tick)?;
        }
        found
    }

    fn search_back_for(&mut self, name: &str, changes_only: bool) -> Result<Stopped, DebugError> {
        let what = if changes_only { "changed" } else { "written" };
        let mut end = self.position;
        let mut since = self.history().first();
        loop {
            let segment =
                self.segment_before(end, |this, tick| this.writes(tick, name, changes_only))?;
            let Some((begin, found)) = segment else {
                // What an older version of the program has done.
                let Some(version) = self.enter_neighbour_version(true)? else { break };
                if self.target(name).is_err() && self.session.program.expression(name).is_err() {
                    return Err(DebugError(format!(
                        "nothing has {what} {name} since tick {since}, and the program before that tick has no such \
                         variable"
                    )));
                }
                since = version.first;
                end = Position { tick: version.end.saturating_sub(1), step: usize::MAX };
                continue;
            };
            if let Some((tick, hit)) = found.last() {
                self.position = Position { tick: *tick, step: hit.step };
                self.is_fresh = false;
                return Ok(Stopped::Writer(format!("{name} was {what} here last")));
            }
            self.interruption.check()?;
            end = Position { tick: begin, step: 0 };
        }
        Err(DebugError(format!("nothing has {what} {name} since tick {since}")))
    }
}

/// The value of a single variable.
fn number_of(executive: &mut dyn Executive, name: &str) -> Option<f64> {
    let variable = executive.names().find(name, Purpose::Watch).ok()?;
    executive.read(variable).number()
}
