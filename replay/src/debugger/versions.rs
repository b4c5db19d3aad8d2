//! Online changes: a run has several versions of the program, one after the other, and the debugger goes from one to the
//! next as it moves. Of each version it has a session of its own, with its program and its ticks.

use super::{Debugger, Session};
use crate::DebugError;
use crate::history::Version;

impl Debugger<'_> {
    /// The first tick that can be shown, of any version of the program.
    pub fn first_tick(&self) -> u64 {
        let first = self.history().versions().first();
        first.map_or(self.history().first(), |version| version.first)
    }

    /// The tick after the last one that is known, of any version of the program.
    pub fn known_ticks(&self) -> u64 {
        let last = self.history().versions().last();
        last.map_or(self.history().known(), |version| version.end)
    }

    /// The number of online changes before the version that is looked at.
    pub fn generation(&self) -> u16 {
        self.history().generation()
    }

    /// The number of online changes before the newest version.
    pub fn newest_generation(&self) -> u16 {
        let last = self.history().versions().last();
        last.map_or(self.generation(), |version| version.generation)
    }

    /// The number of online changes before the version that ran a tick. Ticks that are missing belong to the version before
    /// them.
    pub fn generation_of(&self, tick: u64) -> u16 {
        let versions = self.history().versions();
        let found = versions.iter().rfind(|version| version.first <= tick).or(versions.first());
        found.map_or(self.generation(), |version| version.generation)
    }

    /// Goes over to the version of the program that ran a tick. The position stays as it is and may lie outside that
    /// version: the caller moves it. Gives whether another version is looked at now.
    ///
    /// # Errors
    /// When that version can't be opened.
    pub fn enter_version_of(&mut self, tick: u64) -> Result<bool, DebugError> {
        let generation = self.generation_of(tick);
        if generation == self.generation() {
            return Ok(false);
        }
        self.enter(generation)?;
        Ok(true)
    }

    /// Goes over to the next version, or with `back` to the one before. Gives that version, `None` if there is none.
    pub(super) fn enter_neighbour_version(
        &mut self,
        back: bool,
    ) -> Result<Option<Version>, DebugError> {
        let versions = self.history().versions();
        let own = self.generation();
        let at = versions.iter().position(|version| version.generation == own);
        let other = at.and_then(|at| if back { at.checked_sub(1) } else { Some(at + 1) });
        let Some(version) = other.and_then(|at| versions.get(at)).copied() else {
            return Ok(None);
        };
        self.enter(version.generation)?;
        Ok(Some(version))
    }

    fn enter(&mut self, generation: u16) -> Result<(), DebugError> {
        let open = self.session.open_version.as_ref();
        let open = open.ok_or_else(|| DebugError::new("only the last version can be looked at"))?;
        let opened = open(generation)?;
        let (may_change, control) = (self.session.may_change, self.session.control.take());
        self.session = Session { may_change, control, ..opened };
        self.session.history.interrupt_by(self.interruption.clone());
        self.interpreter = self.session.program.checked().statement_interpreter();
        self.placed = self.session.program.places().placed();
        self.trace = None;
        self.breakpoints.move_to(&self.session.program);
        let first = self.history().first();
        self.output.push(match generation {
            0 => "these ticks were run by the program as it was before the first online change"
                .to_owned(),
            _ => format!(
                "these ticks were run by the program that an online change brought in tick {first}"
            ),
        });
        Ok(())
    }
}
