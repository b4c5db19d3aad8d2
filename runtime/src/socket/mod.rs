//! placeholder
pub(crate) mod commands;
pub(crate) mod hook;
mod connection;
mod peer;
mod protocol;
