//! Kernels: small programs whose speed is compared with that of the same logic in C.
//!
//! A [`Kernel`] describes a program once, as statements over numbered bits, words and array
//! elements. `plc` prints it in a control's language, `c` in C, and `families` generates kernels
//! from a seed.
//!
//! ```
//! use plcc_benches::kernels::{Language, families};
//!
//! let kernels = families::all(1, 100);
//! let ladder = kernels.iter().find(|kernel| kernel.language == Language::Pmi);
//! assert!(ladder.is_some_and(|kernel| kernel.source().contains("$INPUT")));
//! ```

pub mod c;
pub mod c_process;
pub mod families;
mod plc;
pub mod subject;

/// The language that a kernel is written in, and where it keeps its variables.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Language {
    /// PMI: LOGICALs and INTEGERs.
    Pmi,
    /// NCT: bits of I and F, words of F.
    Nct,
    /// PMAC: bits in M-variables, every second one that is not an input in a P-variable; words in P.
    PmacMixed,
    /// PMAC: all bits in M-variables; words in P.
    Pmac,
    /// A PLCC: bits and words in L-variables.
    Plcc,
}

impl Language {
    /// The name of the group whose geometric mean is taken together.
    pub fn group(self) -> &'static str {
        match self {
            Self::Pmi => "pmi",
            Self::Nct => "nct",
            Self::PmacMixed | Self::Pmac => "pmac",
            Self::Plcc => "plcc",
        }
    }

    /// Whether it is one of a PMAC's.
    pub fn is_pmac(self) -> bool {
        matches!(self, Self::PmacMixed | Self::Pmac | Self::Plcc)
    }
}

/// What words and array elements hold, as the C declares them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WordType {
    /// Signed, 16 bits.
    Signed16,
    /// Unsigned, 16 bits.
    Unsigned16,
    /// Signed, 24 bits.
    Signed24,
    /// Integers in doubles; the C may use `int`, since they stay small.
    SmallInteger,
    /// Doubles.
    Double,
}

/// Operations on words, and comparisons, which give a truth value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Op {
    /// Sum.
    Add,
    /// Difference.
    Sub,
    /// Product.
    Mul,
    /// Remainder by a constant, of a number that is not negative.
    Rem,
    /// Quotient of two words that are not negative, or whose quotient is rounded toward zero.
    Quot,
    /// Quotient of doubles.
    Div,
    /// The bits of both, with a constant on the right.
    Mask,
    /// The bits of either, with a constant on the right.
    Join,
    /// A word that is not negative, shifted left by a constant.
    Left,
    /// A word that is not negative, shifted right by a constant.
    Right,
    /// Equal.
    Eq,
    /// Greater.
    Gt,
    /// Less.
    Lt,
}

/// An expression: a truth value or a word.
#[derive(Clone, Debug)]
pub enum Expr {
    /// A bit, by its number.
    Bit(usize),
    /// The opposite of a bit.
    NotBit(usize),
    /// All of several truth values, at least two.
    All(Vec<Expr>),
    /// Any of several truth values, at least two.
    Any(Vec<Expr>),
    /// A word, by its number.
    Word(usize),
    /// The array element whose index is the operand.
    Element(Box<Expr>),
    /// A constant truth value.
    Truth(bool),
    /// A double, by its number.
    Real(usize),
    /// The integer below a double that is not negative.
    Int(Box<Expr>),
    /// A constant word.
    Number(f64),
    /// An operation on words.
    Op(Op, Box<[Expr; 2]>),
}

impl Expr {
    /// An operation on two words.
    pub fn op(op: Op, a: Expr, b: Expr) -> Self {
        Self::Op(op, Box::new([a, b]))
    }

    /// Whether it compares two words.
    pub fn is_comparison(&self) -> bool {
        matches!(self, Self::Op(Op::Eq | Op::Gt | Op::Lt, _))
    }
}

