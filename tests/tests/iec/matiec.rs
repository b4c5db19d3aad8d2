//! matiec: Structured Text to C.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::Command;

use plcc_iec::Project;

use crate::driver::{Place, Reach, done, text};
use crate::source::together;

fn pointer(place: &Place) -> String {
    let name = &place.variable.name;
    match (place.variable.address.is_some(), place.element) {
        (true, _) => format!("it.{name}.value"),
        (false, None) => format!("&it.{name}.value"),
        (false, Some(element)) => format!("&it.{name}.value.table[{element}]"),
    }
}

const REACH: Reach = Reach {
    instance: |project| format!("{} it", project.name),
    begin: |project| format!("{}_init__(&it, 0);", project.name),
    pointer,
    scan: |project| format!("{}_body__(&it);", project.name),
};

/// Compiles programs in a folder of their own.
pub(crate) fn compile(matiec: &Path, projects: &[&Project], folder: &Path) -> Result<(), String> {
    fs::write(folder.join("program.st"), together(projects.iter().copied())).unwrap();
    let mut iec2c = Command::new(matiec.join("iec2c"));
    iec2c.arg("-I").arg(matiec.join("lib")).arg("-T").arg(folder).arg(folder.join("program.st"));
    done(&mut iec2c)?;
    let addresses =
        projects.iter().flat_map(|it| &it.variables).filter_map(|it| it.address.as_ref());
    let places: BTreeSet<String> =
        addresses.map(|it| it.trim_start_matches('%').replace('.', "_")).collect();
    let mut driver = String::from(
        "#include <stdio.h>\n#include <stdlib.h>\n#include <string.h>\n#include \"POUS.h\"\n",
    );
    for place in places {
        let _ = writeln!(driver, "BOOL of_{place}; BOOL *__{place} = &of_{place};");
    }
    driver.push_str("#include \"POUS.c\"\nTIME __CURRENT_TIME; BOOL __DEBUG;\n");
    driver.push_str(&text(projects, &REACH));
    fs::write(folder.join("driver.c"), driver).unwrap();
    let mut cc = Command::new("cc");
    cc.args(["-w", "-O0", "-I"]).arg(matiec.join("lib/C")).arg("-I").arg(folder);
    cc.arg(folder.join("driver.c")).arg("-lm").arg("-o").arg(folder.join("program"));
    done(&mut cc).map(|_| ())
}
