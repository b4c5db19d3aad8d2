//! The manual's tables of names as data.

pub mod names;
