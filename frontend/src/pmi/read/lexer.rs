//! Cuts a statement's text into tokens (PMI 2.2.1 to 2.2.3).

use crate::common::Limits;
use crate::pmi::read::token::{Fault, Kind, Token};

/// The plain character that a character is read as. Text that was copied from a PDF has curly
/// quotes, dashes and non-breaking spaces, which are read as `"`, `-` and a blank.
pub(crate) fn plain(c: char) -> char {
    match c {
        '\u{201c}' | '\u{201d}' | '\u{201e}' | '\u{201f}' | '\u{2033}' => '"',
        '\u{2010}'..='\u{2015}' | '\u{2212}' | '\u{fe63}' | '\u{ff0d}' => '-',
        '\u{a0}' | '\u{2007}' | '\u{202f}' | '\u{feff}' | '\t' | '\u{b}' | '\u{c}' => ' ',
        other => other,
    }
}

/// The longest name that the original compiler took (PMI 2.2.3).
const NAME_LIMIT: usize = 6;
/// The most digits of a number that it took (PMI 4.5, error 28).
const DIGIT_LIMIT: usize = 9;

/// Appends the tokens of `text[start..end]`, one statement without the comment after it, to `out`.
/// A `#` continues the statement on the next line; the rest of its own line is skipped.
pub(crate) fn lex(text: &str, start: u32, end: u32, limits: Limits, out: &mut Vec<Token>) {
    let text = text.get(..end as usize).unwrap_or(text);
    let mut lexer = Lexer { text, at: start as usize, limits, out };
    while lexer.step() {}
}

struct Lexer<'a> {
    text: &'a str,
    at: usize,
    limits: Limits,
    out: &'a mut Vec<Token>,
}

impl Lexer<'_> {
    fn rest(&self) -> &str {
        self.text.get(self.at..).unwrap_or("")
    }

    /// The length of the word (ASCII letters and digits) `skip` bytes further on.
    fn word(&self, skip: usize) -> usize {
        let bytes = self.rest().as_bytes().get(skip..).unwrap_or(&[]);
        bytes.iter().take_while(|b| b.is_ascii_alphanumeric()).count()
    }

    fn push(&mut self, kind: Kind, len: usize) {
        let token = Token { kind, start: self.at as u32, end: (self.at + len) as u32 };
        self.out.push(token);
        self.at += len;
    }

    /// Reads one token, or skips what is between tokens; `false` at the end.
    fn step(&mut self) -> bool {
        let Some(raw) = self.rest().chars().next() else { return false };
        let width = raw.len_utf8();
        match plain(raw) {
            ' ' | '\r' | '\n' => self.at += width,
            '#' => self.at += self.rest().find(['\r', '\n']).unwrap_or(self.rest().len()),
            // A comment. Statements come without theirs, but the text of a single expression has
            // it.
            '?' => return false,
            '"' => self.text_token(width),
            '0'..='9' => self.number(),
            'A'..='Z' | 'a'..='z' => self.name(Kind::Name, 0),
            '@' => self.name(Kind::Executive, 1),
            '$' => self.directive(),
            '/' => self.maybe_equal(Kind::Slash, Kind::Ne),
            '<' => self.maybe_equal(Kind::Lt, Kind::Le),
            '>' => self.maybe_equal(Kind::Gt, Kind::Ge),
            '=' => self.push(Kind::Eq, width),
            '+' => self.push(Kind::Plus, width),
            '-' => self.push(Kind::Minus, width),
            '*' => self.push(Kind::Star, width),
            '%' => self.push(Kind::Percent, width),
            '&' => self.push(Kind::And, width),
            '!' => self.push(Kind::Or, width),
            '(' => self.push(Kind::LParen, width),
            ')' => self.push(Kind::RParen, width),
            '[' => self.push(Kind::LBracket, width),
            ']' => self.push(Kind::RBracket, width),
            ',' => self.push(Kind::Comma, width),
            ':' => self.push(Kind::Colon, width),
            '.' if self.rest().as_bytes().get(1).is_some_and(u8::is_ascii_digit) => {
                let len = 1 + self.word(1);
                self.push(Kind::Bad(Fault::Fraction), len);
            }
            _ => self.push(Kind::Bad(Fault::Extraneous), width),
        }
        true
    }

    /// A sign that may have `=` after it.
    fn maybe_equal(&mut self, alone: Kind, equal: Kind) {
        match self.rest().as_bytes().get(1) {
            Some(b'=') => self.push(equal, 2),
            _ => self.push(alone, 1),
        }
    }

    /// A name of the program, or of the executive, after a prefix (`@`) of `prefix` bytes.
    fn name(&mut self, kind: Kind, prefix: usize) {
        let len = self.word(prefix);
        let word = self.rest().as_bytes().get(prefix..prefix + len).unwrap_or(&[]);
        if let Some(small) = word.iter().position(u8::is_ascii_lowercase) {
            self.bad_inside(prefix + small, prefix + len);
        } else if len == 0 {
            self.push(Kind::Bad(Fault::Extraneous), prefix);
        } else if len > NAME_LIMIT && self.limits == Limits::Original {
            self.push(Kind::Bad(Fault::LongName), prefix + len);
        } else {
            self.push(kind, prefix + len);
        }
    }

    fn directive(&mut self) {
        let len = self.word(1);
        let word = self.rest().as_bytes().get(1..=len).unwrap_or(&[]);
        match word.iter().position(u8::is_ascii_lowercase) {
            Some(small) => self.bad_inside(1 + small, 1 + len),
            None => self.push(Kind::Directive, 1 + len),
        }
    }

    /// Takes a word of `len` bytes that has a wrong character at `from`. The token of the error
    /// reaches from there to the word's end.
    fn bad_inside(&mut self, from: usize, len: usize) {
        let start = (self.at + from) as u32;
        let end = (self.at + len) as u32;
        self.out.push(Token { kind: Kind::Bad(Fault::Extraneous), start, end });
        self.at += len;
    }

    fn number(&mut self) {
        let rest = self.rest().as_bytes();
        let digits = rest.iter().take_while(|b| b.is_ascii_digit()).count();
        let next = rest.get(digits).copied();
        let value = self.rest().get(..digits).and_then(|d| d.parse::<u32>().ok());
        if digits > DIGIT_LIMIT && self.limits == Limits::Original {
            self.push(Kind::Bad(Fault::Digits), digits);
        } else if next == Some(b'.') {
            let len = digits + 1 + self.word(digits + 1);
            self.push(Kind::Bad(Fault::Fraction), len);
        } else if next.is_some_and(|b| b.is_ascii_alphabetic()) {
            let len = self.word(0);
            self.bad_inside(digits, len);
        } else {
            match value {
                Some(value) if value <= i32::MAX as u32 => self.push(Kind::Number(value), digits),
                _ => self.push(Kind::Bad(Fault::TooLarge), digits),
            }
        }
    }

    /// A text in quotes; `open` is the length of the opening quote in bytes.
    fn text_token(&mut self, open: usize) {
        let start = self.at;
        self.at += open;
        let mut hash = None;
        while let Some(raw) = self.rest().chars().next() {
            match plain(raw) {
                '"' => {
                    self.at += raw.len_utf8();
                    let end = self.at as u32;
                    let token = match hash {
                        None => Token { kind: Kind::Text, start: start as u32, end },
                        Some(hash) => {
                            Token { kind: Kind::Bad(Fault::HashInText), start: hash, end: hash + 1 }
                        }
                    };
                    self.out.push(token);
                    return;
                }
                '\r' | '\n' => break,
                '#' => hash = hash.or(Some(self.at as u32)),
                _ => {}
            }
            self.at += raw.len_utf8();
        }
        let kind = Kind::Bad(if hash.is_some() { Fault::HashInText } else { Fault::OpenText });
        let start = hash.unwrap_or(start as u32);
        let end = if hash.is_some() { start + 1 } else { self.at as u32 };
        self.out.push(Token { kind, start, end });
    }
}

