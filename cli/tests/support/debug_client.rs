//! A client of the Debug Adapter Protocol, as an editor is one, over the standard input and output of `plcc debug`.

use std::io::{BufRead, BufReader, Read, Write};
use std::path::Path;
use std::process::{ChildStdin, ChildStdout, Command, Stdio};

use serde_json::{Value, json};

use super::process::Killed;

/// An editor.
pub(crate) struct Client {
    process: Killed,
    to: Option<ChildStdin>,
    from: BufReader<ChildStdout>,
    seq: i64,
    /// Events that came while an answer was waited for.
    pub(crate) events: Vec<Value>,
}

impl Client {
    pub(crate) fn new() -> Self {
        Self::of(&mut Command::new(env!("CARGO_BIN_EXE_plcc")))
    }

    /// As [`new`](Self::new), with relative paths that belong to a folder.
    pub(crate) fn in_folder(folder: &Path) -> Self {
        Self::of(Command::new(env!("CARGO_BIN_EXE_plcc")).current_dir(folder))
    }

    fn of(plcc: &mut Command) -> Self {
        let mut process =
            Killed::spawn(plcc.arg("debug").stdin(Stdio::piped()).stdout(Stdio::piped()));
        let to = process.0.stdin.take();
        let from = BufReader::new(process.0.stdout.take().unwrap());
        let mut client = Self { process, to, from, seq: 0, events: vec![] };
        let capabilities = client.ask("initialize", json!({"adapterID": "plcc"}));
        assert_eq!(capabilities["supportsStepBack"], true);
        client
    }

    /// Launches a program and sets breakpoints in its first file; then the program runs.
    pub(crate) fn launch(arguments: Value, breakpoints: Value) -> Self {
        let mut client = Self::new();
        client.ask("launch", arguments.clone());
        client.event("initialized");
        let set = client.ask(
            "setBreakpoints",
            json!({"source": {"path": arguments["program"]}, "breakpoints": breakpoints}),
        );
        let set = set["breakpoints"].as_array().unwrap();
        assert!(set.iter().all(|set| set["verified"] == true), "{set:?}");
        client.ask("configurationDone", json!({}));
        client
    }

    pub(crate) fn message(&mut self) -> Option<Value> {
        let mut length = 0;
        loop {
            let mut line = String::new();
            if self.from.read_line(&mut line).unwrap() == 0 {
                return None;
            }
            match line.trim().split_once(": ") {
                Some((_, number)) => length = number.parse().unwrap(),
                None => break,
            }
        }
        let mut text = vec![0; length];
        self.from.read_exact(&mut text).unwrap();
        Some(serde_json::from_slice(&text).unwrap())
    }

    pub(crate) fn send(&mut self, bytes: &[u8]) {
        let to = self.to.as_mut().unwrap();
        write!(to, "Content-Length: {}\r\n\r\n", bytes.len()).unwrap();
        to.write_all(bytes).unwrap();
        to.flush().unwrap();
    }

    /// Sends a request and gives its answer.
    pub(crate) fn answer(&mut self, command: &str, arguments: Value) -> Value {
        self.seq += 1;
        let request = json!({
            "seq": self.seq, "type": "request", "command": command, "arguments": arguments,
        });
        self.send(request.to_string().as_bytes());
        loop {
            let message = self.message().expect("an answer");
            if message["type"] == "response" && message["request_seq"] == self.seq {
                return message;
            }
            self.events.push(message);
        }
    }

    /// Sends a request that is done, and gives the body of its answer.
    pub(crate) fn ask(&mut self, command: &str, arguments: Value) -> Value {
        let answer = self.answer(command, arguments);
        assert_eq!(answer["success"], true, "{command}: {answer}");
        answer["body"].clone()
    }

    /// Sends a request that is refused, and gives the reason.
    pub(crate) fn refused(&mut self, command: &str, arguments: Value) -> String {
        let answer = self.answer(command, arguments);
        assert_eq!(answer["success"], false, "{command}: {answer}");
        answer["message"].as_str().unwrap().to_owned()
    }

    /// The next event of a kind.
    pub(crate) fn event(&mut self, kind: &str) -> Value {
        loop {
            if let Some(at) = self.events.iter().position(|event| event["event"] == kind) {
                return self.events.remove(at)["body"].clone();
            }
            let message = self.message().expect("an event");
            self.events.push(message);
        }
    }

    /// Does a movement, and gives why and where the program stands then: reason, tick, line.
    pub(crate) fn go(&mut self, command: &str, arguments: Value) -> (String, u64, u64) {
        self.ask(command, arguments);
        self.stopped()
    }

    pub(crate) fn stopped(&mut self) -> (String, u64, u64) {
        let event = self.event("stopped");
        let frames = self.ask("stackTrace", json!({"threadId": event["threadId"]}));
        let line = frames["stackFrames"][0]["line"].as_u64().unwrap();
        let tick = self.ask("plcc/position", json!({}))["tick"].as_u64().unwrap();
        (event["reason"].as_str().unwrap().to_owned(), tick, line)
    }

    pub(crate) fn value(&mut self, expression: &str) -> String {
        let body = self.ask("evaluate", json!({"expression": expression, "context": "watch"}));
        body["result"].as_str().unwrap().to_owned()
    }

    /// What the statement reads and writes, `NAME=VALUE` each.
    pub(crate) fn accesses(&mut self) -> Vec<String> {
        self.scope("This statement")
    }

    pub(crate) fn scope(&mut self, name: &str) -> Vec<String> {
        let scopes = self.ask("scopes", json!({"frameId": 1}));
        let scopes = scopes["scopes"].as_array().unwrap();
        let scope = scopes.iter().find(|scope| scope["name"] == name);
        let scope = scope.unwrap_or_else(|| panic!("{scopes:?} have no {name}"));
        self.unfold(&scope["variablesReference"])
    }

    /// Types a line into the debug console, and gives the whole answer.
    pub(crate) fn console(&mut self, line: &str) -> Value {
        self.answer("evaluate", json!({"expression": line, "context": "repl"}))
    }

    /// Moves by a line in the debug console.
    pub(crate) fn console_go(&mut self, line: &str) {
        let answer = self.console(line);
        assert_eq!(answer["success"], true, "{answer}");
        self.event("stopped");
    }

    pub(crate) fn unfold(&mut self, reference: &Value) -> Vec<String> {
        let body = self.ask("variables", json!({"variablesReference": reference}));
        let variables = body["variables"].as_array().unwrap();
        let show = |variable: &Value| {
            let text = |field: &str| variable[field].as_str().unwrap().to_owned();
            format!("{}={}", text("name"), text("value"))
        };
        variables.iter().map(show).collect()
    }

    /// Goes away without a word; the adapter has to end by itself.
    pub(crate) fn vanish(mut self) {
        drop(self.to.take());
        assert!(self.process.0.wait().unwrap().success());
    }

    /// Says good-bye.
    pub(crate) fn leave(mut self) {
        self.ask("disconnect", json!({}));
        self.event("terminated");
        self.vanish();
    }
}
