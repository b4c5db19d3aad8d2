//! A real server on a loopback port, with a session of a small program, and clients that speak with it.

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, mpsc};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use plcc_abi::Dialect;
use serde_json::{Value as Json, json};
use tungstenite::client::IntoClientRequest;
use tungstenite::{Message, WebSocket};

use super::{Server, limits};
use crate::testing;

const PROGRAM: &str = "\
$INPUT
A = 1/0
$OUTPUT
B = 2/0
$END
B = A
";

/// A server with its session, which end with the test.
struct Served {
    address: SocketAddr,
    urls: Arc<Mutex<Vec<String>>>,
    ends: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Served {
    fn start() -> Self {
        let urls = Arc::new(Mutex::new(vec![]));
        let ends = Arc::new(AtomicBool::new(false));
        let (sender, started) = mpsc::channel();
        let (announced, until) = (Arc::clone(&urls), Arc::clone(&ends));
        let thread = thread::spawn(move || {
            let announce = move |url: &str| announced.lock().unwrap().push(url.to_owned());
            let server = Server::start("127.0.0.1:0".parse().unwrap(), announce).unwrap();
            sender.send((server.address(), server.first_url().to_owned())).unwrap();
            let mut session = testing::open(Dialect::Pmi, PROGRAM, "3,A,1\n");
            server.run(&mut session, || !until.load(Ordering::Relaxed));
        });
        let (address, url) = started.recv().unwrap();
        urls.lock().unwrap().push(url);
        Self { address, urls, ends, thread: Some(thread) }
    }

    /// The token that was announced last.
    fn token(&self) -> String {
        let urls = self.urls.lock().unwrap();
        urls.last().unwrap().split_once("?token=").unwrap().1.to_owned()
    }

    fn host(&self) -> String {
        self.address.to_string()
    }

    /// Sends a request and gives the whole response as text.
    fn get(&self, path: &str, headers: &[(&str, &str)]) -> String {
        let mut stream = TcpStream::connect(self.address).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
        let mut request = format!("GET {path} HTTP/1.1\r\nConnection: close\r\n");
        if !headers.iter().any(|(name, _)| *name == "Host") {
            request.push_str(&format!("Host: {}\r\n", self.host()));
        }
        for (name, value) in headers {
            request.push_str(&format!("{name}: {value}\r\n"));
        }
        request.push_str("\r\n");
        stream.write_all(request.as_bytes()).unwrap();
        let mut response = vec![];
        stream.read_to_end(&mut response).unwrap();
        String::from_utf8_lossy(&response).into_owned()
    }

    /// Gives the token and gets the cookie and the key.
    fn enter(&self) -> Known {
        let response = self.get(&format!("/?token={}", self.token()), &[]);
        assert!(response.starts_with("HTTP/1.1 303 "), "{response}");
        let after = |text: &str, end: &[char]| {
            let rest = response.split_once(text).unwrap_or_else(|| panic!("{response}")).1;
            rest.split(end).next().unwrap().to_owned()
        };
        Known {
            cookie: after("set-cookie: ", &[';', '\r']),
            key: after("location: /#key=", &['\r']),
        }
    }

    fn upgrade(&self, known: &Known, changes: &[(&str, Option<&str>)]) -> Result<Client, u16> {
        let stream = TcpStream::connect(self.address).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
        let mut request = format!("ws://{}/socket", self.host()).into_client_request().unwrap();
        let own = [
            ("origin", format!("http://{}", self.host())),
            ("cookie", known.cookie.clone()),
            ("sec-websocket-protocol", format!("plcc-monitor, {}", known.key)),
        ];
        for (name, value) in own {
            request.headers_mut().insert(name, value.parse().unwrap());
        }
        for (name, value) in changes {
            let name: tungstenite::http::HeaderName = name.parse().unwrap();
            match value {
                Some(value) => drop(request.headers_mut().insert(name, value.parse().unwrap())),
                None => drop(request.headers_mut().remove(name)),
            }
        }
        match tungstenite::client(request, stream) {
            Ok((socket, response)) => {
                assert_eq!(response.headers()["sec-websocket-protocol"], "plcc-monitor");
                Ok(Client { socket, id: 0, view: Json::Null })
            }
            Err(tungstenite::HandshakeError::Failure(tungstenite::Error::Http(response))) => {
                Err(response.status().as_u16())
            }
            Err(error) => panic!("{error}"),
        }
    }

    fn connect(&self, known: &Known) -> Client {
        self.upgrade(known, &[]).unwrap_or_else(|status| panic!("{status}"))
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        self.ends.store(true, Ordering::Relaxed);
        let ended = self.thread.take().unwrap().join();
        if !thread::panicking() {
            ended.unwrap();
        }
    }
}

/// What a browser keeps.
struct Known {
    cookie: String,
    key: String,
}

struct Client {
    socket: WebSocket<TcpStream>,
    id: u64,
    /// The view that was shown last.
    view: Json,
}

impl Client {
    fn send(&mut self, mut message: Json) -> u64 {
        self.id += 1;
        message["id"] = self.id.into();
        self.socket.send(Message::text(message.to_string())).unwrap();
        self.id
    }

