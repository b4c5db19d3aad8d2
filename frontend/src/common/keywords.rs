//! Keywords and signs of a language for `plcc explain`: each language has a table of them,
//! `reference/keywords.tsv`.

use super::tsv::{self, Row, TsvError};
use crate::language::Topic;

/// The columns of such a table.
const COLUMNS: &[&str] = &["names", "form", "meaning", "section"];

/// A row of the table: a word or a sign of a language.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Keyword {
    /// Its spellings, the full one first, divided by blanks: `ENDWHILE ENDW`.
    pub names: &'static str,
    /// How it is written with what belongs to it: `WHILE (condition)`.
    pub form: &'static str,
    /// What it does, in one line.
    pub meaning: &'static str,
    /// The section of the manual that describes it: `4.10`.
    pub section: &'static str,
}

/// Reads the table of keywords `text`, which is in `file`. Its rows are sorted by the bytes of
/// their first cell.
///
/// # Errors
/// The first row that is malformed or out of order.
pub fn load(file: &'static str, text: &'static str) -> Result<Vec<Keyword>, TsvError> {
    tsv::load(file, text, COLUMNS, str::cmp, |row: &Row<'static>| {
        Ok(Keyword {
            names: row.text("names")?,
            form: row.text("form")?,
            meaning: row.text("meaning")?,
            section: row.text("section")?,
        })
    })
}

/// What `plcc explain` prints for a keyword, in capital or small letters; `None` if none has the
/// name. `manual` is what the language's manual is called: `PMI manual`.
pub fn explain(keywords: &[Keyword], name: &str, manual: &str) -> Option<String> {
    let is_name = |spelling: &str| spelling.eq_ignore_ascii_case(name);
    let keyword = keywords.iter().find(|keyword| keyword.names.split(' ').any(is_name))?;
    let Keyword { names, form, meaning, section } = keyword;
    let names = names.replace(' ', ", ");
    Some(format!("{names}\n  {form}\n  {meaning}\n  {manual} {section}\n"))
}

/// Whether a word is a spelling of one of the keywords, in letters of any case.
pub fn has(keywords: &[Keyword], word: &str) -> bool {
    let mut spellings = keywords.iter().flat_map(|keyword| keyword.names.split(' '));
    spellings.any(|spelling| spelling.eq_ignore_ascii_case(word))
}

/// The keywords as topics of `plcc explain`, by their full spelling.
pub fn topics(keywords: &[Keyword]) -> impl Iterator<Item = Topic> + '_ {
    keywords.iter().map(|keyword| Topic {
        name: keyword.names.split(' ').next().unwrap_or("").to_owned(),
        meaning: keyword.meaning.to_owned(),
    })
}
