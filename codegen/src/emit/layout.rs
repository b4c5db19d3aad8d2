//! The process image's layout as text.

use std::fmt::Write as _;

use plcc_abi::nct::{NctHome, NctName, NctTables};
use plcc_abi::pmac::{Kind, Layout, PmacTables};
use plcc_abi::pmi::PmiTables;
use plcc_abi::{ABI_VERSION, Program, Tables};

/// Where a program's state stands in its image, a line each, offsets and sizes in bytes:
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
    let Program { files: _, image_size, regions, tasks, tables } = program;
    let dialect = program.dialect().name();
    let mut out = format!("plcc {ABI_VERSION} image {image_size} dialect {dialect}\n");
    for task in tasks {
        let _ = writeln!(out, "task {} {}", task.name, task.entry);
    }
    for region in regions {
        let _ = writeln!(out, "region {} {} {}", region.name, region.offset, region.size);
    }
    match tables {
        Tables::Pmi(tables) => pmi(&mut out, tables),
        Tables::Nct(tables) => nct(&mut out, tables),
        Tables::Pmac(tables) => pmac(&mut out, tables),
    }
    out
}

fn variable(out: &mut String, name: &str, ty: &str, offset: u32, elements: u32) {
    let _ = writeln!(out, "variable {name} {ty} {offset} {elements}");
}

fn pmi(out: &mut String, tables: &PmiTables) {
    use plcc_abi::pmi::Type;
    for symbol in &tables.symbols {
        let ty = match symbol.ty {
            Type::Logical => "logical",
            Type::Integer => "integer",
            Type::Long => "long",
        };
        variable(out, &symbol.name, ty, symbol.offset, symbol.elements.unwrap_or(1));
    }
}

/// The bytes that the program names; registers stand in regions of their own.
fn nct(out: &mut String, tables: &NctTables) {
    let mut last = String::new();
    for &name in &tables.named {
        let (homes, letter, byte) = match name {
            NctName::I { byte, .. } => (&tables.inputs, "I", usize::from(byte)),
            NctName::Y { byte, .. } => (&tables.outputs, "Y", usize::from(byte)),
            NctName::F { byte, .. } => (&tables.flags, "F", usize::from(byte)),
            _ => continue,
        };
        let width = if letter == "F" { 3 } else { 2 };
        // A word is two bytes.
        let count = if name.to_string().len() == width + 1 { 2 } else { 1 };
        for number in byte..byte + count {
            let Some(&NctHome { offset, unpacked }) = homes.get(number) else { continue };
            let name = format!("{letter}{number:0width$}");
            if name != last {
                variable(out, &name, if unpacked { "bits" } else { "byte" }, offset, 1);
                last = name;
            }
        }
    }
}

/// P, Q and I; what an M is depends on its definition.
fn pmac(out: &mut String, tables: &PmacTables) {
    let layout = Layout::new(tables.turbo);
    for named in &tables.named {
        let number = named.number;
        let (name, offset) = match named.kind {
            Kind::P => (format!("P{number}"), layout.p_offset(number)),
            Kind::I => (format!("I{number}"), layout.i_offset(number)),
            Kind::Q => {
                let offset = layout.q_offset(layout.q_base_of(named.system) + number);
                (format!("&{}Q{number}", named.system), offset)
            }
            Kind::L | Kind::M => continue,
        };
        variable(out, &name, "double", offset, 1);
    }
}
