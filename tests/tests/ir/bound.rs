//! No scan of a generated program executes more operations than `plcc check --bound` says.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::sync::Arc;

use plcc::compile;
use plcc::disk::Disk;
use plcc_abi::{Dialect, Engine, Outcome, Program, ResumePoint, Scan};
use plcc_codegen::OptLevel;
use plcc_diag::SourceMap;
use plcc_frontend::common::{Limits, Lowered, Options};
use plcc_host::args::ControlArgs;
use plcc_host::session;
use plcc_ir::Module;
use plcc_ir::bound::{Bound, ReturnStack, bounds};
use plcc_ir::interp::Interpreter;
use plcc_ir::passes::optimize;
use plcc_tests::{gen_nct, gen_pmac, gen_pmi};

/// The IR interpreter, which checks each scan against its task's bound.
struct Bounded {
    engine: Interpreter,
    bounds: Vec<Bound>,
    /// For each task the most operations that a scan has executed.
    most: Vec<u64>,
}

impl Engine for Bounded {
    fn call(&mut self, task: usize, from: Option<ResumePoint>, scan: &mut Scan<'_>) -> Outcome {
        let before = self.engine.operations();
        let outcome = self.engine.call(task, from, scan);
        let executed = self.engine.operations() - before;
        if let Some(Bound { operations: Some(most), path: _ }) = self.bounds.get(task) {
            assert!(executed <= *most, "task {task} executed {executed} of {most} operations");
        }
        if let Some(most) = self.most.get_mut(task) {
            *most = executed.max(*most);
        }
        outcome
    }
}

fn lowered(dialect: Dialect, source: &str) -> (Program, Module, Option<ReturnStack>) {
    let mut sources = SourceMap::new();
    let file = sources.add("program", source.as_bytes());
    let options = Options { limits: Limits::None, ..Options::default() };
    let (checked, found) = compile::check(&mut sources, &[file], dialect, &Disk, &options);
    let checked = checked.unwrap_or_else(|| panic!("{found:?}\n{source}"));
    let Lowered { program, mut module, return_stack } = checked.lower().unwrap();
    optimize(&mut module, OptLevel::Speed);
    (program, module, return_stack)
}

/// Runs a program and gives for each task the most that a scan has executed, and its bound.
fn run(dialect: Dialect, source: &str, ticks: u32) -> Vec<(u64, Option<u64>)> {
    let (program, module, returns) = lowered(dialect, source);
    let bounds = bounds(&module, returns);
    let most = vec![0; bounds.len()];
    let operations: Vec<_> = bounds.iter().map(|bound| bound.operations).collect();
    let mut engine = Bounded { engine: Interpreter::new(Arc::new(module)), bounds, most };
    let executive = session::executive(&program, &ControlArgs::default(), false, None);
    let mut executive = executive.unwrap();
    let mut events = vec![];
    for _ in 0..ticks {
        if executive.tick(&mut engine, &mut events).is_err() {
            break;
        }
    }
    engine.most.into_iter().zip(operations).collect()
}

#[test]
fn generated_programs_keep_to_their_bounds() {
    for seed in 0..30 {
        for (dialect, source) in [
            (Dialect::Pmi, gen_pmi::generate(seed, 60).source),
            (Dialect::Pmac, gen_pmac::generate(seed, 60).source),
        ] {
            let found = run(dialect, &source, 30);
            assert!(found.iter().all(|(_, bound)| bound.is_some()), "{source}");
        }
        run(Dialect::Nct, &gen_nct::generate(seed, 60).source, 30);
    }
}

/// In straight code the longest way is the only one.
#[test]
fn the_bound_of_straight_code_is_what_it_executes() {
    for (dialect, source) in [
        (Dialect::Pmi, "$LOGICAL\nA,B,C\n$END\nA = B & /C\nB = A ! C\nC = /A\n".to_owned()),
        (Dialect::Nct, ":001\nLF500 +1 SF500\nLF502 *LF500 SF504\nJ1\n:000\nJ0\n".to_owned()),
        (Dialect::Nct, ":001\nC010 C010\nJ1\n:010 LF500 +1 SF500 R\n:000\nJ0\n".to_owned()),
    ] {
        for (most, bound) in run(dialect, &source, 3) {
            let bound = bound.unwrap_or_else(|| panic!("no bound: {source}"));
            // A call has a branch for each of the ways in which it may be refused.
            let spare = if source.contains('C') && dialect == Dialect::Nct { 20 } else { 0 };
            assert!((most..=most + spare).contains(&bound), "{most} of {bound}: {source}");
        }
    }
}

/// Subroutines are called from several places, in other subroutines, by computed numbers, and never
/// end; jumps back are loops.
#[test]
fn subroutines_have_bounds_and_loops_have_none() {
    let bound = |code: &str| {
        let source = format!(":001\n{code}\n:000\nJ0\n");
        run(Dialect::Nct, &source, 3).get(1).and_then(|(_, bound)| *bound)
    };
    let once = bound("C010\nJ1\n:010 LF500 +1 SF500 R").unwrap();
    let twice = bound("C010\nC010\nJ1\n:010 LF500 +1 SF500 R").unwrap();
    let nested = bound("C020\nJ1\n:010 LF500 +1 SF500 R\n:020 C010 C010 R").unwrap();
    assert!(once < twice && twice < nested, "{once} {twice} {nested}");
    assert!(bound("CF500\nCF502\nJ1\n:010 LF500 +1 SF500 R\n:020 C010 R").is_some());
    assert_eq!(bound("C010\nJ1\n:010 LF500 +1 SF500 C010 R"), None, "recursion");
    assert_eq!(bound(":010 LF500 +1 SF500\nG010\nJ1"), None, "a loop");
    assert_eq!(bound("C010\nJ1\n:010 LF500 (F5000) G010 Z R"), None, "a loop in a subroutine");
}

#[test]
fn a_loop_is_named_by_its_line() {
    let (_, module, returns) = lowered(Dialect::Nct, ":001\n:010\nLF500\nG010\nJ1\n:000\nJ0\n");
    let found = bounds(&module, returns);
    let line = |bound: &Bound| {
        let loc = bound.path.first()?;
        module.statements.get(loc.index()).map(|statement| statement.line)
    };
    assert_eq!((found[1].operations, line(&found[1])), (None, Some(4)));
    assert!(found[0].operations.is_some());
}
