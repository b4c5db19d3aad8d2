//! The manual's tables of names as data.

pub(crate) mod executive;
