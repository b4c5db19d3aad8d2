//! The debug part of an artifact: an ELF file that tells a debugger what it needs of code that another
//! program has loaded: symbols, lines, unwind information, the type of the image, and the variable `context`.
//! The code itself is in the program's memory and not in this file.
//!
//! Its allocated sections have the addresses that they would have if the code began at 0. Whoever has loaded
//! the code adds its address (the table in `runtime/src/gdb/mod.rs` says to what), and debuggers apply
//! the relocations of the debug sections, as they do for any relocatable object.

use object::elf::{
    SHF_ALLOC, SHF_EXECINSTR, SHF_WRITE, SHT_NOBITS, SHT_PROGBITS, SectionFlags as Flags,
};
use object::write::{Object, SectionId};
use object::{BinaryFormat, Endianness, SectionFlags, SectionKind, SymbolKind};
use plcc_abi::unwind::ALIGNMENT;
use plcc_abi::{Code, Program};

use super::ObjectOptions;
use super::object::{SymbolPlace, add_debug, architecture};
use super::{dwarf, scan_context};
use crate::{CodegenError, Target};

/// Where an ELF file's header has the offset of the sections' headers, how long one of those is, and where
/// it has the section's flags and address.
const SECTIONS: usize = 0x28;
const SECTION_HEADER: usize = 64;
const FLAGS: usize = 8;
const ADDRESS: usize = 16;

/// The debug part for code that was compiled for the target. The prefix in `options` is before the names of
/// functions, and the image's type is called `struct {prefix}_image`.
///
/// # Errors
/// When objects can't be made for the target.
pub fn debug_object(
    program: &Program,
    code: &Code,
    target: &Target,
    options: &ObjectOptions,
) -> Result<Vec<u8>, CodegenError> {
    let fail = |reason: String| CodegenError::Target { triple: target.triple(), reason };
    let mut object = Object::new(BinaryFormat::Elf, architecture(target)?, Endianness::Little);
    let text = section(&mut object, ".text", SHF_ALLOC | SHF_EXECINSTR, None);
    object.append_section_bss(text, code.bytes.len() as u64, 1);
    section(&mut object, ".eh_frame", SHF_ALLOC, Some(&code.eh_frame));
    let context = section(&mut object, scan_context::SECTION, SHF_ALLOC | SHF_WRITE, None);
    object.append_section_bss(context, 8, 8);
    let mut symbols: Vec<_> = code
        .functions
        .iter()
        .map(|function| {
            let (offset, size) = (function.offset.into(), function.len.into());
            let place = SymbolPlace { section: text, offset, size, kind: SymbolKind::Text };
            place.export(&mut object, &format!("{}_{}", options.prefix, function.name))
        })
        .collect();
    symbols.push(object.section_symbol(context));
    let debug = dwarf::sections(program, code, options, true);
    let debug = debug.map_err(|error| fail(error.to_string()))?;
    add_debug(&mut object, &debug, &symbols).map_err(|error| fail(error.to_string()))?;
    let mut file = object.write().map_err(|error| fail(error.to_string()))?;
    let base = code.bytes.len().next_multiple_of(ALIGNMENT) as u64;
    set_address_of_unwind_information(&mut file, base)
        .ok_or_else(|| CodegenError::internal("the debug part has no unwind information"))?;
    Ok(file)
}

/// Adds a section with these flags and, if it has any, bytes.
fn section(object: &mut Object<'_>, name: &str, flags: Flags, bytes: Option<&[u8]>) -> SectionId {
    let (kind, sh_type) = match bytes {
        Some(_) => (SectionKind::ReadOnlyData, SHT_PROGBITS),
        None => (SectionKind::UninitializedData, SHT_NOBITS),
    };
    let added = object.add_section(vec![], name.as_bytes().to_vec(), kind);
    if let Some(bytes) = bytes {
        object.append_section_data(added, bytes, ALIGNMENT as u64);
    }
    object.section_mut(added).flags = SectionFlags::Elf { sh_type, sh_flags: flags };
    added
}

/// Sets the address of `.eh_frame`, the only section that is allocated and neither executed nor written;
/// `None` if there is none. (The writer of relocatable objects sets no addresses.)
fn set_address_of_unwind_information(file: &mut [u8], address: u64) -> Option<()> {
    let word = |file: &[u8], at: usize| -> Option<u64> {
        Some(u64::from_le_bytes(*file.get(at..)?.first_chunk()?))
    };
    let mut header = usize::try_from(word(file, SECTIONS)?).ok()?;
    while word(file, header + FLAGS)? != SHF_ALLOC.0 {
        header += SECTION_HEADER;
    }
    *file.get_mut(header + ADDRESS..)?.first_chunk_mut()? = address.to_le_bytes();
    Some(())
}
