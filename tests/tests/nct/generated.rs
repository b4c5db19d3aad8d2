//! Generated NCT programs do the same in every engine, compared after each slice.
#![allow(clippy::unwrap_used)]

use std::sync::Arc;

use plcc_abi::Engine;
use plcc_codegen::{OptLevel, Target, compile};
use plcc_diag::SourceMap;
use plcc_frontend::common::{Lowered, MemoryLoader, Options};
use plcc_frontend::nct;
use plcc_ir::Module;
use plcc_ir::interp::Interpreter;
use plcc_random::seeds;
use plcc_runtime::native::NativeEngine;
use plcc_runtime::nct::{NctExecutive, NctOptions};
use plcc_runtime::{Artifact, Executive, Purpose, artifact};
use plcc_tests::gen_nct::generate;
use plcc_tests::gen_pmi::Case;

fn program(case: &Case, seed: u64) -> nct::Program {
    let mut sources = SourceMap::new();
    let file = sources.add("generated.nct", case.source.as_bytes());
    let options = Options::default();
    let (program, all) = nct::check(&mut sources, file, &MemoryLoader::new(), &options);
    let errors: Vec<_> = all
        .iter()
        .filter(|d| d.is_error())
        .map(|d| (d.code, &d.message, sources.line_col(file, d.span.start)))
        .collect();
    assert!(errors.is_empty(), "seed {seed}\n{}\n{errors:?}", case.source);
    program.unwrap()
}

/// Runs a case. Gives the watched values after each slice, the events and the stop as text.
///
/// `safepoints` is the number of safepoints after which :000 is suspended in a slice. With few of them
/// it is suspended almost everywhere.
fn run(
    case: &Case,
    lowered: &plcc_abi::Program,
    engine: &mut dyn Engine,
    safepoints: u32,
) -> Vec<String> {
    let options = NctOptions { level0_safepoints: Some(safepoints), ..NctOptions::default() };
    let mut executive = NctExecutive::new(lowered, options).unwrap();
    let watched: Vec<_> =
        case.watch.iter().map(|n| (n, executive.find(n, Purpose::Watch).unwrap())).collect();
    let mut seen = vec![];
    let mut events = vec![];
    for tick in 0..case.ticks {
        for row in case.stimulus.lines().skip(1) {
            let mut parts = row.split(',');
            if parts.next().unwrap().parse() != Ok(tick) {
                continue;
            }
            let variable = executive.find(parts.next().unwrap(), Purpose::Stimulus).unwrap();
            let value = executive.parse(variable, parts.next().unwrap()).unwrap();
            executive.set(variable, value);
        }
        let result = executive.tick(engine, &mut events);
        for (name, variable) in &watched {
            seen.push(format!("{tick} {name} {}", executive.get(*variable)));
        }
        for (name, variable) in executive.declared() {
            seen.push(format!("{tick} {name} {}", executive.get(variable)));
        }
        if let Err(stop) = result {
            seen.push(format!("{tick} {stop:?}"));
            break;
        }
    }
    seen.push(format!("{events:?}"));
    seen
}

/// Every engine but the statement interpreter, by name.
fn engines(lowered: &Lowered) -> Vec<(&'static str, Box<dyn Engine>)> {
    assert_eq!(plcc_ir::verify::verify(&lowered.module), []);
    let mut best = lowered.module.clone();
    plcc_ir::passes::optimize(&mut best, OptLevel::Speed);
    let native = |module: &Module| -> Box<dyn Engine> {
        let code = compile(module, &Target::host().unwrap()).unwrap();
        Box::new(NativeEngine::new(&code, &lowered.program).unwrap())
    };
    // Written as an artifact, and read back.
    let loaded = |module: &Module| -> Box<dyn Engine> {
        let code = compile(module, &Target::host_baseline().unwrap()).unwrap();
        let read =
            Artifact::parse(&artifact::encode(&lowered.program, &code).unwrap(), None).unwrap();
        assert_eq!(read.program, lowered.program);
        Box::new(NativeEngine::new(&read.code, &read.program).unwrap())
    };
    let walked = |module: &Module| -> Box<dyn Engine> {
        Box::new(Interpreter::new(Arc::new(module.clone())))
    };
    vec![
        ("ir", walked(&lowered.module)),
        ("ir optimised", walked(&best)),
        ("jit none", native(&lowered.module)),
        ("jit speed", native(&best)),
        ("aot none", loaded(&lowered.module)),
        ("aot speed", loaded(&best)),
    ]
}

fn agree(seeds: std::ops::Range<u64>) {
    let mut seen = String::new();
    for seed in seeds {
        let case = generate(seed, 20 + seed as usize % 150);
        let program = program(&case, seed);
        let lowered = program.lower_with_limit(if seed % 3 == 0 { 30 } else { 2000 }).unwrap();
        let safepoints = [40, 7, 2, 1][seed as usize % 4];
        let wanted = run(&case, &lowered.program, &mut program.interpreter(), safepoints);
        for (name, mut engine) in engines(&lowered) {
            let found = run(&case, &lowered.program, engine.as_mut(), safepoints);
            let differs = wanted.iter().zip(&found).find(|(a, b)| a != b);
            let Case { source, stimulus, .. } = &case;
            assert!(differs.is_none(), "seed {seed} {name}: {differs:?}\n{source}\n{stimulus}");
            assert_eq!(wanted.len(), found.len(), "seed {seed} {name}");
        }
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
