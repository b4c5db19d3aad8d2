//! What NCT's executive knows of a program.

use alloc::{string::String, vec::Vec};

use serde::{Deserialize, Serialize};

use super::{FlagLocation, NctName, NctSettings};

/// The tables of an NCT program. Its tasks are `:000`, `:001` and, where there is one, `:002`, in
/// this order.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct NctTables {
    /// Where the bytes of the running module's input image are, [`IMAGE_BYTES`](super::IMAGE_BYTES) of them.
    pub inputs: Vec<FlagLocation>,
    /// Where the bytes of its image before are.
    pub previous: Vec<FlagLocation>,
    /// Where the bytes of the output image are.
    pub outputs: Vec<FlagLocation>,
    /// Where the local variables are, [`FLAG_BYTES`](super::FLAG_BYTES) of them.
    pub flags: Vec<FlagLocation>,
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
