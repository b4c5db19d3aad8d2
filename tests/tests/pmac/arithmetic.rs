//! PMAC's arithmetic: whatever the range analysis lets integers compute has the bits that floating
//! point gives. Random statements and conditions are run with values at the limits of the formats.
//!
//! Each program is run as native code, in the statement interpreter and in the test's own reference
//! (`plcc_tests::arithmetic`), each from several contents of the memory.
//! `PLCC_CASES=5000000 cargo test --release -p plcc-tests --test pmac arithmetic` runs so many
//! statements. `PLCC_FIRST` is the seed of the first program.
#![allow(clippy::unwrap_used, clippy::panic)]

use plcc_abi::pmac::{Controller, Layout, PmacTables, SparseMemory};
use plcc_abi::{Engine, Outcome, Program, Scan, Tables};
use plcc_codegen::{OptLevel, Optimization, Target, compile};
use plcc_diag::SourceMap;
use plcc_frontend::{
    common::{MemoryLoader, Options},
    pmac,
};
use plcc_random::Rng;
use plcc_runtime::{
    Executive,
    native::NativeEngine,
    pmac::{PmacExecutive, PmacOptions},
};
use plcc_tests::arithmetic::{Kinds, Machine, Statements, fill, program};

/// Statements to a program.
const STATEMENTS: usize = 250;

/// How many contents of the memory each program is run from.
const ROUNDS: usize = 8;

fn tables(program: &Program) -> &PmacTables {
    match &program.tables {
        Tables::Pmac(tables) => tables,
        _ => panic!("not PMAC's"),
    }
}

