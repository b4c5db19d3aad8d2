//! No scan of a generated program executes more operations than `plcc check --bound` says.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::sync::Arc;

use plcc::bound::{Bound, bounds};
use plcc::compile;
use plcc::disk::Disk;
use plcc_abi::{Dialect, Engine, Outcome, Program, ResumePoint, Scan};
use plcc_codegen::OptLevel;
use plcc_control::ControlArgs;
use plcc_diag::SourceMap;
use plcc_frontend::common::{Limits, Lowered, Options, ReturnStack};
use plcc_ir::interp::Interpreter;
use plcc_ir::passes::optimize;
use plcc_ir::text;
use plcc_ir::{Module, RegionId, StatementId};
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
    let executive = plcc_control::executive(&program, &ControlArgs::default(), false, None);
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

fn bounds_of(text: &str, returns: Option<ReturnStack>) -> Vec<Bound> {
    let module = text::parse(text).unwrap_or_else(|error| panic!("{error}"));
    bounds(&module, returns)
}

#[test]
fn the_longest_way_counts() {
    let text = "image 8
region vars at 0 size 8
task \"scan\" L0
fn \"a\" {
block0 (L0):
    @0
    v0: i8 = load vars:0
    v1: i1 = bit v0, 0
    brif v1, block1, block2
block1:
    @1
    v2: i8 = iconst 1
    store vars:0, v2
    goto L1
block2:
    @2
    return
}
fn \"b\" {
block0 (L1):
    @3
    v0: i8 = iconst 1
    store vars:1, v0
    return
}
";
    let path = [0, 1, 3].map(StatementId).to_vec();
    assert_eq!(bounds_of(text, None), [Bound { operations: Some(9), path }]);
}

#[test]
fn a_loop_has_no_bound() {
    let text = "image 8
region vars at 0 size 8
task \"scan\" L0
task \"other\" L2
fn \"a\" {
block0 (L0):
    @0
    v0: i8 = load vars:0
    v1: i1 = bit v0, 0
    brif v1, block1, block2
block1:
    @1
    v2: i8 = iconst 1
    store vars:0, v2
    goto L1
block2:
    return
}
fn \"b\" {
block0 (L1):
    @3
    v0: i8 = iconst 1
    store vars:1, v0
    goto L0
block1 (L2):
    return
}
";
    let (endless, short) = (vec![StatementId(3)], vec![]);
    let expected =
        [Bound { operations: None, path: endless }, Bound { operations: Some(1), path: short }];
    assert_eq!(bounds_of(text, None), expected);
}

/// A subroutine of four operations, called twice from a task of seventeen.
const CALLS: &str = "image 64
region stack at 0 size 64
task \"scan\" L2 resume [L3]
fn \"a\" {
block0 (L2):
    @0
    v0: i32 = load stack:60
    v1: i32 = iconst 0
    store stack:0[v0 * 4, 8], v1
    jump block2
block1 (L0):
    @1
    v2: i32 = load stack:60
    v3: i32 = iconst 1
    store stack:0[v2 * 4, 8], v3
    goto L3
block2 (L3):
    @2
    v4: i32 = load stack:60
    v5: i32 = load stack:0[v4 * 4, 8]
    goto_indirect v5
block3 (L1):
    @3
    v6: i32 = load stack:56
    return
}
";

#[test]
fn a_subroutine_that_is_called_twice_is_no_loop() {
    let stack = ReturnStack { region: RegionId(0), offset: 0, depth: 8, pending: None };
    let found = bounds_of(CALLS, Some(stack));
    // The scan is 4 + 3 + 4 + 3 + 2. One that goes on in the subroutine may return to the first
    // call (4 + 3 + 2 more), though to no more than one, which the analysis does not know.
    assert_eq!(found.len(), 1);
    assert!(found[0].operations.is_some_and(|most| most >= 16), "{found:?}");
    let straight = CALLS.replace(" resume [L3]", "");
    let found = bounds_of(&straight, Some(stack));
    let path = [0, 2, 1, 3].map(StatementId).to_vec();
    assert_eq!(found, [Bound { operations: Some(16), path }]);
    // Without the stack a jump to a label by number may lead anywhere.
    assert_eq!(bounds_of(&straight, None)[0].operations, None);
}

#[test]
fn a_subroutine_that_calls_itself_has_no_bound() {
    let stack = ReturnStack { region: RegionId(0), offset: 0, depth: 8, pending: None };
    let recursive = CALLS.replace(
        "    v5: i32 = load stack:0[v4 * 4, 8]\n    goto_indirect v5",
        "    v5: i32 = iconst 1\n    store stack:0[v4 * 4, 8], v5\n    jump block2",
    );
    assert_eq!(bounds_of(&recursive, Some(stack))[0].operations, None);
}
