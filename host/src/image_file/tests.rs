//! Tests of the image file.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};

use plcc_abi::pmi::{PmiTables, Role, Symbol, Type};
use plcc_abi::{Program, Region, Tables, Task};

use super::*;
use plcc_image::layout::AT_SEQUENCE;
use plcc_runtime::safe_outputs::SafeByte;

fn program(size: u32) -> Program {
    let symbol = Symbol {
        name: "PUMP".into(),
        ty: Type::Logical,
        offset: 3,
        elements: None,
        role: Role::Variable,
        dumped: true,
        retained: false,
    };
    Program {
        files: vec![],
        image_size: size,
        regions: vec![Region { name: "all".into(), offset: 0, size, bits: false }],
        tasks: vec![Task { name: "scan".into(), entry: 0, resume_points: vec![] }],
        tables: Tables::Pmi(PmiTables { symbols: vec![symbol], ..PmiTables::default() }),
        names: vec![],
    }
}

/// A table without variables.
static NO_SYMBOLS: SymbolTable = SymbolTable { symbols: vec![], slots: vec![] };

fn content<'a>(program: &'a Program, image: &'a [u8], safe: &'a [SafeByte]) -> Content<'a> {
    Content {
        program,
        fingerprint: 0x1234,
        image,
        used: &[],
        tick_ns: 20_000_000,
        generation: 7,
        safe_outputs: safe,
        symbols: &NO_SYMBOLS,
        rules: &[],
    }
}

#[test]
fn what_is_published_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("image");
    let program = program(13);
    let mut publisher = Publisher::create(&path, &content(&program, &[9; 13], &[])).unwrap();
    let reader = ImageReader::open(&path).unwrap();
    let first = reader.read().unwrap();
    assert_eq!((first.state, first.ticks), (Some(State::Prepared), 0));
    assert_eq!(first.image, [9; 13]);
    assert_eq!((reader.fingerprint(), reader.generation()), (0x1234, 7));
    assert_eq!(reader.process(), u64::from(std::process::id()));
    let table = String::from_utf8(reader.variables()).unwrap();
    assert_eq!(
        table,
        "{\"region\":\"all\",\"offset\":0,\"bytes\":13}\n\
         {\"name\":\"PUMP\",\"type\":\"logical\",\"offset\":3,\"elements\":1}\n"
    );
    let image: Vec<u8> = (0..13).collect();
    publisher.publish(&image, 5, 99, State::Running, 2);
    let second = reader.read().unwrap();
    assert_eq!(
        second,
        Snapshot { ticks: 5, time: 99, state: Some(State::Running), forces: 2, image }
    );
    publisher.publish(&[1; 12], 6, 99, State::Running, 2);
    assert_eq!(reader.read().unwrap(), second, "an image of another length is not written");
    publisher.end(State::Ended);
    assert_eq!(reader.read().unwrap().state, Some(State::Ended));
}

/// A thread writes ticks whose bytes are all the same; a reader never sees two kinds of bytes.
#[test]
fn readers_see_whole_ticks() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("image");
    let program = program(20_000);
    let mut publisher = Publisher::create(&path, &content(&program, &[0; 20_000], &[])).unwrap();
    let reader = ImageReader::open(&path).unwrap();
    let done = AtomicBool::new(false);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            let mut seen = 0;
            while !done.load(Ordering::Relaxed) || seen == 0 {
                let Some(snapshot) = reader.read() else { continue };
                let expected = snapshot.ticks as u8;
                assert!(snapshot.image.iter().all(|&byte| byte == expected));
                assert!(snapshot.ticks >= seen);
                seen = snapshot.ticks;
            }
        });
        for tick in 1..20_000_u64 {
            publisher.publish(&[tick as u8; 20_000], tick, 0, State::Running, 0);
        }
        done.store(true, Ordering::Relaxed);
    });
}

#[test]
fn of_large_images_changed_pages_are_found_and_stay_current() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("image");
    let size = 1 << 20;
    let program = program(size as u32);
    let mut image = vec![0; size];
    let mut publisher = Publisher::create(&path, &content(&program, &image, &[])).unwrap();
    let reader = ImageReader::open(&path).unwrap();
    image[size - 1] = 1;
    let mut ticks = 0;
    while reader.read().unwrap().image != image {
        ticks += 1;
        assert!(ticks <= size as u64 / 4096 / 8, "the page is not found");
        publisher.publish(&image, ticks, 0, State::Running, 0);
    }
    image[size - 1] = 2;
    publisher.publish(&image, ticks + 1, 0, State::Running, 0);
    assert_eq!(reader.read().unwrap().image, image, "a page in use is current");
}

