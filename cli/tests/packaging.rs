//! What is released. The Debian package is built from the programs under test, and its files are
//! unpacked into a folder and used there; where dpkg-deb is missing this is skipped with a word.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used)]

mod support;
#[path = "../../tests/src/tools.rs"]
mod tools;

use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use support::programs;

fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}

/// The files of libplcrt.
const LIBRARIES: [&str; 2] = ["libplcrt.so", "libplcrt.a"];

/// The folder of libplcrt: that of the test, if all of the workspace is tested; else it is built.
fn libraries() -> PathBuf {
    let own = std::env::current_exe().unwrap();
    let beside = own.parent().unwrap();
    if LIBRARIES.iter().all(|library| beside.join(library).is_file()) {
        return beside.to_owned();
    }
    let profile = beside.parent().unwrap();
    let mut cargo = Command::new(env!("CARGO"));
    cargo.args(["build", "--quiet", "--offline", "--package", "libplcrt", "--target-dir"]);
    cargo.arg(profile.parent().unwrap()).current_dir(root());
    if profile.ends_with("release") {
        cargo.arg("--release");
    }
    done(&mut cargo);
    profile.to_owned()
}

/// Runs a command to its end; it must succeed.
fn done(command: &mut Command) -> String {
    let Output { status, stdout, stderr } = command.output().unwrap();
    assert!(status.success(), "{command:?}: {}", String::from_utf8_lossy(&stderr));
    String::from_utf8(stdout).unwrap()
}

#[test]
fn the_package_holds_programs_that_run() {
    if !tools::is_there("dpkg-deb") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let parts = folder.path().join("parts");
    fs::create_dir(&parts).unwrap();
    for program in ["plcc", "plcrt", "plcctl", "plcio"] {
        symlink(programs().join(program), parts.join(program)).unwrap();
    }
    let libraries = libraries();
    for library in LIBRARIES {
        symlink(libraries.join(library), parts.join(library)).unwrap();
    }
    let mut build = Command::new(root().join("scripts/deb"));
    build.env("DEB_COMPRESSION", "none").arg(&parts).arg(folder.path());
    build.env("DEBFULLNAME", "A Packager").env("DEBEMAIL", "packager@example.org");
    done(&mut build);
    let architecture = done(Command::new("dpkg").arg("--print-architecture"));
    let name = format!("plcc_{}_{}.deb", env!("CARGO_PKG_VERSION"), architecture.trim());
    let package = folder.path().join(name);

    let listing = done(Command::new("dpkg-deb").arg("--contents").arg(&package));
    for (mode, file) in [
        ("-rwxr-xr-x", "./usr/bin/plcc"),
        ("-rwxr-xr-x", "./usr/bin/plcrt"),
        ("-rwxr-xr-x", "./usr/bin/plcctl"),
        ("-rwxr-xr-x", "./usr/bin/plcio"),
        ("-rw-r--r--", "/libplcrt.a"),
        ("-rw-r--r--", "/libplcrt.so"),
        ("-rw-r--r--", "./usr/include/plcrt.h"),
        ("-rw-r--r--", "./usr/include/plcc_image.h"),
        ("-rw-r--r--", "./usr/share/man/man1/plcio.1.gz"),
        ("-rw-r--r--", "./usr/share/man/man1/plcc.1.gz"),
        ("-rw-r--r--", "./usr/share/man/man1/plcc-run.1.gz"),
        ("-rw-r--r--", "./usr/share/man/man1/plcrt.1.gz"),
        ("-rw-r--r--", "./usr/share/man/man1/plcctl.1.gz"),
        ("-rw-r--r--", "./usr/share/bash-completion/completions/plcctl"),
        ("-rw-r--r--", "./usr/share/zsh/vendor-completions/_plcc"),
        ("-rw-r--r--", "./usr/share/fish/vendor_completions.d/plcrt.fish"),
        ("-rw-r--r--", "./usr/lib/systemd/system/plcrt@.service"),
        ("-rw-r--r--", "./usr/lib/systemd/system/plcio@.service"),
        ("-rw-r--r--", "./usr/lib/systemd/system/plcrt-operator@.service"),
        ("-rw-r--r--", "./usr/lib/sysusers.d/plcrt.conf"),
        ("-rw-r--r--", "./usr/lib/tmpfiles.d/plcrt.conf"),
        ("-rw-r--r--", "./usr/share/doc/plcc/copyright"),
        ("-rw-r--r--", "./usr/share/doc/plcc/examples/pmi/lathe.pmi"),
        ("-rwxr-xr-x", "./usr/share/doc/plcc/examples/linuxcnc-lathe/commands"),
        ("drwxr-xr-x", "./etc/plcrt/"),
    ] {
        let has = |line: &str| {
            line.starts_with(mode) && line.contains(" root/root ") && line.ends_with(file)
        };
        assert!(listing.lines().any(has), "{mode} {file} is missing in\n{listing}");
    }
    let control = done(Command::new("dpkg-deb").arg("--field").arg(&package));
    assert!(control.contains("Maintainer: A Packager <packager@example.org>\n"));
    assert!(control.contains("Package: plcc\n") && control.contains("Depends: libc6 (>= 2."));

    let unpacked = folder.path().join("unpacked");
    done(Command::new("dpkg").arg("-x").arg(&package).arg(&unpacked));
    for program in ["plcc", "plcrt", "plcctl", "plcio"] {
        let version = done(Command::new(unpacked.join("usr/bin").join(program)).arg("--version"));
        let first = format!("{program} {}\n", env!("CARGO_PKG_VERSION"));
        assert!(version.starts_with(&first), "{version}");
        assert_eq!(version.contains("drivers: modbus-tcp, modbus-rtu"), program == "plcio");
        let bytes = fs::read(unpacked.join("usr/bin").join(program)).unwrap();
        let holds = |text: &str| bytes.windows(text.len()).any(|part| part == text.as_bytes());
        assert!(!holds(".debug_line\0"), "{program} has tables of lines");
        // Those that run programs keep the symbols that gdb asks for.
        let runs = ["plcc", "plcrt"].contains(&program);
        assert_eq!(holds("__jit_debug_register_code\0"), runs, "{program}");
    }
    let example = unpacked.join("usr/share/doc/plcc/examples/pmi/lathe.pmi");
    let mut check = Command::new(unpacked.join("usr/bin/plcc"));
    done(check.arg("check").arg(example));

    for program in ["plcrt", "plcio"] {
        verify_unit(&unpacked, program);
    }
}

