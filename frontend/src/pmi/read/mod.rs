//! Makes statements of PMI's text: files and lines, tokens, and the cursor over a statement's
//! tokens.

pub(crate) mod cursor;
pub(crate) mod diagnostic;
pub(crate) mod lexer;
pub(crate) mod statements;
pub(crate) mod token;
