//! Checks what can be checked of ARCHITECTURE.md's invariants.
#![allow(clippy::unwrap_used, clippy::panic, clippy::indexing_slicing)]

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Which crate may depend on which of ours. ARCHITECTURE.md draws it for the crates of which
/// `plcc` and `plcrt` are made.
const MAY_DEPEND: &[(&str, &[&str])] = &[
    ("plcc-abi", &[]),
    ("plcc-diag", &["plcc-abi"]),
    ("plcc-ir", &["plcc-abi"]),
    ("plcc-iec", &[]),
    ("plcc-frontend", &["plcc-abi", "plcc-diag", "plcc-iec", "plcc-ir"]),
    ("plcc-codegen", &["plcc-abi", "plcc-ir"]),
    ("plcc-image", &["plcc-abi"]),
    ("plcc-files", &[]),
    ("plcc-pages", &[]),
    ("plcc-protocol", &["plcc-abi"]),
    ("plcc-screen", &["plcc-protocol"]),
    ("plcc-configuration", &["plcc-abi", "plcc-files", "plcc-image"]),
    ("plcc-motion", &["plcc-abi"]),
    ("plcc-simulator", &["plcc-abi", "plcc-diag"]),
    ("plcc-runtime", &["plcc-abi", "plcc-motion", "plcc-simulator"]),
    ("plcc-control", &["plcc-abi", "plcc-runtime"]),
    ("plcc-load", &["plcc-abi", "plcc-files", "plcc-runtime"]),
    ("plcc-record", &["plcc-abi", "plcc-files", "plcc-runtime"]),
    (
        "plcc-host",
        &[
            "plcc-abi",
            "plcc-configuration",
            "plcc-control",
            "plcc-diag",
            "plcc-files",
            "plcc-image",
            "plcc-load",
            "plcc-protocol",
            "plcc-record",
            "plcc-runtime",
            "plcc-simulator",
        ],
    ),
    (
        "plcrt",
        &[
            "plcc-abi",
            "plcc-configuration",
            "plcc-control",
            "plcc-files",
            "plcc-host",
            "plcc-image",
            "plcc-load",
            "plcc-record",
            "plcc-runtime",
        ],
    ),
    ("libplcrt", &["plcc-abi", "plcc-control", "plcc-load", "plcc-runtime"]),
    ("plcctl", &["plcc-pages", "plcc-protocol", "plcc-screen"]),
    (
        "plcio",
        &[
            "plcc-abi",
            "plcc-configuration",
            "plcc-files",
            "plcc-image",
            "plcc-pages",
            "plcc-protocol",
        ],
    ),
    (
        "plcc-replay",
        &[
            "plcc-abi",
            "plcc-diag",
            "plcc-files",
            "plcc-frontend",
            "plcc-protocol",
            "plcc-record",
            "plcc-runtime",
        ],
    ),
    ("plcc-diff", &["plcc-diag", "plcc-frontend"]),
    ("plcc-lsp", &["plcc-abi", "plcc-diag", "plcc-files", "plcc-frontend", "plcc-plctest"]),
    (
        "plcc-prove",
        &["plcc-abi", "plcc-diag", "plcc-frontend", "plcc-ir", "plcc-plctest", "plcc-runtime"],
    ),
    ("plcc-why", &["plcc-abi", "plcc-frontend", "plcc-replay", "plcc-runtime"]),
    ("plcc-dap", &["plcc-abi", "plcc-diag", "plcc-frontend", "plcc-replay", "plcc-why"]),
    (
        "plcc-monitor",
        &[
            "plcc-abi",
            "plcc-diag",
            "plcc-files",
            "plcc-frontend",
            "plcc-protocol",
            "plcc-replay",
            "plcc-runtime",
            "plcc-screen",
            "plcc-why",
        ],
    ),
    ("plcc-plctest", &["plcc-abi", "plcc-diag", "plcc-frontend", "plcc-runtime"]),
    (
        "plcc",
        &[
            "plcc-abi",
            "plcc-codegen",
            "plcc-control",
            "plcc-dap",
            "plcc-diag",
            "plcc-diff",
            "plcc-files",
            "plcc-frontend",
            "plcc-host",
            "plcc-iec",
            "plcc-iec",
            "plcc-image",
            "plcc-ir",
            "plcc-load",
            "plcc-lsp",
            "plcc-monitor",
            "plcc-pages",
            "plcc-plctest",
            "plcc-prove",
            "plcc-record",
            "plcc-replay",
            "plcc-runtime",
            "plcc-why",
        ],
    ),
    ("plcc-random", &[]),
    ("plcc-ir-tests", &["plcc-abi", "plcc-codegen", "plcc-ir", "plcc-random"]),
    ("plcc-tests", EVERYTHING),
    ("plcc-benches", EVERYTHING),
];

