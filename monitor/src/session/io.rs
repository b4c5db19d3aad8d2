//! Inputs and outputs with overrides (PMI 5.3), for all three languages.

use std::collections::BTreeMap;

use plcc_abi::nct::{NctName, NctTables};
use plcc_abi::pmac::PmacTables;
use plcc_abi::pmi::{Format, Lines, PmiTables};
use plcc_abi::{Tables, natural_cmp};
use plcc_runtime::value::number;

use super::Session;
use crate::view::{IoRow, IoView, IoWindow, NamedValue};
use crate::{Refusal, Reply};

/// The warning that PMI 5.3 shows before the first override.
const WARNING: &str = "Overriding inputs and outputs can be dangerous for people and for the machine. \
Normally the program checks for dangerous conditions (limit switches, doors, interlocks). These checks \
are completely bypassed by an override. An override stays when the monitor ends, until it is cleared or \
the control is started anew.";

/// An input or output.
#[derive(Clone, Debug)]
struct Point {
    name: String,
    place: String,
    output: bool,
    bit: bool,
    /// The names of its lines, the lowest first.
    lines: Vec<String>,
}

/// What is known of inputs and outputs.
#[derive(Debug, Default)]
pub(super) struct IoState {
    points: Option<Vec<Point>>,
    confirmed: bool,
    /// Forces in a program that is run here.
    forces: BTreeMap<String, String>,
    last: BTreeMap<String, f64>,
}

impl IoState {
    /// Has the inputs and outputs be looked up again, since another version of the program is shown.
    pub(super) fn forget_points(&mut self) {
        self.points = None;
    }
}

