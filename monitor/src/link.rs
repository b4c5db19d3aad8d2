//! The connection to a control that runs: its socket (docs/socket.md).
//!
//! A monitor can do a control no harm: the control serves its socket in a thread of its own and limits
//! what clients may ask. For its part the link asks for one thing at a time, waits a bounded time for each
//! reply, and after a failure leaves the control alone for a while.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use plcc_protocol::{
    Assignment, Client, ClientError, Done, OnlineChange, Request, Stat, Status, VALUES_PER_TICK,
    Values,
};
use serde::de::DeserializeOwned;

use crate::Refusal;

/// How long a reply is waited for.
const TIMEOUT: Duration = Duration::from_secs(1);
/// How long the reply to an online change is waited for: the control reads the artifact and makes an engine of it first.
const SWAP_TIMEOUT: Duration = Duration::from_secs(60);
/// How long the control may have an online change wait for a motion program: not at all, since nothing else is shown
/// until its reply comes.
const AT_ONCE: Option<f64> = Some(0.0);
/// How long the control is left alone after a failure.
const PAUSE: Duration = Duration::from_secs(2);
/// How long a status is taken for the present one.
const STATUS_AGE: Duration = Duration::from_millis(250);
/// A connection that comes back by itself.
#[derive(Debug)]
pub(crate) struct Link {
    path: PathBuf,
    client: Option<Client>,
    /// How long replies are waited for, but those to online changes.
    timeout: Duration,
    /// How long the control is left alone after a failure.
    pause: Duration,
    /// Before this moment no connection is tried.
    not_before: Option<Instant>,
    status: Option<(Instant, Status)>,
    /// Why there is no connection.
    error: Option<String>,
}

impl Link {
    /// A link to the control at a socket, which need not be there yet.
    pub(crate) fn new(path: &Path) -> Self {
        Self {
            path: path.to_owned(),
            client: None,
            timeout: TIMEOUT,
            pause: PAUSE,
            not_before: None,
            status: None,
            error: None,
        }
    }

