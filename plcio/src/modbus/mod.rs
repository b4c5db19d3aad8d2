//! Modbus: clients ([`client`]), which ask devices, and the server ([`server`]), which others ask.

mod blocks;
pub(crate) mod client;
mod connection;
pub(crate) mod server;
mod visitors;
