//! Decides conditions about a system of states.

mod correspondence;
mod induction;
mod reachability;
mod sat;
mod told;
mod unroll;

pub use correspondence::correspond;
pub use induction::{Found, search};
pub use reachability::{Effort, invariant};
pub use sat::{Answer, Deadline, Sat};
pub(crate) use told::Told;
pub use unroll::{Start, Trace, Unrolling};