/// What tests and benchmarks are made with.
const EVERYTHING: &[&str] = &[
    "plcc",
    "plcc-abi",
    "plcc-codegen",
    "plcc-configuration",
    "plcc-control",
    "plcc-dap",
    "plcc-diag",
    "plcc-files",
    "plcc-frontend",
    "plcc-host",
    "plcc-iec",
    "plcc-image",
    "plcc-ir",
    "plcc-ir-tests",
    "plcc-load",
    "plcc-lsp",
    "plcc-monitor",
    "plcc-motion",
    "plcc-protocol",
    "plcc-random",
    "plcc-record",
    "plcc-replay",
    "plcc-runtime",
    "plcc-simulator",
];

/// Which of ours a crate's own tests may use besides. Random numbers are for all; the tests of
/// code generation run the code, those of plcrt make the pages that it keeps. A test that needs more belongs into `tests/`.
/// Those of the C library compile the program that they run: cargo builds the library for its own
/// tests only.
const TESTS_MAY_USE: &[(&str, &[&str])] = &[
    ("plcrt", &["plcc-pages"]),
    ("plcc-codegen", &["plcc-runtime"]),
    ("libplcrt", &["plcc", "plcc-codegen", "plcc-diag", "plcc-frontend"]),
    ("plcc-monitor", &["plcc-control"]),
    ("plcc-ir-tests", &["plcc-diag", "plcc-frontend", "plcc-runtime"]),
];

/// The only files that may hold `unsafe`.
const UNSAFE: &[&str] = &[
    "abi/src/code.rs",
    "codegen/src/compile.rs",
    "codegen/src/jit_memory.rs",
    "image/src/shared_memory.rs",
    "libplcrt/src/c.rs",
    "load/src/lib.rs",
    "load/src/lib.rs",
    "runtime/src/frame_search.rs",
    "runtime/src/gdb/interface.rs",
    "runtime/src/mapped_code.rs",
    "runtime/src/native.rs",
];

/// The longest that a source file may get, its tests not counted.
const LINES: usize = 500;

/// Tables of data may be as long as what they list.
const TABLES: &[&str] = &["diag/src/codes/"];

/// What the parts of a language's folder may use of each other. Text is read, analysed, and then
/// either lowered to IR or interpreted; those two share nothing, since they are compared.
const PARTS: &[(&str, &[&str])] = &[
    ("reference", &[]),
    ("read", &["reference"]),
    ("analyse", &["read", "reference"]),
    ("lower", &["analyse", "read", "reference"]),
    ("oracle", &["analyse", "read", "reference"]),
];

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

/// The packages that a manifest names in tables of a kind (`dependencies`, `dev-dependencies`,
/// `build-dependencies`), also in those for some targets only. A renamed package counts by its own
/// name.
fn dependencies<'a>(manifest: &'a toml::Table, kind: &str) -> BTreeSet<&'a str> {
    let targets = manifest.get("target").and_then(toml::Value::as_table);
    let targets = targets.into_iter().flat_map(toml::Table::values);
    let places = targets.filter_map(toml::Value::as_table).chain([manifest]);
    let tables = places.filter_map(|place| place.get(kind)?.as_table());
    let packages = tables.flatten().map(|(key, value)| {
        value.get("package").and_then(toml::Value::as_str).unwrap_or(key.as_str())
    });
    packages.collect()
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
        for dependency in dependencies(manifest, "dependencies").intersection(&ours) {
            assert!(allowed.contains(dependency), "{name} must not depend on {dependency}");
        }
    }
    for name in ours {
        assert!(MAY_DEPEND.iter().any(|(known, _)| *known == name), "{name} is not on the map");
    }
}

