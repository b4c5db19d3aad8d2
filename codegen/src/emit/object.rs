//! A relocatable object: ELF, for linkers and debuggers.
//!
//! `codegen/include/plcc.h` declares what it exports, and holds the loop that calls it. Names begin with
//! a prefix, so that several programs can be linked together; `plcc` is the default:
//!
//! | symbol | is |
//! | --- | --- |
//! | `plcc_code` | where the code begins; each chunk has a symbol of its own, `plcc_chunk0`… |
//! | `plcc_abi_version` | 32 bits: [`ABI_VERSION`](plcc_abi::ABI_VERSION) |
//! | `plcc_image_size` | 32 bits: bytes of the process image, which starts as zeros |
//! | `plcc_label_count`, `plcc_labels` | for each label the offset in `plcc_code` of its function, 32 bits |
//! | `plcc_task_count`, `plcc_tasks` | for each task its first label, 32 bits |
//! | `plcc_trap_site_count`, `plcc_trap_sites` | for each [`TrapSite`](plcc_abi::TrapSite) its code, file, line and array, 32 bits each; no array is 2^32 - 1 |
//! | `plcc_layout` | the [layout](super::layout()) as a text that ends with a zero |
//!
//! `.eh_frame` lets debuggers unwind through the code.
//!
//! The code has no relocations; those of the object are in `.eh_frame` and in its debug sections,
//! DWARF 5.

use std::collections::HashMap;

use gimli::SectionId;
use object::write::{
    Object, Relocation, SectionId as ObjectSection, Symbol, SymbolId, SymbolSection,
};
use object::{
    Architecture as ObjectArchitecture, BinaryFormat, Endianness, RelocationEncoding,
    RelocationFlags, RelocationKind, SectionKind, SymbolFlags, SymbolKind, SymbolScope,
};
use plcc_abi::unwind::{self, ALIGNMENT};
use plcc_abi::{ABI_VERSION, Code, Program, SourceLine};
use target_lexicon::Architecture;

use super::{ObjectOptions, dwarf, layout};
use crate::{CodegenError, Target};

/// Alignment of the code in bytes.
const CODE_ALIGNMENT: u64 = 16;

/// An object file, ELF, of code that was compiled for the target.
///
/// # Errors
/// When objects can't be made for it.
pub fn object(
    program: &Program,
    code: &Code,
    target: &Target,
    options: &ObjectOptions,
) -> Result<Vec<u8>, CodegenError> {
    let prefix = &options.prefix;
    let fail = |reason: String| CodegenError::Target { triple: target.triple(), reason };
    let mut object = Object::new(BinaryFormat::Elf, architecture(target)?, Endianness::Little);
    let first = program.files.first().map_or("", String::as_str);
    object.add_file_symbol(first.replace('\0', "?").into_bytes());
    let text = object.add_section(vec![], b".text".to_vec(), SectionKind::Text);
    object.append_section_data(text, &code.bytes, CODE_ALIGNMENT);
    let whole = SymbolPlace { section: text, offset: 0, size: 0, kind: SymbolKind::Label };
    whole.export(&mut object, &format!("{prefix}_code"));
    let functions: Vec<SymbolId> = code
        .functions
        .iter()
        .map(|function| {
            let (offset, size) = (function.offset.into(), function.len.into());
            let place = SymbolPlace { section: text, offset, size, kind: SymbolKind::Text };
            place.export(&mut object, &format!("{prefix}_{}", function.name))
        })
        .collect();
    add_unwind(&mut object, code, &functions).map_err(|error| fail(error.to_string()))?;
    add_tables(&mut object, program, code, prefix);
    // Without this note linkers take the object to need a stack that can be executed.
    object.add_section(vec![], b".note.GNU-stack".to_vec(), SectionKind::Other);
    let debug =
        dwarf::sections(program, code, options, false).map_err(|error| fail(error.to_string()))?;
    add_debug(&mut object, &debug, &functions).map_err(|error| fail(error.to_string()))?;
    object.write().map_err(|error| fail(error.to_string()))
}

/// The architecture of a target, as objects name it.
///
/// # Errors
/// When objects can't be made for it.
pub(super) fn architecture(target: &Target) -> Result<ObjectArchitecture, CodegenError> {
    match target.isa.triple().architecture {
        Architecture::X86_64 => Ok(ObjectArchitecture::X86_64),
        Architecture::Aarch64(_) => Ok(ObjectArchitecture::Aarch64),
        other => {
            let reason = format!("there are no objects for {other}");
            Err(CodegenError::Target { triple: target.triple(), reason })
        }
    }
}

