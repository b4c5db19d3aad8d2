//! Bits that are toggled, set and reset under conditions, in bytes and in words of 24 or 32 bits: random programs leave the
//! same image with `fold` alone, with all passes, with some, and without any.
#![allow(clippy::unwrap_used)]

use std::fmt::Write as _;

use plcc_abi::engine::NoHost;
use plcc_abi::{Engine, Scan};
use plcc_codegen::Optimization;
use plcc_ir::interp::Interpreter;
use plcc_ir::passes::{Pass, PassSet, optimize, run};
use plcc_ir::text::parse;
use plcc_ir::{BinaryOp, InstData, Module, verify};
use plcc_random::{Rng, seeds};

use crate::ir_text::IrText;

/// The bits that are bytes.
const BYTES: usize = 6;
/// The words, of which single bits are used.
const WORDS: usize = 2;
/// The bits of a word that are used: few, so that statements meet.
const PLACES: [usize; 5] = [0, 1, 7, 22, 23];

/// A bit of the image.
#[derive(Clone, Copy)]
enum Bit {
    Byte(usize),
    OfWord(usize, usize),
}

/// Writes a function.
struct Writer {
    rng: Rng,
    ir: IrText,
    /// The bits that are kept when one is replaced.
    word_mask: u32,
}

impl Writer {
    fn number(&mut self, ty: &str, number: i64) -> usize {
        self.ir.inst(ty, &format!("iconst {number}"))
    }

    fn any_bit(&mut self) -> Bit {
        if self.rng.chance(40) {
            return Bit::Byte(self.rng.below(BYTES));
        }
        Bit::OfWord(self.rng.below(WORDS), *self.rng.pick(&PLACES))
    }

    fn load_word(&mut self, word: usize) -> usize {
        self.ir.inst("i32", &format!("load words:{}", 4 * word))
    }

    /// A bit of a word that was loaded, as an integer.
    fn field(&mut self, word: usize, place: usize) -> usize {
        let mut low = word;
        if place > 0 {
            let by = self.number("i32", place as i64);
            low = self.ir.inst("i32", &format!("lshr v{word}, v{by}"));
        }
        let one = self.number("i32", 1);
        self.ir.inst("i32", &format!("and v{low}, v{one}"))
    }

    /// A bit as a truth value.
    fn read(&mut self, bit: Bit) -> usize {
        match bit {
            Bit::Byte(at) => self.ir.inst("i1", &format!("load bits:{at}")),
            Bit::OfWord(word, place) => {
                let word = self.load_word(word);
                let low = self.field(word, place);
                let (cond, to) = *self.rng.pick(&[("eq", 1), ("ne", 0), ("eq", 0)]);
                let to = self.number("i32", to);
                self.ir.inst("i1", &format!("icmp {cond} v{low}, v{to}"))
            }
        }
    }

    /// Puts an integer, of which the lowest bit counts, into a bit of a word.
    fn put(&mut self, word: usize, place: usize, value: usize) {
        let old = self.load_word(word);
        let by = self.number("i32", place as i64);
        let moved = self.ir.inst("i32", &format!("shl v{value}, v{by}"));
        let bit = self.number("i32", 1 << place);
        let masked = self.ir.inst("i32", &format!("and v{moved}, v{bit}"));
        let kept = self.number("i32", i64::from((self.word_mask & !(1 << place)) as i32));
        let rest = self.ir.inst("i32", &format!("and v{old}, v{kept}"));
        let new = self.ir.inst("i32", &format!("or v{rest}, v{masked}"));
        let _ = writeln!(self.ir.text, "store words:{}, v{new}", 4 * word);
    }

    /// Writes a truth value to a bit.
    fn write(&mut self, bit: Bit, value: usize) {
        match bit {
            Bit::Byte(at) => {
                let _ = writeln!(self.ir.text, "store bits:{at}, v{value}");
            }
            Bit::OfWord(word, place) => {
                let wide = self.ir.inst("i32", &format!("zext v{value}"));
                self.put(word, place, wide);
            }
        }
    }

    /// A bit becomes its opposite.
    fn toggle(&mut self, bit: Bit) {
        let (Bit::OfWord(word, place), true) = (bit, self.rng.chance(70)) else {
            let old = self.read(bit);
            let new = self.ir.inst("i1", &format!("not v{old}"));
            return self.write(bit, new);
        };
        let loaded = self.load_word(word);
        let old = self.field(loaded, place);
        let most = *self.rng.pick(&[1, 1, 1, 3, 2]);
        let one = self.number("i32", most);
        let new = match self.rng.below(4) {
            0 => self.ir.inst("i32", &format!("xor v{old}, v{one}")),
            1 => {
                let by = self.rng.below(3) as i64;
                let by = self.number("i32", by);
                let moved = self.ir.inst("i32", &format!("shl v{old}, v{by}"));
                self.ir.inst("i32", &format!("not v{moved}"))
            }
            _ => self.ir.inst("i32", &format!("sub v{one}, v{old}")),
        };
        self.put(word, place, new);
    }

