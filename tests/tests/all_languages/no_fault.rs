//! No instruction of compiled code can raise a processor exception (ARCHITECTURE.md: "Nothing can
//! fault"). This checks Cranelift's IR (CLIF) of the examples, the conformance cases and generated
//! programs, before and after the passes.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::path::{Path, PathBuf};

use plcc_abi::{Dialect, machine::Machine};
use plcc_codegen::{CodegenOptions, OptLevel, Optimization, Target, emit};
use plcc_diag::SourceMap;
use plcc_frontend::common::{Controller, Limits, MemoryLoader, Options};
use plcc_frontend::{pmac, pmi};
use plcc_ir::Module;
use plcc_ir_tests::gen_ir;
use plcc_tests::compile::compile;
use plcc_tests::no_fault::faults;
use plcc_tests::{gen_pmac, gen_pmi};

/// Checks the code of a module for x86-64 and ARM64.
fn check(name: &str, module: &Module, options: CodegenOptions) {
    for triple in ["x86_64-unknown-linux-gnu", "aarch64-unknown-linux-gnu"] {
        let target = Target::baseline(triple).unwrap();
        let clif = emit::clif(module, &target, options).unwrap();
        let found = faults(&clif);
        assert!(found.is_empty(), "{name}, {triple}: {found:#?}");
        assert!(clif.contains("return"), "{name}: there was nothing to look at");
    }
}

fn check_before_and_after_passes(name: &str, module: &Module) {
    check(name, module, CodegenOptions::NONE);
    let mut best = module.clone();
    let options = Optimization::from(OptLevel::Speed).run(&mut best).0;
    check(name, &best, options);
}

/// The programs below a folder.
fn sources(folder: &Path, found: &mut Vec<(PathBuf, Dialect)>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            sources(&path, found);
            continue;
        }
        let dialect = match path.extension().and_then(|ending| ending.to_str()) {
            Some("pmi") => Dialect::Pmi,
            Some("nct") => Dialect::Nct,
            Some("plc") if path.components().any(|part| part.as_os_str() == "nct") => Dialect::Nct,
            Some("pmc" | "pmac") => Dialect::Pmac,
            _ => continue,
        };
        found.push((path, dialect));
    }
}

#[test]
fn examples_and_cases_compile_to_code_that_cannot_fault() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut found = vec![];
    sources(&root.join("examples"), &mut found);
    sources(&root.join("tests/conformance"), &mut found);
    let mut looked = 0;
    for (path, dialect) in &found {
        let mut options = Options::default();
        for machine in [path.with_extension("machine.toml"), path.with_file_name("machine.toml")] {
            if let Ok(text) = std::fs::read_to_string(machine) {
                options.machine = Machine::parse(&text).unwrap();
            }
        }
        // Cases that need options in their file `args` are compiled with all that those can allow.
        let generous =
            Options { limits: Limits::None, controller: Controller::Turbo, ..options.clone() };
        let compiled =
            compile(path, *dialect, &options).or_else(|_| compile(path, *dialect, &generous));
        // Some cases have errors on purpose.
        let Ok(compiled) = compiled else { continue };
        let options = [CodegenOptions::NONE, CodegenOptions::ALL];
        for (module, options) in compiled.modules().into_iter().zip(options) {
            check(&path.to_string_lossy(), module, options);
        }
        looked += 1;
    }
    assert!(looked >= 4 && looked * 2 > found.len(), "{looked} of {}", found.len());
}

#[test]
fn generated_ir_compiles_to_code_that_cannot_fault() {
    for seed in 0..60 {
        check_before_and_after_passes(&format!("IR {seed}"), &gen_ir::generate(seed));
    }
}

#[test]
fn generated_programs_compile_to_code_that_cannot_fault() {
    for seed in 0..8 {
        let case = gen_pmi::generate(seed, 30);
        let mut sources = SourceMap::new();
        let file = sources.add("generated.pmi", case.source.as_bytes());
        let (program, _) =
            pmi::check(&mut sources, file, &MemoryLoader::new(), &Options::default());
        check_before_and_after_passes(
            &format!("PMI {seed}"),
            &program.unwrap().lower().unwrap().module,
        );
        let case = gen_pmac::generate_for(seed, 30, true);
        let mut sources = SourceMap::new();
        let file = sources.add("generated.pmc", case.source.as_bytes());
        let options = Options { controller: Controller::Turbo, ..Options::default() };
        let (program, _) = pmac::check(&mut sources, &[file], &MemoryLoader::new(), &options);
        check_before_and_after_passes(
            &format!("PMAC {seed}"),
            &program.unwrap().lower().unwrap().module,
        );
    }
}
