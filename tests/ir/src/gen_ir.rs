//! Generates random valid IR with every operation, every kind of access and terminator, a region of
//! finite doubles, loops that a counter in the image bounds, and values that are passed to blocks.

use plcc_abi::{Engine, Host, HostFn, Outcome, Region, Scan, SourceLine, TrapCode, TrapSite};
use plcc_ir::{
    Address, BinaryOp, BitGroups, ChunkBuilder, ConvertOp, ExtractOp, Field, FloatCond,
    InstBuilder, IntCond, Module, Place, RegionId, SourceFile, Statement, Type, UnaryOp, Value,
};

use plcc_random::Rng;

/// The size of the image in bytes.
const IMAGE: usize = 208;

/// The offset of the counter that bounds loops.
const FUEL: u32 = 160;

/// The offset of the doubles that are finite and never -0.
const FINITE: u32 = 168;
/// How many of these there are.
const FINITE_COUNT: u32 = 3;

/// The offset of the words of 24 bits.
const WORDS: u32 = 192;
/// How many of these there are.
const WORD_COUNT: u32 = 4;

/// The bytes that hold truth values.
const BITS: [std::ops::Range<usize>; 2] = [0..24, 144..160];

fn region(name: &str, offset: u32, size: u32, bits: bool) -> Region {
    Region { name: name.into(), offset, size, bits }
}

/// Runs some scans. Gives the image and the outcome after each, and a hash of the calls of the host.
pub fn trace(engine: &mut dyn Engine, seed: u64) -> Vec<(Vec<u8>, Outcome, u64)> {
    let mut rng = Rng::new(seed);
    let mut image: Vec<u8> = (0..IMAGE).map(|_| rng.bits() as u8).collect();
    let mut host = Mixer::default();
    let (mut rows, mut from) = (vec![], None);
    for _ in 0..6 {
        for bits in BITS {
            image[bits].iter_mut().for_each(|byte| *byte &= 1);
        }
        image[160..168].copy_from_slice(&20u64.to_le_bytes());
        for word in image[WORDS as usize..].chunks_exact_mut(4) {
            word[3] = 0;
        }
        for double in image[FINITE as usize..WORDS as usize].chunks_exact_mut(8) {
            let bits = rng.bits();
            // Most are integers, as in programs.
            let value = match rng.below(4) {
                0 => f64::from(bits as i32) / 16.0,
                1 => f64::from(bits as i32),
                _ => f64::from(bits as i8),
            };
            double.copy_from_slice(&value.to_le_bytes());
        }
        let outcome = engine.call(0, from, &mut Scan::new(&mut image, &mut host));
        from = outcome.resume_point();
        rows.push((image.clone(), outcome, host.0));
        for _ in 0..4 {
            let at = rng.below(IMAGE);
            image[at] = rng.bits() as u8;
        }
    }
    rows
}

/// The operations on one double.
const FLOAT_OPS: [UnaryOp; 7] = [
    UnaryOp::Fneg,
    UnaryOp::Fabs,
    UnaryOp::Fsqrt,
    UnaryOp::Ffloor,
    UnaryOp::Fceil,
    UnaryOp::Ftrunc,
    UnaryOp::Ffinite,
];

struct Gen {
    rng: Rng,
    b: ChunkBuilder,
    /// The values that the next instruction may use.
    pool: Vec<(Value, Type)>,
    /// The places at which the task can be suspended.
    suspended: Vec<Place>,
}

/// A random module with one task, the same for the same seed.
pub fn generate(seed: u64) -> Module {
    let mut rng = Rng::new(seed);
    let regions = vec![
        region("bits", 0, 24, true),
        region("data", 24, 104, false),
        region("lines", 128, 16, false),
        region("line_bits", 144, 16, true),
        region("fuel", FUEL, 8, false),
        region("finite", FINITE, FINITE_COUNT * 8, false),
        region("words", WORDS, WORD_COUNT * 4, false),
    ];
    let limit = 20 + rng.below(200);
    let mut b = ChunkBuilder::new(IMAGE as u32, regions).with_limit(limit);
    b.finite_region(RegionId(5));
    b.word_region(RegionId(6));
    let mut this = Gen { rng, b, pool: vec![], suspended: vec![] };
    this.program();
    this.b.resume_points(0, &this.suspended);
    let mut module = this.b.finish();
    let text = "a statement ;; of it\n".repeat(module.statements.len());
    module.files.push(SourceFile { name: "generated.pmi".into(), text });
    module
}

