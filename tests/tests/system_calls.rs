//! What the thread that runs the ticks asks of the operating system in real time: after the first
//! ticks one system call a tick, which waits for its time, and no page fault. And what a run does when a system
//! call fails, or is the last one before the process is killed.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, clippy::panic)]

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::process::{Command, Output, Stdio};
use std::thread;
use std::time::Duration;

use plcc_abi::Dialect;
use plcc_tests::loader::{Folder, Running, wait_until};
use plcc_tests::tools;

/// A program of each language that changes something in every tick, what is retained among it.
const PROGRAMS: [(&str, Dialect, &str); 3] = [
    ("a.plcx", Dialect::Pmi, "$OUTPUT\nOUT=1/0\n$INTEGER\nN\n$END\nN=N+1\nOUT=N>3\n@NVINT[1]=N\n"),
    ("b.plcx", Dialect::Nct, ":001\nLF500 +1 SF500\nJ1\n:000\nJ0\n"),
    (
        "c.plcx",
        Dialect::Pmac,
        "I5=2\nI8=20\nOPEN PLC 1 CLEAR\nP1=P1+1\nM1=P1\nCMD\"SAVE\"\nCLOSE\n",
    ),
];

fn folder(name: &str) -> Folder {
    let folder = Folder::new(name);
    for (artifact, dialect, text) in PROGRAMS {
        folder.artifact(artifact, dialect, text);
    }
    folder
}

/// The options of the runs: in real time, with retained data that changes. `test` says whose image file it is, since tests
/// of one process run at the same time.
fn options(test: &str, artifact: &str) -> Vec<String> {
    let words = format!(
        "{artifact} --realtime --watchdog 1h --no-supervisor --retain {artifact}.kept --record {artifact}.plcrec \
         --image /dev/shm/plcc-{test}-{}-{artifact}",
        std::process::id()
    );
    words.split(' ').map(str::to_owned).collect()
}

#[test]
fn a_tick_makes_one_system_call() {
    let folder = folder("calls");
    for (artifact, dialect, _) in PROGRAMS {
        // About three seconds each, so that retained data is handed over meanwhile.
        let ticks = if dialect == Dialect::Pmac { 6000 } else { 150 };
        let mut args = options("calls", artifact);
        args.extend(["--ticks".to_owned(), ticks.to_string()]);
        let args: Vec<&str> = args.iter().map(String::as_str).collect();
        let Some(output) = traced(&folder, &[], &args) else { return };
        assert!(output.status.success(), "{artifact}: {output:?}");
        let calls = folder.read("calls");
        // The thread that waits most often runs the ticks.
        let mut threads: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
        for line in calls.lines().filter(|line| !line.contains(" resumed>")) {
            let (thread, call) = line.split_once(' ').unwrap();
            let call = call.trim_start();
            // An NCT control near its limits reads its processor time.
            if dialect == Dialect::Nct && call.starts_with("clock_gettime(CLOCK_THREAD_CPUTIME_ID")
            {
                continue;
            }
            threads.entry(thread).or_default().push(call.split('(').next().unwrap());
        }
        let waits =
            |calls: &[&str]| calls.iter().filter(|call| **call == "clock_nanosleep").count();
        let scan = threads.values().max_by_key(|calls| waits(calls)).unwrap();
        let first = scan.iter().position(|call| *call == "clock_nanosleep").unwrap();
        let last = scan.iter().rposition(|call| *call == "clock_nanosleep").unwrap();
        // The first ticks may still load pages and fill caches.
        let steady = &scan[first..=last];
        let steady = &steady[steady.len() / 10..];
        let other: Vec<&&str> = steady.iter().filter(|call| **call != "clock_nanosleep").collect();
        assert!(other.is_empty(), "{artifact}: {other:?}");
        // A late tick does not wait.
        assert!(steady.len() > 10 && waits(scan) <= ticks, "{artifact}: {} waits", waits(scan));
    }
}

/// The page faults of a thread so far, those that read from the disk and those that do not.
fn page_faults(process: &str, thread: &str) -> u64 {
    let stat = fs::read_to_string(format!("/proc/{process}/task/{thread}/stat")).unwrap();
    // The name of the program, in parentheses, may hold spaces. After it stand the fields from the
    // third on; the tenth and the twelfth are the two numbers.
    let fields: Vec<&str> = stat.rsplit(')').next().unwrap().split_whitespace().collect();
    let field = |at: usize| fields.get(at).unwrap().parse::<u64>().unwrap();
    field(7) + field(9)
}

