//! Checks that a program's tables fit its image and its code.
//!
//! They are not needed for memory safety: executives and hosts check each access to the image, and
//! the engine each label. They refuse a file that was put together wrongly before it is run.

use plcc_abi::{CodeParts, Program, Region, Task};

use super::MAX_IMAGE;
use super::error::{ArtifactError, inconsistent};
use plcc_runtime::table_check::{Check, ensure};
use plcc_runtime::validate;

/// Checks the tables against the image.
pub(super) fn program(program: &Program) -> Result<(), ArtifactError> {
    if program.image_size > MAX_IMAGE {
        return Err(ArtifactError::TooLarge {
            what: "process image",
            size: u64::from(program.image_size),
            limit: u64::from(MAX_IMAGE),
        });
    }
    regions(program).and_then(|()| validate(program)).map_err(inconsistent)
}

/// Checks that the program has sources, and that its regions follow each other inside the image.
fn regions(program: &Program) -> Check {
    let Program { files, image_size, regions, tasks: _, tables: _, names: _ } = program;
    ensure(!files.is_empty(), || "it names no source".into())?;
    let mut end = 0;
    for Region { name, offset, size, bits: _ } in regions {
        ensure(u64::from(*offset) >= end && offset % 8 == 0, || {
            format!("its region `{name}` overlaps another")
        })?;
        end = u64::from(*offset) + u64::from(*size);
    }
    ensure(end <= u64::from(*image_size), || "its regions exceed the image".into())
}

/// Checks the code's tables against the code and against the program.
pub(super) fn code(program: &Program, code: &CodeParts) -> Result<(), ArtifactError> {
    code_tables(program, code).map_err(inconsistent)
}

fn code_tables(program: &Program, code: &CodeParts) -> Check {
    code.check().map_err(|error| error.to_string())?;
    ensure(code.is_complete(), || "it lacks the code of a label".into())?;
    ensure(code.image_size == program.image_size, || {
        "its code is for a process image of another size".into()
    })?;
    for Task { name, entry, resume_points } in &program.tasks {
        let known = (*entry as usize) < code.labels.len();
        ensure(known, || format!("its task `{name}` starts nowhere"))?;
        let known = resume_points.iter().all(|&label| (label as usize) < code.labels.len());
        ensure(known, || format!("its task `{name}` goes on nowhere"))?;
    }
    let exists = |file: u32| (file as usize) < program.files.len();
    ensure(code.lines.iter().all(|line| exists(line.file)), || {
        "its line table names a file that is not there".into()
    })?;
    ensure(code.label_lines.iter().flatten().all(|line| exists(line.file)), || {
        "a label is in a file that is not there".into()
    })?;
    ensure(code.trap_sites.iter().all(|site| exists(site.statement.file)), || {
        "a place at which it may be stopped is in a file that is not there".into()
    })
}
