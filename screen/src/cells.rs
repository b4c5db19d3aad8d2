//! Keys, lamps and values of panels.

use plcc_protocol::PanelCell;
use ratatui::style::{Modifier, Style};

/// How a cell is drawn: bold where its lamp is on or its key pressed, reversed where it is selected.
pub fn style_of(cell: &PanelCell, is_selected: bool) -> Style {
    let mut style = Style::new();
    if cell.light == Some(true) || cell.pressed == Some(true) {
        style = style.add_modifier(Modifier::BOLD);
    }
    if cell.dim {
        style = style.add_modifier(Modifier::DIM);
    }
    if is_selected {
        style = style.add_modifier(Modifier::REVERSED);
    }
    style
}

/// A cell in one line: a lamp is `*` or `.`, a key that is pressed has brackets.
pub fn cell_text(cell: &PanelCell) -> String {
    let lamp = match cell.light {
        Some(true) => "* ",
        Some(false) => ". ",
        None => "",
    };
    let label = match cell.pressed {
        Some(true) => format!("[{}]", cell.label),
        _ => cell.label.clone(),
    };
    match &cell.value {
        Some(value) if label.is_empty() => format!("{lamp}{value}"),
        Some(value) => format!("{lamp}{label} {value}"),
        None => format!("{lamp}{label}"),
    }
}
