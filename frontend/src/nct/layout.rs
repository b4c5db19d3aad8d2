//! Where each part of a program's state lies in the process image.
//!
//! A byte of I, Y or F of which the program names only bits is kept unpacked, as eight bytes of 0
//! or 1, so that a bit is read and written by one plain access. A byte that a word, a division, a
//! register area or an indirect access can reach stays one byte.

use plcc_abi::{
    Region,
    nct::{
        FLAG_BYTES, FlagLocation, H_COUNT, IMAGE_BYTES, LINE_BYTES, M_COUNT, Q_COUNT, RH_COUNT,
        RP_COUNT, T_COUNT, context, layout::region,
    },
};

use crate::nct::{
    ast::{Arith, ConditionPart, Op, Operand, Program, Space, Test, Variable, Word},
    status_flags::{HIGH_WORD, NOT_BCD, STATUS_BYTES},
};

/// The region of the values of OP that brackets keep. After them comes the number of the
/// statement that jumps back or calls, see `lower/flow.rs`.
pub(crate) const SCRATCH: &str = "scratch";
/// The region of the results that wait for their gate when the code of a long condition is cut.
pub(crate) const WAITING: &str = "waiting";
/// How many results of a condition can wait at once: one for each of 256 nested parentheses and one
/// more, rounded up to a multiple of 8.
const WAITING_BITS: u32 = 264;

/// The layout of one program.
#[derive(Clone, Debug)]
pub(crate) struct Layout {
    /// All regions, by rising offset.
    pub(crate) regions: Vec<Region>,
    /// The image's size in bytes.
    pub(crate) size: u32,
    /// Where each byte of the input image I lies.
    pub(crate) inputs: Vec<FlagLocation>,
    /// Where each byte of the input image of the module's run before lies, for V.
    pub(crate) previous: Vec<FlagLocation>,
    /// Where each byte of the output image Y lies.
    pub(crate) outputs: Vec<FlagLocation>,
    /// Where each byte of the local variables F lies.
    pub(crate) flags: Vec<FlagLocation>,
    /// Offset of the region `context`.
    pub(crate) context: u32,
    /// Offset of the physical input lines P.
    pub(crate) lines_in: u32,
    /// Offset of the physical output lines O.
    pub(crate) lines_out: u32,
    /// Offset of the registers RH.
    pub(crate) rh: u32,
    /// Offset of the counters Q.
    pub(crate) q: u32,
    /// Offset of the 20 ms timers T.
    pub(crate) t: u32,
    /// Offset of the second timers H.
    pub(crate) h: u32,
    /// Offset of the minute timers M.
    pub(crate) m: u32,
    /// Offset of the constants RP.
    pub(crate) rp: u32,
    /// Offset of the values of OP that brackets keep.
    pub(crate) scratch: u32,
}

/// How a program uses the bytes of I, Y or F.
struct ByteUses {
    /// For each byte whether a bit of it is named.
    bits: Vec<bool>,
    /// For each byte whether something can reach it as a whole.
    bytes: Vec<bool>,
}

impl ByteUses {
    fn new(count: usize) -> Self {
        Self { bits: vec![false; count], bytes: vec![false; count] }
    }

    /// Notes that a bit of the byte is named.
    fn bit(&mut self, byte: u16) {
        if let Some(slot) = self.bits.get_mut(byte as usize) {
            *slot = true;
        }
    }

    /// Notes that the word at the byte is named.
    fn word(&mut self, byte: u16) {
        for byte in [byte as usize, byte as usize + 1] {
            if let Some(slot) = self.bytes.get_mut(byte) {
                *slot = true;
            }
        }
    }

    /// Notes that every byte can be reached.
    fn all(&mut self) {
        self.bytes.fill(true);
    }

    /// For each byte whether it is kept unpacked, as eight bytes.
    fn unpacked(&self) -> Vec<bool> {
        self.bits.iter().zip(&self.bytes).map(|(bit, byte)| *bit && !*byte).collect()
    }
}

