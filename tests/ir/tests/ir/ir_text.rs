//! The text of a function that a test generates.

use std::fmt::Write as _;

/// The lines of a function, and how many values and blocks they have.
#[derive(Default)]
pub(crate) struct IrText {
    pub(crate) text: String,
    pub(crate) values: usize,
    pub(crate) blocks: usize,
}

impl IrText {
    /// The beginning of a function whose first block is written by others.
    pub(crate) fn in_block_0() -> Self {
        Self { blocks: 1, ..Self::default() }
    }

    /// Writes an instruction; gives the number of its result.
    pub(crate) fn inst(&mut self, ty: &str, text: &str) -> usize {
        let value = self.values;
        self.values += 1;
        let _ = writeln!(self.text, "v{value}: {ty} = {text}");
        value
    }

    /// Begins the next block.
    pub(crate) fn block(&mut self) {
        let _ = writeln!(self.text, "block{}:", self.blocks);
        self.blocks += 1;
    }
}
