//! The two controllers that run PLC programs of PMAC.

use serde::{Deserialize, Serialize};

/// The controller that a program is for; what differs between the two, [`Layout`](super::Layout)
/// knows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Controller {
    /// PMAC (1): variables I, P, Q and M 0 to 1023, addresses of 16 bits.
    #[default]
    Pmac,
    /// Turbo PMAC: variables 0 to 8191, addresses of 24 bits.
    Turbo,
}
