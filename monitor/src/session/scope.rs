//! The scope: variables against time, of the run or the recording.

use std::time::{Duration, Instant};

use plcc_frontend::common::Expression;
use plcc_replay::DebuggedProgram;
use plcc_runtime::value::number;
use plcc_runtime::{Executive, Purpose, Value};

use super::Session;
use super::confirm::clock;
use super::samples::{Samples, values};
use super::store::{SavedScope, checked_name};
use crate::view::{AxisMark, Channel, Sample, ScopeState as State, ScopeView, TargetKind};
use crate::{Edge, MAX_SCOPE_TICKS, Refusal, Reply, Trigger};

/// How long samples are collected for one view.
const VIEW_TIME: Duration = Duration::from_millis(80);
/// How many ticks are shown at first.
const FIRST_WIDTH: u64 = 200;

/// A trigger that has not been met yet.
#[derive(Debug)]
struct Armed {
    /// `None` where the version of the program that runs has not its variables.
    expression: Option<Expression>,
    /// The next tick in which the trigger is tested.
    next: u64,
    /// The value of the expression after the tick before.
    last: Option<f64>,
}

#[derive(Debug)]
pub(super) struct ScopeState {
    names: Vec<String>,
    width: u64,
    /// The stretch that the user has chosen.
    range: Option<(u64, u64)>,
    trigger: Option<Trigger>,
    armed: Option<Armed>,
    /// The tick in which the trigger was met.
    trigger_tick: Option<u64>,
    /// From which tick on the trigger is looked for.
    searched: u64,
    cursors: [Option<u64>; 2],
    buffer: Samples,
}

impl Default for ScopeState {
    fn default() -> Self {
        Self {
            names: vec![],
            width: FIRST_WIDTH,
            range: None,
            trigger: None,
            armed: None,
            trigger_tick: None,
            searched: 0,
            cursors: [None; 2],
            buffer: Samples::default(),
        }
    }
}

impl ScopeState {
    /// From here on another version of the program runs: the expression of the trigger is one of that. A trigger whose
    /// variables it does not have waits for a version that has them.
    pub(super) fn move_to(&mut self, program: &DebuggedProgram) {
        if let (Some(armed), Some(trigger)) = (&mut self.armed, &self.trigger) {
            armed.expression = program.expression(&trigger.expression).ok();
            armed.last = None;
        }
    }

    /// Takes the values after a tick that was run, if it is the next one, and tests the trigger.
    pub(super) fn take(&mut self, tick: u64, executive: &mut dyn Executive) {
        if !self.names.is_empty() && tick == self.buffer.end() {
            let row = values(&self.names, executive);
            self.buffer.push(row, MAX_SCOPE_TICKS);
        }
        self.test_trigger(tick, executive);
    }

    /// Tests whether the trigger is met in a tick, if this is the next one to be tested.
    fn test_trigger(&mut self, tick: u64, executive: &mut dyn Executive) {
        let (Some(armed), Some(trigger)) = (&mut self.armed, &self.trigger) else { return };
        if tick != armed.next {
            return;
        }
        armed.next += 1;
        let value = armed.expression.as_ref().and_then(|it| it.evaluate(executive.image()).ok());
        let now = value.map(|value| value.number());
        let last = std::mem::replace(&mut armed.last, now);
        let (Some(last), Some(now)) = (last, now) else { return };
        let met = match trigger.edge {
            Edge::Rising => last == 0.0 && now != 0.0,
            Edge::Falling => last != 0.0 && now == 0.0,
            Edge::Both => last != now,
        };
        if met {
            self.trigger_tick = Some(tick);
            self.armed = None;
        }
    }
}

