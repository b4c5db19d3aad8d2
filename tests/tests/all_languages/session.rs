//! Runs with the options of `plcc run` and `plcrt`, which both hand to `plcc_host::session`: the
//! files that they write, their exit status, their time, and the data that survives power-off.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::cell::Cell;
use std::fs;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::time::{Duration, Instant};

use clap::Parser;
use plcc_abi::{Dialect, Engine, Host, HostFn, Outcome, ResumePoint, Scan, TrapCode};
use plcc_frontend::common::Options;
use plcc_host::args::RunArgs;
use plcc_host::run::{Clock, SystemClock};
use plcc_host::session::{self, Surroundings};
use plcc_record::Recording;
use plcc_tests::compile::{EngineKind, compile};

#[derive(Parser)]
struct Args {
    #[command(flatten)]
    run: RunArgs,
}

const PMI: &str = "\
$INPUT
GO = 0/0
$OUTPUT
LAMP = 1/0
$INTEGER
N, LIST[3], FIVE = 5
$FAULT
HOT = \"TOO HOT\", N
$END
N = N + GO
LAMP = GO
HOT = N > 2
@NVINT[0] = @NVINT[0] + GO
LIST[N] = 7
";

const NCT: &str = ":001\nLF500 +1 SF500\nJ1\n:000\nJ0\n";

const PMAC: &str = "I5=2\nOPEN PLC 1 CLEAR\nP1=P1+0.5\nSEND\"tick\"\nCLOSE\nENABLE PLC 1\n";

/// A folder with programs, which goes away with the test.
struct Shop(PathBuf);

impl Shop {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("plcc-{name}-{}", std::process::id()));
        fs::create_dir_all(&path).unwrap();
        let shop = Self(path);
        for (file, text) in [("p.pmi", PMI), ("n.nct", NCT), ("c.pmc", PMAC)] {
            fs::write(shop.path(file), text).unwrap();
        }
        shop
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    /// The text of a file, in which sources are named without their folder.
    fn read(&self, name: &str) -> String {
        let folder = format!("{}/", self.0.display());
        fs::read_to_string(self.path(name)).unwrap().replace(&folder, "")
    }

    /// Runs a program in the statement interpreter; words that begin with `%` are files of the
    /// folder.
    fn run(&self, program: &str, args: &str) -> u8 {
        self.run_in(EngineKind::Statements, program, args, |engine| engine)
    }

    /// The same, paced by a clock of the test.
    fn run_by_clock(&self, clock: &dyn Clock, program: &str, args: &str) -> u8 {
        self.run_in_by_clock(EngineKind::Statements, clock, program, args, |engine| engine)
    }

    /// Runs a program in an engine that `wrap` has put something around.
    fn run_in(
        &self,
        way: EngineKind,
        program: &str,
        args: &str,
        wrap: impl FnOnce(Box<dyn Engine>) -> Box<dyn Engine>,
    ) -> u8 {
        self.run_in_by_clock(way, &SystemClock, program, args, wrap)
    }

    fn run_in_by_clock(
        &self,
        way: EngineKind,
        clock: &dyn Clock,
        program: &str,
        args: &str,
        wrap: impl FnOnce(Box<dyn Engine>) -> Box<dyn Engine>,
    ) -> u8 {
        let dialect = match program {
            "p.pmi" => Dialect::Pmi,
            "n.nct" => Dialect::Nct,
            _ => Dialect::Pmac,
        };
        let compiled = compile(&self.path(program), dialect, &Options::default());
        let (program, engine) = compiled.unwrap_or_else(|e| panic!("{e}")).engine(way).unwrap();
        let mut engine = wrap(engine);
        let words = args.split_whitespace().map(|word| match word.strip_prefix('%') {
            Some(file) => self.path(file).to_string_lossy().into_owned(),
            None => word.to_owned(),
        });
        let args = Args::try_parse_from(std::iter::once("run".to_owned()).chain(words)).unwrap();
        session::run_with(
            &program,
            &mut engine,
            &args.run,
            None,
            Surroundings { clock, ..Surroundings::default() },
        )
    }
}

