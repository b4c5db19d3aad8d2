//! The scope: two rows for each variable, its name with values, and its course.

use plcc_screen::fitted;
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::{Modifier, Style};
use ratatui::text::Line;
use ratatui::widgets::Paragraph;

use crate::view::{Channel, ScopeState, ScopeView};

/// Rising heights of a cell.
const HEIGHTS: [char; 8] = ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];

pub(super) fn draw(view: &ScopeView, frame: &mut Frame<'_>, area: Rect) {
    let width = usize::from(area.width);
    let strong = Style::new().add_modifier(Modifier::BOLD);
    let state = match view.state {
        ScopeState::Rolling if view.tick < view.to => "around the tick that is shown",
        ScopeState::Rolling => "newest ticks",
        ScopeState::Waiting => "waits for the trigger",
        ScopeState::Triggered => "triggered",
        ScopeState::Held => "held",
    };
    let mut head = format!("ticks {} to {}, {state}", view.from, view.to);
    if let Some(trigger) = &view.trigger {
        head.push_str(&format!(", trigger {}", trigger.expression));
    }
    if let Some(tick) = view.trigger_tick {
        head.push_str(&format!(" at {tick}"));
    }
    if let Some(difference) = view.difference {
        head.push_str(&format!(", B-A {difference} s"));
    }
    let mut lines = vec![Line::styled(fitted(&head, width), strong)];
    if let Some(note) = &view.note {
        lines.push(Line::raw(note.clone()));
    }
    if view.channels.is_empty() {
        lines.push(Line::raw("no variable is on the scope: F1, i or Insert adds some"));
    }
    for channel in &view.channels {
        lines.push(Line::styled(title(channel), strong));
        lines.push(Line::raw(course(channel, view, width.saturating_sub(1))));
    }
    lines.push(Line::raw(marks(view, width.saturating_sub(1))));
    lines.push(Line::raw(axis(view, width.saturating_sub(1))));
    frame.render_widget(Paragraph::new(lines), area);
}

fn title(channel: &Channel) -> String {
    let number = plcc_runtime::value::number;
    let mut text = match channel.logical {
        true => channel.name.clone(),
        false => format!("{}  {} to {}", channel.name, number(channel.low), number(channel.high)),
    };
    for (cursor, value) in ["A", "B"].into_iter().zip(channel.at_cursors) {
        if let Some(value) = value {
            text.push_str(&format!("  {cursor}={}", number(value)));
        }
    }
    text
}

/// The cell of a tick.
fn cell(tick: u64, view: &ScopeView, width: usize) -> usize {
    let span = (view.to - view.from + 1).max(1);
    (tick.saturating_sub(view.from) as f64 / span as f64 * width as f64) as usize
}

/// The course of a variable: its largest value in each cell. A cell in which it changes more than once has
/// no height of its own and is marked.
fn course(channel: &Channel, view: &ScopeView, width: usize) -> String {
    let mut cells: Vec<Option<(f64, f64)>> = vec![None; width];
    for sample in &channel.samples {
        if let Some(slot) = cells.get_mut(cell(sample.tick, view, width)) {
            let (low, high) = slot.unwrap_or((sample.low, sample.high));
            *slot = Some((low.min(sample.low), high.max(sample.high)));
        }
    }
    let span = channel.high - channel.low;
    let mut last = None;
    cells
        .into_iter()
        .map(|values| {
            last = values.or(last);
            let Some((low, high)) = last else { return ' ' };
            match channel.logical {
                true if low != high => '|',
                true if high != 0.0 => '▔',
                true => '▁',
                false => {
                    let part = if span > 0.0 { (high - channel.low) / span } else { 0.0 };
                    let index = (part * 7.0).round() as usize;
                    HEIGHTS.get(index).copied().unwrap_or('█')
                }
            }
        })
        .collect()
}

/// The row with the times: a stroke at each mark, and its time after it where there is room.
fn axis(view: &ScopeView, width: usize) -> String {
    let mut row = String::new();
    for mark in &view.axis {
        let at = cell(mark.tick, view, width);
        let used = row.chars().count();
        let text = format!("|{}", mark.text);
        if at >= used && at + text.chars().count() <= width {
            row.push_str(&" ".repeat(at - used));
            row.push_str(&text);
        }
    }
    row
}

/// The row with trigger, cursors, and the tick that is shown elsewhere.
fn marks(view: &ScopeView, width: usize) -> String {
    let mut cells = vec![' '; width];
    let marks = [
        (Some(view.tick), '^'),
        (view.trigger_tick, 'T'),
        (view.cursors[0], 'A'),
        (view.cursors[1], 'B'),
    ];
    for (tick, mark) in marks {
        let Some(tick) = tick.filter(|tick| (view.from..=view.to).contains(tick)) else { continue };
        if let Some(slot) = cells.get_mut(cell(tick, view, width)) {
            *slot = mark;
        }
    }
    cells.into_iter().collect()
}
