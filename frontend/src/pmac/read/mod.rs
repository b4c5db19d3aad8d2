//! Text to statements: the download program's macros, the cursor, the parsers of statements and of
//! on-line commands, and how reading goes on behind an error.

pub(crate) mod assign;
mod buffers;
mod command;
pub(crate) mod cursor;
pub(crate) mod define;
pub(crate) mod download;
pub(crate) mod expr;
pub(crate) mod online;
pub(crate) mod origin;
pub(crate) mod preprocess;
mod recover;
mod report;
mod ring;
pub(crate) mod statement;
mod structure;
mod template;
mod texts;
mod words;
