//! The ticks of a recording, as the debugger runs them again.

use std::fs;
use std::ops::Range;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

use plcc_abi::Engine;
use plcc_abi::place::Direction;
use plcc_record::{Action, Recording, ReplayError, ReplayState, Replayed, RunTicks};
use plcc_runtime::{Event, Executive, Setting};

use crate::DebugError;
use crate::history::{Act, ActKind, History, TickResult, Version};

/// The ticks of a recording.
pub struct Recorded {
    path: PathBuf,
    /// Which file the recording was read from: device and number.
    file: Option<(u64, u64)>,
    recording: Recording,
    /// What the run calls itself.
    run: u64,
    generation: u16,
    /// All versions of the program in the run.
    versions: Vec<Version>,
    state: ReplayState,
    /// Runs the ticks that nobody looks at.
    engine: Box<dyn Engine>,
    first: u64,
    /// The tick after the last one.
    end: u64,
    /// The ticks of a gap that a movement has come to.
    missing: Range<u64>,
    /// Whether the user is still to be told of it.
    tells_missing: bool,
}

impl std::fmt::Debug for Recorded {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Recorded").field("first", &self.first).field("end", &self.end).finish()
    }
}

fn failed(error: ReplayError) -> DebugError {
    DebugError(error.to_string())
}

/// Which file is at a path now.
fn file_at(path: &Path) -> Option<(u64, u64)> {
    fs::metadata(path).ok().map(|metadata| (metadata.dev(), metadata.ino()))
}

/// The ticks of a run that calls itself so.
fn ticks_of(recording: &Recording, run: u64, generation: u16) -> Result<RunTicks<'_>, DebugError> {
    let found = recording.runs().iter().rfind(|one| one.header.run == run);
    let run = found.ok_or_else(|| DebugError::new("the recording has become another one"))?;
    Ok(RunTicks { recording, run, generation })
}

/// The versions of the program in a run, of which ticks are kept.
fn versions_of(recording: &Recording, run: u64) -> Result<Vec<Version>, DebugError> {
    let generations = ticks_of(recording, run, 0)?.run.generations();
    let mut versions = vec![];
    for generation in generations {
        let Range { start, end } = ticks_of(recording, run, generation)?.kept().map_err(failed)?;
        if start < end {
            versions.push(Version { generation, first: start, end });
        }
    }
    Ok(versions)
}

impl Recorded {
    /// The ticks that a run of a recording did after `generation` online changes. `path` is that of the
    /// recording, `run` what the run's header calls it. `executive` is one of the program that ran then,
    /// set as the run was, and `engine` any engine of that program.
    ///
    /// # Errors
    /// When the recording can't be read, or has no such run.
    pub fn new(
        path: &Path,
        recording: Recording,
        run: u64,
        generation: u16,
        executive: Box<dyn Executive + Send>,
        engine: Box<dyn Engine>,
    ) -> Result<Self, DebugError> {
        let (path, file) = (path.to_owned(), file_at(path));
        let (first, last) = ticks_of(&recording, run, generation)?.range().map_err(failed)?;
        let versions = versions_of(&recording, run)?;
        let state = ReplayState::new(executive);
        let end = last.saturating_add(1);
        Ok(Self {
            path,
            file,
            recording,
            run,
            generation,
            versions,
            state,
            engine,
            first,
            end,
            missing: 0..0,
            tells_missing: false,
        })
    }

    /// Runs a tick, in `observed` or else in the history's own engine.
    fn step(
        &mut self,
        tick: u64,
        observed: Option<&mut dyn Engine>,
    ) -> Result<TickResult, DebugError> {
        self.go_before(tick)?;
        if let Some(skipped) = self.skipped(tick) {
            return Ok(skipped);
        }
        let ticks = ticks_of(&self.recording, self.run, self.generation)?;
        let mut events = vec![];
        let cut = self.place_of_cut(tick);
        let replayed = match (observed, &cut) {
            (Some(engine), Some(_)) => self.state.step_into_cut(ticks, engine, &mut events),
            (Some(engine), None) => self.state.step(ticks, engine, &mut events),
            (None, _) => self.state.step(ticks, self.engine.as_mut(), &mut events),
        };
        result_of(tick, replayed.map_err(failed)?, events, cut)
    }

    /// Where the scan of the next tick stood, if the watchdog stopped it there.
    fn place_of_cut(&self, tick: u64) -> Option<(String, u32)> {
        let next = self.state.next().filter(|next| next.tick == tick && next.is_cut())?;
        next.stop.as_ref()?.place.clone()
    }

