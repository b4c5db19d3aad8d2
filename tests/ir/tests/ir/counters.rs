//! The passes `thread-tests` and `if-convert` on random counters: each counts while a contact is closed, is set to a constant
//! otherwise, and is compared with a constant behind that. Optimised programs leave the same image as the plain ones, and
//! most counters lose the branches of their contacts.
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

/// The number of counters at most, of input bits and of output bytes.
const COUNT: usize = 8;

/// Writes the function of the counters.
struct Writer {
    rng: Rng,
    ir: IrText,
}

impl Writer {
    fn branch(&mut self, cond: usize, then: usize, otherwise: usize) {
        let _ = writeln!(self.ir.text, "brif v{cond}, block{then}, block{otherwise}");
        self.ir.block();
    }

    fn jump(&mut self, to: usize) {
        let _ = writeln!(self.ir.text, "jump block{to}");
        self.ir.block();
    }

    fn input(&mut self) -> usize {
        let number = self.rng.below(COUNT);
        self.ir.inst("i1", &format!("load inputs:{number}"))
    }

    fn compare(&mut self, cond: &str, counter: usize, number: usize) -> usize {
        let value = self.ir.inst("i16", &format!("load counters:{}", 2 * counter));
        let number = self.ir.inst("i16", &format!("iconst {number}"));
        self.ir.inst("i1", &format!("icmp {cond} v{value}, v{number}"))
    }

    fn put(&mut self, counter: usize, number: usize) {
        let value = self.ir.inst("i16", &format!("iconst {number}"));
        let _ = writeln!(self.ir.text, "store counters:{}, v{value}", 2 * counter);
    }

    /// A store that has nothing to do with the counter, or none.
    fn output(&mut self, one_of: usize) {
        if self.rng.below(one_of) == 0 {
            let value = self.input();
            let place = self.rng.below(COUNT);
            let _ = writeln!(self.ir.text, "store outputs:{place}, v{value}");
        }
    }

    fn counter(&mut self) {
        let (counter, end) = (self.rng.below(COUNT), 1 + self.rng.below(4));
        let begin = if self.rng.below(4) == 0 { end } else { 0 };
        let first = self.ir.blocks;
        let contact = self.input();
        // The contact, the count, the place behind that, the number without contact, the test.
        self.branch(contact, first, first + 3);
        self.output(4);
        let is_below = self.compare("slt", counter, end);
        self.branch(is_below, first + 1, first + 2);
        let value = self.ir.inst("i16", &format!("load counters:{}", 2 * counter));
        let one = self.ir.inst("i16", "iconst 1");
        let sum = self.ir.inst("i16", &format!("add v{value}, v{one}"));
        let _ = writeln!(self.ir.text, "store counters:{}, v{sum}", 2 * counter);
        self.jump(first + 2);
        self.jump(first + 4);
        self.put(counter, begin);
        self.output(4);
        self.jump(first + 4);
        self.output(4);
        // One test, or two of the same counter.
        for _ in 0..1 + self.rng.below(4) / 3 {
            let number = if self.rng.below(3) > 0 { end } else { self.rng.below(5) };
            let test = self.ir.blocks;
            let is_full = self.compare("eq", counter, number);
            self.branch(is_full, test, test + 1);
            self.output(1);
            if self.rng.below(4) == 0 {
                self.put(counter, 0);
            }
            self.jump(test + 2);
            self.output(2);
            self.jump(test + 2);
        }
    }
}

fn program(seed: u64) -> Module {
    let mut w = Writer { rng: Rng::new(seed), ir: IrText::in_block_0() };
    for _ in 0..1 + w.rng.below(8) {
        w.counter();
    }
    let text = format!(
        "image 40\nregion counters at 0 size 16\nregion inputs at 16 size 8 bits\nregion outputs at 24 size 8 bits\n\
         task \"scan\" L0\n\nfn \"f\" {{\nblock0 (L0):\n{}return\n}}\n",
        w.ir.text
    );
    parse(&text).unwrap()
}

/// How many branches a program has.
fn branches(module: &Module) -> usize {
    let blocks = module.funcs.iter().flat_map(|func| func.blocks());
    blocks.filter(|(_, block)| matches!(block.terminator, Some(Terminator::Brif { .. }))).count()
}

#[test]
fn counters_that_are_tested_behind_their_contact_stay_the_same() {
    // The branches of all programs: as they are written, and with all passes.
    let (mut written, mut left) = (0, 0);
    for seed in seeds(300) {
        let plain = program(seed);
        let (mut all, mut threaded) = (plain.clone(), plain.clone());
        optimize(&mut all, PassSet::ALL);
        run(&mut threaded, &[Pass::IfConvert, Pass::Branches, Pass::Forward, Pass::ThreadTests]);
        written += branches(&plain);
        left += branches(&all);
        let mut rng = Rng::new(seed);
        let mut engines = [plain, all, threaded].map(Interpreter::new);
        for _ in 0..8 {
            let mut start = [0; 40];
            for counter in 0..COUNT {
                start[2 * counter] = rng.below(6) as u8;
            }
            start[16..24].iter_mut().for_each(|input| *input = rng.below(2) as u8);
            let images = engines.each_mut().map(|engine| {
                let mut image = start;
                for _ in 0..3 {
                    engine.call(0, None, &mut Scan::new(&mut image, &mut NoHost));
                }
                image
            });
            assert_eq!(images[1], images[0], "seed {seed}, all passes");
            assert_eq!(images[2], images[0], "seed {seed}, if-convert first");
        }
    }
    // If few counters lost their branches, errors would hardly be found.
    assert!(4 * left < written, "{left} of {written}");
}
