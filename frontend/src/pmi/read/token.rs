//! The tokens of PMI, and what can be wrong with one.

/// Names that no program may declare (PMI 2.2.3).
pub(crate) const RESERVED: [&str; 7] = ["IF", "ELSE", "ELSEIF", "ENDIF", "GOTO", "T", "F"];

/// What a token is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Letters and digits, a letter first.
    Name,
    /// `@` and letters and digits.
    Executive,
    /// `$` and letters and digits.
    Directive,
    /// A number that fits in a LONG.
    Number(u32),
    /// Text between quotes.
    Text,
    /// `=`
    Eq,
    /// `/=`
    Ne,
    /// `<`
    Lt,
    /// `<=`
    Le,
    /// `>`
    Gt,
    /// `>=`
    Ge,
    /// `+`
    Plus,
    /// `-`
    Minus,
    /// `*`
    Star,
    /// `/`
    Slash,
    /// `%`
    Percent,
    /// `&`
    And,
    /// `!`
    Or,
    /// `(`
    LParen,
    /// `)`
    RParen,
    /// `[`
    LBracket,
    /// `]`
    RBracket,
    /// `,`
    Comma,
    /// `:`
    Colon,
    /// Text that is not a token. It is reported when the parser comes to it.
    Bad(Fault),
}

/// Why some text is not a token. The number after the colon is the manual's error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Fault {
    /// A character outside PMI's set, a small letter, a letter after a number: 5.
    Extraneous,
    /// A name of more than six characters: 4.
    LongName,
    /// A number of more than nine digits: 28.
    Digits,
    /// A number with a decimal point: 30.
    Fraction,
    /// A number above 2147483647: 30.
    TooLarge,
    /// A `#` between quotes: 11.
    HashInText,
    /// A quote that is not closed on its line: 11.
    OpenText,
}

/// A token and its place in its file.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Token {
    pub(crate) kind: Kind,
    pub(crate) start: u32,
    pub(crate) end: u32,
}
