//! What NCT's executive knows of a program.

use alloc::{string::String, vec::Vec};

use serde::{Deserialize, Serialize};

use super::{FlagLocation, NctName, NctSettings};

/// The code that a module can reach: its own statements and those of all subroutines and labels that they
/// lead to. By it an online change knows a suspended module again. Statements are numbered from 0 over
/// all those that can be reached, in the source's order.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ReachableCode {
    /// A hash of these statements.
    pub fingerprint: u64,
    /// For each resume point of the program the number of its statement, `None` where the module can't
    /// reach it.
    pub resume_points: Vec<Option<u32>>,
    /// The numbers of the calls among the statements; a call's number is its return address.
    pub calls: Vec<u32>,
}

/// The tables of an NCT program. Its tasks are `:000`, `:001` and, where there is one, `:002`, in
/// this order.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct NctTables {
    /// Where the bytes of the running module's input image lie, [`IMAGE_BYTES`](super::IMAGE_BYTES) of them.
    pub inputs: Vec<FlagLocation>,
    /// Where the bytes of the input image of its run before lie.
    pub previous: Vec<FlagLocation>,
    /// Where the bytes of the output image lie.
    pub outputs: Vec<FlagLocation>,
    /// Where the bytes of the local variables F lie, [`FLAG_BYTES`](super::FLAG_BYTES) of them.
    pub flags: Vec<FlagLocation>,
    /// Captions of softkeys, module :197; Y500 is the first's lamp.
    pub texts197: Vec<String>,
    /// Indexed messages, module :198, of Y700 and on with RH090 and on.
    pub texts198: Vec<String>,
    /// Messages, module :199, of Y710 and on.
    pub texts199: Vec<String>,
    /// What the program says of itself, module :200.
    pub info: String,
    /// The variables that the program names, each once, in natural sort order. A dump shows these.
    pub named: Vec<NctName>,
    /// The code that each module can reach, in the order of the tasks.
    pub reachable: Vec<ReachableCode>,
    /// What the machine file said when the program was compiled.
    pub settings: NctSettings,
}