/// A host whose calls read and write the image, and whose state depends on every argument that it was
/// given.
#[derive(Clone, Debug, Default)]
pub struct Mixer(pub u64);

impl Host for Mixer {
    fn call(&mut self, image: &mut [u8], function: HostFn, args: [u64; 4]) -> u64 {
        // Passes know what some of these functions give.
        if let Some(result) = plcc_abi::pmac::pure_functions::call(function, args) {
            return result;
        }
        let mut sum = args.iter().fold(function as u64, |sum, arg| {
            sum.rotate_left(7).wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ arg
        });
        if !function.is_pure() {
            sum = image.iter().fold(sum, |sum, &byte| sum.rotate_left(3) ^ u64::from(byte));
            if let Some(byte) = image.get_mut(24 + (sum % 136) as usize) {
                *byte = byte.wrapping_add(1) & 1;
            }
            if let Some(byte) = image.get_mut(WORDS as usize + 4 * (sum % 4) as usize) {
                *byte ^= 1 << (sum >> 8 & 7);
            }
            self.0 = self.0.rotate_left(9) ^ sum;
        }
        match function.signature().1 {
            Some(plcc_abi::HostType::F64) => ((sum as i32) as f64 / 8.0).to_bits(),
            _ => sum,
        }
    }
}

impl Gen {
    /// A trap: without a site, at a new one, or at one whose number is computed and may not exist.
    fn trap(&mut self) {
        if self.rng.chance(30) {
            return self.b.trap(TrapCode::Timeout);
        }
        let statement = SourceLine { file: 0, line: 1 + self.rng.below(100) as u32 };
        let array = self.rng.chance(70).then(|| self.rng.below(1000) as u32);
        let site = TrapSite { code: TrapCode::ArrayBounds, statement, array };
        let site = self.b.trap_site(site);
        let site = match self.rng.chance(50) {
            true => self.b.func().constant(Type::I32, site.into()),
            false => self.b.func().load(Type::I32, Address::fixed(RegionId(1), 0)),
        };
        let index = self.b.func().load(Type::I32, Address::fixed(RegionId(1), 4));
        self.b.func().trap_at(site, index);
    }

    fn program(&mut self) {
        let count = 4 + self.rng.below(24);
        let places: Vec<Place> = (0..=count).map(|_| self.b.place()).collect();
        let start = self.b.place();
        self.b.bind(start);
        self.b.task("scan", start);
        for at in 0..count {
            if self.rng.chance(40) {
                self.b.bind(places[at]);
                self.pool.clear();
            }
            let line = at as u32 + 1;
            let start = at as u32 * 21;
            if self.b.func().is_terminated() {
                self.pool.clear();
            }
            let place = |b: &mut ChunkBuilder| {
                let func = b.func().func();
                (func.name().to_owned(), func.block_count())
            };
            let before = place(&mut self.b);
            self.b.statement(Statement { file: 0, line, start, end: start + 20 });
            if place(&mut self.b) != before {
                self.pool.clear();
            }
            for _ in 0..1 + self.rng.below(5) {
                self.action();
            }
            if self.rng.chance(45) {
                self.branch(&places, at);
            }
        }
        // Labels that were jumped to and not yet placed all stand here.
        self.b.ret();
    }

    fn branch(&mut self, places: &[Place], at: usize) {
        let ahead = |rng: &mut Rng| places[at + 1 + rng.below(places.len() - at - 1)];
        match self.rng.below(12) {
            0..5 => {
                let cond = self.value(Type::I1);
                let to = ahead(&mut self.rng);
                let next = self.b.place();
                if self.rng.chance(50) {
                    self.b.brif(cond, next, to);
                } else {
                    self.b.brif(cond, to, next);
                }
                self.b.bind(next);
            }
            5 => {
                let to = ahead(&mut self.rng);
                self.b.jump(to);
            }
            6 => {
                let arg = self.value(Type::I32);
                let arg = self.b.func().binary_imm(BinaryOp::And, arg, 3);
                let targets = (0..3).map(|_| ahead(&mut self.rng)).collect();
                let default = ahead(&mut self.rng);
                self.b.switch(arg, targets, default);
            }
            7 => {
                let to = ahead(&mut self.rng);
                self.b.suspend(to);
                if !self.suspended.contains(&to) {
                    self.suspended.push(to);
                }
            }
            8 => {
                let cond = self.value(Type::I1);
                let (stop, next) = (self.b.place(), self.b.place());
                self.b.brif(cond, stop, next);
                self.b.bind(stop);
                self.trap();
                self.b.bind(next);
            }
            9 => {
                let label = self.b.label(places[at + 1]);
                let number = self.b.func().constant(Type::I32, label.0.into());
                self.b.goto_indirect(number);
            }
            _ => {
                // Jumps back until the counter is used up.
                let at_fuel = Address::fixed(RegionId(4), 0);
                let fuel = self.b.func().load(Type::I32, at_fuel);
                let less = self.b.func().binary_imm(BinaryOp::Sub, fuel, 1);
                self.b.func().store(at_fuel, less);
                let empty = self.b.func().icmp_imm(IntCond::Sle, less, 0);
                let (next, back) = (self.b.place(), self.rng.below(at + 1));
                self.b.brif(empty, next, places[back]);
                self.b.bind(next);
            }
        }
        self.pool.clear();
    }

