//! The connection to a control that runs: its socket (docs/socket.md).
//!
//! A monitor can do a control no harm: the control serves its socket in a thread of its own and limits
//! what clients may ask. For its part the link asks for one thing at a time, waits a bounded time for each
//! reply, and after a failure leaves the control alone for a while.

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, ErrorKind, Read, Write};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use serde_json::{Map, Value as Json, json};

use crate::Refusal;
use crate::view::NamedValue;

/// The version of the protocol.
const VERSION: u64 = 1;
/// How long a reply is waited for.
const TIMEOUT: Duration = Duration::from_secs(1);
/// How long the reply to an online change is waited for: the control reads the artifact and makes an engine of it first.
const SWAP_TIMEOUT: Duration = Duration::from_secs(60);
/// How long the control is left alone after a failure.
const PAUSE: Duration = Duration::from_secs(2);
/// How long a status is taken for the present one.
const STATUS_AGE: Duration = Duration::from_millis(250);
/// The longest reply that is read, in bytes.
const MAX_REPLY: u64 = 16 << 20;
/// How many names one request has at most, so that their values are of one moment.
const MAX_NAMES: usize = 256;

/// What a control says of itself.
#[derive(Clone, Debug, Default)]
pub(crate) struct ControlStatus {
    /// `prepared`, `running` or `stopped`.
    pub(crate) state: String,
    pub(crate) ticks: u64,
    pub(crate) dialect: String,
    pub(crate) program: String,
    pub(crate) forces: Vec<NamedValue>,
    pub(crate) allow: Vec<String>,
    /// How often the program was replaced.
    pub(crate) generation: u64,
    /// The fingerprint of the program's executive, in hexadecimal digits.
    pub(crate) fingerprint: String,
}

/// The values of variables at one moment.
#[derive(Clone, Debug, Default)]
pub(crate) struct Values {
    pub(crate) ticks: u64,
    pub(crate) values: BTreeMap<String, Json>,
}

/// A connection that comes back by itself.
#[derive(Debug)]
pub(crate) struct Link {
    path: PathBuf,
    stream: Option<BufReader<UnixStream>>,
    /// Before this moment no connection is tried.
    not_before: Option<Instant>,
    status: Option<(Instant, ControlStatus)>,
    /// How long the next reply is waited for.
    timeout: Duration,
    /// Why there is no connection.
    error: Option<String>,
}

impl Link {
    /// A link to the control at a socket, which need not be there yet.
    pub(crate) fn new(path: &Path) -> Self {
        let path = path.to_owned();
        Self { path, stream: None, not_before: None, status: None, timeout: TIMEOUT, error: None }
    }

    /// What the control said last; `None` while there is no connection.
    pub(crate) fn status(&self) -> Option<&ControlStatus> {
        self.status.as_ref().map(|(_, status)| status)
    }

    /// Why there is no connection.
    pub(crate) fn error(&self) -> Option<&str> {
        self.error.as_deref()
    }

    /// Asks for the status, unless it is young enough.
    pub(crate) fn poll(&mut self) {
        let is_young = self.status.as_ref().is_some_and(|(at, _)| at.elapsed() < STATUS_AGE);
        if !is_young {
            // Why it fails is shown with the state of the connection.
            let _ = self.ask_status();
        }
    }

    /// Asks for the status, however young the last one is.
    pub(crate) fn ask_status(&mut self) -> Result<ControlStatus, Refusal> {
        let reply = self.ask(&json!({"request": "status"}))?;
        let status = status_of(&reply);
        self.status = Some((Instant::now(), status.clone()));
        Ok(status)
    }

    /// Has the next [`poll`](Self::poll) ask for the status.
    fn expire(&mut self) {
        if let Some((at, _)) = &mut self.status
            && let Some(old) = at.checked_sub(STATUS_AGE)
        {
            *at = old;
        }
    }

    /// How long ticks and scans take, as the control measures it.
    pub(crate) fn timing(&mut self) -> Result<Json, Refusal> {
        self.ask(&json!({"request": "stat"}))
    }

