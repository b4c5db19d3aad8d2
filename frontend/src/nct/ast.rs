//! The checked program: its statements in the order of the text, and the parts of their conditions.

use std::fmt;

use plcc_abi::HostFn;
use plcc_diag::Span;

/// A kind of bits and bytes, by the letter with which a program names them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) enum Space {
    /// Inputs as latched for the module (NCT 2.1.1, 2.2.1).
    I,
    /// Changes of inputs: a bit is 1 if that input has changed since the module ran before (NCT 4.3
    /// `V`).
    V,
    /// Physical input lines (NCT 4.3 `P`).
    P,
    /// The output image (NCT 2.1.2, 2.2.2).
    Y,
    /// Physical output lines (NCT 4.1 `UO`).
    O,
    /// Local variables (NCT 2.3).
    F,
}

impl Space {
    /// The letter in the source.
    pub(crate) fn letter(self) -> char {
        match self {
            Self::I => 'I',
            Self::V => 'V',
            Self::P => 'P',
            Self::Y => 'Y',
            Self::O => 'O',
            Self::F => 'F',
        }
    }

    /// How many bytes it has.
    pub(crate) fn bytes(self) -> u16 {
        match self {
            Self::I | Self::V | Self::Y => 100,
            Self::P | Self::O => 40,
            Self::F => 1000,
        }
    }
}

/// A bit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct Bit {
    /// Of which kind.
    pub(crate) space: Space,
    /// The number of its byte.
    pub(crate) byte: u16,
    /// Its number in the byte, 0 to 7.
    pub(crate) bit: u8,
}

/// A 16-bit variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) enum Word {
    /// Two neighbouring bytes, the low one first.
    Bytes {
        /// Of which kind.
        space: Space,
        /// The low byte.
        byte: u16,
    },
    /// A register between NC and PLC, 0 to 199.
    Rh(u8),
    /// A counter.
    Q(u8),
    /// A 20 ms timer.
    T(u8),
    /// A second timer.
    H(u8),
    /// A minute timer.
    M(u8),
    /// A constant that is set on the control, 1 to 40.
    Rp(u8),
    /// An indirect access: the F word whose address, in BCD, is in the F word at this byte.
    Indirect(u16),
}

/// What a load or store names.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) enum Variable {
    /// A bit.
    Bit(Bit),
    /// A word.
    Word(Word),
}

impl fmt::Display for Bit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { space, byte, bit } = self;
        let width = if *space == Space::F { 3 } else { 2 };
        write!(f, "{}{byte:0width$}{bit}", space.letter())
    }
}

impl fmt::Display for Word {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bytes { space: Space::F, byte } => write!(f, "F{byte:03}"),
            Self::Bytes { space, byte } => write!(f, "{}{byte:02}", space.letter()),
            Self::Rh(n) => write!(f, "RH{n:03}"),
            Self::Q(n) => write!(f, "Q{n:02}"),
            Self::T(n) => write!(f, "T{n:02}"),
            Self::H(n) => write!(f, "H{n:02}"),
            Self::M(n) => write!(f, "M{n}"),
            Self::Rp(n) => write!(f, "RP{n:03}"),
            Self::Indirect(n) => write!(f, "FI{n:03}"),
        }
    }
}

impl fmt::Display for Variable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bit(bit) => bit.fmt(f),
            Self::Word(word) => word.fmt(f),
        }
    }
}

/// A two-operand operation on OP (NCT 4.8, 4.9).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Arith {
    /// `+`
    Add,
    /// `-`
    Sub,
    /// `*`
    Mul,
    /// `/`
    Div,
    /// `A`
    And,
    /// `O`
    Or,
    /// `X`
    Xor,
}

/// How OP is compared, unsigned (NCT 4.10).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Relation {
    /// `<`
    Lt,
    /// `>`
    Gt,
    /// `=`
    Eq,
    /// `<=`
    Le,
    /// `>=`
    Ge,
}

/// What an operation takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Operand {
    /// A number of the text.
    Const(u16),
    /// A variable or its complement.
    Load {
        /// With `N`.
        negate: bool,
        /// The variable.
        place: Variable,
    },
}

/// One test in a condition.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Test {
    /// Of a bit.
    Bit {
        /// With `N`.
        negate: bool,
        /// Which.
        bit: Bit,
    },
    /// Of a counter or timer: not 0.
    Word {
        /// With `N`: 0.
        negate: bool,
        /// Which.
        word: Word,
    },
    /// Of OP.
    Relation {
        /// How.
        relation: Relation,
        /// With what.
        operand: Operand,
    },
}

/// A part of a condition. The parts are in postfix order: a gate combines the two results before
/// it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ConditionPart {
    /// Returns the result of a test.
    Test(Test),
    /// Takes the last two results and returns their `And`, `Or` or `Xor`.
    Gate(Arith),
}

/// A statement with a register area in F (NCT 4.14 to 4.16).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum AreaOp {
    /// Search in a table.
    Hf,
    /// Search for a free pot.
    Pf,
    /// Read macro variable or parameter.
    Mr,
    /// Write macro variable or parameter.
    Mw,
    /// Sum.
    Add,
    /// Difference.
    Sub,
    /// Product.
    Mul,
    /// Quotient and remainder.
    Div,
    /// Comparison.
    Cmp,
}