    fn action(&mut self) {
        match self.rng.below(24) {
            20 | 21 => self.bits_of_word(),
            22 => self.states(),
            23 => self.local_bits(),
            0..8 => self.store(),
            8 => self.host_call(),
            9 | 10 => self.diamond(),
            11 => self.pure_call(),
            12 => self.finite_double(),
            _ => {
                let ty = *self.rng.pick(&Type::ALL);
                self.op(ty, 2);
            }
        }
    }

    /// Unpacks a word, reads and writes some of its bits as local bits, and packs it.
    fn local_bits(&mut self) {
        let first = 8 * self.rng.below(4) as u32;
        let groups = BitGroups { first, groups: 1 + self.rng.below(15) as u8 };
        let word = self.value(Type::I32);
        let b = self.b.func();
        b.local_bits(first + 32);
        b.unpack(word, groups);
        let bits: Vec<u32> =
            groups.iter().flat_map(|group| groups.bits(group)).map(|bit| bit as u32).collect();
        for _ in 0..1 + self.rng.below(6) {
            let at = Address::fixed(RegionId::LOCAL_BITS, *self.rng.pick(&bits));
            match self.rng.below(4) {
                0 => {
                    let word = self.value(Type::I32);
                    self.b.func().unpack(word, groups);
                }
                1 => {
                    let value = self.value(Type::I1);
                    self.b.func().store(at, value);
                }
                2 => {
                    let value = self.b.func().load(Type::I1, at);
                    self.pool.push((value, Type::I1));
                }
                _ => {
                    let groups = groups.iter().filter(|_| self.rng.chance(70));
                    let groups = groups.fold(0, |groups, group| groups | 1 << group);
                    if groups != 0 {
                        let value = self.b.func().pack(BitGroups { first, groups });
                        self.pool.push((value, Type::I32));
                    }
                }
            }
        }
        let value = self.b.func().pack(groups);
        self.pool.push((value, Type::I32));
    }

    fn store(&mut self) {
        let ty = *self.rng.pick(&Type::ALL);
        let value = if ty == Type::F64 { self.number() } else { self.value(ty) };
        let at = self.address(ty);
        self.b.func().store(at, value);
    }

    /// A call of a function that is pure; passes compute some of these with integers.
    fn pure_call(&mut self) {
        let binary =
            [HostFn::PmacMod, HostFn::PmacAnd, HostFn::PmacOr, HostFn::PmacXor, HostFn::Fmod];
        let (x, y) = (self.number(), self.number());
        let (function, args) = match self.rng.below(8) {
            0 => (HostFn::PmacBits, vec![x]),
            1 => {
                let (low, high) = (self.b.func().fconst(-8.0), self.b.func().fconst(7.0));
                (HostFn::PmacRange, vec![x, low, high])
            }
            2 => (HostFn::PmacMod, vec![x, self.b.func().fconst(5.0)]),
            _ => (*self.rng.pick(&binary), vec![x, y]),
        };
        let ty = if function == HostFn::PmacBits { Type::I64 } else { Type::F64 };
        let result = self.b.func().host_call(function, &args);
        self.pool.extend(result.map(|value| (value, ty)));
    }

