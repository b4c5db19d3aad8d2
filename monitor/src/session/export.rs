//! What the scope shows, as a table and as a drawing.

use std::fmt::Write;

use plcc_runtime::value::number;

use super::Session;
use super::scope::ScopeRows;
use crate::{ExportFormat, Refusal, Reply};

/// Sizes of the drawing in pixels.
const WIDTH: f64 = 1000.0;
const MARGIN: f64 = 160.0;
const LANE: f64 = 60.0;
const GAP: f64 = 16.0;

impl Session<'_> {
    pub(super) fn scope_export(&mut self, format: ExportFormat) -> Result<Reply, Refusal> {
        let rows = self.scope_rows()?;
        let text = match format {
            ExportFormat::Csv => csv(&rows),
            ExportFormat::Svg => svg(&rows),
        };
        Ok(Reply { message: Some(format!("{} ticks", rows.rows.len())), text: Some(text) })
    }
}

/// A table: `tick,seconds` and a column for each variable.
fn csv(samples: &ScopeRows) -> String {
    let mut text = format!("tick,seconds,{}\n", samples.names.join(","));
    for (tick, values) in &samples.rows {
        let seconds = *tick as f64 * samples.tick_ns as f64 / 1e9;
        let shown = values.iter().map(|value| value.map_or_else(String::new, number));
        let shown: Vec<String> = shown.collect();
        // Writing to a String does not fail.
        let _ = writeln!(text, "{tick},{},{}", number(seconds), shown.join(","));
    }
    text
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// A drawing with a lane for each variable, one above the other.
fn svg(samples: &ScopeRows) -> String {
    let height = samples.names.len() as f64 * (LANE + GAP) + 2.0 * GAP + 20.0;
    let first = samples.rows.first().map_or(0, |row| row.0);
    let last = samples.rows.last().map_or(0, |row| row.0).max(first + 1);
    let x = |tick: u64| {
        MARGIN
            + (tick.saturating_sub(first)) as f64 / (last - first) as f64 * (WIDTH - MARGIN - GAP)
    };
    let mut text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\" \
         font-family=\"monospace\" font-size=\"12\">\n\
         <rect width=\"{WIDTH}\" height=\"{height}\" fill=\"white\"/>\n"
    );
    for (channel, name) in samples.names.iter().enumerate() {
        let top = GAP + channel as f64 * (LANE + GAP);
        let values =
            || samples.rows.iter().filter_map(|(tick, row)| Some((*tick, (*row.get(channel)?)?)));
        let low = values().map(|(_, value)| value).fold(f64::INFINITY, f64::min);
        let high = values().map(|(_, value)| value).fold(f64::NEG_INFINITY, f64::max);
        let span = if high > low { high - low } else { 1.0 };
        let y = |value: f64| top + LANE - (value - low) / span * LANE;
        let mut points = String::new();
        let mut before: Option<f64> = None;
        for (tick, value) in values() {
            if before == Some(value) && tick != last {
                continue;
            }
            if let Some(before) = before {
                let _ = write!(points, "{:.1},{:.1} ", x(tick), y(before));
            }
            let _ = write!(points, "{:.1},{:.1} ", x(tick), y(value));
            before = Some(value);
        }
        let (middle, bottom) = (top + LANE / 2.0, top + LANE);
        let _ = writeln!(
            text,
            "<text x=\"8\" y=\"{middle}\">{}</text>\n\
             <text x=\"8\" y=\"{}\" font-size=\"10\" fill=\"gray\">{} to {}</text>\n\
             <line x1=\"{MARGIN}\" y1=\"{bottom}\" x2=\"{WIDTH}\" y2=\"{bottom}\" stroke=\"lightgray\"/>\n\
             <polyline points=\"{}\" fill=\"none\" stroke=\"black\"/>",
            escaped(name),
            middle + 14.0,
            if low.is_finite() { number(low) } else { String::new() },
            if high.is_finite() { number(high) } else { String::new() },
            points.trim_end()
        );
    }
    let marks = [
        (samples.trigger_tick, "red"),
        (samples.cursors[0], "blue"),
        (samples.cursors[1], "green"),
    ];
    for (tick, colour) in marks {
        let Some(tick) = tick.filter(|tick| (first..=last).contains(tick)) else { continue };
        let _ = writeln!(
            text,
            "<line x1=\"{0:.1}\" y1=\"0\" x2=\"{0:.1}\" y2=\"{1}\" stroke=\"{colour}\" \
             stroke-dasharray=\"4\"/>",
            x(tick),
            height - 20.0
        );
    }
    let end = height - 6.0;
    let _ = writeln!(
        text,
        "<text x=\"{MARGIN}\" y=\"{end}\">tick {first}</text>\n\
         <text x=\"{}\" y=\"{end}\" text-anchor=\"end\">tick {last}</text>\n</svg>",
        WIDTH - GAP
    );
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn samples() -> ScopeRows {
        ScopeRows {
            names: vec!["A".into(), "B<".into()],
            rows: vec![
                (4, vec![Some(0.0), Some(2.5)]),
                (5, vec![Some(1.0), None]),
                (6, vec![Some(1.0), Some(-1.0)]),
            ],
            tick_ns: 20_000_000,
            trigger_tick: Some(5),
            cursors: [None, Some(99)],
        }
    }

    #[test]
    fn a_table_has_a_row_for_each_tick() {
        assert_eq!(csv(&samples()), "tick,seconds,A,B<\n4,0.08,0,2.5\n5,0.1,1,\n6,0.12,1,-1\n");
    }

    #[test]
    fn a_drawing_has_a_line_for_each_variable_and_the_trigger() {
        let text = svg(&samples());
        assert_eq!(text.matches("<polyline").count(), 2);
        assert!(text.contains("B&lt;") && text.contains("stroke=\"red\""));
        assert!(text.ends_with("</svg>\n") && !text.contains("\"green\""));
    }
}
