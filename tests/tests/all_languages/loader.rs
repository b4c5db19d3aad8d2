//! Runs `plcrt`, the loader, as a process: artifacts that it runs and refuses, Ctrl-C, closed pipes.
#![cfg(unix)]
#![allow(clippy::unwrap_used, clippy::panic)]

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use plcc::compile;
use plcc::disk::Disk;
use plcc_abi::Dialect;
use plcc_codegen::{OptLevel, Target};
use plcc_diag::SourceMap;
use plcc_frontend::common::Options;
use plcc_tests::loader::plcrt;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap()
}

/// A folder with the lathe's artifact, which goes away with the test.
struct Shop(PathBuf);

impl Shop {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("plcrt-{name}-{}", std::process::id()));
        fs::create_dir_all(&path).unwrap();
        let shop = Self(path);
        let source = root().join("examples/pmi/lathe.pmi");
        let mut sources = SourceMap::new();
        let file = sources.add("lathe.pmi", &fs::read(source).unwrap());
        let options = Options::default();
        let (checked, _) = compile::check(&mut sources, &[file], Dialect::Pmi, &Disk, &options);
        let lowered = checked.unwrap().optimized(OptLevel::Speed).unwrap();
        let target = Target::host_baseline().unwrap();
        let code = compile::code(&lowered, &target).unwrap();
        let bytes = compile::artifact(&lowered.program, &code).unwrap();
        fs::write(shop.path("lathe.plcx"), bytes).unwrap();
        shop
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    fn spawn(&self, args: &[&str]) -> Child {
        let mut command = plcrt();
        command.args(args).current_dir(&self.0).stdout(Stdio::piped()).stderr(Stdio::piped());
        command.spawn().unwrap()
    }

    fn run(&self, args: &[&str]) -> Output {
        self.spawn(args).wait_with_output().unwrap()
    }
}

impl Drop for Shop {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

#[test]
fn an_artifact_does_what_its_scenario_expects() {
    let shop = Shop::new("scenario");
    let mut seen = 0;
    for scenario in fs::read_dir(root().join("examples/pmi/lathe")).unwrap() {
        let scenario = scenario.unwrap().path();
        let Ok(args) = fs::read_to_string(scenario.join("args")) else { continue };
        let stimulus = scenario.join("stimulus.csv");
        let mut words = vec!["lathe.plcx", "--trace", "-"];
        words.extend(args.split_whitespace());
        if stimulus.exists() {
            words.extend(["--stimulus", stimulus.to_str().unwrap()]);
        }
        let output = shop.run(&words);
        assert_eq!(output.status.code(), Some(0), "{output:?}");
        let expected = fs::read_to_string(scenario.join("expected.csv")).unwrap();
        assert_eq!(String::from_utf8(output.stdout).unwrap(), expected, "{}", scenario.display());
        seen += 1;
    }
    assert!(seen > 0);
}

#[test]
fn an_artifact_says_what_it_holds() {
    let shop = Shop::new("info");
    let output = shop.run(&["--info", "lathe.plcx"]);
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let text = String::from_utf8(output.stdout).unwrap();
    for line in [
        "language: pmi",
        "sources: lathe.pmi",
        &format!("architecture: {}", std::env::consts::ARCH),
        "runs on this machine: yes",
        "entry points: scan",
    ] {
        assert!(text.lines().any(|l| l == line), "{line} is not in\n{text}");
    }
}

#[test]
fn a_damaged_artifact_is_refused() {
    let shop = Shop::new("damaged");
    let whole = fs::read(shop.path("lathe.plcx")).unwrap();
    let mut flipped = whole.clone();
    let middle = flipped.len() / 2;
    flipped[middle] ^= 1;
    let source = fs::read(root().join("examples/pmi/lathe.pmi")).unwrap();
    for (bytes, word) in [
        (&flipped[..], "corrupt"),
        (&whole[..middle], "truncated"),
        (&source, "not an artifact of plcc"),
        (&[], "not an artifact of plcc"),
    ] {
        fs::write(shop.path("bad.plcx"), bytes).unwrap();
        let output = shop.run(&["bad.plcx", "--ticks", "1", "--dump", "-"]);
        let message = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{message}");
        assert!(message.starts_with("error: bad.plcx: ") && message.contains(word), "{message}");
        assert!(output.stdout.is_empty());
    }
}

#[test]
fn the_artifact_is_not_overwritten() {
    let shop = Shop::new("overwritten");
    let whole = fs::read(shop.path("lathe.plcx")).unwrap();
    for option in ["--dump", "--retain"] {
        let output = shop.run(&["lathe.plcx", "--ticks", "1", option, "./lathe.plcx"]);
        assert_eq!(output.status.code(), Some(2), "{option}");
        assert_eq!(fs::read(shop.path("lathe.plcx")).unwrap(), whole, "{option}");
    }
}

/// Ctrl-C, in real time and in simulated time.
#[test]
fn ctrl_c_ends_a_run_with_its_outputs_complete() {
    for pace in [&["--realtime", "--watchdog", "1h"][..], &["--ticks", "100000000000"]] {
        let shop = Shop::new(if pace.len() == 1 { "clock" } else { "fast" });
        // Something changes in every tick, so that the trace grows.
        fs::write(shop.path("s.csv"), "tick,name,value\n0,@FRO,1\n1,@FRO,2\n").unwrap();
        let args =
            "lathe.plcx --stimulus s.csv --repeat --watch @IPL,@FRO --trace t.csv --dump d.json";
        let mut args: Vec<&str> = args.split(' ').collect();
        args.extend(pace);
        let child = shop.spawn(&args);
        // The process handles Ctrl-C once it has written a part of its trace. The limit ends a test in
        // which it never writes.
        let start = Instant::now();
        let rows = || fs::read_to_string(shop.path("t.csv")).unwrap_or_default().lines().count();
        while rows() < 6 {
            assert!(start.elapsed() < Duration::from_secs(300), "it writes no trace");
            std::thread::sleep(Duration::from_millis(10));
        }
        let id = child.id().to_string();
        assert!(Command::new("kill").args(["-INT", &id]).status().unwrap().success());
        let output = child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(130), "{output:?}");
        let trace = fs::read_to_string(shop.path("t.csv")).unwrap();
        let begin = "tick,name,value\n0,@IPL,1\n0,@FRO,100\n1,@IPL,0\n1,@FRO,2\n2,@FRO,1\n";
        assert!(trace.starts_with(begin), "{}", trace.lines().take(9).collect::<String>());
        let dump = fs::read_to_string(shop.path("d.json")).unwrap();
        assert!(dump.contains("\"state\":\"running\",\"stop\":null,"), "{dump}");
        assert!(dump.ends_with("}}\n"), "{dump}");
    }
}

