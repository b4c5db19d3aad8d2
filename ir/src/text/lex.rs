//! Cuts the text into tokens.
//!
//! | token | what it is |
//! | --- | --- |
//! | word | letters, digits, `_` and `.`; may begin with `@`. A number is a word too: it may begin with `-`, and `+` or `-` may be after the `e` of its exponent |
//! | quoted text | what is between two `"`, escapes not yet replaced |
//! | line of text | what is after a `\|` at the very beginning of a line, escapes not yet replaced |
//! | sign | any other character that is not a space |
//! | end of a line | after each line that has tokens and is not a line of text |
//!
//! A `;` outside quotes begins a comment, which is left out.

use chumsky::prelude::*;

use super::error::ParseError;

/// A part of the text.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Token<'t> {
    /// A word or a number.
    Word(&'t str),
    /// Text in quotes, without them.
    Quoted(&'t str),
    /// A line of a source file, without the `|` and one space after it.
    Line(&'t str),
    /// Any other character.
    Sign(char),
    /// The end of a line.
    End,
}

impl Token<'_> {
    /// What an error message calls it.
    pub(super) fn description(&self) -> String {
        match self {
            Self::Word(word) => format!("`{word}`"),
            Self::Quoted(text) => format!("`\"{text}\"`"),
            Self::Line(_) => "a line of text".into(),
            Self::Sign(sign) => format!("`{sign}`"),
            Self::End => "the end of the line".into(),
        }
    }
}

/// The tokens of a text, and where each begins.
pub(super) struct Tokens<'t> {
    text: &'t str,
    /// In the order of the text.
    pub(super) tokens: Vec<Token<'t>>,
    /// For each token the offset of its first byte in the text; that of an end of a line is
    /// after the line's last token.
    offsets: Vec<usize>,
}

impl<'t> Tokens<'t> {
    /// Cuts a text into tokens.
    ///
    /// # Errors
    /// At a quote that is not closed on its line.
    pub(super) fn new(text: &'t str) -> Result<Self, ParseError> {
        let lexer = lexer();
        let mut all = Self { text, tokens: vec![], offsets: vec![] };
        let mut begin = 0;
        for full in text.split_inclusive('\n') {
            let line = full.strip_suffix('\n').unwrap_or(full);
            let line = line.strip_suffix('\r').unwrap_or(line);
            if let Some(source) = line.strip_prefix('|') {
                all.push(Token::Line(source.strip_prefix(' ').unwrap_or(source)), begin);
            } else {
                // The lexer accepts every line, since any character is at least a sign.
                let found = lexer.parse(line).into_output().unwrap_or_default();
                let mut end = None;
                for (token, span) in found {
                    let offset = begin + span.start;
                    let Some(token) = token else {
                        return Err(all.error_at(offset, "the quote is not closed".into()));
                    };
                    all.push(token, offset);
                    end = Some(begin + span.end);
                }
                if let Some(end) = end {
                    all.push(Token::End, end);
                }
            }
            begin += full.len();
        }
        Ok(all)
    }

    fn push(&mut self, token: Token<'t>, offset: usize) {
        self.tokens.push(token);
        self.offsets.push(offset);
    }

    /// An error at the token with an index, or at the end of the text if there is no such token.
    pub(super) fn error(&self, token: usize, message: impl Into<String>) -> ParseError {
        let offset = self.offsets.get(token).copied().unwrap_or(self.text.len());
        self.error_at(offset, message.into())
    }

    fn error_at(&self, offset: usize, message: String) -> ParseError {
        let before = self.text.get(..offset).unwrap_or(self.text);
        let begin = before.rfind('\n').map_or(0, |at| at + 1);
        let line = before.matches('\n').count() + 1;
        let column = before.get(begin..).unwrap_or("").chars().count() + 1;
        ParseError { line, column, message }
    }
}

/// The tokens of one line with their spans in it; `None` for a quote that is not closed.
fn lexer<'t>() -> impl Parser<'t, &'t str, Vec<(Option<Token<'t>>, SimpleSpan)>> {
    let letter = any().filter(|&c: &char| c.is_ascii_alphanumeric() || c == '_' || c == '.');
    let digit = any().filter(char::is_ascii_digit);
    let exponent = one_of("eE").then(one_of("+-")).ignored();
    let number =
        just('-').or_not().then(digit).then(choice((exponent, letter.ignored())).repeated());
    let name = choice((just('@'), letter)).then(letter.repeated());
    let word = choice((number.to_slice(), name.to_slice())).map(|word| Some(Token::Word(word)));
    let quoted = just('"').ignore_then(none_of('"').repeated().to_slice()).then(just('"').or_not());
    let quoted = quoted.map(|(text, closed)| closed.map(|_| Token::Quoted(text)));
    let sign = none_of(";").map(|sign| Some(Token::Sign(sign)));
    let token = choice((word, quoted, sign)).map_with(|token, place| (token, place.span()));
    let comment = just(';').then(any().repeated()).or_not();
    token.padded().repeated().collect().padded().then_ignore(comment)
}

/// Text with each escape replaced by the character that it stands for; `None` if something else
/// than `\`, `r` or `{hex}` is after a backslash.
pub(super) fn unescaped(text: &str) -> Option<String> {
    let mut out = String::with_capacity(text.len());
    let mut chars = text.chars();
    while let Some(c) = chars.next() {
        if c != '\\' {
            out.push(c);
            continue;
        }
        out.push(match chars.next()? {
            '\\' => '\\',
            'r' => '\r',
            '{' => {
                let digits: String = chars.by_ref().take_while(|&c| c != '}').collect();
                char::from_u32(u32::from_str_radix(&digits, 16).ok()?)?
            }
            _ => return None,
        });
    }
    Some(out)
}
