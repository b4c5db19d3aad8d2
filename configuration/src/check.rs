//! Compares entries with the variables of a program.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use plcc_abi::closest;
use plcc_image::latch::Safe;
use plcc_image::{Direction, Number, Place, Symbol, Type};

use crate::addresses::Addresses;
use crate::range::names;
use crate::{Address, Entry, Mistake, Point, Warning, drivers, outside_range};

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
    let by_line = by_line(symbols);
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
        let addresses = match Addresses::read(entry.driver, &entry.address) {
            Ok(addresses) => addresses,
            Err(message) => {
                wrong(message);
                continue;
            }
        };
        // How many of the addresses are taken.
        let mut next = 0;
        let mut is_clean = true;
        'names: for name in &names {
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
                (next, is_clean) = (next + 1, false);
                continue;
            };
            let is_input = entry.is_input.unwrap_or(symbol.direction == Direction::Input);
            let parts = match lines(entry, symbol, addresses.get(next), &addresses, &by_line) {
                Ok(parts) => parts,
                Err(message) => {
                    wrong(format!("`{name}` {message}"));
                    (next, is_clean) = (next + 1, false);
                    continue;
                }
            };
            let count = parts.len();
            for (index, (entry, symbol)) in parts.into_iter().enumerate() {
                let address = addresses.get(next + index);
                if address.is_none() && !matches!(addresses, Addresses::None) {
                    wrong(addresses.is_too_short(&entry.name, &symbol.name));
                    is_clean = false;
                    break 'names;
                }
                let point = Point { entry, symbol: symbol.clone(), address, is_input };
                if let Some(message) = unfit(&point) {
                    let shown = if count == 1 { name } else { &symbol.name };
                    wrong(format!("`{shown}` {message}{}", lines_wanted(&point, &addresses)));
                    continue;
                }
                let shown = if count == 1 { name } else { &symbol.name };
                if is_input {
                    let bits = bits_of(symbol.outside());
                    let line = bits
                        .into_iter()
                        .fold(None, |found, bit| found.or(given.insert(bit, point.entry.line)));
                    if let Some(line) = line {
                        wrong(format!("`{shown}` is given by the entry of line {line} already"));
                    }
                } else if let Some(address) = &point.address {
                    let line = *driven.entry(address.place()).or_insert(point.entry.line);
                    if line != point.entry.line {
                        wrong(format!(
                            "the point of `{shown}` is driven by the entry of line {line} already"
                        ));
                    }
                }
                checked.points.push(point);
            }
            next += count;
        }
        if let Some(count) = addresses.count().filter(|&count| is_clean && count > next) {
            wrong(format!(
                "`address` has {count} points, but `{}` has {next} lines: one bit goes to each",
                entry.name
            ));
        }
    }
    for driver in drivers::all() {
        checked.mistakes.extend(driver.mistakes(&checked.points));
    }
    checked.warnings = outside_range::warnings(&checked.points);
    let points = checked.points.iter().filter(|point| !point.is_input);
    let taken: HashSet<Place> = points.flat_map(|p| bits_of(p.symbol.outside())).collect();
    let is_taken = |name: &String| {
        by_name
            .get(name.as_str())
            .is_none_or(|symbol| bits_of(symbol.outside()).iter().all(|bit| taken.contains(bit)))
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

/// The places of the bits of a place, or the place itself if it has none.
fn bits_of(place: Place) -> Vec<Place> {
    let bits: Vec<Place> = place.each_bit().collect();
    if bits.is_empty() { vec![place] } else { bits }
}

/// The symbols of single bits, by their places outside; inputs count before others.
fn by_line(symbols: &[Symbol]) -> HashMap<Place, &Symbol> {
    let mut by_line: HashMap<Place, &Symbol> = HashMap::new();
    for symbol in symbols.iter().filter(|symbol| symbol.outside().ty == Type::Bits) {
        if let [bit] = *bits_of(symbol.outside()).as_slice() {
            let known = by_line.entry(bit).or_insert(symbol);
            if known.slot.is_none() {
                *known = symbol;
            }
        }
    }
    by_line
}

/// What an entry wires of a variable: the variable itself, or each of its lines where the points outside are bits that it
/// lists.
fn lines<'s>(
    entry: &Entry,
    symbol: &'s Symbol,
    address: Option<Arc<dyn Address>>,
    addresses: &Addresses,
    by_line: &HashMap<Place, &'s Symbol>,
) -> Result<Vec<(Entry, &'s Symbol)>, String> {
    let place = symbol.outside();
    let is_for_bits = |address: Arc<dyn Address>| {
        address.formats().is_none() && address.unfit(entry.is_input == Some(true), false).is_some()
    };
    let has_lines = matches!(place.ty, Type::Bits | Type::SignedBits | Type::Bcd);
    let is_list = matches!(addresses, Addresses::List(_));
    if place.is_bit() || !has_lines || !is_list || !address.is_some_and(is_for_bits) {
        return Ok(vec![(entry.clone(), symbol)]);
    }
    let safe = match entry.safe {
        Safe::Value(Number::Int(value)) if place.range().is_some_and(|r| r.contains(&value)) => {
            Some(place.bits_of(value))
        }
        Safe::Value(value) => return Err(format!("can't be {value}, its `safe`")),
        Safe::Off | Safe::Hold => None,
    };
    let line = |(bit, at): (u32, Place)| {
        let symbol =
            by_line.get(&at).ok_or("has lines without names, which can't be wired one by one")?;
        let safe = safe.map(|bits| Safe::Value(Number::Int((bits >> bit & 1) as i64)));
        Ok((Entry { safe: safe.unwrap_or(entry.safe), ..entry.clone() }, *symbol))
    };
    (0..).zip(place.each_bit()).map(line).collect()
}

/// The advice for several lines whose entry names one point for a bit.
fn lines_wanted(point: &Point, addresses: &Addresses) -> String {
    let place = point.symbol.outside();
    let fits_bits = || {
        let address = point.address.as_ref();
        address.is_some_and(|address| address.unfit(point.is_input, true).is_none())
    };
    let is_group = !place.is_bit() && matches!(place.ty, Type::Bits | Type::SignedBits | Type::Bcd);
    match is_group && matches!(addresses, Addresses::From(_)) && fits_bits() {
        true => format!(
            "; it has {} lines: a range or a list of as many addresses gives each line a point",
            place.width
        ),
        false => String::new(),
    }
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
