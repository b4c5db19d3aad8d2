//! The program around compiled ones, in C or C++: its argument says which program runs. It reads lines of pairs, the number of a value
//! and the value itself, runs a scan and writes all values in a line.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

use plcc_iec::{Kind, Project, Type, Variable};

/// A variable, or an element of an array.
#[derive(Clone, Copy)]
pub(crate) struct Place<'a> {
    pub(crate) variable: &'a Variable,
    pub(crate) element: Option<u32>,
}

/// All values of a program, in the order of their numbers.
pub(crate) fn places(project: &Project) -> Vec<Place<'_>> {
    let elements = |variable: &Variable| match variable.elements {
        None => vec![None],
        Some(count) => (0..count).map(Some).collect(),
    };
    let of =
        |variable| elements(variable).into_iter().map(move |element| Place { variable, element });
    project.variables.iter().flat_map(of).collect()
}

impl Place<'_> {
    /// As Structured Text calls it.
    pub(crate) fn name(&self) -> String {
        match self.element {
            None => self.variable.name.clone(),
            Some(element) => format!("{}[{element}]", self.variable.name),
        }
    }
}

/// How C reaches what a program has.
pub(crate) struct Reach {
    /// The variable `it` of a program, and what makes it ready.
    pub(crate) instance: fn(&Project) -> String,
    /// A value of it, to read.
    pub(crate) read: fn(&Place) -> String,
    /// The same, to write.
    pub(crate) write: fn(&Place) -> String,
    /// Runs a scan.
    pub(crate) scan: fn(&Project) -> String,
}

/// The functions of the programs, and `main`.
pub(crate) fn text(projects: &[&Project], reach: &Reach) -> String {
    let mut out = String::from("static char line[1 << 20];\n");
    let mut cases = String::new();
    for (number, project) in projects.iter().enumerate() {
        let (mut set, mut tell) = (String::new(), String::new());
        for (number, place) in places(project).into_iter().enumerate() {
            let real = place.variable.ty == Type::Lreal;
            let value = if real { "strtod(word, 0)" } else { "strtoll(word, 0, 10)" };
            if place.variable.kind != Kind::Constant {
                let _ = writeln!(set, "case {number}: {} = {value}; break;", (reach.write)(&place));
            }
            let (form, to) = if real { ("%.17g", "double") } else { ("%lld", "long long") };
            let _ = writeln!(tell, "printf(\"{form} \", ({to}){});", (reach.read)(&place));
        }
        let _ = writeln!(
            out,
            "static void run_{number}(void) {{\n{}\nwhile (fgets(line, sizeof line, stdin)) {{\n\
             char *word = strtok(line, \" \\n\");\nwhile (word) {{ int number = atoi(word); word = strtok(0, \" \\n\");\n\
             switch (number) {{\n{set}}}\nword = strtok(0, \" \\n\"); }}\n{}\n{tell}puts(\"\"); }} }}",
            (reach.instance)(project),
            (reach.scan)(project),
        );
        let _ = writeln!(cases, "case {number}: run_{number}(); break;");
    }
    let _ = writeln!(
        out,
        "int main(int count, char **words) {{ switch (atoi(words[1])) {{\n{cases}}}\nreturn 0; }}"
    );
    out
}

/// Runs a command. Where it fails, gives what it said.
pub(crate) fn done(command: &mut Command) -> Result<String, String> {
    let output = command.stdin(Stdio::null()).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let said = text(&output.stdout) + &text(&output.stderr);
    if output.status.success() { Ok(said) } else { Err(said) }
}

/// Runs a program of those that were compiled: as many scans as there are lines. Gives a line with the values after each.
pub(crate) fn run(folder: &Path, number: usize, lines: &str) -> Result<String, String> {
    let input = folder.join("input");
    fs::write(&input, lines).unwrap();
    let mut program = Command::new(folder.join("program"));
    let output =
        program.arg(number.to_string()).stdin(fs::File::open(&input).unwrap()).output().unwrap();
    if !output.status.success() {
        return Err(format!("{:?}: {}", output.status, String::from_utf8_lossy(&output.stderr)));
    }
    Ok(String::from_utf8(output.stdout).unwrap())
}
