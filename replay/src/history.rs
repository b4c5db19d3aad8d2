//! The ticks of a run, each of which can be run again: [`History`] is any such run, [`Launched`] one that the
//! debugger itself makes in simulated time, with checkpoints to go back to.

use std::collections::BTreeMap;

use plcc_abi::Engine;
use plcc_runtime::stimulus::Player;
use plcc_runtime::{Event, Executive, Purpose, Setting, Stop, VariableKey};

use crate::DebugError;
use crate::interruption::Interruption;

/// What a tick gave.
#[derive(Clone, Debug, Default)]
pub struct TickResult {
    /// Its events.
    pub events: Vec<Event>,
    /// Why the program was stopped in it, if it was.
    pub stop: Option<Stop>,
    /// Whether the clock left the tick out, so that nothing of it was run.
    pub skipped: bool,
    /// Whether the watchdog stopped a scan of it. Such a tick is run again only up to the line at which the scan stood, and
    /// only in an engine that stops there: see [`History::cut_at`].
    pub cut: bool,
    /// A further message for the user, for example that the tick differs from the recorded one.
    pub note: Option<String>,
}

/// A version of the program in a run: what ran after so many online changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Version {
    /// The number of online changes before it.
    pub generation: u16,
    /// The first of its ticks that are known.
    pub first: u64,
    /// The tick after the last of them.
    pub end: u64,
}

/// What acted on a variable from outside before a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Act {
    /// The variable.
    pub variable: VariableKey,
    /// Its new value; `None` where a force ends.
    pub value: Option<Setting>,
    /// How it acted.
    pub kind: ActKind,
}

/// How something acts on a variable from outside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ActKind {
    /// A row of the stimulus sets it.
    Stimulus,
    /// Somebody sets it.
    Write,
    /// An input gets a value from outside: another process gives it, or somebody sets it. A record does not tell which.
    Input,
    /// Somebody forces it, or ends that.
    Force,
}

/// The ticks of a run, or of one version of the program in it.
pub trait History {
    /// The first tick that can be run again.
    fn first(&self) -> u64;

    /// The tick after the last one that is known; the end of a recording, or how far a run has
    /// come.
    fn known(&self) -> u64;

    /// All versions of the program in the run, in order; this history has the ticks of one of them. Empty where there were no
    /// online changes.
    fn versions(&self) -> &[Version] {
        &[]
    }

    /// When the run began, in milliseconds since 1970 (UTC), where its ticks followed the clock.
    fn began_ms(&self) -> Option<u64> {
        None
    }

    /// The number of online changes before the version whose ticks these are.
    fn generation(&self) -> u16 {
        0
    }

    /// Whether further ticks may follow those that are known.
    fn goes_on(&self) -> bool;

    /// Puts the [executive](Self::executive) into the state before a tick.
    ///
    /// # Errors
    /// When there is no such tick.
    fn go_before(&mut self, tick: u64) -> Result<(), DebugError>;

    /// The state before a tick, as a [checkpoint](Executive::checkpoint).
    ///
    /// # Errors
    /// When there is no such tick.
    fn before(&mut self, tick: u64) -> Result<Vec<u8>, DebugError> {
        self.go_before(tick)?;
        Ok(self.executive().checkpoint())
    }

    /// Runs a tick in `engine`: from the state before it, with what acted on the machine in it.
    ///
    /// # Errors
    /// When there is no such tick.
    fn run(&mut self, tick: u64, engine: &mut dyn Engine) -> Result<TickResult, DebugError>;

    /// What acted on variables from outside before a tick, in order.
    ///
    /// # Errors
    /// When there is no such tick.
    fn acts(&mut self, _tick: u64) -> Result<Vec<Act>, DebugError> {
        Ok(vec![])
    }

    /// Of a tick in which the watchdog stopped a scan: the file and the line at which the scan stood. `None` for other
    /// ticks, and where the line is not known; such a tick is not run again.
    ///
    /// # Errors
    /// When there is no such tick.
    fn cut_at(&mut self, _tick: u64) -> Result<Option<(String, u32)>, DebugError> {
        Ok(None)
    }

    /// Runs a tick in an engine of the history's own, which is the fastest way.
    ///
    /// # Errors
    /// When there is no such tick.
    fn run_unobserved(&mut self, tick: u64) -> Result<TickResult, DebugError>;

    /// The executive, in the state after the tick that was run last.
    fn executive(&mut self) -> &mut dyn Executive;

    /// The forces that the user has made and not ended, in the order of their variables' names.
    fn forces(&self) -> Vec<(String, Setting)>;

