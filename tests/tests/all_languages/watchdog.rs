//! The watchdog (`--watchdog`): a scan that takes too long stops the program, in every language and
//! engine.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::fs;
use std::sync::atomic::{AtomicU64, Ordering};

use clap::Parser;
use plcc_abi::{Dialect, Engine, Host, HostFn, Outcome, ResumePoint, Scan, TimeLimit};
use plcc_frontend::common::{Limits, Options};
use plcc_frontend::detect::{Ending, ending};
use plcc_host::args::RunArgs;
use plcc_host::session;
use plcc_tests::compile::{EngineKind, compile};
use plcc_tests::loader::Folder;

#[derive(Parser)]
struct Args {
    #[command(flatten)]
    run: RunArgs,
}

/// Runs a source with options and gives the exit status, the trace, the stop's code and its message.
/// `wrap` puts something around the engine.
fn run(
    file: &str,
    source: &str,
    way: EngineKind,
    args: &str,
    wrap: impl FnOnce(Box<dyn Engine>) -> Box<dyn Engine>,
) -> (u8, String, String, String) {
    let name = format!("plcc-watchdog-{}-{:?}", std::process::id(), std::thread::current().id());
    let folder = std::env::temp_dir().join(name);
    fs::create_dir_all(&folder).unwrap();
    let path = folder.join(file);
    fs::write(&path, source).unwrap();
    let Ending::Of(dialect) = ending(&path) else { panic!("{file} shows no language") };
    let options = Options { limits: Limits::None, ..Options::default() };
    let compiled = compile(&path, dialect, &options).unwrap_or_else(|e| panic!("{e}"));
    let (program, engine) = compiled.engine(way).unwrap();
    let (trace, dump) = (folder.join("t.csv"), folder.join("d.json"));
    let paths = [&trace, &dump].map(|path| path.to_str().unwrap().to_owned());
    let words = ["run", "--trace", &paths[0], "--dump", &paths[1]].map(str::to_owned).into_iter();
    let words = words.chain(args.split_whitespace().map(str::to_owned));
    let args = Args::try_parse_from(words).unwrap_or_else(|e| panic!("{e}"));
    let status = session::run(&program, &mut wrap(engine), &args.run, None);
    let trace = fs::read_to_string(&trace).unwrap_or_default();
    let dump = fs::read_to_string(&dump).unwrap_or_default();
    let _ = fs::remove_dir_all(&folder);
    let text = |key: &str| {
        let (_, rest) = dump.split_once(&format!("\"{key}\":\"")).unwrap_or_default();
        rest.split('"').next().unwrap_or_default().to_owned()
    };
    (status, trace, text("code"), text("message"))
}

/// An engine whose host makes the scan late in its call with this number (from 1).
pub(crate) struct LateAt {
    engine: Box<dyn Engine>,
    at: u64,
    calls: u64,
    epoch: AtomicU64,
}

impl LateAt {
    pub(crate) fn new(engine: Box<dyn Engine>, at: u64) -> Self {
        Self { engine, at, calls: 0, epoch: AtomicU64::new(0) }
    }
}

struct LateHost<'a> {
    host: &'a mut dyn Host,
    at: u64,
    calls: &'a mut u64,
    epoch: &'a AtomicU64,
}

impl Host for LateHost<'_> {
    fn call(&mut self, image: &mut [u8], function: HostFn, args: [u64; 4]) -> u64 {
        *self.calls += 1;
        if *self.calls == self.at {
            self.epoch.store(1, Ordering::Relaxed);
        }
        self.host.call(image, function, args)
    }
}

impl Engine for LateAt {
    fn call(&mut self, task: usize, from: Option<ResumePoint>, scan: &mut Scan<'_>) -> Outcome {
        let epoch = &self.epoch;
        let host = &mut *scan.host;
        let mut host = LateHost { host, at: self.at, calls: &mut self.calls, epoch };
        let limit = TimeLimit { epoch, limit: 1 };
        self.engine.call(task, from, &mut Scan { image: &mut *scan.image, host: &mut host, limit })
    }
}

