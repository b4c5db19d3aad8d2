//! Reads `[simulator]`.

use alloc::{format, string::String, vec::Vec};

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::fields::{Fields, Text, line, number_of, text_of};
use super::{
    AuxEntry, AxisEntry, Decimal, DeviceEntry, DeviceKind, Located, SimulatorTable, SpindleEntry,
    TurretCode, Units,
};

/// Nanoseconds of a millisecond.
const MILLISECOND: u64 = 1_000_000;
/// The most entries of a list.
const MOST: usize = 256;

/// Reads the table `[simulator]` of a machine file that is valid TOML; `None` where it has none.
///
/// # Errors
/// An unknown key, or a value that can't be: with the line.
pub(in crate::machine) fn read(text: &str) -> Result<Option<SimulatorTable>, String> {
    let Ok(file) = DeTable::parse(text) else { return Ok(None) };
    let found = file.get_ref().iter().find(|(name, _)| name.get_ref() == "simulator");
    let Some((_, value)) = found else { return Ok(None) };
    let Some(table) = value.get_ref().as_table() else {
        return Err(format!("line {}: simulator is a table", line(text, value.span().start)));
    };
    let mut fields = Fields::new(text, "[simulator]", table, value.span().start);
    let units = fields.choice("units", ["inch", "mm"])?;
    let mut read = SimulatorTable {
        text: text.into(),
        part_program: fields.text("part_program")?,
        blocks: fields.texts("blocks")?,
        units: units.map(|mm| if mm { Units::Millimetre } else { Units::Inch }),
        lag: fields.time("lag_ms")?,
        stop: fields.time("stop_ms")?,
        home: fields.time("home_ms")?,
        machine_on: fields.time("machine_on_ms")?,
        chop: fields.time("chop_ms")?,
        option_keys_toggle: fields.choice("option_keys", ["level", "toggle"])?,
        homed: fields.flag("homed")?,
        in_position: fields.integer("in_position", 0, 0x7FFF_FFFF)?,
        feed_max: fields.positive("feed_max")?,
        misc: fields.text("misc")?,
        program_number: fields.integer("program_number", 0, 0xFFFF)?.map(|n| n as u16),
        serial: fields.text("serial")?,
        ..SimulatorTable::default()
    };
    if let Some(keys) = fields.take("keys") {
        read.keys = self::keys(&fields, text, keys)?;
    }
    read.axes = list(&mut fields, text, "axis", "[[simulator.axis]]", axis)?;
    read.aux = list(&mut fields, text, "aux", "[[simulator.aux]]", aux)?;
    read.devices = list(&mut fields, text, "device", "[[simulator.device]]", device)?;
    for (place, key, title) in
        [(0, "spindle", "[simulator.spindle]"), (1, "spindle2", "[simulator.spindle2]")]
    {
        let Some(value) = fields.take(key) else { continue };
        let Some(table) = value.get_ref().as_table() else {
            return Err(fields.wrong(value, &format!("{key} is a table")));
        };
        let mut inner = Fields::new(text, title, table, value.span().start);
        let spindle = spindle(&mut inner)?;
        inner.finish()?;
        if let Some(slot) = read.spindles.get_mut(place) {
            *slot = spindle;
        }
    }
    check_letters(&read)?;
    // A PMAC's motors are read in a file of their own.
    let _ = fields.take("motor");
    fields.finish()?;
    Ok(Some(read))
}

/// The entries of a list of tables.
fn list<T>(
    fields: &mut Fields<'_, '_>,
    text: &str,
    key: &'static str,
    title: &str,
    read: fn(&mut Fields<'_, '_>) -> Result<T, String>,
) -> Result<Vec<T>, String> {
    let Some(value) = fields.take(key) else { return Ok(Vec::new()) };
    let wrong = |what: &str| fields.wrong(value, what);
    let entries = value.get_ref().as_array();
    let entries = entries.ok_or_else(|| wrong(&format!("{title} is expected")))?;
    if entries.len() > MOST {
        return Err(wrong(&format!("there are at most {MOST} entries {title}")));
    }
    let entry = |entry: &Spanned<DeValue<'_>>| {
        let Some(table) = entry.get_ref().as_table() else {
            return Err(fields.wrong(entry, &format!("{title} is a table")));
        };
        let mut inner = Fields::new(text, title, table, entry.span().start);
        let read = read(&mut inner)?;
        inner.finish()?;
        Ok(read)
    };
    entries.iter().map(entry).collect()
}

