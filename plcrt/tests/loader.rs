//! What the loader is made of, and what it says to files that are not artifacts.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::collections::BTreeSet;
use std::process::{Command, Output};

/// Packages of a compiler. plcc-diag is none: a part program, which a simulated control reads, has diagnostics too.
const COMPILER: [&str; 3] = ["plcc-ir", "plcc-frontend", "plcc-codegen"];

fn plcrt(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_plcrt")).args(args).output().unwrap()
}

/// Everything that the package needs by these edges of the tree of dependencies.
fn needed(edges: &str) -> BTreeSet<String> {
    let output = Command::new(env!("CARGO"))
        .args(["tree", "--offline", "--locked", "--edges", edges, "--prefix", "none"])
        .args(["--package", "plcrt", "--format", "{p}"])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).unwrap();
    text.lines().filter_map(|line| line.split(' ').next()).map(str::to_owned).collect()
}

#[test]
fn the_loader_depends_on_no_compiler() {
    let needed = needed("normal,build");
    assert!(needed.contains("plcc-runtime") && needed.contains("plcc-abi"), "{needed:?}");
    for name in &needed {
        let compiles = COMPILER.contains(&name.as_str()) || name.starts_with("cranelift");
        assert!(!compiles, "plcrt depends on {name}");
    }
}

#[test]
fn what_is_no_artifact_is_refused() {
    let here = env!("CARGO_MANIFEST_DIR");
    for (file, part) in [("Cargo.toml", "Cargo.toml"), ("missing.plcx", "missing.plcx")] {
        let output = plcrt(&[&format!("{here}/{file}"), "--ticks", "1"]);
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{message}");
        assert!(message.starts_with("error: ") && message.contains(part), "{message}");
        assert!(output.stdout.is_empty());
    }
}

/// None of these may hang: nobody writes to the FIFO, and `/dev/zero` has no end.
#[cfg(target_os = "linux")]
#[test]
fn devices_and_pipes_are_no_artifacts() {
    let fifo = std::env::temp_dir().join(format!("plcrt-fifo-{}", std::process::id()));
    assert!(Command::new("mkfifo").arg(&fifo).status().unwrap().success());
    for path in ["/dev/zero", fifo.to_str().unwrap()] {
        for args in [&[path, "--ticks", "1"][..], &["--info", path]] {
            let output = plcrt(args);
            let message = String::from_utf8_lossy(&output.stderr).into_owned();
            assert_eq!(output.status.code(), Some(2), "{message}");
            assert!(message.contains("only regular files are read"), "{message}");
        }
    }
    std::fs::remove_file(fifo).unwrap();
}

#[test]
fn wrong_usage_gives_exit_status_2() {
    for args in
        [&[][..], &["x.plcx", "--ticks"], &["x.plcx", "--ticks", "1", "--for", "1s"], &["run"]]
    {
        assert_eq!(plcrt(args).status.code(), Some(2), "{args:?}");
    }
    assert_eq!(plcrt(&["--help"]).status.code(), Some(0));
}

#[test]
fn completions_and_the_manual_page_name_the_options() {
    for args in [&["--completions", "bash"][..], &["--completions", "fish"], &["--man"]] {
        let output = plcrt(args);
        let text = String::from_utf8(output.stdout).unwrap();
        assert_eq!(output.status.code(), Some(0), "{args:?}");
        assert!(text.contains("plcrt") && text.contains("stimulus"), "{args:?}: {text}");
    }
    // The earlier spellings, as options, do the same as the commands.
    for (command, option) in
        [(&["man"][..], &["--man"][..]), (&["completions", "zsh"], &["--completions", "zsh"])]
    {
        assert_eq!(plcrt(command).stdout, plcrt(option).stdout);
    }
    let folder = std::env::temp_dir().join(format!("plcrt-man-{}", std::process::id()));
    assert_eq!(plcrt(&["man", "--dir", folder.to_str().unwrap()]).status.code(), Some(0));
    let run = std::fs::read_to_string(folder.join("plcrt-run.1")).unwrap();
    assert!(run.contains("stimulus") && !run.contains("check\\-config"), "{run}");
    assert!(folder.join("plcrt.1").exists() && folder.join("plcrt-check-config.1").exists());
    std::fs::remove_dir_all(folder).unwrap();
    let page = String::from_utf8(plcrt(&["--man"]).stdout).unwrap();
    assert!(page.contains("\\fBplcrt\\fR [OPTIONS] [ARTIFACT]"), "{page}");
    assert_eq!(plcrt(&["--completions", "none"]).status.code(), Some(2));
    assert_eq!(plcrt(&["--man", "x.plcx"]).status.code(), Some(2));
}

#[test]
fn info_is_given_for_artifacts_only() {
    let here = env!("CARGO_MANIFEST_DIR");
    let artifact = format!("{here}/Cargo.toml");
    for command in ["info", "--info"] {
        let output = plcrt(&[command, &artifact]);
        assert_eq!(output.status.code(), Some(2));
        assert!(output.stdout.is_empty());
    }
}
