//! Runs the files of `tests/ir/filetests`. A file of IR says in its comments what the program does and
//! what the passes make of it; a file of NCT stands beside the IR that it becomes.
//!
//! In `tests/ir/filetests/*.ir` these comments are directives:
//!
//! - `; before REGION:OFFSET BYTE…` puts bytes (hexadecimal) into the image before the first scan.
//! - `; after OUTCOME REGION:OFFSET BYTE…` is what the next scan of the first task gives (`end`,
//!   `suspended`, or a trap's code) and leaves in the image: in the IR interpreter and in native
//!   code, each before and after the passes. Any number of such scans can follow.
//! - `; passes NAME…` runs these passes, or with `all` those of the optimiser in its order. The result
//!   is compared with the text after the line `; becomes`, and executed like the rest.
//!
//! A call of a host function that is not pure inverts the lowest bit of each byte of the region `host`, if there is one.
//!
//! Every file has scans; a comment in front of the module that begins with a word in small letters is a
//! directive, so that one which is misspelt fails.
//!
//! Beside each `tests/ir/filetests/nct/*.nct` stands its optimised IR, `*.ir`.
//!
//! `BLESS=1` writes the results into the files; look at them before you commit them.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};

use plcc_abi::pmac::pure_functions;
use plcc_abi::{Engine, Host, HostFn, Outcome, Program, Region, Scan, Tables};
use plcc_codegen::{CodegenOptions, OptLevel, Optimization, Target, compile};
use plcc_diag::SourceMap;
use plcc_frontend::common::{MemoryLoader, Options};
use plcc_frontend::nct;
use plcc_ir::interp::Interpreter;
use plcc_ir::passes::{self, Pass};
use plcc_ir::text::{parse, print};
use plcc_ir::verify::verify;
use plcc_ir::{InstData, IntCond, Module};
use plcc_runtime::NativeEngine;

const BECOMES: &str = "; becomes";

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("filetests")
}

fn files(folder: &Path, ending: &str) -> Vec<PathBuf> {
    let all = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut files: Vec<PathBuf> =
        all.filter(|path| path.extension().is_some_and(|e| e == ending)).collect();
    files.sort();
    assert!(!files.is_empty());
    files
}

fn bless() -> bool {
    std::env::var_os("BLESS").is_some_and(|value| value == "1")
}

/// The text of a module's functions, without image, regions, tasks and statements.
fn functions(module: &Module) -> String {
    let text = print(module);
    let begin = text.find("\nfn ").map_or(text.len(), |at| at + 1);
    let end = text.find("\nstatement ").or_else(|| text.find("\nfile ")).unwrap_or(text.len());
    text[begin..end].trim_end().to_owned() + "\n"
}

/// Reads `REGION:OFFSET BYTE…`, repeated: offsets in the image, each with its bytes.
fn bytes(module: &Module, words: &[&str]) -> Vec<(usize, Vec<u8>)> {
    let mut rows: Vec<(usize, Vec<u8>)> = vec![];
    for word in words {
        match word.split_once(':') {
            Some((name, offset)) => {
                let region = module.regions.iter().find(|region| region.name == name).unwrap();
                let offset: u32 = offset.parse().unwrap();
                rows.push(((region.offset + offset) as usize, vec![]));
            }
            None => rows.last_mut().unwrap().1.push(u8::from_str_radix(word, 16).unwrap()),
        }
    }
    rows
}

fn outcome(outcome: Outcome) -> String {
    match outcome {
        Outcome::End => "end".into(),
        Outcome::Suspended(_) => "suspended".into(),
        Outcome::Trap(trap) => trap.code.name().into(),
    }
}

