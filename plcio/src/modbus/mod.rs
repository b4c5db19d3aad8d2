//! Modbus: clients ([`client`]), which ask devices, and the server ([`server`]), which others ask.

mod blocks;
pub(crate) mod client;
pub(crate) mod server;