/// A checked program, what is said of its arithmetic, and its engines.
struct Built {
    program: Program,
    explained: String,
    engines: Vec<(&'static str, Box<dyn Engine>)>,
}

fn build(source: &str, all_engines: bool) -> Built {
    let mut sources = SourceMap::new();
    let file = sources.add("random.pmc", source.as_bytes());
    let options = Options::default();
    let (checked, found) = pmac::check(&mut sources, &[file], &MemoryLoader::new(), &options);
    if let Some(error) = found.iter().find(|d| d.is_error()) {
        panic!("{source}\n{}", plcc_diag::render::draw(&sources, error, false));
    }
    let checked = checked.unwrap();
    let lowered = checked.lower().unwrap();
    let native = |opt| -> Box<dyn Engine> {
        let mut module = lowered.module.clone();
        let options = Optimization::from(opt).run(&mut module).0;
        let code = compile(&module, &Target::host().unwrap(), options).unwrap();
        Box::new(NativeEngine::new(&code, &lowered.program).unwrap())
    };
    let mut engines =
        vec![("interp", checked.interpreter()), ("jit speed", native(OptLevel::Speed))];
    if all_engines {
        let ir = |module| Box::new(plcc_ir::interp::Interpreter::new(module));
        let mut optimized = lowered.module.clone();
        plcc_ir::passes::optimize(&mut optimized, OptLevel::Speed);
        engines.push(("jit none", native(OptLevel::None)));
        engines.push(("ir", ir(lowered.module.clone())));
        engines.push(("ir speed", ir(optimized)));
    }
    Built { explained: checked.explain_arithmetic().unwrap(), program: lowered.program, engines }
}

/// The name of what stands at an offset of the image.
fn place(layout: &Layout, offset: usize) -> String {
    let offset = offset as u32;
    let regions = layout.regions();
    let region = regions.iter().rev().find(|r| r.offset <= offset).unwrap();
    format!("{}[{}]", region.name, (offset - region.offset) / 8)
}

/// What differs first, if something does: from which memory, in which engine, where.
fn difference(statements: &Statements, built: &mut Built, seed: u64) -> Option<String> {
    let layout = Layout::new(Controller::Pmac);
    let mut executive = PmacExecutive::new(&built.program, PmacOptions::default()).unwrap();
    let clean = executive.image().to_vec();
    let mut start = clean.clone();
    for round in 0..ROUNDS {
        start.copy_from_slice(&clean);
        fill(&mut start, &layout, &mut Rng::new(seed ^ round as u64), round);
        let mut expected = start.clone();
        let ranges = &tables(&built.program).ranges;
        let image = &mut expected;
        let mut oracle =
            Machine { image, layout: &layout, sparse: SparseMemory::default(), ranges };
        oracle.run(statements);
        for (name, engine) in &mut built.engines {
            let (image, host) = executive.parts();
            image.copy_from_slice(&start);
            let outcome = engine.call(0, None, &mut Scan::new(image, host));
            assert_eq!(outcome, Outcome::End);
            if image == expected {
                continue;
            }
            let at = image.iter().zip(&expected).position(|(a, b)| a != b)?;
            let value = |image: &[u8]| {
                let value = plcc_abi::image::read_f64(image, at as u32 & !7);
                format!("{value:?} ({:#x})", value.to_bits())
            };
            let (ours, theirs) = (value(&expected), value(image));
            let place = place(&layout, at);
            return Some(format!("round {round}, {name}: {place} is {theirs}, not {ours}"));
        }
    }
    None
}

/// The fewest statements that still differ.
fn shrunk(statements: &Statements, seed: u64) -> String {
    let differs = |all: &Statements| difference(all, &mut build(&all.to_string(), true), seed);
    let mut kept = statements.clone();
    let mut size = kept.all.len().div_ceil(2);
    while size > 0 {
        let mut at = 0;
        while at < kept.all.len() {
            let mut fewer = kept.clone();
            fewer.all.drain(at..(at + size).min(kept.all.len()));
            if !fewer.all.is_empty() && differs(&fewer).is_some() {
                kept = fewer;
            } else {
                at += size;
            }
        }
        size /= 2;
    }
    let text = kept.to_string();
    let named = |line: &&str| match line.split_once("->") {
        Some((name, _)) => kept.all.iter().any(|s| uses(&s.to_string(), name)),
        None => true,
    };
    let text: Vec<&str> = text.lines().filter(named).collect();
    format!("{}\n{}", differs(&kept).unwrap_or_default(), text.join("\n"))
}

/// Whether a statement names a variable.
fn uses(statement: &str, name: &str) -> bool {
    statement
        .match_indices(name)
        .any(|(at, _)| !statement[at + name.len()..].starts_with(|c: char| c.is_ascii_digit()))
}

/// How many statements are computed in each way, according to `--explain-arithmetic`.
#[derive(Debug, Default)]
struct Share {
    /// In integers.
    integer: usize,
    /// In the 24 bits of L-variables.
    long: usize,
    /// In integers while the P-variables hold integers, which is checked at run time.
    speculated: usize,
    /// Sums and comparisons of what may be integers, in floating point.
    sums: usize,
    /// In floating point for another reason.
    real: usize,
}

impl Share {
    fn count(&mut self, explained: &str, are_long: bool) {
        for line in explained.lines() {
            let mut parts = line.trim().rsplitn(2, ": ");
            let (Some(how), Some(text)) = (parts.next(), parts.next()) else { continue };
            let operator = |signs: &str| text.contains(|c| signs.contains(c));
            if text.ends_with("floating point") || how.starts_with("floating") {
                self.real += 1;
            } else if how == "integer" && are_long {
                self.long += 1;
            } else if how.starts_with("integer while") && operator("&|^%") {
                self.speculated += 1;
            } else if how == "integer" && operator("+-*&|^%<>~") {
                self.integer += 1;
            } else if operator("+-*&|^%<>~(") || text.starts_with("IF") {
                self.sums += 1;
            }
        }
    }
}

#[test]
fn integers_compute_what_floating_point_does() {
    let number = |name| std::env::var(name).ok().and_then(|n| n.parse().ok());
    let cases: usize = number("PLCC_CASES").unwrap_or(4_000);
    let first = number("PLCC_FIRST").unwrap_or(0) as u64;
    let mut share = Share::default();
    for seed in first..first + cases.div_ceil(STATEMENTS) as u64 {
        let kinds = [Kinds::Fields, Kinds::Speculated, Kinds::Any, Kinds::Long][seed as usize % 4];
        let statements = program(seed, kinds, STATEMENTS);
        let mut built = build(&statements.to_string(), seed % 16 < 4);
        if difference(&statements, &mut built, seed).is_some() {
            panic!("seed {seed}: {}", shrunk(&statements, seed));
        }
        share.count(&built.explained, matches!(kinds, Kinds::Long));
        if seed % 400 == 399 {
            println!("up to seed {seed}: {share:?}");
        }
    }
    let Share { integer, long, speculated, sums, real } = share;
    let all = integer + long + speculated + sums + real;
    println!("{all} statements, {ROUNDS} times each: {share:?}");
    // If one of them were rare, its errors would hardly be found.
    assert!(
        10 * integer > all && 20 * speculated > all && 20 * long > all && 5 * real > all,
        "{share:?}"
    );
}

/// Statements whose results were once wrong: the statement, the value of P2 and the value that P1 must
/// get.
#[test]
fn statements_that_were_once_wrong_stay_right() {
    let least = f64::from(i32::MIN);
    let cases = [
        // -2^31 is an integer of 32 bits, its magnitude is not.
        ("P1=ABS(P2)|0", least, -least),
        ("P1=(-P2)|0", least, -least),
        ("P1=(P2*4194304-1+1)%7", least, 4.0),
        // A constant can be -0 too.
        ("P1=P2*P3+(-0)", -1.0, 0.0),
        ("P1=(-0)-P3", 0.0, 0.0),
    ];
    let layout = Layout::new(Controller::Pmac);
    for (statement, p2, expected) in cases {
        let mut built = build(&format!("I5=3\nOPEN PLC 1 CLEAR\n{statement}\nCLOSE\n"), true);
        let mut executive = PmacExecutive::new(&built.program, PmacOptions::default()).unwrap();
        for (name, engine) in &mut built.engines {
            let (image, host) = executive.parts();
            plcc_abi::image::write_f64(image, layout.p_offset(2), p2);
            engine.call(0, None, &mut Scan::new(image, host));
            let value = plcc_abi::image::read_f64(image, layout.p_offset(1));
            assert_eq!(value.to_bits(), f64::to_bits(expected), "{statement} in {name}: {value}");
        }
    }
}
