//! Pictures of traces: `plcc plot` and `plcc run --plot`.
//!
//! [`Picture`] takes samples of variables and draws them as an SVG that needs nothing else: positions over time, velocities
//! below them, other numbers below those, a bar for each bit, and where X and Y of one system are watched the path. Only
//! additions, multiplications and divisions are used, so that the same trace gives the same bytes on every computer.

mod axis;
mod lines;
mod quantity;
mod recorder;
mod svg;
mod table;

use std::collections::HashMap;

pub(crate) use recorder::PlotRecorder;
pub(crate) use table::read_table;

use axis::Axis;
use lines::{path_points, thinned};
use quantity::Quantity;
use svg::{Area, Svg};

/// The size of a picture.
const WIDTH: f64 = 960.0;
const HEIGHT: f64 = 720.0;
/// What lies around the panels: numbers at the left, the axis of time at the bottom.
const LEFT: f64 = 84.0;
const RIGHT: f64 = 16.0;
const TOP: f64 = 12.0;
const BOTTOM: f64 = 40.0;
/// The height of the line above a panel that says what its colours mean.
const LEGEND: f64 = 20.0;
/// Between two panels.
const GAP: f64 = 12.0;
/// The width of the path, which is a square.
const PATH: f64 = 300.0;
/// The most bars that are drawn.
pub(crate) const MAX_BARS: usize = 48;

/// Colours that differ for people who see red and green alike, too (after Okabe and Ito), in the order of the variables.
const COLORS: [&str; 8] =
    ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#8c6bb1", "#555555"];

/// What the axis of time counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TimeUnit {
    /// Base ticks.
    Ticks,
    /// Milliseconds of the control's time.
    Milliseconds,
}

/// A value that a variable took in a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Sample {
    tick: u64,
    /// When the tick began, in the unit of the axis.
    time: f64,
    value: f64,
}

/// A variable with its values.
#[derive(Clone, Debug)]
struct Series {
    name: String,
    /// In rising order of ticks; a value holds until the next one.
    samples: Vec<Sample>,
}

impl Series {
    /// Whether all values are 0 and 1.
    fn is_bit(&self) -> bool {
        self.samples.iter().all(|sample| sample.value == 0.0 || sample.value == 1.0)
    }
}

/// What is drawn.
#[derive(Clone, Debug)]
pub(crate) struct Picture {
    unit: TimeUnit,
    series: Vec<Series>,
    /// The number of each variable, by its name.
    numbers: HashMap<String, usize>,
    /// The last tick, and when it began.
    end: (u64, f64),
}

impl Picture {
    /// A picture without variables.
    pub(crate) fn new(unit: TimeUnit) -> Self {
        Self { unit, series: vec![], numbers: HashMap::new(), end: (0, 0.0) }
    }

    /// The number of a variable in the picture; it is added where it is new.
    fn add(&mut self, name: &str) -> usize {
        if let Some(known) = self.numbers.get(name) {
            return *known;
        }
        let number = self.series.len();
        self.numbers.insert(name.into(), number);
        self.series.push(Series { name: name.into(), samples: vec![] });
        number
    }

    /// A variable has a value from a tick on, which began at `time`. Ticks come in rising order.
    fn sample(&mut self, series: usize, tick: u64, time: f64, value: f64) {
        let Some(series) = self.series.get_mut(series) else { return };
        if series.samples.last().is_none_or(|last| last.value != value) {
            series.samples.push(Sample { tick, time, value });
        }
        self.ends(tick, time);
    }

    /// The tick has been run, so that values hold at least until then.
    fn ends(&mut self, tick: u64, time: f64) {
        if tick >= self.end.0 {
            self.end = (tick, time);
        }
    }

    /// Whether there is nothing to draw.
    pub(crate) fn is_empty(&self) -> bool {
        self.series.iter().all(|series| series.samples.is_empty())
    }

    /// How many bits are left out, since there are more than [`MAX_BARS`].
    pub(crate) fn left_out(&self) -> usize {
        let bits = self.of(Quantity::Bit).count();
        bits.saturating_sub(MAX_BARS)
    }

    /// The variables of a kind, with their numbers.
    fn of(&self, quantity: Quantity) -> impl Iterator<Item = (usize, &Series)> {
        let with_values =
            self.series.iter().enumerate().filter(|(_, series)| !series.samples.is_empty());
        with_values.filter(move |(_, series)| Quantity::of(series) == quantity)
    }