    /// From now on, long movements end with an error as soon as `interruption` wants that.
    fn interrupt_by(&mut self, _interruption: Interruption) {}

    /// Looks whether a record has grown, so that further ticks are known.
    ///
    /// # Errors
    /// When it can't be read any more.
    fn look_for_more(&mut self) -> Result<(), DebugError> {
        Ok(())
    }

    /// Sets a variable before a tick, as the operator would, or with `force` holds it from there on
    /// (`None` for the value ends that). Later ticks are forgotten.
    ///
    /// # Errors
    /// When nothing can be changed here, or not this variable.
    fn change(
        &mut self,
        tick: u64,
        name: &str,
        value: Option<&str>,
        force: bool,
    ) -> Result<(), DebugError>;
}

/// How much memory all checkpoints together may take, in bytes.
const CHECKPOINT_BYTES: usize = 64 << 20;

/// How many ticks lie between two checkpoints, until these take too much memory.
const FIRST_INTERVAL: u64 = 32;

/// A change that the user made.
#[derive(Clone, Copy, Debug)]
enum Change {
    Set(VariableKey, Setting),
    Force(VariableKey, Option<Setting>),
}

/// A run in simulated time that the debugger makes itself.
pub struct Launched {
    executive: Box<dyn Executive + Send>,
    engine: Box<dyn Engine>,
    player: Player,
    /// After how many ticks the run ends; `None` for a run without an end.
    ticks: Option<u64>,
    /// The number of the next tick that the executive runs.
    at: u64,
    known: u64,
    stopped: bool,
    /// States before ticks, by rising tick; tick 0 is always there.
    checkpoints: BTreeMap<u64, Vec<u8>>,
    interval: u64,
    changes: BTreeMap<u64, Vec<Change>>,
    interruption: Interruption,
}

impl std::fmt::Debug for Launched {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Launched").field("at", &self.at).field("known", &self.known).finish()
    }
}

impl Launched {
    /// A run from power-up. `engine` runs the ticks that nobody looks at.
    pub fn new(
        executive: Box<dyn Executive + Send>,
        engine: Box<dyn Engine>,
        player: Player,
        ticks: Option<u64>,
    ) -> Self {
        let checkpoints = BTreeMap::from([(0, executive.checkpoint())]);
        Self {
            executive,
            engine,
            player,
            ticks,
            at: 0,
            known: 0,
            stopped: false,
            checkpoints,
            interval: FIRST_INTERVAL,
            changes: BTreeMap::new(),
            interruption: Interruption::default(),
        }
    }

    fn move_before(&mut self, tick: u64) -> Result<(), DebugError> {
        if tick > self.known && (self.stopped || self.ticks.is_some_and(|ticks| tick >= ticks)) {
            return Err(DebugError(format!("the run ends before tick {tick}")));
        }
        if self.at != tick {
            let nearest = self.checkpoints.range(..=tick).next_back();
            let (&from, state) =
                nearest.ok_or_else(|| DebugError::new("a checkpoint is missing"))?;
            if self.at > tick || self.at < from {
                let resumed = self.executive.resume(state);
                resumed.map_err(|error| DebugError(error.to_string()))?;
                self.at = from;
                self.player.seek(from);
            }
        }
        while self.at < tick {
            self.interruption.check()?;
            let mut engine = std::mem::replace(&mut self.engine, Box::new(NoEngine));
            let result = self.tick(engine.as_mut());
            self.engine = engine;
            if result.stop.is_some() && self.at < tick {
                return Err(DebugError(format!("the program was stopped before tick {tick}")));
            }
        }
        Ok(())
    }

    /// Runs the tick `at`.
    fn tick(&mut self, engine: &mut dyn Engine) -> TickResult {
        let tick = self.at;
        for change in self.changes.get(&tick).into_iter().flatten() {
            match *change {
                Change::Set(key, value) => self.executive.write(key, value),
                Change::Force(key, value) => {
                    // It was possible when it was noted.
                    let _ = self.executive.force(key, value);
                }
            }
        }
        self.player.apply(tick, self.executive.as_mut());
        let mut result = TickResult::default();
        result.stop = self.executive.tick(engine, &mut result.events).err();
        self.at = tick + 1;
        if self.at > self.known {
            self.known = self.at;
            self.stopped = result.stop.is_some();
            if self.known.is_multiple_of(self.interval) && !self.stopped {
                self.keep_checkpoint();
            }
        }
        result
    }

