//! Offsets, sizes and counts that the compiler and the executive of NCT share.

/// Layout of the region `context`, which the executive exchanges with the module that runs.
pub mod context {
    /// Register OP, 16 bits.
    pub const OP: u32 = 0;
    /// Number of return addresses in use, 16 bits.
    pub const DEPTH: u32 = 2;
    /// Safepoints left, 32 bits. Each passed one takes one off; at 0 the module is suspended or
    /// stopped, as [`ON_EMPTY`] says.
    pub const FUEL: u32 = 4;
    /// What happens when the fuel is used up, 8 bits: 0 suspends, 1 traps with
    /// [`TrapCode::Timeout`](crate::TrapCode::Timeout).
    pub const ON_EMPTY: u32 = 8;
    /// Return addresses, 32 bits each, in all engines alike: the number of the calling statement
    /// (`C…` or `CF…`), counted from 0 over all of them in the source's order.
    pub const SITES: u32 = 12;
    /// How deep calls nest at most.
    pub const MAX_DEPTH: u16 = 32;
    /// Length of the region.
    pub const SIZE: u32 = 144;
}

/// Bytes of an input or output image (`Ipq` is byte pq).
pub const IMAGE_BYTES: usize = 100;
/// Modules that run at most: :000, :001 and :002.
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
/// Words in the region `rp`: RP001 to RP040 behind an unused one.
pub const RP_COUNT: u16 = 41;
