//! A cursor over the tokens of one statement.

use plcc_diag::{Diagnostic, FileId, MessageText, Span};

use crate::pmi::read::{
    diagnostic::error,
    split::Extent,
    token::{Fault, Kind, Token},
};

/// A position among the tokens of a statement.
#[derive(Clone)]
pub(crate) struct Cursor<'a> {
    /// The text of the statement's file.
    pub(crate) text: &'a str,
    /// The statement's tokens.
    pub(crate) tokens: &'a [Token],
    /// The index of the next token.
    pub(crate) at: usize,
    pub(crate) statement: Extent,
}

impl<'a> Cursor<'a> {
    pub(crate) fn new(text: &'a str, tokens: &'a [Token], statement: Extent) -> Self {
        Self { text, tokens, at: 0, statement }
    }

    fn file(&self) -> FileId {
        self.statement.file
    }

    /// The next token.
    pub(crate) fn token(&self) -> Option<Token> {
        self.tokens.get(self.at).copied()
    }

    /// The next token's kind.
    pub(crate) fn kind(&self) -> Option<Kind> {
        self.token().map(|token| token.kind)
    }

    /// The kind of the token after the next one.
    pub(crate) fn second_kind(&self) -> Option<Kind> {
        self.tokens.get(self.at + 1).map(|token| token.kind)
    }

    /// A token's text.
    pub(crate) fn slice(&self, token: Token) -> &'a str {
        self.text.get(token.start as usize..token.end as usize).unwrap_or("")
    }

    /// A token's place.
    pub(crate) fn span_of(&self, token: Token) -> Span {
        Span { file: self.file(), start: token.start, end: token.end }
    }

    /// The place of the next token; after the last one, that of the last one.
    pub(crate) fn span(&self) -> Span {
        match self.token().or(self.tokens.last().copied()) {
            Some(token) => self.span_of(token),
            None => {
                Span { file: self.file(), start: self.statement.start, end: self.statement.end }
            }
        }
    }

    /// The whole statement's place.
    pub(crate) fn statement_span(&self) -> Span {
        Span { file: self.file(), start: self.statement.start, end: self.statement.end }
    }

    /// Takes the next token if it is a `kind`.
    pub(crate) fn eat(&mut self, kind: Kind) -> bool {
        let found = self.kind() == Some(kind);
        self.at += usize::from(found);
        found
    }

    /// Takes the next token if it is a name.
    pub(crate) fn name(&mut self) -> Option<(&'a str, Span)> {
        let token = self.token().filter(|token| token.kind == Kind::Name)?;
        self.at += 1;
        Some((self.slice(token), self.span_of(token)))
    }

    /// An error at the next token: the manual's error `number` with `message`. If what is there
    /// is not a token, or the file ends there inside a statement, the error is the one for that
    /// instead.
    pub(crate) fn error_here(&self, number: u8, message: impl Into<MessageText>) -> Diagnostic {
        match self.kind() {
            Some(Kind::Bad(fault)) => self.bad(fault),
            None if self.statement.open => {
                error(2, self.span(), "the file ends in the middle of a statement")
                    .help("finish the statement, or remove the `#` that continues it")
            }
            _ => error(number, self.span(), message),
        }
    }

    /// The next token as a message names it.
    pub(crate) fn found(&self) -> String {
        match self.token() {
            Some(token) => {
                let text = self.slice(token);
                match text.char_indices().nth(20) {
                    Some((cut, _)) => format!("`{}…`", text.get(..cut).unwrap_or("")),
                    None => format!("`{text}`"),
                }
            }
            None => "the end of the statement".to_owned(),
        }
    }

    /// The error of text that is not a token.
    fn bad(&self, fault: Fault) -> Diagnostic {
        let span = self.span();
        let text = self.token().map_or("", |token| self.slice(token));
        let short: String = text.chars().take(20).collect();
        let before = self.text.get(..span.start as usize).unwrap_or("");
        let word = before.trim_end_matches(|c: char| c.is_ascii_alphanumeric());
        let word = word.strip_suffix(['$', '@']).unwrap_or(word).len();
        let word = before.get(word..).unwrap_or("");
        match fault {
            Fault::Extraneous if text.starts_with(|c: char| c.is_ascii_lowercase()) => {
                error(5, span, "small letters have no place in a PMI program")
                    .help(format!("write it in capitals: {word}{}", short.to_ascii_uppercase()))
                    .replace(text.to_ascii_uppercase())
            }
            Fault::Extraneous if text.starts_with(|c: char| c.is_ascii_uppercase()) => {
                error(5, span, format!("`{short}` directly follows a number"))
                    .help("a name starts with a letter, and a number has digits only")
            }
            Fault::Extraneous => error(5, span, format!("`{short}` has no meaning here"))
                .help("remove it; only comments and texts may hold any character"),
            Fault::LongName => error(4, span, format!("`{short}` has more than six characters"))
                .help("shorten the name everywhere, or compile with `--limits none`"),
            Fault::Digits => error(28, span, "the number has more than nine digits")
                .help("a number has at most nine digits; `--limits none` allows more"),
            Fault::Fraction => error(30, span, format!("`{short}` is not a whole number"))
                .help("PMI knows whole numbers only; scale the value, and multiply first"),
            Fault::TooLarge => error(30, span, format!("`{short}` does not fit in a LONG"))
                .help("the largest number is 2147483647"),
            Fault::HashInText => {
                error(11, span, "`#` is in a text, where it is taken for a continuation")
                    .help("write the text without `#`")
                    .replace(text.replace('#', ""))
            }
            Fault::OpenText => {
                error(11, span, "the text is not closed on its line").help("put a \" after it")
            }
        }
    }
}
