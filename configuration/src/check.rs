//! Compares entries with the variables of a program.

use std::collections::{HashMap, HashSet};

use plcc_abi::closest;
use plcc_image::latch::Safe;
use plcc_image::{Direction, Place, Symbol};

use crate::range::names;
use crate::{Entry, Mistake, Point, Warning, drivers, outside_range};

/// How many points a configuration may have.
const MAX_POINTS: usize = 1 << 16;
/// After how many mistakes no more are looked for.
const MAX_MISTAKES: usize = 1000;
/// For how many unknown names the nearest one is looked for.
const MAX_HINTS: usize = 20;

/// What a check has found.
#[derive(Clone, Debug, Default)]
pub struct Checked {
    /// The points of all entries without mistakes.
    pub points: Vec<Point>,
    /// What is wrong.
    pub mistakes: Vec<Mistake>,
    /// What may be wrong.
    pub warnings: Vec<Warning>,
}

/// Resolves the entries for a program with these symbols. `ends_in_bit` says that the last digit of a number in a
/// name is a bit from 0 to 7, as in NCT. `outputs` are the outputs that the program uses; it is a warning if
/// none of the entries takes one of them.
pub fn points(
    entries: &[Entry],
    symbols: &[Symbol],
    ends_in_bit: bool,
    outputs: &[String],
) -> Checked {
    let by_name: HashMap<&str, &Symbol> =
        symbols.iter().map(|symbol| (symbol.name.as_str(), symbol)).collect();
    // The program's own names count more; small letters and capitals are one.
    let mut by_alias: HashMap<String, &Symbol> = HashMap::new();
    for symbol in symbols {
        for alias in &symbol.aliases {
            by_alias.entry(alias.to_ascii_uppercase()).or_insert(symbol);
        }
    }
    let mut checked = Checked::default();
    // The lines of entries that give a variable, and that take a value for a point outside.
    let mut given: HashMap<Place, usize> = HashMap::new();
    let mut driven: HashMap<String, usize> = HashMap::new();
    let mut hints = 0;
    for entry in entries {
        let message = if checked.mistakes.len() >= MAX_MISTAKES {
            "further mistakes are not shown".into()
        } else if checked.points.len() > MAX_POINTS {
            format!("there are more than {MAX_POINTS} points")
        } else {
            String::new()
        };
        if !message.is_empty() {
            checked.mistakes.push(Mistake { line: entry.line, message });
            break;
        }
        let mut wrong =
            |message: String| checked.mistakes.push(Mistake { line: entry.line, message });
        let first = entry.name.split("..").next().unwrap_or("").trim().to_ascii_uppercase();
        let names = match names(&entry.name, ends_in_bit && !by_alias.contains_key(&first)) {
            Ok(names) => names,
            Err(message) => {
                wrong(message);
                continue;
            }
        };
        let first = match entry.driver.address(&entry.address) {
            Ok(address) => address,
            Err(message) => {
                wrong(message);
                continue;
            }
        };
        for (index, name) in names.iter().enumerate() {
            let upper = name.to_ascii_uppercase();
            let symbol = by_name.get(name.as_str()).or_else(|| by_name.get(upper.as_str()));
            let symbol = symbol.or_else(|| by_alias.get(&upper));
            let Some(&symbol) = symbol else {
                hints += 1;
                let near = (hints <= MAX_HINTS)
                    .then(|| {
                        let names = symbols.iter().map(|symbol| symbol.name.as_str());
                        let aliases = symbols.iter().flat_map(|symbol| &symbol.aliases);
                        closest(&upper, names.chain(aliases.map(String::as_str)))
                    })
                    .flatten();
                let hint = near.map(|near| format!("; did you mean `{near}`?")).unwrap_or_default();
                wrong(format!("the program has no variable named `{name}`{hint}"));
                continue;
            };
            let address = match &first {
                Some(first) => match first.nth(index) {
                    Some(address) => Some(address),
                    None => {
                        wrong(first.is_too_long(&entry.name, name));
                        break;
                    }
                },
                None => None,
            };
            let is_input = entry.is_input.unwrap_or(symbol.direction == Direction::Input);
            let point = Point { entry: entry.clone(), symbol: symbol.clone(), address, is_input };
            if let Some(message) = unfit(&point) {
                wrong(format!("`{name}` {message}"));
                continue;
            }
            if is_input {
                if let Some(line) = given.insert(symbol.outside(), entry.line) {
                    wrong(format!("`{name}` is given by the entry of line {line} already"));
                }
            } else if let Some(address) = &point.address {
                let line = *driven.entry(address.place()).or_insert(entry.line);
                if line != entry.line {
                    wrong(format!(
                        "the point of `{name}` is driven by the entry of line {line} already"
                    ));
                }
            }
            checked.points.push(point);
        }
    }
    for driver in drivers::all() {
        checked.mistakes.extend(driver.mistakes(&checked.points));
    }
    checked.warnings = outside_range::warnings(&checked.points);
    let taken: HashSet<Place> =
        checked.points.iter().filter(|point| !point.is_input).map(|p| p.symbol.outside()).collect();
    let is_taken = |name: &String| {
        by_name.get(name.as_str()).is_none_or(|symbol| taken.contains(&symbol.outside()))
    };
    if !entries.is_empty() {
        let free: Vec<&str> =
            outputs.iter().filter(|name| !is_taken(name)).map(String::as_str).collect();
        if let Some((last, others)) = free.split_last() {
            let message = match others {
                [] => format!("output {last} is not wired: no entry [[io]] names it"),
                _ => {
                    let others = others.join(", ");
                    format!("outputs {others} and {last} are not wired: no entry [[io]] names them")
                }
            };
            checked.warnings.push(Warning { line: None, message });
        }
    }
    checked
}

/// Why a point can't be, if it can't; the reason follows the variable's name.
fn unfit(Point { entry, symbol, address, is_input }: &Point) -> Option<String> {
    let place = symbol.outside();
    if symbol.elements != 1 {
        return Some("is an array, which can't be wired".into());
    }
    if *is_input && symbol.slot.is_none() {
        let what = symbol.direction.name();
        return Some(format!("is {what}, and can't be given from outside"));
    }
    if let Some(message) = address.as_ref().and_then(|at| at.unfit(*is_input, place.is_bit())) {
        return Some(message);
    }
    let is_scaled = entry.scale != 1.0 || entry.offset != 0.0;
    if place.is_bit() && is_scaled {
        return Some("is a bit, which has neither `scale` nor `offset`".into());
    }
    if !place.is_bit() && entry.invert {
        return Some("is a number, which can't be inverted".into());
    }
    match entry.safe {
        Safe::Value(value) if !symbol.takes(value) => Some(format!("can't be {value}, its `safe`")),
        _ => None,
    }
}

#[cfg(test)]
mod tests;
