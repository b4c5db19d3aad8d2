//! The loader of the front ends' tables of names (`reference/*.tsv`). It accepts nothing malformed,
//! and its errors say where a table is wrong.
//!
//! A table is a text of lines. The first line names the columns, every other line is a row with one
//! cell for each column; tabs separate cells. There are no quotes, no escapes, no comments and no
//! blank lines. The tables are part of the compiler, so a mistake in one is a mistake of ours:
//! nothing is guessed or left out, and each table has a unit test that loads it.
//!
//! The csv crate is not used. It copies each cell, whereas these rows borrow the cells from the
//! built-in text; and its errors name a cell by its number, whereas these name its column.
//!
//! ```
//! use plcc_frontend::common::tsv;
//!
//! let text = "name\ttype\tsize\n@FRO\tinteger\t0\n@NHOME\tlogical\t32\n";
//! let rows = tsv::load("sizes.tsv", text, &["name", "type", "size"], str::cmp, |row| {
//!     let is_logical = row.word("type", &[("logical", true), ("integer", false)])?;
//!     Ok((row.text("name")?, is_logical, row.number("size", 0..=100)?))
//! });
//! assert_eq!(rows, Ok(vec![("@FRO", false, 0), ("@NHOME", true, 32)]));
//!
//! let text = "name\tsize\n@FRO\tmany\n";
//! let rows = tsv::load("sizes.tsv", text, &["name", "size"], str::cmp, |row| {
//!     row.number("size", 0..=100)
//! });
//! assert_eq!(
//!     rows.map_err(|error| error.to_string()),
//!     Err("sizes.tsv:2: size: `many` is not a number from 0 to 100".to_owned()),
//! );
//! ```

use std::{cmp::Ordering, fmt::Display, ops::RangeInclusive, str::FromStr};

use thiserror::Error;

/// What is wrong with a table, and where.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{file}:{line}: {}{message}", column.map(|name| format!("{name}: ")).unwrap_or_default())]
pub struct TsvError {
    /// The table's file.
    pub file: &'static str,
    /// The line, from 1.
    pub line: u32,
    /// The column, where one cell is wrong.
    pub column: Option<&'static str>,
    /// What is wrong.
    pub message: String,
}

/// A row of a table.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Row<'t> {
    file: &'static str,
    line: u32,
    columns: &'static [&'static str],
    /// As many as there are columns.
    cells: Vec<&'t str>,
}

/// The rows of the table `text`, which is in `file` and has these columns.
///
/// # Errors
/// An item is an error where the first line does not name just these columns in this order, and
/// where a row has another number of cells.
pub fn rows<'t>(
    file: &'static str,
    text: &'t str,
    columns: &'static [&'static str],
) -> impl Iterator<Item = Result<Row<'t>, TsvError>> {
    let mut lines = text.lines();
    let expected = columns.join("\t");
    let header = lines.next().unwrap_or("");
    let wrong_header = (header != expected).then(|| {
        let message = format!("the first line is `{header}`, not `{expected}`");
        Err(TsvError { file, line: 1, column: None, message })
    });
    wrong_header.into_iter().chain((2..).zip(lines).map(move |(line, text)| {
        let cells: Vec<&str> = text.split('\t').collect();
        if cells.len() != columns.len() {
            let message = format!("the row has {} cells, not {}", cells.len(), columns.len());
            return Err(TsvError { file, line, column: None, message });
        }
        Ok(Row { file, line, columns, cells })
    }))
}

/// Reads a whole table. `order` compares the first cells of two neighbouring rows: each must be
/// greater than the one before, so that none is there twice. `parse` makes a value of each row.
///
/// # Errors
/// What [`rows`] finds, the first row that is out of order, and the first error of `parse`.
pub fn load<'t, T>(
    file: &'static str,
    text: &'t str,
    columns: &'static [&'static str],
    order: impl Fn(&str, &str) -> Ordering,
    mut parse: impl FnMut(&Row<'t>) -> Result<T, TsvError>,
) -> Result<Vec<T>, TsvError> {
    let mut values = vec![];
    let mut before: Option<&str> = None;
    for row in rows(file, text, columns) {
        let row = row?;
        let first = row.cells.first().copied().unwrap_or("");
        match before.map(|before| order(before, first)) {
            Some(Ordering::Equal) => {
                return Err(row.error_at(0, format!("`{first}` is here twice")));
            }
            Some(Ordering::Greater) => {
                let before = before.unwrap_or("");
                return Err(row.error_at(0, format!("`{first}` comes after `{before}`")));
            }
            Some(Ordering::Less) | None => {}
        }
        before = Some(first);
        values.push(parse(&row)?);
    }
    Ok(values)
}

/// The values of a table that is built into the compiler.
///
/// # Panics
/// If the table is wrong. No input of a user can cause this, and a unit test loads each table.
#[expect(clippy::panic, reason = "a wrong built-in table is a mistake of ours that a test finds")]
pub fn built_in<T>(table: Result<T, TsvError>) -> T {
    table.unwrap_or_else(|error| panic!("{error}"))
}

impl<'t> Row<'t> {
    /// The row's line in its file, from 1.
    pub fn line(&self) -> u32 {
        self.line
    }

    /// An error of this row's cell in `column`.
    pub fn error(&self, column: &str, message: impl Into<String>) -> TsvError {
        match self.columns.iter().position(|name| *name == column) {
            Some(index) => self.error_at(index, message),
            None => self.no_column(column),
        }
    }

