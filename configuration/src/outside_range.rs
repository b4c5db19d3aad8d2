//! Finds variables that can have values which the format of their point outside can't hold.

use std::collections::HashSet;

use plcc_image::Number;

use crate::{Point, ValueFormat, Warning};

/// The lowest and the highest value of the point for all values that the variable can have; `None` for a number with a
/// fraction, which can be any.
fn values(point: &Point) -> Option<(f64, f64)> {
    let range = point.symbol.outside().range()?;
    let ends = [*range.start(), *range.end()].map(|end| point.outside(Number::Int(end)));
    let [one, other] = ends;
    Some((one.min(other), one.max(other)))
}

/// Whether all values of a variable fit. Any number with a fraction fits a format with a fraction.
fn fits(values: Option<(f64, f64)>, ValueFormat { low, high, .. }: ValueFormat) -> bool {
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
        let Some((own, others)) = point.address.as_ref().and_then(|at| at.formats()) else {
            continue;
        };
        let values = values(point);
        if fits(values, own) || !warned.insert(point.entry.line) {
            continue;
        }
        let can_be = match values {
            Some((lowest, highest)) => format!("{lowest} to {highest}"),
            None => "any number".into(),
        };
        let better = others.into_iter().find(|other| fits(values, *other));
        let better =
            better.map(|better| format!("; {} holds all", better.name)).unwrap_or_default();
        let ValueFormat { name, low, high } = own;
        let message = format!(
            "`{}` can be {can_be}, but {name} is {low} to {high}: what does not fit is not written{better}",
            point.symbol.name
        );
        warnings.push(Warning { line: Some(point.entry.line), message });
    }
    warnings
}
