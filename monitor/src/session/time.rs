//! Which tick is shown, and the running of ticks: new ones as time passes, and earlier ones again.

use std::time::{Duration, Instant};

use plcc_replay::Debugger;
use plcc_replay::history::TickResult;
use plcc_replay::observers::Observed;

use super::Session;
use crate::flow::{Flow, LOOK_BACK, StepsRecorder};
use crate::view::TargetKind;
use crate::{Refusal, Reply};

/// How long [`Session::poll`] runs ticks at most.
const POLL_TIME: Duration = Duration::from_millis(40);

/// How many ticks before the end of a recording its events are collected from, at most.
const EVENTS_BACK: u64 = 20_000;

/// How many events are kept.
const MAX_EVENTS: usize = 5_000;

/// Which tick is shown, and which were run.
#[derive(Debug)]
pub(super) struct Time {
    /// The tick that is shown.
    pub(super) shown: u64,
    /// Whether the newest one is shown.
    pub(super) following: bool,
    /// The first tick that was not run yet. From all before it, events and samples were collected (of a long
    /// recording, from the last [`EVENTS_BACK`]).
    pub(super) run_until: u64,
    /// How fast a program runs: 1 is real time, 0 as fast as possible.
    speed: f64,
    /// When the program was last started, continued or given another speed, and the tick with which it went on.
    begun: Option<(Instant, u64)>,
    /// Why the program was stopped.
    pub(super) stopped: Option<String>,
    /// What the user should know, such as that ticks of a record are damaged.
    pub(super) note: Option<String>,
}

/// Which tick one of several displays shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum ShownTick {
    /// The newest one as time goes on.
    #[default]
    Newest,
    /// This one.
    At(u64),
}

impl ShownTick {
    pub(crate) fn is_newest(self) -> bool {
        self == Self::Newest
    }
}

impl Time {
    pub(super) fn new(debugger: Option<&Debugger<'_>>, speed: f64) -> Self {
        let (first, known) =
            debugger.map_or((0, 0), |debugger| (debugger.first_tick(), debugger.known_ticks()));
        Self {
            shown: first,
            following: true,
            run_until: known.saturating_sub(EVENTS_BACK).max(first),
            speed,
            begun: None,
            stopped: None,
            note: None,
        }
    }
}

