//! The rows of an entry of the watch list: a range as in `P1..5`, a variable, a name that the program defines.

use crate::CheckedProgram;
use crate::pmac::Program;
use crate::presentation::{MAX_ROWS, WatchRow};

/// The variable for which the program defines a name.
pub(super) fn defined_name(program: &Program, word: &str) -> Option<String> {
    let expression = program.expression(word).ok()?;
    match expression.variables() {
        [name] if !name.eq_ignore_ascii_case(word) => Some(name.clone()),
        _ => None,
    }
}

/// The rows of an entry. `defined` gives the variable for which the program defines a name.
pub(super) fn rows(
    entry: &str,
    defined: &dyn Fn(&str) -> Option<String>,
) -> Result<Vec<WatchRow>, String> {
    if let Some((first, last)) = entry.split_once("..") {
        let digits = first.find(|c: char| c.is_ascii_digit()).unwrap_or(first.len());
        let (letters, first) = first.split_at_checked(digits).unwrap_or((first, ""));
        let wrong = || format!("`{entry}` is not a range: one is written P1..5");
        let first: u32 = first.parse().map_err(|_| wrong())?;
        let last: u32 = last.trim().parse().map_err(|_| wrong())?;
        if first > last {
            return Err(wrong());
        }
        let last = last.min(first.saturating_add(MAX_ROWS - 1));
        let letters = letters.to_uppercase();
        return Ok((first..=last)
            .map(|number| WatchRow::of(format!("{letters}{number}")))
            .collect());
    }
    Ok(vec![WatchRow::of(defined(entry).unwrap_or_else(|| entry.to_uppercase()))])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_range_may_end_at_the_largest_number() {
        let rows = rows("P4294967294..4294967295", &|_| None).unwrap();
        assert_eq!(rows, [WatchRow::of("P4294967294"), WatchRow::of("P4294967295")]);
    }
}
