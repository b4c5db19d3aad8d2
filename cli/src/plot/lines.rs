//! The points of lines: few enough to be drawn, and all that can be seen.

use super::Sample;
use super::axis::Axis;

/// The points of a variable over time. A value holds until the tick before the next one. In each of `columns` columns of
/// pixels stand at most two points: the first smallest and the first largest value, in the order of time.
pub(super) fn thinned(
    samples: &[Sample],
    end: (u64, f64),
    columns: f64,
    time: &Axis,
) -> impl Iterator<Item = (f64, f64)> {
    // How long a tick takes, on the average.
    let step = if end.0 > 0 { end.1 / end.0 as f64 } else { 0.0 };
    let held = samples.iter().enumerate().flat_map(move |(at, sample)| {
        let until = match samples.get(at + 1) {
            Some(next) if next.tick > sample.tick + 1 => Some(next.time - step),
            Some(_) => None,
            None => Some(end.1),
        };
        let last = until.filter(|&until| until > sample.time).map(|until| (until, sample.value));
        std::iter::once((sample.time, sample.value)).chain(last)
    });
    let width = time.column(columns);
    let mut points: Vec<(f64, f64)> = vec![];
    let mut column: Option<Column> = None;
    for point in held {
        let number = (point.0 / width).floor();
        match &mut column {
            Some(column) if column.number == number => column.see(point),
            _ => {
                column.into_iter().for_each(|column| points.extend(column.points()));
                column = Some(Column { number, low: point, high: point });
            }
        }
    }
    column.into_iter().for_each(|column| points.extend(column.points()));
    points.into_iter()
}

/// What lies in a column of pixels.
#[derive(Clone, Copy)]
struct Column {
    number: f64,
    low: (f64, f64),
    high: (f64, f64),
}

impl Column {
    fn see(&mut self, point: (f64, f64)) {
        if point.1 < self.low.1 {
            self.low = point;
        }
        if point.1 > self.high.1 {
            self.high = point;
        }
    }

    /// One point or two.
    fn points(self) -> impl Iterator<Item = (f64, f64)> {
        let (first, second) =
            if self.high.0 < self.low.0 { (self.high, self.low) } else { (self.low, self.high) };
        std::iter::once(first).chain((second != first).then_some(second))
    }
}

/// The points at which one of two variables has changed, each with the values of both.
pub(super) fn path_points(x: &[Sample], y: &[Sample]) -> Vec<(f64, f64)> {
    let mut points = vec![];
    let (mut x, mut y) = (x.iter().peekable(), y.iter().peekable());
    let mut at: (Option<f64>, Option<f64>) = (None, None);
    loop {
        let next = match (x.peek(), y.peek()) {
            (Some(x), Some(y)) => x.tick.min(y.tick),
            (Some(one), None) | (None, Some(one)) => one.tick,
            (None, None) => return points,
        };
        if let Some(sample) = x.next_if(|sample| sample.tick == next) {
            at.0 = Some(sample.value);
        }
        if let Some(sample) = y.next_if(|sample| sample.tick == next) {
            at.1 = Some(sample.value);
        }
        if let (Some(x), Some(y)) = at {
            points.push((x, y));
        }
    }
}

/// Points of a picture without those that lie within half a pixel of the one before; the last one stays.
pub(super) fn apart(points: impl Iterator<Item = (f64, f64)>) -> impl Iterator<Item = (f64, f64)> {
    let mut kept: Vec<(f64, f64)> = vec![];
    let mut last = None;
    for point in points {
        let near = |&(x, y): &(f64, f64)| (x - point.0).abs() < 0.5 && (y - point.1).abs() < 0.5;
        if !kept.last().is_some_and(near) {
            kept.push(point);
        }
        last = Some(point);
    }
    let missing = last.filter(|last| kept.last() != Some(last));
    kept.into_iter().chain(missing)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(tick: u64, value: f64) -> Sample {
        Sample { tick, time: tick as f64, value }
    }

    #[test]
    fn a_value_holds_until_the_tick_before_the_next() {
        let samples = [sample(0, 1.0), sample(10, 2.0), sample(11, 3.0)];
        let points: Vec<_> = thinned(&samples, (20, 20.0), 1000.0, &Axis::of_time(20.0)).collect();
        assert_eq!(points, [(0.0, 1.0), (9.0, 1.0), (10.0, 2.0), (11.0, 3.0), (20.0, 3.0)]);
    }

    #[test]
    fn a_column_has_its_first_smallest_and_first_largest_value() {
        let samples: Vec<_> = [5.0, 1.0, 9.0, 1.0, 9.0]
            .iter()
            .zip(0..)
            .map(|(&value, at)| sample(at, value))
            .collect();
        let points: Vec<_> = thinned(&samples, (9, 9.0), 1.0, &Axis::of_time(10.0)).collect();
        assert_eq!(points, [(1.0, 1.0), (2.0, 9.0)]);
    }

    #[test]
    fn a_path_has_both_values_at_each_change() {
        let (x, y) =
            ([sample(0, 1.0), sample(2, 2.0)], [sample(1, 5.0), sample(2, 6.0), sample(4, 7.0)]);
        assert_eq!(path_points(&x, &y), [(1.0, 5.0), (2.0, 6.0), (2.0, 7.0)]);
    }
}