/// The characters between the quotes of a text token, each read as [`plain`] says, but for the
/// non-breaking space, which is kept.
pub(crate) fn text_of(source: &str) -> String {
    let mut chars: Vec<char> = source
        .chars()
        .map(|c| match c {
            '\u{a0}' => c,
            other => plain(other),
        })
        .collect();
    if chars.first() == Some(&'"') {
        chars.remove(0);
    }
    if chars.last() == Some(&'"') {
        chars.pop();
    }
    chars.into_iter().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kinds(text: &str) -> Vec<Kind> {
        let mut out = vec![];
        lex(text, 0, text.len() as u32, Limits::Original, &mut out);
        out.into_iter().map(|token| token.kind).collect()
    }

    #[test]
    fn operators_of_two_characters_stand_together() {
        use Kind::*;
        assert_eq!(kinds("A/=B"), [Name, Ne, Name]);
        assert_eq!(kinds("A/ =B"), [Name, Slash, Eq, Name]);
        assert_eq!(kinds("A<=B>=C"), [Name, Le, Name, Ge, Name]);
        assert_eq!(kinds("A=/B"), [Name, Eq, Slash, Name]);
    }

    #[test]
    fn numbers_are_read_or_refused_with_a_reason() {
        assert_eq!(kinds("32767"), [Kind::Number(32767)]);
        assert_eq!(kinds("1234567890"), [Kind::Bad(Fault::Digits)]);
        assert_eq!(kinds("1.5"), [Kind::Bad(Fault::Fraction)]);
        assert_eq!(kinds("123A"), [Kind::Bad(Fault::Extraneous)]);
        let mut out = vec![];
        lex("2147483648", 0, 10, Limits::None, &mut out);
        assert_eq!(out.first().map(|t| t.kind), Some(Kind::Bad(Fault::TooLarge)));
    }

    #[test]
    fn names_are_read_or_refused_with_a_reason() {
        assert_eq!(kinds("ABC123"), [Kind::Name]);
        assert_eq!(kinds("ABCDEFG"), [Kind::Bad(Fault::LongName)]);
        assert_eq!(kinds("sw6"), [Kind::Bad(Fault::Extraneous)]);
        assert_eq!(kinds("@4A100"), [Kind::Executive]);
        assert_eq!(kinds("$INPUT"), [Kind::Directive]);
    }

    #[test]
    fn continuation_hides_the_rest_of_its_line() {
        assert_eq!(kinds("A # any thing\n+B").len(), 3);
    }

    #[test]
    fn texts() {
        assert_eq!(kinds("\"A ? B\""), [Kind::Text]);
        assert_eq!(kinds("\u{201c}A\u{201d}"), [Kind::Text]);
        assert_eq!(kinds("\"A # B\""), [Kind::Bad(Fault::HashInText)]);
        assert_eq!(kinds("\"A"), [Kind::Bad(Fault::OpenText)]);
        assert_eq!(text_of("\u{201c}A \u{2013} B\u{201d}"), "A - B");
    }
}
