//! STruC++: Structured Text to C++.

use std::fs;
use std::path::Path;
use std::process::Command;

use plcc_iec::Project;

use crate::driver::{Place, Reach, done, text};
use crate::source::together;

fn pointer(place: &Place) -> String {
    let name = &place.variable.name;
    match place.element {
        None => format!("it.{name}.raw_ptr()"),
        Some(element) => format!("it.{name}[{element}].raw_ptr()"),
    }
}

const REACH: Reach = Reach {
    instance: |project| format!("strucpp::Program_{} it", project.name),
    begin: |_| String::new(),
    pointer,
    scan: |_| "it.run();".to_owned(),
};

/// Compiles programs in a folder of their own.
pub(crate) fn compile(strucpp: &Path, projects: &[&Project], folder: &Path) -> Result<(), String> {
    fs::write(folder.join("program.st"), together(projects.iter().copied())).unwrap();
    let mut node = Command::new("node");
    node.arg(strucpp.join("dist/node/cli.js")).arg(folder.join("program.st"));
    done(node.arg("-o").arg(folder.join("machine.cpp")).arg("--no-default-libs"))?;
    let driver = format!(
        "#include <cstdio>\n#include <cstdlib>\n#include <cstring>\n#include \"machine.cpp\"\n{}",
        text(projects, &REACH)
    );
    fs::write(folder.join("driver.cpp"), driver).unwrap();
    let mut cc = Command::new("g++");
    cc.args(["-std=c++17", "-w", "-O0", "-I"]).arg(strucpp.join("src/runtime/include"));
    cc.arg("-I").arg(folder).arg(folder.join("driver.cpp")).arg("-o").arg(folder.join("program"));
    done(&mut cc).map(|_| ())
}
