//! A control that runs while its record is debugged: what the user sets acts on it, as by `plcctl`.
//!
//! The control serves requests by its socket (docs/socket.md) if it was started with `--allow`, and notes each change in
//! its log and in its record, with the user.

use std::path::PathBuf;
use std::time::Duration;

use plcc_protocol::{Assignment, Client, ClientError, Done, Request};

use crate::DebugError;

/// How long a reply is waited for.
const TIMEOUT: Duration = Duration::from_secs(5);

/// The socket of a control.
#[derive(Clone, Debug)]
pub struct ControlSocket {
    path: PathBuf,
}

impl ControlSocket {
    /// The control at a socket. Nothing is connected before something is changed.
    pub fn new(path: impl Into<PathBuf>) -> Self {
        Self { path: path.into() }
    }

    /// Sets a variable once, or with `force` holds it at the value (`None` ends that). Gives the tick before which it is
    /// done.
    ///
    /// # Errors
    /// Why the control refuses it, or does not answer.
    pub fn change(&self, name: &str, value: Option<&str>, force: bool) -> Result<u64, DebugError> {
        let values = |value| vec![Assignment::new(name, value)];
        let request = match (value, force) {
            (Some(value), false) => Request::Set { values: values(value) },
            (Some(value), true) => Request::Force { values: values(value) },
            (None, true) => Request::Unforce { names: vec![name.into()], all: false },
            (None, false) => return Err(DebugError::new("a value is missing")),
        };
        let done = Client::connect(&self.path, TIMEOUT)
            .and_then(|mut client| client.ask::<Done>(&request))
            .map_err(|error| match error {
                ClientError::Refused(_) => DebugError(error.to_string()),
                ClientError::Unreachable(_) => {
                    DebugError(format!("the control does not answer: {error}"))
                }
            })?;
        Ok(done.ticks)
    }
}

#[cfg(test)]
mod tests {
    use std::io::{BufRead, BufReader, Write};
    use std::os::unix::net::UnixListener;
    use std::thread;

    use serde_json::{Value as Json, json};

    use super::*;

    #[test]
    fn a_change_is_a_request_and_a_refusal_an_error() {
        let path = std::env::temp_dir().join(format!("plcc-control-{}", std::process::id()));
        let _ = std::fs::remove_file(&path);
        let listener = UnixListener::bind(&path).unwrap();
        let replies = [
            r#"{"ok":true,"result":{"ticks":812,"count":1}}"#,
            r#"{"ok":false,"error":{"code":"denied","message":"without --allow force"}}"#,
            "no JSON",
        ];
        let served = thread::spawn(move || {
            let mut requests = vec![];
            for reply in replies {
                let (stream, _) = listener.accept().unwrap();
                let mut stream = BufReader::new(stream);
                let mut line = String::new();
                stream.read_line(&mut line).unwrap();
                stream.get_mut().write_all(format!("{reply}\n").as_bytes()).unwrap();
                requests.push(serde_json::from_str::<Json>(&line).unwrap());
            }
            requests
        });
        let control = ControlSocket::new(&path);
        assert_eq!(control.change("N", Some("5"), false), Ok(812));
        let refused = control.change("A", Some("1"), true).unwrap_err();
        assert_eq!(refused.0, "without --allow force");
        assert!(control.change("A", None, true).unwrap_err().0.contains("does not answer"));
        let requests = served.join().unwrap();
        assert_eq!(requests[0]["request"], "set");
        assert_eq!(requests[0]["values"][0]["value"], "5");
        assert_eq!(requests[1]["request"], "force");
        assert_eq!(
            (&requests[2]["request"], &requests[2]["names"][0]),
            (&json!("unforce"), &json!("A"))
        );
        std::fs::remove_file(&path).unwrap();
        assert!(control.change("N", Some("5"), false).is_err());
    }
}