impl Drop for Shop {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

#[test]
fn all_outputs_of_a_stopped_run_are_complete() {
    let shop = Shop::new("stopped");
    fs::write(shop.path("go.csv"), "tick,name,value\n1,GO,1\n").unwrap();
    let args = "--ticks 100 --stimulus %go.csv --watch N,LAMP,LIST,PORT1.0,@ESTOP \
                --trace %t.csv --events %e.jsonl --dump %d.json";
    assert_eq!(shop.run("p.pmi", args), 3);
    assert_eq!(
        shop.read("t.csv"),
        "tick,name,value\n0,N,0\n0,LAMP,0\n0,LIST,\"[7,0,0]\"\n0,PORT1.0,0\n0,@ESTOP,0\n\
         1,N,1\n1,LAMP,1\n1,LIST,\"[7,7,0]\"\n1,PORT1.0,1\n2,N,2\n2,LIST,\"[7,7,7]\"\n\
         3,N,3\n3,PORT1.0,0\n3,@ESTOP,1\n"
    );
    assert_eq!(
        shop.read("e.jsonl"),
        "{\"tick\":3,\"kind\":\"fault\",\"name\":\"HOT\",\"state\":\"on\",\"text\":\"TOO HOT 3\"}\n\
         {\"tick\":3,\"kind\":\"stop\",\"code\":\"NO PMI DATA\",\"file\":\"p.pmi\",\"line\":14}\n"
    );
    let dump = shop.read("d.json");
    let at = "does not exist (LIST has the elements 0 to 2); it was accessed in line 14 of p.pmi;";
    assert!(dump.contains(&format!("\"message\":\"LIST[3] {at}")), "{dump}");
    assert!(dump.contains("\",\"file\":\"p.pmi\",\"line\":14},\"variables\":{"), "{dump}");
    assert!(
        dump.starts_with(
            "{\"dialect\":\"pmi\",\"ticks\":4,\"state\":\"stopped\",\"stop\":{\"tick\":3,\
             \"code\":\"NO PMI DATA\",\"message\":\""
        ),
        "{dump}"
    );
    let variables = dump.split_once("\"variables\":").unwrap().1;
    assert!(variables.starts_with("{\"@ESTOP\":1,\"@NVINT\":[3,0,"), "{variables}");
    assert!(
        variables.ends_with(
            "\"FIVE\":5,\"GO\":1,\"HOT\":1,\"LAMP\":1,\"LIST\":[7,7,7],\"N\":3,\"PORT1.0\":0}}\n"
        ),
        "{variables}"
    );
}

/// An engine in which something panics: the host function `function` when it is called for the
/// `at`-th time (from 0), or without a function the engine itself at the end of that scan.
struct Panicking {
    engine: Box<dyn Engine>,
    function: Option<HostFn>,
    at: usize,
    count: usize,
}

struct PanickingHost<'a> {
    host: &'a mut dyn Host,
    function: HostFn,
    at: usize,
    count: &'a mut usize,
}

impl Host for PanickingHost<'_> {
    fn call(&mut self, image: &mut [u8], function: HostFn, args: [u64; 4]) -> u64 {
        if function == self.function {
            *self.count += 1;
            assert!(*self.count <= self.at, "a host that panics");
        }
        self.host.call(image, function, args)
    }
}

impl Engine for Panicking {
    fn call(&mut self, task: usize, from: Option<ResumePoint>, scan: &mut Scan<'_>) -> Outcome {
        let Some(function) = self.function else {
            let outcome = self.engine.call(task, from, scan);
            self.count += 1;
            assert!(self.count <= self.at, "an engine that panics");
            return outcome;
        };
        let count = &mut self.count;
        let mut host = PanickingHost { host: &mut *scan.host, function, at: self.at, count };
        self.engine.call(
            task,
            from,
            &mut Scan { image: &mut *scan.image, host: &mut host, limit: scan.limit },
        )
    }
}