#[test]
fn a_tick_makes_no_page_fault() {
    let folder = folder("faults");
    for (artifact, ..) in PROGRAMS {
        let mut command = folder.command(&[]);
        let mut running = Running::start(command.args(options("faults", artifact)));
        let kept = folder.path(&format!("{artifact}.kept.bak"));
        wait_until("the first save", || kept.exists());
        let id = running.id();
        let status = fs::read_to_string(format!("/proc/{id}/status")).unwrap();
        let locked = status.lines().find_map(|line| line.strip_prefix("VmLck:")).unwrap();
        if locked.trim() == "0 kB" {
            eprintln!("skipped: memory may not be locked here");
            return;
        }
        // Until something was handed over twice.
        thread::sleep(Duration::from_millis(1500));
        let before = page_faults(&id, &id);
        thread::sleep(Duration::from_millis(2500));
        let after = page_faults(&id, &id);
        running.signal("TERM", 1);
        running.end();
        assert_eq!(after, before, "{artifact}");
    }
}

/// `plcrt ARGS` under strace with these options, in the folder. `None` where strace is missing or may not trace.
fn traced(folder: &Folder, options: &[&str], args: &[&str]) -> Option<Output> {
    let plcrt = folder.command(&[]).get_program().to_owned();
    let mut strace = Command::new("strace");
    strace.args(["-f", "-o", "calls", "-e", "signal=none"]).args(options).arg(plcrt).args(args);
    if !tools::is_there("strace") {
        return None;
    }
    let output = strace.current_dir(folder.path("")).stdin(Stdio::null()).output().unwrap();
    let text = String::from_utf8_lossy(&output.stderr);
    if text.contains("strace: ") {
        tools::missing("strace", &format!("may not trace here: {text}"));
        return None;
    }
    Some(output)
}

/// The names of the system calls that strace has written down.
fn called(folder: &Folder) -> Vec<String> {
    let text = folder.read("calls");
    let begun = text.lines().filter(|line| line.contains('(') && !line.contains(" resumed>"));
    let call = |line: &str| line.split_whitespace().nth(1)?.split('(').next().map(str::to_owned);
    begun.filter_map(call).collect()
}

/// A run that counts in F500, which it keeps, and writes all its files.
const WRITES_ALL: [&str; 18] = [
    "b.plcx",
    "--ticks",
    "5",
    "--retain",
    "kept",
    "--watch",
    "F500",
    "--trace",
    "t.csv",
    "--events",
    "e.jsonl",
    "--log",
    "l.jsonl",
    "--dump",
    "d.json",
    "--record",
    "r.plcrec",
    "--no-supervisor",
];

/// What the retained file holds in F500; it must be whole.
fn kept_count(folder: &Folder, what: &str) -> u64 {
    let args = ["b.plcx", "--ticks", "0", "--retain", "kept", "--watch", "F500", "--dump", "-"];
    let output = folder.run(&args);
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let errors = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{what}: {errors}");
    let value = text.split("\"F500\":").nth(1).unwrap_or_else(|| panic!("{what}: {text}"));
    value.split(|c: char| !c.is_ascii_digit()).next().unwrap().parse().unwrap()
}

