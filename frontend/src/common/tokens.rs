//! Cuts lines into words, numbers, texts and signs, for languages that write them alike.

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
