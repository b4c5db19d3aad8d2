//! Machine code that may be executed.
//!
//! [`CodeParts`] is plain data: bytes and the tables that describe them. Any code can make such a
//! value, but nothing runs it. [`Code`] is the same, sealed: it can only be made by the `unsafe`
//! [`Code::seal`], whose caller vouches for the bytes, and nothing in it can be changed afterwards.
//! So whatever takes a [`Code`] may run it without being `unsafe` itself. Two places seal: code
//! generation, and the artifact reader after its checks.
//!
//! [`CodeMemory`] is memory in which code lies ready to be executed.
#![allow(unsafe_code)]

use alloc::{format, string::String, sync::Arc, vec::Vec};
use core::fmt;
use core::ops::Deref;

use serde::{Deserialize, Serialize};

use crate::function_marker;
use crate::unwind::{self, UnwindEntry};
use crate::{SourceLine, TrapSite};

/// A compiled program's code and its tables: one position-independent blob without relocations.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct CodeParts {
    /// The machine code.
    pub bytes: Vec<u8>,
    /// For each label, by its number, the offset in `bytes` of the function that has it. The
    /// function is called with the label's number. It is [`NO_CODE`](Self::NO_CODE) if the function is not part of
    /// this code, which then is not [complete](Self::is_complete).
    pub labels: Vec<u32>,
    /// For each label, by its number, the line of the statement that begins there, for messages about a
    /// scan that was stopped before it. Where it is not known there is none; the list may be shorter
    /// than that of the labels. An engine shares this table, `lines` and `trap_sites` with the code.
    pub label_lines: Arc<Vec<Option<SourceLine>>>,
    /// The functions, by rising offset.
    pub functions: Vec<FunctionRange>,
    /// Which source line the code from an offset on belongs to, by rising offset.
    pub lines: Arc<Vec<CodeLine>>,
    /// The places at which the program may be stopped; code returns their numbers.
    pub trap_sites: Arc<Vec<TrapSite>>,
    /// The architecture it is for, as `std::env::consts::ARCH` has it.
    pub architecture: String,
    /// The extensions of the instruction set that the processor must have, by the names that Rust's
    /// feature detection uses (`sse4.1`).
    pub features: Vec<String>,
    /// Bytes of the process image that the code may access, from its beginning.
    pub image_size: u32,
    /// The [unwind information](crate::unwind) of the functions; may be empty.
    pub eh_frame: Vec<u8>,
}

/// One compiled function.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FunctionRange {
    /// Its name in the IR.
    pub name: String,
    /// Offset of its first byte in the code.
    pub offset: u32,
    /// Its length in bytes.
    pub len: u32,
}

/// An entry of the line table: from `offset` to the next entry, or to the end of the function, the
/// code belongs to this source line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct CodeLine {
    /// Offset of the first byte in the code.
    pub offset: u32,
    /// The file, an index into [`Program::files`](crate::Program::files).
    pub file: u32,
    /// The line, from 1.
    pub line: u32,
}

/// The tables of some code contradict each other or its bytes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CodeError(String);

impl fmt::Display for CodeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl core::error::Error for CodeError {}

impl CodeParts {
    /// What is in [`labels`](Self::labels) for a label whose function is not part of this code.
    pub const NO_CODE: u32 = u32::MAX;

    /// Whether the function of every label is part of this code. A compiler that compiles just in time may make the
    /// functions that seldom run only when they are needed; an artifact holds them all.
    pub fn is_complete(&self) -> bool {
        !self.labels.contains(&Self::NO_CODE)
    }

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

    /// Whether the tables fit the bytes and each other: functions lie in the code one after the
    /// other and are not empty, each has its [marker](function_marker) in front of it, every label's
    /// offset is that of a function or [`NO_CODE`](Self::NO_CODE), lines are sorted and lie in the code, and unwind information is
    /// about functions.
    ///
    /// # Errors
    /// The first thing that does not fit.
    pub fn check(&self) -> Result<(), CodeError> {
        let ensure = |holds: bool, what: &dyn Fn() -> String| {
            if holds { Ok(()) } else { Err(CodeError(what())) }
        };
        ensure(!self.architecture.is_empty(), &|| "the code is for no architecture".into())?;
        let length = self.bytes.len() as u64;
        let mut end = 0;
        for FunctionRange { name, offset, len } in &self.functions {
            let start = u64::from(*offset);
            ensure(*len > 0 && start >= end, &|| format!("function `{name}` overlaps another"))?;
            end = start + u64::from(*len);
        }
        ensure(end <= length && length < u64::from(Self::NO_CODE), &|| {
            "the functions exceed the code".into()
        })?;
        for label in self.labels.iter().filter(|&&label| label != Self::NO_CODE) {
            let found = self.functions.binary_search_by_key(label, |function| function.offset);
            ensure(found.is_ok(), &|| "a label is at no function".into())?;
        }
        ensure(self.label_lines.len() <= self.labels.len(), &|| {
            "a line is that of no label".into()
        })?;
        ensure(function_marker::are_right(self), &|| {
            "the code does not belong to its tables".into()
        })?;
        let mut last = 0;
        for &CodeLine { offset, file: _, line } in self.lines.iter() {
            let fits = offset >= last && u64::from(offset) < length && line > 0;
            ensure(fits, &|| "the line table does not fit the code".into())?;
            last = offset;
        }
        let entries = unwind::entries(&self.eh_frame, self.bytes.len());
        let known = |entry: &UnwindEntry| {
            let at = self.functions.binary_search_by_key(&entry.start, |function| function.offset);
            let function = at.ok().and_then(|at| self.functions.get(at));
            function.is_some_and(|function| function.len == entry.len)
        };
        ensure(entries.is_some_and(|entries| entries.iter().all(known)), &|| {
            "the unwind information does not fit the functions".into()
        })
    }
}

