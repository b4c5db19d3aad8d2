//! Statements with power flow: values above their variables (PMI 5.1), or at the right (NCT 5, PMAC).

use plcc_screen::{fitted, word_rows};
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::{Modifier, Style};
use ratatui::text::{Line, Span};
use ratatui::widgets::Paragraph;

use crate::view::{Execution, Role, StatementLayout, StatementLine, StatementsView, Token};

/// Cells in front of a statement: the cursor, the mark of what was not executed, the line number.
const MARGIN: usize = 8;

/// How many rows the tick and the tasks that are shown may take: a PMAC has a row's worth of PLCs.
const MAX_FOOT_ROWS: usize = 2;

pub(super) fn draw(view: &StatementsView, frame: &mut Frame<'_>, area: Rect) {
    let width = usize::from(area.width);
    let shown = if view.chosen { "chosen statements" } else { "program" };
    let mut foot = word_rows(&format!("line {}  {shown}  {}", view.last_number, view.scan), width);
    foot.truncate(MAX_FOOT_ROWS);
    let height = usize::from(area.height).saturating_sub(foot.len());
    let mut lines: Vec<Line<'static>> = vec![];
    // Statements of two rows need more room than the view has counted on: the cursor stays in sight.
    let mut cursor_end = 0;
    for (at, line) in view.lines.iter().enumerate() {
        let is_cursor = view.first + at == view.cursor;
        let mut rows = match view.layout {
            StatementLayout::ValuesAbove => above(line, is_cursor, width, view.values),
            StatementLayout::ValuesRight => right(line, is_cursor, width, view.values),
        };
        if let Some(last) = rows.last_mut() {
            add_comment(last, &line.comment, width);
        }
        lines.extend(rows);
        if is_cursor {
            cursor_end = lines.len();
        }
    }
    lines.drain(..cursor_end.saturating_sub(height).min(lines.len()));
    lines.truncate(height);
    if view.total == 0 {
        lines.push(Line::raw("no statement is shown: F1 directory, F4 name, F8 the whole program"));
    }
    lines.resize(height, Line::raw(""));
    let reversed = Style::new().add_modifier(Modifier::REVERSED);
    lines.extend(foot.into_iter().map(|row| Line::styled(fitted(&row, width), reversed)));
    frame.render_widget(Paragraph::new(lines), area);
}

/// The comment of the source after the last row of a statement, as far as there is room for a few words.
fn add_comment(row: &mut Line<'static>, comment: &str, width: usize) {
    /// How many cells have to be free.
    const LEAST: usize = 12;
    let room = width.saturating_sub(row.width() + 2);
    if comment.is_empty() || room < LEAST {
        return;
    }
    let text = fitted(comment, room.min(comment.chars().count()));
    let style = Style::new().add_modifier(Modifier::DIM | Modifier::ITALIC);
    row.push_span(Span::styled(format!("  {text}"), style));
}

fn style(line: &StatementLine) -> Style {
    match line.execution {
        Execution::NotExecuted => Style::new().add_modifier(Modifier::DIM),
        Execution::Executed | Execution::NoStatement => Style::new(),
    }
}

fn margin(line: &StatementLine, is_cursor: bool) -> String {
    let cursor = if is_cursor { '>' } else { ' ' };
    let mark = if line.execution == Execution::NotExecuted { '.' } else { ' ' };
    format!("{cursor}{:>5}{mark} ", line.number)
}

fn token_style(token: &Token, style: Style) -> Style {
    match (token.truth, token.role) {
        (Some(true), _) => style.add_modifier(Modifier::UNDERLINED | Modifier::BOLD),
        (_, Role::Keyword | Role::Label) => style.add_modifier(Modifier::BOLD),
        _ => style,
    }
}

