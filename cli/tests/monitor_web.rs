//! `plcc monitor --web` of a control that runs: what browsers do changes nothing of what the control does.
#![cfg(all(target_os = "linux", feature = "web"))]
#![allow(clippy::unwrap_used, clippy::panic, clippy::indexing_slicing)]

mod support;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread;

use support::browser::Site;
use support::process::{Killed, wait};
use tungstenite::Message;

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

/// A folder that goes away with the test.
struct Folder(PathBuf);

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
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
    let mut control = Killed::spawn(command.stderr(Stdio::null()));
    wait("the control's socket", || path("socket").exists().then_some(()));
    let mut command = plcc();
    command.arg("monitor").arg(path("socket")).arg("--web=127.0.0.1:0");
    let known = Site::open(command.env("XDG_STATE_HOME", &folder.0));

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
