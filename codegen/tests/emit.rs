//! Listings and objects: what they contain, and that an object runs in a C program.
#![allow(clippy::unwrap_used, clippy::panic)]

mod support;
#[path = "../../tests/src/tools.rs"]
mod tools;

use std::process::Command;

use object::{Object as _, ObjectSection as _, ObjectSymbol as _};
use plcc_codegen::{CodegenOptions, Target, compile, emit};
use plcc_ir::InstBuilder;

const TARGETS: [&str; 2] = ["x86_64-unknown-linux-gnu", "aarch64-unknown-linux-gnu"];

#[test]
fn listings_contain_the_source_lines() {
    let (_, module) = support::counter();
    for triple in TARGETS {
        let target = Target::baseline(triple).unwrap();
        let clif = emit::clif(&module, &target, CodegenOptions::NONE).unwrap();
        let asm = emit::asm(&module, &target, CodegenOptions::NONE).unwrap();
        for text in [&clif, &asm] {
            assert!(text.contains(triple));
            assert!(text.contains("(task scan)"), "{text}");
            let mut rest = text.as_str();
            for comment in
                ["; count.pmi:2  N = N + 1", "; count.pmi:3  N = N * 10", "; count.pmi:4  M = N"]
            {
                let at = rest.find(comment).unwrap_or_else(|| panic!("{comment} in\n{text}"));
                rest = &rest[at + comment.len()..];
            }
        }
        assert!(clif.contains("imul"), "{clif}");
        assert!(!asm.contains(".byte"), "{asm}");
        assert_eq!(asm.matches("\n  000000").count(), module.funcs.len(), "{asm}");
        assert!(asm.matches(" ret").count() >= 3, "{asm}");
    }
}

/// The code of a cold block stands after that of the other blocks, whichever side of a branch it is.
#[test]
fn cold_blocks_stand_behind_the_others() {
    let positions = |marks: [&str; 2]| {
        let text = format!(
            "image 8\nregion data at 0 size 8\ntask \"scan\" L0\nfn \"chunk0\" {{\n\
             block0 (L0):\nv0: i32 = load data:0\nv1: i1 = bit v0, 0\nbrif v1, block1, block2\n\
             block1{}:\nv2: i32 = iconst 286331153\nstore data:4, v2\njump block3\n\
             block2{}:\nv3: i32 = iconst 572662306\nstore data:4, v3\njump block3\n\
             block3:\nreturn\n}}\n",
            marks[0], marks[1]
        );
        let module = plcc_ir::text::parse(&text).unwrap();
        let code =
            compile(&module, &Target::baseline(TARGETS[0]).unwrap(), CodegenOptions::NONE).unwrap();
        [[0x11; 4], [0x22; 4]]
            .map(|constant| code.bytes.windows(4).position(|window| window == constant).unwrap())
    };
    let [cold, other] = positions([" cold", ""]);
    assert!(cold > other);
    let [other, cold] = positions(["", " cold"]);
    assert!(cold > other);
}

/// Cranelift keeps statements relative to the first that it meets, which is not the first in the
/// source when the code jumps about.
#[test]
fn every_statement_keeps_its_source_line() {
    use plcc_ir::{Address, ChunkBuilder, Statement, Type};
    let mut b = ChunkBuilder::new(support::IMAGE, support::regions());
    let file = b.add_file("x.nct", "A\nB\nC\nD\nE\nF\n");
    let at = Address::fixed(plcc_ir::RegionId(0), 0);
    let places: Vec<_> = (0..6).map(|_| b.place()).collect();
    for (i, &place) in places.iter().enumerate() {
        b.bind(place);
        b.task(format!("t{i}"), place);
        let (line, start) = (i as u32 + 1, 2 * i as u32);
        b.statement(Statement { file, line, start, end: start + 1 });
        let v = b.func().load(Type::I32, at);
        b.func().store(at, v);
        b.switch(v, places.clone(), places[0]);
    }
    let module = b.finish();
    for triple in TARGETS {
        let target = Target::baseline(triple).unwrap();
        let asm = emit::asm(&module, &target, CodegenOptions::NONE).unwrap();
        for text in [emit::clif(&module, &target, CodegenOptions::NONE).unwrap(), asm] {
            for line in 1..=6 {
                assert!(text.contains(&format!("; x.nct:{line}  ")), "{line} in\n{text}");
            }
        }
        // A table for each statement, and one to enter by.
        let asm = emit::asm(&module, &target, CodegenOptions::NONE).unwrap();
        assert_eq!(asm.matches(".long -> ").count(), 7 * 7, "{asm}");
    }
}