/// All engines leave the scan after the same host function, with the same variables, and name its line.
#[test]
fn a_late_scan_ends_alike_in_every_engine() {
    let nct = ":001\nLF500 +1 SF500\nADD220\nLF500 SF510\nADD220\nLF500 SF520\nJ1\n:000\nJ0\n";
    let pmac = "I5=2\nOPEN PLC 3 CLEAR\nP1=P1+1\nSEND\"a\"\nP2=P1\nSEND\"b\"\nP3=P1\nCLOSE\n";
    for (file, source, at, watch, code, parts, trace) in [
        (
            "a.nct",
            nct,
            3,
            "F500,F510,F520",
            "PLC TIMEOUT1",
            ["module :001", "in line 3 of"],
            "0,F500,1\n0,F510,1\n0,F520,1\n1,F500,2\n",
        ),
        (
            "a.pmc",
            pmac,
            4,
            "P1,P2,P3",
            "WATCHDOG",
            ["PLC 3 took longer", "in line 6 of"],
            "0,P1,1\n0,P2,1\n0,P3,1\n1,P1,2\n1,P2,2\n",
        ),
    ] {
        for way in EngineKind::ALL {
            let wrap = |engine| -> Box<dyn Engine> { Box::new(LateAt::new(engine, at)) };
            let args = format!("--ticks 9 --watch {watch}");
            let (status, rows, stop, message) = run(file, source, way, &args, wrap);
            assert_eq!((status, stop.as_str()), (3, code), "{file} {way:?}");
            assert!(parts.iter().all(|part| message.contains(part)), "{file} {way:?}: {message}");
            assert_eq!(rows, format!("tick,name,value\n{trace}"), "{file} {way:?}");
        }
    }
}

/// A long straight program has no jump at which it could be stopped; its chunks are left at their end. The
/// stop names the line there.
/// Whether a certain scan is late depends on the computer, so the run has as many as it takes.
#[test]
fn a_straight_scan_is_stopped_between_two_chunks() {
    let lines = 6000;
    let pmi = format!("$LOGICAL\nA,B\n$END\n{}", "A = A & B ! /A\nB = /B ! A\n".repeat(lines));
    let nct =
        format!(":001\n{}J1\n:000\nJ0\n", "LF500 +1 SF500 LF501 *LF500 SF502\n".repeat(lines));
    let pmac = format!("I5=2\nOPEN PLC 7 CLEAR\n{}CLOSE\n", "P1=P1*P2+3 P2=P2/P1\n".repeat(lines));
    for (file, source, code, part) in [
        ("a.pmi", &pmi, "WATCHDOG", "the scan took longer"),
        ("a.nct", &nct, "PLC TIMEOUT1", "module :001"),
        ("a.pmc", &pmac, "WATCHDOG", "PLC 7 took longer"),
    ] {
        for way in [
            EngineKind::Statements,
            EngineKind::IrSpeed,
            EngineKind::JitSpeed,
            EngineKind::Artifact,
        ] {
            let args = "--ticks 100000000 --watchdog 1us --watch *";
            let args = if file == "a.pmi" { args } else { "--ticks 100000000 --watchdog 1us" };
            // If the time is over in the last chunk, the scan has ended when that is noticed, and no line is
            // named. Such a run is made again.
            let line = (0..100).find_map(|_| {
                let (status, _, stop, message) = run(file, source, way, args, |engine| engine);
                assert_eq!((status, stop.as_str()), (3, code), "{file} {way:?}");
                assert!(message.contains(part), "{file} {way:?}: {message}");
                let (_, rest) = message.split_once("it was stopped in line ")?;
                Some(rest.split(' ').next().unwrap().parse::<usize>().unwrap())
            });
            let line = line.unwrap();
            let lines = source.lines().count();
            assert!((2..=lines).contains(&line), "{file} {way:?}: line {line}");
        }
    }
}

