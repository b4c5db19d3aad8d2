//! The two programs of docs/image.md, in C and in Rust, with a running control: they are those of `image/examples`, can be
//! compiled as the page says, and do what it says.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use plcc_abi::Dialect;
use plcc_image::ImageReader;
use plcc_tests::loader::{Folder, wait_until};
use plcc_tests::programs::build;

/// The pump runs while the door is closed.
const PMI: &str = "$INPUT\nDOOR = 0/0\n$OUTPUT\nPUMP = 2/0\n$END\nPUMP = /DOOR\n";
const CONFIGURATION: &str = "artifact = \"p.plcx\"\nimage = \"image\"\nperiod = 2\noverrun = \"skip\"\n\
    [[io]]\nname = \"DOOR\"\ndriver = \"other\"\nsafe = 1\ntimeout_ms = 2000\n\
    [[io]]\nname = \"PUMP\"\ndriver = \"other\"\n";

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// A folder with a control that runs, and the program that is started with the path of its image and a number of rounds.
fn drives(name: &str, program: &Path) {
    let folder = Folder::new(name);
    folder.artifact("p.plcx", Dialect::Pmi, PMI);
    fs::write(folder.path("c.toml"), CONFIGURATION).unwrap();
    let mut control = folder.start(&["--config", "c.toml"]);
    let path = folder.path("image");
    wait_until("the control goes on", || {
        ImageReader::open(&path).is_ok_and(|image| image.last_tick() != 0)
    });
    let output = Command::new(program).arg(&path).arg("250").output().unwrap();
    let (text, errors) = (String::from_utf8(output.stdout).unwrap(), output.stderr);
    assert!(output.status.success(), "{}: {}", output.status, String::from_utf8_lossy(&errors));
    // Before the first round the door counts as open.
    let text = text.strip_prefix("PUMP 0\n").unwrap_or(&text);
    assert_eq!(text, "PUMP 1\nPUMP 0\nPUMP 1\nPUMP 0\nPUMP 1\n");
    control.signal("TERM", 1);
    control.end();
}

#[test]
fn the_page_has_the_programs_of_the_examples() {
    let page = fs::read_to_string(root().join("docs/image.md")).unwrap();
    for (fence, name) in [("c", "driver.c"), ("rust", "driver.rs")] {
        let program = fs::read_to_string(root().join("image/examples").join(name)).unwrap();
        let block = format!("\n```{fence} {name}\n{program}```\n");
        assert!(page.contains(&block), "docs/image.md has another {name}");
    }
}

#[test]
fn the_program_in_c_drives_a_control() {
    let folder = Folder::new("driver-c");
    let program = folder.path("driver");
    let mut compiler = Command::new("cc");
    compiler.args(["-Wall", "-Wextra", "-Werror", "-I"]).arg(root().join("image/include"));
    compiler.arg("-o").arg(&program).arg(root().join("image/examples/driver.c"));
    assert!(compiler.status().unwrap().success());
    drives("image-c", &program);
}

#[test]
fn the_program_in_rust_drives_a_control() {
    let profile = build(&["--example", "driver"]);
    drives("image-rust", &profile.join("examples/driver"));
}