/// SIGTERM switches the physical outputs off, or to their safe values; the variables stay.
#[test]
fn a_signal_makes_the_outputs_safe() {
    let shop = Shop::new("safe");
    fs::write(shop.path("s.csv"), "tick,name,value\n0,PORT2.0,1\n0,PORT2.1,1\n").unwrap();
    let args = "lathe.plcx --realtime --watchdog 1h --stimulus s.csv --repeat --watch PORT2.0,PORT2.1,PORT2.7 \
                --safe PORT2.7=1 --safe BEEPER=hold --trace t.csv --dump d.json";
    let child = shop.spawn(&args.split_whitespace().collect::<Vec<&str>>());
    let start = Instant::now();
    while fs::read_to_string(shop.path("t.csv")).unwrap_or_default().lines().count() < 4 {
        assert!(start.elapsed() < Duration::from_secs(300), "it writes no trace");
        std::thread::sleep(Duration::from_millis(10));
    }
    let id = child.id().to_string();
    assert!(Command::new("kill").args(["-TERM", &id]).status().unwrap().success());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130), "{output:?}");
    let dump = fs::read_to_string(shop.path("d.json")).unwrap();
    assert!(dump.contains("\"PORT2.7\":1"), "{dump}");
    assert!(dump.contains("\"PORT2.0\":0"), "{dump}");
}

#[test]
fn a_closed_pipe_ends_the_run_without_a_message() {
    let shop = Shop::new("pipe");
    fs::write(shop.path("s.csv"), "tick,name,value\n0,@FRO,1\n1,@FRO,2\n").unwrap();
    let mut child = shop.spawn(&[
        "lathe.plcx",
        "--ticks",
        "1000000",
        "--stimulus",
        "s.csv",
        "--repeat",
        "--watch",
        "@FRO",
        "--trace",
        "-",
    ]);
    let mut line = String::new();
    let mut reader = BufReader::new(child.stdout.take().unwrap());
    reader.read_line(&mut line).unwrap();
    drop(reader);
    let output = child.wait_with_output().unwrap();
    let message = String::from_utf8(output.stderr).unwrap();
    assert_eq!((output.status.code(), message.as_str()), (Some(0), ""));
}

#[test]
fn with_a_key_unsigned_artifacts_are_refused() {
    let shop = Shop::new("key");
    // The public key whose private key is 32 bytes of 1.
    let key = "-----BEGIN PUBLIC KEY-----\n\
               MCowBQYDK2VwAyEAiojj3XQJ8ZX9UtstPLpdcspnCb8dlBIb83SIAbQPb1w=\n\
               -----END PUBLIC KEY-----\n";
    fs::write(shop.path("owner.pub"), key).unwrap();
    let key = shop.path("owner.pub");
    let artifact = shop.path("lathe.plcx");
    for more in [&["--ticks", "1"][..], &["--info"]] {
        let output = plcrt().arg(&artifact).arg("--key").arg(&key).args(more).output().unwrap();
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{message}");
        assert!(message.contains("is not signed"), "{message}");
        assert!(output.stdout.is_empty());
    }
    let output = plcrt().arg(&artifact).arg("--info").output().unwrap();
    let info = String::from_utf8_lossy(&output.stdout);
    assert!(info.contains("\nsignature: none\n") && info.contains("\ndigest: "), "{info}");
}
