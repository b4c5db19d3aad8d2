//! Draws panels: a panel's title, and its cells in a grid. A lamp is `*` or `.`, a push-button that is pressed has
//! brackets, and the selected cell is reversed.

use plcc_screen::{cell_text, first_shown, fitted, style_of, word_rows};
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::{Modifier, Style};
use ratatui::text::Line;
use ratatui::widgets::Paragraph;

use crate::terminal::app::App;
use crate::view::{Panel, PanelCell, PanelsView};

/// The narrowest cell; a panel with more columns than have room is folded.
const MIN_WIDTH: usize = 12;

pub(super) fn draw(app: &mut App, view: &PanelsView, frame: &mut Frame<'_>, area: Rect) {
    let count = view.panels.len();
    let Some(panel) = view.panels.get(app.panel % count.max(1)) else {
        frame.render_widget(Paragraph::new("the program uses no panels"), area);
        return;
    };
    let number = app.panel % count + 1;
    let moment = view.moment.as_ref().map(|moment| format!(", values of {moment}"));
    let moment = moment.unwrap_or_default();
    let title = format!("{} ({number} of {count}; F5/w: the next one){moment}", panel.title);
    let width = usize::from(area.width);
    let columns = columns(panel, width);
    app.selected = app.selected.min(panel.cells.len().saturating_sub(1));
    app.columns = columns;
    let mut lines =
        vec![Line::styled(fitted(&title, width), Style::new().add_modifier(Modifier::BOLD))];
    let note = panel.note.as_deref().map_or_else(Vec::new, |note| word_rows(note, width));
    let room = usize::from(area.height).saturating_sub(1 + note.len()).max(1);
    let rows: Vec<&[PanelCell]> = panel.cells.chunks(columns).collect();
    let first = first_shown(app.selected / columns, rows.len(), room);
    for (row, cells) in rows.iter().enumerate().skip(first).take(room) {
        let cell_width = (width / columns).max(1);
        let spans: Vec<_> = cells
            .iter()
            .enumerate()
            .map(|(column, cell)| {
                let text = fitted(&cell_text(cell), cell_width.saturating_sub(1));
                let style = style_of(cell, row * columns + column == app.selected);
                [ratatui::text::Span::styled(text, style), ratatui::text::Span::raw(" ")]
            })
            .collect();
        lines.push(Line::from(spans.into_iter().flatten().collect::<Vec<_>>()));
    }
    lines.extend(note.into_iter().map(Line::raw));
    frame.render_widget(Paragraph::new(lines), area);
}

/// How many cells of a panel stand side by side: as many as the panel has columns, or as have room.
fn columns(panel: &Panel, width: usize) -> usize {
    panel.columns.clamp(1, (width / MIN_WIDTH).max(1))
}
