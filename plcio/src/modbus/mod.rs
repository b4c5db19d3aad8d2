//! Modbus: clients ([`client`]), which ask devices, and the server ([`server`]), which others ask.

mod blocks;
pub(crate) mod client;
mod client_events;
mod connection;
mod link;
mod registers;
mod reports;
pub(crate) mod server;
mod unfit;
mod unit;
