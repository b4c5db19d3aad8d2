//! Modbus: over TCP and serial lines `plcio` asks devices, and others ask the server of `plcio`.

mod address;
mod format;
mod settings;

use std::sync::Arc;

pub use address::{Medium, ModbusAddress, Table};
pub use format::{Coding, Format, Order};
pub use settings::{DeviceSettings, Manner, Settings};

use crate::{Address, Driver, DriverSettings};

pub(super) const DRIVERS: &[&dyn Driver] = &[&ModbusTcp, &ModbusRtu, &ModbusServer];

/// `plcio` asks a device over TCP.
#[derive(Debug)]
struct ModbusTcp;

/// `plcio` asks a device over a serial line.
#[derive(Debug)]
struct ModbusRtu;

/// Others ask `plcio` over TCP.
#[derive(Debug)]
struct ModbusServer;

/// A point with an address that is read so.
fn parsed(text: &str, is_tcp: bool, is_serial: bool) -> Result<Option<Arc<dyn Address>>, String> {
    Ok(Some(Arc::new(ModbusAddress::parse(text, is_tcp, is_serial)?)))
}

impl Driver for ModbusTcp {
    fn name(&self) -> &'static str {
        "modbus-tcp"
    }

    fn address(&self, text: &str) -> Result<Option<Arc<dyn Address>>, String> {
        parsed(text, true, false)
    }

    fn lists_addresses(&self) -> bool {
        true
    }
}

impl Driver for ModbusRtu {
    fn name(&self) -> &'static str {
        "modbus-rtu"
    }

    fn address(&self, text: &str) -> Result<Option<Arc<dyn Address>>, String> {
        parsed(text, false, true)
    }

    fn lists_addresses(&self) -> bool {
        true
    }
}

impl Driver for ModbusServer {
    fn name(&self) -> &'static str {
        "modbus-server"
    }

    fn address(&self, text: &str) -> Result<Option<Arc<dyn Address>>, String> {
        parsed(text, false, false)
    }

    fn lists_addresses(&self) -> bool {
        true
    }

    fn missing_setting(&self, settings: &DriverSettings) -> Option<&'static str> {
        settings.modbus.server.is_none().then_some("`modbus-server`, which says where it listens")
    }
}