/// Has systemd read a program's unit, with the path of the unpacked program, where systemd is installed.
fn verify_unit(unpacked: &Path, name: &str) {
    let text = fs::read_to_string(root().join(format!("packaging/{name}@.service"))).unwrap();
    let program = unpacked.join("usr/bin").join(name);
    let text = text.replace(&format!("/usr/bin/{name}"), program.to_str().unwrap());
    let text = text.replace(&format!("Documentation=man:{name}(1)\n"), "");
    let unit = unpacked.join(format!("{name}@.service"));
    fs::write(&unit, text).unwrap();
    match Command::new("systemd-analyze").arg("verify").arg(&unit).output() {
        Ok(Output { stderr, .. }) => {
            let complaints = String::from_utf8_lossy(&stderr);
            assert!(!complaints.contains(&format!("{name}@")), "{complaints}");
        }
        Err(_) => tools::missing("systemd-analyze", "is not installed"),
    }
}

/// Runs scripts/release-notes for a tag, in a folder with this changelog.
fn release_notes(changelog: &str, tag: &str) -> Output {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("scripts")).unwrap();
    for file in ["scripts/release-notes", "Cargo.toml"] {
        fs::copy(root().join(file), folder.path().join(file)).unwrap();
    }
    fs::write(folder.path().join("CHANGELOG.md"), changelog).unwrap();
    let script = folder.path().join("scripts/release-notes");
    Command::new("bash").arg(script).arg(tag).output().unwrap()
}

#[test]
fn the_notes_of_a_release_are_its_section_of_the_changelog() {
    let version = env!("CARGO_PKG_VERSION");
    let tag = format!("v{version}");
    let changelog = format!(
        "# Changelog\n\n## [Unreleased]\n\n- later\n\n## [{version}] - 2026-11-22\n\n### Added\n\n\
         - this\n\n## [0.0.1] - 2026-01-01\n\n- before\n"
    );
    let notes = release_notes(&changelog, &tag);
    assert_eq!(String::from_utf8_lossy(&notes.stdout), "\n### Added\n\n- this\n");
    for (changelog, tag, part) in [
        (changelog.as_str(), "v99.0.0", "is not the version"),
        ("# Changelog\n\n## [Unreleased]\n\n- later\n", tag.as_str(), "has no section"),
    ] {
        let refused = release_notes(changelog, tag);
        assert_eq!(refused.status.code(), Some(2));
        assert!(String::from_utf8_lossy(&refused.stderr).contains(part));
    }
}

#[test]
fn the_release_workflow_calls_scripts_that_exist() {
    let workflow = fs::read_to_string(root().join(".github/workflows/release.yml")).unwrap();
    let words = workflow.split_whitespace();
    let called: Vec<&str> =
        words.filter(|word| word.starts_with("scripts/") || word.starts_with(".ci/")).collect();
    assert_eq!(called, [".ci/run", "scripts/release-notes", "scripts/deb"]);
    for script in called {
        assert!(root().join(script).is_file(), "{script}");
    }
}
