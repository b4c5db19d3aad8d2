//! Runs `plcrt`, the loader, as a process that has to keep its time and its safe side, whatever happens
//! around it.
#![cfg(unix)]
#![allow(clippy::unwrap_used, clippy::panic)]

mod configuration;
mod killed_records;
mod outputs;
mod record;
mod shop;
#[cfg(target_os = "linux")]
mod supervisor;
