//! Offsets, sizes and counts that the compiler and the executive of NCT share.

/// Layout of the region `context`, which the executive exchanges with the module that runs.
pub mod context {
    /// Register OP, 16 bits.
    pub const OP: u32 = 0;
    /// How many calls are open: the number of return addresses in use, 16 bits.
    pub const DEPTH: u32 = 2;
    /// How many safepoints may still be passed, 32 bits. Each safepoint that is passed takes one off;
    /// at 0 the module is suspended or stopped, as [`ON_EMPTY`] says.
    pub const FUEL: u32 = 4;
    /// What happens when the fuel is used up, 8 bits: 0 suspends, 1 traps with
    /// [`TrapCode::Timeout`](crate::TrapCode::Timeout).
    pub const ON_EMPTY: u32 = 8;
    /// Return addresses, 32 bits each, in all engines alike: the number of the calling statement
    /// (`C…` or `CF…`), counted from 0 over all of them in the source's order.
    pub const SITES: u32 = 12;
    /// The most calls that may be open at once; one more traps with
    /// [`TrapCode::CallDepth`](crate::TrapCode::CallDepth).
    pub const MAX_DEPTH: u16 = 32;
    /// The length of the region in bytes.
    pub const SIZE: u32 = 144;
}

/// The names of the regions that the executive finds, beside the [`FlagLocation`](super::FlagLocation)s
/// in the tables.
pub mod region {
    /// The running module's registers, laid out as [`context`](super::context) says.
    pub const CONTEXT: &str = "context";
    /// The input image of the running module: bytes that are kept as bytes, and those that are kept
    /// as eight bytes of 0 or 1.
    pub const INPUT: [&str; 2] = ["input_bytes", "input_bits"];
    /// The input image of that module's run before, in the same two parts; V compares the two.
    pub const PREVIOUS: [&str; 2] = ["previous_bytes", "previous_bits"];
    /// The output image, in two parts.
    pub const OUTPUT: [&str; 2] = ["output_bytes", "output_bits"];
    /// The local variables, in two parts.
    pub const FLAG: [&str; 2] = ["flag_bytes", "flag_bits"];
    /// The physical input lines of the boards, 8 in each byte.
    pub const LINES_IN: &str = "lines_in";
    /// The physical output lines.
    pub const LINES_OUT: &str = "lines_out";
    /// Registers RH, 16 bits each, as all that follow.
    pub const RH: &str = "rh";
    /// Counters Q.
    pub const Q: &str = "q";
    /// 20 ms timers T.
    pub const T: &str = "t";
    /// Second timers H.
    pub const H: &str = "h";
    /// Minute timers M.
    pub const M: &str = "m";
    /// PLC constants RP; RP001 is at index 1.
    pub const RP: &str = "rp";
}

/// Bytes of an input or output image (`Ipqr` is bit r of byte pq).
pub const IMAGE_BYTES: usize = 100;
/// The most modules that a program has: :000, :001 and :002.
pub const MODULES: usize = 3;
/// Bytes of the physical lines: four boards of ten.
pub const LINE_BYTES: usize = 40;
/// Bytes of local variables, F000 to F999 (NCT 2.3).
pub const FLAG_BYTES: usize = 1000;
/// The first local variable that survives power-off (NCT 2.3).
pub const RETAINED_FROM: usize = 500;
/// Registers RH000 to RH199.
pub const RH_COUNT: u16 = 200;
/// Counters Q00 to Q31.
pub const Q_COUNT: u16 = 32;
/// 20 ms timers T00 to T49.
pub const T_COUNT: u16 = 50;
/// Second timers H00 to H99.
pub const H_COUNT: u16 = 100;
/// Minute timers M0 to M9.
pub const M_COUNT: u16 = 10;
/// Words in the region `rp`: an unused one at index 0, then RP001 to RP040.
pub const RP_COUNT: u16 = 41;
