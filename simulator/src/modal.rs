//! What stays in effect from block to block (cnc-side 1.19).

use serde::{Deserialize, Serialize};

use crate::arc::{Circle, Plane};
use crate::part_program::{Block, Feed, Motion};
use crate::setup::Setup;
use crate::way::Way;

/// At the beginning G0, G90 and no F.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Modal {
    pub(crate) motion: Motion,
    pub(crate) plane: Plane,
    pub(crate) absolute: bool,
    pub(crate) feed: Option<Feed>,
}

impl Default for Modal {
    fn default() -> Self {
        Self { motion: Motion::Rapid, plane: Plane::default(), absolute: true, feed: None }
    }
}

impl Modal {
    /// Takes what a block says.
    pub(crate) fn take(&mut self, block: &Block) {
        self.motion = block.motion.unwrap_or(self.motion);
        self.plane = block.plane.unwrap_or(self.plane);
        self.absolute = block.absolute.unwrap_or(self.absolute);
        self.feed = block.feed.or(self.feed);
    }

    /// The speed of its way; `None` in rapid traverse.
    pub(crate) fn speed(&self, setup: &Setup) -> Option<Feed> {
        match self.motion {
            Motion::Rapid => None,
            _ => Some(self.feed.unwrap_or(setup.feed_max)),
        }
    }

    /// The circle of a block's arc from `from` to `end`, if it is one.
    pub(crate) fn circle(
        &self,
        block: &Block,
        letters: &[Option<char>],
        from: &[i128],
        end: &[i128],
    ) -> Option<Circle> {
        let given = block.arc(self.plane).filter(|_| self.motion.is_arc())?;
        let axis = |letter: char| letters.iter().position(|name| *name == Some(letter));
        let [first, second] = self.plane.letters();
        let axes = [axis(first)?, axis(second)?];
        let at = |positions: &[i128]| axes.map(|axis| positions.get(axis).copied().unwrap_or(0));
        let clockwise = self.motion == Motion::Clockwise;
        Some(Circle::new(axes, given, clockwise, at(from), at(end)))
    }

    /// Changes the positions that a block names to those where it ends.
    pub(crate) fn target(&self, block: &Block, positions: &mut [i128]) {
        for &(axis, word) in &block.axes {
            if let Some(position) = positions.get_mut(axis) {
                *position = if self.absolute { word } else { position.saturating_add(word) };
            }
        }
    }
}

impl Way {
    /// Begins a way at a feed, or in rapid traverse with the speeds of the table.
    pub(crate) fn begin_for(
        &mut self,
        from: &[i128],
        end: &[i128],
        feed: Option<Feed>,
        setup: &Setup,
    ) {
        self.begin(from, end, feed, setup.axes.iter().map(|axis| axis.rapid));
    }
}
