//! Checks what can be checked of ARCHITECTURE.md's invariants.
#![allow(clippy::unwrap_used, clippy::panic, clippy::indexing_slicing)]

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Which crate may depend on which of ours, tests and benches aside. ARCHITECTURE.md draws it.
const MAY_DEPEND: &[(&str, &[&str])] = &[
    ("plcc-abi", &[]),
    ("plcc-diag", &[]),
    ("plcc-ir", &["plcc-abi"]),
    ("plcc-frontend", &["plcc-abi", "plcc-diag", "plcc-ir"]),
    ("plcc-codegen", &["plcc-abi", "plcc-ir"]),
    ("plcc-runtime", &["plcc-abi"]),
    ("plcrt", &["plcc-abi", "plcc-runtime"]),
    (
        "plcc",
        &["plcc-abi", "plcc-codegen", "plcc-diag", "plcc-frontend", "plcc-ir", "plcc-runtime"],
    ),
];

/// The only files that may hold `unsafe`.
const UNSAFE: &[&str] = &[
    "abi/src/code.rs",
    "codegen/src/compile.rs",
    "codegen/src/jit_memory.rs",
    "runtime/src/artifact/mod.rs",
    "runtime/src/native.rs",
];

/// The longest that a source file may get.
const LINES: usize = 800;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn manifests() -> BTreeMap<String, toml::Table> {
    let workspace: toml::Table =
        fs::read_to_string(root().join("Cargo.toml")).unwrap().parse().unwrap();
    workspace["workspace"]["members"]
        .as_array()
        .unwrap()
        .iter()
        .map(|member| {
            let path = root().join(member.as_str().unwrap()).join("Cargo.toml");
            let manifest: toml::Table = fs::read_to_string(path).unwrap().parse().unwrap();
            (manifest["package"]["name"].as_str().unwrap().to_owned(), manifest)
        })
        .collect()
}

fn dependencies(manifest: &toml::Table) -> BTreeSet<&str> {
    manifest
        .get("dependencies")
        .and_then(toml::Value::as_table)
        .into_iter()
        .flat_map(|table| table.keys().map(String::as_str))
        .collect()
}

/// Every Rust file of the workspace, by its path from the root.
fn sources() -> Vec<(String, String)> {
    let mut found = Vec::new();
    let mut open = vec![root()];
    while let Some(folder) = open.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            if path.is_dir() {
                if !name.starts_with('.') && name != "target" {
                    open.push(path);
                }
            } else if name.ends_with(".rs") {
                let shown = path.strip_prefix(root()).unwrap().to_string_lossy().into_owned();
                found.push((shown, fs::read_to_string(&path).unwrap()));
            }
        }
    }
    assert!(found.len() > 100, "looked in the wrong place");
    found
}

#[test]
fn crates_depend_only_on_what_the_map_allows() {
    let manifests = manifests();
    let ours: BTreeSet<&str> = manifests.keys().map(String::as_str).collect();
    for (name, allowed) in MAY_DEPEND {
        let manifest = manifests.get(*name).unwrap_or_else(|| panic!("{name} is gone"));
        for dependency in dependencies(manifest).intersection(&ours) {
            assert!(allowed.contains(dependency), "{name} must not depend on {dependency}");
        }
    }
    for name in ours {
        let known = MAY_DEPEND.iter().any(|(known, _)| *known == name);
        assert!(
            known || ["plcc-tests", "plcc-random", "plcc-benches"].contains(&name),
            "{name} is not on the map"
        );
    }
}

#[test]
fn only_codegen_knows_cranelift() {
    for (name, manifest) in manifests() {
        for dependency in dependencies(&manifest) {
            assert!(
                name == "plcc-codegen" || !dependency.starts_with("cranelift"),
                "{name} must not depend on {dependency}"
            );
        }
    }
}

#[test]
fn every_crate_takes_the_lints() {
    for (name, manifest) in manifests() {
        let lints = &manifest["lints"];
        let folder = format!("{}/", name.strip_prefix("plcc-").unwrap_or(&name));
        if UNSAFE.iter().any(|path| path.starts_with(&folder)) {
            assert_eq!(lints["rust"]["unsafe_code"].as_str(), Some("deny"), "{name}");
        } else {
            assert_eq!(lints["workspace"].as_bool(), Some(true), "{name}");
        }
    }
}

#[test]
fn unsafe_stands_only_where_it_may() {
    for (path, text) in sources() {
        if UNSAFE.contains(&path.as_str()) || path.ends_with("architecture.rs") {
            continue;
        }
        for (number, line) in text.lines().enumerate() {
            // The type of a pointer to an unsafe function does nothing by itself.
            let code = line.split("//").next().unwrap_or("").replace("unsafe extern \"C\" fn(", "");
            let words = ["unsafe {", "unsafe fn", "unsafe impl", "unsafe trait", "unsafe extern"];
            let found = words.iter().chain(&["(unsafe_code)"]).any(|word| code.contains(word));
            assert!(!found, "{path}:{}: {line}", number + 1);
        }
    }
}

#[test]
fn every_unsafe_block_says_why() {
    for path in UNSAFE {
        let text = fs::read_to_string(root().join(path)).unwrap();
        let blocks = text.matches("unsafe {").count() + text.matches("unsafe impl").count();
        let reasons = text.matches("SAFETY:").count();
        // What callers and implementors have to see to.
        let duties = text.matches("unsafe fn").count() + text.matches("unsafe trait").count();
        let told = text.matches("/// # Safety").count();
        assert!(blocks + duties > 0, "{path} holds none: take it off the list");
        assert!(reasons >= blocks, "{path}: {blocks} blocks, {reasons} reasons");
        assert!(told >= duties, "{path}: {duties} functions and traits, {told} explained");
    }
}

/// What the statement interpreters must not share with what they are compared with.
const NOT_FOR_ORACLES: &[&str] = &["lower", "plcc_ir", "eval"];

/// A mistake of the lowering, of the IR or of the folding of constants must not hide in the
/// statement interpreter too.
#[test]
fn oracles_share_nothing_with_the_lowering() {
    for language in ["pmi", "nct", "pmac"] {
        let folder = format!("frontend/src/{language}/oracle/");
        let all = sources();
        let files: Vec<_> = all.iter().filter(|(path, _)| path.starts_with(&folder)).collect();
        assert!(!files.is_empty(), "{folder} holds nothing");
        for (path, text) in files {
            for (number, line) in text.lines().enumerate() {
                let code = line.split("//").next().unwrap_or("");
                let names = code.split(|c: char| !(c.is_alphanumeric() || c == '_'));
                let shared = names.into_iter().find(|name| NOT_FOR_ORACLES.contains(name));
                assert_eq!(shared, None, "{path}:{}: {line}", number + 1);
            }
        }
    }
}

#[test]
fn files_stay_short() {
    for (path, text) in sources() {
        let lines = text.lines().count();
        assert!(lines <= LINES, "{path} has {lines} lines: find the second thing it holds");
    }
}

#[test]
fn nothing_is_left_unfinished() {
    for (path, text) in sources() {
        if path.ends_with("architecture.rs") {
            continue;
        }
        for word in ["todo!(", "unimplemented!(", "dbg!("] {
            assert!(!text.contains(word), "{path} holds {word}…)");
        }
    }
}
