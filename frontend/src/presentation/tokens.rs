//! Cuts lines into words, numbers, texts and signs, for languages that write them alike.

use super::text::{Piece, Role};

/// A word, number, text, blank or sign of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Raw<'t> {
    /// White space.
    Blank(&'t str),
    /// Letters, digits, `_` and `@`, beginning with no digit.
    Word(&'t str),
    /// The same, beginning with a digit or `$`.
    Number(&'t str),
    /// What stands in quotes, with them.
    Text(&'t str),
    /// Any other character.
    Sign(&'t str),
}

impl<'t> Raw<'t> {
    /// The text.
    pub fn text(self) -> &'t str {
        match self {
            Self::Blank(text)
            | Self::Word(text)
            | Self::Number(text)
            | Self::Text(text)
            | Self::Sign(text) => text,
        }
    }
}

fn is_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_' || c == '@'
}

/// Cuts a line, from left to right, without knowing the language.
pub fn raw<'t>(line: &'t str) -> Vec<Raw<'t>> {
    let mut found = vec![];
    let mut rest = line;
    while let Some(first) = rest.chars().next() {
        let run = |is: &dyn Fn(char) -> bool| {
            rest.char_indices().find(|&(_, c)| !is(c)).map_or(rest.len(), |(at, _)| at)
        };
        let (length, make): (usize, fn(&'t str) -> Raw<'t>) = if first.is_whitespace() {
            (run(&char::is_whitespace), Raw::Blank)
        } else if first == '"' {
            let end = rest.char_indices().skip(1).find(|&(_, c)| c == '"');
            (end.map_or(rest.len(), |(at, _)| at + 1), Raw::Text)
        } else if first.is_ascii_digit() {
            (run(&|c| is_word(c) || c == '.'), Raw::Number)
        } else if first == '$' {
            let digits = rest.char_indices().skip(1).find(|&(_, c)| !c.is_ascii_hexdigit());
            (digits.map_or(rest.len(), |(at, _)| at), Raw::Number)
        } else if is_word(first) {
            (run(&is_word), Raw::Word)
        } else {
            (first.len_utf8(), Raw::Sign)
        };
        let (piece, after) = rest.split_at_checked(length.max(1)).unwrap_or((rest, ""));
        found.push(make(piece));
        rest = after;
    }
    found
}

/// Marks the variables in front of `=` where a statement can begin: at the beginning of a line, or after a whole
/// statement.
pub fn mark_target(pieces: &mut [Piece]) {
    let is_comparison = |pieces: &[Piece], at: usize| {
        let before = pieces.get(..at).unwrap_or_default();
        let open = before.iter().filter(|piece| piece.text == "(").count();
        let closed = before.iter().filter(|piece| piece.text == ")").count();
        open > closed
    };
    for at in 0..pieces.len() {
        let is_assignment = pieces.get(at).is_some_and(|piece| piece.text == "=");
        if !is_assignment || is_comparison(pieces, at) {
            continue;
        }
        // An index in brackets stands between the array and the sign.
        let mut depth = 0_usize;
        for target in pieces.get_mut(..at).unwrap_or_default().iter_mut().rev() {
            match target.text.as_str() {
                "]" => depth += 1,
                "[" => depth = depth.saturating_sub(1),
                _ if depth == 0 && target.role == Role::Variable => {
                    target.target = true;
                    break;
                }
                _ if depth == 0 && target.role != Role::Blank => break,
                _ => {}
            }
        }
        // The second sign of `A=B=C` is a comparison. Further statements may follow where a language has several on a line.
        if pieces.iter().all(|piece| piece.statement.is_none()) && is_one_expression(pieces, at) {
            return;
        }
    }
}

/// Whether all that stands after the sign `=` at a place is one expression. It is none if two operands follow each
/// other without an operator, as where the next statement begins on the same line.
fn is_one_expression(pieces: &[Piece], at: usize) -> bool {
    let after = pieces.get(at + 1..).unwrap_or_default();
    let pieces: Vec<_> = after.iter().filter(|piece| piece.role != Role::Blank).collect();
    let is_operand = |piece: &Piece| matches!(piece.role, Role::Variable | Role::Constant);
    !pieces.array_windows().any(|[a, b]| {
        (is_operand(a) || a.text == ")") && (is_operand(b) && !b.negated || b.role == Role::Keyword)
    })
}

/// The name by which the directory lists a line: its target, its label or its keyword (PMI 5.1).
pub fn name_of(pieces: &[Piece]) -> String {
    let visible = || pieces.iter().filter(|piece| piece.role != Role::Blank);
    if let Some(label) = visible().next().filter(|piece| piece.role == Role::Label) {
        let colon = if label.text.starts_with(':') { "" } else { ":" };
        return format!("{}{colon}", label.text);
    }
    let target = visible().find(|piece| piece.target);
    let first = visible().next();
    let named = match first {
        Some(first) if first.role == Role::Keyword => Some(first),
        _ => target.or(first),
    };
    named.map_or_else(String::new, |piece| piece.text.clone())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_cut_without_loss() {
        for line in ["A = /B&(C[2]+$FF)", "P1=0P2=60_SEC \"x y\"", "\"open", "é=1"] {
            let again: String = raw(line).iter().map(|token| token.text()).collect();
            assert_eq!(again, line);
        }
        assert_eq!(raw("A1=12"), [Raw::Word("A1"), Raw::Sign("="), Raw::Number("12")]);
    }
}