    fn receive(&mut self) -> Json {
        loop {
            if let Message::Text(text) = self.socket.read().unwrap() {
                return serde_json::from_str(&text).unwrap();
            }
        }
    }

    /// Sends a request and gives its answer; views that come before are kept.
    fn ask(&mut self, message: Json) -> Json {
        let id = self.send(message);
        loop {
            let answer = self.receive();
            if answer["id"] == 0 {
                self.view = answer["view"].clone();
            } else {
                assert_eq!(answer["id"], id);
                return answer;
            }
        }
    }

    /// Waits for a view that satisfies a condition.
    fn wait_for(&mut self, condition: impl Fn(&Json) -> bool) -> Json {
        while !condition(&self.view) {
            let message = self.receive();
            assert_eq!(message["id"], 0);
            self.view = message["view"].clone();
        }
        self.view.clone()
    }
}

fn statements() -> Json {
    json!({"show": {"screen": "statements", "first": 0, "count": 50}})
}

#[test]
fn a_token_opens_one_browser() {
    let served = Served::start();
    assert!(served.get("/", &[]).starts_with("HTTP/1.1 403 "));
    assert!(served.get("/main.js", &[]).starts_with("HTTP/1.1 403 "));
    let first = served.token();
    let known = served.enter();
    let again = served.get(&format!("/?token={first}"), &[]);
    assert!(again.starts_with("HTTP/1.1 403 ") && !again.contains("set-cookie"), "{again}");
    // A browser that is known comes to the page by the old address, too.
    let again = served.get(&format!("/?token={first}"), &[("Cookie", &known.cookie)]);
    assert!(again.contains("location: /\r\n"), "{again}");
    assert_ne!(served.token(), first);
    served.enter();
}

#[test]
fn files_say_what_the_page_may_do() {
    let served = Served::start();
    let known = served.enter();
    for (path, content_type) in
        [("/", "text/html"), ("/main.js", "text/javascript"), ("/style.css", "text/css")]
    {
        let response = served.get(path, &[("Cookie", &known.cookie)]);
        assert!(response.starts_with("HTTP/1.1 200 "), "{response}");
        assert!(response.contains(&format!("content-type: {content_type}")), "{response}");
        assert!(
            response.contains("content-security-policy: default-src 'none'; script-src 'self'; ")
        );
        assert!(response.contains("x-content-type-options: nosniff"));
    }
    let missing = served.get("/../Cargo.toml", &[("Cookie", &known.cookie)]);
    assert!(missing.starts_with("HTTP/1.1 404 "), "{missing}");
}

#[test]
fn other_hosts_and_origins_are_refused() {
    let served = Served::start();
    let known = served.enter();
    let cookie = ("Cookie", known.cookie.as_str());
    let status = |headers: &[(&str, &str)]| served.get("/", headers)[9..12].to_owned();
    assert_eq!(status(&[cookie]), "200");
    assert_eq!(status(&[cookie, ("Host", "evil.example")]), "403");
    assert_eq!(status(&[cookie, ("Origin", "http://evil.example")]), "403");
    assert_eq!(status(&[cookie, ("Sec-Fetch-Site", "cross-site")]), "403");

    let refused = |changes: &[(&str, Option<&str>)]| served.upgrade(&known, changes).err();
    assert_eq!(refused(&[]), None);
    assert_eq!(refused(&[("origin", Some("http://evil.example"))]), Some(403));
    assert_eq!(refused(&[("origin", None)]), Some(403));
    assert_eq!(refused(&[("host", Some("evil.example"))]), Some(403));
    assert_eq!(refused(&[("cookie", None)]), Some(403));
    assert_eq!(refused(&[("sec-websocket-protocol", Some("plcc-monitor"))]), Some(403));
    // The page of another port of this machine: a browser sends it the cookie.
    assert_eq!(refused(&[("origin", Some("http://127.0.0.1:1"))]), Some(403));
}

#[test]
fn a_page_is_shown_what_changes() {
    let served = Served::start();
    let known = served.enter();
    let mut client = served.connect(&known);
    assert!(client.ask(statements())["reply"].is_object());
    let view = client.wait_for(|view| view["body"]["screen"] == "statements");
    assert_eq!(view["status"]["dialect"], "pmi");
    assert!(
        client.ask(json!({"apply": {"command": "go_to_tick", "tick": 3}}))["reply"].is_object()
    );
    let view = client.wait_for(|view| view["status"]["tick"] == 3);
    let lines = view["body"]["lines"].as_array().unwrap().clone();
    let token = lines.iter().flat_map(|line| line["tokens"].as_array().unwrap());
    let mut inputs = token.filter(|token| token["name"] == "A");
    assert!(inputs.any(|token| token["truth"] == true), "{lines:?}");
    let refusal = client.ask(
        json!({"apply": {"command": "find_names", "names": ["NONE"], "uses": true, "all": true}}),
    );
    assert!(refusal["refusal"]["message"].is_string(), "{refusal}");
    let asked = client.ask(json!({"apply": {"command": "why", "name": "A"}}));
    assert!(asked["reply"].is_object(), "{asked}");
    let why = client.ask(json!({"ask": {"screen": "why"}}));
    let first = &why["view"]["body"]["lines"][0]["pieces"];
    assert_eq!((&first[0]["text"], &first[0]["kind"]), (&json!("A"), &json!("name")), "{why}");
    assert_eq!(why["view"]["body"]["tick"], 3);
    let directory = client.ask(json!({"ask": {"screen": "directory"}}));
    assert_eq!(directory["view"]["body"]["screen"], "directory");
    let refusal = client.ask(json!({"ask": {"screen": "nothing"}}));
    let reason = refusal["refusal"]["message"].as_str().unwrap();
    assert!(reason.contains("unknown variant"), "{reason}");
}

#[test]
fn a_page_that_comes_back_sees_the_same() {
    let served = Served::start();
    let known = served.enter();
    let mut client = served.connect(&known);
    client.ask(statements());
    client.ask(json!({"apply": {"command": "go_to_tick", "tick": 5}}));
    drop(client);
    let mut again = served.connect(&known);
    again.ask(statements());
    let view = again.wait_for(|view| view["body"]["screen"] == "statements");
    assert_eq!(view["status"]["tick"], 5);
    assert_eq!(view["status"]["following"], false);
}

#[test]
fn another_browser_begins_in_the_present_and_has_a_tick_of_its_own() {
    let served = Served::start();
    let mut first = served.connect(&served.enter());
    first.ask(statements());
    first.ask(json!({"apply": {"command": "go_to_tick", "tick": 2}}));
    let mut second = served.connect(&served.enter());
    second.ask(statements());
    let view = second.wait_for(|view| view["body"]["screen"] == "statements");
    assert_eq!(view["status"]["following"], true);
    // The program goes on, since the second browser follows it; the first one stays where it is.
    let tick = view["status"]["tick"].as_u64().unwrap();
    second.wait_for(|view| view["status"]["tick"].as_u64() > Some(tick.max(2)));
    let view = first.wait_for(|view| view["status"]["last_tick"].as_u64() > Some(tick.max(2)));
    assert_eq!((&view["status"]["tick"], &view["status"]["past"]), (&json!(2), &json!(true)));
    let asked = first.ask(json!({"ask": {"screen": "status"}}));
    assert_eq!(asked["view"]["status"]["tick"], 2);
    second.ask(json!({"apply": {"command": "go_to_tick", "tick": 1}}));
    let asked = first.ask(json!({"ask": {"screen": "status"}}));
    assert_eq!(asked["view"]["status"]["tick"], 2);
}

#[test]
fn long_and_strange_messages_end_a_page_and_no_other() {
    let served = Served::start();
    let known = served.enter();
    let mut other = served.connect(&known);
    let long = Message::text("x".repeat(limits::LONGEST_MESSAGE + 1));
    for message in [long, Message::binary(vec![0; 10])] {
        let mut client = served.connect(&known);
        // The connection may end while the message is sent.
        let _ = client.socket.send(message);
        loop {
            match client.socket.read() {
                Ok(Message::Close(_)) | Err(_) => break,
                Ok(_) => {}
            }
        }
    }
    let mut client = served.connect(&known);
    assert!(client.ask(json!({"nothing": 1})).is_object());
    assert!(other.ask(statements())["reply"].is_object());
}

#[test]
fn a_page_that_floods_waits_for_itself() {
    let served = Served::start();
    let known = served.enter();
    let mut flood = served.connect(&known);
    let mut other = served.connect(&known);
    const COUNT: u64 = 2000;
    for _ in 0..COUNT {
        flood.send(json!({"apply": {"command": "move_cursor", "by": 1}}));
    }
    // Nothing of it was received; another page gets its answers between them.
    for _ in 0..20 {
        assert!(other.ask(statements())["reply"].is_object());
    }
    // Each message has one answer, in order.
    for id in 1..=COUNT {
        assert_eq!(flood.receive()["id"], id);
    }
}

#[test]
fn pages_are_limited() {
    let served = Served::start();
    let known = served.enter();
    let clients: Vec<Client> = (0..limits::MAX_CLIENTS).map(|_| served.connect(&known)).collect();
    assert_eq!(served.upgrade(&known, &[]).err(), Some(503));
    drop(clients);
    // The places are free again as soon as the server has seen the pages leave.
    while served.upgrade(&known, &[]).is_err() {
        thread::sleep(Duration::from_millis(20));
    }
}
