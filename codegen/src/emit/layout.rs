//! The process image's layout as text.

use std::fmt::Write as _;

use plcc_abi::{ABI_VERSION, Program};

/// Where a program's state lies in its image, as text. Offsets and sizes are in bytes, a task's
/// label is its number, and an array has more than one element:
///
/// ```text
/// plcc VERSION image SIZE dialect NAME
/// task NAME LABEL
/// region NAME OFFSET SIZE
/// variable NAME TYPE OFFSET ELEMENTS
/// ```
///
/// Types are `logical` (a byte of 0 or 1), `integer` (16 bits), `long` (32 bits), `double`, `byte`,
/// and `bits` (eight bytes of 0 or 1, the lowest bit first), all little endian.
pub fn layout(program: &Program) -> String {
    let Program { files: _, image_size, regions, tasks, tables, names: _ } = program;
    let dialect = program.dialect().name();
    let mut out = format!("plcc {ABI_VERSION} image {image_size} dialect {dialect}\n");
    for task in tasks {
        let _ = writeln!(out, "task {} {}", task.name, task.entry);
    }
    for region in regions {
        let _ = writeln!(out, "region {} {} {}", region.name, region.offset, region.size);
    }
    for symbol in tables.symbols() {
        let (name, ty) = (&symbol.name, symbol.ty.name());
        let _ = writeln!(out, "variable {name} {ty} {} {}", symbol.offset, symbol.elements);
    }
    out
}
