//! Machine code, ready to be mapped.

use alloc::{string::String, vec::Vec};

use serde::{Deserialize, Serialize};

/// A compiled program's code: one position-independent blob without relocations.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Code {
    /// The machine code.
    pub bytes: Vec<u8>,
    /// For each label the offset in `bytes` of the function to enter with it.
    pub labels: Vec<u32>,
    /// The functions, by rising offset.
    pub functions: Vec<FunctionRange>,
    /// Which source line the code from an offset on belongs to, by rising offset.
    pub lines: Vec<CodeLine>,
}

/// One compiled function.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FunctionRange {
    /// Its name in the IR.
    pub name: String,
    /// Offset of its first byte.
    pub offset: u32,
    /// Its length in bytes.
    pub len: u32,
}

/// From `offset` on, code of this source line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct CodeLine {
    /// Offset of the first byte.
    pub offset: u32,
    /// The file, an index into [`Program::files`](crate::Program::files).
    pub file: u32,
    /// The line, from 1.
    pub line: u32,
}
