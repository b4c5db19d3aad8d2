//! What the verifier finds.

use std::fmt;

use crate::{Block, Inst};

/// A broken rule, and where it is broken.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub struct VerifyError {
    /// The name of the function, unless the module itself is wrong.
    pub function: Option<String>,
    /// The block, unless the function itself is wrong.
    pub block: Option<Block>,
    /// The instruction, unless the block itself or its terminator is wrong.
    pub inst: Option<Inst>,
    /// What is wrong.
    pub message: String,
}

impl fmt::Display for VerifyError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(function) = &self.function {
            write!(f, "{function}, ")?;
        }
        if let Some(block) = self.block {
            write!(f, "{block}, ")?;
        }
        if let Some(inst) = self.inst {
            write!(f, "{inst}: ")?;
        }
        f.write_str(&self.message)
    }
}

/// The errors found, and the place that is being checked.
#[derive(Default)]
pub(super) struct Errors {
    pub(super) function: Option<String>,
    pub(super) block: Option<Block>,
    pub(super) inst: Option<Inst>,
    pub(super) list: Vec<VerifyError>,
}

impl Errors {
    pub(super) fn push(&mut self, message: impl Into<String>) {
        self.list.push(VerifyError {
            function: self.function.clone(),
            block: self.block,
            inst: self.inst,
            message: message.into(),
        });
    }
}