    fn error_at(&self, index: usize, message: impl Into<String>) -> TsvError {
        let column = self.columns.get(index).copied();
        TsvError { file: self.file, line: self.line, column, message: message.into() }
    }

    fn no_column(&self, column: &str) -> TsvError {
        let message = format!("the table has no column `{column}`");
        TsvError { file: self.file, line: self.line, column: None, message }
    }

    /// The cell of a column as it stands; it may be empty.
    fn cell(&self, column: &str) -> Result<&'t str, TsvError> {
        let index = self.columns.iter().position(|name| *name == column);
        index.and_then(|index| self.cells.get(index).copied()).ok_or_else(|| self.no_column(column))
    }

    /// The cell of a column.
    ///
    /// # Errors
    /// An empty cell, and one that begins or ends with a blank.
    pub fn text(&self, column: &str) -> Result<&'t str, TsvError> {
        let cell = self.cell(column)?;
        if cell.is_empty() {
            return Err(self.error(column, "the cell is empty"));
        }
        if cell.trim() != cell {
            return Err(self.error(column, format!("blanks around `{cell}`")));
        }
        Ok(cell)
    }

    /// The cell of a column, `None` if it is empty.
    ///
    /// # Errors
    /// A cell that begins or ends with a blank.
    pub fn optional_text(&self, column: &str) -> Result<Option<&'t str>, TsvError> {
        if self.cell(column)?.is_empty() { Ok(None) } else { self.text(column).map(Some) }
    }

    /// The number in a column's cell.
    ///
    /// # Errors
    /// What is not a number of the type `T`, and one outside the range.
    pub fn number<T: FromStr + PartialOrd + Display>(
        &self,
        column: &str,
        range: RangeInclusive<T>,
    ) -> Result<T, TsvError> {
        let cell = self.text(column)?;
        let number = cell.parse().ok().filter(|number| range.contains(number));
        number.ok_or_else(|| {
            let (least, most) = (range.start(), range.end());
            self.error(column, format!("`{cell}` is not a number from {least} to {most}"))
        })
    }

    /// What the word in a column's cell stands for, by a list of words.
    ///
    /// # Errors
    /// A word that is not in the list.
    pub fn word<T: Copy>(&self, column: &str, words: &[(&str, T)]) -> Result<T, TsvError> {
        let cell = self.text(column)?;
        let known = words.iter().find(|(word, _)| *word == cell);
        known.map(|&(_, meaning)| meaning).ok_or_else(|| {
            let list: Vec<&str> = words.iter().map(|(word, _)| *word).collect();
            self.error(column, format!("`{cell}` is not one of: {}", list.join(", ")))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const COLUMNS: &[&str] = &["name", "size", "kind"];

    fn table(text: &str) -> Result<Vec<u8>, String> {
        let parse = |row: &Row<'_>| {
            row.text("name")?;
            row.word("kind", &[("bit", 1), ("word", 16)])?;
            row.number("size", 1..=9)
        };
        load("t.tsv", text, COLUMNS, str::cmp, parse).map_err(|error| error.to_string())
    }

    #[test]
    fn a_sound_table_gives_its_rows() {
        assert_eq!(table("name\tsize\tkind\nA\t1\tbit\nB\t9\tword\n"), Ok(vec![1, 9]));
        assert_eq!(table("name\tsize\tkind\n"), Ok(vec![]));
    }

    #[test]
    fn every_mistake_is_named_with_its_row() {
        let head = "name\tsize\tkind\n";
        for (rows, message) in [
            ("A\t1\n", "t.tsv:2: the row has 2 cells, not 3"),
            ("A\t1\tbit\tx\n", "t.tsv:2: the row has 4 cells, not 3"),
            ("A\t1\tbit\n\nB\t1\tbit\n", "t.tsv:3: the row has 1 cells, not 3"),
            ("A\t1\tbits\n", "t.tsv:2: kind: `bits` is not one of: bit, word"),
            ("A\t10\tbit\n", "t.tsv:2: size: `10` is not a number from 1 to 9"),
            ("A\t-1\tbit\n", "t.tsv:2: size: `-1` is not a number from 1 to 9"),
            ("A\t\tbit\n", "t.tsv:2: size: the cell is empty"),
            ("A \t1\tbit\n", "t.tsv:2: name: blanks around `A `"),
            ("A\t1\tbit\nA\t1\tbit\n", "t.tsv:3: name: `A` is here twice"),
            ("B\t1\tbit\nA\t1\tbit\n", "t.tsv:3: name: `A` comes after `B`"),
        ] {
            assert_eq!(table(&format!("{head}{rows}")), Err(message.to_owned()), "{rows:?}");
        }
        let message = "t.tsv:1: the first line is `name`, not `name\tsize\tkind`";
        assert_eq!(table("name\n"), Err(message.to_owned()));
        assert_eq!(table(""), Err(message.replace("`name`", "``")));
    }

    #[test]
    fn a_column_that_the_table_has_not_is_an_error() {
        let row = rows("t.tsv", "name\nA\n", &["name"]).next().unwrap().unwrap();
        assert_eq!(
            row.text("nmae").unwrap_err().to_string(),
            "t.tsv:2: the table has no column `nmae`"
        );
        assert_eq!(row.optional_text("name"), Ok(Some("A")));
    }
}
