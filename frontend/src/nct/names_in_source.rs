//! What the comments of the source say of its variables. NCT declares none: the comment of a variable is one that begins with
//! its name, as in a list at the head of a program, else the one behind the first statement that writes, reads or tests it.

use plcc_abi::GivenName;
use plcc_abi::nct::NctName;

use super::Program;
use super::analyse::cross_reference;
use super::language::COMMENT_SIGNS;
use crate::common::split_comment;

/// The variable that a comment is about, and the rest of it; `None` if it begins with no name.
fn listed(comment: &str) -> Option<GivenName> {
    let end = comment.find(|c: char| !c.is_ascii_alphanumeric()).unwrap_or(comment.len());
    let (word, rest) = comment.split_at(end);
    let text = rest.trim_start_matches(|c: char| c.is_whitespace() || ":=-".contains(c));
    let name: NctName = word.parse().ok().filter(|_| !text.is_empty())?;
    Some(GivenName { name: name.to_string(), text: text.to_owned(), ..GivenName::default() })
}

impl Program {
    /// The comments of variables: those of lists in the order of the text, then those of statements in the order of the names.
    pub(super) fn names_in_source(&self) -> Vec<GivenName> {
        let lines = self.checked.text.lines().map(|line| split_comment(line, COMMENT_SIGNS));
        let lines: Vec<(&str, &str)> = lines.collect();
        if lines.iter().all(|(_, comment)| comment.is_empty()) {
            return vec![];
        }
        let alone = lines.iter().filter(|(statement, _)| statement.trim().is_empty());
        let mut names: Vec<GivenName> = alone.filter_map(|(_, comment)| listed(comment)).collect();
        let behind = |line: u32| {
            let (statement, comment) = *lines.get((line as usize).checked_sub(1)?)?;
            (!statement.trim().is_empty() && !comment.is_empty()).then_some(comment)
        };
        let rows = cross_reference::rows(&self.checked, |_| None, |line| behind(line).is_some());
        names.extend(rows.into_iter().filter_map(|row| {
            let line = [&row.written, &row.read, &row.tested].into_iter().flatten().next()?;
            let text = behind(*line)?.to_owned();
            Some(GivenName { name: row.name, text, ..GivenName::default() })
        }));
        names
    }
}