/// Whatever engine runs: after a panic in a host function nothing of the scan's rest is done, the
/// physical outputs are not written from it, and the control stops with exit status 3.
#[test]
fn a_panic_stops_the_control() {
    let shop = Shop::new("panic");
    fs::write(shop.path("go.csv"), "tick,name,value\n0,GO,1\n").unwrap();
    let nct = ":001\nLF500 +1 SF500 SY00\nADD220\nLF500 SY02\nJ1\n:000\nJ0\n";
    fs::write(shop.path("n.nct"), nct).unwrap();
    let pmac = "I5=2\nOPEN PLC 1 CLEAR\nP1=P1+1\nSEND\"tick\"\nP2=P1\nCLOSE\nENABLE PLC 1\n";
    fs::write(shop.path("c.pmc"), pmac).unwrap();
    let cases = [
        (
            "p.pmi",
            None,
            "--stimulus %go.csv --watch N,LAMP,PORT1.0,@ESTOP",
            "0,N,1\n0,LAMP,1\n0,PORT1.0,1\n0,@ESTOP,0\n1,N,2\n2,N,3\n2,PORT1.0,0\n2,@ESTOP,1\n",
        ),
        (
            "n.nct",
            Some(HostFn::NctAdd),
            "--watch F500,Y00,Y02,O000,O020",
            "0,F500,1\n0,Y00,1\n0,Y02,1\n0,O000,1\n0,O020,1\n1,F500,2\n1,Y00,2\n1,Y02,2\n\
             1,O000,0\n1,O020,0\n2,F500,3\n2,Y00,3\n",
        ),
        (
            "c.pmc",
            Some(HostFn::PmacEvent),
            "--watch P1,P2",
            "0,P1,1\n0,P2,1\n1,P1,2\n1,P2,2\n2,P1,3\n",
        ),
    ];
    for (program, function, args, trace) in cases {
        let args = format!("{args} --ticks 9 --trace %t.csv --events %e.jsonl --dump %d.json");
        for way in EngineKind::ALL {
            let wrap = |engine| -> Box<dyn Engine> {
                Box::new(Panicking { engine, function, at: 2, count: 0 })
            };
            assert_eq!(shop.run_in(way, program, &args, wrap), 3, "{program} {way:?}");
            let written = shop.read("t.csv");
            assert_eq!(written, format!("tick,name,value\n{trace}"), "{program} {way:?}");
            let last = "{\"tick\":2,\"kind\":\"stop\",\"code\":\"INTERNAL ERROR\"}\n";
            assert!(shop.read("e.jsonl").ends_with(last), "{program} {way:?}");
            let dump = shop.read("d.json");
            let stop = "\"ticks\":3,\"state\":\"stopped\",\"stop\":{\"tick\":2,\"code\":\"INTERNAL \
                        ERROR\",\"message\":\"";
            assert!(dump.contains(stop), "{program} {way:?}: {dump}");
        }
    }
}

/// An engine whose scans end in a trap.
struct Trapping(TrapCode);

impl Engine for Trapping {
    fn call(&mut self, _: usize, _: Option<ResumePoint>, _: &mut Scan<'_>) -> Outcome {
        Outcome::trap(self.0)
    }
}

#[test]
fn a_trap_that_the_language_does_not_have_is_an_internal_error() {
    let shop = Shop::new("trap");
    fs::write(shop.path("n.nct"), ":001\nJ1\n:000\nJ0\n").unwrap();
    fs::write(shop.path("c.pmc"), "I5=2\nOPEN PLC 1 CLEAR\nP1=1\nCLOSE\nENABLE PLC 1\n").unwrap();
    for code in TrapCode::ALL.iter().copied() {
        let pmi = match code {
            TrapCode::ArrayBounds => "NO PMI DATA",
            TrapCode::Watchdog => "WATCHDOG",
            _ => "INTERNAL ERROR",
        };
        let pmac = if code == TrapCode::Watchdog { "WATCHDOG" } else { "INTERNAL ERROR" };
        let nct = match code {
            TrapCode::Timeout | TrapCode::Watchdog => "PLC TIMEOUT1",
            TrapCode::CallDepth => "CALL DEPTH",
            _ => "INTERNAL ERROR",
        };
        let stops = [("p.pmi", pmi), ("n.nct", nct), ("c.pmc", pmac)];
        for (program, stop) in stops {
            let wrap = |_| -> Box<dyn Engine> { Box::new(Trapping(code)) };
            let args = "--ticks 3 --events %e.jsonl";
            assert_eq!(
                shop.run_in(EngineKind::ALL[0], program, args, wrap),
                3,
                "{program} {code:?}"
            );
            let last = format!("{{\"tick\":0,\"kind\":\"stop\",\"code\":\"{stop}\"}}\n");
            let events = shop.read("e.jsonl");
            assert!(events.ends_with(&last), "{program} {code:?}: {events}");
        }
    }
}

