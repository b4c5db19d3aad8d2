//! What the machine file says of an NCT control.
//!
//! ```toml
//! control = "nct104"        # how often :002 runs
//! boards = 2                # interface boards
//! [parameters]              # NC parameters by number; these two by name, too
//! MAGAZINE = 24
//! PLC_TAB = 10
//! [constants]               # PLC constants, RP001 to RP040
//! 39 = 24
//! [macros]                  # macro variables
//! 180 = 12.5
//! [tool_pots]               # first content of the pot table; pot 0 is the spindle
//! 0 = { tool = 7 }
//! 3 = { tool = 5, width = 3 }
//! ```

use alloc::{format, string::String, vec, vec::Vec};

use serde::Deserialize;
use toml::{Table, Value};

use crate::nct::{NctControl, NctSettings, ToolPot};

/// The largest number that a parameter or a macro variable can have.
const MAX_NUMBER: u16 = 9999;
/// The largest number of a tool pot: the table of pots, two bytes each, ends at F999 at the latest.
const MAX_POT: u16 = 249;
/// The largest tool number: in a pot's word 14 bits are the tool, the other two a code of its width.
const MAX_TOOL: u16 = 0x3FFF;

/// The keys, as they are in the file.
#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct NctFile {
    control: Option<String>,
    boards: Option<i64>,
    parameters: Table,
    constants: Table,
    macros: Table,
    tool_pots: Option<Value>,
}

impl NctFile {
    /// The keys' names.
    pub(super) const KEYS: [&str; 6] =
        ["control", "boards", "parameters", "constants", "macros", "tool_pots"];

    /// Checks all values.
    pub(super) fn settings(self) -> Result<NctSettings, String> {
        let Self { control, boards, parameters, constants, macros, tool_pots } = self;
        let control = match control {
            None => NctControl::default(),
            Some(name) => NctControl::from_name(&name).ok_or_else(|| {
                let known: Vec<_> = NctControl::ALL.iter().map(|c| c.name()).collect();
                format!("`{name}` is not a control type; there are {}", known.join(", "))
            })?,
        };
        let boards = match boards {
            None => None,
            Some(count @ 0..=4) => Some(count as u8),
            Some(count) => return Err(format!("boards = {count}: there are 0 to 4")),
        };
        let mut settings = NctSettings { control, boards, ..NctSettings::default() };
        for (name, value) in parameters {
            let number = match name.as_str() {
                "MAGAZINE" => 61,
                "PLC_TAB" => 62,
                digits => number("parameter", digits, "", 0, MAX_NUMBER)?,
            };
            settings.parameters.push((number, integer("parameter", &name, &value)?));
        }
        for (name, value) in constants {
            let number = number("constant", &name, "RP", 1, 40)?;
            let value = integer("constant", &name, &value)?;
            if !(-0x8000..=0xFFFF).contains(&value) {
                return Err(format!("constant {name}: {value} does not fit 16 bits"));
            }
            settings.constants.push((number, value as u16));
        }
        for (name, value) in macros {
            let number = number("macro variable", &name, "#", 1, MAX_NUMBER)?;
            let value = value.as_float().or_else(|| value.as_integer().map(|v| v as f64));
            let value = value.filter(|v| v.is_finite());
            let value = value.ok_or_else(|| format!("macro variable {name}: not a number"))?;
            settings.macros.push((number, value));
        }
        settings.tool_pots = tool_pots.map_or(Ok(vec![]), |value| pots(&value))?;
        Ok(settings)
    }
}

fn number(what: &str, name: &str, prefix: &str, low: u16, high: u16) -> Result<u16, String> {
    let digits = name.strip_prefix(prefix).unwrap_or(name);
    let number = digits.parse().ok().filter(|number| (low..=high).contains(number));
    number
        .ok_or_else(|| format!("`{name}` is not the number of a {what}: they are {low} to {high}"))
}

fn integer(what: &str, name: &str, value: &Value) -> Result<i64, String> {
    value.as_integer().ok_or_else(|| format!("{what} {name}: not an integer"))
}

/// The pots. They are in the file as a table by pot number, as a list of tables each with a key
/// `pot`, or as a list of lists `[pot, tool, width]`.
fn pots(value: &Value) -> Result<Vec<ToolPot>, String> {
    match value {
        Value::Array(rows) => rows.iter().map(|row| pot(None, row)).collect(),
        Value::Table(table) => {
            let mut pots = Vec::with_capacity(table.len());
            for (name, row) in table {
                pots.push(pot(Some(number("pot", name, "", 0, MAX_POT)?), row)?);
            }
            pots.sort_by_key(|pot| pot.pot);
            Ok(pots)
        }
        _ => Err("tool_pots: lines `pot = { tool = number, width = 1 }` are expected".into()),
    }
}

