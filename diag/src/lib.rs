//! Source texts, places in them, and diagnostics.
//!
//! A front end reports what it finds in a program as [`Diagnostic`]s: errors, warnings and notes,
//! each with a code (`PMI-31`) and the place that it is about. This crate holds what all languages
//! need for that. The only part that belongs to single languages is the explanation of
//! each code, called its page, which `plcc explain` prints:
//!
//! - [`SourceMap`] holds the files of one compilation as decoded text, and finds the line and
//!   column of a byte offset. It is given the bytes of the files and does not read any itself.
//! - [`Span`] is a piece of one file's text.
//! - [`Diagnostic`] is one finding. [`json::line`] prints it for programs, `render::draw` (with the
//!   feature `render`) draws it for people with an excerpt of the source.
//! - [`find_code`] gives the page of a code: what it means, why the program is refused or warned
//!   of, and an example of how to fix it.
//!
//! ```
//! use plcc_diag::{Diagnostic, SourceMap, Span, find_code, json};
//!
//! let mut sources = SourceMap::new();
//! let file = sources.add("pump.pmi", b"$END\r\nPUMP = REDY\r\n");
//! let place = Span::new(file, 13, 17);
//! let error = Diagnostic::error("PMI-31", place, "nothing is named REDY").help("declare it");
//!
//! assert_eq!(sources.slice(place), "REDY");
//! assert_eq!(sources.line_col(file, place.start), (2, 8));
//! assert!(json::line(&sources, &error).starts_with(r#"{"code":"PMI-31","severity":"error""#));
//! assert_eq!(find_code("pmi-31").map(|page| page.title), Some("undefined variable"));
//! ```

pub mod code;
pub mod codes;
mod decode;
mod diagnostic;
pub mod json;
pub mod lints;
#[cfg(feature = "render")]
pub mod render;
mod source;
mod span;

pub use code::{CodeInfo, find_code};
pub use diagnostic::{Diagnostic, Label, MessageText, Replacement, Severity};
pub use source::SourceMap;
pub use span::{FileId, Span};
