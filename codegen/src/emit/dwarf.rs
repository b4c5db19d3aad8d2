//! Debug information, DWARF 5: the functions, the source line of each instruction, the
//! [type of the image](super::image_type), and in an artifact the [scan context](super::scan_context).

use std::collections::HashSet;
use std::ops::Range;

use gimli::write::{
    Address, AttributeValue, DwarfUnit, EndianVec, FileId, LineProgram, LineString, RelocateWriter,
    Relocation, RelocationTarget, Sections,
};
use gimli::{
    DW_AT_comp_dir, DW_AT_decl_file, DW_AT_decl_line, DW_AT_external, DW_AT_high_pc,
    DW_AT_language, DW_AT_low_pc, DW_AT_name, DW_AT_producer, DW_AT_stmt_list, DW_LANG_C99,
    DW_TAG_label, DW_TAG_lexical_block, DW_TAG_subprogram, Encoding, Format, LineEncoding,
    RunTimeEndian, SectionId,
};
use plcc_abi::{Code, CodeLine, Program};

use super::{ObjectOptions, image_type, scan_context};

/// A section's bytes, and the relocations that the linker has to apply to them.
#[derive(Clone)]
pub(super) struct Section {
    pub(super) bytes: EndianVec<RunTimeEndian>,
    pub(super) relocations: Vec<Relocation>,
}

impl RelocateWriter for Section {
    type Writer = EndianVec<RunTimeEndian>;

    fn writer(&self) -> &Self::Writer {
        &self.bytes
    }

    fn writer_mut(&mut self) -> &mut Self::Writer {
        &mut self.bytes
    }

    fn relocate(&mut self, relocation: Relocation) {
        self.relocations.push(relocation);
    }
}

/// The debug sections of a program's code. Addresses refer to functions by their index, in
/// [`RelocationTarget::Symbol`]; with `context` there is the variable `context` too, whose section has the
/// index after those of the functions.
pub(super) fn sections(
    program: &Program,
    code: &Code,
    options: &ObjectOptions,
    context: bool,
) -> gimli::write::Result<Vec<(SectionId, Section)>> {
    let encoding = Encoding { format: Format::Dwarf32, version: 5, address_size: 8 };
    let mut dwarf = DwarfUnit::new(encoding);
    let string = |dwarf: &mut DwarfUnit, text: &str| {
        // In DWARF a name must not be empty, and ends at its first zero.
        let text = if text.is_empty() { "?".to_owned() } else { text.replace('\0', "?") };
        LineString::new(text, encoding, &mut dwarf.line_strings)
    };
    let first = program.files.first().map_or("", String::as_str);
    let mapped_folder = options.mapped(&options.folder);
    let (folder, name) =
        (string(&mut dwarf, &mapped_folder), string(&mut dwarf, &options.mapped(first)));
    let line_encoding = LineEncoding::default();
    let mut lines = LineProgram::new(encoding, line_encoding, folder, None, name, None);
    let directory = lines.default_directory();
    let files: Vec<FileId> = program
        .files
        .iter()
        .map(|name| lines.add_file(string(&mut dwarf, &options.mapped(name)), directory, None))
        .collect();
    let root = dwarf.unit.root();
    let mut attributes = vec![
        (DW_AT_producer, text("plcc")),
        (DW_AT_language, AttributeValue::Language(DW_LANG_C99)),
        (DW_AT_name, text(&options.mapped(first))),
        (DW_AT_comp_dir, text(&mapped_folder)),
        (DW_AT_stmt_list, AttributeValue::LineProgramRef),
    ];
    if let (Some(start), Some(last)) = (code.functions.first(), code.functions.last()) {
        let length = u64::from(last.offset - start.offset) + u64::from(last.len);
        attributes.push((DW_AT_low_pc, address(0)));
        attributes.push((DW_AT_high_pc, AttributeValue::Udata(length)));
    }
    for (name, value) in attributes {
        dwarf.unit.get_mut(root).set(name, value);
    }
    for (index, function) in code.functions.iter().enumerate() {
        let from = code.lines.partition_point(|line| line.offset < function.offset);
        let to = code.lines.partition_point(|line| line.offset < function.offset + function.len);
        let rows = code.lines.get(from..to).unwrap_or_default();
        let function_entry = dwarf.unit.add(root, DW_TAG_subprogram);
        let entry = dwarf.unit.get_mut(function_entry);
        entry.set(DW_AT_name, text(&function.name));
        entry.set(DW_AT_external, AttributeValue::Flag(true));
        entry.set(DW_AT_low_pc, address(index));
        entry.set(DW_AT_high_pc, AttributeValue::Udata(function.len.into()));
        let Some(&first) = rows.first() else { continue };
        entry.set(
            DW_AT_decl_file,
            AttributeValue::FileIndex(files.get(first.file as usize).copied()),
        );
        entry.set(DW_AT_decl_line, AttributeValue::Udata(first.line.into()));
        for (number, range) in (1..).zip(copies(rows, function.offset + function.len)) {
            let addend = i64::from(range.start - function.offset);
            let start = AttributeValue::Address(Address::Symbol { symbol: index, addend });
            let id = dwarf.unit.add(function_entry, DW_TAG_lexical_block);
            let block = dwarf.unit.get_mut(id);
            block.set(DW_AT_low_pc, start.clone());
            block.set(DW_AT_high_pc, AttributeValue::Udata(range.len() as u64));
            // gdb ignores a block in which nothing is declared.
            let label = dwarf.unit.add(id, DW_TAG_label);
            let label = dwarf.unit.get_mut(label);
            label.set(DW_AT_name, text(&format!("copy{number}")));
            label.set(DW_AT_low_pc, start);
        }
        lines.begin_sequence(Some(Address::Symbol { symbol: index, addend: 0 }));
        // The code before a function's first statement is taken to belong to that statement.
        let prologue = CodeLine { offset: function.offset, ..first };
        let behind = rows.iter().skip(usize::from(first.offset == function.offset));
        for line in std::iter::once(&prologue).chain(behind) {
            let Some(&file) = files.get(line.file as usize) else { continue };
            let row = lines.row();
            row.address_offset = u64::from(line.offset - function.offset);
            row.file = file;
            row.line = line.line.into();
            lines.generate_row();
        }
        lines.end_sequence(function.len.into());
    }
    dwarf.unit.line_program = lines;
    let image = image_type::add(&mut dwarf, program, &options.prefix);
    if context {
        scan_context::add(&mut dwarf, image, code.functions.len());
    }
    let empty = Section { bytes: EndianVec::new(RunTimeEndian::Little), relocations: vec![] };
    let mut sections = Sections::new(empty);
    dwarf.write(&mut sections)?;
    let mut written = vec![];
    sections.for_each(|id, section| {
        if !section.bytes.slice().is_empty() {
            written.push((id, section.clone()));
        }
        Ok::<_, gimli::write::Error>(())
    })?;
    Ok(written)
}

