//! The examples in C and Python are built against the library, and run. They are skipped, with a word,
//! where there is no C compiler or no Python.
#![allow(clippy::unwrap_used, clippy::panic)]

#[path = "../../tests/src/tools.rs"]
mod tools;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use plcc::compile::{artifact, check, code};
use plcc::disk::Disk;
use plcc_abi::Dialect;
use plcc_codegen::{OptLevel, Target};
use plcc_diag::SourceMap;
use plcc_frontend::common::Options;
use plcrt::Control;
use tools::is_there;

/// The artifact of a PMI program.
fn compile(name: &str, source: &[u8]) -> Vec<u8> {
    let mut sources = SourceMap::new();
    let file = sources.add(name, source);
    let (checked, _) = check(&mut sources, &[file], Dialect::Pmi, &Disk, &Options::default());
    let lowered = checked.unwrap().optimized(OptLevel::Speed).unwrap();
    let code = code(&lowered, &Target::host_baseline().unwrap()).unwrap();
    artifact(&lowered.program, &code).unwrap()
}

fn here() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn lathe() -> Vec<u8> {
    let source = fs::read(here().join("../examples/pmi/lathe.pmi")).unwrap();
    compile("lathe.pmi", &source)
}

/// A folder with an artifact, which goes away with the test.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str, artifact: &[u8]) -> Self {
        let path = std::env::temp_dir().join(format!("libplcrt-{name}-{}", std::process::id()));
        fs::create_dir_all(&path).unwrap();
        fs::write(path.join("lathe.plcx"), artifact).unwrap();
        Self(path)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// The folder in which cargo leaves the library: that of the test's own program, or the one above it.
fn library() -> PathBuf {
    let own = std::env::current_exe().unwrap();
    let folders = own.ancestors().skip(1).take(2);
    let found = folders.map(|folder| folder.join("libplcrt.so")).find(|file| file.is_file());
    found.unwrap_or_else(|| panic!("libplcrt.so is not beside {}", own.display()))
}

fn run(command: &mut Command) -> String {
    let output = command.output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    let errors = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{:?}\n{text}\n{errors}", output.status);
    assert_eq!(errors, "");
    text
}

/// What the C example prints when the machine goes on, by the control in Rust.
fn expected() -> Vec<String> {
    let mut control = Control::load(&lathe(), "").unwrap();
    let on = control.find("MCHON").unwrap();
    let actions = [
        (0, "@ESTOP", "1"),
        (5, "MCRDY", "1"),
        (10, "@CP115", "1"),
        (14, "@ESTOP", "0"),
        (30, "@CP115", "0"),
    ];
    let mut lines = vec![];
    let mut before = String::new();
    for tick in 0..100 {
        for (_, name, value) in actions.iter().filter(|action| action.0 == tick) {
            control.set(name, value).unwrap();
        }
        assert!(control.tick());
        let now = control.get(on).to_string();
        if now != before {
            lines.push(format!("tick {tick}: MCHON is {now}\n"));
        }
        before = now;
    }
    assert_eq!(lines.len(), 2, "{lines:?}");
    lines
}

#[test]
fn the_c_example_runs_with_the_shared_library_and_with_the_static_one() {
    if !is_there("cc") {
        return;
    }
    let folder = Folder::new("c", &lathe());
    let library = library();
    let place = library.parent().unwrap();
    let archive = place.join("libplcrt.a");
    let compile = |name: &str, with: &[&std::ffi::OsStr]| {
        let mut command = Command::new("cc");
        command.args(["-std=c99", "-Wall", "-Wextra", "-Werror", "-I"]).arg(here().join("include"));
        command.arg(here().join("examples/lathe.c")).args(with);
        command.args(["-lpthread", "-ldl", "-lm", "-o", name]).current_dir(&folder.0);
        assert_eq!(run(&mut command), "");
    };
    compile("shared", &["-L".as_ref(), place.as_ref(), "-lplcrt".as_ref()]);
    compile("static", &[archive.as_ref()]);
    let outputs = ["shared", "static"].map(|name| {
        let mut command = Command::new(folder.0.join(name));
        run(command.arg("lathe.plcx").env("LD_LIBRARY_PATH", place).current_dir(&folder.0))
    });
    let [shared, linked] = outputs;
    assert_eq!(shared, linked);
    for line in expected() {
        assert!(shared.contains(&line), "{line} in\n{shared}");
    }
    assert!(shared.contains("running after 100 ticks of 20 ms"), "{shared}");
    assert!(shared.contains("@NVINT[3] is 99\n"), "{shared}");
    let missing = Command::new(folder.0.join("static")).arg("none.plcx").output().unwrap();
    assert_eq!(missing.status.code(), Some(2));
    let errors = String::from_utf8(missing.stderr).unwrap();
    assert!(errors.starts_with("the program can't be loaded: ") && errors.contains("none.plcx"));
}

#[test]
fn the_python_example_runs() {
    if !is_there("python3") {
        return;
    }
    let folder = Folder::new("python", &lathe());
    let mut command = Command::new("python3");
    command.arg(here().join("examples/lathe.py")).arg(library()).arg("lathe.plcx");
    let text = run(command.current_dir(&folder.0));
    assert!(text.contains("running after 100 ticks, @NVINT[3] is 7.0\n"), "{text}");
    assert!(text.contains("@NVINT[3] was retained: 7.0\n"), "{text}");
    assert!(text.contains("no variable named `NOBODY`"), "{text}");
}

#[test]
fn a_stop_is_told_with_its_place() {
    let source = b"$INTEGER\nA[5],I\n$END\nI=I+1\nA[I]=1\n";
    let mut control = Control::load(&compile("a.pmi", source), "").unwrap();
    assert_eq!((0..4).map(|_| control.tick()).collect::<Vec<_>>(), [true; 4]);
    assert!(!control.tick());
    assert!(!control.tick());
    assert_eq!(control.ticks(), 5);
    let place = control.stop().unwrap().place.clone().unwrap();
    assert_eq!((place.file.as_str(), place.line), ("a.pmi", 5));
    let event = control.next_event().unwrap();
    assert_eq!(
        event,
        "{\"tick\":4,\"kind\":\"stop\",\"code\":\"NO PMI DATA\",\"file\":\"a.pmi\",\"line\":5}"
    );
    assert_eq!(control.next_event(), None);
    let dump = control.dump().unwrap();
    assert!(dump.contains("\"state\":\"stopped\"") && dump.contains("A[5]"), "{dump}");
    assert!(control.restore(&[]).is_err());
}

#[test]
fn what_is_wrong_is_said() {
    let artifact = lathe();
    for (bytes, options, part) in [
        (&artifact[..artifact.len() / 2], "", "truncated"),
        (&b"text"[..], "", "artifact"),
        (&artifact[..], "--period", "--period"),
        (&artifact[..], "--nonsense 1", "--nonsense"),
        (&artifact[..], "--background-steps 2", "pmac"),
    ] {
        let error = Control::load(bytes, options).err().unwrap();
        assert!(error.contains(part), "{options}: {error}");
    }
    let mut control = Control::load(&artifact, "--period 10").unwrap();
    assert_eq!((control.tick_ns(), control.dialect()), (10_000_000, "pmi"));
    for (name, value, part) in
        [("NOBODY", "1", "NOBODY"), ("MCHON", "0.5", "integer"), ("@NVINT", "1", "@NVINT")]
    {
        let error = control.set(name, value).unwrap_err();
        assert!(error.contains(part), "{error}");
    }
}