/// The state before the run is kept, or that after it, and no temporary file stays. `PLCC_KILLS` gives another
/// number of kills than 24.
#[test]
fn a_kill_at_any_system_call_loses_nothing_that_was_kept() {
    let folder = folder("killed-at-calls");
    let args = ["b.plcx", "--ticks", "5", "--retain", "kept", "--dump", "d.json"];
    let kept = ["kept", "kept.bak"];
    assert_eq!(folder.run(&args).status.code(), Some(0));
    let before: Vec<Vec<u8>> =
        kept.iter().map(|name| fs::read(folder.path(name)).unwrap()).collect();
    if traced(&folder, &[], &args).is_none() {
        return;
    }
    // strace counts the calls of each thread by itself; the first thread does the work.
    let text = folder.read("calls");
    let thread = text.split_whitespace().next().unwrap();
    let calls = text.lines().filter(|line| line.starts_with(thread) && line.contains('(')).count();
    let kills = std::env::var("PLCC_KILLS").ok().and_then(|n| n.parse().ok()).unwrap_or(24);
    let mut seen = vec![];
    for kill in 1..=kills {
        let at = (kill * calls / kills).max(1);
        for (name, bytes) in kept.iter().zip(&before) {
            fs::write(folder.path(name), bytes).unwrap();
        }
        let inject = format!("inject=all:signal=SIGKILL:when={at}");
        traced(&folder, &["-e", "trace=all", "-e", &inject], &args).unwrap();
        seen.push(kept_count(&folder, &inject));
        let names = folder.names();
        assert!(names.iter().all(|name| !name.ends_with(".tmp")), "{inject}: {names:?}");
    }
    assert!(seen.iter().all(|count| [5, 10].contains(count)), "{seen:?}");
    assert!(seen.contains(&5) && (seen.contains(&10) || kills < 24), "{seen:?}");
}

/// The run goes on, or ends with a message and the exit status 2; what is retained stays whole.
#[test]
fn a_system_call_that_fails_ends_in_no_panic() {
    /// Calls that the program makes itself, not the start of every process, and how they may fail.
    const FAULTS: [(&str, &[&str]); 14] = [
        ("openat", &["EIO", "EMFILE", "EINTR"]),
        ("read", &["EIO", "EINTR"]),
        ("write", &["EIO", "ENOSPC", "EINTR"]),
        ("fsync", &["EIO", "EINTR"]),
        ("fdatasync", &["EIO"]),
        ("rename", &["EIO", "ENOSPC"]),
        ("unlink", &["EIO"]),
        ("flock", &["EINTR", "ENOLCK"]),
        ("ftruncate", &["EIO", "ENOSPC"]),
        ("fallocate", &["ENOSPC", "EINTR"]),
        ("statx", &["EIO"]),
        ("lseek", &["EIO"]),
        ("clone3", &["EAGAIN"]),
        ("fcntl", &["EIO"]),
    ];
    let folder = folder("failing-calls");
    if traced(&folder, &[], &WRITES_ALL).is_none() {
        return;
    }
    let calls = called(&folder);
    for (call, errors) in FAULTS {
        let count = calls.iter().filter(|name| *name == call).count();
        // The first ones, which are those of the dynamic linker for some calls, one in the middle, and the last.
        let places: BTreeSet<usize> = [3, count / 2, count].into();
        for (error, at) in errors.iter().flat_map(|error| places.iter().map(move |at| (error, at)))
        {
            if *at == 0 || *at > count {
                continue;
            }
            let inject = format!("inject={call}:error={error}:when={at}");
            let output = traced(&folder, &["-e", &inject], &WRITES_ALL).unwrap();
            let text = String::from_utf8_lossy(&output.stderr).into_owned();
            let status = output.status.code();
            // 127 is that of the dynamic linker.
            assert!(matches!(status, Some(0 | 2 | 127)), "{inject}: {status:?} {text}");
            assert!(!text.contains("panicked"), "{inject}: {text}");
            assert!(*error != "EINTR" || status != Some(2), "{inject} is not repeated: {text}");
            kept_count(&folder, &inject);
        }
    }
}

/// The byte that wakes the thread which waits for signals can be neither written nor read.
#[test]
fn signals_end_a_run_although_nothing_wakes_their_thread() {
    let folder = folder("signals-without-wake-up");
    // A signal in the 20th wait for a tick; without it the run would end by itself.
    let faults = [
        ["-e", "inject=recvfrom:error=EIO"],
        ["-e", "inject=sendto:error=EPIPE"],
        ["-e", "inject=clock_nanosleep:signal=SIGTERM:when=20"],
    ];
    let args = "b.plcx --realtime --watchdog 1h --no-supervisor --ticks 1000 --dump d.json";
    let args: Vec<&str> = args.split(' ').collect();
    let Some(output) = traced(&folder, &faults.concat(), &args) else { return };
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(130), "{text}");
    assert!(!text.contains("panicked"), "{text}");
    assert!(folder.path("d.json").exists(), "the dump is written");
}
