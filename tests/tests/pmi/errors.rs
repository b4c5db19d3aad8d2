//! For every error of PMI's list that a program can have (PMI 4.5), and for our own codes, there is a
//! file in `tests/errors/pmi` with the code as name, and a snapshot of what is drawn for it.
#![allow(clippy::unwrap_used)]

use std::path::Path;

use plcc_diag::{Diagnostic, SourceMap, lints::lint_of_code, render::draw};
use plcc_frontend::{
    common::{MemoryLoader, Options},
    pmi,
};

fn drawn(name: &str, folder: &Path) -> (Vec<Diagnostic>, String) {
    let bytes = std::fs::read(folder.join(name)).unwrap();
    let nested = std::fs::read(folder.join("nested.inc")).unwrap();
    let loader = MemoryLoader::new().with("nested.inc", nested);
    let mut sources = SourceMap::new();
    let file = sources.add(name, &bytes);
    let (_, all) = pmi::check(&mut sources, file, &loader, &Options::default());
    let text: String = all.iter().map(|d| draw(&sources, d, false)).collect();
    (all, text)
}

#[test]
fn each_code_has_a_wrong_program_and_its_drawn_error() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("errors/pmi");
    // 40 needs `--limits none`, 45 is never reported.
    for info in plcc_diag::codes::pmi::CODES {
        let number = info.code.trim_start_matches("PMI-");
        // X3 to X5 need megabytes (cli/tests/budgets.rs), X6 is told by `plcc export` alone (cli/tests/export.rs); lints have programs of their own
        // (tests/all_languages/lints.rs).
        if matches!(number, "40" | "45" | "X3" | "X4" | "X5" | "X6")
            || lint_of_code(info.code).is_some()
        {
            continue;
        }
        let stem = format!("{number:0>2}");
        let (all, text) = drawn(&format!("{stem}.pmi"), &folder);
        assert!(all.iter().any(|d| d.code == info.code), "{}: {all:#?}", info.code);
        assert!(all.iter().all(|d| d.help.is_some() || !d.is_error()), "{text}");
        insta::assert_snapshot!(format!("pmi_{stem}"), text);
    }
}
