//! What the configuration says of the server, and of single devices: tables `[[plcio.device]]`.

use std::time::Duration;

use toml::de::{DeTable, DeValue};

use super::{Medium, ModbusAddress};
use crate::{About, Keys, LineNumbers, Mistake, ReadSettings, value};

/// The settings of Modbus.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Where the server listens. Without it there is no server.
    pub server: Option<String>,
    /// How long a client of the server may ask nothing.
    pub idle: Duration,
    /// The devices that are asked in another manner.
    pub devices: Vec<DeviceSettings>,
}

/// A device, or a unit of it, that is asked in another manner than `[plcio]` says.
#[derive(Clone, Debug, PartialEq)]
pub struct DeviceSettings {
    medium: Medium,
    /// The unit; all of the device without one.
    unit: Option<u8>,
    poll: Option<Duration>,
    answer: Option<Duration>,
    is_single: Option<bool>,
}

/// How a unit is asked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Manner {
    /// The time from one poll to the next.
    pub poll: Duration,
    /// How long it has for an answer.
    pub answer: Duration,
    /// Whether coils and registers are written singly, by the functions 5 and 6.
    pub is_single: bool,
}

impl Settings {
    /// The manner in which a unit of a device is asked, where `usual` is that of all others. What is said of a unit counts more
    /// than what is said of its device.
    pub fn manner(&self, medium: &Medium, unit: u8, usual: Manner) -> Manner {
        let mut manner = usual;
        for wanted in [None, Some(unit)] {
            let own = |one: &&DeviceSettings| one.medium.is_same(medium) && one.unit == wanted;
            for one in self.devices.iter().filter(own) {
                manner.poll = one.poll.unwrap_or(manner.poll);
                manner.answer = one.answer.unwrap_or(manner.answer);
                manner.is_single = one.is_single.unwrap_or(manner.is_single);
            }
        }
        manner
    }
}

impl ReadSettings for Settings {
    fn read(keys: &mut Keys<'_>, about: &About<'_>) -> Self {
        let devices = match keys.take("device") {
            Some((line, value)) => {
                let mut mistakes = vec![];
                let devices = devices(value.get_ref(), line, keys.lines(), about, &mut mistakes);
                keys.add(mistakes);
                devices
            }
            None => vec![],
        };
        Self {
            server: keys.read("modbus-server", value::text),
            idle: keys.time("idle", "idle_ms").unwrap_or(Duration::from_secs(60)),
            devices,
        }
    }
}

/// Reads the key `device`, which is in a line.
fn devices(
    value: &DeValue<'_>,
    line: usize,
    lines: &LineNumbers,
    about: &About<'_>,
    mistakes: &mut Vec<Mistake>,
) -> Vec<DeviceSettings> {
    let addresses =
        about.entries.iter().filter_map(|entry| entry.driver.address(&entry.address).ok()?);
    let wired = addresses.filter_map(|address| {
        let address: &dyn std::any::Any = &*address;
        let address = address.downcast_ref::<ModbusAddress>()?;
        (address.medium != Medium::Server).then(|| address.clone())
    });
    let wired: Vec<ModbusAddress> = wired.collect();
    let mut found: Vec<DeviceSettings> = vec![];
    let mut wrong = |line, message: String| mistakes.push(Mistake { line, message });
    let Some(tables) = value.as_array() else {
        wrong(line, "`device` is a list of tables: [[plcio.device]], and below it address".into());
        return found;
    };
    for table in tables {
        let line = lines.line(table.span().start);
        let Some(keys) = table.get_ref().as_table() else {
            wrong(line, "a table [[plcio.device]] is expected".into());
            continue;
        };
        let (device, found_here) = device(keys, line, lines);
        found_here.into_iter().for_each(|mistake| wrong(mistake.line, mistake.message));
        let Some(device) = device else { continue };
        let is_wired = |one: &&ModbusAddress| one.medium.is_same(&device.medium);
        let of_unit = |one: &ModbusAddress| device.unit.is_none_or(|unit| unit == one.unit);
        let is_same =
            |one: &DeviceSettings| one.medium.is_same(&device.medium) && one.unit == device.unit;
        if !wired.iter().any(|one| is_wired(&one)) {
            wrong(line, format!("no [[io]] has a point of the device `{}`", device.medium));
        } else if !wired.iter().filter(is_wired).any(of_unit) {
            let unit = device.unit.unwrap_or(0);
            wrong(line, format!("no [[io]] has a point of unit {unit} of `{}`", device.medium));
        } else if found.iter().any(is_same) {
            wrong(line, format!("`{}` has a table [[plcio.device]] already", device.medium));
        }
        found.push(device);
    }
    found
}

fn medium(value: &DeValue<'_>) -> value::Result<Medium> {
    let medium = Medium::parse(&value::text(value)?);
    medium.map_err(|why| format!("{why}; a unit has a key of its own, `unit`"))
}

fn unit(value: &DeValue<'_>) -> value::Result<u8> {
    let unit = value::integer(value).and_then(|number| u8::try_from(number).ok());
    unit.ok_or_else(|| "a number from 0 to 255 is expected".into())
}

