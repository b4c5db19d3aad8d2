//! The protocol of a running control's socket (`plcrt run --socket`): a JSON object a line in both directions.
//! `docs/socket.md` explains it to users.
//!
//! | file | holds |
//! | --- | --- |
//! | `request.rs` | what a client asks for, and what it must be allowed for that |
//! | `answer.rs` | what the control answers to each request |
//! | `operator.rs` | what is on the operator's screen |
//! | `timing.rs` | how long ticks and scans take, as an answer and in the log |
//! | `failure.rs` | why a request was not carried out |
//! | `line.rs` | requests and replies as lines, as the control reads and writes them |
//! | `client.rs` | a connection to a control |
//!
//! Types of answers read those of other versions of plcc too: keys that they don't know are passed over, and
//! those that are missing have the value of the type's `Default`. The keys of requests are exact.
//!
//! ```
//! use std::path::Path;
//! use std::time::Duration;
//!
//! use plcc_protocol::{Assignment, Client, ClientError, Done, Request, Status};
//!
//! # fn example(socket: &Path) -> Result<(), ClientError> {
//! let mut client = Client::connect(socket, Duration::from_secs(30))?;
//! let status: Status = client.ask(&Request::Status {})?;
//! println!("{} is {}", status.program, status.state);
//! let set = Request::Set { values: vec![Assignment::new("@FRO", "80")] };
//! let done: Done = client.ask(&set)?;
//! println!("set before tick {}", done.ticks);
//! # Ok(())
//! # }
//! ```

mod answer;
mod client;
mod failure;
mod line;
mod operator;
mod request;
mod timing;

pub use plcc_abi::printable;

pub use answer::{
    Change, ChangedVariable, Comparison, Done, Force, ForcedBy, OnlineChange, OperatorScreen,
    Retained, Stat, Status, Values, Variable, Variables, WaitingChange,
};
pub use client::{Client, ClientError};
pub use failure::{ErrorCode, Failure};
pub use line::{RequestLine, reply};
pub use operator::{Active, EventKind, OperatorView, PanelCell, touch_key_label};
pub use request::{Assignment, DEFAULT_WAIT, MAX_WAIT, Permission, Request};
pub use timing::{TaskSummary, TimesSummary, TimingSummary};

/// The version of the protocol, which every request names.
pub const VERSION: u64 = 1;
/// The longest request in bytes, with its line feed.
pub const MAX_REQUEST: usize = 64 << 10;
/// How many variables one request may name, each pattern counted as the variables that it matches.
pub const MAX_NAMES: usize = 10_000;
/// How many variables are read, set and forced before one tick at most. Those of one request belong to the same moment if they
/// are no more.
pub const VALUES_PER_TICK: usize = 256;
