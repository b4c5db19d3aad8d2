//! A program in Structured Text, compiled by matiec, as a process that is told values and tells values.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use plcc_iec::{Project, Type, Variable, structured_text};

/// The folder of matiec, if the environment names one. Otherwise says that the test is skipped.
pub(crate) fn folder() -> Option<PathBuf> {
    let folder = std::env::var_os("PLCC_MATIEC").map(PathBuf::from);
    if folder.is_none() {
        eprintln!(
            "skipped: PLCC_MATIEC does not name a folder with matiec (scripts/full iec builds one)"
        );
    }
    folder
}

/// A compiled program.
pub(crate) struct Compiled {
    program: PathBuf,
    /// Where each value that it tells stands: a variable, or an element of one.
    pub(crate) places: Vec<String>,
}

/// How C reaches a variable's value, or that of an element.
fn in_c(variable: &Variable, element: Option<u32>) -> String {
    let name = &variable.name;
    match (variable.address.is_some(), element) {
        (true, _) => format!("(*(it.{name}.value))"),
        (false, None) => format!("it.{name}.value"),
        (false, Some(element)) => format!("it.{name}.value.table[{element}]"),
    }
}

/// The program in C around the compiled one. It reads lines of pairs, the number of a value and the value itself, runs a scan and
/// writes all values in a line.
fn driver(project: &Project) -> (String, Vec<String>) {
    let mut places = vec![];
    let (mut set, mut tell) = (String::new(), String::new());
    let mut located = BTreeSet::new();
    for variable in &project.variables {
        if let Some(address) = &variable.address {
            located.insert(address.trim_start_matches('%').replace('.', "_"));
        }
        let elements: Vec<Option<u32>> = match variable.elements {
            None => vec![None],
            Some(count) => (0..count).map(Some).collect(),
        };
        for element in elements {
            let c = in_c(variable, element);
            let number = places.len();
            let real = variable.ty == Type::Lreal;
            let cast = if real { "strtod(word, 0)" } else { "strtoll(word, 0, 10)" };
            let _ = writeln!(set, "case {number}: {c} = {cast}; break;");
            let (form, to) = if real { ("%.17g", "double") } else { ("%lld", "long long") };
            let _ = writeln!(tell, "printf(\"{form} \", ({to}){c});");
            places.push(match element {
                None => variable.name.clone(),
                Some(element) => format!("{}[{element}]", variable.name),
            });
        }
    }
    let mut lines = String::new();
    for place in &located {
        let _ = writeln!(lines, "BOOL of_{place}; BOOL *__{place} = &of_{place};");
    }
    let name = &project.name;
    let text = format!(
        "#include <stdio.h>\n#include <stdlib.h>\n#include <string.h>\n#include \"POUS.h\"\n{lines}#include \"POUS.c\"\n\
         TIME __CURRENT_TIME; BOOL __DEBUG;\nstatic {name} it;\nstatic char line[1 << 20];\n\
         int main(void) {{\n{name}_init__(&it, 0);\nwhile (fgets(line, sizeof line, stdin)) {{\n\
         char *word = strtok(line, \" \\n\");\nwhile (word) {{ int number = atoi(word); word = strtok(0, \" \\n\");\n\
         switch (number) {{\n{set}}}\nword = strtok(0, \" \\n\"); }}\n{name}_body__(&it);\n{tell}puts(\"\"); }}\nreturn 0; }}\n"
    );
    (text, places)
}

fn done(command: &mut Command, what: &str, text: &str) {
    let output = command.stdin(Stdio::null()).output().unwrap();
    assert!(
        output.status.success(),
        "{what}:\n{}{}\n{text}",
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr)
    );
}

/// Compiles a program in a folder of its own.
pub(crate) fn compile(matiec: &Path, project: &Project, folder: &Path) -> Compiled {
    let text = structured_text(project);
    fs::write(folder.join("program.st"), &text).unwrap();
    let mut iec2c = Command::new(matiec.join("iec2c"));
    iec2c.arg("-I").arg(matiec.join("lib")).arg("-T").arg(folder).arg(folder.join("program.st"));
    done(&mut iec2c, "iec2c", &text);
    let (driver, places) = driver(project);
    fs::write(folder.join("driver.c"), driver).unwrap();
    let program = folder.join("program");
    let mut cc = Command::new("cc");
    cc.args(["-w", "-O0", "-I"]).arg(matiec.join("lib/C")).arg("-I").arg(folder);
    cc.arg(folder.join("driver.c")).arg("-lm").arg("-o").arg(&program);
    done(&mut cc, "cc", &text);
    Compiled { program, places }
}

impl Compiled {
    /// Runs as many scans as there are lines, and gives the values after each.
    pub(crate) fn run(&self, lines: &str, folder: &Path) -> Vec<Vec<String>> {
        let input = folder.join("input");
        fs::write(&input, lines).unwrap();
        let output =
            Command::new(&self.program).stdin(fs::File::open(&input).unwrap()).output().unwrap();
        assert!(output.status.success(), "{:?}", output.status);
        let text = String::from_utf8(output.stdout).unwrap();
        text.lines().map(|line| line.split_whitespace().map(str::to_owned).collect()).collect()
    }
}