    /// Loads a double that is known to be finite, or stores one.
    fn finite_double(&mut self) {
        let at = Address::fixed(RegionId(5), 8 * self.rng.below(FINITE_COUNT as usize) as u32);
        if self.rng.chance(60) {
            let value = self.b.func().load(Type::F64, at);
            self.pool.push((value, Type::F64));
            return;
        }
        let value = self.value(Type::F64);
        let b = self.b.func();
        let value = b.unary(UnaryOp::Ffinite, value);
        // A sum with 0 is not -0.
        let zero = b.fconst(0.0);
        let value = b.binary(BinaryOp::Fadd, value, zero);
        b.store(at, value);
    }

    fn host_call(&mut self) {
        let (a, b) = (self.value(Type::I32), self.value(Type::I32));
        if self.rng.chance(50) {
            self.b.func().host_call(HostFn::NctHf, &[a, b]);
        } else if let Some(value) = self.b.func().host_call(HostFn::PmacMRead, &[a]) {
            self.pool.push((value, Type::F64));
        }
    }

    /// A branch whose two sides continue at the same block, which may take a value from each.
    fn diamond(&mut self) {
        let cond = self.value(Type::I1);
        let ty = *self.rng.pick(&Type::ALL);
        let valued = self.rng.chance(50);
        let before = self.value(ty);
        let func = self.b.func();
        let (then, other, join) = (func.create_block(), func.create_block(), func.create_block());
        let param = valued.then(|| func.block_param(join, ty));
        func.brif(cond, then, other);
        let kept = self.pool.len();
        let cold = self.rng.chance(30);
        for block in [then, other] {
            self.b.func().switch_to(block);
            self.b.func().set_cold(cold && block == other);
            for _ in 0..self.rng.below(3) {
                match self.rng.below(3) {
                    0 => self.store(),
                    _ => drop(self.op(ty, 1)),
                }
            }
            let value = if self.rng.chance(20) { before } else { self.value(ty) };
            let args: &[Value] = if valued { &[value] } else { &[] };
            self.b.func().jump(join, args);
            self.pool.truncate(kept);
        }
        self.b.func().set_cold(false);
        self.b.func().switch_to(join);
        self.pool.extend(param.map(|param| (param, ty)));
    }

    /// Puts bits and fields into a word, one after the other, and reads some of them.
    fn bits_of_word(&mut self) {
        let region = RegionId(if self.rng.chance(50) { 1 } else { 6 });
        let at = Address::fixed(region, 4 * self.rng.below(3) as u32);
        if region == RegionId(6) && self.rng.chance(10) {
            self.whole_word(at);
        }
        for _ in 0..1 + self.rng.below(5) {
            if self.rng.chance(20) {
                self.diamond();
            }
            let first = self.rng.below(24) as u8;
            let word = self.b.func().load(Type::I32, at);
            if self.rng.chance(40) {
                let bit = self.b.func().extract(ExtractOp::Unsigned, word, Field::bit(first));
                let truth = match self.rng.chance(50) {
                    true => self.b.func().icmp_imm(IntCond::Ne, bit, 0),
                    false => self.b.func().bit(word, first),
                };
                self.pool.extend([(bit, Type::I32), (truth, Type::I1)]);
                if region == RegionId(1) || self.rng.chance(10) {
                    self.pool.push((word, Type::I32));
                }
            }
            let many = if region == RegionId(1) { 30 } else { 5 };
            let width = if self.rng.chance(many) { 1 + self.rng.below(4) as u8 } else { 1 };
            let field = Field { first, width: width.min(24 - first) };
            let bits = match self.rng.chance(60) {
                true => {
                    let truth = self.value(Type::I1);
                    match field.width == 1 && self.rng.chance(50) {
                        true => truth,
                        false => self.b.func().zextend_or_trunc(Type::I32, truth),
                    }
                }
                false => self.value(Type::I32),
            };
            let word = self.b.func().insert(word, bits, field);
            self.b.func().store(at, word);
        }
    }

    /// Reads a word of 24 bits, or a part of it, or stores it as a whole.
    fn whole_word(&mut self, at: Address) {
        match self.rng.below(4) {
            0 => {
                let value = self.value(Type::I32);
                let value = self.b.func().binary_imm(BinaryOp::And, value, 0xFF_FFFF);
                self.b.func().store(at, value);
            }
            1 => {
                let number = self.value(Type::I32);
                let at = Address::indexed(at.region, 0, number, 4, WORD_COUNT);
                let word = self.b.func().load(Type::I32, at);
                self.pool.push((word, Type::I32));
            }
            2 => {
                let half = self.b.func().load(Type::I16, at);
                self.pool.push((half, Type::I16));
            }
            _ => {
                let word = self.b.func().load(Type::I32, at.volatile());
                self.pool.push((word, Type::I32));
            }
        }
    }

