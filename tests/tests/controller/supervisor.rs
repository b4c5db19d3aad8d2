//! The supervisor: a control in a process of its own, and what happens when one of the two dies or hangs.

use std::fs;
use std::io::Read;
use std::os::unix::net::UnixDatagram;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use plcc_abi::Dialect;
use plcc_control::ControlArgs;
use plcc_host::image_file::{ImageReader, State};
use plcc_load::Artifact;
use plcc_runtime::safe_outputs::SafeByte;
use rustix::process::{Pid, Signal, kill_process};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};

use crate::shop::{Shop, loader, wait};

/// Counts scans, keeps a count over power-off, has an output that is on, and stops when `BAD` is set.
const PMI: &str = "\
$INPUT
BAD = 0/0
$OUTPUT
LAMP = 1/0
$INTEGER
N, LIST[3]
$END
N = N + 1
LAMP = T
@NVINT[0] = @NVINT[0] + 1
IF(BAD)
LIST[N] = 1
ENDIF
";

/// Where all is well nothing waits as long as this.
const LONG: Duration = Duration::from_secs(600);

fn shop(name: &str) -> Shop {
    Shop::new(name, Dialect::Pmi, PMI)
}

/// Waits until something holds.
fn until(what: &str, mut holds: impl FnMut() -> bool) {
    let start = Instant::now();
    while !holds() {
        assert!(start.elapsed() < LONG, "{what}");
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// The process that a supervisor has started, once it has run ticks: its trace then has a row.
fn control_of(supervisor: &Child, shop: &Shop) -> u32 {
    let id = supervisor.id();
    let children = format!("/proc/{id}/task/{id}/children");
    let mut found = None;
    until("no control is started", || {
        let text = fs::read_to_string(&children).unwrap_or_default();
        found = text.split_whitespace().next().and_then(|id| id.parse().ok());
        found.is_some()
    });
    until("no tick is run", || {
        fs::read_to_string(shop.path("t.csv")).is_ok_and(|trace| trace.lines().count() > 3)
    });
    found.unwrap()
}

fn signal(name: &str, process: u32) {
    let process = process.to_string();
    assert!(Command::new("kill").args([name, &process]).status().unwrap().success());
}

const RUN: &str =
    "--realtime --watchdog 1h --period 2 --watch N --trace t.csv --dump d.json --log log.jsonl";

#[test]
fn the_exit_status_is_that_of_the_control() {
    let shop = shop("status");
    fs::write(shop.path("s.csv"), "tick,name,value\n5,BAD,1\n").unwrap();
    for (args, status) in [
        ("--realtime --watchdog 1h --period 1 --ticks 20", 0),
        ("--realtime --watchdog 1h --period 1 --ticks 20 --stimulus s.csv", 3),
        ("--realtime --watchdog 1h --watch NOPE", 2),
    ] {
        let mut child = shop.command(args).spawn().unwrap();
        assert_eq!(wait(&mut child).code(), Some(status), "{args}");
    }
}

#[test]
fn a_signal_to_the_supervisor_ends_the_run_and_everything_is_saved() {
    let shop = shop("signal");
    for name in ["-TERM", "-INT"] {
        let mut supervisor = shop.command(&format!("{RUN} --retain kept")).spawn().unwrap();
        control_of(&supervisor, &shop);
        signal(name, supervisor.id());
        assert_eq!(wait(&mut supervisor).code(), Some(130), "{name}");
        assert!(shop.read("d.json").contains("\"state\":\"running\""));
        assert!(shop.path("kept").is_file());
        for file in ["d.json", "kept", "t.csv"] {
            fs::remove_file(shop.path(file)).unwrap();
        }
    }
}

#[test]
fn a_control_that_is_killed_is_told_and_not_restarted() {
    let shop = shop("killed");
    let mut supervisor = shop.command(RUN).spawn().unwrap();
    signal("-KILL", control_of(&supervisor, &shop));
    assert_eq!(wait(&mut supervisor).code(), Some(3));
    let log = shop.read("log.jsonl");
    let entry = log.lines().find(|line| line.contains("\"kind\":\"control_died\"")).unwrap();
    assert!(entry.contains("SIGKILL") && entry.contains("\"restart\":false"), "{entry}");
}

#[test]
fn faults_and_messages_are_told_as_they_come_and_go() {
    let source = "$INPUT\nOIL = 0/0\n$FAULT\nFLT1 = \"OIL LOW\"\n$MESSAGE\nMSG1 = \"N IS\",N\n$INTEGER\nN\n$END\n\
                  N = N + 1\nFLT1 = OIL\nMSG1 = N = 7\n";
    let shop = Shop::new("faults", Dialect::Pmi, source);
    fs::write(shop.path("s.csv"), "tick,name,value\n3,OIL,1\n9,OIL,0\n").unwrap();
    let run = "--realtime --watchdog 1h --overrun catch-up=20 --period 2 --ticks 15 --stimulus s.csv --log log.jsonl";
    let done = shop.command(run).stderr(Stdio::piped()).spawn().unwrap();
    let said = String::from_utf8(done.wait_with_output().unwrap().stderr).unwrap();
    let told: Vec<&str> = said
        .lines()
        .filter(|line| line.starts_with("fault") || line.starts_with("message"))
        .collect();
    assert_eq!(
        told,
        [
            "fault: tick 3: OIL LOW (FLT1)",
            "message: tick 6: N IS 7 (MSG1)",
            "message: tick 7: no longer: N IS 8 (MSG1)",
            "fault: tick 9: no longer: OIL LOW (FLT1)",
        ],
        "{said}"
    );
    assert!(
        !shop.read("log.jsonl").contains("OIL"),
        "the log is of what happens around the program"
    );
}

/// What a control has begun to say on a terminal is taken away before its supervisor tells of its death.
#[test]
fn the_death_of_a_control_is_told_on_a_line_of_its_own() {
    let shop = shop("terminal");
    let ours = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
    grantpt(&ours).unwrap();
    unlockpt(&ours).unwrap();
    let theirs = ptsname(&ours, vec![]).unwrap().into_string().unwrap();
    let theirs = fs::File::options().read(true).write(true).open(theirs).unwrap();
    let mut supervisor = shop.command(RUN).stderr(theirs).spawn().unwrap();
    let (mut ours, mut said) = (fs::File::from(ours), String::new());
    let mut read_until = |part: &str| {
        let mut bytes = [0; 4096];
        while !said.contains(part) {
            let count = ours.read(&mut bytes).unwrap();
            said.push_str(&String::from_utf8_lossy(&bytes[..count]));
        }
        said.clone()
    };
    read_until("Ctrl-C ends");
    signal("-KILL", control_of(&supervisor, &shop));
    let said = read_until("is not restarted");
    assert!(said.contains("\r\x1b[Kerror: the control's process has died"), "{said:?}");
    assert_eq!(wait(&mut supervisor).code(), Some(3));
}

#[test]
fn a_control_is_restarted_as_often_as_was_said() {
    let shop = shop("restart");
    let mut supervisor = shop.command(&format!("{RUN} --restart 1")).spawn().unwrap();
    let first = control_of(&supervisor, &shop);
    signal("-KILL", first);
    until("it is not told", || shop.read("log.jsonl").contains("\"restart\":true"));
    fs::remove_file(shop.path("t.csv")).unwrap();
    let second = control_of(&supervisor, &shop);
    assert_ne!(first, second);
    signal("-KILL", second);
    assert_eq!(wait(&mut supervisor).code(), Some(3));
    assert_eq!(shop.read("log.jsonl").matches("\"kind\":\"control_died\"").count(), 2);
}

/// A signal that comes after a control has died and before the next one is started is not lost.
#[test]
fn a_signal_before_a_restart_ends_the_supervisor() {
    let shop = shop("pause");
    let mut supervisor = shop.command(&format!("{RUN} --restart 1")).spawn().unwrap();
    signal("-KILL", control_of(&supervisor, &shop));
    until("it is not told", || shop.read("log.jsonl").contains("\"restart\":true"));
    signal("-TERM", supervisor.id());
    // 130 where the computer is so busy that the next control has been started meanwhile.
    let status = wait(&mut supervisor).code();
    assert!(matches!(status, Some(3 | 130)), "{status:?}");
}

#[test]
fn a_control_that_stands_still_is_killed() {
    let shop = shop("stopped");
    let mut supervisor = shop.command(RUN).spawn().unwrap();
    signal("-STOP", control_of(&supervisor, &shop));
    assert_eq!(wait(&mut supervisor).code(), Some(3));
    assert!(shop.read("log.jsonl").contains("it hung"));
}

/// One that is stopped at its first tick may not yet have said that it runs.
#[test]
fn a_control_that_stands_still_at_its_first_tick_is_killed() {
    let shop = shop("stopped-at-first-tick");
    let image = shop.path("image");
    let mut supervisor = shop.command(&format!("{RUN} --image image")).spawn().unwrap();
    signal("-STOP", first_running(&image));
    assert_eq!(wait(&mut supervisor).code(), Some(3));
    assert!(shop.read("log.jsonl").contains("it hung"));
    assert_eq!(ImageReader::open(&image).unwrap().state(), Some(State::Dead));
}

#[test]
fn a_control_whose_supervisor_dies_ends_and_saves() {
    let shop = shop("orphan");
    let mut supervisor = shop.command(&format!("{RUN} --retain kept")).spawn().unwrap();
    let control = control_of(&supervisor, &shop);
    signal("-KILL", supervisor.id());
    wait(&mut supervisor);
    until("the control goes on", || is_gone(control));
    assert!(shop.read("d.json").contains("\"state\":\"running\""));
    assert!(shop.path("kept").is_file());
    assert!(shop.read("log.jsonl").contains("the supervisor has died"));
}

/// A control whose supervisor was killed holds its files for some ten milliseconds more. The next one, which systemd
/// starts at once, waits for them and says so.
#[test]
fn a_control_waits_for_what_the_one_before_it_still_holds() {
    let shop = shop("predecessor");
    let args = "--realtime --watchdog 1h --no-supervisor --ticks 5 --retain kept --record r --image image \
                --log log.jsonl";
    let told = |what: &str| {
        let log = fs::read_to_string(shop.path("log.jsonl")).unwrap_or_default();
        log.lines().any(|line| line.contains(what) && line.contains("is waited for"))
    };
    for held in ["kept.lock", "r", "image"] {
        // The image file is one by its first bytes.
        assert_eq!(wait(&mut shop.command(args).spawn().unwrap()).code(), Some(0), "{held}");
        // On a computer that stands still for longer than the control waits, it may come too late.
        let waited = (0..20).any(|_| {
            let _ = fs::remove_file(shop.path("log.jsonl"));
            let mut options = fs::OpenOptions::new();
            let options = options.write(true).create(true).truncate(false);
            let lock = options.open(shop.path(held)).unwrap();
            lock.lock().unwrap();
            let mut next = shop.command(args).spawn().unwrap();
            until("it is not said that something is waited for", || {
                told(held.trim_end_matches(".lock")) || next.try_wait().unwrap().is_some()
            });
            drop(lock);
            wait(&mut next).code() == Some(0) && told(held.trim_end_matches(".lock"))
        });
        assert!(waited, "{held}");
    }
    let lock = fs::File::create(shop.path("kept.lock")).unwrap();
    lock.lock().unwrap();
    assert_eq!(wait(&mut shop.command(args).spawn().unwrap()).code(), Some(2));
    let log = shop.read("log.jsonl");
    assert!(log.lines().last().unwrap().contains("is in use by"), "{log}");
}

/// Whether a process has ended, also one for whose status nobody has asked yet.
fn is_gone(process: u32) -> bool {
    match fs::read_to_string(format!("/proc/{process}/status")) {
        Ok(status) => status.lines().any(|line| line.starts_with("State:") && line.contains('Z')),
        Err(_) => true,
    }
}

#[test]
fn a_control_whose_supervisor_takes_no_heartbeats_ends_and_saves() {
    let shop = shop("suspended");
    let mut supervisor = shop.command(&format!("{RUN} --retain kept")).spawn().unwrap();
    let control = control_of(&supervisor, &shop);
    signal("-STOP", supervisor.id());
    until("the control goes on", || is_gone(control));
    signal("-CONT", supervisor.id());
    assert_eq!(wait(&mut supervisor).code(), Some(130));
    assert!(shop.read("d.json").contains("\"state\":\"running\""));
    assert!(shop.path("kept").is_file());
    assert!(shop.read("log.jsonl").contains("the supervisor takes no heartbeats"));
}

/// The line of a thread's status in `/proc` that begins with this word.
fn status_line(status: &str, word: &str) -> String {
    status.lines().find_map(|line| line.strip_prefix(word)).unwrap().trim().to_owned()
}

#[test]
fn a_terminal_suspends_neither_control_nor_supervisor() {
    /// The number of SIGTTOU, which a process gets that writes to its terminal from the background.
    const TTOU: u32 = 22;
    let shop = shop("terminal");
    let mut supervisor = shop.command(RUN).spawn().unwrap();
    let control = control_of(&supervisor, &shop);
    let both = [supervisor.id(), control];
    for process in both {
        signal("-TSTP", process);
    }
    until("it is not told", || shop.read("log.jsonl").contains("Ctrl-Z (SIGTSTP) is refused"));
    let rows = shop.read("t.csv").lines().count();
    until("no further tick is run", || shop.read("t.csv").lines().count() > rows + 3);
    for process in both {
        for thread in fs::read_dir(format!("/proc/{process}/task")).unwrap() {
            let status = thread.unwrap().path().join("status");
            let status = fs::read_to_string(status).unwrap();
            assert!(!status_line(&status, "State:").contains("stopped"), "{status}");
            let blocked = u64::from_str_radix(&status_line(&status, "SigBlk:"), 16).unwrap();
            assert!(blocked & 1 << (TTOU - 1) != 0, "{status}");
        }
    }
    signal("-TERM", supervisor.id());
    assert_eq!(wait(&mut supervisor).code(), Some(130));
}

/// Nobody reads what systemd is told, so that its socket is soon full.
#[test]
fn systemd_that_does_not_listen_delays_nothing() {
    let shop = shop("deaf");
    let _socket = UnixDatagram::bind(shop.path("notify")).unwrap();
    let mut command = shop.command(RUN);
    command.env("NOTIFY_SOCKET", shop.path("notify")).env("WATCHDOG_USEC", "2000");
    let mut supervisor = command.spawn().unwrap();
    let control = control_of(&supervisor, &shop);
    until("few ticks are run", || shop.read("t.csv").lines().count() > 100);
    signal("-KILL", control);
    assert_eq!(wait(&mut supervisor).code(), Some(3));
}

#[test]
fn systemd_and_a_hardware_watchdog_are_told_that_all_is_well() {
    let shop = shop("notify");
    let socket = UnixDatagram::bind(shop.path("notify")).unwrap();
    socket.set_read_timeout(Some(LONG)).unwrap();
    fs::write(shop.path("device"), "").unwrap();
    let mut command = shop.command(&format!("{RUN} --watchdog-device device"));
    command.env("NOTIFY_SOCKET", shop.path("notify")).env("WATCHDOG_USEC", "200000");
    let mut supervisor = command.spawn().unwrap();
    let mut message = [0; 256];
    let mut receive = || {
        let length = socket.recv(&mut message).unwrap();
        String::from_utf8(message[..length].to_vec()).unwrap()
    };
    assert!(receive().starts_with("READY=1\n"));
    for _ in 0..3 {
        assert!(receive().starts_with("WATCHDOG=1\n"));
    }
    signal("-TERM", supervisor.id());
    assert_eq!(wait(&mut supervisor).code(), Some(130));
    let fed = fs::read(shop.path("device")).unwrap();
    assert!(fed.starts_with(b"\0") && fed.ends_with(b"V"), "{fed:?}");
}

/// Otherwise systemd would kill the supervisor that waits for the next control, where its `WatchdogSec` is short or the
/// computer is slow.
#[test]
fn systemd_is_told_that_a_control_is_being_started_again() {
    let shop = shop("again");
    let socket = UnixDatagram::bind(shop.path("notify")).unwrap();
    socket.set_read_timeout(Some(LONG)).unwrap();
    let mut command = shop.command(&format!("{RUN} --restart 1"));
    command.env("NOTIFY_SOCKET", shop.path("notify")).env("WATCHDOG_USEC", "200000");
    let mut supervisor = command.spawn().unwrap();
    let mut message = [0; 256];
    let mut receive = || {
        let length = socket.recv(&mut message).unwrap();
        String::from_utf8(message[..length].to_vec()).unwrap()
    };
    assert!(receive().starts_with("READY=1\n"));
    signal("-KILL", control_of(&supervisor, &shop));
    while !receive().contains("SIGKILL") {}
    // The next control comes a second later.
    assert_eq!(receive(), "WATCHDOG=1\n");
    assert_eq!(receive(), "WATCHDOG=1\n");
    while !receive().contains("STATUS=running") {}
    signal("-TERM", supervisor.id());
    assert_eq!(wait(&mut supervisor).code(), Some(130));
}

#[test]
fn without_a_supervisor_there_is_one_process() {
    let shop = shop("alone");
    let mut alone = shop.command(&format!("{RUN} --no-supervisor")).spawn().unwrap();
    until("no tick is run", || {
        fs::read_to_string(shop.path("t.csv")).is_ok_and(|trace| trace.lines().count() > 3)
    });
    let id = alone.id();
    assert_eq!(fs::read_to_string(format!("/proc/{id}/task/{id}/children")).unwrap(), "");
    signal("-TERM", id);
    assert_eq!(wait(&mut alone).code(), Some(130));
}

/// Nobody has opened the FIFO: the control ends before it would.
#[test]
fn a_fifo_as_log_or_hardware_watchdog_holds_up_no_supervisor() {
    let shop = shop("fifos");
    assert!(Command::new("mkfifo").arg(shop.path("fifo")).status().unwrap().success());
    for args in [
        "--realtime --watchdog 1h --key missing --log fifo",
        "--realtime --watchdog 1h --watchdog-device fifo",
    ] {
        let mut supervisor = shop.command(args).spawn().unwrap();
        assert_eq!(wait(&mut supervisor).code(), Some(2), "{args}");
    }
}

/// The dump that `plcrt ARGS` prints, or why it does not.
fn dumped(shop: &Shop, args: &str) -> Result<String, String> {
    let mut command = Command::new(loader());
    let output = command.args(args.split(' ')).current_dir(shop.path("")).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    match output.status.code() {
        Some(0) => Ok(text(&output.stdout)),
        code => Err(format!("{code:?} {}", text(&output.stderr))),
    }
}

#[test]
fn the_image_file_of_a_control_that_was_killed_gives_a_dump() {
    let shop = shop("post-mortem");
    let mut supervisor = shop.command(&format!("{RUN} --image image")).spawn().unwrap();
    signal("-KILL", control_of(&supervisor, &shop));
    wait(&mut supervisor);
    let whole = dumped(&shop, "p.plcx --dump-image image.dead").unwrap();
    assert!(whole.starts_with("{\"dialect\":\"pmi\",\"ticks\":"), "{whole}");
    // The program's variables are as it left them; the lamp's line is off.
    let parts = [
        "\"state\":\"running\",\"stop\":null,",
        "\"LAMP\":1,\"LIST\":[0,0,0],",
        "\"outputs\":{\"LAMP\":0}}\n",
    ];
    for part in parts {
        assert!(whole.contains(part), "{part} is not in {whole}");
    }
    let alone = dumped(&shop, "--dump-image image.dead").unwrap();
    assert!(alone.contains("\"LAMP\":1,\"LIST\":[0,0,0],"), "{alone}");
    // The file's table has the port's other lines too, which can be wired and forced.
    assert!(alone.ends_with("\"outputs\":{\"LAMP\":0,\"PORT1.1\":0,\"PORT1.2\":0,\"PORT1.3\":0,\"PORT1.4\":0,\"PORT1.5\":0,\"PORT1.6\":0,\"PORT1.7\":0}}\n"), "{alone}");
    let other = Shop::new("post-mortem-of-another", Dialect::Pmi, "$INTEGER\nX\n$END\nX = 1\n");
    let artifact = other.path("p.plcx");
    let refused = dumped(&shop, &format!("{} --dump-image image.dead", artifact.display()));
    let refused = refused.unwrap_err();
    assert!(refused.starts_with("Some(2)") && refused.contains("another program"), "{refused}");
    let none = dumped(&shop, "--dump-image p.plcx").unwrap_err();
    assert!(none.contains("it is not an image file"), "{none}");
}

/// Waits until an image file says that a control runs, and gives the control's process.
fn first_running(image: &Path) -> u32 {
    let mut process = 0;
    until("there is no image file", || match ImageReader::open(image) {
        Ok(file) => {
            process = file.process();
            file.state() == Some(State::Running)
        }
        Err(_) => false,
    });
    u32::try_from(process).unwrap()
}

/// The supervisor has heard little from a control that is killed at its first tick, or before.
#[test]
fn outputs_are_safe_after_a_kill_at_the_first_tick() {
    let shop = shop("first-tick");
    let image = shop.path("image");
    for _ in 0..8 {
        let mut supervisor = shop.command(&format!("{RUN} --image image")).spawn().unwrap();
        let process = first_running(&image);
        let id = Pid::from_raw(i32::try_from(process).unwrap()).unwrap();
        kill_process(id, Signal::KILL).unwrap();
        assert_eq!(wait(&mut supervisor).code(), Some(3));
        assert_eq!(ImageReader::open(&image).unwrap().state(), Some(State::Dead));
        let whole = dumped(&shop, "p.plcx --dump-image image.dead").unwrap();
        assert!(whole.ends_with("\"outputs\":{\"LAMP\":0}}\n"), "{whole}");
        for file in [&image, &shop.path("image.dead")] {
            fs::remove_file(file).unwrap();
        }
    }
}

#[test]
fn the_image_file_of_a_run_that_can_not_begin_says_so() {
    let shop = shop("not-begun");
    let args = "--realtime --watchdog 1h --image image --watch N --trace missing/t.csv";
    assert_eq!(wait(&mut shop.command(args).spawn().unwrap()).code(), Some(2));
    assert_eq!(ImageReader::open(&shop.path("image")).unwrap().state(), Some(State::Ended));
}

/// How often the control, and then the supervisor, is killed; more in `scripts/full supervisor`.
fn kills() -> u32 {
    std::env::var("PLCC_KILLS").map_or(50, |text| text.parse().unwrap())
}

/// What the safe outputs of a control are.
fn safe_bytes(shop: &Shop) -> Vec<SafeByte> {
    let artifact = Artifact::open(&shop.path("p.plcx"), None).unwrap();
    let control = ControlArgs::default();
    let executive = plcc_control::executive(&artifact.program, &control, true, None).unwrap();
    executive.safe_lines().bytes().to_vec()
}

/// Whether the outputs in an image have their safe values.
fn is_safe(safe: &[SafeByte], image: &[u8]) -> bool {
    safe.iter().all(|byte| image.get(byte.offset as usize).unwrap() & !byte.keep == byte.set)
}

/// Has this thread run before all that it measures, where that is permitted: else the times are those
/// after which it has had its turn. The processes that it starts are ordinary ones.
fn run_before_all_others() {
    let thread = fs::read_link("/proc/thread-self").unwrap();
    let thread = thread.file_name().unwrap();
    let args = ["--reset-on-fork", "--fifo", "--pid", "60"];
    let _ = Command::new("chrt").args(args).arg(thread).stderr(Stdio::null()).status();
}

/// Kills a process of a pair at random moments, and writes how long it takes until the image file has the
/// safe outputs: percentiles are for people, since a test must not depend on time.
fn kill_at_random(name: &str, supervisor_dies: bool) {
    let shop = shop(name);
    let image = shop.path("image");
    let safe = safe_bytes(&shop);
    run_before_all_others();
    let mut times = vec![];
    for kill in 0..kills() {
        let _ = fs::remove_file(shop.path("t.csv"));
        let args = "--realtime --watchdog 1h --watch N --trace t.csv --image image";
        let mut supervisor = shop.command(args).spawn().unwrap();
        let control = control_of(&supervisor, &shop);
        let reader = ImageReader::open(&image).unwrap();
        assert!(!is_safe(&safe, &reader.read().unwrap().image), "the lamp is on");
        // Anywhere in a period of 20 ms.
        std::thread::sleep(Duration::from_micros(u64::from(kill) * 7_919 % 20_000));
        let victim = if supervisor_dies { supervisor.id() } else { control };
        let victim = Pid::from_raw(i32::try_from(victim).unwrap()).unwrap();
        let start = Instant::now();
        kill_process(victim, Signal::KILL).unwrap();
        while !reader.read().is_some_and(|snapshot| is_safe(&safe, &snapshot.image)) {
            assert!(start.elapsed() < LONG, "the outputs stay on");
            std::thread::sleep(Duration::from_micros(200));
        }
        times.push(start.elapsed());
        wait(&mut supervisor);
        if supervisor_dies {
            until("the control goes on", || is_gone(control));
        } else {
            assert_eq!(reader.state(), Some(State::Dead));
        }
    }
    times.sort();
    let at = |per_mille: usize| times.get((times.len() - 1) * per_mille / 1000).unwrap();
    println!(
        "{name}: {} kills; safe after p50 {:?}, p99.9 {:?}, at most {:?}",
        times.len(),
        at(500),
        at(999),
        at(1000)
    );
}

#[test]
fn outputs_are_safe_after_the_control_is_killed_at_any_moment() {
    kill_at_random("control-killed", false);
}

#[test]
fn outputs_are_safe_after_the_supervisor_is_killed_at_any_moment() {
    kill_at_random("supervisor-killed", true);
}