    /// Values of single variables. Up to [`MAX_NAMES`] of them are of one moment.
    pub(crate) fn get(&mut self, names: &[String]) -> Result<Values, Refusal> {
        let mut found = Values::default();
        for names in names.chunks(MAX_NAMES) {
            let reply = self.ask(&json!({"request": "get", "names": names}))?;
            found.ticks = reply.get("ticks").and_then(Json::as_u64).unwrap_or(0);
            if let Some(values) = reply.get("values").and_then(Json::as_object) {
                found
                    .values
                    .extend(values.iter().map(|(name, value)| (name.clone(), value.clone())));
            }
        }
        Ok(found)
    }

    /// Sets a variable once; gives the tick before which it is done.
    pub(crate) fn set(&mut self, name: &str, value: &str) -> Result<u64, Refusal> {
        self.change(json!({"request": "set", "values": [{"name": name, "value": value}]}))
    }

    /// Forces a variable.
    pub(crate) fn force(&mut self, name: &str, value: &str) -> Result<u64, Refusal> {
        self.change(json!({"request": "force", "values": [{"name": name, "value": value}]}))
    }

    /// Ends the force of a variable, or of all.
    pub(crate) fn release(&mut self, name: Option<&str>) -> Result<u64, Refusal> {
        self.change(match name {
            Some(name) => json!({"request": "unforce", "names": [name]}),
            None => json!({"request": "unforce", "all": true}),
        })
    }

    /// Replaces the program by an artifact; gives the first tick of the new one.
    pub(crate) fn swap(&mut self, artifact: &Path) -> Result<u64, Refusal> {
        self.exchange_program(json!({"request": "swap", "path": artifact}))
    }

    /// Has the program run again that was replaced last; gives its first tick.
    pub(crate) fn rollback(&mut self) -> Result<u64, Refusal> {
        self.exchange_program(json!({"request": "rollback"}))
    }

    fn exchange_program(&mut self, request: Json) -> Result<u64, Refusal> {
        self.timeout = SWAP_TIMEOUT;
        let changed = self.change(request);
        self.timeout = TIMEOUT;
        changed
    }

    fn change(&mut self, request: Json) -> Result<u64, Refusal> {
        let reply = self.ask(&request);
        self.expire();
        Ok(reply?.get("ticks").and_then(Json::as_u64).unwrap_or(0))
    }

    /// Sends a request and gives the result of its reply.
    fn ask(&mut self, request: &Json) -> Result<Json, Refusal> {
        if self.not_before.is_some_and(|at| Instant::now() < at) {
            return Err(Refusal::new(self.error.clone().unwrap_or_default()));
        }
        match self.exchange(request) {
            Ok(reply) => {
                self.error = None;
                result_of(&reply)
            }
            Err(error) => {
                let what = self.path.display();
                let text = match error.kind() {
                    ErrorKind::NotFound => format!("{what}: there is no such socket"),
                    ErrorKind::ConnectionRefused => format!("{what}: no control listens there"),
                    ErrorKind::PermissionDenied => {
                        format!("{what}: it is for the user who runs the control, and for root")
                    }
                    ErrorKind::WouldBlock | ErrorKind::TimedOut => {
                        format!("{what}: the control does not answer")
                    }
                    ErrorKind::BrokenPipe
                    | ErrorKind::ConnectionReset
                    | ErrorKind::UnexpectedEof => {
                        format!("{what}: the control has closed the connection")
                    }
                    _ => format!("{what}: {error}"),
                };
                self.stream = None;
                self.status = None;
                self.not_before = Some(Instant::now() + PAUSE);
                self.error = Some(text.clone());
                Err(Refusal::new(text))
            }
        }
    }

    fn exchange(&mut self, request: &Json) -> std::io::Result<Json> {
        let stream = match self.stream.take() {
            Some(stream) => stream,
            None => {
                let stream = UnixStream::connect(&self.path)?;
                stream.set_write_timeout(Some(TIMEOUT))?;
                BufReader::new(stream)
            }
        };
        let stream = self.stream.insert(stream);
        stream.get_ref().set_read_timeout(Some(self.timeout))?;
        let mut request: Map<String, Json> = request.as_object().cloned().unwrap_or_default();
        request.insert("version".into(), VERSION.into());
        let line = format!("{}\n", Json::Object(request));
        stream.get_mut().write_all(line.as_bytes())?;
        let mut line = vec![];
        stream.by_ref().take(MAX_REPLY).read_until(b'\n', &mut line)?;
        if line.last() != Some(&b'\n') {
            return Err(ErrorKind::UnexpectedEof.into());
        }
        Ok(serde_json::from_slice(&line)?)
    }
}

