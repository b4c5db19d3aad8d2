//! What the compiler and the executive of NCT share: the [tables](NctTables), the [layout] of the
//! image, the names of variables, and the language's [arithmetic].
//!
//! The state of an NCT program has a fixed shape; the compiler only chooses where it lies and
//! which bytes of flags are kept as eight bytes of 0 or 1. Beside the [locations](FlagLocation) of I,
//! Y and F the image has these regions, found by name, little-endian. At power-up they are zero, except F500
//! to F999, which are retained:
//!
//! | region | holds |
//! | --- | --- |
//! | `context` | the [registers](context) of the module that runs, OP among them |
//! | `input_bytes`, `input_bits` | the input image of the running module |
//! | `previous_bytes`, `previous_bits` | that module's image before, for V |
//! | `output_bytes`, `output_bits` | the output image, Y |
//! | `flag_bytes`, `flag_bits` | F000 to F999 |
//! | `lines_in`, `lines_out` | the physical lines of the interface boards, a byte each, 10 bytes a board |
//! | `rh`, `q` | registers from the NC, counters; 16 bits each |
//! | `t`, `h`, `m` | timers of 20 ms, seconds and minutes; 16 bits each |
//! | `rp` | constants from parameters, 16 bits each; RP001 is at index 1 |

pub mod arithmetic;
mod flag_location;
pub mod layout;
mod name;
mod settings;
mod symbols;
mod tables;

pub use flag_location::FlagLocation;
pub use layout::{
    FLAG_BYTES, H_COUNT, IMAGE_BYTES, LINE_BYTES, M_COUNT, MODULES, Q_COUNT, RETAINED_FROM,
    RH_COUNT, RP_COUNT, T_COUNT, context,
};
pub use name::{NctName, NctNameError};
pub use settings::{NctControl, NctSettings, ToolPot};
pub use tables::{NctTables, ReachableCode};

impl crate::DialectTables for NctTables {
    type Variable = NctName;

    const NAMES_END_IN_BITS: bool = true;

    fn symbols(&self) -> alloc::vec::Vec<crate::ImageSymbol> {
        symbols::symbols(self)
    }
}
