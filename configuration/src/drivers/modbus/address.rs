//! Addresses of points in Modbus.
//!
//! | driver | address | example |
//! | --- | --- | --- |
//! | `modbus-tcp` | `HOST[:PORT]/UNIT/TABLE/NUMBER[:FORMAT]` | `192.168.1.10/1/holding/100:f32`, `[fd00::10]:502/1/coil/0` |
//! | `modbus-rtu` | `DEVICE[@BAUD[-8N1]]/UNIT/TABLE/NUMBER[:FORMAT]` | `/dev/ttyUSB0@19200-8E1/7/coil/0` |
//! | `modbus-server` | `TABLE/NUMBER[:FORMAT]` | `holding/0` |
//!
//! TABLE is `coil`, `discrete` (input), `input` (register) or `holding` (register). Numbers count from 0. FORMAT is
//! for registers; [`Format`] has it. `holding/7.3` is bit 3 of a register, the same as `holding/7:bit3`.

use std::fmt;
use std::net::Ipv6Addr;
use std::sync::Arc;

use super::format::{Coding, Format};
use crate::{Address, ValueFormat};

/// How a device is reached.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Medium {
    /// By TCP: host and port.
    Tcp(String, u16),
    /// By a serial line: the device, bauds, and the letter of the parity (`N`, `E` or `O`).
    Serial(String, u32, char),
    /// The point belongs to the server of `plcio`, which others ask.
    Server,
}

impl Medium {
    /// Reads a host and port, or a serial line, which is a path.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn parse(text: &str) -> Result<Self, String> {
        if text.starts_with('/') { line(text) } else { host(text) }
    }

    /// Whether two of them are the same device or the same line, also with other bauds.
    pub fn is_same(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Serial(own, ..), Self::Serial(other, ..)) => own == other,
            _ => self == other,
        }
    }
}

impl fmt::Display for Medium {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Tcp(host, port) if host.contains(':') => write!(f, "[{host}]:{port}"),
            Self::Tcp(host, port) => write!(f, "{host}:{port}"),
            Self::Serial(device, ..) => f.write_str(device),
            Self::Server => f.write_str("the server"),
        }
    }
}

/// A table of a Modbus device.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Table {
    /// Bits that can be read and written.
    Coil,
    /// Bits that can be read.
    Discrete,
    /// Registers that can be read.
    Input,
    /// Registers that can be read and written.
    Holding,
}

/// A point of a Modbus device.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct ModbusAddress {
    /// How the device is reached.
    pub medium: Medium,
    /// The number of the unit there.
    pub unit: u8,
    /// The table.
    pub table: Table,
    /// The number in the table, from 0.
    pub number: u16,
    /// How it makes a value.
    pub format: Format,
}

