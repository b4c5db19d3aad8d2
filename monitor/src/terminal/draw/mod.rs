//! Draws a view with characters. What colours say, underlines, marks or words say too.

mod lists;
mod machine;
mod panels;
mod said;
mod scope;
mod statements;

use plcc_screen::{fitted, word_rows};
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, Clear, Paragraph, Wrap};

use super::app::{App, PAGES, Page};
use super::keys;
use crate::view::{Body, ForcedValue, Status, View};

/// How many rows the keys of a page may take, so that a narrow screen has room for the page.
const MAX_KEY_ROWS: usize = 3;
/// The line of the time while the past is shown.
const PAST: Style = Style::new().fg(Color::Black).bg(Color::Yellow).add_modifier(Modifier::BOLD);
/// How many rows a message may take.
const MAX_MESSAGE_ROWS: usize = 3;

pub(super) fn draw(app: &mut App, view: &View, frame: &mut Frame<'_>) {
    let width = frame.area().width;
    let forces: Vec<String> = view.status.forces.iter().map(ForcedValue::line).collect();
    let forces = (!forces.is_empty()).then(|| format!("forced: {}", forces.join(", ")));
    let note = view.status.note.clone().or(forces);
    let message_rows = message_lines(app, note.as_deref(), width);
    let bar_rows = bar_lines(app, width);
    let rows = Layout::vertical([
        Constraint::Length(1),
        Constraint::Length(1),
        Constraint::Min(1),
        Constraint::Length(message_rows.len() as u16),
        Constraint::Length(bar_rows.len() as u16),
    ]);
    let [head, time, body, message, bar] = rows.areas(frame.area());
    frame.render_widget(Paragraph::new(head_line(app, &view.status, head.width)), head);
    frame.render_widget(Paragraph::new(time_line(&view.status, time.width)), time);
    app.height = usize::from(body.height);
    match (&view.body, app.page) {
        (_, Page::Help) => {
            let lines: Vec<Line<'_>> = keys::HELP.iter().map(|line| Line::raw(*line)).collect();
            frame.render_widget(Paragraph::new(lines), body);
        }
        (Body::Statements(view), _) => statements::draw(view, frame, body),
        (Body::Scope(view), _) => scope::draw(view, frame, body),
        (Body::Machine(view), _) => machine::draw(app, view, frame, body),
        (Body::Panels(view), _) => panels::draw(app, view, frame, body),
        (Body::Operator(view), _) => app.operator.draw(view, frame, body),
        (Body::Status { reason }, _) => {
            let text = reason.clone().unwrap_or_default();
            frame.render_widget(Paragraph::new(text).wrap(Wrap { trim: true }), body);
        }
        (other, _) => lists::draw(app, other, frame, body),
    }
    frame.render_widget(Paragraph::new(message_rows), message);
    frame.render_widget(Paragraph::new(bar_rows), bar);
    if let Some((warning, _)) = &app.warning {
        draw_warning(warning, frame);
    }
}

/// What is shown, its state, and the forces.
fn head_line(app: &App, status: &Status, width: u16) -> Line<'static> {
    let name = std::path::Path::new(&status.program).file_name();
    let program = name.map_or_else(|| status.name.clone(), |name| name.to_string_lossy().into());
    let mut left = format!("{program} ({}) {}", status.dialect.to_uppercase(), status.state);
    if let Some(reason) = &status.reason {
        left.push_str(&format!(": {reason}"));
    }
    let forces = match status.forces.len() {
        0 => String::new(),
        1 => "! 1 OVERRIDE !".to_owned(),
        count => format!("! {count} OVERRIDES !"),
    };
    // The indicator of PMI 3.1.6, which flashes where the terminal can.
    let announced = match status.announced {
        0 => String::new(),
        1 => "! 1 FAULT/MESSAGE !".to_owned(),
        count => format!("! {count} FAULTS/MESSAGES !"),
    };
    let title = PAGES.iter().find(|(page, _)| *page == app.page).map_or("", |(_, title)| title);
    let gap_between = if announced.is_empty() || forces.is_empty() { "" } else { " " };
    let right = format!("{announced}{gap_between}{forces} {title}");
    let room = usize::from(width).saturating_sub(right.chars().count() + 1);
    let left: String = left.chars().take(room).collect();
    let gap =
        " ".repeat(usize::from(width).saturating_sub(left.chars().count() + right.chars().count()));
    let style = Style::new().add_modifier(Modifier::BOLD);
    Line::from(vec![
        Span::styled(left, style),
        Span::raw(gap),
        Span::styled(announced, style.add_modifier(Modifier::REVERSED | Modifier::SLOW_BLINK)),
        Span::raw(gap_between),
        Span::styled(forces, style.fg(Color::Red).add_modifier(Modifier::REVERSED)),
        Span::raw(format!(" {title}")),
    ])
}

