//! Modbus: clients ([`client`]), which ask devices, and the server ([`server`]), which others ask.

mod blocks;
pub(crate) mod client;
mod client_events;
mod connection;
pub(crate) mod server;