impl AreaOp {
    /// The statement's name.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Hf => "HF",
            Self::Pf => "PF",
            Self::Mr => "MR",
            Self::Mw => "MW",
            Self::Add => "ADD",
            Self::Sub => "SUB",
            Self::Mul => "MUL",
            Self::Div => "DIV",
            Self::Cmp => "CMP",
        }
    }

    /// The host function that performs it.
    pub(crate) fn host_function(self) -> HostFn {
        match self {
            Self::Hf => HostFn::NctHf,
            Self::Pf => HostFn::NctPf,
            Self::Mr => HostFn::NctMr,
            Self::Mw => HostFn::NctMw,
            Self::Add => HostFn::NctAdd,
            Self::Sub => HostFn::NctSub,
            Self::Mul => HostFn::NctMul,
            Self::Div => HostFn::NctDiv,
            Self::Cmp => HostFn::NctCmp,
        }
    }

    /// How many bytes its register area has.
    pub(crate) fn area(self) -> u16 {
        match self {
            Self::Hf => 10,
            Self::Pf | Self::Cmp => 6,
            _ => 8,
        }
    }
}

/// What a statement does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Op {
    /// `U`: the bit becomes 1.
    Set(Bit),
    /// `D`: the bit becomes 0.
    Clear(Bit),
    /// `UQ` and `DQ`.
    Count {
        /// The counter.
        counter: u8,
        /// Up or down.
        up: bool,
    },
    /// OP becomes the operand.
    Load(Operand),
    /// The variable becomes OP or its complement.
    Store {
        /// With `N`.
        negate: bool,
        /// The variable.
        place: Variable,
    },
    /// OP and the operand, result in OP.
    Arith {
        /// How.
        op: Arith,
        /// With what.
        operand: Operand,
    },
    /// The variable (or its complement) and OP, result in the variable.
    Update {
        /// How: `Add`, `Sub`, `And`, `Or` or `Xor`.
        op: Arith,
        /// With `N`: the variable is complemented first.
        negate: bool,
        /// The variable.
        place: Variable,
    },
    /// `<<` and `>>`.
    Shift {
        /// Direction.
        left: bool,
        /// 0 to 15.
        by: u8,
    },
    /// BCD to binary.
    Bin,
    /// Binary to BCD.
    Bcd,
    /// The beginning of a bracket that is an operand: OP is kept in this slot, and the bracket
    /// computes in OP.
    Push(u16),
    /// The end of such a bracket: OP becomes the kept value combined with OP.
    Apply {
        /// How they are combined.
        op: Arith,
        /// The slot of the kept value.
        slot: u16,
    },
    /// A condition: a range of [`Program::condition_parts`]. If it does not hold, execution goes on
    /// after the statement `otherwise`, its `E` or `Z`.
    If {
        /// First of its parts.
        first: u32,
        /// Number of its parts.
        count: u32,
        /// The index of its `E` or else its `Z`.
        otherwise: u32,
    },
    /// `E`: execution goes on after the statement `end`, the `Z`.
    Else {
        /// The index of the `Z`.
        end: u32,
    },
    /// `Z`.
    EndIf,
    /// `:nnn`
    Label(u16),
    /// `Gnnn`
    Goto(u16),
    /// `GFnnn`
    GotoIndirect(u16),
    /// `Cnnn`
    Call(u16),
    /// `CFnnn`
    CallIndirect(u16),
    /// `R`
    Return,
    /// `J0`, `J1`, `J2`
    End(u8),
    /// A statement with a register area.
    Area {
        /// Which.
        op: AreaOp,
        /// Where the area begins in F.
        area: u16,
    },
    /// The body of a text module, up to its `$`.
    Text,
    /// A statement that could not be read.
    Bad {
        /// Whether it began a condition.
        opens: Opens,
    },
}

/// Whether a statement that could not be read began a condition.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Opens {
    /// It did.
    Yes,
    /// It did not.
    No,
    /// Its text does not tell.
    Perhaps,
}

/// A statement.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stmt {
    /// What it does.
    pub(crate) op: Op,
    /// Where its text is.
    pub(crate) span: Span,
}

/// The texts of the modules :197 to :200 (NCT 3.4 to 3.7).
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Texts {
    /// Captions of the softkeys (:197).
    pub(crate) softkeys: Vec<String>,
    /// Messages with an index (:198).
    pub(crate) indexed: Vec<String>,
    /// Error messages (:199).
    pub(crate) messages: Vec<String>,
    /// A text about the program (:200).
    pub(crate) info: String,
}

/// A checked program.
#[derive(Clone, Debug)]
pub(crate) struct Program {
    /// The source file's name.
    pub(crate) name: String,
    /// The source text, decoded, for the comments of listings.
    pub(crate) text: String,
    /// The line of each statement, from 1.
    pub(crate) lines: Vec<u32>,
    /// Statements in the order of the text.
    pub(crate) stmts: Vec<Stmt>,
    /// The parts of all conditions.
    pub(crate) condition_parts: Vec<ConditionPart>,
    /// Where each label is: the index of its statement.
    pub(crate) labels: Vec<Option<u32>>,
    /// The texts of its text modules.
    pub(crate) texts: Texts,
    /// How many values of OP nested brackets keep at once, at most: [`Op::Push`]'s slots.
    pub(crate) slots: u16,
}
