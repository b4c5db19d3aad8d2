//! A control that runs: what the user sets while its record is debugged acts on it, as by `plcctl`, and it says what its
//! variables are now.
//!
//! The control serves requests by its socket (docs/socket.md) if it was started with `--allow`, and notes each change in
//! its log and in its record, with the user.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::time::Duration;

use plcc_protocol::{
    Assignment, Client, ClientError, Done, ForcedBy, Request, Status, Values, Variables,
};
use serde::de::DeserializeOwned;
use serde_json::Value as Json;

use crate::DebugError;

/// How long a reply is waited for.
const TIMEOUT: Duration = Duration::from_secs(5);

/// How many variables are asked for at once: as many as the control reads before one tick.
const VALUES_PER_TICK: usize = plcc_protocol::VALUES_PER_TICK;

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

    /// Where the socket is.
    pub fn path(&self) -> &Path {
        &self.path
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
        Ok(self.ask::<Done>(&request)?.ticks)
    }

    /// What the control is doing.
    ///
    /// # Errors
    /// When it does not answer.
    pub fn status(&self) -> Result<Status, DebugError> {
        self.ask(&Request::Status {})
    }

    /// What is known of the variables whose names match a pattern.
    ///
    /// # Errors
    /// When the control does not answer.
    pub fn variables(&self, pattern: &str) -> Result<Variables, DebugError> {
        self.ask(&Request::List { pattern: Some(pattern.into()), after: None })
    }

    /// The values that variables have now, those of an array in their order, with the tick of the last of them. A name that
    /// the control does not know is left out if others are asked for too.
    ///
    /// # Errors
    /// When the control does not answer, or does not know the only name.
    pub fn values(
        &self,
        names: &[String],
    ) -> Result<(u64, BTreeMap<String, Vec<f64>>), DebugError> {
        let mut ticks = 0;
        let mut found = BTreeMap::new();
        let mut add = |values: Values| {
            ticks = values.ticks;
            found.extend(values.values.into_iter().map(|(name, value)| (name, numbers(&value))));
        };
        for part in names.chunks(VALUES_PER_TICK) {
            match self.ask(&Request::Get { names: part.to_vec() }) {
                Ok(values) => add(values),
                Err(error) if names.len() == 1 => return Err(error),
                // One of them is none of the control's variables: the others one by one.
                Err(_) => {
                    for name in part {
                        if let Ok(values) = self.ask(&Request::Get { names: vec![name.clone()] }) {
                            add(values);
                        }
                    }
                }
            }
        }
        Ok((ticks, found))
    }

    /// The names of all its variables.
    ///
    /// # Errors
    /// When the control does not answer.
    pub fn names(&self) -> Result<BTreeSet<String>, DebugError> {
        let mut names = BTreeSet::new();
        let mut after = None;
        loop {
            let part: Variables = self.ask(&Request::List { pattern: None, after })?;
            after = part.variables.last().map(|variable| variable.name.clone());
            names.extend(part.variables.into_iter().map(|variable| variable.name));
            if !part.more || after.is_none() {
                return Ok(names);
            }
        }
    }

    fn ask<T: DeserializeOwned>(&self, request: &Request) -> Result<T, DebugError> {
        let mut client = Client::connect(&self.path, TIMEOUT).map_err(failed)?;
        client.ask(request).map_err(failed)
    }
}

/// Who forces a variable and since which tick, by what the control says in its status.
pub fn forced_by(status: &Status, name: &str) -> Option<(String, u64)> {
    let ForcedBy { by, ticks, .. } = status.forced_by.iter().find(|one| one.name == name)?;
    Some((by.clone(), *ticks))
}

/// Why lines do not have what the program gives a variable: a force on it, or the program is stopped. `None` where neither is so.
pub fn not_as_given(status: &Status, name: &str) -> Option<String> {
    if let Some(force) = status.forces.iter().find(|force| force.name == name) {
        let by = forced_by(status, name).map_or_else(String::new, |(who, _)| format!(" by {who}"));
        let value = &force.value;
        return Some(format!(
            "{name} is forced to {value}{by}: its lines have that value, whatever the program gives"
        ));
    }
    let what =
        "the program is stopped: outputs have their safe values, whatever it gave them before";
    (status.state == "stopped").then(|| what.into())
}

/// The numbers of a value as the control sends it.
fn numbers(value: &Json) -> Vec<f64> {
    match value {
        Json::Array(items) => items.iter().filter_map(Json::as_f64).collect(),
        other => other.as_f64().into_iter().collect(),
    }
}

fn failed(error: ClientError) -> DebugError {
    match error {
        ClientError::Refused(_) => DebugError(error.to_string()),
        ClientError::Unreachable(_) => DebugError(format!("the control does not answer: {error}")),
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
    fn lines_do_not_have_what_the_program_gives_under_a_force_and_after_a_stop() {
        let mut status = Status { state: "running".into(), ..Status::default() };
        assert_eq!(not_as_given(&status, "LAMP"), None);
        status.state = "stopped".into();
        assert!(not_as_given(&status, "LAMP").unwrap().starts_with("the program is stopped"));
        let force = r#"{"forces":[{"name":"LAMP","value":"1"}],"forced_by":[{"name":"LAMP","by":"ann","ticks":7}]}"#;
        let status: Status = serde_json::from_str(force).unwrap();
        let said = not_as_given(&status, "LAMP").unwrap();
        assert!(said.starts_with("LAMP is forced to 1 by ann: "), "{said}");
        assert_eq!(not_as_given(&status, "PUMP"), None);
    }

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
