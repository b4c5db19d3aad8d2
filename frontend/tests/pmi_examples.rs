//! The two complete programs of the manual (PMI 6.1, 6.2) are accepted without errors or warnings.
#![allow(clippy::panic, clippy::unwrap_used)]

mod support;

use std::{collections::HashMap, path::Path};

use plcc_diag::SourceMap;
use plcc_frontend::{
    common::{LintLevels, Machine, MemoryLoader, Options},
    pmi,
};

fn findings(name: &str, machine: Option<&str>) -> Vec<String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/pmi");
    let read = |name: &str| std::fs::read(folder.join(name)).unwrap();
    let machine = machine.map(|name| String::from_utf8(read(name)).unwrap());
    let machine = Machine::parse(&machine.unwrap_or_default()).unwrap();
    let lints = LintLevels::of_machine(&machine).unwrap();
    let options = Options { machine, lints, ..Options::default() };
    let mut sources = SourceMap::new();
    let file = sources.add(name, &read(name));
    let (_, diagnostics) = pmi::check(&mut sources, file, &MemoryLoader::new(), &options);
    let place = |d: &plcc_diag::Diagnostic| sources.line_col(d.span.file, d.span.start).0;
    diagnostics.iter().map(|d| format!("{}:{} {} {}", name, place(d), d.code, d.message)).collect()
}

#[test]
fn the_lathe_is_accepted() {
    assert_eq!(findings("lathe.pmi", None), Vec::<String>::new());
}

#[test]
fn the_touch_screen_program_is_accepted_with_its_machine_file() {
    assert_eq!(findings("touch.pmi", Some("touch.machine.toml")), Vec::<String>::new());
}

/// With the example's stimulus every statement of the lathe's program runs at least once.
#[test]
fn every_statement_of_the_lathe_runs() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/pmi");
    let text = std::fs::read_to_string(folder.join("lathe.pmi")).unwrap();
    let stimulus = std::fs::read_to_string(folder.join("lathe.csv")).unwrap();
    let mut rows: HashMap<u32, Vec<(String, i32)>> = HashMap::new();
    for row in stimulus.lines().skip(1) {
        let mut fields = row.split(',');
        let mut next = || fields.next().unwrap();
        let (tick, name, value) = (next(), next(), next());
        let list = rows.entry(tick.parse().unwrap()).or_default();
        list.push((name.to_owned(), value.parse().unwrap()));
    }
    let mut control = support::Control::new(&text);
    for tick in 0..400 {
        control.set("@IPL", i32::from(tick == 0));
        for (name, value) in rows.remove(&tick).unwrap_or_default() {
            control.set(&name, value);
        }
        control.scan();
        control.set("@CRSET", 0);
    }
    assert!(rows.is_empty());
    let line = |at: u32| text[..at as usize].matches('\n').count() + 1;
    let missed: Vec<_> =
        control.engine.counts().filter(|c| c.1 == 0).map(|c| line(c.0.start)).collect();
    assert_eq!(missed, Vec::<usize>::new());
}