/// How a program uses its images and local variables.
struct Uses {
    inputs: ByteUses,
    outputs: ByteUses,
    flags: ByteUses,
}

impl Uses {
    fn of(program: &Program) -> Self {
        let mut uses = Self {
            inputs: ByteUses::new(IMAGE_BYTES),
            outputs: ByteUses::new(IMAGE_BYTES),
            flags: ByteUses::new(FLAG_BYTES),
        };
        // Arithmetic statements write these whether the program names them or not.
        STATUS_BYTES.into_iter().for_each(|byte| uses.flags.bit(byte));
        for stmt in &program.stmts {
            uses.stmt(&stmt.op);
        }
        for cond in &program.condition_parts {
            match cond {
                ConditionPart::Test(Test::Bit { bit, .. }) => uses.note(Variable::Bit(*bit)),
                ConditionPart::Test(Test::Relation { operand, .. }) => uses.operand(*operand),
                ConditionPart::Test(Test::Word { .. }) | ConditionPart::Gate(_) => {}
            }
        }
        uses
    }

    /// Notes what a statement uses. Conditions are noted by their parts.
    fn stmt(&mut self, op: &Op) {
        match *op {
            Op::Set(bit) | Op::Clear(bit) => self.note(Variable::Bit(bit)),
            Op::Load(operand) => self.operand(operand),
            Op::Store { place: variable, .. } | Op::Update { place: variable, .. } => {
                self.note(variable)
            }
            Op::Arith { op, operand } => {
                self.high_word(op);
                self.operand(operand);
            }
            Op::Apply { op, .. } => self.high_word(op),
            Op::Area { .. } => self.flags.all(),
            Op::GotoIndirect(byte) | Op::CallIndirect(byte) => self.flags.word(byte),
            Op::Bin => self.flags.bit(NOT_BCD.byte),
            Op::Count { .. }
            | Op::Shift { .. }
            | Op::Bcd
            | Op::Push(_)
            | Op::If { .. }
            | Op::Else { .. }
            | Op::EndIf
            | Op::Label(_)
            | Op::Goto(_)
            | Op::Call(_)
            | Op::Return
            | Op::End(_)
            | Op::Text
            | Op::Bad { .. } => {}
        }
    }

    /// A multiplication or division uses the word F000 too.
    fn high_word(&mut self, op: Arith) {
        if matches!(op, Arith::Mul | Arith::Div) {
            self.note(Variable::Word(HIGH_WORD));
        }
    }

    fn operand(&mut self, operand: Operand) {
        if let Operand::Load { place: variable, .. } = operand {
            self.note(variable);
        }
    }

    fn note(&mut self, variable: Variable) {
        match variable {
            Variable::Bit(bit) => {
                if let Some(used) = self.of_space(bit.space) {
                    used.bit(bit.byte);
                }
            }
            Variable::Word(Word::Bytes { space, byte }) => {
                if let Some(used) = self.of_space(space) {
                    used.word(byte);
                }
            }
            Variable::Word(Word::Indirect(_)) => self.flags.all(),
            Variable::Word(_) => {}
        }
    }

    /// The uses of I (and V), Y or F; `None` for physical lines, which are always kept as bytes.
    fn of_space(&mut self, space: Space) -> Option<&mut ByteUses> {
        match space {
            Space::I | Space::V => Some(&mut self.inputs),
            Space::Y => Some(&mut self.outputs),
            Space::F => Some(&mut self.flags),
            Space::P | Space::O => None,
        }
    }
}

/// Lays out regions one after the other.
#[derive(Default)]
struct Regions {
    all: Vec<Region>,
    end: u32,
}

impl Regions {
    /// Adds a region of `size` bytes and returns its offset.
    fn add(&mut self, name: &str, size: u32, bits: bool) -> u32 {
        let offset = self.end.next_multiple_of(8);
        // A region must have a byte at least.
        let size = size.max(1);
        self.end = offset + size;
        self.all.push(Region { name: name.into(), offset, size, bits });
        offset
    }