#[test]
fn wrong_usage_gives_exit_status_2_and_changes_no_file() {
    let shop = Shop::new("usage");
    fs::write(shop.path("good.csv"), "tick,name,value\n0,GO,1\n").unwrap();
    fs::write(shop.path("bad.csv"), "tick,name,value\n0,GO,1\n0,FIVE,1\n").unwrap();
    fs::write(shop.path("kept.csv"), "precious").unwrap();
    for args in [
        "",
        "--dump %kept.csv",
        "--ticks 1 --stimulus %missing.csv --trace %kept.csv",
        "--ticks 1 --stimulus %bad.csv --trace %kept.csv",
        "--ticks 1 --watch NOPE --trace %kept.csv",
        "--ticks 1 --watch FIVE --trace %kept.csv",
        "--ticks 1 --watch N, --trace %kept.csv",
        "--ticks 1 --background-steps 2 --trace %kept.csv",
        "--ticks 1 --param 61=2 --trace %kept.csv",
        "--ticks 1 --stimulus %good.csv --trace %good.csv",
        "--ticks 1 --dump %p.pmi",
        "--ticks 1 --trace %a --events %a",
        "--ticks 1 --retain %a --dump %a.bak",
        "--ticks 1 --trace - --dump -",
        "--ticks 1 --dump %no/folder",
        "--ticks 1 --trace %no/folder",
        "--ticks 1 --retain %no/folder",
    ] {
        assert_eq!(shop.run("p.pmi", args), 2, "{args}");
    }
    assert_eq!(shop.read("kept.csv"), "precious");
    assert_eq!(shop.read("p.pmi"), PMI);
    assert_eq!(shop.read("good.csv"), "tick,name,value\n0,GO,1\n");
    assert_eq!(shop.run("n.nct", "--ticks 1 --period 20"), 2);
    assert_eq!(shop.run("c.pmc", "--ticks 1 --const 1=1"), 2);
}

#[test]
fn a_run_has_as_many_ticks_as_its_options_say() {
    let shop = Shop::new("time");
    for (program, args, ticks) in [
        ("p.pmi", "--for 1s", 50),
        ("p.pmi", "--for 50ms", 3),
        ("p.pmi", "--for 1s --period 2.5", 400),
        ("n.nct", "--for 2m", 6000),
        ("p.pmi", "--ticks 0", 0),
        ("c.pmc", "--ticks 7 --background-steps 3", 7),
    ] {
        assert_eq!(shop.run(program, &format!("{args} --dump %d.json")), 0, "{args}");
        assert!(shop.read("d.json").contains(&format!("\"ticks\":{ticks},")), "{args}");
    }
    assert_eq!(shop.run("c.pmc", "--ticks 7 --background-steps 3 --dump %d.json"), 0);
    assert!(shop.read("d.json").contains("\"P1\":10.5"));
}

/// A clock that stands still but for what is slept.
#[derive(Debug)]
struct SleptTime {
    start: Instant,
    slept: Cell<Duration>,
}

impl Clock for SleptTime {
    fn now(&self) -> Instant {
        self.start + self.slept.get()
    }

    fn sleep(&self, time: Duration) {
        self.slept.set(self.slept.get() + time);
    }
}

/// The record's checkpoints, every 30 s, are taken after a tick where there is time until the next one: else they would wait
/// for 7.5 s.
#[test]
fn in_real_time_checkpoints_are_taken_in_idle_time() {
    let shop = Shop::new("idle");
    let clock = SleptTime { start: Instant::now(), slept: Cell::default() };
    let args = "--realtime --period 1000 --ticks 70 --record %r";
    assert_eq!(shop.run_by_clock(&clock, "p.pmi", args), 0);
    let recording = Recording::open(&shop.path("r")).unwrap();
    let spans = &recording.last_run().unwrap().spans;
    assert_eq!(spans.iter().map(|span| span.first).collect::<Vec<_>>(), [0, 30, 60]);
}

#[test]
fn in_real_time_each_tick_waits_for_its_time() {
    let shop = Shop::new("clock");
    let clock = SleptTime { start: Instant::now(), slept: Cell::default() };
    let simulated = "--ticks 6 --dump %d.json";
    assert_eq!(shop.run_by_clock(&clock, "p.pmi", simulated), 0);
    assert_eq!(clock.slept.get(), Duration::ZERO);
    let real = "--ticks 6 --realtime --watchdog 1h --dump %d.json --retain %kept";
    assert_eq!(shop.run_by_clock(&clock, "p.pmi", real), 0);
    // The first tick begins at once; each of the other five waits for 20 ms.
    assert_eq!(clock.slept.get(), Duration::from_millis(100));
    assert!(shop.read("d.json").contains("\"ticks\":6,"));
    assert!(shop.path("kept").is_file());
}

/// An engine whose scan number `at` (from 0) takes 90 ms on the clock.
struct Slow {
    engine: Box<dyn Engine>,
    clock: Rc<SleptTime>,
    at: usize,
    scans: usize,
}

impl Engine for Slow {
    fn call(&mut self, task: usize, from: Option<ResumePoint>, scan: &mut Scan<'_>) -> Outcome {
        if self.scans == self.at {
            self.clock.sleep(Duration::from_millis(90));
        }
        self.scans += 1;
        self.engine.call(task, from, scan)
    }
}

