//! What PMI's executive knows of a program.
//!
//! Logicals are a byte of 0 or 1 in the image, INTEGERs 16 bits, LONGs 32, arrays contiguous.
//! All offsets are in bytes from the image's start.

use alloc::{format, string::String, vec::Vec};

use serde::{Deserialize, Serialize};

/// A variable's type (PMI 2.2.4).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Type {
    /// True or false, one byte.
    Logical,
    /// 16 bits.
    Integer,
    /// 32 bits.
    Long,
}

impl Type {
    /// Bytes in the image.
    pub fn size(self) -> u32 {
        match self {
            Self::Logical => 1,
            Self::Integer => 2,
            Self::Long => 4,
        }
    }
}

/// How digital lines make a number (PMI 3.1.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Format {
    /// One line, a LOGICAL.
    Bit,
    /// Unsigned binary.
    Binary,
    /// Binary coded decimal.
    Bcd,
    /// Two's complement.
    TwosComplement,
}

/// Lines of one port that make a variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Lines {
    /// The port, 0 to 2047.
    pub port: u16,
    /// Lowest bit, 0 to 7.
    pub low: u8,
    /// Number of bits, 1 to 8.
    pub count: u8,
    /// What they mean.
    pub format: Format,
}

/// What a symbol is to the stimulus, the dump and the executive.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Role {
    /// A variable of the program or the executive.
    Variable,
    /// An input: latched from the lines before a scan.
    Input(Lines),
    /// An output: its lines are written after a scan.
    Output(Lines),
    /// A named constant, an array of them, or a key: its value is in the image from the start.
    Constant,
    /// The control contact of the timer with this index in [`PmiTables::timers`].
    TimerControl(u32),
    /// The clock, preset or clear pin of the flip-flop with this index.
    FlipFlopPin(u32),
}

impl Role {
    /// The lines of an input; `None` for all other symbols.
    pub fn input(self) -> Option<Lines> {
        if let Self::Input(lines) = self { Some(lines) } else { None }
    }

    /// The lines of an output; `None` for all other symbols.
    pub fn output(self) -> Option<Lines> {
        if let Self::Output(lines) = self { Some(lines) } else { None }
    }
}

/// A named variable.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Symbol {
    /// Its name, with the `@` of executive variables.
    pub name: String,
    /// Its type.
    pub ty: Type,
    /// Where it is.
    pub offset: u32,
    /// The number of elements of an array.
    pub elements: Option<u32>,
    /// What it is.
    pub role: Role,
    /// Whether the program declares or names it, so that a dump has it.
    pub dumped: bool,
    /// Whether it survives power-off (PMI 3.4).
    pub retained: bool,
}

/// A timer's kind (PMI 3.1.9).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum TimerKind {
    /// Delay on energising.
    E,
    /// Delay on de-energising.
    D,
}

/// A timer (PMI 3.1.9).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Timer {
    /// Its kind.
    pub kind: TimerKind,
    /// Offset of the control contact, a LOGICAL.
    pub control: u32,
    /// Offset of the delayed contact, a LOGICAL.
    pub delayed: u32,
    /// Offset of the counter, a LONG, -1 when idle, else in units of 20 ms.
    pub counter: u32,
    /// The delay it starts at.
    pub preset: i32,
}

/// A flip-flop (PMI 3.1.10); offsets of LOGICALs, where the pin is declared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FlipFlop {
    /// Output.
    pub q: u32,
    /// Data.
    pub d: Option<u32>,
    /// Clock.
    pub clock: Option<u32>,
    /// Preset.
    pub preset: Option<u32>,
    /// Clear.
    pub clear: Option<u32>,
    /// The clock's value at its last assignment; a byte of 0 or 1 of its own.
    pub last_clock: u32,
}

/// A part of a fault's or message's text.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum TextItem {
    /// Words.
    Text(String),
    /// A variable's value.
    Value {
        /// Its type.
        ty: Type,
        /// Where it is.
        offset: u32,
    },
}

/// A fault or a message (PMI 3.1.7).
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Announcement {
    /// The LOGICAL's name.
    pub name: String,
    /// Where it is.
    pub offset: u32,
    /// What it says.
    pub text: Vec<TextItem>,
}

/// An M or G code that the program declares, for the control to raise (PMI 3.1.8).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct DeclaredCode {
    /// `M` or `G`.
    pub letter: char,
    /// Its number.
    pub number: u16,
    /// Whether the control raises it after the block's movement (/D), not before it (/P).
    pub delayed: bool,
}

impl DeclaredCode {
    /// The name of its variable: `@M03`, `@G175`.
    pub fn name(self) -> String {
        let Self { letter, number, .. } = self;
        format!("@{letter}{number:02}")
    }
}

/// Offsets of the executive variables that the executive itself changes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Special {
    /// `@IPL`: 1 in scan 0 alone.
    pub ipl: u32,
    /// `@ESTOP`: 1 once the program is stopped.
    pub estop: u32,
    /// `@CRSET`: cleared before the next scan.
    pub crset: u32,
}

/// The tables of a PMI program. Every executive variable has its place in the image whether the
/// program names it or not, so that a stimulus can set it.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct PmiTables {
    /// All variables, in natural order of their names.
    pub symbols: Vec<Symbol>,
    /// The timers.
    pub timers: Vec<Timer>,
    /// The flip-flops.
    pub flipflops: Vec<FlipFlop>,
    /// The faults, in the order of their definition.
    pub faults: Vec<Announcement>,
    /// The messages, in the order of their definition.
    pub messages: Vec<Announcement>,
    /// What the executive touches of its own accord.
    pub special: Special,
    /// Offset of the physical lines: 2048 bytes, one a port.
    pub ports: u32,
    /// Values other than 0 at power-up: offset, type, value. Constants and idle counters.
    pub initial: Vec<(u32, Type, i32)>,
    /// The M and G codes that the program declares, in the source's order.
    pub codes: Vec<DeclaredCode>,
}