/// The line that DWARF gives each of the object's addresses, by function.
fn lines(bytes: &[u8]) -> Vec<(u64, String, u64)> {
    use gimli::{EndianSlice, LittleEndian, SectionId};
    let file = object::File::parse(bytes).unwrap();
    let mut loaded = std::collections::HashMap::new();
    for section in file.sections() {
        let mut data = section.uncompressed_data().unwrap().into_owned();
        for (offset, relocation) in section.relocations() {
            let object::RelocationTarget::Symbol(symbol) = relocation.target() else { continue };
            let value =
                file.symbol_by_index(symbol).unwrap().address() as i64 + relocation.addend();
            let size = usize::from(relocation.size()) / 8;
            let at = offset as usize;
            data[at..at + size].copy_from_slice(&value.to_le_bytes()[..size]);
        }
        loaded.insert(section.name().unwrap().to_owned(), data);
    }
    let empty = vec![];
    let load = |id: SectionId| {
        let data = loaded.get(id.name()).unwrap_or(&empty);
        Ok::<_, gimli::Error>(EndianSlice::new(data, LittleEndian))
    };
    let dwarf = gimli::Dwarf::load(load).unwrap();
    let header = dwarf.units().next().unwrap().unwrap();
    let unit = dwarf.unit(header).unwrap();
    let mut rows = unit.line_program.clone().unwrap().rows();
    let mut all = vec![];
    while let Some((header, row)) = rows.next_row().unwrap() {
        if row.end_sequence() {
            continue;
        }
        let file = row.file(header).unwrap();
        let name = dwarf.attr_string(&unit, file.path_name()).unwrap();
        let name = name.to_string_lossy().into_owned();
        all.push((row.address(), name, row.line().unwrap().get()));
    }
    all
}

#[test]
fn objects_have_symbols_and_lines() {
    let (program, module) = support::counter();
    for triple in TARGETS {
        let target = Target::baseline(triple).unwrap();
        let code = compile(&module, &target, CodegenOptions::NONE).unwrap();
        let bytes =
            emit::object(&program, &code, &target, &emit::ObjectOptions::default()).unwrap();
        let file = object::File::parse(&*bytes).unwrap();
        for name in ["plcc_code", "plcc_labels", "plcc_tasks", "plcc_layout"] {
            let found = file.symbols().any(|s| s.name() == Ok(name) && s.is_global());
            assert!(found, "{name} for {triple}");
        }
        let text = file.section_by_name(".text").unwrap();
        assert_eq!(text.data().unwrap(), code.bytes);
        assert_eq!(text.relocations().count(), 0);
        assert!(file.symbols().all(|symbol| !symbol.is_undefined() || symbol.name() == Ok("")));
        let lines = lines(&bytes);
        let mut seen = vec![];
        for function in &code.functions {
            let name = format!("plcc_{}", function.name);
            assert!(file.symbols().any(|s| s.name() == Ok(&name) && s.is_global()), "{name}");
            // One that only goes on to another has no line.
            let row = lines.iter().find(|row| row.0 == u64::from(function.offset));
            if let Some((_, file, line)) = row {
                assert_eq!(file, "count.pmi");
                seen.push(*line);
            }
        }
        assert_eq!(seen, [2, 3, 4], "{lines:?}");
    }
}

/// An object linked into a C program by `plcc.h` runs there, and `addr2line` knows its lines.
#[test]
fn an_object_runs_in_c() {
    let (program, module) = support::counter();
    let target = Target::host_baseline().unwrap();
    let code = compile(&module, &target, CodegenOptions::NONE).unwrap();
    let folder = std::env::temp_dir().join(format!("plcc-emit-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(
        folder.join("count.o"),
        emit::object(&program, &code, &target, &emit::ObjectOptions::default()).unwrap(),
    )
    .unwrap();
    std::fs::write(
        folder.join("main.c"),
        r#"
        #include <stdio.h>
        #include <string.h>
        #include "plcc.h"
        static uint64_t host(const struct plcc_context *c, uint32_t f, uint64_t a, uint64_t b,
                             uint64_t d, uint64_t e) { return 0; }
        int main(void) {
            static uint8_t image[4096];
            struct plcc_context context = { .image = image, .host = host };
            struct plcc_task task = plcc_task_at(0);
            int n;
            if (plcc_abi_version != VERSION || plcc_image_size > sizeof image) return 1;
            for (n = 0; n < 4; n++) printf("%d ", plcc_scan(&task, &context));
            printf("%d %d\n", image[0], image[8]);
            fputs(plcc_layout, stdout);
            return 0;
        }
        "#,
    )
    .unwrap();
    let status = Command::new("cc")
        .args(["-Wall", "-Werror", "-Wextra", "-Wno-unused-parameter", "-g", "-I"])
        .arg(concat!(env!("CARGO_MANIFEST_DIR"), "/include"))
        .arg(format!("-DVERSION={}", plcc_abi::ABI_VERSION))
        .args(["-o", "main", "main.c", "count.o"])
        .current_dir(&folder)
        .status()
        .unwrap();
    assert!(status.success());
    let output = Command::new(folder.join("main")).output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    assert_eq!(text, format!("2 1 2 1 110 110\n{}", emit::layout(&program)));
    assert!(text.contains("region vars 0 16\n"), "{text}");
    let line = code.lines.iter().find(|line| line.line == 3).unwrap();
    let function = code.function_at(line.offset).unwrap();
    if tools::is_there("addr2line") {
        let mut addr2line = Command::new("addr2line");
        addr2line.args(["-f", "-e", "count.o", &format!("{:#x}", function.offset)]);
        let output = addr2line.current_dir(&folder).output().unwrap();
        let text = String::from_utf8(output.stdout).unwrap();
        assert!(text.contains(&function.name) && text.contains("count.pmi:3"), "{text}");
    }
    std::fs::remove_dir_all(&folder).unwrap();
}