/// A statement.
#[derive(Clone, Debug)]
pub enum Stmt {
    /// A bit becomes a truth value.
    SetBit(usize, Expr),
    /// A word becomes a number.
    SetWord(usize, Expr),
    /// A bit becomes its opposite.
    Toggle(usize),
    /// A double becomes a number.
    SetReal(usize, Expr),
    /// The element with an index becomes a number.
    SetElement(Expr, Expr),
    /// A condition, the statements where it holds, and those where it does not.
    If(Expr, Vec<Stmt>, Vec<Stmt>),
}

/// How statements that set a bit are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BitStyle {
    /// As the language writes relay logic: an assignment in PMI, a condition that switches the bit
    /// on or else off in NCT and PMAC.
    Conditions,
    /// By operators: NCT's chains on OP, PMAC's `&`, `|` and `^`.
    Operators,
}

/// A program.
#[derive(Clone, Debug)]
pub struct Kernel {
    /// What it consists of, such as `ladder`.
    pub name: &'static str,
    /// The language in which it is measured.
    pub language: Language,
    /// How its bits are set.
    pub style: BitStyle,
    /// What its words hold.
    pub word_type: WordType,
    /// The first bits are inputs, which change from scan to scan. A multiple of 192, so that they
    /// fill whole words in each layout.
    pub inputs: usize,
    /// The number of bits.
    pub bits: usize,
    /// The first words are inputs too, which change from scan to scan.
    pub input_words: usize,
    /// The number of words.
    pub words: usize,
    /// The number of elements of its array; 0 if it has none.
    pub elements: usize,
    /// What the first elements hold before the first scan, as somebody has entered it; the others are 0.
    pub start: Vec<f64>,
    /// Whether the elements are doubles, and not words.
    pub real_elements: bool,
    /// The number of doubles besides words and elements, which only a PMAC has.
    pub reals: usize,
    /// Its statements, in the order of execution.
    pub stmts: Vec<Stmt>,
}

impl Kernel {
    /// Its text in its language.
    pub fn source(&self) -> String {
        plc::print(self)
    }
}

/// How many scans' inputs there are; after them they begin again ([`Inputs::pattern`]). There are so many that the
/// processor can't learn how branches go with random inputs: of 256 it does.
pub const PATTERNS: usize = 4096;

/// How much the inputs change from scan to scan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Inputs {
    /// Not at all.
    Static,
    /// Each has a chance of one in a hundred to be drawn again, so about half as many bits change.
    Hundredth,
    /// Each is drawn again.
    Random,
}

impl Inputs {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Static, Self::Hundredth, Self::Random];

    /// The pattern that a scan sees. With static inputs it is always the first, so that reading patterns from
    /// all over the caches is not part of what is measured.
    pub fn pattern(self, scan: usize) -> usize {
        match self {
            Self::Static => 0,
            _ => scan % PATTERNS,
        }
    }
}

/// The inputs of one scan.
#[derive(Clone, Debug)]
pub struct Pattern {
    /// For each input bit 0 or 1.
    pub bits: Vec<u8>,
    /// The input words.
    pub words: Vec<i16>,
}

/// The patterns of a kernel's inputs.
pub fn patterns(kernel: &Kernel, inputs: Inputs, seed: u64) -> Vec<Pattern> {
    let mut rng = plcc_random::Rng::new(seed ^ 0x5EED);
    let mut now = Pattern {
        bits: (0..kernel.inputs).map(|_| u8::from(rng.chance(50))).collect(),
        words: (0..kernel.input_words).map(|_| rng.below(100) as i16).collect(),
    };
    let mut all = vec![];
    // The second half is the first one backwards, so that no scan has a great change.
    for _ in 0..PATTERNS / 2 {
        all.push(now.clone());
        let percent = match inputs {
            Inputs::Static => 0,
            Inputs::Hundredth => 1,
            Inputs::Random => 100,
        };
        for bit in &mut now.bits {
            if rng.chance(percent) {
                *bit = u8::from(rng.chance(50));
            }
        }
        for word in &mut now.words {
            if rng.chance(percent) {
                *word = rng.below(100) as i16;
            }
        }
    }
    let back: Vec<Pattern> = all.iter().rev().cloned().collect();
    all.extend(back);
    all
}
