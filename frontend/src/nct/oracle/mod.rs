//! The statement interpreter: walks the program's statements as the control's own did (NCT 4).
//!
//! It is the oracle that the other engines are held against. It knows nothing of IR and shares
//! only the layout with the lowering.

use std::sync::Arc;

use plcc_abi::{
    Engine, Outcome, ResumePoint, Scan, TrapCode,
    image::{read_u8, read_u16, read_u32, write_u16, write_u32},
    nct::context,
};

use crate::nct::{
    ast::{Arith, Bit, Cond, Op, Operand, Place, Program, Relation, Space},
    ast::{Test, Word},
    layout::Layout,
};

/// Walks the statements of a program.
pub struct Interpreter {
    program: Arc<Program>,
    layout: Arc<Layout>,
    /// The first statement of each task.
    entries: Vec<usize>,
    /// The statements at which a task goes on that was suspended, in the source's order. Control
    /// can come from each module to each label, so they are the same for all tasks.
    resume_points: Vec<usize>,
    /// The statements that call, in the source's order: what return addresses count.
    calls: Vec<usize>,
    /// Results of a condition that wait for their gate.
    waiting: Vec<bool>,
    /// How often each statement ran.
    counts: Vec<u64>,
}

impl Interpreter {
    pub(crate) fn new(program: Arc<Program>, layout: Arc<Layout>) -> Self {
        let entries: Vec<usize> = crate::nct::tables::modules(&program).map(|(_, at)| at).collect();
        let calls = (0..).zip(&program.stmts);
        let calls = calls.filter(|(_, s)| matches!(s.op, Op::Call(_) | Op::CallIndirect(_)));
        Self {
            entries,
            resume_points: resume_points(&program),
            calls: calls.map(|(at, _)| at).collect(),
            waiting: vec![],
            counts: vec![0; program.stmts.len()],
            program,
            layout,
        }
    }

    /// How often each statement ran, by the line it begins at.
    pub fn counts(&self) -> impl Iterator<Item = (u32, u64)> {
        self.program.lines.iter().copied().zip(self.counts.iter().copied())
    }
}

/// Where a task can be suspended: at the statements that a safepoint stands before, which are the
/// labels that something jumps back to or calls.
fn resume_points(program: &Program) -> Vec<usize> {
    let at = |label: u16| Some(program.labels.get(usize::from(label)).copied().flatten()? as usize);
    let mut points = vec![];
    for (from, stmt) in program.stmts.iter().enumerate() {
        let back = |to: &usize| *to <= from;
        match stmt.op {
            Op::Goto(label) => points.extend(at(label).filter(back)),
            Op::Call(label) => points.extend(at(label)),
            Op::GotoIndirect(_) => points.extend(NAMED.filter_map(at).filter(back)),
            Op::CallIndirect(_) => points.extend(NAMED.filter_map(at)),
            _ => {}
        }
    }
    points.sort_unstable();
    points.dedup();
    points
}

impl Engine for Interpreter {
    fn call(&mut self, task: usize, from: Option<ResumePoint>, scan: &mut Scan<'_>) -> Outcome {
        let Some(&entry) = self.entries.get(task) else { return Outcome::End };
        let start = match from {
            None => Some(entry),
            Some(ResumePoint(number)) => self.resume_points.get(number as usize).copied(),
        };
        let Some(mut at) = start else { return Outcome::Trap(TrapCode::BadLabel) };
        let program = Arc::clone(&self.program);
        let layout = Arc::clone(&self.layout);
        let mut run = Run {
            program: &program,
            layout: &layout,
            calls: &self.calls,
            image: &mut *scan.image,
            op: 0,
            waiting: &mut self.waiting,
        };
        run.op = read_u16(run.image, layout.context + context::OP);
        if from.is_none() {
            run.set_depth(0);
        }
        let outcome = loop {
            let Some(stmt) = program.stmts.get(at) else { break Outcome::End };
            if let Some(count) = self.counts.get_mut(at) {
                *count += 1;
            }
            if let Op::Area { op, area } = stmt.op {
                let args = [area.into(), run.op.into(), 0, 0];
                scan.host.call(run.image, op.host_function(), args);
                at += 1;
                continue;
            }
            match run.step(at, &stmt.op) {
                Next::At(next) => at = next,
                Next::Suspend(next) => {
                    break match self.resume_points.binary_search(&next) {
                        Ok(number) => Outcome::Suspended(ResumePoint(number as u32)),
                        Err(_) => Outcome::Trap(TrapCode::BadLabel),
                    };
                }
                Next::End => break Outcome::End,
                Next::Trap(code) => break Outcome::Trap(code),
            }
        };
        write_u16(run.image, layout.context + context::OP, run.op);
        outcome
    }
}