/// Divides the code of a function, which ends at `end`, where a statement begins whose code is also before:
/// the specialised and the general code of a PLC have all statements twice. Gives the offsets of each part;
/// none for code that has each statement once. Each part is a block of its own, since debuggers put a
/// breakpoint at the first instruction of a line in each block.
fn copies(rows: &[CodeLine], end: u32) -> Vec<Range<u32>> {
    let mut starts = vec![];
    let mut seen = HashSet::new();
    let mut last = None;
    for row in rows {
        let place = (row.file, row.line);
        if last == Some(place) {
            continue;
        }
        last = Some(place);
        if !seen.insert(place) {
            starts.push(row.offset);
            seen = HashSet::from([place]);
        }
    }
    let ends = starts.iter().skip(1).copied().chain([end]);
    starts.iter().copied().zip(ends).map(|(start, end)| start..end).collect()
}

fn text(text: &str) -> AttributeValue {
    AttributeValue::String(text.replace('\0', "?").into_bytes())
}

fn address(function: usize) -> AttributeValue {
    AttributeValue::Address(Address::Symbol { symbol: function, addend: 0 })
}

/// What a relocation refers to: a section, or else (`Err`) a function, by its index.
pub(super) fn target(relocation: &Relocation) -> Result<SectionId, usize> {
    match relocation.target {
        RelocationTarget::Section(id) => Ok(id),
        RelocationTarget::Symbol(function) => Err(function),
    }
}

#[cfg(test)]
mod tests {
    use plcc_abi::CodeLine;

    use super::copies;

    #[test]
    fn code_is_divided_where_a_statement_comes_again() {
        let parts = |lines: &[u32], end: u32| -> Vec<(u32, u32)> {
            let rows = (0..).zip(lines).map(|(offset, &line)| CodeLine { offset, file: 0, line });
            let rows: Vec<CodeLine> = rows.collect();
            copies(&rows, end).into_iter().map(|part| (part.start, part.end)).collect()
        };
        assert_eq!(parts(&[1, 2, 2, 3], 9), []);
        assert_eq!(parts(&[1, 2, 3, 1, 2, 3], 9), [(3, 9)]);
        assert_eq!(parts(&[1, 2, 1, 3, 3, 2, 1, 4], 9), [(2, 6), (6, 9)]);
        assert_eq!(parts(&[], 9), []);
    }
}
