//! `--gdb`: gdb stops at lines of the source in code that `plcrt` has loaded or `plcc run` has compiled, prints
//! variables there and goes on by lines. Skipped, with a word, where there is no gdb or it may not run
//! programs.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, clippy::panic)]

mod support;
#[path = "../../tests/src/tools.rs"]
mod tools;

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use support::{Folder, programs};

const LIFT: &str = "\
$OUTPUT
UP = 1/0
$INTEGER
N
$END
N = N + 1
UP = N > 2
IF (UP)
 N = 40
ENDIF
";

/// Runs gdb on a command in a folder, with gdb's own commands, and gives what it prints; `None` where there
/// is no gdb that can do so.
fn gdb(folder: &Path, commands: &[&str], program: &Path, args: &[&str]) -> Option<String> {
    let mut command = Command::new("gdb");
    command.args(["-nx", "-batch", "-ex", "set debuginfod enabled off"]);
    command.args(["-ex", "set breakpoint pending on", "-ex", "set max-value-size unlimited"]);
    for line in commands {
        command.args(["-ex", line]);
    }
    command.arg("--args").arg(program).args(args).current_dir(folder).stdin(Stdio::null());
    if !tools::is_there("gdb") {
        return None;
    }
    let output = command.output().unwrap();
    let errors = String::from_utf8_lossy(&output.stderr);
    if errors.contains("not permitted") {
        tools::missing("gdb", &format!("may not run programs here: {errors}"));
        return None;
    }
    Some(format!("{}\n{errors}", String::from_utf8_lossy(&output.stdout)))
}

/// Whether the texts stand in a text in this order.
fn in_order(text: &str, parts: &[&str]) {
    let mut rest = text;
    for part in parts {
        match rest.split_once(part) {
            Some((_, behind)) => rest = behind,
            None => panic!("no `{part}`, or not in this order, in\n{text}"),
        }
    }
}

/// Stops in line 7 in the third scan, looks at the program's variables, and goes on by lines. The code is not
/// optimised: else a variable may get its value some statements later.
const SESSION: [&str; 11] = [
    "break lift.pmi:7",
    "run",
    "continue",
    "continue",
    "backtrace 1",
    "print ((struct plcc_image *)context->image)->N",
    "print ((struct plcc_image *)context->image)->UP",
    "next",
    "print context->image->UP",
    "next",
    "continue",
];

fn is_right(text: &str) {
    in_order(
        text,
        &[
            "Breakpoint 1, ",
            "lift.pmi:7\n7\tUP = N > 2",
            "Breakpoint 1, ",
            "Breakpoint 1, ",
            "#0  ",
            "lift.pmi:7\n",
            "$1 = 3",
            "$2 = false",
            "$3 = true",
            "9\t N = 40",
            "exited normally",
        ],
    );
}

/// The loader stripped as the Debian package has it: without symbols but the two that gdb looks for.
fn stripped_loader(folder: &Folder) -> PathBuf {
    let loader = folder.path().join("plcrt");
    std::fs::copy(programs().join("plcrt"), &loader).unwrap();
    let kept = ["-K", "__jit_debug_register_code", "-K", "__jit_debug_descriptor"];
    let stripped = Command::new("strip").args(kept).arg(&loader).status();
    assert!(stripped.is_ok_and(|status| status.success()), "strip is part of what gdb needs");
    loader
}

#[test]
fn gdb_stops_at_lines_of_an_artifact() {
    let folder = Folder::with(&[("lift.pmi", LIFT)]);
    folder.plcc("build lift.pmi --opt none").exits(0);
    if gdb(folder.path(), &[], Path::new("true"), &[]).is_none() {
        return;
    }
    let loader = stripped_loader(&folder);
    let args = ["--gdb", "lift.plcx", "--ticks", "3"];
    if let Some(text) = gdb(folder.path(), &SESSION, &loader, &args) {
        is_right(&text);
    }
    // In real time no other process runs the control, and a scan that a breakpoint holds up is not too long.
    let args = ["--gdb", "lift.plcx", "--realtime"];
    let long = ["break lift.pmi:7", "run", "shell sleep 0.3", "next", "continue", "next"];
    if let Some(text) = gdb(folder.path(), &long, &loader, &args) {
        in_order(&text, &["lift.pmi:7\n", "8\tIF (UP)", "Breakpoint 1, ", "lift.pmi:7\n"]);
    }
}

