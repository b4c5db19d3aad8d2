//! What the thread that runs the ticks asks of the operating system in real time: after the first
//! ticks one system call a tick, which waits for its time, and no page fault.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, clippy::panic)]

use std::collections::BTreeMap;
use std::fs;
use std::process::{Command, Stdio};
use std::thread;
use std::time::Duration;

use plcc_abi::Dialect;
use plcc_tests::loader::{Folder, Running, wait_until};

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

/// The options of the runs: in real time, with retained data that changes.
fn options(artifact: &str) -> Vec<String> {
    let words = format!(
        "{artifact} --realtime --watchdog 1h --no-supervisor --retain {artifact}.kept --record {artifact}.plcrec \
         --image /dev/shm/plcc-calls-{}-{artifact}",
        std::process::id()
    );
    words.split(' ').map(str::to_owned).collect()
}

#[test]
fn a_tick_makes_one_system_call() {
    let folder = folder("calls");
    let plcrt = folder.command(&[]).get_program().to_owned();
    for (artifact, dialect, _) in PROGRAMS {
        // About three seconds each, so that retained data is handed over meanwhile.
        let ticks = if dialect == Dialect::Pmac { 6000 } else { 150 };
        let mut strace = Command::new("strace");
        strace.args(["-f", "-o", "calls", "-e", "signal=none"]).arg(&plcrt);
        strace.args(options(artifact)).args(["--ticks", &ticks.to_string()]);
        let strace = strace.current_dir(folder.path("")).stderr(Stdio::null());
        if !strace.status().is_ok_and(|status| status.success()) {
            eprintln!("skipped: strace is missing here, or may not trace");
            return;
        }
        let calls = folder.read("calls");
        // The thread that waits most often runs the ticks.
        let mut threads: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
        for line in calls.lines().filter(|line| !line.contains(" resumed>")) {
            let (thread, call) = line.split_once(' ').unwrap();
            let call = call.trim_start();
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
        let mut running = Running::start(command.args(options(artifact)));
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
