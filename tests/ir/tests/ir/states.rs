//! The passes `thread-tests` and `switches` on random state machines: rows of conditions that test the number of a state,
//! most of them with other conditions beside it. Optimised programs leave the same image as the plain ones, and most of
//! them have a switch or fewer tests.
#![allow(clippy::unwrap_used)]

use std::fmt::Write as _;

use plcc_abi::engine::NoHost;
use plcc_abi::{Engine, Scan};
use plcc_ir::interp::Interpreter;
use plcc_ir::passes::{Pass, PassSet, optimize, run};
use plcc_ir::text::parse;
use plcc_ir::{Module, Terminator};
use plcc_random::{Rng, seeds};

use crate::ir_text::IrText;

/// The number of input bits, and that of output bytes.
const COUNT: usize = 8;

/// Writes the function of a state machine.
struct Writer {
    rng: Rng,
    ir: IrText,
    /// How the state is compared: its type, and the bits above the 24 that count (of a field).
    ty: &'static str,
    is_field: bool,
}

impl Writer {
    /// Whether the state has a number.
    fn test(&mut self, number: i64) -> usize {
        let ty = self.ty;
        let mut state = self.ir.inst(ty, "load state:0");
        if self.is_field {
            state = self.ir.inst(ty, &format!("extract_s v{state}, 0, 24"));
        }
        let number = self.ir.inst(ty, &format!("iconst {number}"));
        self.ir.inst("i1", &format!("icmp eq v{state}, v{number}"))
    }

    fn input(&mut self) -> usize {
        let number = self.rng.below(COUNT);
        self.ir.inst("i1", &format!("load inputs:{number}"))
    }

    fn output(&mut self) {
        let (place, number) = (self.rng.below(COUNT), self.rng.below(3));
        let value = self.ir.inst("i8", &format!("iconst {number}"));
        let _ = writeln!(self.ir.text, "store outputs:{place}, v{value}");
    }

    /// A new state, or something else that the statements of a condition may do.
    fn action(&mut self, states: usize) {
        if self.rng.below(4) > 0 {
            let number = self.rng.below(states);
            let value = self.ir.inst(self.ty, &format!("iconst {number}"));
            let _ = writeln!(self.ir.text, "store state:0, v{value}");
        }
        if self.rng.below(3) == 0 {
            self.output();
        }
    }

    /// A condition with its statements, between two blocks.
    fn condition(&mut self, states: usize) {
        let has_inner = self.rng.below(2) == 0;
        if self.rng.below(3) == 0 {
            // A contact that is tested before the state.
            let (inner, input) = (self.ir.blocks, self.input());
            let behind = if has_inner { inner + 5 } else { inner + 2 };
            let _ = writeln!(self.ir.text, "brif v{input}, block{inner}, block{behind}");
            self.ir.block();
            if self.rng.below(8) == 0 {
                self.output();
            }
        }
        let number = self.rng.below(states) as i64;
        let mut terms = vec![self.test(number)];
        for _ in 0..self.rng.below(3) {
            terms.push(self.input());
        }
        if self.rng.below(8) == 0 {
            // A store between the comparison and the branch.
            self.output();
        }
        while terms.len() > 1 {
            let a = terms.swap_remove(self.rng.below(terms.len()));
            let b = terms.swap_remove(self.rng.below(terms.len()));
            terms.push(self.ir.inst("i1", &format!("and v{a}, v{b}")));
        }
        let first = self.ir.blocks;
        let behind = if has_inner { first + 4 } else { first + 1 };
        let _ = writeln!(self.ir.text, "brif v{}, block{first}, block{behind}", terms[0]);
        self.ir.block();
        if has_inner {
            let input = self.input();
            let _ = writeln!(self.ir.text, "brif v{input}, block{}, block{}", first + 1, first + 2);
            for _ in 0..2 {
                self.ir.block();
                self.action(states);
                let _ = writeln!(self.ir.text, "jump block{}", first + 3);
            }
            self.ir.block();
            if self.rng.below(2) == 0 {
                self.output();
            }
        } else {
            self.action(states);
        }
        let _ = writeln!(self.ir.text, "jump block{behind}");
        self.ir.block();
    }
}

fn program(seed: u64) -> Module {
    let mut rng = Rng::new(seed);
    let (ty, is_field) = *rng.pick(&[("i16", false), ("i32", false), ("i32", true), ("i8", false)]);
    let mut w = Writer { rng, ir: IrText::in_block_0(), ty, is_field };
    let states = 3 + w.rng.below(8);
    for _ in 0..4 + w.rng.below(12) {
        w.condition(states);
    }
    let text = format!(
        "image 32\nregion state at 0 size 4\nregion inputs at 8 size 8 bits\nregion outputs at 16 size 8\n\
         task \"scan\" L0\n\nfn \"f\" {{\nblock0 (L0):\n{}return\n}}\n",
        w.ir.text
    );
    parse(&text).unwrap()
}

/// How many switches and branches a program has.
fn branches(module: &Module) -> (usize, usize) {
    let blocks = module.funcs.iter().flat_map(|func| func.blocks());
    let (mut switches, mut tests) = (0, 0);
    for (_, block) in blocks {
        match block.terminator {
            Some(Terminator::Switch { .. }) => switches += 1,
            Some(Terminator::Brif { .. }) => tests += 1,
            _ => {}
        }
    }
    (switches, tests)
}

#[test]
fn state_machines_with_conditions_of_any_form_stay_the_same() {
    let (mut switched, mut programs) = (0, 0);
    for seed in seeds(300) {
        let plain = program(seed);
        let (mut all, mut threaded) = (plain.clone(), plain.clone());
        optimize(&mut all, PassSet::ALL);
        run(&mut threaded, &[Pass::ThreadTests, Pass::Branches, Pass::Switches, Pass::Branches]);
        programs += 1;
        switched += usize::from(branches(&threaded).0 > 0);
        let mut rng = Rng::new(seed);
        let mut engines = [plain, all, threaded].map(Interpreter::new);
        for _ in 0..12 {
            let mut start = [0; 32];
            start[0] = rng.below(11) as u8;
            start[8..16].iter_mut().for_each(|input| *input = rng.below(2) as u8);
            let images = engines.each_mut().map(|engine| {
                let mut image = start;
                for _ in 0..3 {
                    engine.call(0, None, &mut Scan::new(&mut image, &mut NoHost));
                }
                image
            });
            assert_eq!(images[1], images[0], "seed {seed}, all passes");
            assert_eq!(images[2], images[0], "seed {seed}, thread-tests");
        }
    }
    // If few became switches, errors would hardly be found.
    assert!(2 * switched > programs, "{switched} of {programs}");
}
