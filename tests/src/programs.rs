//! The workspace's programs, built once from the sources under test. Tests of `plcc`, on which `plcc-tests` is built,
//! include this file by its path.
#![allow(
    dead_code,
    unreachable_pub,
    clippy::unwrap_used,
    reason = "not every test that includes this file needs all of it"
)]

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

/// A program of the workspace.
///
/// # Panics
/// When it can't be built.
pub fn program(name: &str) -> PathBuf {
    folder_of_programs().join(name)
}

/// The folder of the workspace's programs.
///
/// # Panics
/// When they can't be built.
pub fn folder_of_programs() -> &'static Path {
    static BUILT: OnceLock<PathBuf> = OnceLock::new();
    BUILT.get_or_init(|| build(&["--bins"]))
}

/// Builds a part of the workspace as `cargo test --workspace` does, so that nothing is compiled for a second time:
/// what crates are compiled with depends on all that is built together. A test, the smallest one, is among it
/// because tests have dependencies of their own. Gives the folder of the profile.
///
/// # Panics
/// When it can't be built.
pub fn build(words: &[&str]) -> PathBuf {
    // The test lies in the folder `deps` of its profile.
    let test = std::env::current_exe().unwrap();
    let profile = test.parent().and_then(Path::parent).unwrap();
    let target = profile.parent().unwrap();
    let mut cargo = Command::new(env!("CARGO"));
    cargo.args(["build", "--quiet", "--locked", "--offline", "--workspace", "--test", "mutants"]);
    cargo.args(words).arg("--target-dir").arg(target);
    if profile.ends_with("release") {
        cargo.arg("--release");
    }
    cargo.current_dir(env!("CARGO_MANIFEST_DIR"));
    assert!(cargo.status().is_ok_and(|status| status.success()), "{cargo:?} does not build");
    profile.to_owned()
}