fn keys(
    fields: &Fields<'_, '_>,
    text: &str,
    value: &Spanned<DeValue<'_>>,
) -> Result<Vec<(Text, Text)>, String> {
    let Some(table) = value.get_ref().as_table() else {
        return Err(fields.wrong(value, "keys is a table of names"));
    };
    let mut keys = Vec::new();
    for (name, variable) in table.iter() {
        let line = line(text, name.span().start);
        let name = Located { value: name.get_ref().trim().to_ascii_uppercase(), line };
        if name.value.is_empty()
            || keys.iter().any(|(other, _): &(Text, _)| other.value == name.value)
        {
            return Err(format!("line {line}: a key has a name, and each is there once"));
        }
        keys.push((name, text_of(fields, variable, "a key")?));
    }
    keys.sort_by_key(|(name, _)| name.line);
    Ok(keys)
}

fn axis(fields: &mut Fields<'_, '_>) -> Result<AxisEntry, String> {
    let name = match fields.text("name")? {
        None => None,
        Some(Located { value, line }) => {
            let upper = value.to_ascii_uppercase();
            let mut letters = upper.chars();
            match (letters.next(), letters.next()) {
                (Some(letter @ ('X' | 'Y' | 'Z' | 'U' | 'V' | 'W' | 'A' | 'B' | 'C')), None) => {
                    Some(Located { value: letter, line })
                }
                _ => {
                    let what = "an axis is called X, Y, Z, U, V, W, A, B or C";
                    return Err(format!("line {line}: `{value}`: {what}"));
                }
            }
        }
    };
    let jog = match fields.take("jog") {
        None => None,
        Some(value) => Some(match value.get_ref().as_array() {
            None => [number_of(fields, value, "jog")?; 3],
            Some(list) => {
                let speeds: Vec<Decimal> = list
                    .iter()
                    .map(|speed| number_of(fields, speed, "jog"))
                    .collect::<Result<_, _>>()?;
                let three: Result<[Decimal; 3], _> = speeds.try_into();
                three.map_err(|_| fields.wrong(value, "jog has three speeds: high, medium, low"))?
            }
        })
        .filter(|speeds| speeds.iter().all(|speed| !speed.is_negative() && !speed.is_zero()))
        .map(Some)
        .ok_or_else(|| fields.wrong(value, "jog is above 0"))?,
    };
    let direction = fields.take("ref_direction");
    let reference_positive = match direction.map(|at| (at, at.get_ref())) {
        None => None,
        Some((_, DeValue::Integer(number))) if matches!(number.as_str(), "1" | "+1") => Some(true),
        Some((_, DeValue::Integer(number))) if number.as_str() == "-1" => Some(false),
        Some((at, _)) => return Err(fields.wrong(at, "ref_direction is 1 or -1")),
    };
    Ok(AxisEntry {
        line: fields.line,
        name,
        counts: fields.integer("counts", 1, 1_000_000_000)?,
        start: fields.number("start")?,
        home: fields.number("home")?,
        min: fields.number("min")?,
        max: fields.number("max")?,
        rapid: fields.positive("rapid")?,
        jog,
        reference_speed: fields.positive("ref")?,
        reference_positive,
        reference_by_switch: fields.choice("reference", ["time", "switch"])?,
    })
}

fn aux(fields: &mut Fields<'_, '_>) -> Result<AuxEntry, String> {
    Ok(AuxEntry {
        counts: fields.integer("counts", 1, 1_000_000_000)?,
        max: fields.integer("max", 0, 0x7FFF_FFFF)?,
    })
}

