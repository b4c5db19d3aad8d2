//! The pass `rows`: random statements that put bits into words, many of which do the same with each bit
//! of a word, and that show texts where such bits are 1. The results stay the same, and most of these
//! programs are changed by the pass.
#![allow(clippy::unwrap_used)]

use std::fmt::Write as _;

use plcc_abi::engine::NoHost;
use plcc_abi::{Engine, Scan};
use plcc_ir::Module;
use plcc_ir::interp::Interpreter;
use plcc_ir::passes::{Pass, PassSet, optimize};
use plcc_ir::text::{parse, print};
use plcc_random::Rng;

use crate::ir_text::IrText;

/// The words of the image that hold rows, 32 bits each.
const WORDS: usize = 10;
/// The bytes of the image: behind those words lies the number of a text.
const SIZE: usize = 4 * WORDS + 4;

/// How the bits of a row are computed; each lane takes the bit with its own number.
#[derive(Clone)]
enum Shape {
    /// The bit of a word, at a distance from the lane's.
    Word(usize, usize),
    /// Any bit of any word.
    Scattered,
    Not(Box<Shape>),
    Binary(&'static str, Box<[Shape; 2]>),
}

/// Writes a program.
struct Writer {
    rng: Rng,
    ir: IrText,
    statements: usize,
}

impl Writer {
    fn shape(&mut self, depth: usize) -> Shape {
        match self.rng.below(if depth == 0 { 4 } else { 9 }) {
            0 => Shape::Scattered,
            1 => Shape::Word(self.rng.below(WORDS), self.rng.below(8)),
            2 | 3 => Shape::Word(self.rng.below(WORDS), 0),
            4 => Shape::Not(Box::new(self.shape(depth - 1))),
            _ => {
                let op = *self.rng.pick(&["and", "or", "xor"]);
                Shape::Binary(op, Box::new([self.shape(depth - 1), self.shape(depth - 1)]))
            }
        }
    }

    /// Writes what computes one lane of a shape, an `i1`.
    fn lane(&mut self, shape: &Shape, number: usize) -> usize {
        match shape {
            Shape::Word(word, distance) => self.bit(*word, (number + distance) % 32),
            Shape::Scattered => {
                let (word, bit) = (self.rng.below(WORDS), self.rng.below(32));
                self.bit(word, bit)
            }
            Shape::Not(shape) => {
                let arg = self.lane(shape, number);
                self.ir.inst("i1", &format!("not v{arg}"))
            }
            Shape::Binary(op, shapes) => {
                let mut args = shapes.each_ref().map(|shape| self.lane(shape, number));
                if self.rng.chance(20) {
                    args.swap(0, 1);
                }
                self.ir.inst("i1", &format!("{op} v{}, v{}", args[0], args[1]))
            }
        }
    }

    fn bit(&mut self, word: usize, bit: usize) -> usize {
        let word = self.ir.inst("i32", &format!("load data:{}", 4 * word));
        let by = self.ir.inst("i32", &format!("iconst {bit}"));
        let word = self.ir.inst("i32", &format!("lshr v{word}, v{by}"));
        self.ir.inst("i1", &format!("bit v{word}, 0"))
    }

    /// Writes a statement that puts a truth value into a bit of a word.
    fn put(&mut self, word: usize, bit: usize, value: usize) {
        let wide = self.ir.inst("i32", &format!("zext v{value}"));
        let by = self.ir.inst("i32", &format!("iconst {bit}"));
        let new = self.ir.inst("i32", &format!("shl v{wide}, v{by}"));
        let old = self.ir.inst("i32", &format!("load data:{}", 4 * word));
        let mask = self.ir.inst("i32", &format!("iconst {}", !(1i32 << bit)));
        let kept = self.ir.inst("i32", &format!("and v{old}, v{mask}"));
        let all = self.ir.inst("i32", &format!("or v{kept}, v{new}"));
        let _ = writeln!(self.ir.text, "store data:{}, v{all}", 4 * word);
    }

