//! Reads a module from text: cuts it into [tokens](super::lex), finds their
//! [structure](super::grammar), and [looks up](super::resolve) what each name stands for. If one of
//! these steps fails, there is an error with its place.

use chumsky::Parser;
use chumsky::error::{Rich, RichPattern, RichReason};

use super::error::ParseError;
use super::grammar::module;
use super::lex::{Token, Tokens};
use super::resolve::resolve;
use crate::Module;

/// Reads a module. Every name in what is read leads somewhere; whether the module keeps the
/// other rules of IR, the [verifier](crate::verify) says.
///
/// # Errors
/// At the first place that cannot be read: what was expected there and what was found, or the
/// name that stands for nothing.
pub fn parse(text: &str) -> Result<Module, ParseError> {
    let tokens = Tokens::new(text)?;
    let items = module().parse(tokens.tokens.as_slice()).into_result().map_err(|errors| {
        let message = errors.first().map(message).unwrap_or_default();
        let at = errors.first().map_or(0, |error| error.span().start);
        tokens.error(at, message)
    })?;
    resolve(&tokens, items)
}

/// The message of an error: `expected A, B or C, found D`.
fn message(error: &Rich<'_, Token<'_>>) -> String {
    let (expected, found) = match error.reason() {
        RichReason::ExpectedFound { expected, found } => (expected, found),
        RichReason::Custom(message) => return message.clone(),
    };
    let mut expected: Vec<String> = expected.iter().filter_map(description).collect();
    expected.sort_unstable();
    expected.dedup();
    let last = expected.pop().unwrap_or_default();
    let found = found.as_ref().map_or("the end of the text".into(), |token| token.description());
    match expected.as_slice() {
        [] => format!("expected {last}, found {found}"),
        others => format!("expected {} or {last}, found {found}", others.join(", ")),
    }
}

fn description(pattern: &RichPattern<'_, Token<'_>>) -> Option<String> {
    match pattern {
        RichPattern::Token(token) => Some(token.description()),
        RichPattern::Label(label) => Some(label.to_string()),
        RichPattern::EndOfInput => Some("the end of the text".into()),
        _ => None,
    }
}