impl ModbusAddress {
    /// Reads an address: of the driver `modbus-tcp` if `tcp` is true, of `modbus-rtu` if `serial` is, else of
    /// `modbus-server`.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn parse(text: &str, tcp: bool, serial: bool) -> Result<Self, String> {
        let mut parts: Vec<&str> = text.rsplitn(if tcp || serial { 4 } else { 2 }, '/').collect();
        parts.reverse();
        let (medium, unit, table, number) = match *parts.as_slice() {
            [host, unit, table, number] if tcp => (self::host(host)?, unit, table, number),
            [device, unit, table, number] if serial => (line(device)?, unit, table, number),
            [table, number] if !tcp && !serial => (Medium::Server, "0", table, number),
            _ => {
                let form = match (tcp, serial) {
                    (true, _) => "HOST:PORT/UNIT/TABLE/NUMBER, as in 192.168.1.10:502/1/coil/0",
                    (_, true) => {
                        "DEVICE@BAUD/UNIT/TABLE/NUMBER, as in /dev/ttyUSB0@19200-8E1/1/coil/0"
                    }
                    _ => "TABLE/NUMBER, as in holding/0",
                };
                return Err(format!("`{text}` is not an address: {form} is expected"));
            }
        };
        let table = match table {
            "coil" => Table::Coil,
            "discrete" => Table::Discrete,
            "input" => Table::Input,
            "holding" => Table::Holding,
            _ => {
                return Err(format!(
                    "`{table}` is not a table; the tables are coil, discrete, input and holding"
                ));
            }
        };
        let unit =
            unit.parse().map_err(|_| format!("`{unit}` is not a unit; units are 0 to 255"))?;
        let (number, format) = match number.split_once(':') {
            Some((number, format)) => (number, Some(format)),
            None => (number, None),
        };
        let is_bit = matches!(table, Table::Coil | Table::Discrete);
        let (number, bit) = match number.split_once('.') {
            Some((number, bit)) => (number, Some(format!("bit{bit}"))),
            None => (number, None),
        };
        if let (Some(_), Some(format)) = (&bit, format) {
            return Err(format!("a bit of a register has no format `{format}`"));
        }
        let format = match format.or(bit.as_deref()) {
            None if is_bit => Format::Bit,
            None => Format::DEFAULT,
            Some(format) if is_bit => return Err(format!("a single bit has no format `{format}`")),
            Some(format) => Format::parse(format)?,
        };
        let number = number.parse().map_err(|_| {
            format!("`{number}` is not the number of a point: those are 0 to 65535")
        })?;
        Ok(Self { medium, unit, table, number, format })
    }

    /// The address of the point number `index` (from 0) of a range that begins here. `None` if it is beyond the
    /// last number of the table, 65535.
    fn after(&self, index: usize) -> Option<Self> {
        let mut next = self.clone();
        if let Format::BitOf(bit) = self.format {
            let at = usize::from(bit) + index;
            next.format = Format::BitOf((at % 16) as u8);
            next.number = self.number.checked_add(u16::try_from(at / 16).ok()?)?;
        } else {
            let step = index.checked_mul(usize::from(self.format.registers()))?;
            next.number = self.number.checked_add(u16::try_from(step).ok()?)?;
        }
        next.number.checked_add(self.format.registers() - 1)?;
        Some(next)
    }
}

impl Address for ModbusAddress {
    fn nth(&self, index: usize) -> Option<Arc<dyn Address>> {
        Some(Arc::new(self.after(index)?))
    }

    fn written(&self) -> Option<String> {
        let Self { medium, unit, table, number, format } = self;
        let device = match medium {
            Medium::Server => String::new(),
            medium => format!("{medium}/{unit}/"),
        };
        let table = match table {
            Table::Coil => "coil",
            Table::Discrete => "discrete",
            Table::Input => "input",
            Table::Holding => "holding",
        };
        let bit = match format {
            Format::BitOf(bit) => format!(".{bit}"),
            Format::Bit | Format::Number(..) => String::new(),
        };
        Some(format!("{device}{table}/{number}{bit}"))
    }

    fn unfit(&self, is_input: bool, is_bit: bool) -> Option<String> {
        if self.format.is_bit() != is_bit {
            let (is, needs) = match is_bit {
                true => ("a bit", "a coil, a discrete input or a bit of a register"),
                false => ("a number", "a register"),
            };
            return Some(format!("is {is}, which needs {needs}"));
        }
        let is_read_only = matches!(self.table, Table::Discrete | Table::Input);
        match (&self.medium, is_input) {
            (Medium::Server, true) if is_read_only => {
                Some("is given from outside, but its table can't be written".into())
            }
            (Medium::Tcp(..) | Medium::Serial(..), false) if is_read_only => {
                Some("goes outside, but its table can only be read".into())
            }
            _ => None,
        }
    }

    fn formats(&self) -> Option<(ValueFormat, Vec<ValueFormat>)> {
        let Format::Number(coding, _) = self.format else { return None };
        let format = |coding: Coding| {
            let (low, high) = coding.range();
            ValueFormat { name: coding.name(), low, high }
        };
        Some((format(coding), Coding::all().map(format).collect()))
    }
}

/// Reads `HOST[:PORT]`. An address of IPv6 is in brackets, with its zone where it needs one: `[fe80::1%eth0]:502`.
fn host(text: &str) -> Result<Medium, String> {
    let (host, port) = match text.rsplit_once(':') {
        // A colon in brackets is one of the address.
        Some((host, port)) if !port.ends_with(']') => (host, port.parse().ok()),
        _ => (text, Some(502)),
    };
    let inner = host.strip_prefix('[').and_then(|rest| rest.strip_suffix(']'));
    let is_v6 = |address: &str| {
        let (address, zone) = address.split_once('%').unwrap_or((address, "zone"));
        !zone.is_empty() && address.parse::<Ipv6Addr>().is_ok()
    };
    let host = match inner {
        Some(address) => Some(address).filter(|address| is_v6(address)),
        None => Some(host).filter(|host| !host.is_empty() && !host.contains([':', '[', ']'])),
    };
    match (host, port) {
        (Some(host), Some(port)) => Ok(Medium::Tcp(host.into(), port)),
        _ => Err(format!(
            "`{text}` is not a host and a port, as in 192.168.1.10:502; an IPv6 address is in brackets, as in [fd00::10]:502"
        )),
    }
}