fn spindle(fields: &mut Fields<'_, '_>) -> Result<SpindleEntry, String> {
    Ok(SpindleEntry {
        rpm: fields.integer("rpm", 1, 1_000_000)?,
        min: fields.integer("min", 0, 1_000_000)?,
        ramp: fields.time("ramp_ms")?,
        lag: fields.time("lag_ms")?,
        orient: fields.time("orient_ms")?,
        encoder: fields.flag("encoder")?,
    })
}

fn device(fields: &mut Fields<'_, '_>) -> Result<DeviceEntry, String> {
    let name = fields.needed("name")?;
    let kind = fields.needed("kind")?;
    let mut time = |key, default: u64| -> Result<u64, String> {
        Ok(fields.time(key)?.unwrap_or(default * MILLISECOND))
    };
    let kind = match kind.value.as_str() {
        "relay" => {
            let (on, off) = (time("on_ms", 100)?, time("off_ms", 100)?);
            let (output, input) = (fields.needed("output")?, fields.needed("input")?);
            DeviceKind::Relay { output, input, on, off }
        }
        "cylinder" => {
            let times = (time("extend_ms", 500)?, time("retract_ms", 500)?);
            DeviceKind::Cylinder {
                extend: fields.needed("extend")?,
                retract: fields.text("retract")?,
                extended: fields.text("extended")?,
                retracted: fields.text("retracted")?,
                extend_time: times.0,
                retract_time: times.1,
            }
        }
        "turret" => {
            let station_time = time("station_ms", 400)?;
            turret(fields, station_time)?
        }
        "pump" => {
            let (rise, fall) = (time("rise_ms", 1000)?, time("fall_ms", 1000)?);
            let on = fields.integer("on", 0, 100)?.unwrap_or(80) as u32;
            let off = fields.integer("off", 0, 100)?.unwrap_or(60) as u32;
            let (output, input) = (fields.needed("output")?, fields.needed("input")?);
            if off >= on {
                let line = fields.line;
                return Err(format!("line {line}: a pump's switch opens below where it closes"));
            }
            DeviceKind::Pump { output, input, rise, fall, on, off }
        }
        "switch" => {
            let axis = fields.needed("axis")?;
            let (from, to) = (fields.number("from")?, fields.number("to")?);
            let input = fields.needed("input")?;
            let Some((from, to)) = from.zip(to) else {
                let line = fields.line;
                return Err(format!("line {line}: a switch needs the keys `from` and `to`"));
            };
            DeviceKind::Switch { axis, from, to, input }
        }
        other => {
            let kinds = ["relay", "cylinder", "turret", "pump", "switch"];
            let near = crate::closest(other, kinds);
            let near = near.map_or(String::new(), |near| format!("; did you mean `{near}`?"));
            let known = "relay, cylinder, turret, pump and switch";
            return Err(format!("line {}: `{other}`: devices are {known}{near}", kind.line));
        }
    };
    Ok(DeviceEntry { name, kind })
}

fn turret(fields: &mut Fields<'_, '_>, station_time: u64) -> Result<DeviceKind, String> {
    let stations = fields.integer("stations", 1, 999)?.unwrap_or(8);
    let station = fields.integer("station", 1, stations)?.unwrap_or(1);
    let code = match fields.take("code") {
        None => TurretCode::None,
        Some(value) if value.get_ref().is_array() => {
            TurretCode::Bits(fields.texts("code")?.unwrap_or_default())
        }
        Some(value) => TurretCode::Number(text_of(fields, value, "code")?),
    };
    Ok(DeviceKind::Turret {
        output: fields.needed("output")?,
        reverse: fields.text("reverse")?,
        stations: stations as u32,
        station_time,
        station: station as u32,
        code,
        strobe: fields.text("strobe")?,
    })
}