/// A scan that takes longer than its period costs ticks, but no time: timers, tick numbers and the
/// stimulus are where they would be without it.
#[test]
fn skipped_ticks_move_what_time_moves() {
    let shop = Shop::new("overrun");
    let pmi = "$TIMER\nE/GO/GONE = 40\n$END\nGO = T\n";
    fs::write(shop.path("p.pmi"), pmi).unwrap();
    fs::write(shop.path("n.nct"), ":001\nJ1\n:000\nJ0\n").unwrap();
    fs::write(shop.path("c.pmc"), "I5=2\nI10=83886080\nOPEN PLC 1 CLEAR\nP1=1\nCLOSE\n").unwrap();
    for (program, rows, watch, scans) in [
        ("p.pmi", "1,GO#COUNT,30\n4,GO#COUNT,20\n", "GO#COUNT,GONE", 1),
        ("n.nct", "1,T00,100\n1,H00,7\n47,T01,9\n", "T00,T01,H00,M0", 2),
        ("c.pmc", "1,X:$0700,1000\n4,P3,4\n", "X:$0,X:$0700,Y:$0700,P3", 1),
    ] {
        fs::write(shop.path("s.csv"), format!("tick,name,value\n{rows}")).unwrap();
        let args = format!(
            "--ticks 52 --realtime --watchdog 1h --stimulus %s.csv --watch {watch} --dump %d.json"
        );
        let run = |at, more: &str| {
            let clock = Rc::new(SleptTime { start: Instant::now(), slept: Cell::default() });
            let wrap = |engine| -> Box<dyn Engine> {
                Box::new(Slow { engine, clock: Rc::clone(&clock), at, scans: 0 })
            };
            let args = format!("{args} {more}");
            let status =
                shop.run_in_by_clock(EngineKind::Statements, clock.as_ref(), program, &args, wrap);
            (status, shop.read("d.json"))
        };
        let punctual = run(usize::MAX, "");
        for at in [2, 45] {
            assert_eq!(run(at * scans, ""), punctual, "{program} {at}");
            assert_eq!(run(at * scans, "--overrun catch-up=1"), punctual, "{program} {at}");
        }
        let (status, dump) = run(10 * scans, "--overrun stop");
        assert_eq!(status, 3, "{program}");
        let stop = "\"ticks\":12,\"state\":\"stopped\",\"stop\":{\"tick\":11,\"code\":\"OVERRUN\",";
        assert!(dump.contains(stop), "{dump}");
    }
}

#[test]
fn retained_data_goes_from_run_to_run_and_damaged_files_are_not_used() {
    let shop = Shop::new("kept");
    let run = || shop.run("n.nct", "--ticks 5 --retain %kept --watch F500 --dump %d.json");
    let holds = |value: u16| assert!(shop.read("d.json").contains(&format!("\"F500\":{value}")));
    assert_eq!(run(), 0);
    holds(5);
    assert_eq!(run(), 0);
    holds(10);
    fs::write(shop.path("kept"), "damaged").unwrap();
    assert_eq!(run(), 0);
    holds(15);
    for file in ["kept", "kept.bak"] {
        fs::write(shop.path(file), "damaged").unwrap();
    }
    assert_eq!(run(), 2);
    assert_eq!(shop.read("kept"), "damaged", "left for who repairs it");
    fs::remove_file(shop.path("kept")).unwrap();
    fs::remove_file(shop.path("kept.bak")).unwrap();
    assert_eq!(shop.run("p.pmi", "--ticks 1 --retain %kept"), 0);
    assert_eq!(run(), 2, "it is PMI's");
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_gives_exit_status_2() {
    if !Path::new("/dev/full").exists() {
        return;
    }
    let shop = Shop::new("full");
    for output in ["trace", "events", "dump"] {
        let args = format!("--ticks 20000 --watch P1 --{output} /dev/full");
        assert_eq!(shop.run("c.pmc", &args), 2, "{output}");
    }
}

/// The rows are sorted backwards. A reader whose time grew with the square of their number would
/// not come to an end here.
#[test]
fn a_stimulus_may_have_a_million_rows() {
    let shop = Shop::new("million");
    let rows: String = (0..1_000_000).rev().map(|tick| format!("{tick},GO,0\n")).collect();
    fs::write(shop.path("go.csv"), format!("tick,name,value\n{rows}")).unwrap();
    assert_eq!(shop.run("p.pmi", "--ticks 10 --stimulus %go.csv"), 0);
}
