//! A control that runs while its record is debugged: what the user sets acts on it, as by `plcctl`.
//!
//! The control serves requests by its socket (docs/socket.md) if it was started with `--allow`, and notes each change in
//! its log and in its record, with the user.

use std::io::{BufRead, BufReader, Read, Write};
use std::os::unix::net::UnixStream;
use std::path::PathBuf;
use std::time::Duration;

use serde_json::{Value as Json, json};

use crate::DebugError;

/// How long a reply is waited for.
const TIMEOUT: Duration = Duration::from_secs(5);
/// The longest reply that is read, in bytes.
const MAX_REPLY: u64 = 1 << 20;

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
        let mut request = match (value, force) {
            (Some(value), _) => json!({"values": [{"name": name, "value": value}]}),
            (None, true) => json!({"names": [name]}),
            (None, false) => return Err(DebugError::new("a value is missing")),
        };
        if let Some(request) = request.as_object_mut() {
            let what = match (value, force) {
                (Some(_), false) => "set",
                (Some(_), true) => "force",
                (None, _) => "unforce",
            };
            request.insert("request".into(), what.into());
            request.insert("version".into(), 1.into());
        }
        let reply = self.exchange(&request).map_err(|error| {
            DebugError(format!("{}: the control does not answer: {error}", self.path.display()))
        })?;
        let ticks = reply.pointer("/result/ticks").and_then(Json::as_u64);
        ticks.ok_or_else(|| {
            let message = reply.pointer("/error/message").and_then(Json::as_str);
            let text = message.unwrap_or("the control's reply is of another version");
            DebugError(text.chars().filter(|c| !c.is_control()).collect())
        })
    }

    fn exchange(&self, request: &Json) -> std::io::Result<Json> {
        let stream = UnixStream::connect(&self.path)?;
        stream.set_read_timeout(Some(TIMEOUT))?;
        stream.set_write_timeout(Some(TIMEOUT))?;
        let mut stream = BufReader::new(stream);
        stream.get_mut().write_all(format!("{request}\n").as_bytes())?;
        let mut line = vec![];
        stream.take(MAX_REPLY).read_until(b'\n', &mut line)?;
        Ok(serde_json::from_slice(&line)?)
    }
}

#[cfg(test)]
mod tests {
    use std::os::unix::net::UnixListener;
    use std::thread;

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
