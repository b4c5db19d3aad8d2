//! A connection to a control.

use std::fmt::{self, Display, Formatter};
use std::io::{self, BufRead, BufReader, ErrorKind, Read, Write};
use std::os::unix::fs::FileTypeExt;
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::time::Duration;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::{Failure, Request, VERSION};

/// The longest reply that is read, in bytes.
const MAX_REPLY: u64 = 64 << 20;

/// Why there is no result. Its text is for people and holds no control characters.
#[derive(Debug)]
pub enum ClientError {
    /// The control has refused the request.
    Refused(Failure),
    /// There is no control, or it does not answer; the connection is of no more use. The reason is a sentence that begins
    /// with the socket's path.
    Unreachable(String),
}

impl Display for ClientError {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let (Self::Refused(Failure { message: text, .. }) | Self::Unreachable(text)) = self;
        f.write_str(&plcc_abi::printable(text))
    }
}

impl std::error::Error for ClientError {}

/// A connection, by which one request at a time is made.
#[derive(Debug)]
pub struct Client {
    path: PathBuf,
    stream: BufReader<UnixStream>,
}

/// A request as it is sent.
#[derive(Serialize)]
struct Sent<'a> {
    version: u64,
    #[serde(flatten)]
    request: &'a Request,
}

/// What matters of a reply.
#[derive(Deserialize)]
struct Reply<T> {
    result: Option<T>,
    error: Option<Failure>,
}

fn unreachable(path: &Path, why: &str) -> ClientError {
    ClientError::Unreachable(format!("{}: {why}", path.display()))
}

fn failed(path: &Path, error: &io::Error) -> ClientError {
    let why = match error.kind() {
        ErrorKind::NotFound => "there is no such socket",
        ErrorKind::ConnectionRefused => "no control listens there any more",
        ErrorKind::PermissionDenied => "it is for the user who runs the control, and for root",
        ErrorKind::WouldBlock | ErrorKind::TimedOut => "the control does not answer",
        ErrorKind::BrokenPipe | ErrorKind::ConnectionReset | ErrorKind::UnexpectedEof => {
            "the control has closed the connection"
        }
        _ => return unreachable(path, &error.to_string()),
    };
    unreachable(path, why)
}

/// Whether there is something at a path that is not a socket.
fn is_no_socket(path: &Path) -> bool {
    std::fs::metadata(path).is_ok_and(|about| !about.file_type().is_socket())
}

impl Client {
    /// Connects to a socket; each reply is waited for as long as `timeout`, which is not 0.
    ///
    /// # Errors
    /// [`ClientError::Unreachable`].
    pub fn connect(path: &Path, timeout: Duration) -> Result<Self, ClientError> {
        let stream = UnixStream::connect(path).map_err(|error| match is_no_socket(path) {
            true => unreachable(path, "it is not a socket; plcrt run --socket makes one"),
            false => failed(path, &error),
        })?;
        let client = Self { path: path.to_owned(), stream: BufReader::new(stream) };
        client.set_timeout(timeout)?;
        Ok(client)
    }

    /// Sets how long each reply is waited for from now on, which is not 0.
    ///
    /// # Errors
    /// [`ClientError::Unreachable`].
    pub fn set_timeout(&self, timeout: Duration) -> Result<(), ClientError> {
        let stream = self.stream.get_ref();
        let set = stream.set_read_timeout(Some(timeout));
        set.and_then(|()| stream.set_write_timeout(Some(timeout)))
            .map_err(|error| failed(&self.path, &error))
    }

    /// Sends a request and gives the result of its reply, as the type that [`Request`] names or as JSON.
    ///
    /// # Errors
    /// The control refuses it, or does not answer in time, or with something else.
    pub fn ask<T: DeserializeOwned>(&mut self, request: &Request) -> Result<T, ClientError> {
        let Self { path, stream } = self;
        let line = serde_json::to_string(&Sent { version: VERSION, request });
        let line = line.map_err(|error| unreachable(path, &error.to_string()))?;
        match stream.get_mut().write_all(format!("{line}\n").as_bytes()) {
            // A control that sends a client away closes the connection after its reply.
            Err(error) if error.kind() != ErrorKind::BrokenPipe => {
                return Err(failed(path, &error));
            }
            _ => {}
        }
        let mut line = Vec::new();
        let read = stream.by_ref().take(MAX_REPLY).read_until(b'\n', &mut line);
        read.map_err(|error| failed(path, &error))?;
        if line.last() != Some(&b'\n') {
            return Err(failed(path, &ErrorKind::UnexpectedEof.into()));
        }
        match serde_json::from_slice(&line) {
            Ok(Reply { error: Some(failure), .. }) => Err(ClientError::Refused(failure)),
            Ok(Reply { result: Some(result), .. }) => Ok(result),
            Err(error) if !error.is_data() => {
                Err(unreachable(path, &format!("the reply is not JSON: {error}")))
            }
            _ => Err(unreachable(path, "the reply is of another version")),
        }
    }
}