    /// What is done to a bit.
    fn action(&mut self, bit: Bit) {
        match self.rng.below(6) {
            0 => {
                let truth = self.rng.chance(50);
                let value = self.number("i1", i64::from(truth));
                self.write(bit, value);
            }
            1 => {
                let other = self.any_bit();
                let (x, y) = (self.read(bit), self.read(other));
                let op = *self.rng.pick(&["xor", "and", "or"]);
                let mut value = self.ir.inst("i1", &format!("{op} v{x}, v{y}"));
                if self.rng.chance(40) {
                    value = self.ir.inst("i1", &format!("not v{value}"));
                }
                self.write(bit, value);
            }
            _ => self.toggle(bit),
        }
    }

    /// A condition of one or two bits.
    fn condition(&mut self) -> usize {
        let bit = self.any_bit();
        let first = self.read(bit);
        if self.rng.chance(50) {
            return first;
        }
        let bit = self.any_bit();
        let second = self.read(bit);
        let second = self.ir.inst("i1", &format!("not v{second}"));
        self.ir.inst("i1", &format!("and v{first}, v{second}"))
    }

    /// One statement: an action, perhaps under a condition, perhaps with another one else.
    fn statement(&mut self) {
        let bit = self.any_bit();
        if self.rng.chance(25) {
            return self.action(bit);
        }
        let cond = self.condition();
        let [then, otherwise, next] = [self.ir.blocks, self.ir.blocks + 1, self.ir.blocks + 2];
        self.ir.blocks += 3;
        let _ = writeln!(self.ir.text, "brif v{cond}, block{then}, block{otherwise}\nblock{then}:");
        self.action(bit);
        let _ = writeln!(self.ir.text, "jump block{next}\nblock{otherwise}:");
        if self.rng.chance(40) {
            let other = self.any_bit();
            let bit = if self.rng.chance(70) { bit } else { other };
            self.action(bit);
        }
        let _ = writeln!(self.ir.text, "jump block{next}\nblock{next}:");
    }
}

fn program(seed: u64) -> Module {
    let mut rng = Rng::new(seed);
    let is_24 = rng.chance(60);
    let word_mask = if is_24 { 0xFF_FFFF } else { u32::MAX };
    let mut w = Writer { rng, ir: IrText::in_block_0(), word_mask };
    for _ in 0..1 + w.rng.below(8) {
        w.statement();
    }
    let words = if is_24 { " words24" } else { "" };
    let text = format!(
        "image 16\nregion bits at 0 size 8 bits\nregion words at 8 size 8{words}\ntask \"scan\" L0\n\n\
         fn \"f\" {{\nblock0 (L0):\n{}return\n}}\n",
        w.ir.text
    );
    parse(&text).unwrap()
}

/// The number of a module's operations of a kind.
fn count(module: &Module, is: impl Fn(&InstData) -> bool) -> usize {
    let blocks = module.funcs().flat_map(|(_, func)| func.blocks().map(move |(_, b)| (func, b)));
    blocks
        .flat_map(|(func, b)| b.insts.iter().map(|&inst| func.inst(inst)))
        .filter(|i| is(i))
        .count()
}

fn is_xor(data: &InstData) -> bool {
    matches!(data, InstData::Binary { op: BinaryOp::Xor, .. })
}

#[test]
fn toggled_bits_of_any_form_stay_the_same() {
    let (mut toggled, mut programs) = (0, 0);
    for seed in seeds(600) {
        let plain = program(seed);
        assert!(verify::verify(&plain).is_empty(), "seed {seed}");
        let mut rng = Rng::new(seed);
        let some = Optimization::some(|| rng.chance(70));
        let (mut all, mut part, mut alone) = (plain.clone(), plain.clone(), plain.clone());
        optimize(&mut all, PassSet::ALL);
        some.run(&mut part);
        run(
            &mut alone,
            &[Pass::Forward, Pass::IfConvert, Pass::Branches, Pass::Forward, Pass::Fold],
        );
        for module in [&all, &part, &alone] {
            assert!(verify::verify(module).is_empty(), "seed {seed}");
        }
        programs += 1;
        toggled += usize::from(count(&all, is_xor) > count(&plain, is_xor));
        let is_24 = !plain.word_regions.is_empty();
        let mut engines = [plain, all, part, alone].map(Interpreter::new);
        for _ in 0..40 {
            let mut start = [0; 16];
            for byte in &mut start[..8] {
                *byte = rng.below(2) as u8;
            }
            for (at, byte) in start[8..].iter_mut().enumerate() {
                *byte = if is_24 && at % 4 == 3 { 0 } else { rng.bits() as u8 };
            }
            let images = engines.each_mut().map(|engine| {
                let mut image = start;
                engine.call(0, None, &mut Scan::new(&mut image, &mut NoHost));
                image
            });
            assert_eq!(images[1], images[0], "seed {seed}, all passes");
            assert_eq!(images[2], images[0], "seed {seed}, some passes");
            assert_eq!(images[3], images[0], "seed {seed}, fold");
        }
    }
    // If few were changed, errors would hardly be found.
    assert!(2 * toggled > programs, "{toggled} of {programs}");
}
