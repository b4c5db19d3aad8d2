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
    /// The architecture it is for, as `std::env::consts::ARCH` has it.
    pub architecture: String,
    /// What a processor must have beyond its architecture to run it, by the names that Rust's
    /// feature detection uses.
    pub features: Vec<String>,
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

impl Code {
    /// The source line that the code at an offset belongs to.
    pub fn line_at(&self, offset: u32) -> Option<CodeLine> {
        let function = self.function_at(offset)?;
        let behind = self.lines.partition_point(|line| line.offset <= offset);
        // A line's code does not reach into the next function.
        let line = self.lines.get(behind.checked_sub(1)?)?;
        (line.offset >= function.offset).then_some(*line)
    }

    /// The function that the code at an offset belongs to.
    pub fn function_at(&self, offset: u32) -> Option<&FunctionRange> {
        let behind = self.functions.partition_point(|function| function.offset <= offset);
        let function = self.functions.get(behind.checked_sub(1)?)?;
        (offset - function.offset < function.len).then_some(function)
    }
}

#[cfg(test)]
mod tests {
    use alloc::vec;

    use super::*;

    #[test]
    fn offsets_are_found_where_there_is_code() {
        let function = |offset, len| FunctionRange { name: String::new(), offset, len };
        let line = |offset, line| CodeLine { offset, file: 0, line };
        let code = Code {
            functions: vec![function(0, 10), function(16, 8)],
            lines: vec![line(2, 1), line(5, 2), line(18, 3)],
            ..Code::default()
        };
        let cases = [(0, None), (2, Some(1)), (4, Some(1)), (9, Some(2)), (10, None), (16, None)];
        for (offset, expected) in cases.into_iter().chain([(23, Some(3)), (24, None)]) {
            assert_eq!(code.line_at(offset).map(|line| line.line), expected, "{offset}");
        }
        assert_eq!(code.function_at(23).map(|function| function.offset), Some(16));
        assert!(code.function_at(15).is_none());
    }
}
