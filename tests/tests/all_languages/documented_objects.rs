//! The tables of `docs/objects.md` are those of the source.
#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::Path;

use plcc_abi::nct::context;
use plcc_abi::pmac::{Controller, Layout};
use plcc_abi::{HostFn, HostType, TrapCode};
use plcc_diag::SourceMap;
use plcc_frontend::common::Options;
use plcc_tests::compile::{EngineKind, compile_sources};

/// The cells of the rows of the page's tables.
fn rows() -> Vec<Vec<String>> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/objects.md");
    let page = fs::read_to_string(path).unwrap().replace("\\|", "or");
    let rows = page.lines().filter_map(|line| line.strip_prefix("| ")?.strip_suffix(" |"));
    let cells = |row: &str| row.split('|').map(|cell| cell.trim().to_owned()).collect();
    rows.map(cells).collect()
}

/// The rows that begin with a number and have so many cells, without their last cell.
fn numbered(count: usize) -> Vec<Vec<String>> {
    let numbered = |row: &Vec<String>| row.len() == count && row[0].parse::<u32>().is_ok();
    rows().into_iter().filter(numbered).map(|row| row[..count - 1].to_vec()).collect()
}

fn type_name(ty: HostType) -> &'static str {
    match ty {
        HostType::I32 => "int",
        HostType::I64 => "long",
        HostType::F64 => "double",
    }
}

#[test]
fn every_function_of_the_host_is_documented_as_it_is() {
    let mut functions = HostFn::ALL.to_vec();
    functions.sort_by_key(|function| *function as u32);
    let expected: Vec<Vec<String>> = functions
        .into_iter()
        .map(|function| {
            let (takes, gives) = function.signature();
            let takes: Vec<&str> = takes.iter().copied().map(type_name).collect();
            vec![
                (function as u32).to_string(),
                format!("`{}`", function.name()),
                takes.join(", "),
                gives.map_or_else(String::new, |ty| type_name(ty).into()),
                if function.is_pure() { "yes" } else { "no" }.into(),
            ]
        })
        .collect();
    assert_eq!(numbered(6), expected);
}

#[test]
fn every_trap_code_is_documented_as_it_is() {
    let row = |code: &TrapCode| vec![(*code as u32).to_string(), format!("`{}`", code.name())];
    let expected: Vec<Vec<String>> = TrapCode::ALL.iter().map(row).collect();
    let found: Vec<_> = numbered(3).into_iter().filter(|row| row[1].starts_with('`')).collect();
    assert_eq!(found, expected);
}

#[test]
fn the_regions_of_a_pmac_lie_where_the_page_says() {
    let regions = |controller| Layout::new(controller).regions();
    let both = regions(Controller::Pmac).into_iter().zip(regions(Controller::Turbo));
    let expected: Vec<Vec<String>> = both
        .map(|(pmac, turbo)| {
            let numbers = [pmac.offset, pmac.size, turbo.offset, turbo.size];
            let name = format!("`{}`", pmac.name);
            std::iter::once(name).chain(numbers.map(|number| number.to_string())).collect()
        })
        .collect();
    let found: Vec<Vec<String>> =
        rows().into_iter().filter(|row| row.len() == 6).map(|row| row[..5].to_vec()).collect();
    let found: Vec<_> = found.into_iter().filter(|row| row[0].starts_with('`')).collect();
    assert_eq!(found, expected);
}

#[test]
fn the_context_of_an_nct_module_is_as_the_page_says() {
    let bytes = [
        (context::OP, 2),
        (context::DEPTH, 2),
        (context::FUEL, 4),
        (context::ON_EMPTY, 1),
        (context::SITES, u32::from(context::MAX_DEPTH) * 4),
    ];
    let row = |(offset, size): (u32, u32)| vec![offset.to_string(), size.to_string()];
    let expected: Vec<_> = bytes.into_iter().map(row).collect();
    let found: Vec<_> = numbered(3).into_iter().filter(|row| !row[1].starts_with('`')).collect();
    // The rows of PMAC's region `exec` follow.
    assert_eq!(found[..expected.len()], expected);
}

/// All regions that a program of a language has are on the page.
#[test]
fn every_region_is_documented() {
    let named: String = rows().into_iter().map(|row| row[0].clone() + " ").collect();
    for (dialect, source) in [
        (plcc_abi::Dialect::Pmi, "$INTEGER\nA\n$END\nA=1\n".to_owned()),
        (plcc_abi::Dialect::Pmi, format!("$INTEGER\nA\n$END\nA=1{}\n", "+A".repeat(2000))),
        (plcc_abi::Dialect::Nct, ":001 J1\n:000 J0\n".to_owned()),
        (plcc_abi::Dialect::Pmac, "I5=2\nOPEN PLC 1 CLEAR\nP1=1\nCLOSE\n".to_owned()),
    ] {
        let mut sources = SourceMap::new();
        let file = sources.add("case", source.as_bytes());
        let options = Options { limits: plcc_frontend::common::Limits::None, ..Options::default() };
        let compiled = compile_sources(&mut sources, &[file], dialect, &options).unwrap();
        let (program, _) = compiled.engine(EngineKind::Statements).unwrap();
        for region in &program.regions {
            assert!(named.contains(&format!("`{}`", region.name)), "{dialect:?} {}", region.name);
        }
    }
}
