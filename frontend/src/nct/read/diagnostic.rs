//! The errors of the manual's list (NCT 6.3), and how the parser makes them.

use plcc_diag::{Diagnostic, MessageText, Span};

/// An error of a statement that could not be read.
pub(crate) type SyntaxError = Box<Diagnostic>;

/// What was read, or why it could not be read.
pub(crate) type Read<T> = Result<T, SyntaxError>;

macro_rules! codes {
    ($($number:literal)*) => {
        /// The code of an error of the manual's list; `NCT-X1`, plcc's own error, for a number that
        /// is not in the list.
        pub(crate) fn code(number: u8) -> &'static str {
            match number {
                $($number => concat!("NCT-", $number),)*
                _ => "NCT-X1",
            }
        }
    };
}

codes! {
    1 2 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20 22 23 24 25 26 27 28 29 30 31 32 33 34 35 36 37
    38 39 40 41 42 43 44 45 46 47 48 49 50 51 52 53 54 55 56 57 58 59 60 61 62 63 64 65 66 67 68 69
    71 72 73 74 75 76
}

/// The error `number` of the manual's list.
pub(crate) fn error(
    number: u8,
    span: Span,
    message: impl Into<MessageText>,
    help: impl Into<MessageText>,
) -> SyntaxError {
    Box::new(Diagnostic::error(code(number), span, message).help(help))
}

/// A character as a message names it; `None` is the end of the text.
pub(crate) fn shown(c: Option<char>) -> String {
    match c {
        Some(c) => format!("`{c}`"),
        None => "the end of the text".into(),
    }
}
