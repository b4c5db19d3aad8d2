//! Executable memory for code that is run where it was compiled (`--engine jit`), by cranelift-jit.
//!
//! Its [`ArenaMemoryProvider`] protects the pages, makes the instruction caches coherent and
//! flushes the pipelines of all processors. The rest of the crate is not used: `JITModule` wants
//! code with relocations and keeps its memory until the process ends, while [`JitMemory`] gives it
//! back when it is dropped, so that a process may compile any number of programs.
#![allow(unsafe_code)]

use std::panic::{AssertUnwindSafe, catch_unwind};

use cranelift_jit::{ArenaMemoryProvider, BranchProtection, JITMemoryKind, JITMemoryProvider};
use plcc_abi::{Code, CodeMemory};

use crate::CodegenError;
use crate::error::panic_text;

/// Functions of the code begin at multiples of this, in bytes.
const ALIGNMENT: u64 = 16;

/// A copy of some code in an arena of its own, which can be executed and not written.
pub struct JitMemory {
    arena: ArenaMemoryProvider,
    /// Where the code lies in the arena.
    start: *const u8,
    len: usize,
}

// SAFETY: the arena may be used by any thread, and `start` points into it; nothing changes the
// bytes there after `new`.
unsafe impl Send for JitMemory {}

impl JitMemory {
    /// Copies some code into executable memory.
    ///
    /// # Errors
    /// [`CodegenError::Memory`] when the system gives no memory, or does not let it be executed.
    pub fn new(code: &Code) -> Result<Self, CodegenError> {
        let fail = |reason: String| CodegenError::Memory { reason };
        let len = code.bytes.len();
        let arena = ArenaMemoryProvider::new_with_size(len.max(1));
        let mut memory = Self {
            arena: arena.map_err(|error| fail(error.to_string()))?,
            start: std::ptr::dangling(),
            len,
        };
        let arena = &mut memory.arena;
        // Both steps panic where the system refuses to change the pages' protection. After a panic
        // the arena is not used again, only freed, which it can be in any state.
        let room = guard(|| arena.allocate(len.max(1), ALIGNMENT, JITMemoryKind::Executable))?;
        let room = room.map_err(|error| fail(error.to_string()))?;
        // SAFETY: the arena has given out `len` bytes, to nobody else, which can be written until
        // they are finalised; the code's bytes lie elsewhere.
        unsafe { room.copy_from_nonoverlapping(code.bytes.as_ptr(), len) };
        let done =
            guard(|| arena.finalize(BranchProtection::None).map_err(|error| error.to_string()))?;
        done.map_err(fail)?;
        memory.start = room;
        Ok(memory)
    }
}

/// Runs a step and makes an error of a panic in it.
fn guard<T>(step: impl FnOnce() -> T) -> Result<T, CodegenError> {
    catch_unwind(AssertUnwindSafe(step))
        .map_err(|payload| CodegenError::Memory { reason: one_line(panic_text(&*payload)) })
}

/// A panic's text in one line. cranelift-jit panics with an error whose text has several lines: its
/// causes, and where `RUST_BACKTRACE` is set a backtrace, which is left out.
fn one_line(text: &str) -> String {
    let lines = text.lines().map(str::trim).take_while(|line| *line != "Stack backtrace:");
    lines.filter(|line| !line.is_empty()).collect::<Vec<_>>().join(" ")
}

impl Drop for JitMemory {
    fn drop(&mut self) {
        // SAFETY: a value that is being dropped is borrowed by nobody, so nobody reads or executes
        // the memory: whoever runs code keeps the value (see `CodeMemory`).
        unsafe { self.arena.free_memory() };
    }
}

// SAFETY: the arena's pages stay where they are until it is freed in `drop`; finalised, they can
// be executed and not written, and cranelift-jit has made the caches coherent and flushed the
// pipelines.
unsafe impl CodeMemory for JitMemory {
    fn bytes(&self) -> &[u8] {
        // SAFETY: `start` and `len` are those of the copy, which can be read and is not changed
        // as long as `self` lives.
        unsafe { std::slice::from_raw_parts(self.start, self.len) }
    }
}

#[cfg(test)]
mod tests {
    use plcc_abi::CodeMemory as _;
    use plcc_ir::ChunkBuilder;

    use super::{JitMemory, guard};
    use crate::{CodegenError, CodegenOptions, Target};

    /// The permissions of the page at an address, as Linux shows them: `r-xp`.
    #[cfg(target_os = "linux")]
    fn permissions(address: usize) -> Option<String> {
        let maps = std::fs::read_to_string("/proc/self/maps").ok()?;
        maps.lines().find_map(|line| {
            let (range, rest) = line.split_once(' ')?;
            let (from, to) = range.split_once('-')?;
            let ends = [from, to].map(|end| usize::from_str_radix(end, 16).unwrap_or(0));
            (ends[0]..ends[1]).contains(&address).then(|| rest[..4].to_owned())
        })
    }

    #[test]
    fn code_is_mapped_executable_until_it_is_dropped() {
        let mut b = ChunkBuilder::new(8, vec![]);
        let start = b.place();
        b.bind(start);
        b.task("t", start);
        b.ret();
        let code =
            crate::compile(&b.finish(), &Target::host().unwrap(), CodegenOptions::NONE).unwrap();
        let memory = JitMemory::new(&code).unwrap();
        let memory = Box::new(memory);
        assert_eq!(memory.bytes(), code.bytes);
        #[cfg(target_os = "linux")]
        {
            let address = memory.bytes().as_ptr() as usize;
            assert_eq!(permissions(address).as_deref(), Some("r-xp"));
        }
    }

    #[test]
    fn a_message_is_one_line_without_backtrace() {
        let text =
            "no rights: Backend(failed\n\nCaused by:\n    denied\n\nStack backtrace:\n 0: x)";
        let error = guard(|| -> () { panic!("{text}") });
        let reason = "no rights: Backend(failed Caused by: denied";
        assert!(matches!(error, Err(CodegenError::Memory { reason: r }) if r == reason));
    }

    #[test]
    fn a_panic_of_the_arena_is_an_error() {
        let texts = [guard(|| -> () { panic!("no {}", 1) }), guard(|| -> () { panic!("no 1") })];
        for text in texts {
            assert!(matches!(text, Err(CodegenError::Memory { reason }) if reason == "no 1"));
        }
    }
}