impl Session<'_> {
    /// Reads ticks that were recorded meanwhile, or runs those of a program that are due. Works for at most
    /// some 40 ms; what is left is done at the next call. Gives whether anything has changed.
    pub fn poll(&mut self) -> bool {
        let before = (self.time.run_until, self.time.shown);
        let until = Instant::now() + POLL_TIME;
        if let Some(link) = &mut self.link {
            link.poll();
        }
        let Some(run_target) = self.run_target() else { return false };
        self.let_keys_go();
        let listed = self.continue_answer(until);
        while self.time.run_until < run_target && Instant::now() < until {
            let tick = self.time.run_until;
            // While the user stays at a tick of another version of the program, that one is not left.
            if !self.time.following && !self.is_of_version(tick) {
                break;
            }
            // The last ticks are run in the interpreter right now, since they are shown next: to run them again would
            // take longer.
            let is_near = run_target - tick <= LOOK_BACK;
            let result = if is_near { self.trace(tick) } else { self.run_unobserved(tick) };
            if let Err(refusal) = result {
                self.time.note = Some(refusal.message);
                // Damage in a record is passed over; a program that can't go on stays where it is.
                if self.kind != TargetKind::Program {
                    self.time.run_until = tick + 1;
                }
                break;
            }
            self.time.run_until = tick + 1;
            if self.time.stopped.is_some() {
                break;
            }
        }
        self.search_trigger(until);
        if self.time.following {
            self.time.shown = self.time.run_until.saturating_sub(1).max(self.first());
        }
        listed || before != (self.time.run_until, self.time.shown)
    }

    /// Shows the tick of another display from now on.
    pub(crate) fn show_tick_of(&mut self, shown: ShownTick) {
        match shown {
            ShownTick::Newest => {
                self.time.following = true;
                self.time.shown = self.time.run_until.saturating_sub(1).max(self.first());
            }
            ShownTick::At(tick) => (self.time.following, self.time.shown) = (false, tick),
        }
    }

    /// The tick that is shown now.
    pub(crate) fn shown_tick(&self) -> ShownTick {
        if self.time.following { ShownTick::Newest } else { ShownTick::At(self.time.shown) }
    }

    /// The tick before which all are to be run now; `None` without a run or recording.
    fn run_target(&mut self) -> Option<u64> {
        let (kind, following) = (self.kind, self.time.following);
        let debugger = self.debugger.as_mut()?;
        if kind != TargetKind::Program {
            if let Err(error) = debugger.history_mut().look_for_more() {
                self.time.note = Some(error.0);
            }
            return Some(debugger.known_ticks());
        }
        if !following || self.time.stopped.is_some() {
            self.time.begun = None;
            return Some(self.time.run_until);
        }
        let (since, from) = *self.time.begun.get_or_insert((Instant::now(), self.time.run_until));
        let passed = since.elapsed().as_secs_f64();
        let ticks = match self.time.speed {
            speed if speed > 0.0 => passed * speed * 1e9 / debugger.tick_ns().max(1) as f64,
            _ => f64::INFINITY,
        };
        // As fast as possible: as many as can be run in the time of one call, but no more than that.
        let most = self.time.run_until.saturating_add(10_000);
        let wanted = from.saturating_add(1).saturating_add(ticks as u64).min(most);
        if wanted == most {
            self.time.begun = None;
        }
        Some(wanted)
    }

    pub(super) fn first(&self) -> u64 {
        self.debugger.as_ref().map_or(0, Debugger::first_tick)
    }

    pub(super) fn state(&self) -> String {
        let state = match (self.kind, &self.debugger, &self.link) {
            (TargetKind::Control, _, Some(link)) => match link.status() {
                Some(status) => return status.state.clone(),
                None => "not connected",
            },
            (TargetKind::Control, ..) => "not connected",
            _ if self.time.stopped.is_some() => "stopped",
            (TargetKind::Recording, ..) => "recorded",
            (TargetKind::Program, Some(debugger), _) => {
                match debugger.history().goes_on()
                    || self.time.run_until < debugger.history().known()
                {
                    true if self.time.following => "running",
                    true => "paused",
                    false => "ended",
                }
            }
            (TargetKind::Program, None, _) => "ended",
        };
        state.to_owned()
    }

    /// Runs a tick in the fastest engine, and takes in its events.
    fn run_unobserved(&mut self, tick: u64) -> Result<(), Refusal> {
        self.enter_version_of(tick)?;
        self.executive_tick = None;
        let result = self.debugger()?.history_mut().run_unobserved(tick)?;
        self.executive_tick = Some(tick);
        self.take_result(tick, result);
        Ok(())
    }

    /// Runs a tick in the statement interpreter, takes in what its statements did, and, of a tick that
    /// was not run before, its events.
    pub(super) fn trace(&mut self, tick: u64) -> Result<(), Refusal> {
        let is_new = tick >= self.time.run_until;
        self.debugger()?;
        self.enter_version_of(tick)?;
        self.executive_tick = None;
        let (Some(debugger), Some(interpreter)) = (&mut self.debugger, &mut self.interpreter)
        else {
            return Ok(());
        };
        let mut recorder = StepsRecorder::new(&self.placed);
        let cut = debugger.cut_statements(tick)?;
        let mut engine = Observed::new(interpreter.as_mut(), &mut recorder).cut_at(cut);
        let result = debugger.history_mut().run(tick, &mut engine)?;
        let steps = recorder.finish();
        self.costs.take(&steps, &self.text);
        self.traces.insert(tick, steps);
        self.executive_tick = Some(tick);
        if is_new {
            self.take_result(tick, result);
        }
        Ok(())
    }

    /// Takes in what a tick gave that was not run before.
    fn take_result(&mut self, tick: u64, result: TickResult) {
        self.take_tick(tick, result.skipped, result.cut);
        self.time.note = result.note.or(self.time.note.take());
        self.time.stopped = result.stop.map(|stop| stop.message);
        self.take_events(result.events);
    }

    /// Takes in a tick that was run for the first time. The executive is in the state after it.
    fn take_tick(&mut self, tick: u64, skipped: bool, cut: bool) {
        if skipped || cut {
            self.note_overrun(tick, cut);
        }
        if let Some(debugger) = &mut self.debugger {
            let tick_ns = debugger.tick_ns();
            let executive = debugger.history_mut().executive();
            self.scope.take(tick, executive);
            self.machine.take(tick, tick_ns, executive);
        }
    }

    fn take_events(&mut self, events: Vec<plcc_runtime::Event>) {
        self.show_in_terminal(&events);
        self.events.extend(events);
        let over = self.events.len().saturating_sub(MAX_EVENTS);
        self.events.drain(..over);
    }

    /// What the statements did in the last scans up to the tick that is shown.
    pub(super) fn flow(&mut self) -> Result<&Flow, Refusal> {
        let tick = self.time.shown;
        let is_known = self.flow.as_ref().is_some_and(|(of, _)| *of == tick);
        if !is_known {
            let scans_go_on = self.debugger()?.program().language().scans_go_on();
            self.enter_version_of(tick)?;
            let history = self.debugger()?.history();
            let (known, version_first) = (history.known(), history.first());
            let first = (tick + 1).saturating_sub(LOOK_BACK).max(version_first);
            // While newest ticks are followed, those that were traced already are enough: tracing all of the last
            // ones would take longer than the ticks themselves.
            let first = if self.time.following && self.traces.has(tick) { tick } else { first };
            for of in first..=tick {
                // A program has not run its first tick yet.
                if !self.traces.has(of) && of < known {
                    self.trace(of)?;
                }
            }
            let flow = Flow::new(&self.traces, tick, scans_go_on);
            self.flow = Some((tick, flow));
        }
        let nothing = || Refusal::new("no tick was run yet");
        self.flow.as_ref().map(|(_, flow)| flow).ok_or_else(nothing)
    }

    pub(super) fn follow(&mut self) -> Result<Reply, Refusal> {
        self.debugger()?;
        self.time.following = true;
        self.time.shown = self.time.run_until.saturating_sub(1).max(self.first());
        Ok(Reply::default())
    }

    pub(super) fn pause(&mut self) -> Result<Reply, Refusal> {
        self.debugger()?;
        self.time.following = false;
        Ok(Reply::message(format!("tick {}", self.time.shown)))
    }

    pub(super) fn set_speed(&mut self, speed: f64) -> Result<Reply, Refusal> {
        if self.kind != TargetKind::Program {
            return Err(Refusal::new("only a program that is run here has a speed"));
        }
        if !speed.is_finite() || speed < 0.0 {
            return Err(Refusal::new("the speed is a number from 0 (as fast as possible)"));
        }
        self.time.speed = speed;
        self.time.begun = None;
        Ok(Reply::default())
    }

    pub(super) fn go_to_tick(&mut self, tick: u64) -> Result<Reply, Refusal> {
        let (first, last) = (self.first(), self.time.run_until.saturating_sub(1));
        self.debugger()?;
        if tick < first || tick > last {
            return Err(Refusal::new(format!("the ticks from {first} to {last} can be shown")));
        }
        self.time.following = false;
        self.time.shown = tick;
        self.scope_follow(tick);
        Ok(Reply::message(format!("tick {tick}")))
    }

    pub(super) fn move_ticks(&mut self, by: i64) -> Result<Reply, Refusal> {
        let (first, last) = (self.first(), self.time.run_until.saturating_sub(1));
        let tick = self.time.shown.saturating_add_signed(by).clamp(first, last.max(first));
        self.go_to_tick(tick)
    }

    /// Goes to the tick of the next or previous scan of the task at the cursor.
    pub(super) fn move_scans(&mut self, by: i64) -> Result<Reply, Refusal> {
        /// How many ticks are searched for a scan of the task.
        const MOST: u64 = 5_000;
        let task = self.task_at_cursor();
        let mut tick = self.time.shown;
        for _ in 0..by.unsigned_abs() {
            let mut looked = 0;
            loop {
                let next = tick.saturating_add_signed(by.signum());
                if next == tick
                    || next < self.first()
                    || next >= self.time.run_until
                    || looked >= MOST
                {
                    return Err(Refusal::new("there is no further scan of this task"));
                }
                tick = next;
                looked += 1;
                if !self.traces.has(tick) {
                    self.trace(tick)?;
                }
                let runs = self.traces.get(tick).is_some_and(|steps| match task {
                    Some(task) => steps.calls.iter().any(|call| call.task == task),
                    None => !steps.calls.is_empty(),
                });
                if runs {
                    break;
                }
            }
        }
        self.go_to_tick(tick)
    }

    /// Goes back to the statement that changed a variable last, before the tick that is shown or in it.
    pub(super) fn previous_change(&mut self, name: &str) -> Result<Reply, Refusal> {
        let (shown, run_until) = (self.time.shown, self.time.run_until);
        let was_followed = self.time.following;
        self.executive_tick = None;
        let debugger = self.debugger()?;
        // From the end of the tick that is shown when it is the newest one, else from its beginning, so
        // that the same command again goes further back.
        let from = if was_followed && shown + 1 >= run_until { shown + 1 } else { shown };
        match from == shown {
            true => debugger.go_to_tick(shown)?,
            false => debugger.go_to_end()?,
        }
        debugger.go_to_last_change(name)?;
        self.show_version();
        let debugger = self.debugger()?;
        let position = debugger.position();
        let statement = debugger.step_here()?.map(|step| step.statement);
        if let Some(row) = statement.and_then(|statement| self.text.row_of(statement)) {
            self.put_cursor(row)?;
        }
        self.time.following = false;
        self.time.shown = position.tick;
        self.scope_follow(position.tick);
        Ok(Reply::message(format!("{name} was changed in tick {}", position.tick)))
    }

    /// The task of the statement at the cursor.
    fn task_at_cursor(&mut self) -> Option<usize> {
        let row = self.cursor_row()?;
        if let Some(task) = self.task_of_row(row) {
            return Some(task);
        }
        let statement = *self.text.rows.get(row)?.statements.first()?;
        let steps = self.traces.get(self.time.shown)?;
        let call = steps.steps.iter().find(|step| step.0 == statement)?.1;
        steps.calls.get(call).map(|call| call.task)
    }
}
