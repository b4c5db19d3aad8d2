//! Whether a program's tables fit its image and its code.
//!
//! Executives and the host keep to the image whatever a table says, and the dispatcher to the
//! labels; this finds a file that was put together wrongly before it does something odd.

use plcc_abi::{Code, CodeLine, FunctionRange, Program, Region, Task};

use super::MAX_IMAGE;
use super::error::{ArtifactError, inconsistent};
use crate::control::control;

/// Nothing, or what does not fit.
pub(crate) type Check = Result<(), ArtifactError>;

/// An error that says `what` is inconsistent, unless a condition holds.
pub(crate) fn ensure(holds: bool, what: impl FnOnce() -> String) -> Check {
    if holds { Ok(()) } else { Err(inconsistent(what())) }
}

/// The process image, of which only the size is known yet.
#[derive(Clone, Copy)]
pub(crate) struct Image {
    /// Its length in bytes.
    pub(crate) size: u64,
}

impl Image {
    /// An image of `size` bytes.
    pub(crate) fn new(size: u32) -> Self {
        Self { size: size.into() }
    }

    /// Whether `length` bytes from `offset` are inside.
    pub(crate) fn holds(self, offset: u32, length: u32) -> bool {
        u64::from(offset) + u64::from(length) <= self.size
    }

    /// Refuses `what` unless its `length` bytes from `offset` are inside.
    pub(crate) fn check(self, offset: u32, length: u32, what: &str) -> Check {
        ensure(self.holds(offset, length), || format!("{what} is outside the image"))
    }
}

/// The tables against the image.
pub(super) fn program(program: &Program) -> Check {
    let Program { files, image_size, regions, tasks: _, tables } = program;
    if *image_size > MAX_IMAGE {
        return Err(ArtifactError::TooLarge {
            what: "process image",
            size: u64::from(*image_size),
            limit: u64::from(MAX_IMAGE),
        });
    }
    ensure(!files.is_empty(), || "it names no source".into())?;
    let mut end = 0;
    for Region { name, offset, size, bits: _ } in regions {
        ensure(u64::from(*offset) >= end && offset % 8 == 0, || {
            format!("its region `{name}` overlaps another")
        })?;
        end = u64::from(*offset) + u64::from(*size);
    }
    ensure(end <= u64::from(*image_size), || "its regions exceed the image".into())?;
    control(tables).validate(*image_size)
}

/// The code against the tables.
pub(super) fn code(program: &Program, code: &Code) -> Check {
    let Code { bytes, labels, functions, lines, architecture, features: _ } = code;
    ensure(!architecture.is_empty(), || "its code is for no architecture".into())?;
    let length = bytes.len() as u64;
    let mut end = 0;
    for FunctionRange { name, offset, len } in functions {
        let start = u64::from(*offset);
        ensure(*len > 0 && start >= end, || format!("its function `{name}` overlaps another"))?;
        end = start + u64::from(*len);
    }
    ensure(end <= length, || "its functions exceed its code".into())?;
    for label in labels {
        let found = functions.binary_search_by_key(label, |function| function.offset);
        ensure(found.is_ok(), || "one of its labels is at no function".into())?;
    }
    for Task { name, entry } in &program.tasks {
        ensure((*entry as usize) < labels.len(), || format!("its task `{name}` starts nowhere"))?;
    }
    let mut last = 0;
    for &CodeLine { offset, file, line } in lines {
        let fits = offset >= last
            && u64::from(offset) < length
            && (file as usize) < program.files.len()
            && line > 0;
        ensure(fits, || "its line table does not fit".into())?;
        last = offset;
    }
    Ok(())
}
