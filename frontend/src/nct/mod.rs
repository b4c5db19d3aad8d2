//! The NCT language.
