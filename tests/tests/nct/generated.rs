//! Generated NCT programs do the same in every engine, compared after each slice.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::sync::Arc;

use plcc_abi::Engine;
use plcc_codegen::{CodegenOptions, OptLevel, Optimization, Target, compile};
use plcc_diag::SourceMap;
use plcc_frontend::common::{Lowered, MemoryLoader, Options};
use plcc_frontend::nct;
use plcc_ir::Module;
use plcc_ir::interp::Interpreter;
use plcc_load::Artifact;
use plcc_random::seeds;
use plcc_runtime::native::NativeEngine;
use plcc_runtime::nct::{NctExecutive, NctOptions};
use plcc_runtime::{Executive, Purpose};
use plcc_tests::gen_nct::generate;
use plcc_tests::gen_pmi::Case;
use plcc_tests::idioms::Failure;

/// Checks a program.
///
/// # Errors
/// It has errors.
fn program(case: &Case) -> Result<nct::Program, Failure> {
    let mut sources = SourceMap::new();
    let file = sources.add("generated.nct", case.source.as_bytes());
    let options = Options::default();
    let (program, all) = nct::check(&mut sources, file, &MemoryLoader::new(), &options);
    if let Some(error) = all.iter().find(|d| d.is_error()) {
        return Err(Failure::Invalid(plcc_diag::render::draw(&sources, error, false)));
    }
    Ok(program.unwrap())
}

/// Runs a case. Returns the watched values after each slice, the events and the stop as text.
///
/// `safepoints` is the number of safepoints after which :000 is suspended in a slice. With few of them
/// it is suspended almost everywhere.
fn run(
    case: &Case,
    lowered: &plcc_abi::Program,
    engine: &mut dyn Engine,
    safepoints: u32,
) -> Result<Vec<String>, Failure> {
    let invalid = |why: &dyn std::fmt::Display| Failure::Invalid(why.to_string());
    let options = NctOptions { level0_safepoints: Some(safepoints), ..NctOptions::default() };
    let mut executive = NctExecutive::new(lowered, options).unwrap();
    let watched: Vec<_> = case
        .watch
        .iter()
        .map(|n| (n, executive.names().find(n, Purpose::Watch).unwrap()))
        .collect();
    let mut seen = vec![];
    let mut events = vec![];
    for tick in 0..case.ticks {
        for row in case.stimulus.lines().skip(1) {
            let mut parts = row.split(',');
            if parts.next().unwrap().parse() != Ok(tick) {
                continue;
            }
            let variable = executive.names().find(parts.next().unwrap(), Purpose::Stimulus);
            let variable = variable.map_err(|why| invalid(&why))?;
            let value = executive.names().parse(variable, parts.next().unwrap());
            let value = value.map_err(|why| invalid(&why))?;
            executive.write(variable, value);
        }
        let result = executive.tick(engine, &mut events);
        for (name, variable) in &watched {
            seen.push(format!("{tick} {name} {}", executive.read(*variable)));
        }
        for (name, variable) in executive.names().declared() {
            seen.push(format!("{tick} {name} {}", executive.read(variable)));
        }
        if let Err(stop) = result {
            seen.push(format!("{tick} {stop:?}"));
            break;
        }
    }
    seen.push(format!("{events:?}"));
    Ok(seen)
}

/// An engine with its name.
type Named = (&'static str, Box<dyn Engine>);

/// Every engine but the statement interpreter.
///
/// # Errors
/// The compiler can't make one.
fn engines(lowered: &Lowered) -> Result<Vec<Named>, Failure> {
    if let Some(rule) = plcc_ir::verify::verify(&lowered.module).first() {
        return Err(Failure::refused(rule));
    }
    let mut best = lowered.module.clone();
    let speed = Optimization::from(OptLevel::Speed).run(&mut best).0;
    let none = CodegenOptions::NONE;
    let native = |module: &Module, options| -> Result<Box<dyn Engine>, Failure> {
        let code = compile(module, &Target::host().unwrap(), options).map_err(Failure::refused)?;
        Ok(Box::new(NativeEngine::new(&code, &lowered.program).map_err(Failure::refused)?))
    };
    // Written as an artifact, and read back.
    let loaded = |module: &Module, options| -> Result<Box<dyn Engine>, Failure> {
        let code = compile(module, &Target::host_baseline().unwrap(), options)
            .map_err(Failure::refused)?;
        let read =
            Artifact::parse(&plcc_load::encode(&lowered.program, &code).unwrap(), None).unwrap();
        assert_eq!(read.program, lowered.program);
        Ok(Box::new(NativeEngine::new(&read.code, &read.program).map_err(Failure::refused)?))
    };
    let walked = |module: &Module| -> Box<dyn Engine> {
        Box::new(Interpreter::new(Arc::new(module.clone())))
    };
    Ok(vec![
        ("ir", walked(&lowered.module)),
        ("ir optimised", walked(&best)),
        ("jit none", native(&lowered.module, none)?),
        ("jit speed", native(&best, speed)?),
        ("aot none", loaded(&lowered.module, none)?),
        ("aot speed", loaded(&best, speed)?),
    ])
}

/// Runs a case in all engines, in functions and slices of lengths that depend on the seed. Returns what was seen.
///
/// # Errors
/// How the engines differ; that the program has errors or can't be compiled, too.
pub(super) fn compare(case: &Case, seed: u64) -> Result<Vec<String>, Failure> {
    let program = program(case)?;
    let limit = if seed.is_multiple_of(3) { 30 } else { 2000 };
    let lowered = program.lower_with_limit(limit).map_err(Failure::refused)?;
    let safepoints = [40, 7, 2, 1][seed as usize % 4];
    let wanted = run(case, &lowered.program, &mut program.interpreter(), safepoints)?;
    for (name, mut engine) in engines(&lowered)? {
        let found = run(case, &lowered.program, engine.as_mut(), safepoints)?;
        if let Some((wanted, found)) = wanted.iter().zip(&found).find(|(a, b)| a != b) {
            return Err(Failure::Differs(format!("{name}: {found}, not {wanted}")));
        }
        if wanted.len() != found.len() {
            return Err(Failure::Differs(format!("{name} runs for another number of slices")));
        }
    }
    Ok(wanted)
}

fn agree(seeds: std::ops::Range<u64>) {
    let mut seen = String::new();
    for seed in seeds {
        let case = generate(seed, 20 + seed as usize % 150);
        let wanted = compare(&case, seed).unwrap_or_else(|why| {
            panic!("seed {seed} {why}\n{}\n{}", case.source, case.stimulus);
        });
        seen += wanted.last().map_or("", String::as_str);
        seen += wanted.iter().rev().nth(1).map_or("", String::as_str);
    }
    // Without these events the programs would not reach what is to be compared.
    for event in ["Y710", "CALL DEPTH"] {
        assert!(seen.contains(event), "no program ever had {event}");
    }
}

#[test]
fn generated_programs_agree() {
    agree(seeds(120));
}
