//! Coverage in the form of LCOV, which `genhtml` and many editors and servers read.

use std::collections::BTreeMap;
use std::fmt::Write;

use super::Coverage;

/// A record for each source file: how often each line ran, and for each contact two branches, one for each result that it
/// decided.
pub fn lcov(all: &[Coverage], path: &dyn Fn(&str) -> String) -> String {
    let mut text = String::from("TN:\n");
    for coverage in all {
        for file in coverage.files() {
            let statements =
                || coverage.statements.iter().filter(move |statement| statement.span.file == file);
            // Writing to memory does not fail.
            let _ = writeln!(text, "SF:{}", path(coverage.sources.path(file)));
            let mut branches: BTreeMap<u32, Vec<Option<u64>>> = BTreeMap::new();
            let mut lines: BTreeMap<u32, u64> = BTreeMap::new();
            for statement in statements() {
                let runs = lines.entry(statement.line).or_default();
                *runs = (*runs).max(statement.runs);
                let sides = statement.contacts.iter().flat_map(|contact| {
                    let ran = |count: u64| (statement.runs > 0).then_some(count);
                    [ran(contact.counts.decided_zero), ran(contact.counts.decided_one)]
                });
                branches.entry(statement.line).or_default().extend(sides);
            }
            let all_branches = || {
                branches.iter().flat_map(|(line, sides)| sides.iter().map(move |side| (line, side)))
            };
            for (line, sides) in &branches {
                for (number, side) in sides.iter().enumerate() {
                    let taken = side.map_or_else(|| "-".to_owned(), |count| count.to_string());
                    let _ = writeln!(text, "BRDA:{line},0,{number},{taken}");
                }
            }
            let hit =
                all_branches().filter(|(_, side)| side.is_some_and(|count| count > 0)).count();
            let _ = writeln!(text, "BRF:{}\nBRH:{hit}", all_branches().count());
            for (line, runs) in &lines {
                let _ = writeln!(text, "DA:{line},{runs}");
            }
            let hit = lines.values().filter(|runs| **runs > 0).count();
            let _ = writeln!(text, "LF:{}\nLH:{hit}\nend_of_record", lines.len());
        }
    }
    text
}
