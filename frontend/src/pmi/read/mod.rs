//! PMI text to statements: files and lines, tokens, and the cursor that walks a statement's tokens.

pub(crate) mod cursor;
pub(crate) mod diagnostic;
pub(crate) mod lexer;
pub(crate) mod statements;
pub(crate) mod token;
