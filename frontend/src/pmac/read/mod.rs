//! Source text to a download, in two stages. What is checked here is the form of the text: words,
//! numbers that the controller does not have, IF and WHILE with their ends, which the controller
//! checks as well when it reads a CLOSE. What needs the whole download, such as definitions that
//! may come later, is checked in `analyse`.
//!
//! 1. [`preprocess`] makes one text of all files: it reads `#include` and the other `directives`,
//!    replaces the names of `#define` (`macros`) and `$(NAME)` (`template`), and drops `comments`.
//! 2. [`download`] reads that text: on-line commands ([`online`], `buffers`) and the statements of
//!    the buffers between them ([`statement`], `structure`, `command`, `texts`, `ring`). Both use
//!    the parsers of [`expr`], [`assign`], [`define`] and the table of `words`. `motion_program` and
//!    `motion_structure` read motion programs, in which lines count, `motion_calls` the words after calls; `kinematics` is for the programs of
//!    Turbo PMAC's kinematics, which are read as PLCs. `skip` passes over other buffers. After an error, `report` and `recover` find where reading goes on, and
//!    `other_languages` says what people who know other languages probably meant.

pub(crate) mod assign;
mod buffers;
mod command;
pub(crate) mod comments;
pub(crate) mod cursor;
pub(crate) mod define;
mod directives;
pub(crate) mod download;
pub(crate) mod expr;
mod kinematics;
mod macros;
mod motion_calls;
mod motion_command;
mod motion_program;
mod motion_structure;
mod motion_words;
pub(crate) mod online;
pub(crate) mod other_languages;
pub(crate) mod preprocess;
mod ranges;
mod recover;
mod report;
mod ring;
mod skip;
pub(crate) mod statement;
mod structure;
mod template;
mod texts;
pub(crate) mod words;
mod words_of_other_languages;

pub(in crate::pmac) use command::online_actions;
