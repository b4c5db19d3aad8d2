//! Text to statements: the download program's macros, the cursor, the parsers of statements and of
//! on-line commands, and how reading goes on behind an error.

pub(crate) mod assign;
mod buffers;
mod command;
mod comments;
pub(crate) mod cursor;
pub(crate) mod define;
mod directives;
pub(crate) mod download;
pub(crate) mod expr;
mod macros;
pub(crate) mod online;
pub(crate) mod preprocess;
mod recover;
mod report;
mod ring;
mod skip;
pub(crate) mod statement;
mod structure;
mod template;
mod texts;
mod words;