impl Session<'_> {
    /// The forces in effect.
    pub(super) fn forces(&self) -> Vec<NamedValue> {
        if let Some(status) = self.link.as_ref().and_then(|link| link.status()) {
            return status.forces.clone();
        }
        let own = self.io.forces.iter();
        own.map(|(name, value)| NamedValue {
            name: name.clone(),
            value: value.clone(),
            written: true,
        })
        .collect()
    }

    /// Whether the control (or the program that is run here) allows something.
    pub(super) fn allows(&self, what: &str) -> bool {
        match &self.link {
            Some(link) => {
                link.status().is_some_and(|status| status.allow.iter().any(|word| word == what))
            }
            None => self.debugger.as_ref().is_some_and(|debugger| debugger.may_change()),
        }
    }

    fn points(&mut self) -> Result<Vec<Point>, Refusal> {
        if let Some(points) = &self.io.points {
            return Ok(points.clone());
        }
        let (names, image): (Vec<String>, Vec<u8>) = match &mut self.debugger {
            Some(debugger) => {
                let executive = debugger.history_mut().executive();
                let names = executive.declared().into_iter().map(|(name, _)| name).collect();
                (names, executive.image().to_vec())
            }
            None => (vec![], vec![]),
        };
        let points = match self.tables() {
            Some(Tables::Pmi(tables)) => pmi_points(tables),
            Some(Tables::Nct(tables)) => nct_points(tables),
            Some(Tables::Pmac(tables)) => pmac_points(tables, &names, &image),
            None => {
                return Err(Refusal::new(
                    "without the program its inputs and outputs are not known; name its source \
                     after the socket",
                ));
            }
        };
        self.io.points = Some(points.clone());
        Ok(points)
    }

    pub(super) fn io_view(&mut self) -> Result<IoView, Refusal> {
        let points = self.points()?;
        let mut names: Vec<String> = vec![];
        for point in &points {
            names.push(point.name.clone());
            names.extend(point.lines.iter().cloned());
        }
        let moment = self.read(&names)?;
        let forces = self.forces();
        let row = |point: &Point| {
            let value = moment.values.get(&point.name).copied();
            let last = self.io.last.get(&point.name).copied();
            let lines: Option<Vec<bool>> =
                point.lines.iter().map(|line| Some(moment.values.get(line)? != &0.0)).collect();
            let physical = lines.filter(|lines| !lines.is_empty()).map(|lines| {
                let digits = lines.iter().rev().map(|&on| if on { '1' } else { '0' });
                digits.collect::<String>()
            });
            IoRow {
                name: point.name.clone(),
                place: point.place.clone(),
                logical: value.map_or_else(|| "?".into(), number),
                physical,
                forced: forces
                    .iter()
                    .find(|force| force.name == point.name)
                    .map(|force| force.value.clone()),
                bit: point.bit,
                changed: last.is_some() && last != value,
            }
        };
        let window = |title: &str, outputs: bool| IoWindow {
            title: title.into(),
            outputs,
            rows: points.iter().filter(|point| point.output == outputs).map(row).collect(),
        };
        let windows = vec![window("Outputs", true), window("Inputs", false)];
        self.io.last = moment.values;
        let warning = (!self.io.confirmed).then(|| WARNING.to_owned());
        Ok(IoView { windows, warning })
    }

    pub(super) fn confirm_warning(&mut self) -> Result<Reply, Refusal> {
        self.io.confirmed = true;
        Ok(Reply::default())
    }

    pub(super) fn force(&mut self, name: &str, value: &str) -> Result<Reply, Refusal> {
        if !self.allows("force") {
            let Some(link) = &mut self.link else {
                return Err(Refusal::new("nothing can be forced in a recording"));
            };
            // A control that does not answer may allow it.
            link.ask_status()?;
            if !self.allows("force") {
                return Err(Refusal::new("the control was started without --allow force"));
            }
        }
        if !self.io.confirmed {
            return Err(Refusal {
                message: "the warning must be confirmed first".into(),
                warning: Some(WARNING.into()),
            });
        }
        let name = self.defined_name(name).unwrap_or_else(|| name.trim().to_owned());
        let tick = self.act(&name, Some(value), true)?;
        if self.link.is_none() {
            self.io.forces.insert(name.clone(), value.to_owned());
        }
        Ok(Reply::message(format!("{name} is forced to {value} from tick {tick} on")))
    }

    pub(super) fn release(&mut self, name: &str) -> Result<Reply, Refusal> {
        let name = self.defined_name(name).unwrap_or_else(|| name.trim().to_owned());
        if self.link.is_none() && !self.io.forces.contains_key(&name) {
            return Err(Refusal::new(format!("{name} is not forced")));
        }
        let tick = self.act(&name, None, true)?;
        self.io.forces.remove(&name);
        Ok(Reply::message(format!("{name} is not forced from tick {tick} on")))
    }

    pub(super) fn release_all(&mut self) -> Result<Reply, Refusal> {
        if let Some(link) = &mut self.link {
            link.release(None)?;
            return Ok(Reply::message("nothing is forced any more"));
        }
        let names: Vec<String> = self.io.forces.keys().cloned().collect();
        for name in names {
            self.act(&name, None, true)?;
            self.io.forces.remove(&name);
        }
        Ok(Reply::message("nothing is forced any more"))
    }
}

fn pmi_points(tables: &PmiTables) -> Vec<Point> {
    let point = |name: &str, lines: Lines, output: bool| {
        let Lines { port, low, count, format } = lines;
        let bits = low..low.saturating_add(count);
        let place = match count {
            1 => format!("{port}/{low}"),
            _ => format!("{port}/{low}-{}", bits.end.saturating_sub(1)),
        };
        Point {
            name: name.into(),
            place,
            output,
            bit: format == Format::Bit,
            lines: bits.map(|bit| format!("PORT{port}.{bit}")).collect(),
        }
    };
    let symbols = tables.symbols.iter();
    symbols
        .filter_map(|symbol| match (symbol.role.input(), symbol.role.output()) {
            (Some(lines), _) => Some(point(&symbol.name, lines, false)),
            (_, Some(lines)) => Some(point(&symbol.name, lines, true)),
            _ => None,
        })
        .collect()
}

fn nct_points(tables: &NctTables) -> Vec<Point> {
    /// The first byte that belongs to no physical board.
    const BOARDS: u8 = 40;
    let mut named: Vec<NctName> = tables.named.clone();
    named.sort_by(|a, b| natural_cmp(&a.to_string(), &b.to_string()));
    named.dedup();
    let point = |name: NctName| {
        let (byte, bit, output) = match name {
            NctName::I { byte, bit: Some(bit) } => (byte, bit, false),
            NctName::Y { byte, bit: Some(bit) } => (byte, bit, true),
            _ => return None,
        };
        let line = match output {
            true => NctName::O { byte, bit: Some(bit) },
            false => NctName::P { byte, bit: Some(bit) },
        };
        let is_physical = byte < BOARDS;
        Some(Point {
            name: name.to_string(),
            place: match is_physical {
                true => board_place(byte, bit, output),
                false => "NC".into(),
            },
            output,
            bit: true,
            lines: if is_physical { vec![line.to_string()] } else { vec![] },
        })
    };
    named.into_iter().filter_map(point).collect()
}