/// Code that may be executed. Its parts can be read (it dereferences to them), not changed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Code(CodeParts);

impl Code {
    /// Makes code of its parts.
    ///
    /// # Errors
    /// When the tables do not fit, see [`CodeParts::check`].
    ///
    /// # Safety
    /// Every function of `parts.functions` is machine code for `parts.architecture` (with
    /// `parts.features`) that can be called as a [`ChunkFn`](crate::context::ChunkFn) with a valid
    /// context and any label. It works at whatever address the bytes lie. Called so, it accesses
    /// no memory but its stack, its own constants, the context, the first `parts.image_size` bytes of
    /// the context's image, and the context's epoch, which it only reads; it calls nothing but the
    /// context's host function; and it leaves by returning.
    pub unsafe fn seal(parts: CodeParts) -> Result<Self, CodeError> {
        parts.check()?;
        Ok(Self(parts))
    }
}

impl Deref for Code {
    type Target = CodeParts;

    fn deref(&self) -> &CodeParts {
        &self.0
    }
}

/// Memory in which machine code lies ready to be executed. It is given back when the value is
/// dropped, so whoever runs the code keeps the value as long as a scan can be in it.
///
/// # Safety
/// [`bytes`](Self::bytes) gives the same address and length as long as the value lives, also when
/// it is moved. The bytes there are never written again and may be executed, and every thread of
/// the process that does so sees them as they are: where the architecture needs it, the
/// instruction caches were made coherent and the pipelines of all processors flushed before the
/// value came into being.
pub unsafe trait CodeMemory: Send {
    /// The bytes where they lie.
    fn bytes(&self) -> &[u8];
}

#[cfg(test)]
mod tests {
    use alloc::vec;

    use super::*;

    fn function(offset: u32, len: u32) -> FunctionRange {
        FunctionRange { name: String::new(), offset, len }
    }

    fn line(offset: u32, line: u32) -> CodeLine {
        CodeLine { offset, file: 0, line }
    }

    fn parts() -> CodeParts {
        let mut parts = CodeParts {
            bytes: vec![0; 72],
            labels: vec![64, 16, 64],
            functions: vec![function(16, 10), function(64, 8)],
            lines: Arc::new(vec![line(18, 1), line(21, 2), line(66, 3)]),
            architecture: "pdp11".into(),
            image_size: 8,
            ..CodeParts::default()
        };
        function_marker::write(&mut parts);
        parts
    }

    #[test]
    fn lines_and_functions_are_found_only_for_offsets_inside_code() {
        let code = parts();
        let cases =
            [(16, None), (18, Some(1)), (20, Some(1)), (25, Some(2)), (26, None), (64, None)];
        for (offset, expected) in cases.into_iter().chain([(71, Some(3)), (72, None)]) {
            assert_eq!(code.line_at(offset).map(|line| line.line), expected, "{offset}");
        }
        assert_eq!(code.function_at(71).map(|function| function.offset), Some(64));
        assert!(code.function_at(63).is_none());
    }

    #[test]
    fn tables_that_do_not_fit_the_code_are_refused() {
        assert_eq!(parts().check(), Ok(()));
        let changes: [fn(&mut CodeParts); 20] = [
            |parts| parts.architecture.clear(),
            |parts| parts.bytes.truncate(71),
            |parts| parts.labels[0] = 1,
            |parts| parts.labels[0] = 72,
            |parts| parts.labels[0] = 16,
            |parts| parts.labels.swap(0, 1),
            |parts| parts.labels.truncate(2),
            |parts| parts.label_lines = Arc::new(vec![None; 4]),
            |parts| parts.image_size = 4,
            |parts| parts.functions.clear(),
            |parts| parts.functions.swap(0, 1),
            |parts| parts.functions[0].len = 9,
            |parts| parts.functions[0].len = 49,
            |parts| parts.functions[1].len = 0,
            |parts| parts.functions[1].len = u32::MAX,
            |parts| parts.functions[0].offset = 0,
            |parts| Arc::make_mut(&mut parts.lines)[2].offset = 72,
            |parts| Arc::make_mut(&mut parts.lines)[1].line = 0,
            |parts| Arc::make_mut(&mut parts.lines).swap(0, 1),
            |parts| parts.eh_frame = vec![0; 8],
        ];
        for (number, change) in changes.iter().enumerate() {
            let mut changed = parts();
            change(&mut changed);
            assert!(changed.check().is_err(), "change {number}");
        }
    }
}
