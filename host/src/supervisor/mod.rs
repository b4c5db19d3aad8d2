//! The supervisor of a control in real time: a process of its own, which starts the control as its child,
//! watches it, and puts the physical outputs into their safe state when it dies or hangs.
//!
//! The two processes hold the ends of a pair of sockets. The child sends a [`Heartbeat`] every few
//! milliseconds; when it dies, however that happens, the operating system closes its end, and the
//! supervisor knows at once. The other way round the child knows by its end that the supervisor has died,
//! and ends its run: outputs safe, retained data saved.
//!
//! | file | holds |
//! | --- | --- |
//! | `heartbeat.rs` | what the child sends |
//! | `link.rs` | the child's end |
//! | `parent.rs` | the supervisor |
//! | `notify.rs` | messages for systemd, and the hardware watchdog |

mod heartbeat;
mod link;
mod notify;
mod parent;

use std::time::Duration;

pub use heartbeat::{Heartbeat, Phase};
pub(crate) use link::Link;
pub use parent::{Supervision, supervise};

/// The time of the clock that all processes of the computer share (`CLOCK_MONOTONIC`).
pub fn monotonic() -> Duration {
    Duration::from_nanos(plcc_image::monotonic_ns())
}
