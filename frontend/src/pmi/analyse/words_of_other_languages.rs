//! Words of other languages, and what PMI has in their place.

use super::other_languages::{ErrorSite, HABITS};
use crate::common::{Explanation, explanation, help};
use crate::pmi::read::section::Section;

/// Operators that are words elsewhere.
pub(super) fn operator(word: &str) -> Option<Explanation> {
    explanation(format!("`{word}` is not an operator"), HABITS.help("operator", word)?)
}

/// Truth values that are words elsewhere.
pub(super) fn truth_value(word: &str) -> Option<Explanation> {
    let help = HABITS.help("truth value", word)?;
    explanation(format!("{word} is neither a constant nor a variable"), help)
}

/// A statement that begins with `first`, with `second` after it.
pub(super) fn statement(first: &str, second: &str) -> Option<Explanation> {
    let both = HABITS.help("statement", &format!("{first}/{second}"));
    let known = both.or_else(|| HABITS.help("statement", first)).or_else(|| {
        let is_block = is_block_number(first) && !second.is_empty();
        let help = "blocks of part programs have no place here; a label is a name with a colon";
        is_block.then(|| help.to_owned())
    });
    explanation(format!("`{first}` begins no statement of PMI"), known?)
}

/// Whether a word numbers the block of a part program: `N10`.
fn is_block_number(word: &str) -> bool {
    let digits = word.strip_prefix('N').unwrap_or("");
    !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit())
}

/// A directive that does not exist.
pub(super) fn directive(word: &str) -> Option<Explanation> {
    let name = word.strip_prefix('$').unwrap_or(word);
    let known = HABITS.help("directive", name);
    help(known.or_else(|| Some(format!("write {}", HABITS.help("type", name)?)))?)
}

/// A declaration with a type.
pub(super) fn declaration(site: &ErrorSite<'_, '_>) -> Option<Explanation> {
    let typed = (1..=3).find_map(|index| HABITS.help("type", site.word(index)));
    let first = site.word(0);
    if first == "VAR" {
        return help("leave VAR out: a directive such as $INTEGER begins a list of variables");
    }
    let directive = typed.or_else(|| HABITS.help("type", first))?;
    let is_variable =
        |section| matches!(section, Section::Logical | Section::Integer | Section::Long);
    if site.section.is_some_and(is_variable) {
        return help(format!("leave the type out: the names after {directive} have it"));
    }
    help(format!("declare variables after {directive}, the name alone"))
}