#[test]
fn gdb_stops_at_lines_of_code_that_was_just_compiled() {
    let folder = Folder::with(&[("lift.pmi", LIFT)]);
    let plcc = Path::new(env!("CARGO_BIN_EXE_plcc"));
    for engine in ["jit", "aot"] {
        let args =
            ["run", "--engine", engine, "--opt", "none", "--gdb", "lift.pmi", "--ticks", "3"];
        if let Some(text) = gdb(folder.path(), &SESSION, plcc, &args) {
            is_right(&text);
        }
    }
}

/// A PLC that changes a definition through a number that the compiler does not know: from then on its general code runs.
const MOVED: &str = "\
I5=2
M1->Y:$FFC2,8
M101->Y:$BC01,0,16
P8=101
OPEN PLC 1 CLEAR
P1=P1+1
IF(P1=2)
M(P8)=$FFC3
ENDIF
M1=1
P2=P2+1
CLOSE
";

#[test]
fn gdb_stops_in_general_code() {
    let folder = Folder::with(&[("moved.pmc", MOVED)]);
    let commands =
        ["break moved.pmc:10 if context->image->P1 == 400", "run", "print context->image->P2"];
    let plcc = Path::new(env!("CARGO_BIN_EXE_plcc"));
    let args = ["run", "--gdb", "moved.pmc", "--ticks", "2000"];
    if let Some(text) = gdb(folder.path(), &commands, plcc, &args) {
        in_order(&text, &["Breakpoint 1.2, ", "moved.pmc:10\n", "$1 = 399"]);
        assert!(!text.contains("Cannot"), "{text}");
    }
}

#[test]
fn gdb_prints_what_a_module_of_nct_has() {
    let folder = Folder::with(&[("count.nct", ":001\nLF020\n+1\nSF020\nU002\nJ1\n:000 J0\n")]);
    let commands =
        ["break count.nct:5", "run", "continue", "print context->image->F0201", "next", "continue"];
    let plcc = Path::new(env!("CARGO_BIN_EXE_plcc"));
    let args = ["run", "--gdb", "count.nct", "--ticks", "2"];
    if let Some(text) = gdb(folder.path(), &commands, plcc, &args) {
        in_order(&text, &["count.nct:5\n", "count.nct:5\n", "$1 = true", "exited normally"]);
    }
}

/// What `--gdb` can't do is said before anything runs.
#[test]
fn programs_without_machine_code_or_debug_part_are_refused() {
    let folder = Folder::with(&[("lift.pmi", LIFT)]);
    folder.plcc("build lift.pmi --no-debug").exits(0);
    folder.plcc("run lift.plcx --ticks 1").exits(0);
    folder.plcc("run lift.plcx --gdb --ticks 1").exits(2).says(&["lift.plcx", "--no-debug"]);
    folder.plcc("run lift.pmi --engine interp --gdb --ticks 1").exits(2).says(&["plcc debug"]);
    folder.plcc("build lift.pmi --emit asm --no-debug").exits(2).says(&["--no-debug"]);
    let size = |name: &str| folder.path().join(name).metadata().unwrap().len();
    folder.plcc("build lift.pmi -o whole.plcx").exits(0);
    assert!(size("whole.plcx") > size("lift.plcx"));
    // Without the debug part an artifact does not depend on the folder in which it was built.
    let inner = Folder::with(&[("lift.pmi", LIFT)]);
    inner.plcc("build lift.pmi --no-debug").exits(0);
    let bytes = |folder: &Folder| std::fs::read(folder.path().join("lift.plcx")).unwrap();
    assert_eq!(bytes(&folder), bytes(&inner));
}