/// The engines for a module, and for what passes have made of it.
fn engines(module: &Module, changed: Option<&Module>) -> Vec<(&'static str, Box<dyn Engine>)> {
    let mut best = module.clone();
    let speed = Optimization::ALL.run(&mut best).0;
    // With what is done in long programs only.
    let mut as_if_long = module.clone();
    let long = plcc_ir_tests::as_if_long().run(&mut as_if_long).0;
    let native = |module: &Module, options| -> Box<dyn Engine> {
        let code = compile(module, &Target::host().unwrap(), options).unwrap();
        Box::new(NativeEngine::new(&code, &plcc_ir_tests::program_of(module)).unwrap())
    };
    let mut engines: Vec<(&str, Box<dyn Engine>)> = vec![
        ("native none", native(module, CodegenOptions::NONE)),
        ("native speed", native(&best, speed)),
        ("native, as if long", native(&as_if_long, long)),
        ("interpreted", Box::new(Interpreter::new(module.clone()))),
        ("interpreted, optimised", Box::new(Interpreter::new(best))),
    ];
    if let Some(changed) = changed {
        engines.push(("native, after the passes", native(changed, CodegenOptions::ALL)));
        engines
            .push(("interpreted, after the passes", Box::new(Interpreter::new(changed.clone()))));
    }
    engines
}

/// A host with PMAC's pure functions. All others give 0, and change the lowest bit of some bytes.
struct TestHost {
    changes: Range<usize>,
}

impl TestHost {
    /// A host that changes the region `host` of a module, if there is one.
    fn of(module: &Module) -> Self {
        let region = module.regions.iter().find(|region| region.name == "host");
        let bytes =
            |region: &Region| region.offset as usize..(region.offset + region.size) as usize;
        Self { changes: region.map_or(0..0, bytes) }
    }
}

impl Host for TestHost {
    fn call(&mut self, image: &mut [u8], function: HostFn, args: [u64; 4]) -> u64 {
        if let Some(result) = pure_functions::call(function, args) {
            return result;
        }
        image[self.changes.clone()].iter_mut().for_each(|byte| *byte ^= 1);
        0
    }
}

/// The words after a directive, for each line that has it.
fn directives<'a>(text: &'a str, word: &str) -> Vec<Vec<&'a str>> {
    let rows = text.lines().filter_map(|line| line.strip_prefix("; ")?.strip_prefix(word));
    let rows = rows.filter_map(|row| row.strip_prefix(' '));
    rows.map(|row| row.split_whitespace().collect()).collect()
}

/// Runs a file's scans in every engine.
fn run(path: &Path, text: &str, module: &Module, changed: Option<&Module>) {
    assert!(!directives(text, "after").is_empty(), "{} has no scan", path.display());
    for (name, mut engine) in engines(module, changed) {
        let mut image = vec![0; module.image_size as usize];
        for words in directives(text, "before") {
            for (at, row) in bytes(module, &words) {
                image[at..at + row.len()].copy_from_slice(&row);
            }
        }
        let mut from = None;
        for words in directives(text, "after") {
            let mut host = TestHost::of(module);
            let mut scan = Scan::new(&mut image, &mut host);
            let found = engine.call(0, from, &mut scan);
            from = found.resume_point();
            assert_eq!(outcome(found), words[0], "{}, {name}", path.display());
            for (at, row) in bytes(module, &words[1..]) {
                let found = &image[at..at + row.len()];
                assert_eq!(found, row, "{}, {name}: {words:?}", path.display());
            }
        }
    }
}

#[test]
fn each_ir_file_runs_and_is_optimised_as_it_says() {
    for path in files(&folder(), "ir") {
        let text = fs::read_to_string(&path).unwrap();
        let (source, wanted) = text.split_once(BECOMES).unwrap_or((&text, ""));
        let module = parse(source).unwrap_or_else(|error| panic!("{}:{error}", path.display()));
        assert_eq!(verify(&module), [], "{}", path.display());
        let changed = changed(&path, source, &module);
        run(&path, source, &module, changed.as_ref());
        let Some(changed) = changed else {
            assert_eq!(wanted, "", "{} does not say which passes run", path.display());
            continue;
        };
        let found = functions(&changed);
        if bless() {
            fs::write(&path, format!("{}{BECOMES}\n\n{found}", source)).unwrap();
        } else {
            assert_eq!(found, wanted.trim_start(), "{}", path.display());
        }
    }
}