/// Where a symbol is.
pub(super) struct SymbolPlace {
    pub(super) section: ObjectSection,
    pub(super) offset: u64,
    pub(super) size: u64,
    pub(super) kind: SymbolKind,
}

impl SymbolPlace {
    pub(super) fn export(self, object: &mut Object<'_>, name: &str) -> SymbolId {
        object.add_symbol(Symbol {
            name: name.as_bytes().to_vec(),
            value: self.offset,
            size: self.size,
            kind: self.kind,
            scope: SymbolScope::Linkage,
            weak: false,
            section: SymbolSection::Section(self.section),
            flags: SymbolFlags::None,
        })
    }
}

/// Adds the constants and tables that `plcc.h` declares.
fn add_tables(object: &mut Object<'_>, program: &Program, code: &Code, prefix: &str) {
    let section = object.add_section(vec![], b".rodata".to_vec(), SectionKind::ReadOnlyData);
    let mut add = |name: &str, bytes: &[u8], align: u64| {
        let offset = object.append_section_data(section, bytes, align);
        let place =
            SymbolPlace { section, offset, size: bytes.len() as u64, kind: SymbolKind::Data };
        place.export(object, &format!("{prefix}_{name}"));
    };
    let words = |words: &mut dyn Iterator<Item = u32>| -> Vec<u8> {
        words.flat_map(u32::to_le_bytes).collect()
    };
    let mut number = |name: &str, value: u32| add(name, &value.to_le_bytes(), 4);
    number("abi_version", ABI_VERSION);
    number("image_size", program.image_size);
    number("label_count", code.labels.len() as u32);
    number("task_count", program.tasks.len() as u32);
    number("trap_site_count", code.trap_sites.len() as u32);
    let sites = code.trap_sites.iter().flat_map(|site| {
        let SourceLine { file, line } = site.statement;
        [site.code as u32, file, line, site.array.unwrap_or(u32::MAX)]
    });
    add("trap_sites", &words(&mut sites.into_iter()), 4);
    add("labels", &words(&mut code.labels.iter().copied()), 4);
    add("tasks", &words(&mut program.tasks.iter().map(|task| task.entry)), 4);
    let text = layout(program).replace('\0', "?") + "\0";
    add("layout", text.as_bytes(), 1);
}

/// Adds the unwind information. The linker puts the functions' addresses in.
fn add_unwind(
    object: &mut Object<'_>,
    code: &Code,
    functions: &[SymbolId],
) -> object::write::Result<()> {
    let section = object.add_section(vec![], b".eh_frame".to_vec(), SectionKind::ReadOnlyData);
    object.append_section_data(section, &code.eh_frame, ALIGNMENT as u64);
    let flags = RelocationFlags::Generic {
        kind: RelocationKind::Relative,
        encoding: RelocationEncoding::Generic,
        size: 32,
    };
    // Code is sealed after its unwind information was checked.
    for entry in unwind::entries(&code.eh_frame, code.bytes.len()).unwrap_or_default() {
        let index = code.functions.binary_search_by_key(&entry.start, |function| function.offset);
        let Some(&symbol) = index.ok().and_then(|index| functions.get(index)) else { continue };
        let offset = entry.address_at.into();
        object.add_relocation(section, Relocation { offset, symbol, addend: 0, flags })?;
    }
    Ok(())
}

/// Adds the debug information with its relocations. `symbols` are those of the functions, and of what the
/// debug information names besides.
pub(super) fn add_debug(
    object: &mut Object<'_>,
    debug: &[(SectionId, dwarf::Section)],
    symbols: &[SymbolId],
) -> object::write::Result<()> {
    let mut ids = HashMap::new();
    for (id, section) in debug {
        let kind = match id.is_string() {
            true => SectionKind::DebugString,
            false => SectionKind::Debug,
        };
        let added = object.add_section(vec![], id.name().as_bytes().to_vec(), kind);
        object.append_section_data(added, section.bytes.slice(), 1);
        ids.insert(*id, (added, object.section_symbol(added)));
    }
    for (id, section) in debug {
        let Some(&(own, _)) = ids.get(id) else { continue };
        for relocation in &section.relocations {
            let symbol = match dwarf::target(relocation) {
                Ok(section) => ids.get(&section).map(|&(_, symbol)| symbol),
                Err(index) => symbols.get(index).copied(),
            };
            let Some(symbol) = symbol else { continue };
            let flags = RelocationFlags::Generic {
                kind: RelocationKind::Absolute,
                encoding: RelocationEncoding::Generic,
                size: relocation.size * 8,
            };
            let (offset, addend) = (relocation.offset as u64, relocation.addend);
            object.add_relocation(own, Relocation { offset, symbol, addend, flags })?;
        }
    }
    Ok(())
}