/// The connection points of the lines of an interface board: bit by bit those of inputs 0 to 3 on connector I1; those
/// of inputs 4 to 6 on I2 are the same again (NCT 2.1.1).
const INPUT_PINS: [[u8; 8]; 4] = [
    [35, 32, 14, 13, 37, 36, 18, 17],
    [29, 28, 10, 9, 31, 30, 12, 11],
    [25, 24, 6, 5, 27, 26, 8, 7],
    [21, 20, 2, 1, 23, 22, 4, 3],
];
/// Those of outputs 0 to 3 on connector O1 (NCT 2.1.2).
const OUTPUT_PINS: [[u8; 8]; 4] = [
    [14, 12, 31, 29, 30, 13, 16, 15],
    [6, 4, 21, 23, 7, 5, 24, 22],
    [10, 8, 25, 27, 26, 9, 28, 11],
    [20, 34, 32, 1, 2, 35, 3, 33],
];

/// Where a line of an NCT's interface board is: `board 1 O1-14`, its connector and connection point. Lines beyond the
/// tables have byte and bit.
fn board_place(byte: u8, bit: u8, is_output: bool) -> String {
    let (board, own) = (byte / 10 + 1, usize::from(byte % 10));
    let (connector, pins) = match (is_output, own) {
        (true, 0..=3) => ("O1", OUTPUT_PINS.get(own)),
        (false, 0..=3) => ("I1", INPUT_PINS.get(own)),
        (false, 4..=6) => ("I2", INPUT_PINS.get(own - 4)),
        _ => ("", None),
    };
    match pins.and_then(|pins| pins.get(usize::from(bit))) {
        Some(pin) => format!("board {board} {connector}-{pin}"),
        None => format!("board {board} byte {own} bit {bit}"),
    }
}

fn pmac_points(tables: &PmacTables, names: &[String], image: &[u8]) -> Vec<Point> {
    use plcc_abi::pmac::{Controller, Definition, Layout, PmacName};
    /// Where the words of inputs and outputs begin.
    const FIRST_PORT: u32 = 0xC000;
    let layout = Layout::new(tables.controller);
    let definition = |name: &str| -> Option<Definition> {
        let PmacName::Variable(variable) = PmacName::parse(name, &layout).ok()? else {
            return None;
        };
        let is_m = variable.kind == plcc_abi::pmac::Kind::M;
        is_m.then(|| super::online::definition(image, tables.controller, variable.number))
    };
    let first = if tables.controller == Controller::Pmac { FIRST_PORT } else { 0x78000 };
    let mut points = vec![];
    for name in names {
        let Some(definition) = definition(name) else { continue };
        let bits = match definition {
            Definition::X { address, field } | Definition::Y { address, field }
                if address >= first =>
            {
                field.width
            }
            _ => continue,
        };
        let is_output = |output: &plcc_abi::pmac::Output| output.definition == definition;
        points.push(Point {
            name: name.clone(),
            bit: bits == 1,
            place: super::online::definition_text(definition),
            output: tables.outputs.iter().any(is_output),
            lines: vec![],
        });
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_interface_boards_have_connection_points() {
        for (byte, bit, is_output, place) in [
            (0, 0, false, "board 1 I1-35"),
            (12, 3, false, "board 2 I1-5"),
            (34, 7, false, "board 4 I2-17"),
            (6, 0, false, "board 1 I2-25"),
            (0, 0, true, "board 1 O1-14"),
            (23, 7, true, "board 3 O1-33"),
            (7, 1, false, "board 1 byte 7 bit 1"),
            (4, 1, true, "board 1 byte 4 bit 1"),
        ] {
            assert_eq!(board_place(byte, bit, is_output), place);
        }
    }
}
