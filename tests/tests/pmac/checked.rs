//! Downloads that must be right, from their text.
#![allow(clippy::unwrap_used, clippy::panic)]

use plcc_diag::SourceMap;
use plcc_frontend::common::{MemoryLoader, Options};
use plcc_frontend::pmac;

/// The checked program of a text; a panic with the first error if there is one.
pub(crate) fn check(source: &str) -> pmac::Program {
    let mut sources = SourceMap::new();
    let file = sources.add("moved.pmc", source.as_bytes());
    let (program, all) =
        pmac::check(&mut sources, &[file], &MemoryLoader::new(), &Options::default());
    if let Some(error) = all.iter().find(|d| d.is_error()) {
        panic!("{source}\n{}", plcc_diag::render::draw(&sources, error, false));
    }
    program.unwrap()
}
