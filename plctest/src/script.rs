//! A test script as it was read: its statements with their places, names and conditions still as text.

use plcc_diag::Span;

/// A piece of a script's text with its place.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Piece {
    /// The text, of a text in quotes without them.
    pub text: String,
    /// Where it stands.
    pub span: Span,
}

/// A length of time, as it was written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Length {
    /// So many ticks.
    Ticks(u64),
    /// So many nanoseconds.
    Time(u64),
}

impl Length {
    /// How many whole ticks it takes, rounded up, where a tick has this length.
    pub fn ticks(self, tick_ns: u64) -> u64 {
        match self {
            Self::Ticks(ticks) => ticks,
            Self::Time(ns) => ns.div_ceil(tick_ns.max(1)),
        }
    }
}

/// What an `expect` looks at.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Expected {
    /// A condition of the program's language holds.
    Condition(Piece),
    /// An event of the test contains a text.
    Message(Piece),
    /// The program was stopped with a code.
    Stop(Piece),
}

/// What a line says.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Body {
    /// `program "FILE"`
    Program(Piece),
    /// `machine "FILE"`
    Machine(Piece),
    /// `simulate`
    Simulate,
    /// `never COND` (`holds` is false) and `always COND`.
    Invariant {
        /// What a condition has to be at the end of each tick.
        holds: bool,
        /// The conditions.
        conditions: Vec<Piece>,
    },
    /// `after COND, COND within TIME`
    Response {
        /// What becomes true.
        after: Piece,
        /// What has to be true then.
        then: Vec<Piece>,
        /// How soon.
        within: Length,
    },
    /// `test "NAME"`
    Test(Piece),
    /// `end`
    End,
    /// `set NAME = VALUE`
    Set(Vec<(Piece, Piece)>),
    /// `pulse NAME for TIME`
    Pulse(Vec<Piece>, Option<Length>),
    /// `force NAME = VALUE`
    Force(Vec<(Piece, Piece)>),
    /// `release NAME`
    Release(Vec<Piece>),
    /// `wait until COND within TIME`
    Wait(Vec<Piece>, Length),
    /// `expect …`
    Expect(Vec<Expected>),
    /// `hold COND for TIME`
    Hold(Vec<Piece>, Length),
    /// `run TIME`
    Run(Length),
    /// `power cycle`
    PowerCycle,
}

/// A statement.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Statement {
    /// What it says.
    pub body: Body,
    /// The whole statement, without a comment.
    pub span: Span,
    /// Its line, from 1.
    pub line: u32,
}

/// A test.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Test {
    /// Its name.
    pub name: Piece,
    /// The line of `test`.
    pub line: u32,
    /// What it does.
    pub statements: Vec<Statement>,
    /// How many of the script's invariants stand above it.
    pub invariants: usize,
}

/// A script.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Script {
    /// The files of the program, in their order.
    pub programs: Vec<Piece>,
    /// The machine file, if one is named.
    pub machine: Option<Piece>,
    /// Where the other side is asked to answer.
    pub simulate: Option<Span>,
    /// `never`, `always` and `after`, in their order.
    pub invariants: Vec<Statement>,
    /// The tests, in their order.
    pub tests: Vec<Test>,
}