/// What a reply gives, or why it refuses.
fn result_of(reply: &Json) -> Result<Json, Refusal> {
    if let Some(result) = reply.get("result") {
        return Ok(result.clone());
    }
    let message = reply.pointer("/error/message").and_then(Json::as_str);
    let text = message.unwrap_or("the control's reply is of another version");
    Err(Refusal::new(text.chars().filter(|c| !c.is_control()).collect::<String>()))
}

fn status_of(reply: &Json) -> ControlStatus {
    let text = |key: &str| {
        let found = reply.get(key).and_then(Json::as_str).unwrap_or_default();
        found.chars().filter(|c| !c.is_control()).collect::<String>()
    };
    let number = |key: &str| reply.get(key).and_then(Json::as_u64).unwrap_or(0);
    let list = |key: &str| reply.get(key).and_then(Json::as_array).cloned().unwrap_or_default();
    let force = |row: &Json| {
        let of = |key: &str| row.get(key).and_then(Json::as_str).map(str::to_owned);
        Some(NamedValue { name: of("name")?, value: of("value")?, written: true })
    };
    ControlStatus {
        state: text("state"),
        ticks: number("ticks"),
        dialect: text("dialect"),
        program: text("program"),
        forces: list("forces").iter().filter_map(force).collect(),
        generation: number("generation"),
        fingerprint: text("fingerprint"),
        allow: list("allow").iter().filter_map(|word| word.as_str().map(str::to_owned)).collect(),
    }
}

#[cfg(test)]
mod tests {
    use std::os::unix::net::UnixListener;
    use std::thread;

    use super::*;

    /// A control that answers each request by the next of `replies`, and then is silent.
    fn control(name: &str, replies: &'static [&'static str]) -> PathBuf {
        let path = std::env::temp_dir().join(format!("plcc-{name}-{}", std::process::id()));
        let _ = std::fs::remove_file(&path);
        let listener = UnixListener::bind(&path).unwrap();
        thread::spawn(move || {
            let (stream, _) = listener.accept().unwrap();
            let mut stream = BufReader::new(stream);
            for reply in replies {
                let mut line = String::new();
                stream.read_line(&mut line).unwrap();
                stream.get_mut().write_all(format!("{reply}\n").as_bytes()).unwrap();
            }
            let mut rest = String::new();
            let _ = stream.read_to_string(&mut rest);
        });
        path
    }

    #[test]
    fn a_control_is_asked_and_its_refusal_is_shown() {
        let path = control(
            "link",
            &[
                r#"{"ok":true,"result":{"state":"running","ticks":7,"allow":["force"],"forces":[{"name":"A","value":"1"}]}}"#,
                r#"{"ok":false,"error":{"code":"denied","message":"no \u001bwrite"}}"#,
                r#"{"ok":true,"result":{"ticks":9,"values":{"A":1}}}"#,
            ],
        );
        let mut link = Link::new(&path);
        link.poll();
        let status = link.status().unwrap();
        assert_eq!((status.state.as_str(), status.ticks), ("running", 7));
        assert_eq!(status.forces[0].name, "A");
        assert_eq!(link.set("A", "1").unwrap_err().message, "no write");
        assert_eq!(link.get(&["A".into()]).unwrap().values["A"], 1);
    }

    #[test]
    fn a_control_that_is_silent_is_left_alone() {
        let path = control("silent", &[]);
        let mut link = Link::new(&path);
        link.poll();
        assert!(link.status().is_none());
        assert!(link.error().unwrap().ends_with("the control does not answer"));
        // The next request is not even sent.
        let begun = Instant::now();
        assert!(link.timing().is_err());
        assert!(begun.elapsed() < TIMEOUT);
    }
}
