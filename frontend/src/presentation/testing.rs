//! What tests share.

use plcc_abi::Dialect;
use plcc_diag::SourceMap;

use super::StatementPlaces;
use crate::common::{MemoryLoader, Options};
use crate::language;

/// Number, text and comment of the rows of a program that may include files.
pub(crate) fn shown(dialect: Dialect, text: &str, included: &[(&str, &str)]) -> Vec<[String; 3]> {
    let mut sources = SourceMap::new();
    let file = sources.add("main", text.as_bytes());
    let loader = included
        .iter()
        .fold(MemoryLoader::new(), |loader, (path, text)| loader.with(*path, text.as_bytes()));
    let (checked, found) =
        language(dialect).check(&mut sources, &[file], &loader, &Options::default());
    let checked = checked.unwrap_or_else(|| panic!("{found:?}"));
    let places = StatementPlaces::new(checked.as_ref(), &sources);
    let rows = checked.text(&sources, &places);
    rows.into_iter()
        .map(|row| [row.text(), row.comment, row.number])
        .map(|[text, comment, number]| [number, text, comment])
        .collect()
}
