//! The operator's screen: faults and messages in large letters, overrides, keys and lamps. Arrows choose a key, Enter or a
//! space presses or releases it.

use plcc_protocol::{Active, EventKind, OperatorView, PanelCell};
use ratatui::Frame;
use ratatui::crossterm::event::KeyCode;
use ratatui::layout::Rect;
use ratatui::style::{Color, Modifier, Style};
use ratatui::text::{Line, Span};
use ratatui::widgets::Paragraph;

use crate::{cell_text, first_shown, fitted, style_of, word_rows};

/// What the keys do, for the last row of the screen.
pub const KEYS: &str = "arrows: choose a key  Enter: press or release it  q: leave";

/// The cells that a key takes at least.
const KEY_WIDTH: usize = 20;

/// Which key of an operator's screen is chosen.
#[derive(Clone, Copy, Debug, Default)]
pub struct Operator {
    selected: usize,
    /// How many keys stood side by side when the screen was drawn last.
    columns: usize,
}

/// What a key of the keyboard asks for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Asked {
    /// Nothing more.
    Nothing,
    /// To leave the screen.
    Leave,
    /// To set the variable of a key.
    Press {
        /// The variable.
        name: String,
        /// 1 to press, 0 to release.
        value: String,
    },
    /// To press what can't be pressed; why not.
    Refused(&'static str),
}

impl Operator {
    /// Takes a key of the keyboard.
    pub fn key(&mut self, view: &OperatorView, code: KeyCode) -> Asked {
        let columns = self.columns.max(1) as isize;
        let by = match code {
            KeyCode::Char('q') | KeyCode::F(10) => return Asked::Leave,
            KeyCode::Enter | KeyCode::Char(' ') => return self.press(view),
            KeyCode::Left => -1,
            KeyCode::Right => 1,
            KeyCode::Up => -columns,
            KeyCode::Down => columns,
            _ => return Asked::Nothing,
        };
        let last = view.keys.len().saturating_sub(1);
        self.selected = self.selected.saturating_add_signed(by).min(last);
        Asked::Nothing
    }

    fn press(self, view: &OperatorView) -> Asked {
        let Some(key) = view.keys.get(self.selected) else { return Asked::Nothing };
        match key.press() {
            Some((name, value)) => Asked::Press { name, value },
            None => Asked::Refused("this is a lamp, which can't be pressed"),
        }
    }

    /// Draws the screen.
    pub fn draw(&mut self, view: &OperatorView, frame: &mut Frame<'_>, area: Rect) {
        let (width, height) = (usize::from(area.width), usize::from(area.height));
        let strong = Style::new().add_modifier(Modifier::BOLD);
        let mut lines = all_announced(&view.active, width, height / 2);
        if view.active.is_empty() {
            lines.push(Line::styled("no fault and no message", strong));
            lines.push(Line::raw(""));
        }
        if !view.overrides.is_empty() {
            let overrides = view.overrides.iter();
            let overrides: Vec<String> = overrides
                .map(|cell| format!("{} {}", cell.label, cell.value.as_deref().unwrap_or("-")))
                .collect();
            lines.push(Line::styled(overrides.join("   "), strong));
            lines.push(Line::raw(""));
        }
        if view.keys.is_empty() {
            lines.push(Line::raw("the program uses no key and no lamp of the control's panels"));
        }
        let room = height.saturating_sub(lines.len());
        lines.extend(self.keys(&view.keys, width, room));
        frame.render_widget(Paragraph::new(lines), area);
    }

    /// The keys in rows, of which as many as have `room` are shown, the chosen one among them.
    fn keys(&mut self, keys: &[PanelCell], width: usize, room: usize) -> Vec<Line<'static>> {
        self.columns = (width / KEY_WIDTH).max(1);
        self.selected = self.selected.min(keys.len().saturating_sub(1));
        let cell_width = (width / self.columns).max(2);
        let rows: Vec<&[PanelCell]> = keys.chunks(self.columns).collect();
        // A row is left free after each, where there is room for it.
        let apart = if rows.len() * 2 <= room + 1 { 2 } else { 1 };
        let first = first_shown(self.selected / self.columns, rows.len(), room.div_ceil(apart));
        let mut lines = vec![];
        for (row, cells) in rows.iter().enumerate().skip(first) {
            let spans = cells.iter().enumerate().flat_map(|(column, cell)| {
                let is_selected = row * self.columns + column == self.selected;
                let text = fitted(&cell_text(cell), cell_width - 1);
                [Span::styled(text, style_of(cell, is_selected)), Span::raw(" ")]
            });
            lines.push(Line::from(spans.collect::<Vec<_>>()));
            lines.extend((1..apart).map(|_| Line::raw("")));
        }
        lines.truncate(room);
        lines
    }
}