#[test]
fn a_supervisor_writes_safe_outputs_for_a_process_that_died_while_it_wrote() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("image");
    let program = program(16);
    let safe = [
        SafeByte { offset: 1, keep: 0xF0, set: 0x05 },
        SafeByte { offset: 9, keep: 0, set: 0 },
        SafeByte { offset: 16, keep: 0, set: 0xEE },
    ];
    let mut publisher = Publisher::create(&path, &content(&program, &[0; 16], &safe)).unwrap();
    publisher.publish(&[0xFF; 16], 1, 0, State::Running, 0);
    drop(publisher);
    // The writer dies: the counter stays odd.
    let mut bytes = std::fs::read(&path).unwrap();
    bytes[AT_SEQUENCE] |= 1;
    std::fs::write(&path, &bytes).unwrap();
    let reader = ImageReader::open(&path).unwrap();
    assert_eq!(reader.read(), None);
    SafeOutputWriter::open(&path).unwrap().write().unwrap();
    let snapshot = reader.read().unwrap();
    assert_eq!(snapshot.state, Some(State::Dead));
    let mut expected = [0xFF; 16];
    (expected[1], expected[9]) = (0xF5, 0);
    assert_eq!(snapshot.image, expected);
}

#[test]
fn files_that_are_something_else_or_in_use_are_not_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("image");
    let program = program(8);
    let content = content(&program, &[0; 8], &[]);
    std::fs::write(&path, "tick,name,value\n").unwrap();
    let refused = Publisher::create(&path, &content).unwrap_err();
    assert!(matches!(refused, ImageFileError::Other(_)), "{refused}");
    assert!(matches!(Publisher::create(folder.path(), &content), Err(ImageFileError::Other(_))));
    assert!(ImageReader::open(&path).is_err());
    std::fs::write(&path, "").unwrap();
    let first = Publisher::create(&path, &content).unwrap();
    let me = u64::from(std::process::id());
    match Publisher::create(&path, &content) {
        Err(ImageFileError::InUse(_, process)) => assert_eq!(process, me),
        other => panic!("{other:?}"),
    }
    drop(first);
    Publisher::create(&path, &content).unwrap();
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "nothing is left over");
}

#[test]
fn a_file_that_can_not_be_put_in_place_is_removed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("image");
    let program = program(8);
    let _publisher = Publisher::prepare(&path, &content(&program, &[0; 8], &[])).unwrap();
    std::fs::create_dir(&path).unwrap();
    assert!(matches!(Publisher::put_in_place(&path), Err(ImageFileError::Io(..))));
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "only the folder is there");
}

/// The function in C that `docs/image.md` shows reads what is published.
#[test]
fn the_documented_function_in_c_reads_a_tick() {
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("..");
    let document = std::fs::read_to_string(root.join("docs/image.md")).unwrap();
    let (_, code) = document.split_once("```c\n").unwrap();
    let (code, _) = code.split_once("```").unwrap();
    let main = r#"
#include <fcntl.h>
#include <stdio.h>
#include <sys/mman.h>
int main(int count, char **arguments) {
    int file = open(arguments[1], O_RDONLY);
    const void *map = mmap(0, 8192, PROT_READ, MAP_SHARED, file, 0);
    unsigned char image[13];
    if (count != 2 || map == MAP_FAILED) return 1;
    printf("%llu", (unsigned long long)read_tick(map, image));
    for (int at = 0; at < 13; at++) printf(" %d", image[at]);
}
"#;
    let folder = tempfile::tempdir().unwrap();
    let (source, binary) = (folder.path().join("reader.c"), folder.path().join("reader"));
    std::fs::write(&source, format!("{code}{main}")).unwrap();
    let mut compiler = std::process::Command::new("cc");
    compiler.args(["-Wall", "-Wextra", "-Werror", "-o"]).arg(&binary).arg(&source);
    assert!(compiler.status().unwrap().success());
    let path = folder.path().join("image");
    let program = program(13);
    let mut publisher = Publisher::create(&path, &content(&program, &[9; 13], &[])).unwrap();
    let image: Vec<u8> = (0..13).collect();
    publisher.publish(&image, 5, 0, State::Running, 0);
    let output = std::process::Command::new(&binary).arg(&path).output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    assert_eq!(text, "5 0 1 2 3 4 5 6 7 8 9 10 11 12");
}

/// A control with inputs, and its image file: the input `A` of a line, the output `PUMP` of four lines in
/// BCD, and the variable `SPEED`.
fn control_with_inputs(
    path: &std::path::Path,
) -> (Program, plcc_runtime::pmi::PmiExecutive, Publisher) {
    use plcc_abi::pmi::{Format, Lines, Special};
    let symbol = |name: &str, ty, offset, role| Symbol {
        name: name.into(),
        ty,
        offset,
        elements: None,
        role,
        dumped: true,
        retained: false,
    };
    let lines = |port, low, count, format| Lines { port, low, count, format };
    let symbols = vec![
        symbol("A", Type::Logical, 0, Role::Input(lines(1, 3, 1, Format::Bit))),
        symbol("PUMP", Type::Integer, 2, Role::Output(lines(2, 4, 4, Format::Bcd))),
        symbol("SPEED", Type::Integer, 4, Role::Variable),
    ];
    let special = Special { ipl: 6, estop: 7, crset: 8 };
    let mut program = program(16 + 2048);
    program.tables = Tables::Pmi(PmiTables { symbols, special, ports: 16, ..PmiTables::default() });
    let options = plcc_runtime::pmi::PmiOptions::default();
    let executive = plcc_runtime::pmi::PmiExecutive::new(&program, options).unwrap();
    let table = SymbolTable::new(&*plcc_runtime::names_of(&program));
    let image = vec![0; program.image_size as usize];
    let publisher =
        Publisher::create(path, &Content { symbols: &table, ..content(&program, &image, &[]) });
    let publisher = publisher.unwrap();
    (program, executive, publisher)
}