/// Checks that no letter and no device is there twice.
fn check_letters(table: &SimulatorTable) -> Result<(), String> {
    let mut letters: Vec<char> = Vec::new();
    for Located { value, line } in table.axes.iter().filter_map(|axis| axis.name.as_ref()) {
        if letters.contains(value) {
            return Err(format!(
                "line {line}: there is an axis {value} already; give each letter once"
            ));
        }
        letters.push(*value);
    }
    if let Some(Located { value, line }) = &table.misc {
        for (at, letter) in value.char_indices() {
            let twice = value.chars().take(at).any(|before| before == letter);
            if !matches!(letter, 'A' | 'B' | 'C') || twice || letters.contains(&letter) {
                let what = "misc has letters of A, B and C that are not axes, each once";
                return Err(format!("line {line}: {what}"));
            }
        }
    }
    let mut names: Vec<String> = Vec::new();
    for Located { value, line } in table.devices.iter().map(|device| &device.name) {
        let upper = value.trim().to_ascii_uppercase();
        if upper.is_empty() || upper == "LINE" || names.contains(&upper) {
            let what = "a device has a name of its own, which is not LINE";
            return Err(format!("line {line}: `{value}`: {what}"));
        }
        names.push(upper);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use alloc::string::ToString;

    use super::super::super::Machine;
    use super::super::*;

    #[test]
    fn every_part_of_the_table_is_read() {
        let text = "[simulator]\nunits = \"mm\"\nlag_ms = 12.5\nblocks = [\"M3\", \"G4 P1\"]\n\
                    [simulator.keys]\n\"Door\" = \"LS12\"\n\
                    [[simulator.axis]]\nname = \"x\"\nstart = 0.1\njog = [3, 2, 1]\n\
                    [[simulator.device]]\nname = \"CLAMP\"\nkind = \"cylinder\"\nextend = \"!Y1\"\n\
                    [simulator.spindle]\nrpm = 4000\n";
        let table = Machine::parse(text).unwrap().simulator.unwrap();
        assert_eq!((table.units, table.lag), (Some(Units::Millimetre), Some(12_500_000)));
        assert_eq!(table.blocks.unwrap()[1], Located { value: "G4 P1".into(), line: 4 });
        assert_eq!(table.keys[0].0, Located { value: "DOOR".into(), line: 6 });
        assert_eq!(table.axes[0].start.unwrap().times(1_000_000), Some(100_000));
        assert_eq!(table.spindles[0].rpm, Some(4000));
        let DeviceKind::Cylinder { extend, extend_time, .. } = &table.devices[0].kind else {
            panic!("a cylinder")
        };
        assert_eq!((extend.value.as_str(), extend.line, *extend_time), ("!Y1", 14, 500_000_000));
    }

    #[test]
    fn a_wrong_table_is_refused_with_its_line_and_what_to_do() {
        for (text, part) in [
            (
                "[simulator]\nlagms = 3\n",
                "line 2: `lagms` is not a key of [simulator]; did you mean `lag_ms`?",
            ),
            ("[simulator]\nlag_ms = -1\n", "line 2: lag_ms is a number of milliseconds"),
            ("[simulator]\nlag_ms = inf\n", "line 2: lag_ms"),
            ("[simulator]\nunits = \"cm\"\n", "line 2: units is \"inch\" or \"mm\""),
            ("simulator = 3\n", "line 1: simulator is a table"),
            ("[[simulator.axis]]\nname = \"Q\"\n", "line 2: `Q`: an axis is called"),
            (
                "[[simulator.axis]]\nname = \"X\"\n[[simulator.axis]]\nname = \"x\"\n",
                "line 4: there is an axis X",
            ),
            ("[[simulator.device]]\nname = \"A\"\nkind = \"relais\"\n", "did you mean `relay`?"),
            (
                "[[simulator.device]]\nname = \"A\"\nkind = \"relay\"\noutput = \"Y1\"\n",
                "needs the key `input`",
            ),
            ("[simulator]\nmisc = \"AD\"\n", "line 2: misc has letters"),
            ("[simulator.spindle]\nrpm = 0\n", "line 2: rpm is a whole number from 1"),
        ] {
            let error = Machine::parse(text).unwrap_err().to_string();
            assert!(error.contains(part), "{error}");
        }
    }
}
