//! A connection to a control.

use std::io::{BufRead, BufReader, ErrorKind, Read, Write};
use std::os::unix::fs::FileTypeExt;
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::time::Duration;

use serde_json::Value as Json;

/// The version of the protocol.
const VERSION: u64 = 1;
/// The longest reply that is read, in bytes.
const MAX_REPLY: u64 = 64 << 20;

/// Why there is no result.
#[derive(Debug)]
pub(crate) enum Error {
    /// The control refused the request; what it said.
    Refused(Json),
    /// There is no control, or it does not answer; the reason is for people.
    Unreachable(String),
}

/// A connection.
pub(crate) struct Client {
    stream: BufReader<UnixStream>,
}

fn unreachable(what: &str, error: &std::io::Error) -> Error {
    Error::Unreachable(match error.kind() {
        ErrorKind::NotFound => format!("{what}: there is no such socket"),
        ErrorKind::ConnectionRefused => format!("{what}: no control listens there any more"),
        ErrorKind::PermissionDenied => {
            format!("{what}: it is for the user who runs the control, and for root")
        }
        ErrorKind::WouldBlock | ErrorKind::TimedOut => format!("{what}: no reply came in time"),
        _ => format!("{what}: {error}"),
    })
}

/// Whether there is something at a path that is no socket.
fn is_no_socket(path: &Path) -> bool {
    std::fs::metadata(path).is_ok_and(|about| !about.file_type().is_socket())
}

impl Client {
    /// Connects to a socket; each reply is waited for as long as `timeout`.
    pub(crate) fn connect(path: &Path, timeout: Duration) -> Result<Self, Error> {
        let what = path.display().to_string();
        let failed = |error| unreachable(&what, &error);
        let stream = UnixStream::connect(path).map_err(|error| match is_no_socket(path) {
            true => {
                Error::Unreachable(format!("{what}: it is no socket; plcrt --socket makes one"))
            }
            false => failed(error),
        })?;
        stream.set_read_timeout(Some(timeout)).map_err(failed)?;
        stream.set_write_timeout(Some(timeout)).map_err(failed)?;
        Ok(Self { stream: BufReader::new(stream) })
    }

    /// Sends a request and gives the result of its reply.
    pub(crate) fn ask(&mut self, request: &Json) -> Result<Json, Error> {
        let failed = |error| unreachable("the control", &error);
        let mut request = request.clone();
        if let Some(map) = request.as_object_mut() {
            map.insert("version".into(), VERSION.into());
        }
        let sent = self.stream.get_mut().write_all(format!("{request}\n").as_bytes());
        // A control that sends a client away closes the connection after its reply.
        if let Err(error) = sent.as_ref()
            && error.kind() != ErrorKind::BrokenPipe
        {
            return Err(unreachable("the control", error));
        }
        let mut line = Vec::new();
        self.stream.by_ref().take(MAX_REPLY).read_until(b'\n', &mut line).map_err(failed)?;
        if line.last() != Some(&b'\n') {
            return Err(Error::Unreachable("the control ended the connection".into()));
        }
        let reply: Json = serde_json::from_slice(&line)
            .map_err(|error| Error::Unreachable(format!("the reply is no JSON: {error}")))?;
        match (reply.get("ok"), reply.get("result"), reply.get("error")) {
            (Some(Json::Bool(true)), Some(result), _) => Ok(result.clone()),
            (_, _, Some(error)) => Err(Error::Refused(error.clone())),
            _ => Err(Error::Unreachable("the reply is of another version".into())),
        }
    }
}