fn is_single(value: &DeValue<'_>) -> value::Result<bool> {
    match value.as_str() {
        Some("single") => Ok(true),
        Some("multiple") => Ok(false),
        _ => Err("\"single\" or \"multiple\" is expected".into()),
    }
}

/// Reads a table; nothing where it has no address that can be used.
fn device(
    table: &DeTable<'_>,
    line: usize,
    lines: &LineNumbers,
) -> (Option<DeviceSettings>, Vec<Mistake>) {
    let mut keys = Keys::new(Some(table), "[[plcio.device]]", lines, line);
    let medium = keys.read("address", medium);
    let unit = keys.read("unit", unit);
    let poll = keys.time("poll", "poll_ms");
    let answer = keys.time("answer", "answer_ms");
    let is_single = keys.read("write", is_single);
    keys.require("address");
    let (mistakes, is_usable) = keys.finish();
    let medium = medium.filter(|_| is_usable);
    (medium.map(|medium| DeviceSettings { medium, unit, poll, answer, is_single }), mistakes)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::indexing_slicing)]

    use std::path::Path;

    use crate::Configuration;

    use super::*;

    const POINTS: &str = "image = \"i\"\n\
        [[io]]\nname = \"A\"\ndriver = \"modbus-tcp\"\naddress = \"[::1]/1/coil/0\"\n\
        [[io]]\nname = \"B\"\ndriver = \"modbus-rtu\"\naddress = \"/dev/ttyS0@9600-8N1/7/coil/0\"\n\
        [[io]]\nname = \"C\"\ndriver = \"modbus-rtu\"\naddress = \"/dev/ttyS0@9600-8N1/8/coil/0\"\n\
        [plcio]\npoll_ms = 5\n";

    fn read(tables: &str) -> Result<(Settings, Manner), Vec<Mistake>> {
        let text = format!("{POINTS}{tables}");
        let (configuration, findings) = Configuration::read(&text, Path::new("c.toml"));
        let (plcio, mistakes) = (configuration.plcio, findings.for_plcio());
        let manner = Manner { poll: plcio.poll, answer: plcio.answer, is_single: false };
        if mistakes.is_empty() { Ok((plcio.drivers.modbus, manner)) } else { Err(mistakes) }
    }

    #[test]
    fn a_unit_is_asked_as_its_table_says_and_else_as_its_device() {
        let (settings, usual) = read(
            "[[plcio.device]]\naddress = \"[::1]:502\"\nwrite = \"single\"\n\
             [[plcio.device]]\naddress = \"/dev/ttyS0\"\nunit = 7\npoll_ms = 70\n\
             [[plcio.device]]\naddress = \"/dev/ttyS0\"\npoll_ms = 80\nanswer_ms = 90\n",
        )
        .unwrap();
        let manner = |medium: &str, unit| {
            let manner = settings.manner(&Medium::parse(medium).unwrap(), unit, usual);
            (manner.poll.as_millis(), manner.answer.as_millis(), manner.is_single)
        };
        assert_eq!(manner("[::1]", 1), (5, 500, true));
        assert_eq!(manner("[::1]:503", 1), (5, 500, false));
        assert_eq!(manner("/dev/ttyS0@9600-8N1", 7), (70, 90, false));
        assert_eq!(manner("/dev/ttyS0@9600-8N1", 8), (80, 90, false));
    }

    #[test]
    fn mistakes_in_tables_of_devices_have_lines() {
        let mistakes = read(
            "[[plcio.device]]\naddress = \"[::1]\"\nunit = 256\npol_ms = 1\nanswer_ms = 0\nwrite = \"one\"\n\
             [[plcio.device]]\naddress = \"10.0.0.1\"\n\
             [[plcio.device]]\naddress = \"10.0.0.1:502/1\"\n\
             [[plcio.device]]\naddress = \"[::1]\"\nunit = 2\n\
             [[plcio.device]]\nunit = 1\n\
             [[plcio.device]]\naddress = \"[::1]\"\n\
             [[plcio.device]]\naddress = \"[::1]:502\"\n",
        )
        .unwrap_err();
        let expected = [
            (18, "`unit`: a number from 0 to 255 is expected"),
            (19, "there is no key `pol_ms` in [[plcio.device]]; did you mean `poll_ms`?"),
            (20, "`answer_ms`: a number of milliseconds is expected"),
            (21, "`write`: \"single\" or \"multiple\" is expected"),
            (22, "no [[io]] has a point of the device `10.0.0.1:502`"),
            (25, "a unit has a key of its own, `unit`"),
            (26, "no [[io]] has a point of unit 2 of `[::1]:502`"),
            (29, "the key `address` is missing in this [[plcio.device]]"),
            (33, "`[::1]:502` has a table [[plcio.device]] already"),
        ];
        assert_eq!(mistakes.len(), expected.len(), "{mistakes:#?}");
        for (mistake, (line, part)) in mistakes.iter().zip(expected) {
            assert!(mistake.line == line && mistake.message.contains(part), "{mistake:?} {part}");
        }
        let mistakes = read("device = 1\n").unwrap_err();
        assert!(mistakes[0].message.contains("[[plcio.device]]"), "{mistakes:?}");
    }
}
