//! Random IR does the same before and after each pass, interpreted and as native code: the same image,
//! outcomes and calls of the host.
#![allow(clippy::unwrap_used, clippy::panic)]

use plcc_abi::{Outcome, Program, Tables};
use plcc_codegen::{CodegenOptions, Optimization, Target, compile};
use plcc_ir::interp::Interpreter;
use plcc_ir::passes::{self, OptLevel, Pass};
use plcc_ir::{Module, verify};
use plcc_random::{Rng, seeds};
use plcc_runtime::native::NativeEngine;
use plcc_tests::gen_ir::{generate, trace};

fn interpreted(module: &Module, seed: u64) -> Vec<(Vec<u8>, Outcome, u64)> {
    trace(&mut Interpreter::new(module.clone()), seed)
}

fn assert_sound(module: &Module, what: &str) {
    let errors: Vec<String> = verify::verify(module).iter().map(ToString::to_string).collect();
    assert!(errors.is_empty(), "{what}: {errors:#?}");
}

#[test]
fn each_pass_keeps_what_a_program_does() {
    for seed in seeds(300) {
        let module = generate(seed);
        assert_sound(&module, &format!("seed {seed}"));
        let wanted = interpreted(&module, seed);
        for &pass in Pass::ALL {
            let mut changed = module.clone();
            passes::run(&mut changed, &[pass]);
            assert_eq!(interpreted(&changed, seed), wanted, "seed {seed}, {}", pass.name());
        }
        let mut rng = Rng::new(seed);
        let row: Vec<Pass> = (0..10).map(|_| *rng.pick(Pass::ALL)).collect();
        let mut changed = module.clone();
        passes::run(&mut changed, &row);
        assert_eq!(interpreted(&changed, seed), wanted, "seed {seed}, {row:?}");
        let mut best = module.clone();
        passes::optimize(&mut best, OptLevel::Speed);
        assert_sound(&best, &format!("seed {seed}, optimised"));
        assert_eq!(interpreted(&best, seed), wanted, "seed {seed}, optimised");
        let some = random_passes(seed);
        let mut changed = module.clone();
        some.run(&mut changed);
        assert_eq!(interpreted(&changed, seed), wanted, "seed {seed}, {some:?}");
    }
}

/// A random set of passes: each is in it or not, or all are but one.
fn random_passes(seed: u64) -> Optimization {
    let mut rng = Rng::new(seed ^ 0xA11);
    if rng.chance(50) {
        return Optimization::ALL.without(*rng.pick(Pass::ALL));
    }
    Optimization::some(|| rng.chance(50))
}

fn program(module: &Module) -> Program {
    Program {
        image_size: module.image_size,
        regions: module.regions.clone(),
        tasks: module.tasks.clone(),
        tables: Tables::Pmi(Default::default()),
        files: vec![],
    }
}

#[test]
fn native_code_does_what_the_interpreter_does() {
    for seed in seeds(120) {
        let module = generate(seed);
        let wanted = interpreted(&module, seed);
        let mut best = module.clone();
        let speed = Optimization::ALL.run(&mut best).0;
        let random = random_passes(seed);
        let mut changed = module.clone();
        let some = random.run(&mut changed).0;
        let none = CodegenOptions::NONE;
        for (module, options) in [(&module, none), (&best, speed), (&changed, some)] {
            let target = Target::host().unwrap();
            let code = compile(module, &target, options).unwrap();
            let mut native = NativeEngine::new(&code, &program(module)).unwrap();
            assert_eq!(trace(&mut native, seed), wanted, "seed {seed}, {options:?}, {random:?}");
        }
    }
}
