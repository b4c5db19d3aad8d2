//! Where reading goes on after an error: the next statement of the same line, or the line's end.
//!
//! Each wrong statement is to have one error. So a word counts as the beginning of the next
//! statement only where it can't belong to the wrong one: outside of parentheses and quotes, and
//! after something with which an expression can end.

use super::cursor::Cursor;
use super::words::{self, Keyword, PLC, Word};

/// How many bytes of a line are searched for quotes. The limit keeps the time linear for a line
/// with many errors.
const QUOTES_AHEAD: usize = 1024;

/// The offset of the next statement after `pos`, or of the line's end. The wrong statement begins
/// at `start`. In `online` text there is no IF, WHILE or CLOSE that would begin a statement
/// wherever it is.
pub(super) fn next_statement(text: &str, start: usize, pos: usize, online: bool) -> usize {
    let bytes = text.as_bytes();
    let byte = |at: usize| bytes.get(at).copied().unwrap_or(b'\n');
    let conditional = |keyword: Option<Keyword>| {
        use Keyword::{And, If, Or, While};
        matches!(keyword, Some(If | While | And | Or))
    };
    let (mut depth, mut quoted) = (0usize, false);
    // Whether the parentheses of a condition are still to come.
    let mut condition_follows = conditional(word_at(text, start).map(|(word, _)| word.keyword));
    // How many quotes the line still has. If the number is odd, one of them is missing.
    let line = bytes.iter().skip(pos).take(QUOTES_AHEAD).take_while(|b| **b != b'\n');
    let mut quotes = line.filter(|b| **b == b'"').count();
    let mut after_letter = false;
    let mut last_visible = b'\n';
    let mut at = start;
    while at < text.len() {
        let current = byte(at);
        if current == b'\n' {
            if at >= pos {
                return at;
            }
            quoted = false;
        }
        if !quoted && !after_letter {
            let word = word_at(text, at);
            let after = at >= pos && at > start;
            if after && !online && word.is_some_and(|(word, end)| is_structural(word, end.pos - at))
            {
                return at;
            }
            if depth == 0 && word.is_some_and(|(word, _)| joins_conditions(word)) {
                condition_follows = true;
            }
            let ends =
                last_visible.is_ascii_alphanumeric() || matches!(last_visible, b')' | b'"' | b'.');
            let open = depth > 0 || condition_follows || quotes % 2 != 0;
            if after && !open && ends && begins_statement(text, at, word) {
                return at;
            }
        }
        match current {
            b'"' => {
                quoted = !quoted;
                quotes -= usize::from(at >= pos && quotes > 0);
            }
            b'(' if !quoted => depth += 1,
            b')' if !quoted => {
                depth = depth.saturating_sub(1);
                condition_follows &= depth != 0;
            }
            _ => {}
        }
        after_letter = current.is_ascii_alphabetic() || current == b'_';
        if current > b' ' {
            last_visible = current;
        }
        at += 1;
    }
    text.len()
}

/// The word of a PLC's statement that is at an offset, and a cursor after it.
fn word_at(text: &str, at: usize) -> Option<(&'static Word, Cursor<'_>)> {
    let mut cur = Cursor::new(text);
    cur.pos = at;
    cur.crosses_lines = true;
    if !cur.byte().is_ascii_alphabetic() {
        return None;
    }
    words::find(cur, PLC)
}

/// Whether a word belongs to the structure of a program, so that a statement begins wherever it
/// is. CLS and shortened forms of WHILE do not count, since they may be parts of names.
fn is_structural(word: &Word, length: usize) -> bool {
    match word.keyword {
        Keyword::If | Keyword::Else | Keyword::EndIf | Keyword::EndWhile => true,
        Keyword::While | Keyword::Close => length == "WHILE".len(),
        _ => false,
    }
}

/// Whether a word joins another condition to the one in front of it: AND or OR.
fn joins_conditions(word: &Word) -> bool {
    matches!(word.keyword, Keyword::And | Keyword::Or)
}

/// Whether an assignment, or another statement that can be nothing else, begins at an offset.
/// `word` is the word that is there, if there is one.
fn begins_statement(text: &str, at: usize, word: Option<(&Word, Cursor<'_>)>) -> bool {
    let rest = text.as_bytes().get(at..).unwrap_or(&[]);
    let Some((word, mut after)) = word else {
        let [letter, number @ ..] = rest else { return false };
        let variable = matches!(letter.to_ascii_uppercase(), b'P' | b'Q' | b'M' | b'I' | b'L');
        let glued = number.first().is_some_and(u8::is_ascii_alphabetic);
        return variable && !glued && is_assignment(number.trim_ascii_start());
    };
    match word.keyword {
        Keyword::Switch(_) => true,
        Keyword::Command | Keyword::Send | Keyword::Display => {
            if word.keyword != Keyword::Display {
                let _ = words::port(&mut after);
            }
            !after.byte().is_ascii_alphabetic() && matches!(after.peek(), b'"' | b'^')
        }
        Keyword::Address => {
            !after.byte().is_ascii_alphabetic() && matches!(after.peek(), b'#' | b'&')
        }
        _ => false,
    }
}

/// Whether a text begins with what follows the letter of a variable in an assignment: a number, a
/// range or an expression in parentheses, and then `=`, `|=`, `&=` or `^=`.
fn is_assignment(text: &[u8]) -> bool {
    let number = |b: &&u8| b.is_ascii_digit() || matches!(b, b'.' | b',');
    let mut length = text.iter().take_while(number).count();
    if text.first() == Some(&b'(') {
        let mut depth = 0usize;
        for byte in text.iter().take_while(|b| !matches!(b, b'\n' | b'"')) {
            length += 1;
            match byte {
                b'(' => depth += 1,
                b')' => depth -= 1,
                _ => {}
            }
            if depth == 0 {
                break;
            }
        }
        if depth != 0 {
            return false;
        }
    }
    let rest = text.get(length..).unwrap_or(&[]).trim_ascii_start();
    let rest = rest
        .strip_prefix(b"|")
        .or(rest.strip_prefix(b"&"))
        .or(rest.strip_prefix(b"^"))
        .unwrap_or(rest);
    length > 0 && rest.first() == Some(&b'=')
}
