//! What a thread with real-time priority needs: without events, ticks, reading and setting take nothing from
//! the allocator. A C program counts, since its allocator is the library's too. Skipped, with a word, where
//! there is no C compiler.
#![cfg(target_env = "gnu")]
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

/// Reports a fault in each tick in which the button changes.
const FAULTS: &str = "\
$INPUT
BTN = 0/0
$OUTPUT
OUT = 1/0
$INTEGER
N, A[2]
$FAULT
FLT = \"COUNT\", N
$END
N = N + 1
FLT = BTN
OUT = BTN
";

const COUNTS: &str = r#"
#include <stdio.h>
#include "plcrt.h"

extern void *__libc_malloc(size_t);
extern void *__libc_calloc(size_t, size_t);
extern void *__libc_realloc(void *, size_t);
static long taken;
void *malloc(size_t n) { taken++; return __libc_malloc(n); }
void *calloc(size_t n, size_t m) { taken++; return __libc_calloc(n, m); }
void *realloc(void *p, size_t n) { taken++; return __libc_realloc(p, n); }

int main(void)
{
    struct plcrt *control = plcrt_open("faults.plcx", NULL);
    int64_t button = plcrt_find(control, "BTN", PLCRT_WRITE), out = plcrt_find(control, "OUT", PLCRT_LINES);
    int64_t array = plcrt_find(control, "A", PLCRT_READ);
    for (int keep = 1; keep >= 0; keep--) {
        double value = 0;
        long before = 0;
        plcrt_keep_events(control, keep);
        for (int tick = 0; tick < 100; tick++) {
            if (tick == 1)
                before = taken;
            if (plcrt_write(control, button, tick % 2) != PLCRT_OK || plcrt_tick(control) != PLCRT_OK
                || plcrt_read(control, out, 0, &value) != PLCRT_OK || value != tick % 2
                || plcrt_read(control, array, 1, &value) != PLCRT_OK)
                return 1;
        }
        printf("%s %s\n", keep ? "with events:" : "without events:", taken > before ? "some" : "none");
    }
    /* OUT is 1. Its line becomes safe, and the variable stays. */
    double line = 1, variable = 0;
    if (plcrt_make_safe(control) != PLCRT_OK || plcrt_read(control, out, 0, &line) != PLCRT_OK || line != 0
        || plcrt_get(control, "OUT", &variable) != PLCRT_OK || variable != 1)
        return 2;
    while (plcrt_next_event(control))
        ;
    printf("stop: %s\n", plcrt_stop_message(control) ? "some" : "none");
    plcrt_close(control);
    return 0;
}
"#;

/// The folder in which cargo leaves the library: that of the test's own program, or the one above it.
fn library() -> PathBuf {
    let own = std::env::current_exe().unwrap();
    let folders = own.ancestors().skip(1).take(2).map(Path::to_owned);
    let mut found = folders.filter(|folder| folder.join("libplcrt.so").is_file());
    found.next().unwrap_or_else(|| panic!("libplcrt.so is not beside {}", own.display()))
}

#[test]
fn ticks_without_events_allocate_nothing() {
    if !tools::is_there("cc") {
        return;
    }
    let mut sources = SourceMap::new();
    let file = sources.add("faults.pmi", FAULTS.as_bytes());
    let (checked, found) = check(&mut sources, &[file], Dialect::Pmi, &Disk, &Options::default());
    let lowered =
        checked.unwrap_or_else(|| panic!("{found:?}")).optimized(OptLevel::Speed).unwrap();
    let code = code(&lowered, &Target::host_baseline().unwrap()).unwrap();
    let folder = std::env::temp_dir().join(format!("libplcrt-real-time-{}", std::process::id()));
    fs::create_dir_all(&folder).unwrap();
    fs::write(folder.join("faults.plcx"), artifact(&lowered.program, &code).unwrap()).unwrap();
    fs::write(folder.join("counts.c"), COUNTS).unwrap();
    let mut build = Command::new("cc");
    build.args(["-Wall", "-Werror", "-o", "counts", "counts.c", "-I"]);
    build.arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("include"));
    build.arg("-L").arg(library()).arg("-lplcrt").current_dir(&folder);
    let built = build.output().unwrap();
    assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
    let mut run = Command::new(folder.join("counts"));
    let ran = run.current_dir(&folder).env("LD_LIBRARY_PATH", library()).output().unwrap();
    fs::remove_dir_all(&folder).unwrap();
    let said = String::from_utf8_lossy(&ran.stdout);
    assert!(ran.status.success(), "{said}{}", String::from_utf8_lossy(&ran.stderr));
    assert_eq!(said, "with events: some\nwithout events: none\nstop: none\n");
}