    /// Adds the two regions of I, Y or F, for bytes and for single bits, and returns where each byte
    /// lies. After the bytes comes one more that is always 0, so that a word can be read at the
    /// last one.
    fn locations(&mut self, names: [&str; 2], unpacked: &[bool]) -> Vec<FlagLocation> {
        let [bytes, bits] = names;
        let bytes = self.add(bytes, unpacked.len() as u32 + 1, false);
        let count = unpacked.iter().filter(|u| **u).count() as u32;
        let mut next = self.add(bits, count * 8, true);
        let mut location = |(byte, &unpacked): (usize, &bool)| {
            if !unpacked {
                return FlagLocation { offset: bytes + byte as u32, unpacked };
            }
            next += 8;
            FlagLocation { offset: next - 8, unpacked }
        };
        unpacked.iter().enumerate().map(&mut location).collect()
    }
}

impl Layout {
    /// Lays out a program.
    pub(crate) fn new(program: &Program) -> Self {
        let uses = Uses::of(program);
        let mut regions = Regions::default();
        let words = |count: u16| u32::from(count) * 2;
        let context = regions.add(region::CONTEXT, context::SIZE, false);
        let inputs = regions.locations(region::INPUT, &uses.inputs.unpacked());
        let previous = regions.locations(region::PREVIOUS, &uses.inputs.unpacked());
        let outputs = regions.locations(region::OUTPUT, &uses.outputs.unpacked());
        let flags = regions.locations(region::FLAG, &uses.flags.unpacked());
        let lines_in = regions.add(region::LINES_IN, LINE_BYTES as u32 + 1, false);
        let lines_out = regions.add(region::LINES_OUT, LINE_BYTES as u32 + 1, false);
        let rh = regions.add(region::RH, words(RH_COUNT), false);
        let q = regions.add(region::Q, words(Q_COUNT), false);
        let t = regions.add(region::T, words(T_COUNT), false);
        let h = regions.add(region::H, words(H_COUNT), false);
        let m = regions.add(region::M, words(M_COUNT), false);
        let rp = regions.add(region::RP, words(RP_COUNT), false);
        // The number of the statement that jumps back or calls lies after them, aligned.
        let slots = (u32::from(program.slots) * 2).next_multiple_of(4);
        let scratch = regions.add(SCRATCH, slots + 4, false);
        regions.add(WAITING, WAITING_BITS, true);
        let size = regions.end.next_multiple_of(8);
        Self {
            regions: regions.all,
            size,
            inputs,
            previous,
            outputs,
            flags,
            context,
            lines_in,
            lines_out,
            rh,
            q,
            t,
            h,
            m,
            rp,
            scratch,
        }
    }

    /// Where a byte lies; for V where that byte of the inputs does. `None` for a byte that does not
    /// exist.
    #[inline]
    pub(crate) fn location(&self, space: Space, byte: u16) -> Option<FlagLocation> {
        let byte = byte as usize;
        match space {
            Space::I | Space::V => self.inputs.get(byte).copied(),
            Space::Y => self.outputs.get(byte).copied(),
            Space::F => self.flags.get(byte).copied(),
            Space::P | Space::O if byte >= LINE_BYTES => None,
            Space::P => Some(FlagLocation { offset: self.lines_in + byte as u32, unpacked: false }),
            Space::O => {
                Some(FlagLocation { offset: self.lines_out + byte as u32, unpacked: false })
            }
        }
    }

    /// The offset of a register, counter, timer or constant; `None` for other words.
    #[inline]
    pub(crate) fn register(&self, word: Word) -> Option<u32> {
        let (base, n) = match word {
            Word::Rh(n) => (self.rh, n),
            Word::Q(n) => (self.q, n),
            Word::T(n) => (self.t, n),
            Word::H(n) => (self.h, n),
            Word::M(n) => (self.m, n),
            Word::Rp(n) => (self.rp, n),
            Word::Bytes { .. } | Word::Indirect(_) => return None,
        };
        Some(base + u32::from(n) * 2)
    }
}
