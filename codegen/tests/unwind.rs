//! Unwind information: complete in the code, and enough for a debugger in an object.
#![allow(clippy::unwrap_used, clippy::panic)]

mod support;
#[path = "../../tests/src/tools.rs"]
mod tools;

use std::fs;
use std::path::Path;
use std::process::Command;

use gimli::{
    BaseAddresses, CfaRule, CieOrFde, EhFrame, LittleEndian, UnwindContext, UnwindSection,
};
use plcc_abi::pmi::PmiTables;
use plcc_abi::unwind::ALIGNMENT;
use plcc_abi::{HostFn, Program, Tables};
use plcc_codegen::{CodegenOptions, Target, compile, emit};
use plcc_ir::{Address, BinaryOp, ChunkBuilder, InstBuilder, Module, Type};
use tools::is_there;

/// A program whose function calls the host and needs registers and a frame.
fn caller() -> (Program, Module) {
    let mut b = ChunkBuilder::new(support::IMAGE, support::regions());
    let at = |offset| Address::fixed(plcc_ir::RegionId(0), offset);
    let start = b.place();
    b.bind(start);
    b.task("scan", start);
    let values: Vec<_> = (0..8).map(|i| b.func().load(Type::I8, at(i))).collect();
    b.func().host_call(HostFn::PmacSave, &[]);
    for (i, value) in (0..).zip(values) {
        let value = b.func().binary_imm(BinaryOp::Add, value, 1);
        b.func().store(at(i), value);
    }
    b.ret();
    let module = b.finish();
    let program = Program {
        files: vec!["caller.pmi".into()],
        image_size: support::IMAGE,
        regions: support::regions(),
        tasks: module.tasks.clone(),
        tables: Tables::Pmi(PmiTables { ports: 16, ..PmiTables::default() }),
        names: vec![],
    };
    (program, module)
}

/// Every function is described, from its first to its last byte, and at its first instruction the
/// caller's frame lies where the machine's call leaves it.
#[test]
fn every_function_is_described() {
    for (_, module) in [support::counter(), caller()] {
        // Bytes between the stack pointer and the caller's frame when a function is entered.
        for (triple, entered) in [("x86_64-unknown-linux-gnu", 8), ("aarch64-unknown-linux-gnu", 0)]
        {
            let code =
                compile(&module, &Target::baseline(triple).unwrap(), CodegenOptions::NONE).unwrap();
            let section = EhFrame::new(&code.eh_frame, LittleEndian);
            let place = code.bytes.len().next_multiple_of(ALIGNMENT) as u64;
            let bases = BaseAddresses::default().set_eh_frame(place);
            let mut found = vec![];
            let mut entries = section.entries(&bases);
            while let Some(entry) = entries.next().unwrap() {
                let CieOrFde::Fde(fde) = entry else { continue };
                let fde = fde.parse(EhFrame::cie_from_offset).unwrap();
                found.push((fde.initial_address(), fde.len()));
                let mut context = UnwindContext::new();
                let mut rows = fde.rows(&section, &bases, &mut context).unwrap();
                let first = rows.next_row().unwrap().unwrap();
                let CfaRule::RegisterAndOffset { offset, .. } = first.cfa() else { panic!() };
                assert_eq!(*offset, entered, "{triple}");
            }
            let functions: Vec<(u64, u64)> =
                code.functions.iter().map(|f| (f.offset.into(), f.len.into())).collect();
            assert_eq!(found, functions, "{triple}");
        }
    }
}

/// The host function unwinds by the sections alone, as exceptions of C++ would, and counts how often
/// it comes to `main`; not when the program has no argument. gdb has other ways too, where there is
/// no unwind information.
const MAIN: &str = r#"
#include <unwind.h>
#include "plcc.h"
int main(int argc, char **argv);
static int unwinds, found;
static _Unwind_Reason_Code frame(struct _Unwind_Context *context, void *data) {
    found += _Unwind_GetRegionStart(context) == (_Unwind_Ptr)main;
    return _URC_NO_REASON;
}
static uint64_t host(const struct plcc_context *c, uint32_t f, uint64_t a, uint64_t b,
                     uint64_t d, uint64_t e) {
    if (unwinds) _Unwind_Backtrace(frame, 0);
    return 0;
}
int main(int argc, char **argv) {
    static uint8_t image[4096];
    struct plcc_context context = { .image = image, .host = host };
    struct plcc_task task = plcc_task_at(0);
    unwinds = argc > 1;
    return plcc_scan(&task, &context) == PLCC_END && found == unwinds ? image[7] : 100;
}
"#;

/// A trace before each instruction from the scan's first on, in the host function too.
const SCRIPT: &str = "\
set debuginfod enabled off
set pagination off
break *plcc_chunk0
run
set $n = 0
while $n < 150
  backtrace
  stepi
  set $n = $n + 1
end
";

fn build(folder: &Path) {
    let (program, module) = caller();
    let target = Target::host_baseline().unwrap();
    let code = compile(&module, &target, CodegenOptions::NONE).unwrap();
    fs::create_dir_all(folder).unwrap();
    fs::write(
        folder.join("scan.o"),
        emit::object(&program, &code, &target, &emit::ObjectOptions::default()).unwrap(),
    )
    .unwrap();
    fs::write(folder.join("main.c"), MAIN).unwrap();
    fs::write(folder.join("script"), SCRIPT).unwrap();
    let status = Command::new("cc")
        .args(["-g", "-O0", "-I", concat!(env!("CARGO_MANIFEST_DIR"), "/include")])
        .args(["-o", "main", "main.c", "scan.o"])
        .current_dir(folder)
        .status()
        .unwrap();
    assert!(status.success());
}

/// gdb finds the way from every instruction of a scan to `main`, also from the host function that
/// the scan calls.
#[test]
fn gdb_unwinds_through_a_scan() {
    if !is_there("cc") || !is_there("gdb") {
        return;
    }
    let folder = std::env::temp_dir().join(format!("plcc-unwind-{}", std::process::id()));
    build(&folder);
    for argument in [None, Some("unwind")] {
        let status = Command::new(folder.join("main")).args(argument).status().unwrap();
        assert_eq!(status.code(), Some(1), "{argument:?}");
    }
    let gdb = Command::new("gdb")
        .args(["-nx", "-batch", "-x", "script", "main"])
        .current_dir(&folder)
        .output()
        .unwrap();
    fs::remove_dir_all(&folder).unwrap();
    let text = String::from_utf8_lossy(&gdb.stdout);
    let errors = String::from_utf8_lossy(&gdb.stderr);
    if errors.contains("not permitted") {
        tools::missing("gdb", &format!("may not run programs here: {errors}"));
        return;
    }
    let mut traces: Vec<Vec<&str>> = vec![];
    for line in text.lines().filter(|line| line.starts_with('#')) {
        if line.starts_with("#0 ") {
            traces.push(vec![]);
        }
        traces.last_mut().unwrap().push(line);
    }
    let inside = |trace: &[&str], frame: usize| {
        trace.get(frame).is_some_and(|line| line.contains(" chunk0 ("))
    };
    assert!(traces.iter().filter(|trace| inside(trace, 0)).count() > 30, "{text}\n{errors}");
    let in_host = |trace: &&Vec<&str>| trace[0].contains("host (") && inside(trace, 1);
    assert!(traces.iter().filter(in_host).count() > 3, "{text}\n{errors}");
    for trace in traces.iter().filter(|trace| inside(trace, 0) || in_host(trace)) {
        let chain = trace.iter().any(|line| line.contains("main ("));
        assert!(chain, "{}\n{errors}", trace.join("\n"));
    }
}
