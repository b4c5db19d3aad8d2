//! Adds a fourth language to a copy of the sources, as `tests/fourth` says, and does everything with a program in it
//! that users do. So what a language costs is what lies in that folder, and nothing that shows, debugs, records or
//! wires programs can know the three languages by heart.
//!
//! It compiles our crates once more, in `target/fourth`, which takes minutes, so it runs where the environment variable
//! `PLCC_FOURTH_LANGUAGE` is set. Continuous integration sets it.
#![allow(clippy::unwrap_used, clippy::panic, clippy::indexing_slicing)]

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Lines that are added to a file that is there.
struct Edit {
    file: String,
    after: String,
    add: String,
}

/// The additions that a list names.
fn edits(list: &Path) -> Vec<Edit> {
    let table: toml::Table = fs::read_to_string(list).unwrap().parse().unwrap();
    let edit = |edit: &toml::Value| {
        let text = |key: &str| edit[key].as_str().unwrap().to_owned();
        Edit { file: text("file"), after: text("after"), add: text("add") }
    };
    table["edit"].as_array().unwrap().iter().map(edit).collect()
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().to_owned()
}

/// Writes a file if it has another text, so that cargo builds nothing twice.
fn write(path: &Path, bytes: &[u8]) {
    if fs::read(path).is_ok_and(|old| old == bytes) {
        return;
    }
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    fs::write(path, bytes).unwrap();
}

/// The files of the workspace that git knows, and what is to be added to it.
fn listed(root: &Path) -> Vec<String> {
    let mut git = Command::new("git");
    git.args(["ls-files", "-z", "--cached", "--others", "--exclude-standard"]).current_dir(root);
    let output = git.output().unwrap();
    assert!(output.status.success());
    let names = String::from_utf8(output.stdout).unwrap();
    names.split('\0').filter(|name| !name.is_empty()).map(str::to_owned).collect()
}

/// Removes the files of an earlier copy that are not among these.
fn drop_others(folder: &Path, laid: &BTreeSet<PathBuf>) {
    for entry in fs::read_dir(folder).into_iter().flatten() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            drop_others(&path, laid);
        } else if !laid.contains(&path) {
            fs::remove_file(&path).unwrap();
        }
    }
}

/// Copies the sources to `copy`, lays the language over them and adds its lines.
fn lay_over(root: &Path, copy: &Path) {
    const OVERLAY: &str = "tests/fourth/";
    let edits = edits(&root.join(OVERLAY).join("lines.toml"));
    let names = listed(root);
    let laid: BTreeSet<PathBuf> =
        names.iter().map(|name| copy.join(name.strip_prefix(OVERLAY).unwrap_or(name))).collect();
    drop_others(copy, &laid);
    for name in names {
        let Ok(bytes) = fs::read(root.join(&name)) else { continue };
        let mut text = bytes;
        for edit in edits.iter().filter(|edit| edit.file == name) {
            let old = String::from_utf8(text).unwrap();
            let at =
                old.find(&edit.after).unwrap_or_else(|| panic!("{name} has no {}", edit.after));
            let (before, behind) = old.split_at(at + edit.after.len());
            text = [before, &edit.add, behind].concat().into_bytes();
        }
        let to = match name.strip_prefix(OVERLAY) {
            Some("lines.toml") => continue,
            Some(inner) => inner,
            None => &name,
        };
        write(&copy.join(to), &text);
    }
}

/// Links the libraries that the workspace was built with into the copy's target folder, so that the copy builds nothing but
/// our own crates. Those of the workspace are linked too, and not used: they have another path.
fn share_libraries(from: &Path, to: &Path) {
    if to.exists() {
        return;
    }
    fs::create_dir_all(to.parent().unwrap()).unwrap();
    let mut part = to.to_owned();
    part.set_extension("part");
    let _ = fs::remove_dir_all(&part);
    for folder in ["deps", "build", ".fingerprint"] {
        link(&from.join(folder), &part.join(folder));
    }
    fs::rename(part, to).unwrap();
}

/// Links the files of a folder into another one. Programs are left out.
fn link(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).into_iter().flatten() {
        let path = entry.unwrap().path();
        let beside = to.join(path.file_name().unwrap());
        if path.is_dir() {
            link(&path, &beside);
        } else if path.extension().is_some() || !from.ends_with("deps") {
            fs::hard_link(&path, &beside).unwrap();
        }
    }
}

/// The crates of ours that the workspace has optimised for its tests. The programs of this test are tiny.
fn optimised(root: &Path) -> Vec<String> {
    let manifest: toml::Table =
        fs::read_to_string(root.join("Cargo.toml")).unwrap().parse().unwrap();
    let packages = manifest["profile"]["dev"]["package"].as_table().unwrap();
    packages.keys().filter(|name| *name != "*").cloned().collect()
}

fn cargo(copy: &Path, target: &Path, words: &[&str]) {
    let mut cargo = Command::new(env!("CARGO"));
    cargo.args(words).args(["--quiet", "--workspace", "--locked", "--offline", "--target-dir"]);
    cargo.arg(target);
    for name in optimised(copy) {
        cargo.args(["--config", &format!("profile.dev.package.{name}.opt-level=0")]);
    }
    // The settings of the test that runs are none for the copy.
    for (name, _) in std::env::vars_os() {
        if name.to_string_lossy().starts_with("CARGO_PKG_") {
            cargo.env_remove(name);
        }
    }
    let status = cargo.env_remove("CARGO_MANIFEST_DIR").current_dir(copy).status().unwrap();
    assert!(status.success(), "cargo {}", words.join(" "));
}

#[test]
fn a_fourth_language_takes_its_folders_and_a_list_of_lines() {
    if std::env::var_os("PLCC_FOURTH_LANGUAGE").is_none() {
        eprintln!("skipped: it compiles the workspace once more; set PLCC_FOURTH_LANGUAGE");
        return;
    }
    let root = root();
    let target = root.join("target/fourth");
    let copy = target.join("sources");
    lay_over(&root, &copy);
    // The folder in which cargo has put this test is that of the workspace's libraries.
    let deps = std::env::current_exe().unwrap();
    share_libraries(deps.parent().and_then(Path::parent).unwrap(), &target.join("debug"));
    cargo(&copy, &target, &["build", "--bin", "plcrt", "--test", "mini"]);
    cargo(&copy, &target, &["test", "--test", "mini"]);
}
