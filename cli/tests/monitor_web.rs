//! `plcc monitor --web` of a control that runs: what browsers do changes nothing of what the control does.
#![cfg(all(target_os = "linux", feature = "web"))]
#![allow(clippy::unwrap_used, clippy::panic, clippy::indexing_slicing)]

use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use tungstenite::client::IntoClientRequest;
use tungstenite::{Message, WebSocket};

/// How many ticks of 20 ms the control runs.
const TICKS: &str = "250";

fn plcc() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_plcc"));
    command.current_dir(Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap());
    command
}

/// The lathe with its stimulus; the trace goes to a file.
fn lathe(trace: &Path) -> Command {
    let mut command = plcc();
    command.args(["run", "examples/pmi/lathe.pmi", "--stimulus", "examples/pmi/lathe.csv"]);
    command.args(["--ticks", TICKS, "--watch", "MCHON,@CL101,@JGINC,BEEPER", "--trace"]).arg(trace);
    command
}

/// A process that is killed with the test.
struct Killed(Child);

impl Drop for Killed {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A folder that goes away with the test.
struct Folder(PathBuf);

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// What a browser gets for the token: the server's host, the cookie, the key.
struct Known {
    host: String,
    cookie: String,
    key: String,
}

impl Known {
    fn enter(url: &str) -> Self {
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
        Self { host: host.into(), cookie: after("set-cookie: "), key: after("location: /#key=") }
    }

    fn connect(&self) -> WebSocket<TcpStream> {
        let stream = TcpStream::connect(&self.host).unwrap();
        let timeout = Some(Duration::from_secs(600));
        stream.set_read_timeout(timeout).unwrap();
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

#[test]
fn browsers_that_flood_hang_and_leave_change_no_tick() {
    let folder = Folder(std::env::temp_dir().join(format!("plcc-web-{}", std::process::id())));
    fs::create_dir_all(&folder.0).unwrap();
    let path = |name: &str| folder.0.join(name);
    assert!(lathe(&path("alone.csv")).status().unwrap().success());

    // No tick is skipped, however busy the computer is.
    let mut command = lathe(&path("watched.csv"));
    command
        .args(["--realtime", "--watchdog", "1h", "--overrun", "catch-up=100000", "--socket"])
        .arg(path("socket"));
    let mut control = Killed(command.stderr(Stdio::null()).spawn().unwrap());
    let start = Instant::now();
    while !path("socket").exists() {
        assert!(start.elapsed() < Duration::from_secs(600), "the control does not start");
        thread::sleep(Duration::from_millis(5));
    }
    let mut command = plcc();
    command.arg("monitor").arg(path("socket")).arg("--web=127.0.0.1:0");
    command.env("XDG_STATE_HOME", &folder.0).stderr(Stdio::piped());
    let mut monitor = Killed(command.spawn().unwrap());
    let mut line = String::new();
    BufReader::new(monitor.0.stderr.take().unwrap()).read_line(&mut line).unwrap();
    let known = Known::enter(line.split_whitespace().find(|word| word.contains("token")).unwrap());

    // One page is shown values, one never reads what it is sent, two flood, one sends what is too long.
    let mut page = known.connect();
    page.send(Message::text(r#"{"id":1,"show":{"screen":"variables"}}"#)).unwrap();
    // A ping may come before the answer.
    while !page.read().unwrap().to_text().unwrap().contains("\"id\":1") {}
    let mut hanging = known.connect();
    hanging.send(Message::text(r#"{"id":1,"show":{"screen":"events"}}"#)).unwrap();
    let floods: Vec<_> = [
        r#"{"id":1,"ask":{"screen":"io"}}"#,
        r#"{"id":1,"apply":{"command":"watch","names":["@FRO"]}}"#,
    ]
    .into_iter()
    .map(|message| {
        let mut flood = known.connect();
        thread::spawn(move || {
            // Sending ends when the server reads no more, since nothing is received here.
            for _ in 0..20_000 {
                if flood.send(Message::text(message)).is_err() {
                    break;
                }
            }
        })
    })
    .collect();
    let mut long = known.connect();
    let _ = long.send(Message::text("x".repeat(1 << 20)));
    drop(long);

    assert!(control.0.wait().unwrap().success());
    for flood in floods {
        flood.join().unwrap();
    }
    let alone = fs::read_to_string(path("alone.csv")).unwrap();
    assert!(alone.lines().count() > 5);
    assert_eq!(fs::read_to_string(path("watched.csv")).unwrap(), alone);
    // The monitor goes on without the control.
    page.send(Message::text(r#"{"id":2,"show":{"screen":"status"}}"#)).unwrap();
    while !page.read().unwrap().to_text().unwrap().contains("\"id\":2") {}
}