impl Session<'_> {
    /// Tests the trigger in ticks that were run before it was set, until a moment.
    pub(super) fn search_trigger(&mut self, until: Instant) {
        while Instant::now() < until {
            let Some(next) = self.scope.armed.as_ref().map(|armed| armed.next) else { return };
            if next >= self.time.run_until || !self.run_again(next) {
                return;
            }
            if let Some(debugger) = &mut self.debugger {
                self.scope.test_trigger(next, debugger.history_mut().executive());
            }
        }
    }

    /// Runs a tick once more without taking anything from it; whether that was possible.
    pub(super) fn run_again(&mut self, tick: u64) -> bool {
        if self.enter_version_of(tick).is_err() {
            return false;
        }
        self.executive_tick = None;
        let Some(debugger) = &mut self.debugger else { return false };
        debugger.history_mut().run_unobserved(tick).is_ok()
    }

    /// The values of variables after a tick, which is run again; NaN for those that have none.
    pub(super) fn values_after(
        &mut self,
        tick: u64,
        names: &[String],
    ) -> Result<Vec<f64>, Refusal> {
        if !self.run_again(tick) {
            return Err(Refusal::new(format!("tick {tick} can't be run again")));
        }
        Ok(values(names, self.debugger()?.history_mut().executive()))
    }

    /// Goes with the tick that is shown, when that leaves the stretch of time that the user has chosen. What a trigger has chosen
    /// stays.
    pub(super) fn scope_follow(&mut self, tick: u64) {
        let (from, to) = self.scope_range();
        if self.scope.range.is_some() && !(from..=to).contains(&tick) {
            let from = tick.saturating_sub((to - from) / 2).max(self.first());
            self.scope.range = Some((from, from + self.scope.width.saturating_sub(1)));
        }
    }

    /// The ticks that are shown. As long as neither a trigger nor the user has chosen them, they are those up to the newest tick,
    /// or around the one at which the monitor stays.
    fn scope_range(&self) -> (u64, u64) {
        let scope = &self.scope;
        let (first, last) = (self.first(), self.time.run_until.saturating_sub(1).max(self.first()));
        let clamp = |from: u64, to: u64| (from.clamp(first, last), to.clamp(first, last));
        match (scope.range, scope.trigger_tick, &scope.trigger) {
            (Some((from, to)), ..) => clamp(from, to),
            (None, Some(met), Some(trigger)) => {
                let from = met.saturating_sub(trigger.before);
                clamp(from, from + scope.width.saturating_sub(1))
            }
            _ if self.time.following => clamp((last + 1).saturating_sub(scope.width), last),
            _ => {
                let end = (self.time.shown + scope.width / 4 + 1).min(last + 1).max(1);
                clamp(end.saturating_sub(scope.width), end - 1)
            }
        }
    }

    /// Where the axis of time has marks: at round times of the day, or round times since power-up where no time of day is known.
    fn axis_marks(&self, from: u64, to: u64) -> Vec<AxisMark> {
        /// How many marks there are at most.
        const MOST: u64 = 6;
        let tick_ns = self.debugger.as_ref().map_or(1, |debugger| debugger.tick_ns().max(1));
        let span = (to - from + 1).saturating_mul(tick_ns);
        let least = span.div_ceil(MOST).max(tick_ns);
        let powers = (0..18).map(|power| 10_u64.pow(power));
        let steps = powers.flat_map(|power| [1, 2, 5].map(|factor| factor * power));
        let step = steps.into_iter().find(|step| *step >= least).unwrap_or(least);
        let began = self.began_ns();
        let offset = began.unwrap_or(0);
        let first = (offset + from.saturating_mul(tick_ns)).div_ceil(step).saturating_mul(step);
        let times = (0..=MOST).map(|mark| first.saturating_add(mark.saturating_mul(step)));
        let marks = times.filter_map(|time| {
            let tick = time.checked_sub(offset)?.div_ceil(tick_ns);
            let text = match began {
                Some(_) => clock(time, step < 1_000_000_000),
                None => format!("{} s", number(time as f64 / 1e9)),
            };
            (tick <= to).then_some(AxisMark { tick, text })
        });
        marks.collect()
    }

    /// Collects the samples of the ticks `from` to `to`, until a moment at most; gives whether all are there.
    fn fill(&mut self, from: u64, to: u64, until: Instant) -> bool {
        let buffer = &mut self.scope.buffer;
        if from < buffer.first || from > buffer.end() {
            *buffer = Samples::from(from);
        }
        loop {
            let next = self.scope.buffer.end();
            if next > to {
                return true;
            }
            if Instant::now() >= until || !self.run_again(next) {
                return false;
            }
            if let Some(debugger) = &mut self.debugger {
                let row = values(&self.scope.names, debugger.history_mut().executive());
                self.scope.buffer.push(row, MAX_SCOPE_TICKS);
            }
        }
    }

    pub(super) fn scope_view(&mut self, samples: usize) -> Result<ScopeView, Refusal> {
        self.debugger()?;
        let (from, to) = self.scope_range();
        let is_there = self.time.run_until > 0
            && (self.scope.names.is_empty() || self.fill(from, to, Instant::now() + VIEW_TIME));
        let names = self.scope.names.clone();
        let channels = names.into_iter().enumerate();
        let channels = channels.map(|(at, name)| self.channel(at, name, from, to, samples));
        let channels = channels.collect();
        let scope = &self.scope;
        let tick_ns = self.debugger.as_ref().map_or(0, |debugger| debugger.tick_ns());
        let difference = match scope.cursors {
            [Some(a), Some(b)] => {
                Some(b as f64 - a as f64).map(|ticks| ticks * tick_ns as f64 / 1e9)
            }
            _ => None,
        };
        let state = match (scope.range, scope.trigger_tick, &scope.trigger) {
            (Some(_), ..) => State::Held,
            (None, Some(_), Some(_)) => State::Triggered,
            (None, None, Some(_)) => State::Waiting,
            _ => State::Rolling,
        };
        Ok(ScopeView {
            channels,
            from,
            to,
            trigger_tick: scope.trigger_tick,
            trigger: scope.trigger.clone(),
            state,
            cursors: scope.cursors,
            difference,
            saved: self.store.scopes(),
            note: self.scope_note(is_there),
            tick: self.time.shown,
            axis: self.axis_marks(from, to),
        })
    }

    /// What the user should know: how far a search has come, or that samples are still missing.
    fn scope_note(&self, is_there: bool) -> Option<String> {
        let (scope, run_until) = (&self.scope, self.time.run_until);
        match &scope.armed {
            Some(armed) if armed.next < run_until => {
                Some(format!("looks for the trigger, up to tick {} so far", armed.next))
            }
            Some(_) if self.kind == TargetKind::Recording => Some(format!(
                "the record does not meet the trigger from tick {} on",
                scope.searched
            )),
            _ => {
                (!is_there).then(|| format!("samples up to tick {} are there", scope.buffer.end()))
            }
        }
    }

    fn channel(&self, at: usize, name: String, from: u64, to: u64, samples: usize) -> Channel {
        let buffer = &self.scope.buffer;
        let count = to - from + 1;
        let step = count.div_ceil(samples.max(1) as u64).max(1);
        let mut found: Vec<Sample> = vec![];
        let mut tick = from;
        while tick <= to {
            let stretch =
                (tick..=to.min(tick + step - 1)).filter_map(|tick| buffer.value(tick, at));
            let sample = stretch.fold(None, |sample: Option<Sample>, value| {
                let known = sample.unwrap_or(Sample { tick, low: value, high: value, last: value });
                Some(Sample {
                    low: known.low.min(value),
                    high: known.high.max(value),
                    last: value,
                    ..known
                })
            });
            found.extend(sample);
            tick += step;
        }
        let low = found.iter().map(|sample| sample.low).fold(f64::INFINITY, f64::min);
        let high = found.iter().map(|sample| sample.high).fold(f64::NEG_INFINITY, f64::max);
        let is_bit = |value: f64| value == 0.0 || value == 1.0;
        Channel {
            logical: found.iter().all(|sample| is_bit(sample.low) && is_bit(sample.high)),
            low: if low.is_finite() { low } else { 0.0 },
            high: if high.is_finite() { high } else { 0.0 },
            at_cursors: self.scope.cursors.map(|cursor| buffer.value(cursor?, at)),
            samples: found,
            name,
        }
    }

    pub(super) fn scope_add(&mut self, names: &[String]) -> Result<Reply, Refusal> {
        for name in names.iter().map(|name| name.trim()).filter(|name| !name.is_empty()) {
            let name = self.defined_name(name).unwrap_or_else(|| name.to_owned());
            let executive = self.debugger()?.history_mut().executive();
            let found = executive.names().find(&name, Purpose::Watch);
            let variable = found.map_err(|error| Refusal::new(error.to_string()))?;
            if let Value::Array(_) = executive.read(variable) {
                return Err(Refusal::new(format!("`{name}` is an array; name an element")));
            }
            if !self.scope.names.contains(&name) {
                self.scope.names.push(name);
                self.scope.buffer = Samples::default();
            }
        }
        Ok(Reply::default())
    }

    pub(super) fn scope_remove(&mut self, name: &str) -> Result<Reply, Refusal> {
        let count = self.scope.names.len();
        self.scope.names.retain(|known| known != name);
        if self.scope.names.len() == count {
            return Err(Refusal::new(format!("`{name}` is not on the scope")));
        }
        self.scope.buffer = Samples::default();
        Ok(Reply::default())
    }

    pub(super) fn scope_show(&mut self, from: u64, to: u64) -> Result<Reply, Refusal> {
        self.debugger()?;
        if from > to || to - from >= MAX_SCOPE_TICKS {
            return Err(Refusal::new(format!("from 1 to {MAX_SCOPE_TICKS} ticks can be shown")));
        }
        self.scope.range = Some((from, to));
        self.scope.width = to - from + 1;
        Ok(Reply::default())
    }

    pub(super) fn scope_width(&mut self, ticks: u64) -> Result<Reply, Refusal> {
        self.debugger()?;
        if ticks == 0 || ticks > MAX_SCOPE_TICKS {
            return Err(Refusal::new(format!("from 1 to {MAX_SCOPE_TICKS} ticks can be shown")));
        }
        self.scope.width = ticks;
        self.scope.range = None;
        Ok(Reply::default())
    }

    pub(super) fn scope_trigger(&mut self, trigger: Option<Trigger>) -> Result<Reply, Refusal> {
        let expression = match &trigger {
            Some(trigger) => Some(self.debugger()?.program().expression(&trigger.expression)?),
            None => None,
        };
        // A recording is searched from its beginning. Elsewhere the trigger is waited for in the ticks that come; while an earlier
        // tick is shown, it is looked for from there on.
        let next = match (self.kind, self.time.following) {
            (TargetKind::Recording, _) => self.first(),
            (_, true) => self.time.run_until,
            (_, false) => self.time.shown,
        };
        self.scope.searched = next;
        let armed = |expression| Armed { expression: Some(expression), next, last: None };
        self.scope.armed = expression.map(armed);
        (self.scope.trigger_tick, self.scope.trigger, self.scope.range) = (None, trigger, None);
        Ok(Reply::default())
    }

    /// Looks for the trigger again, after the tick in which it was met.
    pub(super) fn scope_next_trigger(&mut self) -> Result<Reply, Refusal> {
        let (Some(met), Some(trigger)) = (self.scope.trigger_tick, self.scope.trigger.clone())
        else {
            return Err(Refusal::new("no trigger was met yet: set one first"));
        };
        let expression = self.debugger()?.program().expression(&trigger.expression)?;
        // From the tick itself on, whose value is the one before the next tick.
        self.scope.armed = Some(Armed { expression: Some(expression), next: met, last: None });
        (self.scope.trigger_tick, self.scope.range, self.scope.searched) = (None, None, met + 1);
        Ok(Reply::default())
    }

    pub(super) fn scope_cursor(&mut self, cursor: u8, tick: Option<u64>) -> Result<Reply, Refusal> {
        let slot = self.scope.cursors.get_mut(usize::from(cursor));
        let slot = slot.ok_or_else(|| Refusal::new("the cursors are 0 and 1"))?;
        *slot = tick;
        Ok(Reply::default())
    }

    pub(super) fn scope_save(&mut self, name: &str) -> Result<Reply, Refusal> {
        let ScopeState { names, width, trigger, .. } = &self.scope;
        let saved = SavedScope { names: names.clone(), width: *width, trigger: trigger.clone() };
        let name = checked_name(name)?;
        self.store.keep_scope(name, saved);
        self.save()?;
        Ok(Reply::message(format!("kept as {name}")))
    }

    pub(super) fn scope_load(&mut self, name: &str) -> Result<Reply, Refusal> {
        let saved = self.store.scope(name.trim()).cloned();
        let missing = || Refusal::new(format!("nothing is kept as `{}`", name.trim()));
        let SavedScope { names, width, trigger } = saved.ok_or_else(missing)?;
        let before = std::mem::take(&mut self.scope);
        let load = || {
            self.scope_add(&names)?;
            self.scope_width(width)?;
            self.scope_trigger(trigger)
        };
        let loaded = load();
        if loaded.is_err() {
            self.scope = before;
        }
        loaded
    }

    /// The samples that are shown: names, and a row for each tick.
    pub(super) fn scope_rows(&mut self) -> Result<ScopeRows, Refusal> {
        let (from, to) = self.scope_range();
        if self.scope.names.is_empty() {
            return Err(Refusal::new("no variable is on the scope"));
        }
        let long = Instant::now() + Duration::from_secs(30);
        if !self.fill(from, to, long) {
            return Err(Refusal::new("not all ticks can be run again; show a shorter stretch"));
        }
        let names = self.scope.names.clone();
        let row =
            |tick: u64| (0..names.len()).map(|at| self.scope.buffer.value(tick, at)).collect();
        let rows = (from..=to).map(|tick| (tick, row(tick))).collect();
        let tick_ns = self.debugger()?.tick_ns();
        Ok(ScopeRows {
            names,
            rows,
            tick_ns,
            trigger_tick: self.scope.trigger_tick,
            cursors: self.scope.cursors,
        })
    }
}

/// What an export is made of.
#[derive(Clone, Debug)]
pub(super) struct ScopeRows {
    pub(super) names: Vec<String>,
    /// Tick, and the value of each variable.
    pub(super) rows: Vec<(u64, Vec<Option<f64>>)>,
    pub(super) tick_ns: u64,
    pub(super) trigger_tick: Option<u64>,
    pub(super) cursors: [Option<u64>; 2],
}

#[cfg(test)]
mod tests {
    use plcc_abi::Dialect;

    use super::*;

    #[test]
    fn a_set_up_with_unknown_variables_leaves_the_scope_as_it_is() {
        let mut session = crate::testing::open(Dialect::Pmi, "$INTEGER\nN\n$END\nN=N+1\n", "");
        session.run_to(3);
        session.scope_add(&["N".into()]).unwrap();
        let saved = SavedScope { names: vec!["GONE".into()], width: 10, trigger: None };
        session.store.keep_scope("old", saved);
        assert!(session.scope_load("old").is_err());
        assert_eq!((session.scope.names.as_slice(), session.scope.width), (&["N".into()][..], 200));
    }
}
