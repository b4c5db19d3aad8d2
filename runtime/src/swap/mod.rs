//! Online change: another version of a program takes the place of the one that runs, between two
//! ticks, and takes its state over.
//!
//! The socket's thread prepares it: it reads the new artifact, makes its engine and executive, and
//! compares the two programs ([`Comparison`]). Variables of the same name belong together; a value is kept
//! where type and number of elements are the same. What changes the meaning of a variable, or the tasks
//! (another type, an input on another line, a task that goes), is refused unless the user accepts it by its
//! name. What is copied where is decided beforehand, as a [`Plan`]. The thread that runs the ticks only
//! carries it out (`Replacement`), without allocating or freeing memory.
//!
//! What is particular to a control stands in its folder, in `transfer.rs`.

mod compare;
mod replaceable;
#[cfg(feature = "args")]
mod replacement;

use plcc_abi::{Program, Tables};

pub use compare::{Change, Comparison, Row};
pub use replaceable::ReplaceableExecutive;
#[cfg(feature = "args")]
pub(crate) use replacement::Replacement;

use crate::nct::NctTransfer;
use crate::pmac::PmacTransfer;
use crate::pmi::PmiTransfer;

/// How the state of one executive becomes that of another one.
#[derive(Clone, Debug, PartialEq)]
pub enum Plan {
    /// Of PMI programs.
    Pmi(PmiTransfer),
    /// Of NCT programs.
    Nct(NctTransfer),
    /// Of PMAC downloads.
    Pmac(PmacTransfer),
}

/// Compares two programs.
///
/// # Errors
/// When the new one is for another control, so that nothing could be taken over.
pub fn compare(old: &Program, new: &Program) -> Result<Comparison, String> {
    match (&old.tables, &new.tables) {
        (Tables::Pmi(old), Tables::Pmi(new)) => Ok(crate::pmi::compare(old, new)),
        (Tables::Nct(was), Tables::Nct(is)) => Ok(crate::nct::compare(old, was, new, is)),
        (Tables::Pmac(was), Tables::Pmac(is)) => crate::pmac::compare(old, was, new, is),
        _ => {
            let name = |program: &Program| program.dialect().name().to_uppercase();
            let (was, is) = (name(old), name(new));
            Err(format!("it is a program in {is}, and the program that runs is in {was}"))
        }
    }
}
