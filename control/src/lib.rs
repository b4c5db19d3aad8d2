//! A control as its options say, without files, clocks and sockets around it.
//!
//! [`ControlArgs`] are the options that a control of each language has, and [`executive()`] makes the control of a
//! program from them. [`Watch`] finds the variables of a list of names and patterns, and [`dump`](dump()) writes the state of
//! a control as one line of JSON. `plcrt` and `plcc run` add their services to this, `libplcrt` uses it as it is.
//!
//! ```no_run
//! use plcc_abi::{Engine, Program};
//! use plcc_control::{ControlArgs, executive};
//! use plcc_runtime::Purpose;
//!
//! # fn run(program: &Program, engine: &mut dyn Engine) -> Result<(), Box<dyn std::error::Error>> {
//! let mut control = executive(program, &ControlArgs::default(), false, None)?;
//! let lamp = control.names().find("LS27", Purpose::Watch)?;
//! control.tick(engine, &mut vec![]).map_err(|stop| stop.message)?;
//! println!("LS27 is {}", control.read(lamp));
//! # Ok(())
//! # }
//! ```

pub mod dump;
mod options;
mod watch;

pub use dump::dump;
pub use options::{
    ControlArgs, ControlError, NctArgs, PmacArgs, PmiArgs, executive, takes_machine_file,
};
pub use watch::Watch;
