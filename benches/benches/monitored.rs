//! How late the ticks of a control begin while somebody monitors it: 1 ms a tick, in native code, with the priority and
//! the locked memory that `plcrt --realtime` asks for.
//!
//! Each row is a run of its own. The clients are processes of their own, which are this same program:
//!
//! | client | does |
//! | --- | --- |
//! | `alone` | nothing; the row to compare with |
//! | `monitor` | the monitor's model: it polls, and shows variables, inputs and outputs, and timing ten times a second |
//! | `flood` | sends requests for all variables as fast as it can, and reads no reply |
//! | `hang` | connects and sends half a request |
//! | `leave` | connects, asks, and goes away before the reply, again and again |
//!
//! `cargo bench -p plcc-benches --bench monitored -- 30` takes 30 seconds for each row (10 without a number). Lateness depends
//! on what else the computer does, so the table is only worth something on one that does nothing else.
#![allow(clippy::unwrap_used, clippy::print_stdout, clippy::panic)]

use std::io::Write;
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use plcc_benches::lateness::{self, Lateness};
use plcc_monitor::view::{Screen, TargetKind};
use plcc_monitor::{Session, Target};

/// The argument by which the program knows that it is a client; what it does and the socket follow.
const CLIENT: &str = "--client";

const CLIENTS: [&str; 5] = ["alone", "monitor", "flood", "hang", "leave"];

/// A client that is ended with its run.
struct Ended(Child);

impl Drop for Ended {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    if let [mode, client, socket] = words.as_slice()
        && mode == CLIENT
    {
        return be(client, Path::new(socket));
    }
    let seconds = words.iter().filter_map(|word| word.parse::<usize>().ok()).next_back();
    let seconds = seconds.unwrap_or(10);
    println!(
        "{:<10} {:>8} {:>10} {:>10} {:>10}",
        "client", "ticks", "median us", "99.9 % us", "latest us"
    );
    for client in CLIENTS {
        let late = run(client, seconds);
        println!(
            "{client:<10} {:>8} {:>10.1} {:>10.1} {:>10.1}",
            late.ticks(),
            late.at(0.5),
            late.at(0.999),
            late.at(1.0)
        );
    }
}

/// Runs the lathe beside a client.
fn run(client: &str, seconds: usize) -> Lateness {
    let socket = socket_path();
    let _ = std::fs::remove_file(&socket);
    let path = socket.display().to_string();
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.args([CLIENT, client]).arg(&socket).stdout(Stdio::null()).stderr(Stdio::null());
    let _client = Ended(command.spawn().unwrap());
    lateness::of_the_lathe(seconds, &["--socket", &path])
}

fn socket_path() -> PathBuf {
    std::env::temp_dir().join(format!("plcc-monitored-{}", std::process::id()))
}

/// What a client does until it is ended.
fn be(client: &str, socket: &Path) {
    const REQUEST: &[u8] = b"{\"version\":1,\"request\":\"get\",\"names\":[\"*\"]}\n";
    let wait = || std::thread::sleep(Duration::from_millis(10));
    let connect = || loop {
        match UnixStream::connect(socket) {
            Ok(stream) => return stream,
            Err(_) => wait(),
        }
    };
    match client {
        "monitor" => monitor(socket),
        "flood" => {
            // A stream that the control has closed is replaced.
            loop {
                let mut stream = connect();
                while stream.write_all(REQUEST).is_ok() {}
            }
        }
        "hang" => {
            let mut stream = connect();
            let _ = stream.write_all(b"{\"version\":1,");
            loop {
                wait();
            }
        }
        "leave" => loop {
            let _ = connect().write_all(REQUEST);
        },
        _ => loop {
            wait();
        },
    }
}

/// The model of a monitor that shows its screens ten times a second.
fn monitor(socket: &Path) {
    let mut session = Session::open(Target {
        kind: TargetKind::Control,
        name: socket.display().to_string(),
        run: None,
        socket: Some(socket.to_owned()),
        state_folder: None,
        speed: 1.0,
        operator: false,
        rebuilder: None,
    });
    loop {
        session.poll();
        for screen in [Screen::Timing, Screen::Variables, Screen::Io] {
            std::hint::black_box(session.view(&screen));
        }
        std::thread::sleep(Duration::from_millis(100));
    }
}
