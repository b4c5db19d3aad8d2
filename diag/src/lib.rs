//! Places in source text, diagnostics, and the table of codes.
//!
//! Knows no language and does no IO: a [`SourceMap`] is given bytes and keeps text, a front end
//! returns [`Diagnostic`]s, and whoever talks to a person draws them (feature `render`) or prints
//! them as JSON.

pub mod code;
pub mod codes;
mod decode;
mod diagnostic;
pub mod json;
#[cfg(feature = "render")]
pub mod render;
mod source;
mod span;

pub use code::{CodeInfo, find_code};
pub use diagnostic::{Diagnostic, Label, Severity};
pub use source::SourceMap;
pub use span::{FileId, Span};