    /// Writes a statement that puts a number into a word if a truth value is 1.
    fn show(&mut self, word: usize, value: usize) {
        let old = self.ir.inst("i32", &format!("load data:{}", 4 * word));
        let number = self.rng.below(1000);
        let number = self.ir.inst("i32", &format!("iconst {number}"));
        let new = self.ir.inst("i32", &format!("select v{value}, v{number}, v{old}"));
        let _ = writeln!(self.ir.text, "store data:{}, v{new}", 4 * word);
    }
}

/// A program of a few rows, whose statements are written row by row or lane by lane.
fn program(seed: u64) -> Module {
    let mut w = Writer { rng: Rng::new(seed), ir: IrText::default(), statements: 0 };
    let rows: Vec<(usize, Shape)> =
        (0..1 + w.rng.below(4)).map(|_| (w.rng.below(WORDS), w.shape(3))).collect();
    let (first, count) = (w.rng.below(8), 4 + w.rng.below(20));
    let by_lane = w.rng.chance(50);
    // The rows whose bits show texts. The number of the text seldom lies among the words of the rows.
    let shows: Vec<bool> = rows.iter().map(|_| w.rng.chance(30)).collect();
    let number = if w.rng.chance(10) { w.rng.below(WORDS) } else { WORDS };
    let outer = if by_lane { count } else { rows.len() };
    for a in 0..outer {
        for b in 0..(if by_lane { rows.len() } else { count }) {
            let (row, lane) = if by_lane { (b, a) } else { (a, b) };
            let (to, shape) = rows[row].clone();
            // Now and then a lane is computed in another way, or a word is stored in between.
            let shape = if w.rng.chance(2) { w.shape(2) } else { shape };
            if w.rng.chance(1) {
                let value = w.ir.inst("i32", "iconst 1431655765");
                let word = w.rng.below(WORDS);
                let _ = writeln!(w.ir.text, "store data:{}, v{value}", 4 * word);
            }
            // Each is a statement of its own, so that words are stored more than once.
            let _ = writeln!(w.ir.text, "@{}", w.statements);
            w.statements += 1;
            let value = w.lane(&shape, first + lane);
            w.put(to, first + lane, value);
            if shows[row] {
                w.show(number, value);
            }
        }
    }
    let statement = |n: usize| format!("statement file 0 line {} from 0 to 0\n", n + 1);
    let statements: String = (0..w.statements).map(statement).collect();
    let text = format!(
        "image {SIZE}\nregion data at 0 size {SIZE}\ntask \"scan\" L0\n\nfn \"f\" {{\nblock0 (L0):\n\
         {}return\n}}\n{statements}",
        w.ir.text
    );
    parse(&text).unwrap()
}

#[test]
fn rows_of_bits_are_computed_as_words_and_stay_the_same() {
    let (mut changed, mut guarded) = (0, 0);
    let programs = 400;
    for seed in 0..programs {
        let plain = program(seed);
        let (mut with, mut without) = (plain.clone(), plain.clone());
        optimize(&mut with, PassSet::ALL);
        optimize(&mut without, PassSet::ALL.without(Pass::Rows));
        changed += usize::from(print(&with) != print(&without));
        // Nothing else makes a branch in these programs.
        guarded += usize::from(print(&with).contains("brif"));
        let mut rng = Rng::new(seed);
        let mut engines = [plain, with].map(Interpreter::new);
        for _ in 0..10 {
            let start: Vec<u8> = (0..SIZE).map(|_| rng.bits() as u8).collect();
            let images = engines.each_mut().map(|engine| {
                let mut image = start.clone();
                engine.call(0, None, &mut Scan::new(&mut image, &mut NoHost));
                image
            });
            assert_eq!(images[0], images[1], "seed {seed}, image {start:?}");
        }
    }
    // If few were, errors of the pass would hardly be found.
    assert!(4 * changed > programs as usize, "{changed} of {programs}");
    assert!(20 * guarded > programs as usize, "{guarded} of {programs}");
}