    /// A row of conditions on the number of a state, whose statements may change it.
    fn states(&mut self) {
        let ty = *self.rng.pick(&[Type::I16, Type::I32, Type::F64]);
        let at = Address::fixed(RegionId(1), 24);
        let is_field = ty == Type::I32 && self.rng.chance(50);
        let constant = |b: &mut ChunkBuilder, number: usize| match ty {
            Type::F64 => b.func().fconst(number as f64),
            ty => b.func().constant(ty, number as i64),
        };
        if self.rng.chance(70) {
            let first = constant(&mut self.b, self.rng.below(10));
            self.b.func().store(at, first);
        }
        let kept = self.pool.len();
        for state in 0..6 + self.rng.below(6) {
            let now = self.b.func().load(ty, at);
            let number = constant(&mut self.b, state);
            let func = self.b.func();
            let is_here = match ty {
                Type::F64 => func.fcmp(FloatCond::Eq, now, number),
                _ if is_field => {
                    let field = func.binary_imm(BinaryOp::And, now, 0xFF_FFFF);
                    func.icmp(IntCond::Eq, field, number)
                }
                _ => func.icmp(IntCond::Eq, now, number),
            };
            let (arm, next) = (func.create_block(), func.create_block());
            func.brif(is_here, arm, next);
            self.b.func().switch_to(arm);
            if self.rng.chance(40) {
                self.diamond();
            }
            if self.rng.chance(60) {
                let other = constant(&mut self.b, self.rng.below(10));
                self.b.func().store(at, other);
            }
            self.b.func().jump(next, &[]);
            self.pool.truncate(kept);
            self.b.func().switch_to(next);
        }
    }

    /// A double that is a number, so that its bits are the same everywhere.
    fn number(&mut self) -> Value {
        let value = self.value(Type::F64);
        let b = self.b.func();
        let is_number = b.fcmp(FloatCond::Eq, value, value);
        let zero = b.fconst(0.0);
        b.select(is_number, value, zero)
    }

    fn address(&mut self, ty: Type) -> Address {
        let line = self.rng.chance(15);
        let (region, size) = match (ty, line) {
            (Type::I1, false) => (RegionId(0), 24),
            (Type::I1, true) => (RegionId(3), 16),
            (_, false) => (RegionId(1), 104),
            (_, true) => (RegionId(2), 16),
        };
        // There are few addresses, so that accesses often overlap.
        let span = (size - ty.bytes()).min(12) + 1;
        let offset = self.rng.below(span as usize) as u32;
        if line {
            return Address::fixed(region, offset).volatile();
        }
        if self.rng.chance(85) {
            return Address::fixed(region, offset);
        }
        let scale = 1 + self.rng.below(3) as u32;
        let count = 1 + self.rng.below(((size - offset - ty.bytes()) / scale) as usize) as u32;
        let index = self.value(Type::I32);
        let index = match self.rng.chance(70) {
            true => self.b.func().binary_imm(BinaryOp::And, index, 7),
            false => index,
        };
        Address::indexed(region, offset, index, scale, count)
    }

    fn value(&mut self, ty: Type) -> Value {
        let fitting: Vec<Value> =
            self.pool.iter().rev().filter(|(_, of)| *of == ty).map(|(v, _)| *v).take(6).collect();
        if !fitting.is_empty() && self.rng.chance(65) {
            return *self.rng.pick(&fitting);
        }
        self.op(ty, 1)
    }

    fn constant(&mut self, ty: Type) -> Value {
        let few = [0, 1, -1, 2, 3, 7, 8, 15, 16, 31, 127, 128, 255, 256, 32767, i64::MIN];
        if ty == Type::F64 {
            let few = [0.0, -0.0, 1.0, -1.5, 0.5, 1e300, 3.0e9, f64::INFINITY, 2.5];
            let value = *self.rng.pick(&few);
            return self.b.func().fconst(value);
        }
        let value = match self.rng.chance(80) {
            true => *self.rng.pick(&few),
            false => self.rng.bits() as i64,
        };
        self.b.func().constant(ty, value)
    }