    /// What the control said last; `None` while there is no connection.
    pub(crate) fn status(&self) -> Option<&Status> {
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
    pub(crate) fn ask_status(&mut self) -> Result<Status, Refusal> {
        let mut status: Status = self.ask(&Request::Status {}, self.timeout)?;
        let Status { state, dialect, program, fingerprint, .. } = &mut status;
        for text in [state, dialect, program, fingerprint] {
            *text = plcc_abi::printable(text).into_owned();
        }
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
    pub(crate) fn timing(&mut self) -> Result<Stat, Refusal> {
        self.ask(&Request::Stat {}, self.timeout)
    }

    /// Values of single variables. Up to [`VALUES_PER_TICK`] of them are of one moment. Gives them with the number of ticks that
    /// the control had done when the first of them were read.
    pub(crate) fn get(&mut self, names: &[String]) -> Result<(u64, Values), Refusal> {
        let mut found = Values::default();
        let mut first = None;
        for names in names.chunks(VALUES_PER_TICK) {
            let part: Values = self.ask(&Request::Get { names: names.to_vec() }, self.timeout)?;
            first.get_or_insert(part.ticks);
            found.ticks = part.ticks;
            found.values.extend(part.values);
        }
        Ok((first.unwrap_or(found.ticks), found))
    }

    /// Sets a variable once; gives the tick before which it is done.
    pub(crate) fn set(&mut self, name: &str, value: &str) -> Result<u64, Refusal> {
        self.change(&Request::Set { values: vec![Assignment::new(name, value)] })
    }

    /// Presses a key of the operator's screen, or releases it.
    pub(crate) fn press(&mut self, name: &str, on: bool) -> Result<u64, Refusal> {
        self.change(&Request::Press { name: name.to_owned(), on })
    }

    /// Forces a variable.
    pub(crate) fn force(&mut self, name: &str, value: &str) -> Result<u64, Refusal> {
        self.change(&Request::Force { values: vec![Assignment::new(name, value)] })
    }

    /// Ends the force of a variable, or of all.
    pub(crate) fn release(&mut self, name: Option<&str>) -> Result<u64, Refusal> {
        let names = name.into_iter().map(str::to_owned).collect();
        self.change(&Request::Unforce { names, all: name.is_none() })
    }

    /// Replaces the program by an artifact; gives the first tick of the new one.
    pub(crate) fn swap(&mut self, artifact: &Path) -> Result<u64, Refusal> {
        let path = artifact.to_owned();
        self.exchange_program(&Request::Swap {
            path,
            accept: vec![],
            dry_run: false,
            wait: AT_ONCE,
        })
    }

    /// Has the program run again that was replaced last; gives its first tick.
    pub(crate) fn rollback(&mut self) -> Result<u64, Refusal> {
        self.exchange_program(&Request::Rollback { wait: AT_ONCE })
    }

    fn exchange_program(&mut self, request: &Request) -> Result<u64, Refusal> {
        let changed = self.ask(request, SWAP_TIMEOUT);
        self.expire();
        changed.map(|change: OnlineChange| change.ticks)
    }

    fn change(&mut self, request: &Request) -> Result<u64, Refusal> {
        let changed = self.ask(request, self.timeout);
        self.expire();
        changed.map(|done: Done| done.ticks)
    }

    /// Sends a request and gives the result of its reply, for which it waits as long as `timeout`.
    fn ask<T: DeserializeOwned>(
        &mut self,
        request: &Request,
        timeout: Duration,
    ) -> Result<T, Refusal> {
        if self.not_before.is_some_and(|at| Instant::now() < at) {
            return Err(Refusal::new(self.error.clone().unwrap_or_default()));
        }
        let answer = self.exchange(request, timeout);
        self.error = None;
        answer.map_err(|error| {
            let text = error.to_string();
            if let ClientError::Unreachable(_) = error {
                self.client = None;
                self.status = None;
                self.not_before = Some(Instant::now() + self.pause);
                self.error = Some(text.clone());
            }
            Refusal::new(text)
        })
    }

    fn exchange<T: DeserializeOwned>(
        &mut self,
        request: &Request,
        timeout: Duration,
    ) -> Result<T, ClientError> {
        let client = match self.client.take() {
            Some(client) => client,
            None => Client::connect(&self.path, timeout)?,
        };
        let client = self.client.insert(client);
        client.set_timeout(timeout)?;
        client.ask(request)
    }
}

#[cfg(test)]
mod tests {
    use std::io::{BufRead, BufReader, Read, Write};
    use std::os::unix::net::UnixListener;
    use std::thread;

    use super::*;

    /// A control that answers each request by the next of `replies`, and then is silent. Its thread gives what has come
    /// then, on the first connection and on all that wait when that has ended.
    fn control(
        name: &str,
        replies: &'static [&'static str],
    ) -> (PathBuf, thread::JoinHandle<String>) {
        let path = std::env::temp_dir().join(format!("plcc-{name}-{}", std::process::id()));
        let _ = std::fs::remove_file(&path);
        let listener = UnixListener::bind(&path).unwrap();
        let thread = thread::spawn(move || {
            let (stream, _) = listener.accept().unwrap();
            let mut stream = BufReader::new(stream);
            for reply in replies {
                let mut line = String::new();
                stream.read_line(&mut line).unwrap();
                stream.get_mut().write_all(format!("{reply}\n").as_bytes()).unwrap();
            }
            let mut rest = String::new();
            stream.read_to_string(&mut rest).unwrap();
            listener.set_nonblocking(true).unwrap();
            while let Ok((mut stream, _)) = listener.accept() {
                stream.read_to_string(&mut rest).unwrap();
            }
            rest
        });
        (path, thread)
    }

    #[test]
    fn a_control_is_asked_and_its_refusal_is_shown() {
        let (path, _) = control(
            "link",
            &[
                r#"{"ok":true,"result":{"state":"running","ticks":7,"allow":["force"],"forces":[{"name":"A","value":"1"}]}}"#,
                r#"{"ok":false,"error":{"code":"denied","message":"no \u001bwrite"}}"#,
                r#"{"ok":true,"result":{"ticks":9,"values":{"A":1}}}"#,
            ],
        );
        let mut link = Link::new(&path);
        link.timeout = Duration::from_secs(600);
        link.poll();
        let status = link.status().unwrap();
        assert_eq!((status.state.as_str(), status.ticks), ("running", 7));
        assert_eq!(status.forces[0].name, "A");
        assert_eq!(link.set("A", "1").unwrap_err().message, "no ?write");
        let (ticks, found) = link.get(&["A".into()]).unwrap();
        assert_eq!((ticks, &found.values["A"]), (9, &1.into()));
    }

    #[test]
    fn a_control_that_is_silent_is_left_alone() {
        let (path, requests) = control("silent", &[]);
        let mut link = Link::new(&path);
        link.timeout = Duration::from_millis(20);
        link.pause = Duration::from_secs(3600);
        link.poll();
        assert!(link.status().is_none());
        assert!(link.error().unwrap().ends_with("the control does not answer"));
        // The next request is not even sent.
        assert!(link.timing().is_err());
        drop(link);
        let requests = requests.join().unwrap();
        assert_eq!(requests.lines().count(), 1, "{requests}");
    }
}
