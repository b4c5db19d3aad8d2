//! Finds variables that can have values which the format of their point outside can't hold.

use std::collections::HashSet;

use super::Warning;
use super::check::{Address, Point};
use super::ethercat_point::ProcessValue;
use super::modbus_format::{Coding, Format};
use crate::symbol::Number;

/// A format's name, and the lowest and the highest value that it can hold.
type Named = (&'static str, (f64, f64));

/// The format of a point, and the formats that it could have instead; `None` where it has none, or is a bit.
fn formats(address: &Address) -> Option<(Named, Vec<Named>)> {
    match address {
        Address::Modbus(address) => {
            let Format::Number(coding, _) = address.format else { return None };
            let named = |coding: Coding| (coding.name(), coding.range());
            Some((named(coding), Coding::all().map(named).collect()))
        }
        Address::Ethercat(point) => {
            let named = |value: ProcessValue| Some((value.name()?, value.range()));
            Some((named(point.value)?, ProcessValue::numbers().filter_map(named).collect()))
        }
        Address::Gpio(_) | Address::Zenoh(_) => None,
    }
}

/// The lowest and the highest value of the point for all values that the variable can have; `None` for a number with a
/// fraction, which can be any.
fn values(point: &Point) -> Option<(f64, f64)> {
    let range = point.symbol.outside().range()?;
    let ends = [*range.start(), *range.end()].map(|end| point.outside(Number::Int(end)));
    let [one, other] = ends;
    Some((one.min(other), one.max(other)))
}

/// Whether all values of a variable fit. Any number with a fraction fits a format with a fraction.
fn fits(values: Option<(f64, f64)>, (_, (low, high)): Named) -> bool {
    match values {
        Some((lowest, highest)) => low <= lowest.round() && highest.round() <= high,
        None => low <= f32::MIN.into(),
    }
}

/// One warning for each entry that takes variables to points that can't hold all of their values.
pub(super) fn warnings(points: &[Point]) -> Vec<Warning> {
    let mut warned = HashSet::new();
    let mut warnings = vec![];
    for point in points.iter().filter(|point| !point.is_input) {
        let Some((own, others)) = point.address.as_ref().and_then(formats) else { continue };
        let values = values(point);
        if fits(values, own) || !warned.insert(point.entry.line) {
            continue;
        }
        let can_be = match values {
            Some((lowest, highest)) => format!("{lowest} to {highest}"),
            None => "any number".into(),
        };
        let better = others.into_iter().find(|other| fits(values, *other));
        let better = better.map(|(name, _)| format!("; {name} holds all")).unwrap_or_default();
        let (name, (low, high)) = own;
        let message = format!(
            "`{}` can be {can_be}, but {name} is {low} to {high}: what does not fit is not written{better}",
            point.symbol.name
        );
        warnings.push(Warning { line: Some(point.entry.line), message });
    }
    warnings
}