/// Where to go on.
enum Next {
    At(usize),
    Suspend(usize),
    End,
    Trap(TrapCode),
}

struct Run<'a> {
    program: &'a Program,
    layout: &'a Layout,
    /// The statements that call, in the source's order.
    calls: &'a [usize],
    image: &'a mut [u8],
    op: u16,
    waiting: &'a mut Vec<bool>,
}

/// A bit of F by its four digits.
const fn flag(digits: u16) -> Bit {
    Bit { space: Space::F, byte: digits / 10, bit: (digits % 10) as u8 }
}

const CARRY: Bit = flag(40);
const ZERO: Bit = flag(46);
const SIGN: Bit = flag(47);
const OVERFLOW: Bit = flag(53);
const SYNTAX: Bit = flag(80);
const NOT_BCD: Bit = flag(82);
const MUL_OVERFLOW: Bit = flag(83);
const BCD_SIGN: Bit = flag(87);
/// The high word of products and dividends, later the remainder.
const HIGH: Word = Word::Bytes { space: Space::F, byte: 0 };

/// Labels that an indirect jump or call can name (NCT 4.11).
const NAMED: std::ops::RangeInclusive<u16> = 3..=196;

/// The number that four BCD digits stand for.
fn from_bcd(word: u16) -> Option<u16> {
    let digits = [word >> 12, word >> 8 & 15, word >> 4 & 15, word & 15];
    let valid = digits.iter().all(|digit| *digit < 10);
    valid.then(|| digits.iter().fold(0, |n, digit| n * 10 + digit))
}

/// Up to 9999 as four BCD digits.
fn to_bcd(n: u16) -> u16 {
    (n / 1000) << 12 | (n / 100 % 10) << 8 | (n / 10 % 10) << 4 | (n % 10)
}

