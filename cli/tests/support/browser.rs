//! A browser of the monitor's page: it enters by the printed address and speaks by a WebSocket.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Command, Stdio};
use std::thread;
use std::time::Duration;

use serde_json::{Value as Json, json};
use tungstenite::client::IntoClientRequest;
use tungstenite::{Message, WebSocket};

use super::process::{Killed, PATIENCE, wait};

/// A monitor that serves browsers, and what a browser has got for the token of its address.
pub(crate) struct Site {
    _monitor: Killed,
    host: String,
    cookie: String,
    key: String,
}

impl Site {
    /// Starts `command`, a `plcc monitor … --web=127.0.0.1:0`, and enters by the address that it prints.
    pub(crate) fn open(command: &mut Command) -> Self {
        let mut monitor = Killed::spawn(command.stderr(Stdio::piped()));
        let mut lines = BufReader::new(monitor.0.stderr.take().unwrap()).lines();
        let line = lines.find_map(|line| line.ok().filter(|line| line.contains("token"))).unwrap();
        let url = line.split_whitespace().find(|word| word.contains("token")).unwrap();
        let (host, query) = url.strip_prefix("http://").unwrap().split_once('/').unwrap();
        let mut stream = TcpStream::connect(host).unwrap();
        let request = format!("GET /{query} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n");
        stream.write_all(request.as_bytes()).unwrap();
        let mut response = String::new();
        stream.read_to_string(&mut response).unwrap();
        let after = |text: &str| {
            let rest = response.split_once(text).unwrap_or_else(|| panic!("{response}")).1;
            rest.split([';', '\r']).next().unwrap().to_owned()
        };
        let (cookie, key) = (after("set-cookie: "), after("location: /#key="));
        // Whoever reads what the monitor says must go on, or the monitor would have to wait.
        thread::spawn(move || lines.for_each(drop));
        Self { _monitor: monitor, host: host.to_owned(), cookie, key }
    }

    /// A further WebSocket of this browser.
    pub(crate) fn connect(&self) -> WebSocket<TcpStream> {
        let stream = TcpStream::connect(&self.host).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        stream.set_write_timeout(Some(Duration::from_secs(1))).unwrap();
        let mut request = format!("ws://{}/socket", self.host).into_client_request().unwrap();
        let headers = request.headers_mut();
        headers.insert("origin", format!("http://{}", self.host).parse().unwrap());
        headers.insert("cookie", self.cookie.parse().unwrap());
        let protocols = format!("plcc-monitor, {}", self.key);
        headers.insert("sec-websocket-protocol", protocols.parse().unwrap());
        tungstenite::client(request, stream).unwrap().0
    }
}

/// A page, with a monitor of its own.
pub(crate) struct Page {
    _site: Site,
    socket: WebSocket<TcpStream>,
    id: u64,
}

impl Page {
    /// Opens the page of a monitor, as [`Site::open`].
    pub(crate) fn open(command: &mut Command) -> Self {
        let site = Site::open(command);
        let socket = site.connect();
        Self { _site: site, socket, id: 0 }
    }

    /// Sends a message with a number of its own, and gives the answer to it.
    pub(crate) fn send(&mut self, mut message: Json) -> Json {
        self.id += 1;
        message["id"] = self.id.into();
        self.socket.send(Message::text(message.to_string())).unwrap();
        loop {
            let Message::Text(text) = self.socket.read().unwrap() else { continue };
            let answer: Json = serde_json::from_str(&text).unwrap();
            if answer["id"] == self.id {
                return answer;
            }
        }
    }

    /// The row of an input or output, once it is as `is` says.
    pub(crate) fn row(&mut self, name: &str, is: impl Fn(&Json) -> bool) -> Json {
        wait(name, || {
            let answer = self.send(json!({"ask": {"screen": "io"}}));
            // As long as the connection comes up there is a reason instead of windows.
            let windows = answer["view"]["body"]["windows"].as_array().cloned().unwrap_or_default();
            let rows = windows.iter().filter_map(|window| window["rows"].as_array()).flatten();
            rows.filter(|row| row["name"] == name).find(|row| is(row)).cloned()
        })
    }
}