#[test]
fn tests_of_a_crate_use_only_what_they_may() {
    let manifests = manifests();
    let ours: BTreeSet<&str> = manifests.keys().map(String::as_str).collect();
    for (name, manifest) in &manifests {
        // A crate may name itself, for its own features.
        let mut allowed = vec!["plcc-random", name.as_str()];
        for list in [MAY_DEPEND, TESTS_MAY_USE] {
            allowed.extend(list.iter().filter(|(known, _)| known == name).flat_map(|row| row.1));
        }
        for dependency in dependencies(manifest, "dev-dependencies").intersection(&ours) {
            assert!(allowed.contains(dependency), "{name}'s tests must not use {dependency}");
        }
    }
}

#[test]
fn nothing_runs_when_a_crate_is_built() {
    for (name, manifest) in manifests() {
        let needed = dependencies(&manifest, "build-dependencies");
        assert!(needed.is_empty(), "{name} needs {needed:?} to be built");
        assert!(manifest["package"].get("build").is_none(), "{name} has a build script");
    }
    for (path, _) in sources() {
        let folder = path.strip_suffix("build.rs").map(|folder| root().join(folder));
        let script = folder.is_some_and(|folder| folder.join("Cargo.toml").exists());
        assert!(!script, "{path} would run when its crate is built");
    }
}

#[test]
fn only_codegen_knows_cranelift() {
    for (name, manifest) in manifests() {
        for kind in ["dependencies", "dev-dependencies", "build-dependencies"] {
            for dependency in dependencies(&manifest, kind) {
                // The IR's tables are its maps, which know nothing of code generation.
                let is_tables = name == "plcc-ir" && dependency == "cranelift-entity";
                assert!(
                    name == "plcc-codegen" || is_tables || !dependency.starts_with("cranelift"),
                    "{name} must not depend on {dependency}"
                );
            }
        }
    }
}

#[test]
fn every_crate_uses_the_workspace_lints() {
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
fn unsafe_is_used_only_in_the_files_that_may() {
    for (path, text) in sources() {
        if UNSAFE.contains(&path.as_str()) || path.ends_with("architecture.rs") {
            continue;
        }
        for (number, line) in text.lines().enumerate() {
            // The type of a pointer to an unsafe function does nothing by itself.
            let code = code(line).replace("unsafe extern \"C\" fn(", "");
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
        // Names that are not mangled, and so may clash with others.
        let names = text.matches("#[unsafe(").count();
        assert!(blocks + duties + names > 0, "{path} holds none: take it off the list");
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
                let names = code(line).split(|c: char| !(c.is_alphanumeric() || c == '_'));
                let shared = names.into_iter().find(|name| NOT_FOR_ORACLES.contains(name));
                assert_eq!(shared, None, "{path}:{}: {line}", number + 1);
            }
        }
    }
}

/// The files of a language's folder, beside those of the interpreter itself, that may name the
/// statement interpreter: those that offer it, and the evaluation of single expressions.
const MAY_USE_ORACLES: &[&str] = &["mod.rs", "language.rs", "expression.rs"];

/// The compiler must not lean on the interpreter with which it is compared, so nothing of it may
/// name one: not `read`, `analyse`, `lower`, and none of the files beside them, such as `tables.rs`.
#[test]
fn compilers_use_nothing_of_their_oracles() {
    for language in ["pmi", "nct", "pmac"] {
        let folder = format!("frontend/src/{language}/");
        let all = sources();
        let files: Vec<_> = all
            .iter()
            .filter_map(|(path, text)| Some((path.strip_prefix(&folder)?, text)))
            .filter(|(path, _)| !["oracle/", "tests/"].iter().any(|it| path.starts_with(it)))
            .filter(|(path, _)| !MAY_USE_ORACLES.contains(path))
            .collect();
        for part in ["lower/", "analyse/", "read/", "tables.rs"] {
            assert!(files.iter().any(|(path, _)| path.starts_with(part)), "{folder}{part} is gone");
        }
        for (path, text) in files {
            let text = text.split("#[cfg(test)]\nmod ").next().unwrap_or("");
            for (number, line) in text.lines().enumerate() {
                let mut names = code(line).split(|c: char| !(c.is_alphanumeric() || c == '_'));
                let is_used = names.any(|name| name == "oracle" || name == "Interpreter");
                assert!(!is_used, "{folder}{path}:{}: {line}", number + 1);
            }
        }
    }
}

