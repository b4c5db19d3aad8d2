//! The PMAC language.
