//! The program around compiled ones, in C or C++: its argument says which program runs. It reads lines of pairs, the number of a value
//! and the value itself, runs a scan and writes all values in a line.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

use plcc_iec::{Project, Type, Variable};

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
    /// The declaration of the program's variable; `it` is to be its name.
    pub(crate) instance: fn(&Project) -> String,
    /// What makes it ready.
    pub(crate) begin: fn(&Project) -> String,
    /// Where a value of it is.
    pub(crate) pointer: fn(&Place) -> String,
    /// Runs a scan.
    pub(crate) scan: fn(&Project) -> String,
}

/// What all programs need: values are reached by their pointers, since compilers take long for a statement that reads or writes each.
const COMMON: &str = r#"
static char line[1 << 20];

static void set(void *at, char type, const char *word) {
  switch (type) {
    case 'b': case 'u': *(unsigned char *)at = atoi(word); break;
    case 'i': *(short *)at = atoi(word); break;
    case 'w': *(unsigned short *)at = atoi(word); break;
    case 'd': *(int *)at = strtoll(word, 0, 10); break;
    case 'l': *(long long *)at = strtoll(word, 0, 10); break;
    case 'r': *(double *)at = strtod(word, 0); break;
  }
}

static void tell(void *at, char type) {
  switch (type) {
    case 'b': case 'u': printf("%d ", *(unsigned char *)at); break;
    case 'i': printf("%d ", *(short *)at); break;
    case 'w': printf("%d ", *(unsigned short *)at); break;
    case 'd': printf("%d ", *(int *)at); break;
    case 'l': printf("%lld ", *(long long *)at); break;
    case 'r': printf("%.17g ", *(double *)at); break;
  }
}

static void run(void (*scan)(void), void **at, const char *types) {
  while (fgets(line, sizeof line, stdin)) {
    char *word = strtok(line, " \n");
    while (word) {
      int number = atoi(word);
      set(at[number], types[number], strtok(0, " \n"));
      word = strtok(0, " \n");
    }
    scan();
    for (int number = 0; types[number]; number++) tell(at[number], types[number]);
    puts("");
  }
}
"#;

/// The letter of a type.
fn letter(ty: Type) -> char {
    match ty {
        Type::Bool => 'b',
        Type::Usint => 'u',
        Type::Int => 'i',
        Type::Uint => 'w',
        Type::Dint => 'd',
        Type::Lint => 'l',
        Type::Lreal => 'r',
    }
}

/// The functions of the programs, and `main`.
pub(crate) fn text(projects: &[&Project], reach: &Reach) -> String {
    let mut out = String::from(COMMON);
    let mut cases = String::new();
    for (number, project) in projects.iter().enumerate() {
        let places = places(project);
        let types: String = places.iter().map(|place| letter(place.variable.ty)).collect();
        let _ = writeln!(
            out,
            "#define it it_{number}\nstatic {};\nstatic void scan_{number}(void) {{ {} }}\n\
             static void run_{number}(void) {{\nstatic void *at[{}];\n{}",
            (reach.instance)(project),
            (reach.scan)(project),
            places.len() + 1,
            (reach.begin)(project)
        );
        for (number, place) in places.iter().enumerate() {
            let _ = writeln!(out, "at[{number}] = (void *){};", (reach.pointer)(place));
        }
        let _ = writeln!(out, "run(scan_{number}, at, \"{types}\"); }}\n#undef it");
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
