//! Compiles the examples of docs/pmac.md: each must get exactly the diagnostics that it names.
//!
//! What stands after ```` ```pmac ```` is `turbo` for `--controller turbo`, a code for each
//! diagnostic in the order of their places, or the name of a file for examples that include it.
#![allow(clippy::unwrap_used)]

use std::path::Path;

use plcc_diag::SourceMap;
use plcc_frontend::common::{Controller, MemoryLoader, Options};
use plcc_frontend::pmac;

/// The words after ```` ``` ````, the number of that line, and the text of the example.
type Example = (Vec<String>, usize, String);

fn examples(text: &str) -> Vec<Example> {
    let mut found = Vec::new();
    let mut open: Option<Example> = None;
    for (line, number) in text.lines().zip(1..) {
        match (&mut open, line.strip_prefix("```")) {
            (None, Some(info)) => {
                let words = info.split_whitespace().map(str::to_owned).collect();
                open = Some((words, number, String::new()));
            }
            (Some(_), Some(_)) => found.extend(open.take()),
            (Some((.., text)), None) => {
                text.push_str(line);
                text.push('\n');
            }
            (None, None) => {}
        }
    }
    assert!(open.is_none(), "a fence is not closed");
    found.retain(|(words, ..)| words.first().is_some_and(|word| word == "pmac"));
    found
}

#[test]
fn examples_in_the_docs_get_the_diagnostics_they_name() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/pmac.md");
    let examples = examples(&std::fs::read_to_string(path).unwrap());
    assert!(examples.len() >= 19, "{} examples", examples.len());
    let mut loader = MemoryLoader::new();
    let mut wrong = Vec::new();
    for (words, line, text) in &examples {
        if let Some(name) = words.iter().find(|word| word.contains('.')) {
            loader = loader.with(name, text.as_bytes());
            continue;
        }
        let turbo = words.iter().any(|word| word == "turbo");
        let controller = if turbo { Controller::Turbo } else { Controller::Pmac };
        let options = Options { controller, ..Options::default() };
        let mut sources = SourceMap::new();
        let file = sources.add("example.pmc", text.as_bytes());
        let (_, mut diagnostics) = pmac::check(&mut sources, &[file], &loader, &options);
        diagnostics.retain(|diagnostic| diagnostic.code != "PMAC-W2");
        diagnostics.sort_by_key(|diagnostic| diagnostic.span.start);
        let codes: Vec<&str> = diagnostics.iter().map(|diagnostic| diagnostic.code).collect();
        let named: Vec<&String> = words.iter().filter(|word| word.starts_with("PMAC-")).collect();
        if codes != named {
            let all: Vec<String> = diagnostics
                .iter()
                .map(|d| format!("{} {}", sources.line_col(d.span.file, d.span.start).0, d.message))
                .collect();
            wrong.push(format!("line {line}: {named:?} expected, {codes:?} found: {all:?}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
