//! Cross-references: where a program reads, writes and tests each of its variables.

use std::collections::BTreeMap;
use std::fmt;

use plcc_abi::natural_cmp;
use plcc_diag::{Diagnostic, FileId, SourceMap};

/// Where a variable occurs in one file. The lists hold line numbers, from 1, in rising order, each
/// once.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct CrossReferenceRow {
    /// The variable.
    pub name: String,
    /// The file that the lines are of.
    pub file: String,
    /// What the variable means to the control, where it has a meaning.
    pub meaning: Option<String>,
    /// Where its value is loaded or computed with.
    pub read: Vec<u32>,
    /// Where it gets a value.
    pub written: Vec<u32>,
    /// Where a condition looks at it.
    pub tested: Vec<u32>,
}

/// A program's cross-reference. [`Display`](fmt::Display) writes it as a table, a line for each
/// row.
#[derive(Clone, Debug, Default)]
pub struct CrossReference {
    /// A row for each variable and each file that it occurs in, in natural sort order.
    pub rows: Vec<CrossReferenceRow>,
    /// Variables that seem to be forgotten or used by mistake; only NCT's cross-reference looks for
    /// them.
    pub warnings: Vec<Diagnostic>,
}

/// How a statement uses a variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Use {
    /// Its value is loaded or computed with.
    Read,
    /// It gets a value.
    Written,
    /// A condition looks at it.
    Tested,
}

/// Collects the uses of variables.
#[derive(Debug, Default)]
pub struct CrossReferenceBuilder {
    /// By name and file.
    rows: BTreeMap<(String, FileId), CrossReferenceRow>,
}

impl CrossReferenceBuilder {
    /// Adds a use of a variable in a line of a file.
    pub fn add(&mut self, name: &str, sources: &SourceMap, file: FileId, line: u32, used: Use) {
        let row = self.rows.entry((name.to_owned(), file)).or_insert_with(|| CrossReferenceRow {
            name: name.to_owned(),
            file: sources.path(file).to_owned(),
            ..CrossReferenceRow::default()
        });
        match used {
            Use::Read => row.read.push(line),
            Use::Written => row.written.push(line),
            Use::Tested => row.tested.push(line),
        }
    }

    /// The cross-reference of all uses that were added. `meaning` says what a variable means to the
    /// control, or `None`.
    pub fn finish(self, meaning: impl Fn(&str) -> Option<String>) -> CrossReference {
        let mut rows: Vec<CrossReferenceRow> = self.rows.into_values().collect();
        rows.sort_by(|a, b| natural_cmp(&a.name, &b.name));
        for row in &mut rows {
            row.meaning = meaning(&row.name);
            for lines in [&mut row.read, &mut row.written, &mut row.tested] {
                lines.sort_unstable();
                lines.dedup();
            }
        }
        CrossReference { rows, warnings: vec![] }
    }
}

fn lines(lines: &[u32]) -> String {
    if lines.is_empty() {
        return "-".into();
    }
    lines.iter().map(u32::to_string).collect::<Vec<_>>().join(" ")
}

impl fmt::Display for CrossReference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let several = self.rows.array_windows().any(|[a, b]| a.file != b.file);
        let heads = ["name", "written", "read", "tested", "meaning"].map(str::to_owned);
        let rows = self.rows.iter().map(|row| {
            let name =
                if several { format!("{} {}", row.name, row.file) } else { row.name.clone() };
            let meaning = row.meaning.clone().unwrap_or_default();
            [name, lines(&row.written), lines(&row.read), lines(&row.tested), meaning]
        });
        let rows: Vec<[String; 5]> = std::iter::once(heads).chain(rows).collect();
        let width = |column: usize| {
            let widths = rows.iter().map(|row| row.get(column).map_or(0, String::len));
            widths.max().unwrap_or(0).min(40)
        };
        let widths = [width(0), width(1), width(2), width(3)];
        for [name, written, read, tested, meaning] in &rows {
            let [a, b, c, d] = widths;
            let line = format!("{name:a$}  {written:b$}  {read:c$}  {tested:d$}  {meaning}");
            writeln!(f, "{}", line.trim_end())?;
        }
        Ok(())
    }
}
