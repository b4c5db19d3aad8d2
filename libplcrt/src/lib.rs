//! Runs compiled programs from C, Python and every other language that can call C functions.
//!
//! [`Control`] is a control with its program: it loads an artifact of `plcc build`, does one base tick
//! at a time, and gives and sets variables by the names that users know. [`c`] has the same as C
//! functions; `include/plcrt.h` declares them, `examples/` has a program in C and one in Python. The
//! library contains no compiler. It does not look at the clock: a tick is run when the caller asks for it.
//!
//! ```no_run
//! use plcrt::Control;
//!
//! let mut control = Control::open("lathe.plcx".as_ref(), "--period 10")?;
//! let lamp = control.find("LS27")?;
//! control.set("MCHON", "1")?;
//! while control.ticks() < 100 && control.tick() {
//!     println!("LS27 is {}", control.get(lamp));
//!     while let Some(event) = control.next_event() {
//!         println!("{event}");
//!     }
//! }
//! # Ok::<(), String>(())
//! ```

pub mod c;
mod control;
mod error;
mod found;

pub use control::{Control, Settable};
