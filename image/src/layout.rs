//! Offsets and numbers of an image file, each once. `docs/image.md` explains them byte by byte, and
//! a test compares the two.

/// The first eight bytes of every image file.
pub const MAGIC: [u8; 8] = *b"PLCCIMG1";
/// The version of this layout.
pub const VERSION: u32 = 1;
/// Bytes of the header; the process image begins after it.
pub const HEADER_SIZE: usize = 4096;

/// Offset of [`MAGIC`].
pub const AT_MAGIC: usize = 0x00;
/// Offset of [`VERSION`], 32 bits.
pub const AT_VERSION: usize = 0x08;
/// Offset of [`HEADER_SIZE`], 32 bits.
pub const AT_HEADER_SIZE: usize = 0x0C;
/// Offset of the program's fingerprint, 64 bits.
pub const AT_FINGERPRINT: usize = 0x10;
/// Offset of the language's number, 32 bits: its index in `Dialect::ALL`.
pub const AT_DIALECT: usize = 0x18;
/// Offset of the process image's length in bytes, 32 bits.
pub const AT_IMAGE_SIZE: usize = 0x1C;
/// Offset of the process image's offset in the file, 64 bits.
pub const AT_IMAGE: usize = 0x20;
/// Offset of the offset of the table of variables in the file, 64 bits.
pub const AT_VARIABLES: usize = 0x28;
/// Offset of the length of the table of variables in bytes, 64 bits.
pub const AT_VARIABLES_SIZE: usize = 0x30;
/// Offset of the offset of the table of safe outputs in the file, 64 bits.
pub const AT_SAFE_OUTPUTS: usize = 0x38;
/// Offset of the number of entries in the table of safe outputs, 64 bits.
pub const AT_SAFE_OUTPUTS_COUNT: usize = 0x40;
/// Offset of the length of a tick in nanoseconds, as it was when the file was made, 64 bits.
pub const AT_TICK_NS: usize = 0x48;
/// Offset of the number of the process that writes the file, 64 bits.
pub const AT_PROCESS: usize = 0x50;
/// Offset of the time at which the file was made, in nanoseconds since 1970, 64 bits.
pub const AT_CREATED: usize = 0x58;
/// Offset of the generation, 64 bits: how often the program has been replaced by an online change.
pub const AT_GENERATION: usize = 0x60;

/// Offset of the offset of the table of symbols in the file, 64 bits; 0 where there is none.
pub const AT_SYMBOLS: usize = 0x68;
/// Offset of the number of entries in the table of symbols, 64 bits.
pub const AT_SYMBOLS_COUNT: usize = 0x70;
/// Offset of the offset of the area for inputs in the file, 64 bits; 0 where there is none.
pub const AT_INPUTS: usize = 0x78;

/// Offset of the sequence counter, 64 bits: even between two writes, odd during one.
pub const AT_SEQUENCE: usize = 0x80;
/// Offset of the number of ticks done, 64 bits.
pub const AT_TICKS: usize = 0x88;
/// Offset of the time at which the last tick ended, in nanoseconds of `CLOCK_MONOTONIC`, 64 bits.
pub const AT_TIME: usize = 0x90;
/// Offset of the number of the [`State`], 64 bits.
pub const AT_STATE: usize = 0x98;
/// Offset of the number of forces in effect, 64 bits.
pub const AT_FORCES: usize = 0xA0;

/// Bytes of an entry in the table of safe outputs: offset in the process image (32 bits), mask (8
/// bits), value (8 bits), two bytes of 0.
pub const SAFE_OUTPUT_SIZE: usize = 8;

/// Bytes of an entry in the table of symbols; `symbol.rs` has its parts.
pub const SYMBOL_SIZE: usize = 48;

/// What the control is doing, as the file says it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// The program is loaded, and its first tick has not ended.
    Prepared,
    /// The program runs.
    Running,
    /// The program does not run, by a fault or by a command; its outputs have their safe values.
    Stopped,
    /// The process has ended in order. Nothing is written any more.
    Ended,
    /// Another program has taken this one's place by an online change, and the file of the same
    /// name is another one now. Nothing is written any more.
    Replaced,
    /// The process is dead, and its supervisor has written the safe outputs.
    Dead,
}

impl State {
    /// All states, by their numbers.
    pub const ALL: [Self; 6] =
        [Self::Prepared, Self::Running, Self::Stopped, Self::Ended, Self::Replaced, Self::Dead];

    /// The number in the file.
    pub fn number(self) -> u64 {
        match self {
            Self::Prepared => 0,
            Self::Running => 1,
            Self::Stopped => 2,
            Self::Ended => 3,
            Self::Replaced => 4,
            Self::Dead => 5,
        }
    }

    /// The state of a number; `None` for numbers of later versions.
    pub fn from_number(number: u64) -> Option<Self> {
        Self::ALL.into_iter().find(|state| state.number() == number)
    }

    /// The word for it in messages and answers.
    pub fn name(self) -> &'static str {
        match self {
            Self::Prepared => "prepared",
            Self::Running => "running",
            Self::Stopped => "stopped",
            Self::Ended => "ended",
            Self::Replaced => "replaced",
            Self::Dead => "dead",
        }
    }
}