impl Run<'_> {
    fn depth(&self) -> u16 {
        read_u16(self.image, self.layout.context + context::DEPTH)
    }

    fn set_depth(&mut self, depth: u16) {
        write_u16(self.image, self.layout.context + context::DEPTH, depth);
    }

    fn bit(&self, bit: Bit) -> bool {
        let Some(location) = self.layout.location(bit.space, bit.byte) else { return false };
        let now = location.bit(self.image, bit.bit);
        if bit.space != Space::V {
            return now;
        }
        let before = self.layout.previous.get(bit.byte as usize);
        before.is_some_and(|location| location.bit(self.image, bit.bit)) != now
    }

    fn set(&mut self, bit: Bit, value: bool) {
        if let Some(location) = self.layout.location(bit.space, bit.byte) {
            location.set_bit(self.image, bit.bit, value);
        }
    }

    fn byte(&self, space: Space, byte: u16) -> u8 {
        let Some(location) = self.layout.location(space, byte) else { return 0 };
        let now = location.read(self.image);
        if space != Space::V {
            return now;
        }
        let before = self.layout.previous.get(byte as usize);
        before.map_or(now, |location| location.read(self.image) ^ now)
    }

    /// Where an indirect access leads, with its flags to be set afterwards.
    fn indirect(&self, at: u16) -> Result<Word, (bool, bool)> {
        let address = self.word(Word::Bytes { space: Space::F, byte: at });
        match from_bcd(address) {
            Some(byte @ 0..=999) => Ok(Word::Bytes { space: Space::F, byte }),
            Some(_) => Err((true, false)),
            None => Err((false, true)),
        }
    }

    /// A word that exists.
    fn word(&self, word: Word) -> u16 {
        if let Word::Bytes { space, byte } = word {
            return u16::from_le_bytes([self.byte(space, byte), self.byte(space, byte + 1)]);
        }
        self.layout.register(word).map_or(0, |offset| read_u16(self.image, offset))
    }

    fn set_word(&mut self, word: Word, value: u16) {
        if let Word::Bytes { space, byte } = word {
            for (byte, value) in [byte, byte + 1].into_iter().zip(value.to_le_bytes()) {
                if let Some(location) = self.layout.location(space, byte) {
                    location.write(self.image, value);
                }
            }
        } else if let Some(offset) = self.layout.register(word) {
            write_u16(self.image, offset, value);
        }
    }

    /// Sets the flags of an indirect access.
    fn note(&mut self, syntax: bool, not_bcd: bool) {
        self.set(SYNTAX, syntax);
        self.set(NOT_BCD, not_bcd);
    }

    /// The value of a load; `None` where an indirect one is refused.
    fn operand(&mut self, operand: Operand) -> Option<u16> {
        let (negate, place) = match operand {
            Operand::Const(value) => return Some(value),
            Operand::Load { negate, place } => (negate, place),
        };
        let value = match place {
            Place::Bit(bit) => return Some(u16::from(self.bit(bit) != negate)),
            Place::Word(Word::Indirect(at)) => match self.indirect(at) {
                Ok(word) => {
                    let value = self.word(word);
                    self.note(false, false);
                    value
                }
                Err((syntax, not_bcd)) => {
                    self.note(syntax, not_bcd);
                    return None;
                }
            },
            Place::Word(word) => self.word(word),
        };
        Some(if negate { !value } else { value })
    }

    /// Writes `change(old, OP)` into a variable; flags of an indirect access and of arithmetic
    /// follow the result.
    fn update(&mut self, place: Place, change: impl FnOnce(u16, u16) -> (u16, Option<bool>)) {
        match place {
            Place::Bit(bit) => {
                let (value, _) = change(u16::from(self.bit(bit)), self.op & 1);
                self.set(bit, value & 1 != 0);
            }
            Place::Word(word) => {
                let (word, indirect) = match word {
                    Word::Indirect(at) => match self.indirect(at) {
                        Ok(word) => (word, true),
                        Err((syntax, not_bcd)) => return self.note(syntax, not_bcd),
                    },
                    word => (word, false),
                };
                let (value, carry) = change(self.word(word), self.op);
                self.set_word(word, value);
                if indirect {
                    self.note(false, false);
                }
                if let Some(carry) = carry {
                    self.result_flags(carry, value);
                }
            }
        }
    }

    fn result_flags(&mut self, carry: bool, value: u16) {
        self.set(CARRY, carry);
        self.set(ZERO, value == 0);
        self.set(SIGN, value & 0x8000 != 0);
    }

    /// OP becomes `a` with `b`.
    fn arith(&mut self, op: Arith, a: u16, b: u16) {
        self.op = match op {
            Arith::And => a & b,
            Arith::Or => a | b,
            Arith::Xor => a ^ b,
            Arith::Add | Arith::Sub => {
                let (value, carry) = sum(op, a, b);
                self.result_flags(carry, value);
                value
            }
            Arith::Mul => {
                let product = u32::from(a) * u32::from(b);
                let high = (product >> 16) as u16;
                self.set_word(HIGH, high);
                self.set(MUL_OVERFLOW, high != 0);
                product as u16
            }
            Arith::Div => {
                let dividend = u32::from(self.word(HIGH)) << 16 | u32::from(a);
                let divisor = u32::from(b);
                self.set(SYNTAX, divisor == 0);
                if divisor == 0 {
                    a
                } else {
                    self.set_word(HIGH, (dividend % divisor) as u16);
                    (dividend / divisor) as u16
                }
            }
        };
    }

    fn condition(&mut self, first: u32, count: u32) -> bool {
        self.waiting.clear();
        for at in first..first + count {
            let result = match self.program.conds.get(at as usize) {
                Some(Cond::Test(test)) => self.test(*test),
                Some(Cond::Gate(gate)) => {
                    let b = self.waiting.pop().unwrap_or(false);
                    let a = self.waiting.pop().unwrap_or(false);
                    match gate {
                        Arith::And => a & b,
                        Arith::Or => a | b,
                        _ => a ^ b,
                    }
                }
                None => false,
            };
            self.waiting.push(result);
        }
        self.waiting.pop().unwrap_or(false)
    }

    fn test(&mut self, test: Test) -> bool {
        match test {
            Test::Bit { negate, bit } => self.bit(bit) != negate,
            Test::Word { negate, word } => (self.word(word) != 0) != negate,
            Test::Relation { relation, operand } => {
                let Some(value) = self.operand(operand) else { return false };
                match relation {
                    Relation::Lt => self.op < value,
                    Relation::Gt => self.op > value,
                    Relation::Eq => self.op == value,
                    Relation::Le => self.op <= value,
                    Relation::Ge => self.op >= value,
                }
            }
        }
    }

    fn target(&self, label: u16) -> Option<usize> {
        Some(self.program.labels.get(label as usize).copied().flatten()? as usize)
    }

    /// Passes a safepoint on the way to a statement.
    fn safepoint(&mut self, to: usize) -> Next {
        let offset = self.layout.context + context::FUEL;
        let fuel = read_u32(self.image, offset).wrapping_sub(1);
        write_u32(self.image, offset, fuel);
        if fuel != 0 {
            Next::At(to)
        } else if read_u8(self.image, self.layout.context + context::ON_EMPTY) == 0 {
            Next::Suspend(to)
        } else {
            Next::Trap(TrapCode::Timeout)
        }
    }

    fn jump(&mut self, from: usize, to: usize) -> Next {
        if to <= from { self.safepoint(to) } else { Next::At(to) }
    }

    fn call(&mut self, from: usize, to: usize) -> Next {
        let depth = self.depth();
        if depth >= context::MAX_DEPTH {
            return Next::Trap(TrapCode::CallDepth);
        }
        let slot = self.layout.context + context::SITES + u32::from(depth) * 4;
        let number = self.calls.binary_search(&from).unwrap_or(usize::MAX);
        write_u32(self.image, slot, number as u32);
        self.set_depth(depth + 1);
        self.safepoint(to)
    }

    /// The label that a word of F names, if one does.
    fn named_label(&mut self, at: u16) -> Option<usize> {
        let word = self.word(Word::Bytes { space: Space::F, byte: at });
        let Some(label) = from_bcd(word) else {
            self.note(false, true);
            return None;
        };
        let target = if NAMED.contains(&label) { self.target(label) } else { None };
        self.note(target.is_none(), false);
        target
    }

    fn step(&mut self, at: usize, op: &Op) -> Next {
        match *op {
            Op::Set(bit) => self.set(bit, true),
            Op::Clear(bit) => self.set(bit, false),
            Op::Count { counter, up } => {
                let counter = Word::Q(counter);
                let step = if up { 1 } else { u16::MAX };
                self.set_word(counter, self.word(counter).wrapping_add(step));
            }
            Op::Load(operand) => self.op = self.operand(operand).unwrap_or(self.op),
            Op::Store { negate, place } => {
                self.update(place, |_, op| (if negate { !op } else { op }, None));
            }
            Op::Arith { op, operand } => {
                let Some(value) = self.operand(operand) else { return Next::At(at + 1) };
                if let Operand::Load { place: Place::Bit(_), .. } = operand {
                    // A bit meets bit 0 alone.
                    let value = if op == Arith::And { 0xFFFE | value } else { value };
                    self.arith(op, self.op, value);
                } else {
                    self.arith(op, self.op, value);
                }
            }
            Op::Update { op, negate, place } => self.update(place, |old, with| {
                let old = if negate { !old } else { old };
                match op {
                    Arith::And => (old & with, None),
                    Arith::Or => (old | with, None),
                    Arith::Xor => (old ^ with, None),
                    _ => {
                        let (value, carry) = sum(op, old, with);
                        (value, Some(carry))
                    }
                }
            }),
            Op::Shift { left: true, by } => self.op <<= by,
            Op::Shift { left: false, by } => self.op >>= by,
            Op::Bin => self.bin(),
            Op::Bcd => self.bcd(),
            Op::Push(slot) => {
                write_u16(self.image, self.layout.scratch + u32::from(slot) * 2, self.op);
            }
            Op::Apply { op, slot } => {
                let kept = read_u16(self.image, self.layout.scratch + u32::from(slot) * 2);
                self.arith(op, kept, self.op);
            }
            Op::If { first, count, otherwise } => {
                if !self.condition(first, count) {
                    return Next::At(otherwise as usize + 1);
                }
            }
            Op::Else { end } => return Next::At(end as usize + 1),
            Op::Goto(label) => {
                let Some(to) = self.target(label) else { return Next::End };
                return self.jump(at, to);
            }
            Op::GotoIndirect(word) => {
                if let Some(to) = self.named_label(word) {
                    return self.jump(at, to);
                }
            }
            Op::Call(label) => {
                let Some(to) = self.target(label) else { return Next::End };
                return self.call(at, to);
            }
            Op::CallIndirect(word) => {
                if let Some(to) = self.named_label(word) {
                    return self.call(at, to);
                }
            }
            Op::Return => {
                let Some(depth) = self.depth().checked_sub(1) else { return Next::End };
                self.set_depth(depth);
                let slot = self.layout.context + context::SITES + u32::from(depth) * 4;
                let number = read_u32(self.image, slot) as usize;
                let Some(call) = self.calls.get(number) else {
                    return Next::Trap(TrapCode::BadLabel);
                };
                return Next::At(call + 1);
            }
            Op::End(_) => return Next::End,
            Op::EndIf | Op::Label(_) | Op::Text | Op::Area { .. } | Op::Bad { .. } => {}
        }
        Next::At(at + 1)
    }

    fn bin(&mut self) {
        let Some(value) = from_bcd(self.op) else { return self.set(NOT_BCD, true) };
        let value = if self.bit(BCD_SIGN) { value.wrapping_neg() } else { value };
        self.op = value;
        self.set(NOT_BCD, false);
        self.set(ZERO, value == 0);
        self.set(SIGN, value & 0x8000 != 0);
    }

    fn bcd(&mut self) {
        let signed = self.op.cast_signed();
        let value = signed.unsigned_abs();
        self.set(OVERFLOW, value > 9999);
        if value <= 9999 {
            self.op = to_bcd(value);
            self.set(ZERO, value == 0);
            self.set(SIGN, signed < 0);
        }
    }
}

/// The 16-bit sum or difference and its carry or borrow.
fn sum(op: Arith, a: u16, b: u16) -> (u16, bool) {
    if op == Arith::Add { a.overflowing_add(b) } else { a.overflowing_sub(b) }
}
