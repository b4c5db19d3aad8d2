//! Draws the simulated machine: axes and small machines as bars, the block that runs, ways in a plane, and below them lamps and
//! keys, of which the selected one is reversed.

use plcc_screen::{cell_text, first_shown, fitted, style_of, word_rows};
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style};
use ratatui::symbols::Marker;
use ratatui::text::{Line, Span};
use ratatui::widgets::Paragraph;
use ratatui::widgets::canvas::{Canvas, Points};

use crate::terminal::app::App;
use crate::view::{AxisView, DeviceView, MachineView, PathView, ProgramView};

/// The cells of a bar at most.
const BAR: usize = 20;
/// From how many cells on a row says where an axis is to be.
const WIDE: usize = 70;
/// The narrowest cell of a key.
const KEY_WIDTH: usize = 18;
/// The narrowest screen that has room for a way beside the rest, and the part of it that the way takes.
const PATH_BESIDE: u16 = 76;
const STRONG: Style = Style::new().add_modifier(Modifier::BOLD);

pub(super) fn draw(app: &mut App, view: &MachineView, frame: &mut Frame<'_>, area: Rect) {
    let width = usize::from(area.width);
    let mut below = lamps(view, width);
    below.extend(keys(app, view, width, usize::from(area.height) / 2));
    let rows = [Constraint::Min(4), Constraint::Length(below.len() as u16)];
    let [above, bottom] = Layout::vertical(rows).areas(area);
    frame.render_widget(Paragraph::new(below), bottom);
    let path = view.paths.first().filter(|_| area.width >= PATH_BESIDE);
    let columns =
        [Constraint::Min(40), Constraint::Percentage(if path.is_some() { 42 } else { 0 })];
    let [list, plane] = Layout::horizontal(columns).areas(above);
    let lines = list_lines(view, usize::from(list.width), usize::from(list.height));
    frame.render_widget(Paragraph::new(lines), list);
    if let Some(path) = path {
        draw_path(path, frame, plane);
    }
}

/// Axes, small machines and programs, in as many rows as there are.
fn list_lines(view: &MachineView, width: usize, height: usize) -> Vec<Line<'static>> {
    let mut lines =
        vec![Line::styled(fitted(&format!("values of {}", view.moment), width), STRONG)];
    let text = |text: String| Line::raw(fitted(&text, width));
    lines.extend(view.axes.iter().map(|axis| text(axis_text(axis, width))));
    lines.extend(view.devices.iter().map(|device| text(device_text(device))));
    // What is left is for the programs, the line that runs first of all.
    let left = height.saturating_sub(lines.len());
    let each = left.checked_div(view.programs.len()).unwrap_or(0);
    for program in &view.programs {
        lines.extend(program_lines(program, width, each));
    }
    lines
}

fn number(value: Option<f64>) -> String {
    let rounded = |value: f64| plcc_runtime::value::number((value * 10_000.0).round() / 10_000.0);
    value.map_or_else(|| "?".into(), rounded)
}

/// A bar with a mark where something is, from 0 to 1.
fn bar(part: Option<f64>, width: usize) -> String {
    let at = part.map(|part| (part * width.saturating_sub(1) as f64).round() as usize);
    let cells = (0..width).map(|cell| if Some(cell) == at { '#' } else { '-' });
    format!("[{}]", cells.collect::<String>())
}

fn axis_text(axis: &AxisView, width: usize) -> String {
    let head = format!("{:<3} {:>9} {}", axis.name, number(axis.actual), axis.unit);
    let mut tail =
        axis.error.map_or(String::new(), |error| format!(" error {}", number(Some(error))));
    let Some((low, high)) = axis.travel else { return head + &tail };
    if let Some(commanded) = axis.commanded.filter(|_| width >= WIDE) {
        tail.insert_str(0, &format!(" to {}", number(Some(commanded))));
    }
    let used = head.len() + tail.len() + format!("{low}{high}").len() + 5;
    let room = width.saturating_sub(used).clamp(4, BAR);
    format!("{head} {low} {} {high}{tail}", bar(axis.part(), room))
}

fn device_text(device: &DeviceView) -> String {
    let drawn = match device.kind.as_str() {
        "cylinder" => {
            let out = device.part.map_or(0, |part| (part * 8.0).round() as usize).min(8);
            format!("[=={}|{}]", "=".repeat(out), " ".repeat(8 - out))
        }
        "relay" | "switch" => {
            (if device.part == Some(1.0) { "--o-o--" } else { "--o/ o--" }).to_owned()
        }
        _ => bar(device.part, BAR / 2),
    };
    let lines = device.lines.iter().map(|line| format!("{}={}", line.name, number(line.value)));
    let lines: Vec<String> = lines.collect();
    format!("{:<8} {:<8} {drawn} {}  {}", device.name, device.kind, device.text, lines.join(" "))
}

