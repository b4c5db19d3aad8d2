//! The monitor: what a running or recorded PLC program does, for displays in a terminal and in a
//! browser. This crate holds the model, which knows neither of them.
//!
//! A [`Session`] monitors one of three things, as its [`Target`] says: a control that runs (by its socket, and
//! by its record for what happens within scans), a recording, or a program that the session runs
//! itself. A display does nothing but three calls, in any order:
//!
//! - [`Session::poll`] a few times a second: reads new ticks of a recording, or runs further ticks of a program. It takes at most some 40 ms.
//! - [`Session::view`] for what is to be drawn: a [`View`] of a [`Screen`], plain data.
//! - [`Session::apply`] for what the user does: a [`Command`]; it gives a [`Reply`] or a [`Refusal`], both
//!   with a text for the user.
//!
//! Cursor, selection, watch lists and the tick that is shown belong to the session, so that a display
//! keeps nothing of them, and may vanish and come back (PMI 5.0). All of these types are serialisable: as
//! JSON, a command is `{"command":"go_to_tick","tick":812}`, a screen `{"screen":"statements","count":20}`, a
//! view `{"status":{…},"body":{"screen":"statements",…}}`.
//!
//! A session stays in the thread that opened it. A server runs it in a thread of its own and hands it
//! commands and screens by a channel.
//!
//! The values beside statements (*power flow*, as in displays of ladder diagrams) are exact: the session runs the ticks around the one that is shown again in the
//! statement interpreter, with an observer (see [`plcc_replay`]), and shows what each statement read and
//! wrote.
//!
//! ```
//! use plcc_monitor::view::{Body, Screen};
//! use plcc_monitor::{Command, Target, Refusal, Session};
//!
//! # fn example(target: Target<'_>) -> Result<(), Refusal> {
//! let mut session = Session::open(target);
//! session.poll();
//! session.apply(Command::GoToTick { tick: 812 })?;
//! let view = session.view(&Screen::Statements { first: None, count: 20 });
//! if let Body::Statements(statements) = view.body {
//!     for line in statements.lines {
//!         println!("{:>6} {}", line.number, line.text());
//!     }
//! }
//! # Ok(())
//! # }
//! ```

mod command;
mod flow;
mod link;
mod rebuild;
mod session;
pub mod terminal;
#[cfg(test)]
mod testing;
mod text;
pub mod view;
#[cfg(feature = "web")]
pub mod web;

pub use command::{Command, Edge, ExportFormat, Format, Refusal, Reply, Trigger};
pub use rebuild::{Rebuilder, Rebuilt, RunningProgram};
pub use session::{Session, Target};
pub use view::{Screen, View};

/// The folder for what outlives a session: watch lists, set-ups of the scope, chosen statements. It is `plcc/monitor` below `XDG_STATE_HOME` or
/// `~/.local/state`. `None` if there is no home folder.
pub fn state_folder() -> Option<std::path::PathBuf> {
    session::store::state_folder()
}

/// How many ticks the scope shows at most.
pub const MAX_SCOPE_TICKS: u64 = 1_000_000;
