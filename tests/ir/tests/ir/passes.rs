//! Random IR does the same before and after each pass, interpreted and as native code: the same image,
//! outcomes and calls of the host.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::fmt::Write;
use std::fs;
use std::path::Path;

use plcc_abi::Outcome;
use plcc_codegen::{CodegenOptions, Optimization, Target, compile};
use plcc_ir::interp::Interpreter;
use plcc_ir::passes::{self, OptLevel, Pass, PassOptions};
use plcc_ir::text::{parse, print};
use plcc_ir::{Module, verify};
use plcc_ir_tests::gen_ir::{generate, trace};
use plcc_ir_tests::{as_if_long, program_of};
use plcc_random::{Rng, seeds};
use plcc_runtime::native::NativeEngine;

/// What can be left out apart from passes, by their names on the command line.
const TECHNIQUES: [&str; 5] =
    ["wide-bits", "vectors", "double-constants", "reload-bits", "by-length"];

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

/// The modules of `tests/ir/filetests`, and random ones.
fn modules() -> Vec<Module> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("filetests");
    let paths = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let paths = paths.filter(|path| path.extension().is_some_and(|ending| ending == "ir"));
    let written = paths.map(|path| {
        let text = fs::read_to_string(&path).unwrap();
        parse(text.split("; becomes").next().unwrap()).unwrap()
    });
    written.chain((0..40).map(generate)).collect()
}

/// Leaves each pass out of the optimiser in turn: some program is another one then. A pass for which
/// that is not so does nothing, or nothing that others don't do as well, and the test above says
/// nothing of it.
#[test]
fn each_pass_does_something_that_the_others_do_not() {
    let modules = modules();
    let optimized = |module: &Module, passes: PassOptions| {
        let mut best = module.clone();
        passes::optimize(&mut best, passes);
        print(&best)
    };
    let all = as_if_long();
    let wanted: Vec<String> = modules.iter().map(|module| optimized(module, all.passes)).collect();
    let mut idle = Pass::ALL.to_vec();
    idle.retain(|&pass| {
        let mut with_all = modules.iter().zip(&wanted);
        with_all.all(|(module, wanted)| optimized(module, all.without(pass).passes) == *wanted)
    });
    assert_eq!(idle, [], "without these passes every program is the same");
}

/// A program of relay logic with this many equations.
fn equations(count: u32) -> Module {
    let mut text = "image 64\nregion bits at 0 size 64 bits\ntask \"scan\" L0\n\n".to_owned();
    text += "fn \"chunk0\" {\nblock0 (L0):\n";
    for at in 0..count {
        let v = 4 * at;
        let (a, b, to) = (at % 61, (at + 7) % 59, (at + 3) % 64);
        writeln!(text, "    v{v}: i1 = load bits:{a}").unwrap();
        writeln!(text, "    v{}: i1 = load bits:{b}", v + 1).unwrap();
        writeln!(text, "    v{}: i1 = xor v{v}, v{}", v + 2, v + 1).unwrap();
        writeln!(text, "    v{}: i1 = and v{}, v{v}", v + 3, v + 2).unwrap();
        writeln!(text, "    store bits:{to}, v{}", v + 3).unwrap();
    }
    parse(&format!("{text}    return\n}}\n")).unwrap()
}

/// Leaves each technique out in turn: the machine code of some program is another one then.
#[test]
fn each_technique_changes_some_code() {
    let code = |module: &Module, how: Optimization| {
        let mut best = module.clone();
        let options = how.run(&mut best).0;
        compile(&best, &Target::host().unwrap(), options).unwrap().bytes.clone()
    };
    let mut modules = modules();
    modules.push(equations(2500));
    // By length means that a program's length decides; elsewhere all techniques are used.
    let mut idle = TECHNIQUES.to_vec();
    idle.retain(|&technique| {
        let with = if technique == "by-length" { Optimization::ALL } else { as_if_long() };
        let without = with.with_changes(&format!("-{technique}")).unwrap();
        modules.iter().all(|module| code(module, with) == code(module, without))
    });
    assert_eq!(idle, [""; 0], "without these techniques all code is the same");
}

/// A random set of passes: each is in it or not, or all are but one.
fn random_passes(seed: u64) -> Optimization {
    let mut rng = Rng::new(seed ^ 0xA11);
    if rng.chance(50) {
        return Optimization::ALL.without(*rng.pick(Pass::ALL));
    }
    Optimization::some(|| rng.chance(50))
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
            let mut native = NativeEngine::new(&code, &program_of(module)).unwrap();
            assert_eq!(trace(&mut native, seed), wanted, "seed {seed}, {options:?}, {random:?}");
        }
    }
}