    /// The picture as the text of an SVG file.
    pub(crate) fn draw(&self) -> String {
        let mut svg = Svg::new(WIDTH, HEIGHT);
        let paths = self.paths();
        let right = if paths.is_empty() { RIGHT } else { RIGHT + PATH + LEFT };
        let width = WIDTH - LEFT - right;
        let time = Axis::of_time(self.end.1);
        let panels = [
            (Quantity::Position, "position", 3.0),
            (Quantity::Velocity, "velocity", 2.0),
            (Quantity::Number, "value", 2.0),
        ];
        let panels: Vec<_> = panels
            .into_iter()
            .map(|(quantity, title, weight)| (self.of(quantity).collect::<Vec<_>>(), title, weight))
            .filter(|(series, ..)| !series.is_empty())
            .collect();
        let bars: Vec<_> = self.of(Quantity::Bit).take(MAX_BARS).collect();
        let height = HEIGHT - TOP - BOTTOM;
        let most = if panels.is_empty() { height } else { height / 2.0 };
        let bar = (most / bars.len().max(1) as f64).min(22.0);
        let above = height - bar * bars.len() as f64;
        let weights: f64 = panels.iter().map(|(.., weight)| weight).sum();
        let mut y = TOP;
        for (series, title, weight) in &panels {
            let share = above * weight / weights;
            let area = Area { x: LEFT, y: y + LEGEND, width, height: share - LEGEND - GAP };
            self.panel(&mut svg, area, &time, series, title);
            y += share;
        }
        let bars_area = Area { x: LEFT, y, width, height: bar * bars.len() as f64 };
        self.bars(&mut svg, bars_area, &time, &bars, bar);
        let bottom = y + bars_area.height;
        let unit = match self.unit {
            TimeUnit::Ticks => "ticks",
            TimeUnit::Milliseconds => "ms",
        };
        svg.time_axis(Area { x: LEFT, y: TOP, width, height: bottom - TOP }, &time, unit);
        for (number, path) in paths.iter().enumerate() {
            let side = PATH.min((HEIGHT - TOP - BOTTOM) / paths.len() as f64 - LEGEND - 2.0 * GAP);
            let y = TOP + LEGEND + (side + LEGEND + 3.0 * GAP) * number as f64;
            let area = Area { x: WIDTH - RIGHT - PATH, y, width: side, height: side };
            self.path(&mut svg, area, path);
        }
        svg.finish()
    }

    /// Draws numbers over time.
    fn panel(
        &self,
        svg: &mut Svg,
        area: Area,
        time: &Axis,
        series: &[(usize, &Series)],
        title: &str,
    ) {
        let values = series.iter().flat_map(|(_, series)| &series.samples);
        let axis = Axis::of_values(values.map(|sample| sample.value));
        svg.frame(area, time, &axis);
        svg.legend(
            area,
            title,
            series.iter().map(|&(number, series)| (color(number), series.name.as_str())),
        );
        for &(number, series) in series {
            let points = thinned(&series.samples, self.end, area.width, time);
            let points = points.map(|(at, value)| {
                (
                    area.x + time.share(at) * area.width,
                    area.bottom() - axis.share(value) * area.height,
                )
            });
            svg.polyline(color(number), points);
        }
    }

    /// Draws a bar for each bit, as long as it is 1.
    fn bars(&self, svg: &mut Svg, area: Area, time: &Axis, bars: &[(usize, &Series)], height: f64) {
        for (row, &(number, series)) in bars.iter().enumerate() {
            let y = area.y + height * row as f64;
            svg.bar_name(area.x, y + height / 2.0, &series.name, height);
            let mut spans: Vec<(f64, f64)> = vec![];
            for (at, sample) in series.samples.iter().enumerate() {
                if sample.value == 0.0 {
                    continue;
                }
                let end = series.samples.get(at + 1).map_or(self.end.1, |next| next.time);
                let begin = area.x + time.share(sample.time) * area.width;
                let end = area.x + time.share(end) * area.width;
                match spans.last_mut() {
                    // What lies within one column of pixels is one bar.
                    Some(last) if begin - last.1 < 1.0 => last.1 = end,
                    _ => spans.push((begin, end)),
                }
            }
            svg.bars(color(number), y + height * 0.15, height * 0.7, &spans);
        }
    }

    /// The systems of which X and Y are watched: the numbers of both.
    fn paths(&self) -> Vec<(usize, usize)> {
        let find = |name: String| {
            self.numbers
                .get(&name)
                .copied()
                .filter(|&at| self.series.get(at).is_some_and(|s| !s.samples.is_empty()))
        };
        let system = |series: &Series| series.name.strip_suffix(".X").map(str::to_owned);
        let pair =
            |(x, series): (usize, &Series)| Some((x, find(format!("{}.Y", system(series)?))?));
        self.series
            .iter()
            .enumerate()
            .filter(|(_, s)| !s.samples.is_empty())
            .filter_map(pair)
            .collect()
    }

    /// Draws Y over X, both on one scale.
    fn path(&self, svg: &mut Svg, area: Area, &(x, y): &(usize, usize)) {
        let (Some(x_series), Some(y_series)) = (self.series.get(x), self.series.get(y)) else {
            return;
        };
        let values = |series: &Series| series.samples.iter().map(|s| s.value).collect::<Vec<_>>();
        let (x_axis, y_axis) = Axis::of_equal_scale(&values(x_series), &values(y_series));
        svg.frame(area, &x_axis, &y_axis);
        svg.numbers_below(area, &x_axis);
        svg.legend(
            area,
            "path",
            std::iter::once((color(x), format!("{}, {}", x_series.name, y_series.name).as_str())),
        );
        let points = path_points(&x_series.samples, &y_series.samples);
        let points = points.into_iter().map(|(x, y)| {
            (area.x + x_axis.share(x) * area.width, area.bottom() - y_axis.share(y) * area.height)
        });
        svg.polyline(color(x), lines::apart(points));
    }
}

/// The colour of the variable with a number.
fn color(number: usize) -> &'static str {
    COLORS.get(number % COLORS.len()).copied().unwrap_or("#000000")
}

#[cfg(test)]
mod tests;