    /// A new value of a type, from operands that are `depth` operations away at most.
    fn op(&mut self, ty: Type, depth: usize) -> Value {
        let operand = |this: &mut Self, ty: Type| match depth {
            0 => this.constant(ty),
            _ if this.rng.chance(25) => this.constant(ty),
            _ if this.rng.chance(50) => this.op(ty, depth - 1),
            _ => {
                let found = this.pool.iter().rev().find(|(_, of)| *of == ty).copied();
                found.map_or_else(|| this.constant(ty), |(value, _)| value)
            }
        };
        let value = match self.rng.below(11) {
            10 if ty == Type::I1 => {
                let of = *self.rng.pick(&[Type::I8, Type::I16, Type::I32, Type::I64]);
                let word = operand(self, of);
                let number = self.rng.below(of.bits() as usize) as u8;
                self.b.func().bit(word, number)
            }
            10 if ty.is_int() => {
                let word = operand(self, ty);
                let first = self.rng.below(ty.bits() as usize) as u8;
                let width = 1 + self.rng.below(ty.bits() as usize - usize::from(first)) as u8;
                let field = Field { first, width };
                if self.rng.chance(50) {
                    let op = *self.rng.pick(ExtractOp::ALL);
                    self.b.func().extract(op, word, field)
                } else {
                    let truth = self.rng.chance(50);
                    let field = if truth { Field::bit(first) } else { field };
                    let bits = operand(self, if truth { Type::I1 } else { ty });
                    self.b.func().insert(word, bits, field)
                }
            }
            0..3 => {
                let at = self.address(ty);
                self.b.func().load(ty, at)
            }
            3 => {
                let cond = operand(self, Type::I1);
                let (a, b) = (operand(self, ty), operand(self, ty));
                self.b.func().select(cond, a, b)
            }
            4 if ty == Type::I1 => {
                let of = *self.rng.pick(&[Type::I8, Type::I16, Type::I32, Type::I64]);
                let cond = *self.rng.pick(IntCond::ALL);
                let (a, b) = (operand(self, of), operand(self, of));
                self.b.func().icmp(cond, a, b)
            }
            5 if ty == Type::I1 => {
                let cond = *self.rng.pick(FloatCond::ALL);
                let (a, b) = (operand(self, Type::F64), operand(self, Type::F64));
                self.b.func().fcmp(cond, a, b)
            }
            4 | 5 => self.conversion(ty, operand),
            6 if ty == Type::I1 && self.rng.chance(10) => self.b.func().is_late(),
            6 => {
                let ops: &[UnaryOp] = match ty {
                    Type::F64 => &FLOAT_OPS,
                    Type::I1 => &[UnaryOp::Not],
                    _ => &[UnaryOp::Not, UnaryOp::Neg],
                };
                let op = *self.rng.pick(ops);
                let arg = operand(self, ty);
                self.b.func().unary(op, arg)
            }
            _ => {
                let all: Vec<BinaryOp> =
                    BinaryOp::ALL.iter().copied().filter(|op| op.operands().include(ty)).collect();
                let op = *self.rng.pick(&all);
                let (a, b) = (operand(self, ty), operand(self, ty));
                self.b.func().binary(op, a, b)
            }
        };
        self.pool.push((value, ty));
        value
    }

    fn conversion(&mut self, to: Type, operand: impl Fn(&mut Self, Type) -> Value) -> Value {
        let ints = [Type::I1, Type::I8, Type::I16, Type::I32, Type::I64];
        if to == Type::F64 {
            let from = *self.rng.pick(&[Type::I32, Type::I64]);
            let arg = operand(self, from);
            return self.b.func().convert(ConvertOp::IntToFloat, to, arg);
        }
        if to == Type::I1 && self.rng.chance(30) {
            let arg = operand(self, Type::F64);
            let op = *self.rng.pick(&[ConvertOp::IsInteger, ConvertOp::IsIntegerOrNan]);
            return self.b.func().convert(op, to, arg);
        }
        if to == Type::I32 && self.rng.chance(30) {
            let arg = operand(self, Type::F64);
            let b = self.b.func();
            // Which NaN an operation gives differs between machines.
            let (number, zero) = (b.fcmp(FloatCond::Eq, arg, arg), b.fconst(0.0));
            let arg = b.select(number, arg, zero);
            return b.convert(ConvertOp::FloatToInt, to, arg);
        }
        let from = *self.rng.pick(&ints);
        let arg = operand(self, from);
        let signed = self.rng.chance(50);
        let func = self.b.func();
        match signed {
            true => func.sextend_or_trunc(to, arg),
            false => func.zextend_or_trunc(to, arg),
        }
    }
}
