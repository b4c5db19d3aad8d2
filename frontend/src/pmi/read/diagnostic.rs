//! Errors by the manual's numbers (PMI 4.5), and the warnings.

use plcc_diag::{Diagnostic, MessageText, Span};

/// What reading or checking a statement returns: the statement's first error.
pub(crate) type Result<T = ()> = std::result::Result<T, Box<Diagnostic>>;

/// Makes the function that turns an error's number into its code.
macro_rules! codes {
    ($($n:literal)*) => {
        /// The code `PMI-n` of the manual's error n; `PMI-45`, the compiler's own error, for a
        /// number that is not in the list.
        fn code(number: u8) -> &'static str {
            match number {
                $($n => concat!("PMI-", $n),)*
                _ => "PMI-45",
            }
        }
    };
}
codes!(1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20 21 22 23 24 25 28 29 30 31 32 34 35 36
       37 38 39 40 41 42 43 44 46 47);

/// An array index that is outside its array whatever happens.
pub(crate) const OUT_OF_ARRAY: &str = "PMI-X1";
/// Two outputs that share a line.
pub(crate) const SHARED_OUTPUT: &str = "PMI-X2";
/// Included files that are too long in all.
pub(crate) const TOO_MUCH_INCLUDED: &str = "PMI-X3";
/// A line of more than 71 characters.
pub(crate) const LONG_LINE: &str = "PMI-W1";
/// Curly quotes or dashes.
pub(crate) const TYPOGRAPHY: &str = "PMI-W2";
/// `$AUXAXIS` is kept and not acted on.
pub(crate) const AUXAXIS: &str = "PMI-W3";
/// A text that does not fit the display.
pub(crate) const LONG_TEXT: &str = "PMI-W4";

/// The manual's error `number`.
pub(crate) fn error(number: u8, span: Span, message: impl Into<MessageText>) -> Diagnostic {
    Diagnostic::error(code(number), span, message)
}

/// What a user can do about an error of this code, for errors that were made without a help.
pub(crate) fn default_help(code: &str) -> Option<&'static str> {
    Some(match code {
        "PMI-9" => "a name is a letter and up to five letters and digits",
        "PMI-11" => "`plcc explain PMI-11` lists what may be wrong",
        "PMI-12" => "write a number without sign, fraction or name",
        "PMI-21" => "E delays switching on, D switching off: E/TC/DC = 50",
        "PMI-24" => "M codes are @M00 to @M299, G codes @G00 to @G199",
        _ => return None,
    })
}

/// Adds a help without replacing the one that an error has.
pub(crate) trait HelpIfNone {
    /// The same with `text` as its help, unless it has one.
    fn help_if_none(self, text: impl Into<MessageText>) -> Self;
}

impl HelpIfNone for Diagnostic {
    fn help_if_none(self, text: impl Into<MessageText>) -> Self {
        if self.help.is_some() { self } else { self.help(text) }
    }
}
