//! What stays in effect from block to block (cnc-side 1.19).

use serde::{Deserialize, Serialize};

use crate::part_program::{Block, Feed, Motion};
use crate::setup::Setup;
use crate::way::Way;

/// At the beginning G0, G90 and no F.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Modal {
    pub(crate) motion: Motion,
    pub(crate) absolute: bool,
    pub(crate) feed: Option<Feed>,
}

impl Default for Modal {
    fn default() -> Self {
        Self { motion: Motion::Rapid, absolute: true, feed: None }
    }
}

impl Modal {
    /// Takes what a block says.
    pub(crate) fn take(&mut self, block: &Block) {
        self.motion = block.motion.unwrap_or(self.motion);
        self.absolute = block.absolute.unwrap_or(self.absolute);
        self.feed = block.feed.or(self.feed);
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