/// The tick that is shown, and where it lies among those that are known.
fn time_line(status: &Status, width: u16) -> Line<'static> {
    let mark = if status.following { "newest" } else { "stays" };
    let time = status.time.as_ref().map(|time| format!("{time} ")).unwrap_or_default();
    let mut text = format!("tick {} {:.3} s {time}{mark} ", status.tick, status.seconds);
    if status.past {
        text.insert_str(0, "PAST ");
    }
    if let Some(ticks) = status.control_ticks {
        text.push_str(&format!("(control {ticks}) "));
    }
    let ends = format!("{} {}", status.first_tick, status.last_tick);
    let room = usize::from(width).saturating_sub(text.chars().count() + ends.len() + 4);
    if room >= 5 {
        let span = status.last_tick.saturating_sub(status.first_tick).max(1);
        let at = status.tick.saturating_sub(status.first_tick).min(span);
        let at = (at as f64 / span as f64 * (room - 1) as f64).round() as usize;
        let slider: String = (0..room).map(|cell| if cell == at { '#' } else { '-' }).collect();
        text.push_str(&format!("{} [{slider}] {}", status.first_tick, status.last_tick));
    }
    match status.past {
        true => Line::styled(fitted(&text, usize::from(width)), PAST),
        false => Line::raw(text),
    }
}

/// What is being typed, or the last message, in as many rows as it needs up to [`MAX_MESSAGE_ROWS`]. Of a longer text that is
/// being typed the end is seen.
fn message_lines(app: &App, note: Option<&str>, width: u16) -> Vec<Line<'static>> {
    let width = usize::from(width);
    let (text, style) = match (&app.prompt, &app.message) {
        (Some(prompt), _) => {
            let text: Vec<char> = format!("{}: {}_", prompt.title, prompt.text).chars().collect();
            let rows: Vec<String> =
                text.chunks(width.max(1)).map(|row| row.iter().collect()).collect();
            let first = rows.len().saturating_sub(MAX_MESSAGE_ROWS);
            return rows.into_iter().skip(first).map(Line::raw).collect();
        }
        (None, Some((text, true))) => {
            (format!("! {text}"), Style::new().add_modifier(Modifier::BOLD))
        }
        (None, Some((text, false))) => (text.clone(), Style::new()),
        (None, None) => (note.unwrap_or_default().to_owned(), Style::new()),
    };
    let mut rows = word_rows(&text, width);
    if rows.len() > MAX_MESSAGE_ROWS {
        rows.truncate(MAX_MESSAGE_ROWS);
        if let Some(last) = rows.last_mut() {
            *last = fitted(&format!("{} …", last.trim_end()), width);
        }
    }
    rows.into_iter().map(|row| Line::styled(row, style)).collect()
}

/// How many rows a screen of this width has besides those of the page itself.
pub(super) fn rows_around(app: &App, width: u16) -> usize {
    2 + message_lines(app, None, width).len() + bar_lines(app, width).len()
}

/// The keys of the page, in as many rows as they need, and the pages.
fn bar_lines(app: &App, width: u16) -> Vec<Line<'static>> {
    if app.page == Page::Operator {
        return vec![Line::raw(plcc_screen::KEYS)];
    }
    let width = usize::from(width);
    let mut rows = vec![String::new()];
    let keys = keys::keys(app.page, app.chooses_statements).iter().map(|key| match key.function {
        0 => format!("{} {}", key.letter, key.label),
        number => format!("F{number}/{} {}", key.letter, key.label),
    });
    // In the terminal of a PMAC letters and digits are typed.
    let leaves = (app.page == Page::Terminal).then(|| keys::LEAVE_TERMINAL.to_owned());
    for piece in keys.chain(leaves) {
        match rows.last_mut() {
            Some(row) if row.is_empty() => row.push_str(&piece),
            Some(row) if row.chars().count() + 2 + piece.chars().count() <= width => {
                row.push_str("  ");
                row.push_str(&piece);
            }
            _ => rows.push(piece),
        }
    }
    rows.truncate(MAX_KEY_ROWS);
    let bold = Style::new().add_modifier(Modifier::BOLD);
    let mut lines: Vec<Line<'static>> =
        rows.into_iter().map(|row| Line::styled(row, bold)).collect();
    let pages = app.pages().map(|(number, (page, title))| {
        let style = match page == app.page {
            true => Style::new().add_modifier(Modifier::REVERSED),
            false => Style::new(),
        };
        Span::styled(format!("{} {title}", number % 10), style)
    });
    // A second row where one does not have room for all.
    let mut row = Line::default();
    for page in pages.chain([Span::raw("?:help")]) {
        if row.width() + page.width() > width {
            lines.push(std::mem::take(&mut row));
        }
        row.push_span(page);
        row.push_span(Span::raw(" "));
    }
    lines.push(row);
    lines
}

fn draw_warning(warning: &str, frame: &mut Frame<'_>) {
    let area = frame.area();
    let width = area.width.saturating_sub(8).min(70);
    let height = 12.min(area.height);
    let x = (area.width - width) / 2;
    let y = (area.height - height) / 2;
    let place = Rect { x, y, width, height };
    let text = format!("{warning}\n\ny: do it    any other key: leave everything as it is");
    let block = Block::bordered().title(" WARNING ");
    frame.render_widget(Clear, place);
    frame.render_widget(Paragraph::new(text).wrap(Wrap { trim: true }).block(block), place);
}