    /// What a tick gives that was skipped after an overrun, or is missing in the recording: nothing, since there is
    /// nothing to run again. `None` for any other tick.
    fn skipped(&mut self, tick: u64) -> Option<TickResult> {
        let is_skipped = self.state.next().is_some_and(|next| next.tick > tick);
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
    cut: Option<(String, u32)>,
) -> Result<TickResult, DebugError> {
    let mut result = TickResult { events, ..TickResult::default() };
    let Some(replayed) = replayed else {
        return Err(DebugError(format!("tick {tick} is not in the recording")));
    };
    result.stop = replayed.stop;
    result.cut = replayed.cut;
    if replayed.cut {
        let shown = match cut {
            Some((_, line)) => format!(
                "is shown up to the first time that a scan came to line {line}, where it stood"
            ),
            None => "is not run again".into(),
        };
        result.note =
            Some(format!("tick {tick} was stopped in its middle by the watchdog; it {shown}"));
    } else if !replayed.matches {
        result.note = Some(format!(
            "tick {tick} differs from the recorded one; `plcc replay` says in which variable"
        ));
    }
    Ok(result)
}

impl History for Recorded {
    fn first(&self) -> u64 {
        self.first
    }

    fn known(&self) -> u64 {
        self.end
    }

    fn versions(&self) -> &[Version] {
        &self.versions
    }

    fn generation(&self) -> u16 {
        self.generation
    }

    fn goes_on(&self) -> bool {
        false
    }

    fn go_before(&mut self, tick: u64) -> Result<(), DebugError> {
        let ticks = ticks_of(&self.recording, self.run, self.generation)?;
        let known = self.missing.contains(&tick).then_some(self.missing.end);
        let gone = self.state.go_to(ticks, known.unwrap_or(tick), self.engine.as_mut());
        // A tick that is missing is like one that was skipped: the state is that after the gap.
        if let Err(ReplayError::NotKept { .. }) = gone
            && let Some(missing) = self.state.missing().filter(|gap| gap.contains(&tick))
        {
            (self.missing, self.tells_missing) = (missing, true);
            return Ok(());
        }
        gone.map_err(failed)
    }

    fn run(&mut self, tick: u64, engine: &mut dyn Engine) -> Result<TickResult, DebugError> {
        self.step(tick, Some(engine))
    }

    fn began_ms(&self) -> Option<u64> {
        let header = &ticks_of(&self.recording, self.run, self.generation).ok()?.run.header;
        header.clocked.then_some(header.began_ms)
    }

    /// In simulated time nothing but the stimulus sets variables.
    fn acts(&mut self, tick: u64) -> Result<Vec<Act>, DebugError> {
        self.go_before(tick)?;
        let clocked = ticks_of(&self.recording, self.run, self.generation)?.run.header.clocked;
        let names = self.state.executive().names();
        let set = |variable| match names.properties(variable).direction {
            _ if !clocked => ActKind::Stimulus,
            Direction::Input => ActKind::Input,
            _ => ActKind::Write,
        };
        let next = self.state.next().filter(|next| next.tick == tick);
        let actions = next.map_or(&[][..], |next| next.actions.as_slice());
        let act = |action: &Action| match *action {
            Action::Write(variable, value) => {
                Some(Act { variable, value: Some(value), kind: set(variable) })
            }
            Action::Force(variable, value) => Some(Act { variable, value, kind: ActKind::Force }),
            Action::Skip(_) | Action::SafeOutputs => None,
        };
        Ok(actions.iter().filter_map(act).collect())
    }

    fn cut_at(&mut self, tick: u64) -> Result<Option<(String, u32)>, DebugError> {
        self.go_before(tick)?;
        Ok(self.place_of_cut(tick))
    }

    fn run_unobserved(&mut self, tick: u64) -> Result<TickResult, DebugError> {
        self.step(tick, None)
    }

    fn executive(&mut self) -> &mut dyn Executive {
        self.state.executive()
    }

    /// Nothing can be forced in a record.
    fn forces(&self) -> Vec<(String, Setting)> {
        vec![]
    }

    fn look_for_more(&mut self) -> Result<(), DebugError> {
        let read = |error: plcc_record::RecordError| DebugError(error.to_string());
        let file = file_at(&self.path);
        if file == self.file {
            self.recording.refresh().map_err(read)?;
        } else if file.is_some() {
            // The part that was written is now the older one, and a new one was begun.
            self.recording = Recording::open(&self.path).map_err(read)?;
            self.file = file;
        }
        self.versions = versions_of(&self.recording, self.run)?;
        let ticks = ticks_of(&self.recording, self.run, self.generation)?;
        let (first, last) = ticks.range().map_err(failed)?;
        let end = last.saturating_add(1);
        if (first, end) != (self.first, self.end) {
            self.state.read_on(ticks).map_err(failed)?;
            (self.first, self.end) = (first, end);
        }
        Ok(())
    }

    fn change(&mut self, _: u64, _: &str, _: Option<&str>, _: bool) -> Result<(), DebugError> {
        Err(DebugError::new("a recording can't be changed"))
    }
}
