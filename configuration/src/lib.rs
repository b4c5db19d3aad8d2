//! The configuration file of a controller, `plcrt run --config FILE.toml`, which the programs `plcrt` and `plcio` both read: its entries
//! `[[io]]`, which say which variable of the program belongs to which point outside, and the table `[plcio]` with the settings of
//! the drivers. `docs/controller.md` and `docs/wiring.md` explain it for users.
//!
//! ```toml
//! [[io]]
//! name = "LS1..LS16"                            # a variable, or a range in the language's own numbering
//! driver = "modbus-tcp"
//! address = "192.168.1.10:502/1/discrete/0"     # of the first point; the others follow it
//! safe = 0
//! timeout = "200ms"
//! ```
//!
//! Whatever is read here finds all of its mistakes, each with its line. So the keys of a table are read one by one ([`Keys`]); serde
//! would end at the first mistake.
//!
//! A driver is a file or a folder of `drivers/` with its addresses, its settings and what is wrong with its points, and a line in the
//! list of `drivers/mod.rs`. Its other half, which exchanges the values, is a folder of `plcio`.
//!
//! | file | holds |
//! | --- | --- |
//! | `file.rs` | the whole file |
//! | `keys.rs` | the keys of a table, one by one, with places for mistakes |
//! | `value.rs` | the values that keys have |
//! | `time.rs` | times with their units |
//! | `mistake.rs` | mistakes and warnings |
//! | `line_numbers.rs` | which line an offset is in |
//! | `entry.rs` | the entries `[[io]]` as they are written |
//! | `range.rs` | ranges of names |
//! | `driver.rs` | what a driver says of its addresses, its settings and its points |
//! | `drivers/` | the drivers |
//! | `point.rs` | a variable and its point outside |
//! | `check.rs` | compares entries with the variables of a program |
//! | `outside_range.rs` | variables whose values the format of their point can't hold |
//! | `plcio.rs` | the table `[plcio]` |

mod addresses;
mod check;
mod driver;
pub mod drivers;
mod entry;
mod file;
mod keys;
mod line_numbers;
mod mistake;
mod outside_range;
mod plcio;
mod point;
mod range;
pub mod value;

pub use check::{Checked, points};
pub use driver::{About, Driver, ReadSettings};
pub use drivers::DriverSettings;
pub use entry::{DEFAULT_TIMEOUT, Entry, entries};
pub use file::{Configuration, Findings, SafeEntry};
pub use keys::Keys;
pub use line_numbers::LineNumbers;
pub use mistake::{Mistake, Mistakes, Warning};
pub use plcio::Plcio;
pub use point::{Address, Point, ValueFormat};
