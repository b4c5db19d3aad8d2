//! What NCT's executive knows of a program.
//!
//! The state of an NCT program has a fixed shape; the compiler only chooses where it lies and
//! which bytes of flags are kept as eight bytes of 0 or 1. Beside the [homes](NctHome) of I, Y and
//! F the image has these regions, found by name, little endian, zero at power-up:
//!
//! | region | holds |
//! | --- | --- |
//! | `context` | the running module's [registers](context) |
//! | `input_bytes`, `input_bits` | the input image of the running module |
//! | `previous_bytes`, `previous_bits` | that module's image before, for V |
//! | `output_bytes`, `output_bits` | the output image, Y |
//! | `flag_bytes`, `flag_bits` | F000 to F999 |
//! | `lines_in`, `lines_out` | the physical lines of the boards, a byte each, 10 a board |
//! | `rh`, `q`, `t`, `h`, `m`, `rp` | registers of 16 bits; RP001 is at index 1 |

mod flag_location;
mod name;
mod settings;
mod symbols;

use alloc::{string::String, vec::Vec};

use serde::{Deserialize, Serialize};

pub use flag_location::NctHome;
pub use name::{NctName, NctNameError};
pub use settings::{NctControl, NctSettings, ToolPot};
pub(crate) use symbols::symbols;

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

/// The tables of an NCT program. Its tasks are `:000`, `:001` and, where there is one, `:002`, in
/// this order.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct NctTables {
    /// Where the bytes of the running module's input image are, [`IMAGE_BYTES`] of them.
    pub inputs: Vec<NctHome>,
    /// Where the bytes of its image before are.
    pub previous: Vec<NctHome>,
    /// Where the bytes of the output image are.
    pub outputs: Vec<NctHome>,
    /// Where the local variables are, [`FLAG_BYTES`] of them.
    pub flags: Vec<NctHome>,
    /// Captions of softkeys, module :197; Y500 is the first's lamp.
    pub texts197: Vec<String>,
    /// Indexed messages, module :198, of Y700 and on with RH090 and on.
    pub texts198: Vec<String>,
    /// Messages, module :199, of Y710 and on.
    pub texts199: Vec<String>,
    /// What the program says of itself, module :200.
    pub info: String,
    /// What the program names, in natural order and each once: a dump's variables.
    pub named: Vec<NctName>,
    /// What the machine file said when the program was compiled.
    pub settings: NctSettings,
}