/// A statement with the values of its numbers in a row above, wrapped where it is too long.
fn above(line: &StatementLine, is_cursor: bool, width: usize, values: bool) -> Vec<Line<'static>> {
    let style = style(line);
    let mut rows: Vec<Line<'static>> = vec![];
    let mut upper = String::new();
    let mut lower: Vec<Span<'static>> = vec![];
    let mut used = 0;
    let room = width.saturating_sub(MARGIN).max(10);
    let mut head = margin(line, is_cursor);
    let mut end_row = |upper: &mut String, lower: &mut Vec<Span<'static>>| {
        if !upper.trim().is_empty() {
            let text = format!("{}{}", " ".repeat(MARGIN), upper.trim_end());
            rows.push(Line::styled(text, style));
        }
        let mut spans = vec![Span::styled(std::mem::replace(&mut head, " ".repeat(MARGIN)), style)];
        spans.append(lower);
        rows.push(Line::from(spans));
        upper.clear();
    };
    for token in &line.tokens {
        let value = token.value.as_deref().filter(|_| values).unwrap_or("");
        let (text, long) = (token.text.chars().count(), value.chars().count());
        let cells = text.max(long);
        // Two values do not touch.
        let gap = usize::from(long > 0 && upper.ends_with(|c: char| c != ' '));
        if used + gap + cells > room && used > 0 {
            end_row(&mut upper, &mut lower);
            used = 0;
        } else if gap > 0 {
            upper.push(' ');
            lower.push(Span::raw(" "));
            used += 1;
        }
        upper.push_str(&fitted(value, cells));
        lower.push(Span::styled(token.text.clone(), token_style(token, style)));
        lower.push(Span::raw(" ".repeat(cells - text)));
        used += cells;
    }
    end_row(&mut upper, &mut lower);
    rows
}

/// A statement with the values of its variables at the right. What is too long is continued in further rows; without
/// values the text has the whole width.
fn right(line: &StatementLine, is_cursor: bool, width: usize, values: bool) -> Vec<Line<'static>> {
    let style = style(line);
    let room = width.saturating_sub(MARGIN);
    let values = if values { value_texts(line) } else { vec![] };
    let left = if values.is_empty() { room } else { room * 11 / 20 };
    let mut texts = token_rows(line, style, left).into_iter();
    let mut values = wrapped(&values, room.saturating_sub(left + 1)).into_iter();
    let mut head = margin(line, is_cursor);
    let mut rows = vec![];
    loop {
        let (text, value) = (texts.next(), values.next());
        if text.is_none() && value.is_none() && !rows.is_empty() {
            return rows;
        }
        let (text, used) = text.unwrap_or_default();
        let mut spans = vec![Span::styled(std::mem::replace(&mut head, " ".repeat(MARGIN)), style)];
        spans.extend(text);
        if let Some(value) = value {
            spans.push(Span::raw(" ".repeat(left.saturating_sub(used) + 1)));
            spans.push(Span::styled(value, style));
        }
        rows.push(Line::from(spans));
    }
}

/// The tokens of a statement in rows of at most `room` cells, each row with the number of cells that it takes. A token that
/// is longer than a row is divided.
fn token_rows(line: &StatementLine, style: Style, room: usize) -> Vec<(Vec<Span<'static>>, usize)> {
    let room = room.max(1);
    let mut rows: Vec<(Vec<Span<'static>>, usize)> = vec![(vec![], 0)];
    for token in &line.tokens {
        let text: Vec<char> = token.text.chars().collect();
        let is_full = |row: &(Vec<Span<'static>>, usize)| row.1 > 0 && row.1 + text.len() > room;
        if rows.last().is_some_and(is_full) {
            rows.push((vec![], 0));
        }
        for part in text.chunks(room) {
            if rows.last().is_some_and(|row| row.1 + part.len() > room) {
                rows.push((vec![], 0));
            }
            if let Some((spans, used)) = rows.last_mut() {
                spans
                    .push(Span::styled(part.iter().collect::<String>(), token_style(token, style)));
                *used += part.len();
            }
        }
    }
    rows
}

/// What stands at the right of a statement: where tasks wait, how often it was executed, and its values.
fn value_texts(line: &StatementLine) -> Vec<String> {
    let mut texts: Vec<String> = line.waits.iter().map(|task| format!("<{task} waits>")).collect();
    if line.times > 1 {
        texts.push(format!("{}x", line.times));
    }
    texts.extend(line.values.iter().map(|one| match one.written {
        true => format!("{}:={}", one.name, one.value),
        false => format!("{}={}", one.name, one.value),
    }));
    texts
}

/// Texts with blanks between them, in rows of at most `room` cells. A text that is longer than a row is cut.
fn wrapped(texts: &[String], room: usize) -> Vec<String> {
    let mut rows: Vec<String> = vec![];
    for text in texts {
        let count = text.chars().count();
        match rows.last_mut() {
            Some(row) if row.chars().count() + 1 + count <= room => {
                row.push(' ');
                row.push_str(text);
            }
            _ if count > room => rows.push(fitted(text, room)),
            _ => rows.push(text.clone()),
        }
    }
    rows
}
