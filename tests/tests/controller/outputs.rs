//! Outputs that take nothing, or fail: in real time they neither delay nor end a run, nor change how it
//! ends.

use std::fs::{self, File};
use std::io::{Read, Write, pipe};
use std::os::fd::OwnedFd;
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::{Command, Stdio};

use plcc_abi::Dialect;
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};

use crate::shop::{Shop, loader, wait};

/// An array that changes in every scan, so that each row of the trace is long, and a fault that comes and
/// goes, so that there are events in every tick.
const PMI: &str = "\
$INTEGER
N, LIST[200]
$FAULT
BUSY = \"A FAULT THAT COMES AND GOES IN EVERY OTHER SCAN\", N
$END
N = N + 1
LIST[N - N / 200 * 200] = N
BUSY = (N - N / 2 * 2) = 1
";

fn shop(name: &str) -> Shop {
    Shop::new(name, Dialect::Pmi, PMI)
}

/// The options of a run. Its ticks are all executed, however busy the computer is.
const TICKS: &str = "--realtime --watchdog 1h --overrun catch-up=100000 --period 1 --ticks 800";

/// All ticks were run, and the dump says so.
fn assert_all_ticks(shop: &Shop) {
    let dump = shop.read("d.json");
    assert!(dump.contains("\"ticks\":800,\"state\":\"running\""), "{dump}");
}

fn file(pipe: impl Into<OwnedFd>) -> Stdio {
    Stdio::from(pipe.into())
}

/// Runs `plcrt` with these arguments to its end: its exit status, and what it has written to standard error.
fn run(shop: &Shop, args: &str) -> (Option<i32>, String) {
    let (mut errors, to) = pipe().unwrap();
    let mut command = shop.command(args);
    let mut child = command.stderr(file(to)).spawn().unwrap();
    // The command holds an end of the pipe, which would never be closed.
    drop(command);
    let mut message = String::new();
    errors.read_to_string(&mut message).unwrap();
    (wait(&mut child).code(), message)
}

#[test]
fn a_pipe_that_nobody_reads_delays_nothing() {
    let shop = shop("unread");
    for output in ["--trace - --watch N,LIST", "--events -"] {
        let (unread, to) = pipe().unwrap();
        let args = format!("{TICKS} {output} --dump d.json --log log.jsonl");
        let mut child = shop.command(&args).stdout(file(to)).spawn().unwrap();
        let status = wait(&mut child);
        let log = shop.read("log.jsonl");
        assert_eq!(status.code(), Some(0), "{log}");
        assert_all_ticks(&shop);
        assert!(log.contains("\"kind\":\"output_stuck\""), "{log}");
        drop(unread);
        fs::remove_file(shop.path("log.jsonl")).unwrap();
    }
}

#[test]
fn a_fifo_that_nobody_reads_is_not_waited_for() {
    let shop = shop("fifo");
    for output in ["trace", "events", "log"] {
        let fifo = shop.path("fifo");
        assert!(Command::new("mkfifo").arg(&fifo).status().unwrap().success());
        let args = format!("{TICKS} --watch N,LIST --{output} fifo --dump d.json");
        let mut child = shop.command(&args).spawn().unwrap();
        assert_eq!(wait(&mut child).code(), Some(0), "{output}");
        assert_all_ticks(&shop);
        fs::remove_file(fifo).unwrap();
    }
}

#[test]
fn standard_error_that_nobody_reads_delays_nothing() {
    let shop = shop("stderr");
    let (_unread, mut to) = pipe().unwrap();
    // As much as a pipe holds, unless the system says otherwise.
    to.write_all(&[b'x'; 1 << 16]).unwrap();
    let args = format!("{TICKS} --trace /dev/full --watch N --dump d.json --log log.jsonl");
    let mut child = shop.command(&args).stderr(file(to)).spawn().unwrap();
    assert_eq!(wait(&mut child).code(), Some(0));
    assert_all_ticks(&shop);
    assert!(shop.read("log.jsonl").contains("\"kind\":\"output_failed\",\"output\":\"trace\""));
}

#[test]
fn a_full_disk_is_told_and_changes_nothing() {
    if !Path::new("/dev/full").exists() {
        return;
    }
    let shop = shop("full");
    for output in ["trace", "events", "log"] {
        let args = format!("{TICKS} --watch N,LIST --{output} /dev/full --dump d.json");
        let (status, message) = run(&shop, &args);
        assert_eq!(status, Some(0), "{message}");
        assert_all_ticks(&shop);
        let expected =
            format!("the {output} can't be written, the attempt is repeated: the disk is full");
        assert!(message.contains(&expected), "{output}: {message}");
    }
    let mut child = shop.command(&format!("{TICKS} --dump /dev/full")).spawn().unwrap();
    assert_eq!(wait(&mut child).code(), Some(0), "the dump changes the exit status as little");
}

