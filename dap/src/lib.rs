//! The Debug Adapter Protocol: what editors send and get, over two streams.
//!
//! [`serve`] answers requests until the client leaves. `continue` and `reverseContinue` run in short slices of
//! time, and requests that come meanwhile are answered between two slices, so that `pause` works. Other long
//! movements end for `pause` and when the client leaves. Besides the protocol's own requests there are
//! these, for the commands of an editor's extension:
//!
//! | request | arguments | does |
//! | --- | --- | --- |
//! | `plcc/lastWriter` | `name` | goes back to the statement that wrote a variable last |
//! | `plcc/lastChange` | `name` | goes back to the statement that changed it last |
//! | `plcc/scanForward`, `plcc/scanBack` | | goes to the next scan of the task, or the one before |
//! | `plcc/goToTick` | `tick` | goes to the beginning of a tick |
//! | `plcc/position` | | gives tick, milliseconds, and the known ticks |
//!
//! ```
//! use plcc_dap::{LaunchArguments, Launcher};
//! use plcc_replay::Session;
//!
//! /// Opens what an editor names.
//! struct Sources;
//!
//! impl Launcher for Sources {
//!     fn launch(&self, _: &LaunchArguments) -> Result<Session<'_>, String> {
//!         Err("there is no such program".into())
//!     }
//! }
//!
//! let mut answers = vec![];
//! plcc_dap::serve(std::io::empty(), &mut answers, &Sources)?;
//! assert!(answers.is_empty());
//! # Ok::<(), std::io::Error>(())
//! ```
//!
//! Architecture Invariant: no message of a client makes the adapter panic; what can't be done is
//! answered with the reason.

mod answers;
mod console;
mod protocol;
mod server;
mod transport;

use std::io::{self, BufRead, Write};
use std::sync::mpsc;
use std::thread;

use plcc_replay::Interruption;
use plcc_replay::Session;

pub use protocol::{LaunchArguments, OneOrMore};

use server::Server;

/// Makes the session that a client asks for.
pub trait Launcher {
    /// The session for these arguments.
    ///
    /// # Errors
    /// Why there is none, for people: files that can't be read, errors in the program.
    fn launch(&self, arguments: &LaunchArguments) -> Result<Session<'_>, String>;
}

/// Serves one client: reads its messages from `from` and answers on `to`, until it disconnects or its
/// stream ends.
///
/// # Errors
/// When a stream fails, or the client's messages have no valid form.
pub fn serve(
    mut from: impl BufRead + Send + 'static,
    to: impl Write,
    launcher: &dyn Launcher,
) -> io::Result<()> {
    let (sender, receiver) = mpsc::channel();
    let interruption = Interruption::default();
    let noted = interruption.clone();
    // The thread ends with the stream; nobody waits for it, since a client may leave it open.
    thread::spawn(move || {
        loop {
            let message = transport::read(&mut from);
            let is_last = !matches!(message, Ok(Some(_)));
            if message.as_ref().ok().and_then(Option::as_ref).is_none_or(server::interrupts) {
                noted.begin();
            }
            if sender.send(message).is_err() || is_last {
                break;
            }
        }
    });
    Server::new(to, launcher, interruption).serve(&receiver)
}
