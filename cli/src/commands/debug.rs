//! `plcc debug`: the Debug Adapter Protocol on standard input and output.

use std::io::{self, BufReader};
use std::path::Path;

use plcc_dap::{LaunchArguments, Launcher};
use plcc_replay::{ControlSocket, Session};

use crate::debug_session::{attach, launch, run_command};
use crate::failure::{DONE, Failure};

pub(crate) fn debug() -> Result<u8, Failure> {
    let input = BufReader::new(io::stdin());
    let served = plcc_dap::serve(input, io::stdout().lock(), &Sources);
    served.map_err(|error| {
        Failure::usage(match error.kind() {
            io::ErrorKind::InvalidData => format!(
                "standard input is not a stream of messages of the Debug Adapter Protocol, which an \
                 editor writes: {error}"
            ),
            _ => format!("the debugger's client is gone: {error}"),
        })
    })?;
    Ok(DONE)
}

/// Makes sessions of source files and of recordings.
struct Sources;

impl Launcher for Sources {
    fn launch(&self, arguments: &LaunchArguments) -> Result<Session<'_>, String> {
        let command = run_command(arguments)?;
        let folder = Path::new(arguments.cwd.as_deref().unwrap_or_default());
        let session = match (arguments.recording.as_deref(), arguments.socket.as_deref()) {
            (Some(path), socket) => {
                attach(&command, &folder.join(path), socket.is_some()).map(|session| {
                    let control = socket.map(|socket| ControlSocket::new(folder.join(socket)));
                    Session { control, ..session }
                })
            }
            (None, Some(_)) => Err(Failure::usage(
                "`socket` needs `recording`: statements and values come from the control's record",
            )),
            (None, None) => launch(&command),
        };
        session.map_err(|failure| failure.text("plcc debug"))
    }
}