/// A write beyond the limit of a file's size raises a signal, SIGXFSZ, whose default is to end the process.
#[test]
fn the_limit_of_a_file_size_does_not_end_the_process() {
    let shop = shop("limit");
    for (pace, status) in [(TICKS, 0), ("--ticks 800", 2)] {
        let run = format!(
            "ulimit -f 8; exec {} p.plcx {pace} --trace t.csv --watch N,LIST --dump d.json",
            loader().display()
        );
        let mut command = Command::new("sh");
        command.args(["-c", &run]).current_dir(shop.path("")).stderr(Stdio::null());
        assert_eq!(wait(&mut command.spawn().unwrap()).code(), Some(status), "{pace}");
        if status == 0 {
            assert_all_ticks(&shop);
        }
    }
}

#[test]
fn a_reader_that_leaves_ends_no_run() {
    let shop = shop("leaves");
    let (reader, to) = pipe().unwrap();
    let args = format!("{TICKS} --trace - --watch N,LIST --dump d.json --log log.jsonl");
    let mut child = shop.command(&args).stdout(file(to)).spawn().unwrap();
    let mut reader = reader;
    reader.read_exact(&mut [0; 10]).unwrap();
    drop(reader);
    assert_eq!(wait(&mut child).code(), Some(0));
    assert_all_ticks(&shop);
    let log = shop.read("log.jsonl");
    assert!(log.contains("\"kind\":\"output_closed\",\"output\":\"trace\""), "{log}");
}

/// None of the files exists before the run.
#[test]
fn outputs_that_links_make_one_file_are_refused() {
    let shop = shop("links");
    symlink(".", shop.path("folder")).unwrap();
    symlink("new", shop.path("other")).unwrap();
    for (events, dump) in [("new", "folder/new"), ("new", "other"), ("folder/other", "new")] {
        let args = format!("--ticks 1 --events {events} --dump {dump}");
        let (status, message) = run(&shop, &args);
        assert_eq!(status, Some(2), "{args}: {message}");
        assert!(message.contains("--dump would overwrite --events"), "{args}: {message}");
        assert!(!shop.path("new").exists(), "{args}");
    }
}

/// What the run writes besides under names of its own would overwrite an output too.
#[test]
fn outputs_with_the_names_of_files_that_stand_beside_others_are_refused() {
    let shop = shop("beside");
    for (args, what) in [
        ("--dump d.json --trace d.json.tmp --watch N", "--dump's temporary file"),
        ("--retain kept --events kept.tmp", "--retain's temporary file"),
        ("--record r --dump r.1", "--record's older part"),
        ("--image i --dump i.dead", "--image's copy of a dead control"),
    ] {
        let (status, message) = run(&shop, &format!("--ticks 1 {args}"));
        assert_eq!(status, Some(2), "{args}: {message}");
        assert!(message.contains(&format!("{what} would overwrite")), "{args}: {message}");
    }
}

/// Ctrl-S stops a terminal: whoever writes to it waits until Ctrl-Q.
#[test]
fn a_stopped_terminal_delays_nothing() {
    let shop = shop("terminal");
    let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
    grantpt(&master).unwrap();
    unlockpt(&master).unwrap();
    let path = ptsname(&master, Vec::new()).unwrap();
    let terminal = File::options().read(true).write(true).open(path.to_str().unwrap()).unwrap();
    let mut master = File::from(master);
    master.write_all(b"\x13").unwrap();
    let ticks = TICKS.replace("800", "1600");
    let args = format!("{ticks} --trace - --watch N,LIST --dump d.json --log log.jsonl");
    let mut command = shop.command(&args);
    command.stdout(terminal.try_clone().unwrap()).stderr(terminal);
    let mut child = command.spawn().unwrap();
    let status = wait(&mut child);
    let log = shop.read("log.jsonl");
    assert_eq!(status.code(), Some(0), "{log}");
    assert!(shop.read("d.json").contains("\"ticks\":1600,"));
    assert!(log.contains("\"kind\":\"output_stuck\",\"output\":\"trace\""), "{log}");
}