/// A loop without end: NCT's own limit, and the watchdog in simulated time.
#[test]
fn endless_modules_of_nct_are_stopped() {
    let source = ":001\n:010\nLF500 +1 SF500\nG010\nJ1\n:000\nJ0\n";
    for way in
        [EngineKind::Statements, EngineKind::IrSpeed, EngineKind::JitSpeed, EngineKind::Artifact]
    {
        let (status, _, code, message) =
            run("a.nct", source, way, "--realtime --ticks 5", |engine| engine);
        assert_eq!((status, code.as_str()), (3, "PLC TIMEOUT1"), "{way:?}");
        assert!(message.contains("within its time"), "{way:?}: {message}");
    }
    // By its safepoints, as without a watchdog, if the watchdog allows them.
    for args in ["--ticks 5", "--ticks 5 --watchdog 1h", "--ticks 5 --watchdog off"] {
        let (status, _, code, message) =
            run("a.nct", source, EngineKind::JitSpeed, args, |engine| engine);
        assert_eq!((status, code.as_str()), (3, "PLC TIMEOUT1"), "{args}");
        assert!(message.contains("1000000 backward jumps"), "{args}: {message}");
    }
    // :000 that never ends is suspended at the end of each slice's share of the time.
    let source = ":001\nLF500 +1 SF500\nJ1\n:000\n:010\nLF502 +1 SF502\nG010\nJ0\n";
    let args = "--realtime --ticks 3 --watch F500";
    let (status, trace, ..) = run("a.nct", source, EngineKind::JitSpeed, args, |engine| engine);
    assert_eq!((status, trace.as_str()), (0, "tick,name,value\n0,F500,1\n1,F500,2\n2,F500,3\n"));
}

/// With a limit that no scan reaches everything is as without one.
#[test]
fn a_watchdog_that_stops_no_scan_changes_nothing() {
    let source = ":001\nLF500 +1 SF500 SY00\nC010\nJ1\n:010 LF502 +1 SF502 R\n:000\n:011\nLF504 +1 \
                  SF504\nG011\nJ0\n";
    let args = "--ticks 20 --watch F500,F502,F504,Y00";
    for way in EngineKind::ALL {
        let plain = run("a.nct", source, way, args, |engine| engine);
        let watched = run("a.nct", source, way, &format!("{args} --watchdog 1h"), |engine| engine);
        assert_eq!(plain, watched, "{way:?}");
        assert_eq!(plain.0, 0);
    }
}

/// `plcrt` as a process: the exit status, the dump, and the physical outputs, which are off while the
/// variables keep their values.
#[test]
fn a_controller_that_is_stopped_has_its_outputs_off() {
    let folder = Folder::new("watchdog");
    let endless = ":001\nLF500 +1 SF500 SY000\n:010\nLF502 +1 SF502\nG010\nJ1\n:000\nJ0\n";
    folder.artifact("n.plcx", Dialect::Nct, endless);
    let straight = "A = A & B ! /A\nB = /B ! A\n".repeat(4000);
    let straight = format!("$OUTPUT\nLAMP = 1/0\n$LOGICAL\nA,B\n$END\nLAMP = T\n{straight}");
    folder.artifact("p.plcx", Dialect::Pmi, &straight);
    for (args, code, variables) in [
        ("n.plcx --watch Y000,O000", "PLC TIMEOUT1", ["\"O000\":0", "\"Y000\":1"]),
        (
            "p.plcx --watchdog 1us --period 1 --watch PORT1.0",
            "WATCHDOG",
            ["\"LAMP\":1", "\"PORT1.0\":0"],
        ),
    ] {
        let args = format!("{args} --realtime --ticks 1000000 --trace t.csv --dump d.json");
        let output = folder.run(&args.split(' ').collect::<Vec<&str>>());
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(3), "{message}");
        assert!(message.contains(code), "{message}");
        let dump = folder.read("d.json");
        assert!(dump.contains(&format!("\"code\":\"{code}\"")), "{dump}");
        assert!(dump.contains("\"file\":") && dump.contains("\"line\":"), "{dump}");
        for variable in variables {
            assert!(dump.contains(variable), "{variable} is not in {dump}");
        }
    }
}
