//! Objects in C programs: several linked together, and what debuggers see of a program's variables and
//! sources. What needs a C compiler or gdb is skipped, with a word, where they are not installed.
#![allow(clippy::unwrap_used, clippy::panic)]

mod support;
#[path = "../../tests/src/tools.rs"]
mod tools;

use std::path::Path;
use std::process::{Command, Output};

use support::{Folder, SLICES, STOPS};
use tools::is_there;

const INCLUDE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../codegen/include");

fn run(command: &mut Command, folder: &Path) -> Output {
    let output = command.current_dir(folder).output().unwrap();
    let errors = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{:?}: {errors}", output.status);
    output
}

/// Compiles `main.c` of the folder with objects, to `main`.
fn link(folder: &Folder, objects: &[&str]) {
    let mut command = Command::new("cc");
    command.args(["-Wall", "-Wextra", "-Werror", "-Wno-unused-parameter", "-g", "-O0"]);
    command.args(["-I", INCLUDE, "-o", "main", "main.c"]).args(objects);
    run(&mut command, folder.path());
}

const HOST: &str = "static uint64_t host(const struct plcc_context *c, uint32_t f, uint64_t x,\n\
                    uint64_t y, uint64_t z, uint64_t w) { return 0; }\n";

/// Two programs in one; the scan of one is stopped, and says where.
#[test]
fn programs_with_prefixes_run_in_one_c_program() {
    let folder = Folder::with(&[("stops.pmi", STOPS), ("slices.nct", SLICES)]);
    folder.plcc("build stops.pmi --emit obj --prefix lift -o lift.o").exits(0);
    folder.plcc("build slices.nct --emit obj --prefix Door_2 -o door.o").exits(0);
    if !is_there("cc") {
        return;
    }
    let main = "\
#define PLCC_PREFIX lift
#include \"plcc.h\"
#define PLCC_PREFIX Door_2
#include \"plcc.h\"
#include <stdio.h>
HOST
static uint8_t image[2][16384];
int main(void) {
    struct plcc_context context[2] = { { .image = image[0], .host = host },
                                       { .image = image[1], .host = host } };
    struct plcc_task lift = lift_task_at(0), door = Door_2_task_at(1);
    if (lift_image_size > sizeof *image || Door_2_image_size > sizeof *image) return 1;
    for (int n = 0; n < 4; n++)
        printf(\"%d %d\\n\", lift_scan(&lift, context), Door_2_scan(&door, context + 1));
    printf(\"trap %u at line %u, index %d\\n\", lift.trap, lift_trap_sites[lift.trap_site].line,
           lift.trap_index);
    return Door_2_layout[0] != 'p';
}
";
    folder.write("main.c", main.replace("HOST\n", HOST));
    link(&folder, &["lift.o", "door.o"]);
    let output = run(&mut Command::new(folder.path().join("main")), folder.path());
    let text = String::from_utf8(output.stdout).unwrap();
    assert_eq!(text, "1 1\n1 1\n1 1\n3 1\ntrap 1 at line 4, index 3\n");
}

#[test]
fn what_is_no_prefix_or_map_is_refused() {
    let folder = Folder::with(&[("stops.pmi", STOPS)]);
    for (options, part) in [
        ("--emit obj --prefix 2door", "2door"),
        ("--emit obj --prefix my-door", "my-door"),
        ("--emit obj --debug-prefix-map here", "here"),
        ("--prefix lift", "--emit obj"),
        ("--emit asm --debug-prefix-map a=b", "--emit obj"),
    ] {
        folder.plcc(&format!("build stops.pmi {options}")).exits(2).says(&[part]);
    }
}

const PUMPS: &str = "\
$OUTPUT
PUMP = 1/0
$INTEGER
N, A[3]
$LONG
FAR
$END
PUMP = T
N = N - 5
FAR = N * 1000 + 70000
@NVINT[1] = N
FLG = N > 7
";

const FLAGS: &str = ":001\nU012\nLF500 +5 SF500\nJ1\n:000 J0\n";

const MILL: &str =
    "I5=2\nM1->Y:$FFC2,8\nM2->X:$10,4,8,S\nOPEN PLC 1 CLEAR\nM1=1\nM2=-3\nP7=2.5\nCLOSE\n";

/// What gdb prints at the end of `main`, after one scan of a task.
fn gdb(name: &str, source: &str, task: u32, commands: &[&str]) -> Option<String> {
    if !is_there("cc") || !is_there("gdb") {
        return None;
    }
    let folder = Folder::with(&[("plc/keep.txt", "")]);
    folder.write(format!("plc/{name}"), source);
    // The object is built where its source lies, gdb runs somewhere else.
    let mut build = folder.command(&["build", name, "--emit", "obj", "-o", "../plc.o"]);
    run(&mut build, &folder.path().join("plc"));
    let main = format!(
        "#include \"plcc.h\"\n{HOST}static uint8_t image[4 << 20];\nint main(void) {{\n\
         struct plcc_context here = {{ .image = image, .host = host }}, *context = &here;\n\
         struct plcc_task task = plcc_task_at({task});\nplcc_scan(&task, context);\n\
         return context->image != image;\n}}\n"
    );
    folder.write("main.c", &main);
    link(&folder, &["plc.o"]);
    let mut command = Command::new("gdb");
    command.args(["-nx", "-batch", "-ex", "set debuginfod enabled off"]);
    // For a bit field gdb reads the whole image, which is larger for a PMAC than it does by itself.
    command.args(["-ex", "set max-value-size unlimited"]);
    command.args(["-ex", "break main.c:9", "-ex", "run"]);
    for line in commands {
        command.args(["-ex", line]);
    }
    let output = run(command.arg("main"), folder.path());
    let errors = String::from_utf8_lossy(&output.stderr);
    if errors.contains("not permitted") {
        tools::missing("gdb", &format!("may not run programs here: {errors}"));
        return None;
    }
    let text = String::from_utf8(output.stdout).unwrap();
    Some(format!("{text}\n{errors}"))
}

/// The command that prints a member of the image's type.
fn member(name: &str) -> String {
    format!("print ((struct plcc_image *)context->image)->{name}")
}

/// Whether gdb printed these values, in this order.
fn printed(text: &str, values: &[&str]) {
    for (number, value) in (1..).zip(values) {
        assert!(text.contains(&format!("${number} = {value}\n")), "${number} = {value} in\n{text}");
    }
}

#[test]
fn gdb_prints_the_variables_of_pmi_and_finds_the_source() {
    let names = ["PUMP", "N", "FAR", "at_NVINT[1]", "FLG"].map(member);
    let mut commands: Vec<&str> = names.iter().map(String::as_str).collect();
    commands.push("list pumps.pmi:8,9");
    commands.push("ptype struct plcc_image");
    let Some(text) = gdb("pumps.pmi", PUMPS, 0, &commands) else { return };
    printed(&text, &["true", "-5", "65000", "-5", "false"]);
    assert!(text.contains("8\tPUMP = T") && text.contains("9\tN = N - 5"), "{text}");
    assert!(text.contains("short A[3];"), "{text}");
}

#[test]
fn gdb_prints_the_flags_of_nct_and_the_bits_of_a_pmac() {
    let names = ["Y012", "Y011", "F5002", "F5001"].map(member);
    let commands: Vec<&str> = names.iter().map(String::as_str).collect();
    if let Some(text) = gdb("flags.nct", FLAGS, 1, &commands) {
        printed(&text, &["true", "false", "true", "false"]);
    }
    let names = ["M1", "M2", "P7"].map(member);
    let commands: Vec<&str> = names.iter().map(String::as_str).collect();
    if let Some(text) = gdb("mill.pmc", MILL, 0, &commands) {
        printed(&text, &["1", "-3", "2.5"]);
    }
}

/// The map replaces a folder in the paths that debuggers get.
#[test]
fn debuggers_look_for_sources_where_the_map_says() {
    let folder = Folder::with(&[("stops.pmi", STOPS)]);
    let here = folder.path().canonicalize().unwrap();
    let build = |map: &str| {
        let mut args = vec!["build", "stops.pmi", "--emit", "obj"];
        if !map.is_empty() {
            args.extend(["--debug-prefix-map", map]);
        }
        run(&mut folder.command(&args), folder.path());
        let object = std::fs::read(folder.path().join("stops.o")).unwrap();
        String::from_utf8_lossy(&object).into_owned()
    };
    let shown = here.to_str().unwrap();
    assert!(build("").contains(shown));
    let mapped = build(&format!("{shown}=/usr/src/machine"));
    assert!(mapped.contains("/usr/src/machine") && !mapped.contains(shown));
}
