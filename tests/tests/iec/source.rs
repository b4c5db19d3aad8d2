//! The text of several programs in one file, so that a compiler reads its library, and a C compiler its headers, once for all of them.

use std::collections::BTreeSet;
use std::path::Path;

use plcc_abi::machine::Machine;
use plcc_diag::SourceMap;
use plcc_frontend::common::{Limits, Options};
use plcc_iec::{Project, structured_text};

use crate::case::{Case, Made, Rules};

/// A program's text in its parts.
pub(crate) struct Parts {
    /// The functions, each with its comment.
    pub(crate) functions: Vec<String>,
    /// From PROGRAM to END_PROGRAM.
    pub(crate) program: String,
    /// The configuration.
    pub(crate) configuration: String,
}

/// The parts of a program.
pub(crate) fn parts(project: &Project) -> Parts {
    const END: &str = "END_FUNCTION\n\n";
    let text = structured_text(project);
    let begin = text.find(&format!("\nPROGRAM {}\n", project.name)).unwrap() + 1;
    let end = begin + text[begin..].find("\nCONFIGURATION ").unwrap() + 1;
    Parts {
        functions: text[..begin]
            .split_inclusive(END)
            .filter(|it| it.ends_with(END))
            .map(str::to_owned)
            .collect(),
        program: text[begin..end].to_owned(),
        configuration: text[end..].to_owned(),
    }
}

/// The options of a file: the machine that a file beside it describes.
pub(crate) fn on_its_machine(path: &Path) -> Options {
    let mut options = Options { limits: Limits::None, ..Options::default() };
    let machine = path.with_extension("machine.toml");
    if machine.exists() {
        options.machine = Machine::parse(&std::fs::read_to_string(machine).unwrap()).unwrap();
    }
    options
}

/// What a source is exported as.
pub(crate) fn exported(rules: &'static Rules, file: &str, source: &str) -> String {
    let mut map = SourceMap::new();
    let id = map.add(file, source.as_bytes());
    match Case::of(rules, &mut map, &[id], String::new(), 0, &Options::default()) {
        Made::Case(case) => structured_text(case.project()),
        Made::NotExported(why) => panic!("{why:?}"),
        Made::Wrong => panic!("{source} has errors"),
    }
}

/// All programs, with each function once, and the configuration of the first one.
pub(crate) fn together<'a>(projects: impl Iterator<Item = &'a Project>) -> String {
    let mut known = BTreeSet::new();
    let (mut functions, mut programs, mut configuration) = (String::new(), String::new(), None);
    for project in projects {
        let parts = parts(project);
        for function in parts.functions {
            let from = function.find("FUNCTION ").unwrap();
            if known.insert(function[from..].to_owned()) {
                functions.push_str(&function);
            }
        }
        programs.push_str(&parts.program);
        configuration.get_or_insert(parts.configuration);
    }
    functions + &programs + &configuration.unwrap()
}
