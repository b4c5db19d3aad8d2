//! Words, numbers, quoted strings and signs of one line.

use super::ParseError;

/// What a line is made of.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Token {
    /// A word of letters, digits, `_` and `.`, or a number.
    Word(String),
    /// A string in quotes, without them.
    Quoted(String),
    /// One sign.
    Sign(char),
}

impl Token {
    /// How it is named in a message.
    fn shown(&self) -> String {
        match self {
            Self::Word(word) => format!("`{word}`"),
            Self::Quoted(text) => format!("{text:?}"),
            Self::Sign(sign) => format!("`{sign}`"),
        }
    }
}

/// A line and how far it was read.
pub(super) struct Line {
    number: usize,
    /// Tokens with their columns.
    tokens: Vec<(usize, Token)>,
    at: usize,
    /// The column behind the line's end.
    end: usize,
}

impl Line {
    /// Splits a line; a comment does not count.
    pub(super) fn new(number: usize, text: &str) -> Result<Self, ParseError> {
        let mut line = Self { number, tokens: vec![], at: 0, end: 1 };
        let mut chars = text.chars().enumerate().map(|(at, c)| (at + 1, c)).peekable();
        while let Some((column, c)) = chars.next() {
            line.end = column;
            if c == ';' {
                break;
            }
            if c.is_whitespace() {
                continue;
            }
            let token = if c == '"' {
                let mut inner = String::new();
                loop {
                    match chars.next() {
                        Some((_, '"')) => break,
                        Some((_, c)) => inner.push(c),
                        None => return Err(line.error_at(column, "the quote is not closed")),
                    }
                }
                Token::Quoted(unescaped(&inner).ok_or_else(|| {
                    line.error_at(column, "a backslash wants `\\`, `r` or `{hex}` behind it")
                })?)
            } else if is_word(c) || c == '-' || c == '@' {
                let mut word = String::from(c);
                let number = c == '-' || c.is_ascii_digit();
                while let Some(&(_, c)) = chars.peek() {
                    // The sign of an exponent belongs to its number.
                    let exponent = number
                        && matches!(c, '+' | '-')
                        && word.ends_with(['e', 'E'])
                        && !word.starts_with("0x");
                    if !is_word(c) && !exponent {
                        break;
                    }
                    word.push(c);
                    chars.next();
                }
                Token::Word(word)
            } else {
                Token::Sign(c)
            };
            line.tokens.push((column, token));
        }
        Ok(line)
    }

    fn error_at(&self, column: usize, message: impl Into<String>) -> ParseError {
        ParseError { line: self.number, column, message: message.into() }
    }

    /// A complaint about the token just read.
    pub(super) fn error_before(&self, message: impl Into<String>) -> ParseError {
        let token = self.at.checked_sub(1).and_then(|at| self.tokens.get(at));
        self.error_at(token.map_or(1, |(column, _)| *column), message)
    }

    fn wanted(&self, what: &str) -> ParseError {
        match self.tokens.get(self.at) {
            Some((column, token)) => {
                self.error_at(*column, format!("{what} is wanted here, not {}", token.shown()))
            }
            None => self.error_at(self.end, format!("{what} is wanted behind this line")),
        }
    }

    /// Where the next token stands.
    pub(super) fn place(&self) -> (usize, usize) {
        let column = self.tokens.get(self.at).map_or(self.end, |(column, _)| *column);
        (self.number, column)
    }

    /// Whether nothing is left.
    pub(super) fn is_done(&self) -> bool {
        self.at >= self.tokens.len()
    }

    /// Takes a sign if it comes next.
    pub(super) fn take(&mut self, sign: char) -> bool {
        let found = matches!(self.tokens.get(self.at), Some((_, Token::Sign(s))) if *s == sign);
        self.at += usize::from(found);
        found
    }

    /// Takes a sign.
    pub(super) fn sign(&mut self, sign: char) -> Result<(), ParseError> {
        if self.take(sign) { Ok(()) } else { Err(self.wanted(&format!("`{sign}`"))) }
    }

    /// Takes a word if this one comes next.
    pub(super) fn take_word(&mut self, word: &str) -> bool {
        let found = self.peek() == Some(word);
        self.at += usize::from(found);
        found
    }

    /// The word that comes next.
    pub(super) fn peek(&self) -> Option<&str> {
        match self.tokens.get(self.at) {
            Some((_, Token::Word(word))) => Some(word),
            _ => None,
        }
    }

    /// Takes a word; `what` says what for.
    pub(super) fn word(&mut self, what: &str) -> Result<String, ParseError> {
        match self.tokens.get(self.at) {
            Some((_, Token::Word(word))) => {
                self.at += 1;
                Ok(word.clone())
            }
            _ => Err(self.wanted(what)),
        }
    }

    /// Takes this word.
    pub(super) fn keyword(&mut self, word: &str) -> Result<(), ParseError> {
        if self.take_word(word) { Ok(()) } else { Err(self.wanted(&format!("`{word}`"))) }
    }

    /// Takes a quoted string.
    pub(super) fn quoted(&mut self, what: &str) -> Result<String, ParseError> {
        match self.tokens.get(self.at) {
            Some((_, Token::Quoted(text))) => {
                self.at += 1;
                Ok(text.clone())
            }
            _ => Err(self.wanted(what)),
        }
    }

    /// Takes a number.
    pub(super) fn number<N: std::str::FromStr>(&mut self, what: &str) -> Result<N, ParseError> {
        let word = self.word(what)?;
        word.parse().map_err(|_| self.error_before(format!("`{word}` is no {what}")))
    }

    /// Takes a reference: a prefix and a number.
    pub(super) fn reference(&mut self, prefix: &str, what: &str) -> Result<u32, ParseError> {
        let number = |word: &str| word.strip_prefix(prefix)?.parse().ok();
        match self.peek().and_then(number) {
            Some(number) => {
                self.at += 1;
                Ok(number)
            }
            None => Err(self.wanted(&format!("{what} (`{prefix}0`)"))),
        }
    }

    /// Makes sure that nothing is left.
    pub(super) fn end(&self) -> Result<(), ParseError> {
        if self.is_done() { Ok(()) } else { Err(self.wanted("the end of the line")) }
    }
}

fn is_word(c: char) -> bool {
    c.is_ascii_alphanumeric() || c == '_' || c == '.'
}

/// Text as it was before control characters were written out.
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
