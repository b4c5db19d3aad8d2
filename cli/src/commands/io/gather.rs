//! The wires of a program, and what its control gives and takes.

use std::collections::{BTreeMap, BTreeSet};

use plcc_abi::place::Direction;
use plcc_abi::{GivenName, natural_cmp};
use plcc_frontend::CheckedProgram;
use plcc_frontend::presentation::{Exchange, Uses};
use plcc_runtime::{Names, Purpose, VariableKey};

/// An input or output with its lines.
#[derive(Clone, Debug)]
pub(super) struct Wire {
    pub(super) name: String,
    pub(super) is_input: bool,
    /// Its lines by their own names, the lowest first.
    pub(super) lines: Vec<String>,
    /// Where they were: port and bits, board, connector and pin, address.
    pub(super) place: String,
    /// What people call it and say of it.
    pub(super) said: GivenName,
    /// What it means to the control, where that is known.
    pub(super) meaning: Option<String>,
}

/// A variable that the control gives the program, or takes from it.
#[derive(Clone, Debug)]
pub(super) struct Exchanged {
    pub(super) name: String,
    pub(super) exchange: Exchange,
    pub(super) said: GivenName,
    pub(super) meaning: Option<String>,
}

impl Wire {
    /// What it is, in one line.
    pub(super) fn description(&self) -> String {
        let said = self.said.summary();
        if said.is_empty() { self.meaning.clone().unwrap_or_default() } else { said }
    }
}

impl Exchanged {
    /// What it means to the control, and what people say of it, in one line.
    pub(super) fn description(&self) -> String {
        let said = Some(self.said.line()).filter(|said| !said.is_empty());
        let parts = [self.meaning.clone(), said];
        parts.into_iter().flatten().collect::<Vec<_>>().join("; ")
    }
}

/// All of a program.
#[derive(Clone, Debug, Default)]
pub(super) struct Gathered {
    /// In the order of ports and bits.
    pub(super) wires: Vec<Wire>,
    /// In natural order.
    pub(super) exchanged: Vec<Exchanged>,
    /// Inputs that the program assigns, with the places.
    pub(super) assigned_inputs: Vec<(String, String)>,
}

/// How the program uses a variable, in all of its files.
#[derive(Default)]
struct Use {
    uses: Uses,
    meaning: Option<String>,
    written_at: Option<String>,
}

/// Gathers them. `names` are those of the program.
pub(super) fn gather(checked: &dyn CheckedProgram, names: &dyn Names) -> Gathered {
    let mut found: BTreeMap<String, Use> = BTreeMap::new();
    for row in checked.cross_reference().rows {
        let entry = found.entry(checked.stands_for(&row.name)).or_default();
        entry.uses.read |= !(row.read.is_empty() && row.tested.is_empty());
        entry.uses.written |= !row.written.is_empty();
        entry.meaning = entry.meaning.take().or(row.meaning);
        let line = row.written.first().map(|line| format!("{}:{line}", row.file));
        entry.written_at = entry.written_at.take().or(line);
    }
    // What is declared is wired although no statement names it.
    let declared = names.declared();
    for (name, _) in &declared {
        found.entry(name.clone()).or_default();
    }
    let declared: Vec<String> = declared.into_iter().map(|(name, _)| name).collect();
    let points = checked.io_points(&declared, &[]);
    let said =
        |name: &str| names.given().said_of(name).map(|said| said.into_owned()).unwrap_or_default();
    let mut gathered = Gathered::default();
    let mut wired: Vec<((u32, u8), Wire)> = vec![];
    let mut seen: BTreeSet<String> = BTreeSet::new();
    for (name, Use { uses, meaning, written_at }) in found {
        let Ok(key) = names.find(&name, Purpose::Watch) else { continue };
        let lines = names.lines(key);
        let direction = names.properties(key).direction;
        if lines.is_empty() || direction == Direction::Internal {
            let in_word = lines.is_empty() && meaning.is_some();
            let declared = match direction {
                Direction::Input => Some(Exchange::Machine),
                Direction::Output => Some(Exchange::Program),
                Direction::Internal => None,
            };
            let is_used = uses.read || uses.written;
            let exchange = checked.exchange(&name, Uses { declared, in_word, ..uses });
            if let Some(exchange) = exchange.filter(|_| is_used) {
                gathered.exchanged.push(Exchanged { said: said(&name), name, exchange, meaning });
            }
            continue;
        }
        let is_input = direction == Direction::Input;
        if is_input && let Some(at) = written_at {
            gathered.assigned_inputs.push((name.clone(), at));
        }
        // A word of two bytes is the wires of both.
        let bits = checked.bit_names(&name);
        let meaning = meaning.filter(|_| bits.is_empty());
        let parts: Vec<(String, VariableKey)> = match bits.is_empty() {
            true => vec![(name, key)],
            false => bits
                .into_iter()
                .filter_map(|bit| Some((bit.clone(), names.find(&bit, Purpose::Watch).ok()?)))
                .collect(),
        };
        for (name, key) in parts {
            let lines = names.lines(key);
            let Some(first) = lines.first().and_then(|line| names.properties(*line).value) else {
                continue;
            };
            if !seen.insert(name.clone()) {
                continue;
            }
            let lines: Vec<String> = lines.iter().map(|line| names.canonical(*line)).collect();
            let point = points.iter().find(|point| point.name == name);
            let place = checked.place_of_lines(&lines, point.map(|point| point.place.as_str()));
            let (said, meaning) = (said(&name), meaning.clone());
            let order = (first.offset + u32::from(first.bit / 8), first.bit % 8);
            wired.push((order, Wire { name, is_input, lines, place, said, meaning }));
        }
    }
    wired.sort_by(|(a, one), (b, other)| a.cmp(b).then(natural_cmp(&one.name, &other.name)));
    gathered.wires = wired.into_iter().map(|(_, wire)| wire).collect();
    gathered.exchanged.sort_by(|a, b| natural_cmp(&a.name, &b.name));
    gathered
}
