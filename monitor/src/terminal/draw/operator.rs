//! The operator's screen: faults and messages in large letters, overrides, keys and lamps.

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::{Color, Modifier, Style};
use ratatui::text::{Line, Span};
use ratatui::widgets::Paragraph;

use super::super::app::App;
use super::{fitted, panels, word_rows};
use crate::view::{Active, EventKind, OperatorView};

/// The cells that a key takes at least.
const KEY_WIDTH: usize = 20;

pub(super) fn draw(app: &mut App, view: &OperatorView, frame: &mut Frame<'_>, area: Rect) {
    let width = usize::from(area.width);
    let strong = Style::new().add_modifier(Modifier::BOLD);
    let mut lines: Vec<Line<'static>> = vec![];
    for one in &view.active {
        lines.extend(announced(one, width));
    }
    if view.active.is_empty() {
        lines.push(Line::styled("no fault and no message", strong));
        lines.push(Line::raw(""));
    }
    let overrides = view.overrides.iter();
    let overrides: Vec<String> = overrides
        .map(|cell| format!("{} {}", cell.label, cell.value.as_deref().unwrap_or("-")))
        .collect();
    if !overrides.is_empty() {
        lines.push(Line::styled(overrides.join("   "), strong));
        lines.push(Line::raw(""));
    }
    app.columns = (width / KEY_WIDTH).max(1);
    app.selected = app.selected.min(view.keys.len().saturating_sub(1));
    if view.keys.is_empty() {
        lines.push(Line::raw("the program uses no key and no lamp of the control's panels"));
    }
    let cell_width = (width / app.columns).max(2);
    for (row, cells) in view.keys.chunks(app.columns).enumerate() {
        let spans = cells.iter().enumerate().flat_map(|(column, cell)| {
            let is_selected = row * app.columns + column == app.selected;
            let text = fitted(&panels::cell_text(cell), cell_width - 1);
            [Span::styled(text, panels::style_of(cell, is_selected)), Span::raw(" ")]
        });
        lines.push(Line::from(spans.collect::<Vec<_>>()));
        lines.push(Line::raw(""));
    }
    frame.render_widget(Paragraph::new(lines), area);
}

/// A fault or message: a bar with its text in capitals that stand apart, where the width is enough for that.
fn announced(one: &Active, width: usize) -> Vec<Line<'static>> {
    let color = if one.kind == EventKind::Fault { Color::Red } else { Color::Yellow };
    let style = Style::new().fg(Color::Black).bg(color).add_modifier(Modifier::BOLD);
    let apart: Vec<String> = one.text.to_uppercase().chars().map(String::from).collect();
    let apart = apart.join(" ");
    let text = if apart.chars().count() + 4 <= width { apart } else { one.text.clone() };
    let rows = word_rows(&text, width.saturating_sub(4));
    let bar = |text: &str| Line::styled(fitted(&format!("  {text}"), width), style);
    let text = rows.iter().map(|row| bar(row));
    [bar("")].into_iter().chain(text).chain([bar(""), Line::raw("")]).collect()
}
