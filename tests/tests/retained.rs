//! The retained file of `plcrt` processes: disks that fail, signals, second processes, sudden death.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, clippy::panic)]

use std::fs::{self, File};
use std::io::{BufRead, BufReader, Write};
use std::os::unix::net::UnixStream;
use std::process::{Command, Stdio};
use std::thread;
use std::time::Duration;

use plcc_abi::Dialect;
use plcc_random::Rng;
use plcc_tests::loader::{Folder, Running, wait_until};
use plcc_tests::tools;

/// Counts slices of 20 ms in F500, which survives power-off.
const COUNT: &str = ":001\nLF500 +1 SF500\nJ1\n:000\nJ0\n";

/// A control whose process is the one that the test has started.
const REALTIME: [&str; 7] =
    ["count.plcx", "--realtime", "--watchdog", "1h", "--no-supervisor", "--retain", "kept"];
/// A control in a process of its own, which the process that the test has started supervises.
const SUPERVISED: [&str; 6] = ["count.plcx", "--realtime", "--watchdog", "1h", "--retain", "kept"];

fn folder(name: &str) -> Folder {
    let folder = Folder::new(name);
    folder.artifact("count.plcx", Dialect::Nct, COUNT);
    folder
}

/// What the retained file holds in F500; it must be whole.
fn saved_count(folder: &Folder, file: &str) -> u64 {
    let args = ["count.plcx", "--ticks", "0", "--retain", file, "--watch", "F500", "--dump", "-"];
    let output = folder.run(&args);
    let (text, errors) =
        (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert_eq!(output.status.code(), Some(0), "{errors}");
    let value = text.split("\"F500\":").nth(1).unwrap_or_else(|| panic!("{text}"));
    value.split(|c: char| !c.is_ascii_digit()).next().unwrap().parse().unwrap()
}

#[test]
fn a_folder_that_vanishes_and_comes_back_ends_no_saving() {
    let folder = folder("vanishes");
    fs::create_dir(folder.path("disk")).unwrap();
    let args = ["--retain", "disk/kept", "--log", "log", "--socket", "socket"];
    let args = [&REALTIME[..REALTIME.len() - 2], &args[..]].concat();
    let mut running = folder.start(&args);
    wait_until("the first save", || folder.path("disk/kept.bak").exists());
    fs::rename(folder.path("disk"), folder.path("away")).unwrap();
    running.says("the retained file");
    wait_until("an entry of the log", || folder.read("log").contains("retained_file_failed"));
    assert!(status(&folder).contains("can't be written"), "{}", status(&folder));
    // So many ticks that several attempts have failed.
    let failed = ticks(&folder);
    wait_until("further ticks", || ticks(&folder) >= failed + 150);
    fs::rename(folder.path("away"), folder.path("disk")).unwrap();
    let before = saved_count_without_lock(&folder);
    running.says("is written again");
    let retained = r#""retained":{"error":null,"file":"disk/kept"}"#;
    assert!(status(&folder).contains(retained), "{}", status(&folder));
    // Nothing can be saved at the end.
    running.signal("KILL", 1);
    running.end();
    assert!(saved_count(&folder, "disk/kept") > before);
    assert!(folder.read("log").contains("\"retained_file_recovered\""));
}

/// How many ticks a running process has done.
fn ticks(folder: &Folder) -> u64 {
    let status = status(folder);
    let (_, ticks) = status.split_once("\"ticks\":").unwrap();
    ticks.trim_end_matches(['}', ',', '\n']).split([',', '}']).next().unwrap().parse().unwrap()
}

/// The reply of a running process to the request for its status.
fn status(folder: &Folder) -> String {
    let mut stream = UnixStream::connect(folder.path("socket")).unwrap();
    stream.write_all(b"{\"version\":1,\"request\":\"status\"}\n").unwrap();
    let mut line = String::new();
    BufReader::new(stream).read_line(&mut line).unwrap();
    line
}

/// What a file holds that a running process has locked.
fn saved_count_without_lock(folder: &Folder) -> u64 {
    fs::copy(folder.path("disk/kept"), folder.path("seen")).unwrap();
    saved_count(folder, "seen")
}

/// A limit on the size of files stands for a full disk. Its signal (SIGXFSZ) must not end the process.
#[test]
fn a_limit_on_the_size_of_files_ends_no_saving() {
    let limit = |id: &str, bytes: &str| {
        let words = ["--pid", id, &format!("--fsize={bytes}:")];
        Command::new("prlimit")
            .args(words)
            .stderr(Stdio::null())
            .status()
            .is_ok_and(|s| s.success())
    };
    if !limit(&std::process::id().to_string(), "unlimited") {
        tools::missing("prlimit", "is not installed, or may not set limits here");
        return;
    }
    let folder = folder("limit");
    let mut running = folder.start(&REALTIME);
    wait_until("the first save", || folder.path("kept.bak").exists());
    assert!(limit(&running.id(), "0"));
    running.says("the newest state is kept");
    assert!(limit(&running.id(), "unlimited"));
    running.says("is written again");
    running.signal("TERM", 1);
    assert_eq!(running.end().code(), Some(130));
    assert!(saved_count(&folder, "kept") > 50);
}

/// Whether the process that has locked the retained file handles SIGTERM.
fn handles_signals(folder: &Folder) -> bool {
    let id = fs::read_to_string(folder.path("kept.lock")).unwrap_or_default();
    let status = fs::read_to_string(format!("/proc/{}/status", id.trim())).unwrap_or_default();
    let caught = status.lines().find_map(|line| line.strip_prefix("SigCgt:"));
    let caught = caught.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    // SIGTERM is signal 15.
    caught.is_some_and(|mask| mask >> 14 & 1 != 0)
}

/// Signals, and how often each is sent; first to a control alone and then to a supervisor.
const SIGNALS: [(&str, usize); 10] = [
    ("TERM", 2),
    ("TERM", 2),
    ("INT", 3),
    ("INT", 3),
    ("QUIT", 1),
    ("QUIT", 1),
    ("PWR", 2),
    ("PWR", 2),
    ("HUP", 2),
    ("HUP", 2),
];

#[test]
fn signals_that_come_together_are_one_and_all_is_saved() {
    let folder = folder("signals");
    for (round, (signal, times)) in SIGNALS.into_iter().enumerate() {
        // A test that runs under `nohup` starts all processes so that they survive SIGHUP.
        if signal == "HUP" && hangup_is_ignored() {
            eprintln!("skipped: SIGHUP is ignored here");
            continue;
        }
        let dump = format!("dump{round}");
        let options = if round % 2 == 0 { &REALTIME[..] } else { &SUPERVISED };
        let trace = format!("trace{round}");
        let more = ["--dump", &dump, "--watch", "F500", "--trace", &trace];
        let mut running = folder.start(&[options, &more].concat());
        wait_until("that it handles signals", || handles_signals(&folder));
        // Some ticks, for the count to go on.
        wait_until("some ticks", || {
            fs::read_to_string(folder.path(&trace)).is_ok_and(|text| text.lines().count() > 5)
        });
        let before = if round == 0 { 0 } else { saved_count_of_copy(&folder) };
        running.signal(signal, times);
        assert_eq!(running.end().code(), Some(130), "{signal}");
        assert!(folder.read(&dump).ends_with("}}\n"), "{signal}");
        assert!(saved_count(&folder, "kept") > before, "{signal}");
    }
}

/// Whether this process, and so all that it starts, ignores SIGHUP.
fn hangup_is_ignored() -> bool {
    let status = fs::read_to_string("/proc/self/status").unwrap();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:")).unwrap();
    u64::from_str_radix(mask.trim(), 16).unwrap() & 1 != 0
}

fn saved_count_of_copy(folder: &Folder) -> u64 {
    fs::copy(folder.path("kept"), folder.path("seen")).unwrap();
    saved_count(folder, "seen")
}

#[test]
fn nohup_keeps_a_run_from_ending_with_its_terminal() {
    let folder = folder("nohup");
    let plcrt = folder.command(&[]).get_program().to_owned();
    let mut nohup = Command::new("nohup");
    nohup.arg(plcrt).args(REALTIME).current_dir(folder.path(""));
    let mut running = Running::start(&mut nohup);
    wait_until("the first save", || folder.path("kept.bak").exists());
    running.signal("HUP", 2);
    // It goes on to count and to save; a run that ends saves once more at most.
    for _ in 0..3 {
        let before = saved_count_of_copy(&folder);
        wait_until("another save", || saved_count_of_copy(&folder) > before);
    }
    running.signal("TERM", 1);
    assert_eq!(running.end().code(), Some(130));
}

#[test]
fn a_second_process_is_refused_and_told_which_is_the_first() {
    let folder = folder("second");
    let mut running = folder.start(&REALTIME);
    wait_until("its lock", || folder.path("kept.lock").exists());
    wait_until("the number in its lock", || folder.read("kept.lock").contains('\n'));
    let second = folder.run(&["count.plcx", "--ticks", "1", "--retain", "kept"]);
    let message = String::from_utf8(second.stderr).unwrap();
    assert_eq!(second.status.code(), Some(2), "{message}");
    assert!(message.contains(&format!("process {}", running.id())), "{message}");
    running.signal("TERM", 1);
    running.end();
    let third = folder.run(&["count.plcx", "--ticks", "1", "--retain", "kept"]);
    assert_eq!(third.status.code(), Some(0));
}

#[test]
fn a_retained_file_that_is_missing_is_told_or_refused() {
    let folder = folder("missing");
    let run = |more: &[&str]| {
        let output =
            folder.run(&[&["count.plcx", "--ticks", "1", "--retain", "kept"], more].concat());
        (output.status.code(), String::from_utf8(output.stderr).unwrap())
    };
    let (status, message) = run(&["--retain-must-exist"]);
    assert_eq!(status, Some(2));
    assert!(message.contains("neither the retained file kept nor its copy exists"), "{message}");
    let (status, message) = run(&[]);
    assert_eq!(status, Some(0));
    assert!(message.contains("begins with nothing retained"), "{message}");
    assert_eq!(run(&["--retain-must-exist"]), (Some(0), String::new()));
    fs::write(folder.path("kept.bak"), "damaged").unwrap();
    let (status, message) = run(&[]);
    assert_eq!(status, Some(0));
    assert!(message.contains("kept.bak of the retained file can't be used"), "{message}");
}

/// Saving is stuck here in the dump, for which a FIFO stands whose reader takes nothing. A signal more
/// than a second after the first one ends the process all the same; the retained data is saved.
#[test]
fn a_later_signal_waits_for_the_save_at_most_five_seconds() {
    let folder = Folder::new("stuck");
    // The dump has more bytes than a FIFO takes.
    let arrays: Vec<String> = (0..200).map(|number| format!("A{number}[255]")).collect();
    let text = format!("$INTEGER\n{}\n$END\n@NVINT[1]=7\n", arrays.join("\n"));
    folder.artifact("many.plcx", Dialect::Pmi, &text);
    assert!(Command::new("mkfifo").arg(folder.path("fifo")).status().unwrap().success());
    let reader = File::options().read(true).write(true).open(folder.path("fifo")).unwrap();
    // In real time a dump that nobody takes is left; in simulated time it is waited for.
    let args = ["many.plcx", "--ticks", "100000000000", "--retain", "kept", "--dump", "fifo"];
    let mut running = folder.start(&args);
    wait_until("that it handles signals", || handles_signals(&folder));
    running.signal("TERM", 2);
    wait_until("the save", || folder.path("kept.bak").exists());
    thread::sleep(Duration::from_millis(1500));
    running.signal("TERM", 1);
    running.says("not everything could be saved within 5 s");
    assert_eq!(running.end().code(), Some(130));
    drop(reader);
    let args = ["many.plcx", "--ticks", "0", "--retain", "kept", "--watch", "@NVINT[1]"];
    let output = folder.run(&[&args[..], &["--dump", "-"]].concat());
    assert!(String::from_utf8(output.stdout).unwrap().contains("\"@NVINT[1]\":7"));
}

/// A PMAC program that was changed finds what the former one had saved, and a file beside with what it
/// has no place for.
#[test]
fn a_changed_program_takes_over_what_the_former_one_saved() {
    let folder = Folder::new("changed");
    let first = "I5=2\nP7=1\nM1->Y:$C000,0,8\nM2->Y:$C001,0,8\n\
        OPEN PLC 1 CLEAR\nP1=P1+1\nP7=9\nCMD\"M2->Y:$C005,0,8\"\nCMD\"SAVE\"\nCLOSE\n";
    let second = "I5=2\nP7=2\nP8=5\nM1->Y:$C002,0,8\nM2->Y:$C003,0,8\n\
        OPEN PLC 1 CLEAR\nP2=P1\nCLOSE\n";
    folder.artifact("first.plcx", Dialect::Pmac, first);
    folder.artifact("second.plcx", Dialect::Pmac, second);
    let run = |program: &str, ticks: &str| {
        let args = [program, "--ticks", ticks, "--retain", "kept", "--watch", "P1,P7,P8"];
        let output = folder.run(&[&args[..], &["--dump", "-"]].concat());
        assert_eq!(output.status.code(), Some(0));
        (String::from_utf8(output.stdout).unwrap(), String::from_utf8(output.stderr).unwrap())
    };
    let (dump, _) = run("first.plcx", "20");
    assert!(dump.contains("\"P7\":9"), "{dump}");
    let saved = fs::read(folder.path("kept")).unwrap();
    let (dump, messages) = run("second.plcx", "2");
    assert!(dump.contains("\"P7\":9") && dump.contains("\"P8\":5"), "{dump}");
    assert!(!dump.contains("\"P1\":0"), "{dump}");
    for part in ["1 is gone: M2;", "2 are new: M1, P8;", "kept.old"] {
        assert!(messages.contains(part), "`{part}` is not in {messages}");
    }
    assert_eq!(fs::read(folder.path("kept.old")).unwrap(), saved);
    // What the second program has saved is its own.
    assert_eq!(run("second.plcx", "2").1, "");
}

/// SIGKILL at random moments. `PLCC_KILLS` gives another number of them than 8.
#[test]
fn a_process_that_is_killed_leaves_a_whole_file_and_no_rubbish() {
    let folder = folder("killed");
    let kills = std::env::var("PLCC_KILLS").ok().and_then(|n| n.parse().ok()).unwrap_or(8);
    let mut rng = Rng::new(11);
    let mut last = 0;
    for _ in 0..kills {
        let mut running = folder.start(&REALTIME);
        wait_until("its lock", || folder.path("kept.lock").exists());
        thread::sleep(Duration::from_millis(rng.below(1500) as u64));
        running.signal("KILL", 1);
        running.end();
        let count = saved_count(&folder, "kept");
        assert!(count >= last, "{count} after {last}");
        last = count;
        assert_eq!(folder.names(), ["count.plcx", "kept", "kept.bak"]);
    }
}

/// The order of system calls that survives a power failure: each copy is written and synchronised
/// before it takes its name, and its folder is synchronised before the other copy is begun. The dump
/// comes last.
#[test]
fn system_calls_have_the_order_that_survives_a_power_failure() {
    let folder = folder("strace");
    let plcrt = folder.command(&[]).get_program().to_owned();
    let mut strace = Command::new("strace");
    let calls = "trace=openat,write,fsync,rename,renameat,renameat2,unlink,unlinkat";
    strace.args(["-f", "-y", "-s", "8", "-o", "calls", "-e", calls]).arg(plcrt);
    strace.args(["count.plcx", "--ticks", "3", "--retain", "kept", "--dump", "dump"]);
    if !tools::is_there("strace") {
        return;
    }
    let done = strace.current_dir(folder.path("")).output().unwrap();
    let text = String::from_utf8_lossy(&done.stderr);
    if text.contains("strace: ") {
        tools::missing("strace", &format!("may not trace here: {text}"));
        return;
    }
    assert!(done.status.success(), "{done:?}");
    let place = fs::canonicalize(folder.path("")).unwrap().display().to_string();
    let calls: Vec<String> = folder
        .read("calls")
        .lines()
        .filter(|line| !line.contains("ENOENT"))
        .filter_map(|line| {
            let call = line.split_once(' ')?.1.trim_start();
            let (name, arguments) = call.split_once('(')?;
            let name = name.trim_end_matches('2').trim_end_matches("at");
            let has = |file: &str| arguments.contains(&format!("{place}/{file}"));
            Some(match name {
                "write" if has("kept.new>") => "write".to_owned(),
                "fsync" if has("kept.new>") => "fsync file".to_owned(),
                "fsync" if arguments.contains(&format!("{place}>")) => "fsync folder".to_owned(),
                "rename" if has("kept.new\"") && has("kept\"") => "rename to kept".to_owned(),
                "rename" if has("kept.new\"") && has("kept.bak\"") => {
                    "rename to kept.bak".to_owned()
                }
                "rename" if has("dump\"") => "rename to dump".to_owned(),
                _ => return None,
            })
        })
        .collect();
    let expected = [
        "write",
        "fsync file",
        "rename to kept",
        "fsync folder",
        "write",
        "fsync file",
        "rename to kept.bak",
        "fsync folder",
        "rename to dump",
    ];
    assert_eq!(calls, expected, "{}", folder.read("calls"));
}