/// What the passes that a file names make of its module; `None` if it names none.
fn changed(path: &Path, source: &str, module: &Module) -> Option<Module> {
    let rows = directives(source, "passes");
    assert!(rows.len() <= 1, "{} names passes twice", path.display());
    let names = rows.first()?;
    let mut changed = module.clone();
    if names[..] == ["all"] {
        passes::optimize(&mut changed, OptLevel::Speed);
    } else {
        let pass = |name: &&str| Pass::from_name(name).unwrap_or_else(|| panic!("{name}"));
        passes::run(&mut changed, &names.iter().map(pass).collect::<Vec<_>>());
    }
    Some(changed)
}

/// The optimised IR of an NCT program.
fn nct_ir(text: &str) -> (Module, Program) {
    let mut sources = SourceMap::new();
    let file = sources.add("test.nct", text.as_bytes());
    let (program, all) = nct::check(&mut sources, file, &MemoryLoader::new(), &Options::default());
    let lowered = program.unwrap_or_else(|| panic!("{all:?}")).lower().unwrap();
    let mut module = lowered.module;
    passes::optimize(&mut module, OptLevel::Speed);
    (module, lowered.program)
}

#[test]
fn each_nct_file_becomes_the_ir_beside_it() {
    for path in files(&folder().join("nct"), "nct") {
        let (module, _) = nct_ir(&fs::read_to_string(&path).unwrap());
        let found = functions(&module);
        let beside = path.with_extension("ir");
        if bless() {
            fs::write(&beside, found).unwrap();
        } else {
            assert_eq!(found, fs::read_to_string(&beside).unwrap(), "{}", path.display());
        }
    }
}

/// How many times the module computes a carry, which it does by an unsigned comparison.
fn carries(module: &Module) -> usize {
    let insts = module.funcs().flat_map(|(_, func)| {
        func.blocks().flat_map(|(_, block)| block.insts.iter().map(|&inst| *func.inst(inst)))
    });
    insts.filter(|data| matches!(data, InstData::Icmp { cond: IntCond::Ult, .. })).count()
}

#[test]
fn a_carry_that_nobody_reads_is_not_computed() {
    let program =
        |middle: &str| format!(":001 LF500 +LF502 {middle} SF504 +1 SF506 LF504 -2 J1 :000 J0");
    // The flags of the last addition are kept for other modules. Those of the additions before it are
    // overwritten, in one of the two programs after the carry was read.
    let (unread, _) = nct_ir(&program(""));
    let (read, _) = nct_ir(&program("(F0040) UF5080 Z"));
    assert_eq!((carries(&unread), carries(&read)), (1, 2));
}

#[test]
fn a_byte_stored_over_the_flags_replaces_them() {
    // 0xFFFF + 1 sets carry and zero; what F004 then holds is added to, stored over them and
    // read as bits.
    let (module, program) = nct_ir(
        ":001 LF500 -1 +1 LF004 SF500 A1 SF004 (F0040) UF5080 Z (F0046) UF5081 Z J1 :000 J0",
    );
    let code = compile(&module, &Target::host().unwrap(), CodegenOptions::ALL).unwrap();
    let mut engine = NativeEngine::new(&code, &program).unwrap();
    let mut image = vec![0; program.image_size as usize];
    let task = program.tasks.iter().position(|task| task.name == ":001").unwrap();
    let Tables::Nct(tables) = &program.tables else { panic!("NCT's tables") };
    let fuel = program.region("context").unwrap().offset + plcc_abi::nct::context::FUEL;
    plcc_abi::image::write_i32(&mut image, fuel, 1000);
    let mut host = TestHost { changes: 0..0 };
    let mut scan = Scan::new(&mut image, &mut host);
    assert_eq!(engine.call(task, None, &mut scan), Outcome::End);
    let byte = |at: usize| tables.flags[at].read(&image);
    assert_eq!((byte(500), byte(501)), (0x41, 0), "carry and zero");
    assert_eq!((byte(4), byte(5)), (1, 0), "what was stored");
    assert_eq!(byte(508), 1, "the carry bit is the stored byte's");
}
