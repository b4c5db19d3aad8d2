//! Control over a Unix socket (`--socket`): other processes of the same user, or of root, look at a
//! running control, set and force variables, stop and start the program, and replace it by another
//! version.
//!
//! A thread of its own serves the socket. What needs the program it hands to the thread that runs the
//! ticks, by a queue of fixed length, and that thread carries out a bounded number of commands before
//! each tick (`hook.rs`): it allocates and frees no memory for them, takes no lock and makes no
//! system call. So nothing that a client does delays a tick. `docs/socket.md` explains the protocol,
//! whose types are in `plcc-protocol`; `plcctl` is a client.
//!
//! | file | holds |
//! | --- | --- |
//! | `server.rs`, `connection.rs`, `peer.rs` | the socket, its clients, who they are |
//! | `token_bucket.rs` | how often a client may ask, and connections are accepted |
//! | `requests/` | what each request does; `online_change.rs`: what `swap` and `rollback` do; `waiting_change.rs`: a change that can't be carried out yet |
//! | `program.rs`, `panel.rs` | the program as the socket's thread knows it, and its operator's screen |
//! | `commands.rs` | what goes between the two threads |
//! | `dialogue.rs` | requests and replies without a socket, for fuzzing |
//! | `hook.rs` | the side of the thread that runs the ticks; it also writes the image file |

mod commands;
mod connection;
mod dialogue;
mod hook;
mod panel;
mod peer;
mod program;
mod requests;
mod server;
#[cfg(test)]
mod tests;
mod token_bucket;

pub(crate) use commands::{RunProgress, queues};
pub use dialogue::Dialogue;
pub(crate) use hook::InterfaceHook;
pub(crate) use peer::Admitted;
pub use peer::{AllowedGroup, AllowedUser};
pub(crate) use requests::Requests;
pub use requests::{Load, Loaded, MakeExecutive, RetainedStatus, RunServices, Timing};
pub use server::SocketError;
pub(crate) use server::{Server, is_in_use};