fn pot(number: Option<u16>, row: &Value) -> Result<ToolPot, String> {
    let shown = number.map_or_else(|| "tool_pots".into(), |number| format!("pot {number}"));
    let wrong = |what: &str| format!("{shown}: {what}");
    let small = |value: &Value, what: &str, high: u16| {
        let value = value.as_integer().and_then(|v| u16::try_from(v).ok());
        value.filter(|&v| v <= high).ok_or_else(|| wrong(&format!("{what} is 0 to {high}")))
    };
    let (pot, tool, width) = match row {
        Value::Integer(_) => (None, Some(row), None),
        Value::Array(cells) => match (number, cells.as_slice()) {
            (Some(_), [tool, rest @ ..]) => (None, Some(tool), rest.first()),
            (None, [pot, tool, rest @ ..]) => (Some(pot), Some(tool), rest.first()),
            _ => return Err(wrong("pot, tool and width are expected")),
        },
        Value::Table(table) => {
            if let Some(key) =
                table.keys().find(|k| !["pot", "tool", "width"].contains(&k.as_str()))
            {
                return Err(wrong(&format!("`{key}` is not known: pot, tool and width are")));
            }
            (table.get("pot"), table.get("tool"), table.get("width"))
        }
        _ => return Err(wrong("`{ tool = number, width = 1 }` is expected")),
    };
    let number = match (number, pot) {
        (Some(number), None) => number,
        (None, Some(pot)) => small(pot, "a pot", MAX_POT)?,
        (Some(_), Some(_)) => return Err(wrong("has its number twice")),
        (None, None) => return Err(wrong("a pot's number is missing")),
    };
    let tool = tool.map_or(Ok(0), |tool| small(tool, "a tool's number", MAX_TOOL))?;
    let width = width.map_or(Ok(1), |width| small(width, "a width", 7))?;
    if !matches!(width, 1 | 3 | 5 | 7) {
        return Err(wrong("a width is 1, 3, 5 or 7"));
    }
    Ok(ToolPot { pot: number, tool, width: width as u8 })
}

#[cfg(test)]
mod tests {
    use alloc::string::ToString;

    use super::super::Machine;
    use super::*;

    #[test]
    fn every_key_of_a_machine_file_is_read() {
        let text = "control = \"NCT98\"\nboards = 2\n[parameters]\nMAGAZINE = 24\n1204 = 1\n\
                    [constants]\n39 = 24\nRP001 = -1\n[macros]\n180 = 1.5\n\"#2000\" = 7\n\
                    [tool_pots]\n3 = { tool = 5, width = 3 }\n0 = 7\n1 = [2, 5]\n";
        let settings = Machine::parse(text).unwrap().nct;
        assert_eq!((settings.control, settings.boards), (NctControl::Nct98, Some(2)));
        assert_eq!(settings.parameters, [(1204, 1), (61, 24)]);
        assert_eq!(settings.constants, [(39, 24), (1, 0xFFFF)]);
        assert_eq!(settings.macros, [(2000, 7.0), (180, 1.5)]);
        let pot = |pot, tool, width| ToolPot { pot, tool, width };
        assert_eq!(settings.tool_pots, [pot(0, 7, 1), pot(1, 2, 5), pot(3, 5, 3)]);
    }

    #[test]
    fn pots_may_be_written_as_a_list() {
        let text = "[[tool_pots]]\npot = 4\ntool = 9\nwidth = 7\n[[tool_pots]]\npot = 5\n";
        let settings = Machine::parse(text).unwrap().nct;
        let words: Vec<_> = settings.tool_pots.iter().map(|p| (p.pot, p.word())).collect();
        assert_eq!(words, [(4, 0xC009), (5, 0)]);
    }

    #[test]
    fn a_wrong_value_is_refused_with_the_reason() {
        for (text, part) in [
            ("control = \"nct1\"\n", "nct104"),
            ("boards = 5\n", "0 to 4"),
            ("[parameters]\nX = 1\n", "not the number of a parameter"),
            ("[parameters]\n61 = \"a\"\n", "not an integer"),
            ("[constants]\n41 = 1\n", "1 to 40"),
            ("[constants]\n1 = 65536\n", "16 bits"),
            ("[macros]\n1 = true\n", "not a number"),
            ("[tool_pots]\n250 = 1\n", "0 to 249"),
            ("[tool_pots]\n1 = { tool = 1, width = 2 }\n", "1, 3, 5 or 7"),
            ("[tool_pots]\n1 = { tol = 1 }\n", "`tol` is not known"),
            ("[[tool_pots]]\ntool = 1\n", "missing"),
            ("tool_pots = 1\n", "expected"),
        ] {
            let error = Machine::parse(text).unwrap_err().to_string();
            assert!(error.contains(part), "{text}: {error}");
        }
    }
}