/// What is announced, in at most `height` lines; what has no room is counted.
fn all_announced(active: &[Active], width: usize, height: usize) -> Vec<Line<'static>> {
    let mut lines: Vec<Line<'static>> = vec![];
    for (number, one) in active.iter().enumerate() {
        let color = if one.kind == EventKind::Fault { Color::Red } else { Color::Yellow };
        let next = bar(&one.text, color, width);
        if number > 0 && lines.len() + next.len() > height {
            let more = active.len() - number;
            let strong = Style::new().add_modifier(Modifier::BOLD);
            lines.push(Line::styled(format!("and {more} more"), strong));
            lines.push(Line::raw(""));
            break;
        }
        lines.extend(next);
    }
    lines
}

/// A bar with a text in capitals that stand apart, where the width is enough for that, and a free row after it.
pub fn bar(text: &str, color: Color, width: usize) -> Vec<Line<'static>> {
    let style = Style::new().fg(Color::Black).bg(color).add_modifier(Modifier::BOLD);
    let apart: Vec<String> = text.to_uppercase().chars().map(String::from).collect();
    let apart = apart.join(" ");
    let text = if apart.chars().count() + 4 <= width { apart } else { text.to_owned() };
    let rows = word_rows(&text, width.saturating_sub(4));
    let row = |text: &str| Line::styled(fitted(&format!("  {text}"), width), style);
    let text = rows.iter().map(|text| row(text));
    [row("")].into_iter().chain(text).chain([row(""), Line::raw("")]).collect()
}

#[cfg(test)]
mod tests {
    use ratatui::Terminal;
    use ratatui::backend::TestBackend;

    use super::*;

    fn drawn(operator: &mut Operator, view: &OperatorView) -> String {
        let mut terminal = Terminal::new(TestBackend::new(60, 14)).unwrap();
        terminal.draw(|frame| operator.draw(view, frame, frame.area())).unwrap();
        terminal.backend().to_string()
    }

    fn key(number: usize) -> PanelCell {
        PanelCell {
            label: format!("key {number}"),
            pressed: Some(false),
            variable: Some(format!("K{number}")),
            ..PanelCell::default()
        }
    }

    #[test]
    fn the_chosen_key_is_in_sight_and_messages_leave_room_for_keys() {
        let message = |number: usize| Active {
            kind: EventKind::Fault,
            name: format!("F{number}"),
            text: format!("fault {number}"),
            since: None,
        };
        let view = OperatorView {
            active: (0..5).map(message).collect(),
            keys: (0..40).map(key).collect(),
            ..OperatorView::default()
        };
        let mut operator = Operator::default();
        let text = drawn(&mut operator, &view);
        assert!(text.contains("F A U L T   0") && text.contains("and 4 more"), "{text}");
        assert!(text.contains("key 0") && !text.contains("key 39"), "{text}");
        for _ in 0..20 {
            assert_eq!(operator.key(&view, KeyCode::Down), Asked::Nothing);
        }
        assert!(drawn(&mut operator, &view).contains("key 39"));
        let press = operator.key(&view, KeyCode::Enter);
        assert_eq!(press, Asked::Press { name: "K39".into(), value: "1".into() });
        assert_eq!(operator.key(&view, KeyCode::Char('q')), Asked::Leave);
    }

    #[test]
    fn a_lamp_is_not_pressed() {
        let lamp = PanelCell { label: "lamp".into(), light: Some(true), ..PanelCell::default() };
        let view = OperatorView { keys: vec![lamp], ..OperatorView::default() };
        let mut operator = Operator::default();
        assert!(matches!(operator.key(&view, KeyCode::Enter), Asked::Refused(_)));
        let nothing = OperatorView::default();
        assert_eq!(operator.key(&nothing, KeyCode::Enter), Asked::Nothing);
        assert!(drawn(&mut operator, &nothing).contains("uses no key"));
    }
}
