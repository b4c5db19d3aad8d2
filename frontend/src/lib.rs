//! The languages: source text of PMI, NCT and PMAC to a checked program, and from there to IR and
//! to a statement interpreter.
//!
//! Each language has a folder, [`pmi`], [`nct`] and [`pmac`], all in the same shape: `read` (text
//! to statements), `analyse` (statements to the checked program, diagnostics), `lower` (to IR),
//! `oracle` (the statement interpreter, which shares nothing with `lower`), `reference` (the
//! manual's tables). [`common`] holds what they share. The main types:
//!
//! - [`Language`]: recognises, checks and explains programs; the list of all is [`LANGUAGES`].
//! - [`CheckedProgram`]: a program without errors; makes its IR, its interpreter, its
//!   cross-reference.
//! - [`Presentation`]: what displays, debuggers and editors ask about a program's names and its text.
//! - [`common::Options`]: what is fixed when a program is compiled.
//!
//! A comment such as `PMI 2.3.7` or `NCT 4.10` names the section of the control's manual that says
//! so. A ruling is what plcc does where a manual is silent or contradicts itself; the rulings are
//! in the project's `docs/pmi.md`, `docs/nct.md` and `docs/pmac.md`.
//!
//! ```
//! use plcc_abi::Dialect;
//! use plcc_diag::SourceMap;
//! use plcc_frontend::common::{MemoryLoader, Options};
//! use plcc_frontend::language;
//!
//! let mut sources = SourceMap::new();
//! let file = sources.add("count.pmi", b"$INTEGER\nN\n$END\nN = N + 1\n");
//! let pmi = language(Dialect::Pmi);
//! let (program, diagnostics) =
//!     pmi.check(&mut sources, &[file], &MemoryLoader::new(), &Options::default());
//! assert!(diagnostics.is_empty());
//! let lowered = program.map(|program| program.lower());
//! let tasks = lowered.and_then(Result::ok).map(|lowered| lowered.program.tasks.len());
//! assert_eq!(tasks, Some(1));
//! ```
//!
//! Architecture Invariant: nothing here does input or output. Files are asked of a
//! [`common::FileLoader`].

pub mod common;
pub mod detect;
pub mod language;
pub mod nct;
pub mod pmac;
pub mod pmi;
pub mod presentation;

pub use language::{
    CheckedProgram, LANGUAGES, Language, LengthCodes, RestOfCheck, Titles, Topic, language,
};
pub use presentation::Presentation;
