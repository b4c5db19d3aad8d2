//! Tools of other makes that some tests run: debuggers, tracers, compilers. A test that does not find its
//! tool, or whose tool may not do its work here, says so on standard error and is over; it fails if the
//! environment variable `PLCC_REQUIRE_TOOLS` has the tool's name. That is a list of names with spaces or commas
//! between, or `all`. Continuous integration sets it to the tools that it has installed, so that no test is
//! left out there unnoticed.
//!
//! Tests of crates that `plcc-tests` is built on include this file by its path, since they can't depend on
//! that package.
#![allow(
    dead_code,
    unreachable_pub,
    reason = "not every test that includes this file needs all of it"
)]

use std::process::{Command, Stdio};

/// The tools, each with what brings it: a package of Debian, or something else.
const TOOLS: [(&str, &str); 16] = [
    ("aarch64-linux-gnu-gcc", "the packages gcc-aarch64-linux-gnu and libc6-dev-arm64-cross"),
    ("addr2line", "the package binutils"),
    ("cc", "the packages gcc and libc6-dev"),
    ("dpkg-deb", "the package dpkg"),
    ("emacs", "the packages emacs-nox and elpa-eglot"),
    ("fst2vcd", "the package gtkwave"),
    ("gdb", "the package gdb"),
    ("linuxcnc", "the packages linuxcnc-uspace and linuxcnc-uspace-dev"),
    ("mdbook", "`cargo install --locked mdbook`"),
    ("nvim", "the package neovim"),
    ("prlimit", "the package util-linux"),
    ("pymodbus", "`pip install pymodbus`; PLCC_PYTHON may name the Python that has it"),
    ("python3", "the package python3"),
    ("qemu-aarch64", "the package qemu-user"),
    ("strace", "the package strace"),
    ("systemd-analyze", "the package systemd"),
];

/// Whether a program is there. Where it is missing, the test says so and does without it, or fails if the tool is
/// required.
#[must_use]
pub fn is_there(tool: &str) -> bool {
    let mut command = Command::new(tool);
    command.arg("--version").stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    let found = command.status().is_ok();
    if !found {
        missing(tool, "is not installed");
    }
    found
}

/// Says that a tool is not installed, or what it may not do here, and that the test is not carried out.
///
/// # Panics
/// If the tool is required.
#[allow(clippy::panic, reason = "a test fails by a panic")]
pub fn missing(tool: &str, why: &str) {
    let known = TOOLS.iter().find(|(name, _)| *name == tool);
    let Some((_, source)) = known else { panic!("`{tool}` is not in the list of tools") };
    let text = format!("{tool} {why} (it comes with {source})");
    let required = std::env::var("PLCC_REQUIRE_TOOLS").unwrap_or_default();
    assert!(!is_required(tool, &required), "{text}, and PLCC_REQUIRE_TOOLS is `{required}`");
    eprintln!("skipped: {text}");
}

/// Whether a list of tools has one of them. A name that is none of a tool would require nothing, so it is a mistake.
pub(crate) fn is_required(tool: &str, list: &str) -> bool {
    let names: Vec<&str> = list.split([' ', ',']).filter(|name| !name.is_empty()).collect();
    for name in &names {
        let is_known = *name == "all" || TOOLS.iter().any(|(known, _)| known == name);
        assert!(is_known, "PLCC_REQUIRE_TOOLS has `{name}`, which is none of the tools of tests");
    }
    names.contains(&tool) || names.contains(&"all")
}