    /// Keeps a checkpoint of the state before the tick `at`. When all together take too much memory, the
    /// interval is doubled, and every second one is dropped.
    fn keep_checkpoint(&mut self) {
        self.checkpoints.insert(self.at, self.executive.checkpoint());
        let bytes: usize = self.checkpoints.values().map(Vec::len).sum();
        if bytes > CHECKPOINT_BYTES {
            self.interval *= 2;
            let interval = self.interval;
            self.checkpoints.retain(|tick, _| tick.is_multiple_of(interval));
        }
    }
}

/// Takes the place of the engine while that is borrowed.
struct NoEngine;

impl Engine for NoEngine {
    fn call(
        &mut self,
        _: usize,
        _: Option<plcc_abi::ResumePoint>,
        _: &mut plcc_abi::Scan<'_>,
    ) -> plcc_abi::Outcome {
        plcc_abi::Outcome::End
    }
}

impl History for Launched {
    fn first(&self) -> u64 {
        0
    }

    fn known(&self) -> u64 {
        self.known
    }

    fn goes_on(&self) -> bool {
        !self.stopped && self.ticks.is_none_or(|ticks| self.known < ticks)
    }

    fn go_before(&mut self, tick: u64) -> Result<(), DebugError> {
        self.move_before(tick)
    }

    fn run(&mut self, tick: u64, engine: &mut dyn Engine) -> Result<TickResult, DebugError> {
        if tick >= self.known && !self.goes_on() {
            return Err(DebugError(format!("the run ends before tick {tick}")));
        }
        self.move_before(tick)?;
        Ok(self.tick(engine))
    }

    fn acts(&mut self, tick: u64) -> Result<Vec<Act>, DebugError> {
        let changes = self.changes.get(&tick).into_iter().flatten().map(|change| match *change {
            Change::Set(variable, value) => {
                Act { variable, value: Some(value), kind: ActKind::Write }
            }
            Change::Force(variable, value) => Act { variable, value, kind: ActKind::Force },
        });
        let rows = self.player.rows_of(tick).map(|(variable, value)| Act {
            variable,
            value: Some(value),
            kind: ActKind::Stimulus,
        });
        Ok(changes.chain(rows).collect())
    }

    fn run_unobserved(&mut self, tick: u64) -> Result<TickResult, DebugError> {
        if tick >= self.known && !self.goes_on() {
            return Err(DebugError(format!("the run ends before tick {tick}")));
        }
        self.move_before(tick)?;
        let mut engine = std::mem::replace(&mut self.engine, Box::new(NoEngine));
        let result = self.tick(engine.as_mut());
        self.engine = engine;
        Ok(result)
    }

    fn executive(&mut self) -> &mut dyn Executive {
        self.executive.as_mut()
    }

    fn forces(&self) -> Vec<(String, Setting)> {
        let names = self.executive.names();
        let mut forces = BTreeMap::new();
        for change in self.changes.values().flatten() {
            match *change {
                Change::Force(key, Some(value)) => drop(forces.insert(names.canonical(key), value)),
                Change::Force(key, None) => drop(forces.remove(&names.canonical(key))),
                Change::Set(..) => {}
            }
        }
        forces.into_iter().collect()
    }

    fn interrupt_by(&mut self, interruption: Interruption) {
        self.interruption = interruption;
    }

    fn change(
        &mut self,
        tick: u64,
        name: &str,
        value: Option<&str>,
        force: bool,
    ) -> Result<(), DebugError> {
        let text = |error: &dyn std::fmt::Display| DebugError(error.to_string());
        let names = self.executive.names();
        let key = names.find(name, Purpose::Stimulus).map_err(|error| text(&error))?;
        let setting =
            value.map(|value| names.parse(key, value).map_err(|error| text(&error))).transpose()?;
        if self.executive.names().properties(key).elements.is_some() {
            return Err(DebugError(format!("`{name}` is not a single variable")));
        }
        self.move_before(tick)?;
        let change = match (setting, force) {
            (Some(_), false) if self.executive.is_held(key) => {
                return Err(DebugError(format!(
                    "`{name}` is forced, so that setting it would do nothing; end its force first, or force it to another value"
                )));
            }
            (Some(value), false) => Change::Set(key, value),
            (None, false) => return Err(DebugError::new("a value is missing")),
            (value, true) => {
                let forced = self.executive.force(key, value);
                forced.map_err(|reason| DebugError(format!("`{name}` {reason}")))?;
                Change::Force(key, value)
            }
        };
        self.changes.entry(tick).or_default().push(change);
        self.changes.retain(|&of, _| of <= tick);
        self.checkpoints.retain(|&of, _| of <= tick);
        (self.known, self.stopped) = (tick, false);
        Ok(())
    }
}