fn program_lines(program: &ProgramView, width: usize, room: usize) -> Vec<Line<'static>> {
    let mut head = program.name.clone();
    if let Some(number) = program.number.filter(|number| *number != 0.0) {
        head.push_str(&format!(" PROG {number}"));
    }
    match program.line {
        Some(0.0) | None => head.push_str(", no block runs"),
        Some(line) if line < 0.0 => head.push_str(&format!(", entered block {}", -line)),
        Some(line) => head.push_str(&format!(", line {line}")),
    }
    if let Some(base) = program.base {
        head.push_str(&format!(", time base {} %", number(Some(base))));
    }
    let current = program.lines.iter().position(|line| line.current).unwrap_or(0);
    let room = room.saturating_sub(1);
    let first = first_shown(current, program.lines.len(), room);
    let lines = program.lines.iter().skip(first).take(room).map(|line| {
        let mark = if line.current { '>' } else { ' ' };
        let style = if line.current { STRONG } else { Style::new() };
        Line::styled(fitted(&format!("{mark}{:>4} {}", line.number, line.text), width), style)
    });
    [Line::styled(fitted(&head, width), STRONG)].into_iter().chain(lines).collect()
}

fn lamps(view: &MachineView, width: usize) -> Vec<Line<'static>> {
    if view.lamps.is_empty() {
        return vec![];
    }
    let lamps: Vec<String> =
        view.lamps.iter().map(|lamp| cell_text(lamp).replace(' ', "\u{a0}")).collect();
    word_rows(&format!("lamps: {}", lamps.join(" ")), width).into_iter().map(Line::raw).collect()
}

fn keys(app: &mut App, view: &MachineView, width: usize, most: usize) -> Vec<Line<'static>> {
    app.columns = (width / KEY_WIDTH).max(1);
    app.selected = app.selected.min(view.keys.len().saturating_sub(1));
    if view.keys.is_empty() {
        return vec![];
    }
    let cell_width = (width / app.columns).max(2);
    let rows: Vec<_> = view.keys.chunks(app.columns).collect();
    let first = first_shown(app.selected / app.columns, rows.len(), most);
    let rows = rows.into_iter().enumerate().skip(first).take(most).map(|(row, cells)| {
        let spans = cells.iter().enumerate().flat_map(|(column, cell)| {
            let is_selected = row * app.columns + column == app.selected;
            let text = fitted(&cell_text(cell), cell_width - 1);
            [Span::styled(text, style_of(cell, is_selected)), Span::raw(" ")]
        });
        Line::from(spans.collect::<Vec<_>>())
    });
    let title = Line::styled("keys", STRONG);
    [title].into_iter().chain(rows).collect()
}

/// A way with equal scales: a cell is twice as high as it is wide.
fn draw_path(path: &PathView, frame: &mut Frame<'_>, area: Rect) {
    let rows = [Constraint::Length(1), Constraint::Min(1)];
    let [title, plane] = Layout::vertical(rows).areas(area);
    let of = |axis: usize| path.points.iter().filter_map(move |point| point.get(axis)).copied();
    let bounds = |axis| {
        let low = of(axis).fold(f64::INFINITY, f64::min);
        let high = of(axis).fold(f64::NEG_INFINITY, f64::max);
        if low <= high { (low, high) } else { (0.0, 0.0) }
    };
    let ((left, right), (bottom, top)) = (bounds(0), bounds(1));
    let (width, height) = (f64::from(plane.width.max(1)), f64::from(plane.height.max(1)) * 2.0);
    // The way has a margin of a twentieth, and never less than something.
    let scale = ((right - left) / width).max((top - bottom) / height).max(1e-6) * 1.1;
    let around = |low: f64, high: f64, cells: f64| {
        let middle = (low + high) / 2.0;
        [middle - cells * scale / 2.0, middle + cells * scale / 2.0]
    };
    let coords: Vec<(f64, f64)> = path.points.iter().map(|[x, y]| (*x, *y)).collect();
    let here = coords.last().copied();
    let text = match here {
        Some((x, y)) => format!("{}: {}, {}", path.name, number(Some(x)), number(Some(y))),
        None => path.name.clone(),
    };
    frame.render_widget(Paragraph::new(Line::styled(text, STRONG)), title);
    let canvas = Canvas::default()
        .marker(Marker::Braille)
        .x_bounds(around(left, right, width))
        .y_bounds(around(bottom, top, height))
        .paint(move |context| {
            context.draw(&Points { coords: &coords, color: Color::Reset });
            if let Some((x, y)) = here {
                context.print(x, y, "+");
            }
        });
    frame.render_widget(canvas, plane);
}
