//! What only a whole line of a part program tells: words that belong together, and what is missing.

use super::arcs::Modal;
use super::block::{AuxMove, Cycle, Motion};
use super::read::{Mistake, Reader, wrong};

impl Reader<'_> {
    /// What only the whole line tells. `broken` says that the line has a mistake already, so that what is missing
    /// may stand behind it.
    pub(super) fn complete(&mut self, modal: &Modal, broken: bool) -> Result<(), Box<Mistake>> {
        if let Some(at) = self.dwell
            && let Some(axis) = self.first_axis
        {
            let what = "G4 has no axes";
            return wrong("SIM-6", at.max(axis), what, "put the axes into a block of their own");
        }
        if let Some((at, axis)) = self.aux {
            if usize::from(axis) >= self.rules.aux {
                let what = format!("there is no auxiliary axis {axis}");
                let help = "give it in the machine file: [[simulator.aux]], an entry for each axis from 0 on";
                return wrong("SIM-13", at, what, help);
            }
            let of_axis = self
                .block
                .axes
                .iter()
                .find(|(axis, _)| self.rules.letters.get(*axis) == Some(&Some('X')));
            let position = of_axis.map(|(_, x)| *x).or(self.aux_position.take().map(|(_, x)| x));
            let feed = self.block.feed.take();
            self.block.aux = Some(AuxMove { axis, position, feed });
            self.block.axes.clear();
        }
        if broken {
            return Ok(());
        }
        if let Some((at, _)) = self.aux_position {
            let help = "write a word that the control has, or give the axis in [[simulator.axis]]";
            return wrong("SIM-2", at, "this control has no axis X", help);
        }
        match (self.dwell, self.parameter) {
            (None, Some((at, _))) => {
                let help = "P is the time of G4, as in G4 P1.5";
                return wrong("SIM-2", at, "P has no meaning without G4", help);
            }
            (Some(at), None) => {
                return wrong("SIM-13", at, "G4 has no time", "give it in seconds, as in G4 P1.5");
            }
            (Some(_), Some((_, seconds))) => {
                let time = seconds.times(1_000_000_000).and_then(|time| u64::try_from(time).ok());
                self.block.dwell = Some(time.unwrap_or(u64::MAX));
            }
            (None, None) => {}
        }
        if let Some((letter, at)) =
            self.needs.iter().find(|(letter, _)| !self.seen.contains(letter)).copied()
        {
            let what = format!("this G code needs {letter}");
            let help = "give F in the block of G33, and Z in that of G74 or G84";
            return wrong("SIM-13", at, what, help);
        }
        let motion = self.block.motion.or(modal.motion);
        self.check_arc(modal, motion)?;
        let is_feed = match self.block.cycle {
            Some(cycle) => cycle == Cycle::Tap,
            None => motion.is_some_and(|motion| motion != Motion::Rapid),
        };
        if is_feed
            && !modal.feed
            && self.block.feed.is_none()
            && let (Some(at), None) = (self.first_axis.or(self.first_arc), self.block.aux)
        {
            let help = "give the feed in this block or before it, as in F200";
            return wrong("SIM-8", at, "this is a feed, and no F was given so far", help);
        }
        Ok(())
    }
}
