//! The technique `vectors` of code generation: random rows of statements that do the same with neighbouring
//! variables. Native code leaves the same image as the interpreter, and most of these programs have code that
//! differs from that without the technique.
#![allow(clippy::unwrap_used)]

use std::fmt::Write as _;

use plcc_abi::engine::NoHost;
use plcc_abi::{Code, Engine, Scan};
use plcc_codegen::{CodegenOptions, Target, compile};
use plcc_ir::Module;
use plcc_ir::interp::Interpreter;
use plcc_ir::passes::{PassSet, optimize};
use plcc_ir::text::parse;
use plcc_ir_tests::program_of;
use plcc_random::{Rng, seeds};

use crate::ir_text::IrText;
use plcc_runtime::NativeEngine;

/// The number of variables of each type.
const COUNT: usize = 96;

/// The types of variables, each with its size in bytes. Those of a type are in a region of its name.
const TYPES: [(&str, usize); 4] = [("i1", 1), ("i8", 1), ("i16", 2), ("i32", 4)];

/// How the lanes of a row are computed.
#[derive(Clone)]
enum Shape {
    /// Neighbours, from a variable on.
    Neighbours(usize),
    /// Any variable.
    Scattered,
    /// The same variable in all lanes.
    Same(usize),
    Constant(Option<i64>),
    Unary(&'static str, Box<Shape>),
    Binary(&'static str, Box<[Shape; 2]>),
    /// A comparison of numbers of the row's type, which gives a truth value.
    Compare(&'static str, Box<[Shape; 2]>),
    /// A choice by a truth value.
    Select(Box<[Shape; 3]>),
    /// A truth value as a number.
    Extend(Box<Shape>),
}

/// Writes a program.
struct Writer {
    rng: Rng,
    ir: IrText,
    statements: usize,
    /// The number type that is used beside truth values.
    number: &'static str,
}

impl Writer {
    fn shape(&mut self, is_truth: bool, depth: usize) -> Shape {
        let (truth, number) = (true, false);
        let sub = |this: &mut Self, is_truth| this.shape(is_truth, depth - 1);
        match self.rng.below(if depth == 0 { 6 } else { 12 }) {
            0 => Shape::Scattered,
            1..4 => Shape::Neighbours(self.rng.below(COUNT)),
            4 => Shape::Same(self.rng.below(COUNT)),
            5 => Shape::Constant(match self.rng.below(3) {
                0 => None,
                1 => Some(0),
                _ => Some(1),
            }),
            6 if is_truth => Shape::Unary("not", Box::new(sub(self, truth))),
            6 => {
                let op: &&str = self.rng.pick(&["not", "neg"]);
                Shape::Unary(op, Box::new(sub(self, number)))
            }
            7 if is_truth => {
                let cond = ["eq", "ne", "slt", "sle", "sgt", "sge", "ult", "ule", "ugt", "uge"];
                let cond = *self.rng.pick(&cond);
                Shape::Compare(cond, Box::new([sub(self, number), sub(self, number)]))
            }
            7 => Shape::Extend(Box::new(sub(self, truth))),
            8 | 9 => {
                let parts = [sub(self, truth), sub(self, is_truth), sub(self, is_truth)];
                Shape::Select(Box::new(parts))
            }
            _ => {
                let ops: &[&str] = match is_truth {
                    true => &["and", "or", "xor"],
                    false => {
                        &["and", "or", "xor", "add", "sub", "smin", "smax", "umin", "umax", "mul"]
                    }
                };
                let op = *self.rng.pick(ops);
                Shape::Binary(op, Box::new([sub(self, is_truth), sub(self, is_truth)]))
            }
        }
    }

    fn load(&mut self, ty: &str, number: usize) -> usize {
        self.ir.inst(ty, &format!("load {ty}:{}", number % COUNT * size(ty)))
    }

    /// Writes what computes one lane of a shape.
    fn lane(&mut self, is_truth: bool, shape: &Shape, lane: usize) -> usize {
        let ty = if is_truth { "i1" } else { self.number };
        match shape {
            Shape::Neighbours(first) => self.load(ty, first + lane),
            Shape::Scattered => {
                let number = self.rng.below(COUNT);
                self.load(ty, number)
            }
            Shape::Same(number) => self.load(ty, *number),
            Shape::Constant(number) => {
                let any = self.rng.below(200) as i64 - 100;
                let number = number.unwrap_or(if is_truth { any & 1 } else { any });
                self.ir.inst(ty, &format!("iconst {number}"))
            }
            Shape::Unary(op, arg) => {
                let arg = self.lane(is_truth, arg, lane);
                self.ir.inst(ty, &format!("{op} v{arg}"))
            }
            Shape::Binary(op, args) => {
                let mut args = args.each_ref().map(|arg| self.lane(is_truth, arg, lane));
                if *op == "and" && self.rng.chance(20) {
                    args.swap(0, 1);
                }
                self.ir.inst(ty, &format!("{op} v{}, v{}", args[0], args[1]))
            }
            Shape::Compare(cond, args) => {
                let args = args.each_ref().map(|arg| self.lane(false, arg, lane));
                self.ir.inst("i1", &format!("icmp {cond} v{}, v{}", args[0], args[1]))
            }
            Shape::Select(parts) => {
                let cond = self.lane(true, &parts[0], lane);
                let a = self.lane(is_truth, &parts[1], lane);
                let b = self.lane(is_truth, &parts[2], lane);
                self.ir.inst(ty, &format!("select v{cond}, v{a}, v{b}"))
            }
            Shape::Extend(arg) => {
                let arg = self.lane(true, arg, lane);
                self.ir.inst(ty, &format!("zext v{arg}"))
            }
        }
    }

    fn store(&mut self, ty: &str, number: usize, value: usize) {
        let _ = writeln!(self.ir.text, "store {ty}:{}, v{value}", number % COUNT * size(ty));
    }

    /// Writes, now and then, something that keeps stores where they are.
    fn disturb(&mut self) {
        match self.rng.below(300) {
            0 => {
                let value = self.ir.inst("i1", "iconst 1");
                let number = self.rng.below(COUNT);
                self.store("i1", number, value);
            }
            1 => {
                let value = self.ir.inst(self.number, "iconst 77");
                let index = self.ir.inst("i32", "iconst 5");
                let (ty, step) = (self.number, size(self.number));
                let _ = writeln!(self.ir.text, "store {ty}:0[v{index} * {step}, 90], v{value}");
            }
            2 => {
                let number = self.rng.below(COUNT);
                let (from, to) = (self.load(self.number, number), self.rng.below(COUNT));
                self.store(self.number, to, from);
            }
            3 => {
                let late = self.ir.inst("i1", "is_late");
                self.store("i1", 0, late);
            }
            _ => {}
        }
    }
}

fn size(ty: &str) -> usize {
    TYPES.iter().find(|(name, _)| *name == ty).map_or(1, |(_, size)| *size)
}

/// A program of a few rows, whose statements are written row by row or lane by lane.
fn program(seed: u64) -> Module {
    let mut rng = Rng::new(seed);
    let number = *rng.pick(&["i8", "i16", "i32"]);
    let mut w = Writer { rng, ir: IrText::default(), statements: 0, number };
    let mut rows: Vec<(bool, usize, Shape)> = vec![];
    for _ in 0..1 + w.rng.below(4) {
        let is_truth = w.rng.chance(60);
        let shape = w.shape(is_truth, 3);
        rows.push((is_truth, w.rng.below(COUNT), shape));
    }
    // Often as many as fill vectors, since a choice of a number needs that.
    let lanes = if w.rng.chance(50) { 8 * (1 + w.rng.below(4)) } else { 4 + w.rng.below(30) };
    let by_lane = w.rng.chance(50);
    // A number that each lane of the first row may choose, if that row has truth values.
    let mut chosen = w.rng.chance(40).then(|| w.load(number, 0));
    let step = w.rng.below(3) as i64 - 1;
    for a in 0..if by_lane { lanes } else { rows.len() } {
        for b in 0..if by_lane { rows.len() } else { lanes } {
            let (row, lane) = if by_lane { (b, a) } else { (a, b) };
            let (is_truth, to, shape) = rows[row].clone();
            // Now and then a lane is computed in another way.
            let shape = if w.rng.chance(1) { w.shape(is_truth, 2) } else { shape };
            let _ = writeln!(w.ir.text, "@{}", w.statements);
            w.statements += 1;
            w.disturb();
            let value = w.lane(is_truth, &shape, lane);
            w.store(if is_truth { "i1" } else { number }, to + lane, value);
            if let Some(before) = chosen
                && is_truth
                && row == 0
            {
                // Now and then a number does not fit the others.
                let number_here = 50 + step * lane as i64 + i64::from(w.rng.chance(3));
                let constant = w.ir.inst(number, &format!("iconst {number_here}"));
                chosen =
                    Some(w.ir.inst(number, &format!("select v{value}, v{constant}, v{before}")));
            }
        }
    }
    if let Some(chosen) = chosen {
        w.store(number, 1, chosen);
    }
    let (mut regions, mut at) = (String::new(), 0);
    for (ty, size) in TYPES {
        let bits = if ty == "i1" { " bits" } else { "" };
        let _ = writeln!(regions, "region {ty} at {at} size {}{bits}", COUNT * size);
        at += COUNT * size;
    }
    let statement = |n: usize| format!("statement file 0 line {} from 0 to 0\n", n + 1);
    let statements: String = (0..w.statements).map(statement).collect();
    let text = format!(
        "image {at}\n{regions}task \"scan\" L0\n\nfn \"f\" {{\nblock0 (L0):\n{}return\n}}\n{statements}",
        w.ir.text
    );
    parse(&text).unwrap()
}

/// This technique alone.
const VECTORS: CodegenOptions = CodegenOptions { vectors: true, ..CodegenOptions::NONE };

fn code(module: &Module, options: CodegenOptions) -> Code {
    compile(module, &Target::host().unwrap(), options).unwrap()
}

fn engine(module: &Module, options: CodegenOptions) -> NativeEngine {
    NativeEngine::new(&code(module, options), &program_of(module)).unwrap()
}

#[test]
fn rows_of_statements_are_computed_in_vectors_and_stay_the_same() {
    let (mut changed, mut programs) = (0, 0);
    for seed in seeds(300) {
        let plain = program(seed);
        let mut best = plain.clone();
        optimize(&mut best, PassSet::ALL);
        // Without any pass, so that the rows are as they were written.
        let without = code(&plain, CodegenOptions::NONE);
        programs += 1;
        changed += usize::from(code(&plain, VECTORS).bytes != without.bytes);
        let mut rng = Rng::new(seed);
        let mut engines = [engine(&plain, VECTORS), engine(&best, CodegenOptions::ALL)];
        let mut interpreter = Interpreter::new(plain);
        for _ in 0..5 {
            let mut start: Vec<u8> = (0..COUNT * 8).map(|_| rng.bits() as u8).collect();
            start[..COUNT].iter_mut().for_each(|truth| *truth &= 1);
            let run = |engine: &mut dyn Engine| {
                let mut image = start.clone();
                engine.call(0, None, &mut Scan::new(&mut image, &mut NoHost));
                image
            };
            let wanted = run(&mut interpreter);
            for engine in &mut engines {
                assert_eq!(run(engine), wanted, "seed {seed}");
            }
        }
    }
    // If few were, errors would hardly be found. Only on x86-64 vectors are used.
    if cfg!(target_arch = "x86_64") {
        assert!(3 * changed > programs, "{changed} of {programs}");
    }
}

#[test]
fn a_variable_that_all_statements_of_a_row_use_is_spread_by_one_instruction() {
    let rows = 64;
    let mut text = String::from(
        "image 256\nregion i1 at 0 size 256 bits\ntask \"scan\" L0\n\nfn \"f\" {\nblock0 (L0):\nv0: i1 = iconst 1\n",
    );
    for row in 0..rows {
        let (input, enable, and) = (3 * row + 1, 3 * row + 2, 3 * row + 3);
        let _ = writeln!(text, "v{input}: i1 = load i1:{row}");
        let _ = writeln!(text, "v{enable}: i1 = load i1:200");
        let _ = writeln!(text, "v{and}: i1 = and v{input}, v{enable}");
        let _ = writeln!(text, "store i1:{}, v{and}", 100 + row);
    }
    text.push_str("return\n}\n");
    let module = parse(&text).unwrap();
    let length = code(&module, VECTORS).bytes.len();
    // A vector of 16 lanes takes some 40 bytes; with an instruction for each lane it takes more than 100.
    if cfg!(target_arch = "x86_64") {
        assert!(length < 4 * 80, "{length}");
    }
    let mut image = vec![0; 256];
    image[..64].iter_mut().step_by(3).for_each(|truth| *truth = 1);
    image[200] = 1;
    engine(&module, VECTORS).call(0, None, &mut Scan::new(&mut image, &mut NoHost));
    assert_eq!(image[100..164], image[..64]);
}