fn line(text: &str) -> Result<Medium, String> {
    let (device, settings) = text.split_once('@').unwrap_or((text, "19200-8E1"));
    let (bauds, frame) = settings.split_once('-').unwrap_or((settings, "8E1"));
    let parity = match frame {
        "8N1" => 'N',
        "8E1" => 'E',
        "8O1" => 'O',
        _ => return Err(format!("`{frame}` is not a frame; the frames are 8E1, 8N1 and 8O1")),
    };
    match bauds.parse() {
        Ok(bauds) if !device.is_empty() => Ok(Medium::Serial(device.into(), bauds, parity)),
        _ => Err(format!("`{text}` is not a serial line, as in /dev/ttyUSB0@19200-8E1")),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::super::format::Order;
    use super::*;

    #[test]
    fn addresses_name_a_device_and_a_point() {
        let tcp = |text| ModbusAddress::parse(text, true, false);
        let swapped = Order { is_low_word_first: true, is_low_byte_first: false };
        let point = tcp("io.local:1502/3/holding/100:f32-swapped").unwrap();
        assert_eq!(point.medium, Medium::Tcp("io.local".into(), 1502));
        assert_eq!((point.unit, point.table, point.number), (3, Table::Holding, 100));
        assert_eq!(point.format, Format::Number(Coding::F32, swapped));
        assert_eq!(point.after(3).map(|next| next.number), Some(106));
        assert_eq!(tcp("10.0.0.1/1/coil/0").unwrap().medium, Medium::Tcp("10.0.0.1".into(), 502));
        for (text, host, port) in [
            ("[::1]:502/1/coil/0", "::1", 502),
            ("[fe80::1%eth0]/1/coil/0", "fe80::1%eth0", 502),
            ("[fd00::10]:1502/1/coil/0", "fd00::10", 1502),
        ] {
            let medium = tcp(text).unwrap().medium;
            assert_eq!(medium, Medium::Tcp(host.into(), port));
            assert_eq!(medium.to_string(), format!("[{host}]:{port}"));
        }
        let bit = tcp("h/1/holding/5:bit14").unwrap().after(3).unwrap();
        assert_eq!((bit.number, bit.format), (6, Format::BitOf(1)));
        assert_eq!(tcp("h/1/holding/5.14"), tcp("h/1/holding/5:bit14"));
        assert_eq!(tcp("h/1/input/65535").unwrap().after(1), None);
        let serial = ModbusAddress::parse("/dev/ttyS0@9600-8N1/7/discrete/2", false, true).unwrap();
        assert_eq!(serial.medium, Medium::Serial("/dev/ttyS0".into(), 9600, 'N'));
        assert_eq!(
            ModbusAddress::parse("input/4:i16", false, false).unwrap().format,
            Format::Number(Coding::I16, Order::default())
        );
        for text in [
            "",
            "h",
            "h/1/coil",
            "h/256/coil/0",
            "h/1/coils/0",
            "h/1/coil/65536",
            "h/1/coil/0:u16",
            "h:x/1/coil/0",
            "::1/1/coil/0",
            "fd00::10:502/1/coil/0",
            "[::1/1/coil/0",
            "[1.2.3.4]:502/1/coil/0",
            "[]:502/1/coil/0",
            "[::1]x:502/1/coil/0",
            "[fe80::1%]/1/coil/0",
            "/1/coil/0",
            "h/1/input/0:u16-swapped",
            "h/1/input/0:bit16",
            "h/1/input/0.16",
            "h/1/input/0.",
            "h/1/input/0.1:bit1",
            "h/1/coil/0.1",
        ] {
            assert!(tcp(text).is_err(), "{text}");
        }
        assert!(ModbusAddress::parse("/dev/ttyS0@x/1/coil/0", false, true).is_err());
    }
}
