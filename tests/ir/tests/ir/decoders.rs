//! The pass `decoders` on random programs: truth values that are on for several numbers, of a number of any type, a double
//! too, or of a field of a word. The programs leave the same image with the pass, with all passes, and without any.
#![allow(clippy::unwrap_used)]

use std::fmt::Write as _;

use plcc_abi::engine::NoHost;
use plcc_abi::{Engine, Scan};
use plcc_ir::interp::Interpreter;
use plcc_ir::passes::{Pass, PassSet, optimize, run};
use plcc_ir::text::{parse, print};
use plcc_ir::{Module, verify};
use plcc_random::{Rng, seeds};

use crate::ir_text::IrText;

/// The number of output bits.
const OUTPUTS: usize = 8;

/// Writes the function of a decoder.
struct Writer {
    rng: Rng,
    ir: IrText,
}

impl Writer {
    /// Whether a double, or its bits, is a number, which is not always an integer from 0 to 63.
    fn double_comparison(&mut self, ty: &str, number: usize) -> usize {
        let limit = *self.rng.pick(&[8, 32, 64, 70]);
        let mut to = self.rng.below(limit) as f64;
        if self.rng.chance(10) {
            to = *self.rng.pick(&[-0.0, -1.0, 2.5, 4_294_967_299.0]);
        }
        if ty == "i64" {
            let to = self.ir.inst(ty, &format!("iconst {}", to.to_bits() as i64));
            return self.ir.inst("i1", &format!("icmp eq v{number}, v{to}"));
        }
        let to = self.ir.inst("f64", &format!("fconst {to:?}"));
        let args = if self.rng.chance(20) { [to, number] } else { [number, to] };
        self.ir.inst("i1", &format!("fcmp eq v{}, v{}", args[0], args[1]))
    }

    /// Whether a number, or its lowest bits by a mask, or a field of it, is another one.
    fn comparison(&mut self, ty: &str, bits: u32, number: usize, field: usize) -> usize {
        let limit = *self.rng.pick(&[8, 32, 64, 70]);
        let to = self.rng.below(limit) as i64 - i64::from(self.rng.chance(5));
        let compared = match field {
            0 => number,
            1 => {
                let kept = self.ir.inst(ty, "iconst 15");
                self.ir.inst(ty, &format!("and v{number}, v{kept}"))
            }
            _ => {
                let op = self.rng.pick(&["extract_u", "extract_s"]);
                self.ir.inst(ty, &format!("{op} v{number}, 1, 6"))
            }
        };
        let to = (to << (64 - bits)) >> (64 - bits);
        let to = self.ir.inst(ty, &format!("iconst {to}"));
        self.ir.inst("i1", &format!("icmp eq v{compared}, v{to}"))
    }

    /// An output that is on if any of several comparisons holds, or an input.
    fn output(&mut self, ty: &str, bits: u32, number: usize, field: usize) {
        let mut terms: Vec<usize> = vec![];
        for _ in 0..1 + self.rng.below(6) {
            terms.push(match ty {
                "f64" | "i64" => self.double_comparison(ty, number),
                _ => self.comparison(ty, bits, number, field),
            });
        }
        if self.rng.chance(30) {
            terms.push(self.ir.inst("i1", "load inputs:0"));
        }
        while terms.len() > 1 {
            let a = terms.swap_remove(self.rng.below(terms.len()));
            let b = terms.swap_remove(self.rng.below(terms.len()));
            let both = self.ir.inst("i1", &format!("or v{a}, v{b}"));
            terms.push(both);
            if self.rng.chance(10) {
                let place = self.rng.below(OUTPUTS);
                let _ = writeln!(self.ir.text, "store outputs:{place}, v{both}");
            }
        }
        let place = self.rng.below(OUTPUTS);
        let _ = writeln!(self.ir.text, "store outputs:{place}, v{}", terms[0]);
    }
}

fn program(seed: u64) -> Module {
    let mut w = Writer { rng: Rng::new(seed), ir: IrText::default() };
    let (ty, bits) = *w.rng.pick(&[("i8", 8), ("i16", 16), ("i32", 32), ("f64", 64), ("i64", 64)]);
    let numbers = [0, 8].map(|at| w.ir.inst(ty, &format!("load numbers:{at}")));
    for _ in 0..1 + w.rng.below(6) {
        let (number, field) = (*w.rng.pick(&numbers), w.rng.below(3));
        w.output(ty, bits, number, field);
    }
    let text = format!(
        "image 32\nregion numbers at 0 size 16\nregion inputs at 16 size 8 bits\nregion outputs at 24 size 8 bits\n\
         task \"scan\" L0\n\nfn \"f\" {{\nblock0 (L0):\n{}return\n}}\n",
        w.ir.text
    );
    parse(&text).unwrap()
}

/// A number as a double, or now and then another double whose lowest bits or rounding make that number.
fn double(number: u32, rng: &mut Rng) -> f64 {
    let number = f64::from(number);
    match rng.below(12) {
        0 => number + 0.5,
        1 => -number,
        2 => number + 4_294_967_296.0,
        3 => *rng.pick(&[f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -2_147_483_648.0, -0.0]),
        _ => number,
    }
}

#[test]
fn decoders_of_any_form_stay_the_same() {
    let (mut decoded, mut programs) = (0, 0);
    for seed in seeds(300) {
        let plain = program(seed);
        let (mut all, mut alone) = (plain.clone(), plain.clone());
        optimize(&mut all, PassSet::ALL);
        run(&mut alone, &[Pass::Decoders]);
        assert!(verify::verify(&alone).is_empty(), "seed {seed}");
        programs += 1;
        decoded += usize::from(print(&alone) != print(&plain));
        let text = print(&plain);
        let is_double = text.contains("f64") || text.contains("i64");
        let mut engines = [plain, all, alone].map(Interpreter::new);
        let mut rng = Rng::new(seed);
        for number in 0..80 {
            let mut start = [0; 32];
            let number = if number < 72 { number } else { rng.bits() as u32 };
            for (at, number) in [(0, number), (8, rng.below(70) as u32)] {
                let bits =
                    if is_double { double(number, &mut rng).to_bits() } else { number.into() };
                start[at..at + 8].copy_from_slice(&bits.to_le_bytes());
            }
            start[16] = rng.below(2) as u8;
            let images = engines.each_mut().map(|engine| {
                let mut image = start;
                engine.call(0, None, &mut Scan::new(&mut image, &mut NoHost));
                image
            });
            assert_eq!(images[1], images[0], "seed {seed}, all passes, {number}");
            assert_eq!(images[2], images[0], "seed {seed}, decoders, {number}");
        }
    }
    // If few were changed, errors would hardly be found.
    assert!(2 * decoded > programs, "{decoded} of {programs}");
}
