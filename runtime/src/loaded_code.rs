//! Code where it lies in memory, and code that is made only when a scan first comes to it.

use std::sync::Arc;

use plcc_abi::{Code, CodeLine, CodeMemory, SourceLine};

use crate::mapped_code::NoMemory;
use crate::native_error::NativeError;

/// Makes the part of a program's code that seldom runs. Where a compiler is at hand, a program may start without
/// this part.
pub trait LaterCode: Send {
    /// Makes the code and puts it into memory, for the same machine and image as the part that is there. Its labels
    /// have the numbers that they have there; those without code in one part have it in the other.
    ///
    /// # Errors
    /// When no code can be made; the message is for people.
    fn make(self: Box<Self>) -> Result<(Code, Box<dyn CodeMemory>), String>;
}

/// Some code where it lies in memory.
pub(crate) struct LoadedCode {
    memory: Box<dyn CodeMemory>,
    /// Where it begins and ends.
    extent: (usize, usize),
    /// The offsets of its functions, rising.
    functions: Vec<u32>,
    /// The source line of each piece of code, to say where a scan was stopped that took too long.
    lines: Arc<Vec<CodeLine>>,
}

impl LoadedCode {
    /// Some code in memory, which holds a copy of `code.bytes` at its beginning.
    ///
    /// # Errors
    /// When the memory holds something else, or the code is for another machine.
    pub(crate) fn new(code: &Code, memory: Box<dyn CodeMemory>) -> Result<Self, NativeError> {
        let missing = crate::cpu::missing(&code.features);
        if code.architecture != std::env::consts::ARCH || !missing.is_empty() {
            let needed = std::iter::once(&code.architecture).chain(&missing);
            let needed: Vec<&str> = needed.map(String::as_str).collect();
            return Err(NativeError::Machine(needed.join(" with ")));
        }
        let bytes = memory.bytes();
        if !bytes.starts_with(&code.bytes) {
            return Err(NativeError::Misfit("the memory holds other code"));
        }
        let begin = bytes.as_ptr() as usize;
        Ok(Self {
            extent: (begin, begin + bytes.len()),
            functions: code.functions.iter().map(|function| function.offset).collect(),
            lines: Arc::clone(&code.lines),
            memory,
        })
    }

    /// The bytes where they lie.
    pub(crate) fn bytes(&self) -> &[u8] {
        self.memory.bytes()
    }

    /// Where the code begins and ends in memory.
    pub(crate) fn extent(&self) -> (usize, usize) {
        self.extent
    }

    /// Keeps the code in memory until the process ends.
    pub(crate) fn keep_memory(&mut self) {
        std::mem::forget(std::mem::replace(&mut self.memory, Box::new(NoMemory)));
    }

    /// The source line of the call from which code returns to an address; `None` if the address is not in
    /// the code, or the call belongs to no line.
    pub(crate) fn line_of_call(&self, return_address: usize) -> Option<SourceLine> {
        let (begin, end) = self.extent;
        let address = return_address.checked_sub(1).filter(|address| *address < end)?;
        let offset = u32::try_from(address.checked_sub(begin)?).ok()?;
        let functions = self.functions.partition_point(|&function| function <= offset);
        let function = self.functions.get(functions.checked_sub(1)?)?;
        let behind = self.lines.partition_point(|line| line.offset <= offset);
        let line = self.lines.get(behind.checked_sub(1)?)?;
        // A line's code does not reach into the next function.
        (line.offset >= *function).then_some(SourceLine { file: line.file, line: line.line })
    }
}