/// The header in C reads whole ticks and gives inputs, and the example in Python prints variables.
#[test]
fn programs_in_c_and_python_read_variables_and_give_inputs() {
    use plcc_runtime::Executive;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("image");
    let (_, mut executive, mut publisher) = control_with_inputs(&path);
    let mut image = executive.image().to_vec();
    (image[2], image[4], image[16 + 2]) = (1, 44, 0x70);
    publisher.publish(&image, 7, 0, State::Running, 0);
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../image");
    let main = r#"
#include "plcc_image.h"
int main(int count, char **arguments) {
    struct plcc_image image;
    if (count != 2 || plcc_image_open(&image, arguments[1], 1) || plcc_image_read(&image)) return 1;
    const struct plcc_symbol *pump = plcc_image_find(&image, "PUMP");
    const struct plcc_symbol *speed = plcc_image_find(&image, "SPEED");
    const struct plcc_symbol *a = plcc_image_find(&image, "A");
    if (!pump || !speed || !a || plcc_image_find(&image, "B")) return 2;
    printf("%d %g %g\n", (int)image.ticks, plcc_image_value(&image, pump), plcc_image_value(&image, speed));
    if (plcc_inputs_begin(&image, "in C") || plcc_inputs_claim(&image, a) || plcc_inputs_claim(&image, speed)) return 3;
    if (!plcc_inputs_claim(&image, pump)) return 4;
    plcc_inputs_set(&image, a, 1);
    plcc_inputs_set(&image, speed, -5);
    return plcc_inputs_publish(&image);
}
"#;
    let (source, binary) = (folder.path().join("driver.c"), folder.path().join("driver"));
    std::fs::write(&source, main).unwrap();
    let mut compiler = std::process::Command::new("cc");
    compiler.args(["-std=gnu11", "-Wall", "-Wextra", "-Werror", "-I"]).arg(root.join("include"));
    compiler.arg("-o").arg(&binary).arg(&source);
    assert!(compiler.status().unwrap().success());
    let output = std::process::Command::new(&binary).arg(&path).output().unwrap();
    assert_eq!(String::from_utf8(output.stdout).unwrap(), "7 7 44\n", "{}", output.status);
    assert!(output.status.success());
    // A file whose parts would not lie within it is refused.
    let whole = std::fs::read(&path).unwrap();
    for at in [layout::AT_IMAGE, layout::AT_SYMBOLS, layout::AT_SYMBOLS_COUNT, layout::AT_INPUTS] {
        let mut damaged = whole.clone();
        damaged[at..at + 8].copy_from_slice(&(u64::MAX / 16).to_le_bytes());
        let path = folder.path().join("damaged");
        std::fs::write(&path, damaged).unwrap();
        let output = std::process::Command::new(&binary).arg(&path).output().unwrap();
        assert_eq!(output.status.code(), Some(1), "the header's word at {at:#x}");
    }
    let mut scan = crate::journal::ScanJournal::discarding();
    publisher.latch(&mut executive, 8, false, &mut scan);
    let value = |executive: &mut plcc_runtime::pmi::PmiExecutive, name| {
        let variable = executive.names().find(name, plcc_runtime::Purpose::Watch).unwrap();
        executive.read(variable).to_string()
    };
    assert_eq!(value(&mut executive, "PORT1.3"), "1");
    assert_eq!(value(&mut executive, "SPEED"), "-5");

    let mut python = std::process::Command::new("python3");
    python.arg(root.join("examples/read_image.py")).arg(&path).args(["PUMP", "SPEED", "A"]);
    match python.output() {
        Ok(output) => assert_eq!(
            String::from_utf8(output.stdout).unwrap(),
            "ticks 7\nA input 0 \nPUMP output 7 \nSPEED variable 44 \n",
            "{}",
            String::from_utf8_lossy(&output.stderr)
        ),
        Err(error) => eprintln!("skipped: python3 is missing here: {error}"),
    }
}

/// The table of `docs/image.md` has every offset of `layout.rs`.
#[test]
fn the_documentation_has_the_offsets_of_the_header() {
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("..");
    let document = std::fs::read_to_string(root.join("docs/image.md")).unwrap();
    let source = include_str!("../../../image/src/layout.rs");
    let mut offsets = 0;
    for line in source.lines() {
        let Some(rest) = line.strip_prefix("pub const AT_") else { continue };
        let (_, value) = rest.split_once("= ").unwrap();
        let value = value.trim_end_matches(';');
        assert!(document.contains(&format!("| `{value}` |")), "{value} is missing");
        offsets += 1;
    }
    assert!(offsets >= 21);
    for state in State::ALL {
        let row = format!("| {} | {} |", state.number(), state.name());
        assert!(document.contains(&row), "{row} is missing");
    }
}
