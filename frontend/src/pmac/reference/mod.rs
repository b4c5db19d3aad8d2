//! The manuals' tables of I- and M-variables as data, and what `plcc explain` and the listings say
//! of them.

pub mod describe;
pub mod listing_comments;
pub mod tables;
