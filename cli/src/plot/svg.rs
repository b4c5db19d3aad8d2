//! The text of an SVG file: lines, bars, numbers and names at their places. Coordinates have two decimals.

use std::fmt::Write;

use super::axis::Axis;

/// The grey of lines that only help to read the picture.
const GRID: &str = "#dddddd";
/// About how wide a letter is, by which it is known how many names fit.
const LETTER: f64 = 6.6;

/// A rectangle of the picture.
#[derive(Clone, Copy, Debug)]
pub(super) struct Area {
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) width: f64,
    pub(super) height: f64,
}

impl Area {
    pub(super) fn bottom(self) -> f64 {
        self.y + self.height
    }

    fn right(self) -> f64 {
        self.x + self.width
    }
}

/// A picture that is being written.
pub(super) struct Svg {
    text: String,
}

impl Svg {
    /// A white picture of a size in pixels.
    pub(super) fn new(width: f64, height: f64) -> Self {
        let mut svg = Self { text: String::new() };
        svg.put(format_args!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
             viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" font-size=\"11\">\n\
             <rect width=\"{width}\" height=\"{height}\" fill=\"#ffffff\"/>\n"
        ));
        svg
    }

    fn put(&mut self, text: std::fmt::Arguments<'_>) {
        // Writing to memory does not fail.
        let _ = self.text.write_fmt(text);
    }

    fn line(&mut self, from: (f64, f64), to: (f64, f64), color: &str) {
        let ((x1, y1), (x2, y2)) = (from, to);
        self.put(format_args!(
            "<line x1=\"{}\" y1=\"{}\" x2=\"{}\" y2=\"{}\" stroke=\"{color}\"/>\n",
            at(x1),
            at(y1),
            at(x2),
            at(y2)
        ));
    }

    fn word(&mut self, (x, y): (f64, f64), anchor: &str, color: &str, text: &str) {
        self.put(format_args!(
            "<text x=\"{}\" y=\"{}\" text-anchor=\"{anchor}\" fill=\"{color}\">{}</text>\n",
            at(x),
            at(y),
            escaped(text)
        ));
    }

    /// The frame of a panel with a grid, and the numbers of its vertical axis.
    pub(super) fn frame(&mut self, area: Area, horizontal: &Axis, vertical: &Axis) {
        for (value, _) in horizontal.numbers() {
            let x = area.x + horizontal.share(value) * area.width;
            self.line((x, area.y), (x, area.bottom()), GRID);
        }
        for (value, text) in vertical.numbers() {
            let y = area.bottom() - vertical.share(value) * area.height;
            self.line((area.x, y), (area.right(), y), GRID);
            self.word((area.x - 6.0, y + 4.0), "end", "#333333", &text);
        }
        self.put(format_args!(
            "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"none\" stroke=\"#888888\"/>\n",
            at(area.x), at(area.y), at(area.width), at(area.height)
        ));
    }

    /// The numbers of a horizontal axis, below its panel.
    pub(super) fn numbers_below(&mut self, area: Area, axis: &Axis) {
        for (value, text) in axis.numbers() {
            let x = area.x + axis.share(value) * area.width;
            self.word((x, area.bottom() + 14.0), "middle", "#333333", &text);
        }
    }

    /// The axis of time, below all panels.
    pub(super) fn time_axis(&mut self, area: Area, axis: &Axis, unit: &str) {
        self.line((area.x, area.bottom()), (area.right(), area.bottom()), "#888888");
        self.numbers_below(area, axis);
        let middle = area.x + area.width / 2.0;
        self.word((middle, area.bottom() + 30.0), "middle", "#333333", unit);
    }

    /// The line above a panel: what it shows, and the names of its variables in their colours. Those that have no room are
    /// counted.
    pub(super) fn legend<'n>(
        &mut self,
        area: Area,
        title: &str,
        names: impl Iterator<Item = (&'static str, &'n str)>,
    ) {
        let y = area.y - 6.0;
        self.word((area.x, y), "start", "#333333", title);
        let mut x = area.x + 64.0;
        let mut more = 0;
        for (color, name) in names {
            let width = LETTER * name.chars().count() as f64 + 14.0;
            if more > 0 || x + width > area.right() - 60.0 {
                more += 1;
                continue;
            }
            self.word((x, y), "start", color, name);
            x += width;
        }
        if more > 0 {
            self.word((area.right(), y), "end", "#333333", &format!("and {more} more"));
        }
    }

    /// A line through points.
    pub(super) fn polyline(&mut self, color: &str, points: impl Iterator<Item = (f64, f64)>) {
        let points: Vec<String> = points.map(|(x, y)| format!("{},{}", at(x), at(y))).collect();
        self.put(format_args!(
            "<polyline fill=\"none\" stroke=\"{color}\" stroke-width=\"1.5\" stroke-linejoin=\"round\" \
             stroke-linecap=\"round\" points=\"{}\"/>\n",
            points.join(" ")
        ));
    }

    /// The name of a bar, at the left of it.
    pub(super) fn bar_name(&mut self, x: f64, y: f64, name: &str, height: f64) {
        let fits = ((x - 10.0) / LETTER) as usize;
        let shown: String = match name.char_indices().nth(fits) {
            Some((end, _)) => format!("{}…", name.get(..end).unwrap_or_default()),
            None => name.into(),
        };
        let size = height.min(11.0);
        self.put(format_args!(
            "<text x=\"{}\" y=\"{}\" text-anchor=\"end\" font-size=\"{}\" fill=\"#333333\">{}</text>\n",
            at(x - 6.0), at(y + size * 0.36), at(size), escaped(&shown)
        ));
    }

    /// Bars from one x to another.
    pub(super) fn bars(&mut self, color: &str, y: f64, height: f64, spans: &[(f64, f64)]) {
        for (begin, end) in spans {
            let width = (end - begin).max(0.5);
            self.put(format_args!(
                "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"{color}\"/>\n",
                at(*begin),
                at(y),
                at(width),
                at(height)
            ));
        }
    }

    /// The whole file.
    pub(super) fn finish(mut self) -> String {
        self.text.push_str("</svg>\n");
        self.text
    }
}

/// A coordinate.
fn at(value: f64) -> String {
    let text = format!("{value:.2}");
    if text == "-0.00" { "0.00".into() } else { text }
}

/// A text inside an element.
fn escaped(text: &str) -> String {
    let mut out = String::new();
    for letter in text.chars() {
        match letter {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            // XML has no other control characters.
            letter if letter.is_control() || matches!(letter, '\u{fffe}' | '\u{ffff}') => {
                out.push('\u{fffd}')
            }
            letter => out.push(letter),
        }
    }
    out
}