/// The code of a line: nothing after `//`.
fn code(line: &str) -> &str {
    line.split("//").next().unwrap_or("")
}

/// The parts of a language's folder that a text names by their paths (`super::read::…`,
/// `crate::pmac::{analyse, …}`).
fn parts_named(text: &str) -> BTreeSet<&'static str> {
    let text: String = text.lines().map(code).collect::<Vec<_>>().join("\n");
    let mut found = BTreeSet::new();
    for (part, _) in PARTS {
        for parent in ["super::", "pmi::", "nct::", "pmac::"] {
            if text.contains(&format!("{parent}{part}::")) {
                found.insert(*part);
            }
            for (at, _) in text.match_indices(&format!("{parent}{{")) {
                let list = text[at..].split(';').next().unwrap_or("");
                let mut words = list.split(|c: char| !(c.is_alphanumeric() || c == '_'));
                if words.any(|word| word == *part) {
                    found.insert(*part);
                }
            }
        }
    }
    found
}

/// Text goes one way through a language's folder: read, analyse, then lower or interpret.
#[test]
fn parts_of_a_language_use_only_those_before_them() {
    let sources = sources();
    for language in ["pmi", "nct", "pmac"] {
        for (part, allowed) in PARTS {
            let folder = format!("frontend/src/{language}/{part}/");
            let files: Vec<_> =
                sources.iter().filter(|(path, _)| path.starts_with(&folder)).collect();
            assert!(!files.is_empty(), "{folder} holds nothing");
            for (path, text) in files {
                // Tests of a part may go all the way.
                let text = text.split("#[cfg(test)]\nmod ").next().unwrap_or("");
                for used in parts_named(text) {
                    let may = used == *part || allowed.contains(&used);
                    assert!(may || path.ends_with("tests.rs"), "{path} must not use {used}");
                }
            }
        }
    }
}

#[test]
fn the_check_of_the_parts_finds_every_way_to_name_one() {
    let found = |text| parts_named(text).into_iter().collect::<Vec<_>>();
    assert_eq!(found("use super::super::lower::Lower; // super::read::x"), ["lower"]);
    assert_eq!(
        found("use crate::pmac::{ast, oracle::{A,\n B}, read};\nfn analyse() {}"),
        ["oracle", "read"]
    );
}

/// A file's length without the tests that stand at its end.
fn length(text: &str) -> usize {
    text.split("#[cfg(test)]\nmod ").next().unwrap_or("").lines().count()
}

#[test]
fn files_stay_short() {
    let mut wrong = vec![];
    for (path, text) in sources() {
        let is_test = path.contains("tests/") || path.ends_with("/tests.rs");
        if is_test || TABLES.iter().any(|table| path.starts_with(table)) {
            continue;
        }
        let lines = length(&text);
        if lines > LINES {
            wrong.push(format!("{path} has {lines} lines: find the second thing it holds"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// A reader of a crate begins at its `lib.rs`.
#[test]
fn every_library_begins_with_what_it_is_for_and_an_example() {
    let workspace: toml::Table =
        fs::read_to_string(root().join("Cargo.toml")).unwrap().parse().unwrap();
    for member in workspace["workspace"]["members"].as_array().unwrap() {
        let path = root().join(member.as_str().unwrap()).join("src/lib.rs");
        // plcrt and its like are programs only.
        if !path.exists() {
            assert!(path.with_file_name("main.rs").exists(), "{} is missing", path.display());
            continue;
        }
        let text = fs::read_to_string(&path).unwrap();
        let head: Vec<&str> = text.lines().take_while(|line| line.starts_with("//!")).collect();
        assert!(head.len() > 3, "{} says too little of the crate", path.display());
        let fences = head.iter().filter(|line| line.starts_with("//! ```")).count();
        assert!(fences >= 2, "{} has no example", path.display());
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
