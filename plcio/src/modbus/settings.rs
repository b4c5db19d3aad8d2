//! What the configuration says of single devices: tables `[[plcio.device]]`.

use std::time::Duration;

use plcc_abi::closest;
use plcc_image::configuration::{Driver, Entry, Medium, Mistake, ModbusAddress};
use toml::de::{DeTable, DeValue};

use super::Manner;

/// A device, or a unit of it, that is asked in another manner than `[plcio]` says.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct DeviceSettings {
    medium: Medium,
    /// The unit; all of the device without one.
    unit: Option<u8>,
    poll: Option<Duration>,
    answer: Option<Duration>,
    is_single: Option<bool>,
}

const KEYS: [&str; 5] = ["address", "unit", "poll_ms", "answer_ms", "write"];

/// A time from 1 ms to an hour, as keys that end in `_ms` have it.
///
/// # Errors
/// What is expected.
pub(crate) fn milliseconds(value: &DeValue<'_>) -> Result<Duration, &'static str> {
    let DeValue::Integer(number) = value else { return Err("a number of milliseconds") };
    let number = number.as_str().parse().ok().filter(|ms| (1..=3_600_000).contains(ms));
    number.map(Duration::from_millis).ok_or("a number of milliseconds")
}

/// The manner in which a unit of a device is asked, where `usual` is that of all others. What is said of a unit counts more
/// than what is said of its device.
pub(crate) fn manner(
    settings: &[DeviceSettings],
    medium: &Medium,
    unit: u8,
    usual: Manner,
) -> Manner {
    let mut manner = usual;
    for wanted in [None, Some(unit)] {
        let own = |one: &&DeviceSettings| one.medium.is_same(medium) && one.unit == wanted;
        for one in settings.iter().filter(own) {
            manner.poll = one.poll.unwrap_or(manner.poll);
            manner.answer = one.answer.unwrap_or(manner.answer);
            manner.is_single = one.is_single.unwrap_or(manner.is_single);
        }
    }
    manner
}

/// Reads the key `device`. `line_of` gives the line of an offset in the file.
pub(crate) fn read(
    value: &toml::Spanned<DeValue<'_>>,
    entries: &[Entry],
    line_of: &dyn Fn(usize) -> usize,
    mistakes: &mut Vec<Mistake>,
) -> Vec<DeviceSettings> {
    let address = |entry: &Entry| {
        let is_tcp = entry.driver == Driver::ModbusTcp;
        let is_client = is_tcp || entry.driver == Driver::ModbusRtu;
        is_client.then(|| ModbusAddress::parse(&entry.address, is_tcp, !is_tcp).ok()).flatten()
    };
    let wired: Vec<ModbusAddress> = entries.iter().filter_map(address).collect();
    let mut found: Vec<DeviceSettings> = vec![];
    let Some(tables) = value.get_ref().as_array() else {
        let message = "`device` is a list of tables: [[plcio.device]], and below it address".into();
        mistakes.push(Mistake { line: line_of(value.span().start), message });
        return found;
    };
    for table in tables {
        let line = line_of(table.span().start);
        let mut wrong = |line, message: String| mistakes.push(Mistake { line, message });
        let Some(keys) = table.get_ref().as_table() else {
            wrong(line, "a table [[plcio.device]] is expected".into());
            continue;
        };
        let Some(device) = device(keys, line, line_of, &mut wrong) else { continue };
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

/// Reads a table; nothing where it has no address that can be used.
fn device(
    table: &DeTable<'_>,
    line: usize,
    line_of: &dyn Fn(usize) -> usize,
    wrong: &mut dyn FnMut(usize, String),
) -> Option<DeviceSettings> {
    let (mut medium, mut unit, mut poll, mut answer, mut is_single) =
        (None, None, None, None, None);
    let mut is_usable = true;
    for (key, value) in table {
        let (key, line) = (key.get_ref().as_ref(), line_of(key.span().start));
        let value = value.get_ref();
        let done = match key {
            "address" => match value.as_str().map(Medium::parse) {
                Some(Ok(parsed)) => {
                    medium = Some(parsed);
                    Ok(())
                }
                Some(Err(why)) => {
                    wrong(line, format!("`address`: {why}; a unit has a key of its own, `unit`"));
                    is_usable = false;
                    continue;
                }
                None => Err("a text in quotes"),
            },
            "unit" => {
                let digits = match value {
                    DeValue::Integer(digits) => digits.as_str().parse().ok(),
                    _ => None,
                };
                unit = digits;
                unit.map(|_| ()).ok_or("a number from 0 to 255")
            }
            "poll_ms" => milliseconds(value).map(|time| poll = Some(time)),
            "answer_ms" => milliseconds(value).map(|time| answer = Some(time)),
            "write" => {
                is_single = match value.as_str() {
                    Some("single") => Some(true),
                    Some("multiple") => Some(false),
                    _ => None,
                };
                is_single.map(|_| ()).ok_or("\"single\" or \"multiple\"")
            }
            _ => {
                let near = closest(key, KEYS).map(|near| format!("; did you mean `{near}`?"));
                let near = near.unwrap_or_default();
                wrong(line, format!("there is no key `{key}` in [[plcio.device]]{near}"));
                continue;
            }
        };
        if let Err(expected) = done {
            wrong(line, format!("`{key}`: {expected} is expected"));
            is_usable = false;
        }
    }
    if !table.contains_key("address") {
        wrong(line, "the key `address` is missing in this [[plcio.device]]".into());
    }
    let medium = medium.filter(|_| is_usable)?;
    Some(DeviceSettings { medium, unit, poll, answer, is_single })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::indexing_slicing)]

    use std::path::Path;

    use crate::settings::Settings;

    use super::*;

    const POINTS: &str = "image = \"i\"\n\
        [[io]]\nname = \"A\"\ndriver = \"modbus-tcp\"\naddress = \"[::1]/1/coil/0\"\n\
        [[io]]\nname = \"B\"\ndriver = \"modbus-rtu\"\naddress = \"/dev/ttyS0@9600-8N1/7/coil/0\"\n\
        [[io]]\nname = \"C\"\ndriver = \"modbus-rtu\"\naddress = \"/dev/ttyS0@9600-8N1/8/coil/0\"\n\
        [plcio]\npoll_ms = 5\n";

    fn read(tables: &str) -> Result<Settings, Vec<Mistake>> {
        Settings::read(&format!("{POINTS}{tables}"), Path::new(""))
    }

    #[test]
    fn a_unit_is_asked_as_its_table_says_and_else_as_its_device() {
        let settings = read(
            "[[plcio.device]]\naddress = \"[::1]:502\"\nwrite = \"single\"\n\
             [[plcio.device]]\naddress = \"/dev/ttyS0\"\nunit = 7\npoll_ms = 70\n\
             [[plcio.device]]\naddress = \"/dev/ttyS0\"\npoll_ms = 80\nanswer_ms = 90\n",
        )
        .unwrap();
        let manner = |medium: &str, unit| {
            let manner = settings.manner(&Medium::parse(medium).unwrap(), unit);
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
