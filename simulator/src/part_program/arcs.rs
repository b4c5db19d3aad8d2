//! What is modal while a part program is read, and the check of its arcs (SIM-9).

use super::block::{Block, Cycle, Motion};
use super::read::{Mistake, Reader, wrong};
use crate::arc::{Circle, Given, Plane};
use crate::setup::Rules;

/// By how many nanometres the two radii of an arc may differ.
const MAX_DIFFERENCE: f64 = 10_000.0;

/// What is modal and has to be known while a program is read.
#[derive(Clone, Default)]
pub(super) struct Modal {
    pub(super) motion: Option<Motion>,
    pub(super) plane: Plane,
    pub(super) relative: bool,
    pub(super) feed: bool,
    /// Where the axes are at the end of the blocks so far; nothing for a block that is entered.
    pub(super) positions: Vec<i128>,
}

impl Reader<'_> {
    /// Checks that an arc can be one.
    pub(super) fn check_arc(
        &self,
        modal: &Modal,
        motion: Option<Motion>,
    ) -> Result<(), Box<Mistake>> {
        if let Some(cycle) = self.block.cycle {
            // R of a tapping cycle is the point from where it feeds.
            let has_centre = self.block.centre.iter().any(Option::is_some);
            let has_more = has_centre || cycle == Cycle::Home && self.block.radius.is_some();
            return match self.first_arc.filter(|_| has_more) {
                Some(at) => {
                    let help = "I, J, K and R belong to G2 and G3, and R to G74 and G84";
                    wrong("SIM-2", at, "this word has no meaning in this block", help)
                }
                None => Ok(()),
            };
        }
        let place = self.first_axis.or(self.first_arc);
        let Some(at) = place.filter(|_| self.block.aux.is_none() && self.dwell.is_none()) else {
            return Ok(());
        };
        let Some(motion) = motion.filter(|motion| motion.is_arc()) else {
            return match self.first_arc {
                Some(at) => {
                    let help = "I, J, K and R belong to G2 and G3";
                    wrong("SIM-2", at, "this word has no meaning without an arc", help)
                }
                None => Ok(()),
            };
        };
        let help =
            "give the centre by I, J, K, or the radius by R; the end lies on the same circle";
        let plane = self.block.plane.unwrap_or(modal.plane);
        let has_centre = self.block.centre.iter().any(Option::is_some);
        let given = self.block.arc(plane).filter(|given| *given != Given::Radius(0));
        let Some(given) = given.filter(|_| !(has_centre && self.block.radius.is_some())) else {
            return wrong("SIM-9", at, "an arc needs its centre or its radius, and not both", help);
        };
        let axis = |letter: char| self.rules.letters.iter().position(|name| *name == Some(letter));
        let [first, second] = plane.letters();
        let Some(axes) = axis(first).zip(axis(second)) else {
            return wrong(
                "SIM-9",
                at,
                format!("there are no axes {first} and {second} for this arc"),
                help,
            );
        };
        if modal.positions.is_empty() {
            return Ok(());
        }
        let mut after = modal.clone();
        after.relative = self.block.absolute.map_or(modal.relative, |absolute| !absolute);
        after.go_to(&self.block, self.rules);
        let at_axes = |modal: &Modal| {
            let of = |axis: usize| modal.positions.get(axis).copied().unwrap_or(0);
            [of(axes.0), of(axes.1)]
        };
        let (start, end) = (at_axes(modal), at_axes(&after));
        let clockwise = motion == Motion::Clockwise;
        let circle = Circle::new([axes.0, axes.1], given, clockwise, start, end);
        let radius = circle.radius(start);
        let differs = (circle.radius(end) - radius).abs() > MAX_DIFFERENCE;
        if differs || radius == 0.0 || matches!(given, Given::Radius(_)) && start == end {
            return wrong("SIM-9", at, "this arc has no circle: its two radii differ", help);
        }
        Ok(())
    }
}

impl Modal {
    /// Moves the axes to where a block ends.
    pub(super) fn go_to(&mut self, block: &Block, rules: &Rules) {
        let goes = |position: i128, word: i128| {
            if self.relative { position.saturating_add(word) } else { word }
        };
        for &(axis, word) in &block.axes {
            let is_z = rules.letters.get(axis) == Some(&Some('Z'));
            let Some(position) = self.positions.get_mut(axis) else { continue };
            *position = match block.cycle {
                Some(Cycle::Home) => rules.homes.get(axis).copied().unwrap_or(0),
                Some(Cycle::Tap) if is_z => {
                    block.radius.map_or(*position, |radius| goes(*position, radius))
                }
                _ => goes(*position, word),
            };
        }
    }
}
