//! A small program in IR, with a source, a loop through two tasks, and a region of each kind.

use plcc_abi::pmi::PmiTables;
use plcc_abi::{Program, Region, Tables};
use plcc_ir::{Address, BinaryOp, ChunkBuilder, InstBuilder, Module, Statement, Type};

/// Bytes of the image: 8 of variables, and PMI's ports.
pub(crate) const IMAGE: u32 = 16 + 2048;

/// The source that [`counter`] pretends to be made from.
pub(crate) const SOURCE: &str = "$END\nN = N + 1\nN = N * 10\nM = N\n";

/// The regions of [`counter`].
pub(crate) fn regions() -> Vec<Region> {
    vec![
        Region { name: "vars".into(), offset: 0, size: 16, bits: false },
        Region { name: "ports".into(), offset: 16, size: 2048, bits: false },
    ]
}

/// A program whose first scan adds 1 to a variable and is suspended, and whose second multiplies it
/// by ten and copies it. Each statement is a function of its own.
pub(crate) fn counter() -> (Program, Module) {
    let mut b = ChunkBuilder::new(IMAGE, regions()).with_limit(1);
    let file = b.add_file("count.pmi", SOURCE);
    let at = |offset| Address::fixed(plcc_ir::RegionId(0), offset);
    let (start, middle) = (b.place(), b.place());
    let statement = |line: u32| {
        let start: usize = SOURCE.split_inclusive('\n').take(line as usize - 1).map(str::len).sum();
        let text = SOURCE.lines().nth(line as usize - 1).unwrap_or_default();
        Statement { file, line, start: start as u32, end: (start + text.len()) as u32 }
    };
    b.bind(start);
    b.task("scan", start);
    b.resume_points(0, &[middle]);
    b.statement(statement(2));
    let v = b.func().load(Type::I16, at(0));
    let v = b.func().binary_imm(BinaryOp::Add, v, 1);
    b.func().store(at(0), v);
    b.suspend(middle);
    b.bind(middle);
    b.statement(statement(3));
    let v = b.func().load(Type::I16, at(0));
    let v = b.func().binary_imm(BinaryOp::Mul, v, 10);
    b.func().store(at(0), v);
    b.statement(statement(4));
    let v = b.func().load(Type::I16, at(0));
    b.func().store(at(8), v);
    b.ret();
    let module = b.finish();
    let program = Program {
        files: vec!["count.pmi".into()],
        image_size: IMAGE,
        regions: regions(),
        tasks: module.tasks.clone(),
        tables: Tables::Pmi(PmiTables { ports: 16, ..PmiTables::default() }),
        names: vec![],
    };
    (program, module)
}
