//! What a PMI program drives beside its outputs: operator panels, touch windows, machine status and the production
//! display (PMI 3.4).

use plcc_abi::number;
use plcc_abi::pmi::PmiTables;

use crate::presentation::{Cell, PanelDraft, Shown};

pub(super) fn panels(tables: &PmiTables) -> Vec<PanelDraft> {
    let elements = |name: &str| {
        let symbol = tables.symbols.iter().find(|symbol| symbol.name == name);
        symbol.and_then(|symbol| symbol.elements).unwrap_or(0)
    };
    let mut panels = vec![
        operator_panel(),
        square_panel(1),
        square_panel(2),
        touch_window("Operator touch window", 'O', "W1AT"),
        touch_window("Extended operator window", 'M', "EXTOP"),
        machine_status(elements("@STTXT")),
        production(elements("@POSRG")),
    ];
    let codes = tables.symbols.iter().filter(|symbol| {
        let digits = symbol.name.strip_prefix("@M").or_else(|| symbol.name.strip_prefix("@G"));
        digits
            .is_some_and(|digits| !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit()))
    });
    panels.push(PanelDraft {
        title: "Pending M and G codes".into(),
        columns: 4,
        cells: codes
            .map(|symbol| Cell::light(symbol.name.trim_start_matches('@'), symbol.name.clone()))
            .collect(),
        note: None,
    });
    panels.retain(|panel| !panel.cells.is_empty());
    panels
}

/// Five rows of three push-buttons, and one that is centred: "Upper left @CP100, upper right @CP102, bottom centered
/// @CP115".
fn operator_panel() -> PanelDraft {
    let button = |at: u32| {
        Cell::button(format!("@CP1{at:02}"), format!("@CP1{at:02}"), Some(format!("@CL1{at:02}")))
    };
    let mut cells: Vec<Cell> = (0..15).map(button).collect();
    cells.extend([Cell::gap(), button(15)]);
    PanelDraft { title: "Operator panel".into(), columns: 3, cells, note: None }
}

/// A 4 x 4 panel.
fn square_panel(panel: u32) -> PanelDraft {
    let button = |at: u32| {
        let name = format!("@4P{panel}{at:02}");
        Cell::button(name.clone(), name, Some(format!("@4L{panel}{at:02}")))
    };
    PanelDraft {
        title: format!("4 x 4 panel {panel}"),
        columns: 4,
        cells: (0..16).map(button).collect(),
        note: None,
    }
}

/// A touch window of twelve buttons, of the variables with this letter, and a variable that says more of it.
fn touch_window(title: &str, letter: char, more: &str) -> PanelDraft {
    let button = |at: u32| Cell {
        label: format!("@{letter}TX{at:02}"),
        shown: Shown::Key(format!("@{letter}TX{at:02}")),
        light: Some(format!("@{letter}LT{at:02}")),
        button: Some(format!("@{letter}PB{at:02}")),
        ..Cell::default()
    };
    let mut cells: Vec<Cell> = (0..12).map(button).collect();
    cells.push(Cell::number(format!("@{more}"), format!("@{more}")));
    let attributes = (0..12).map(|at| format!("@{letter}AT{at:02}"));
    cells.extend(attributes.map(|name| Cell::number(name.clone(), name)));
    PanelDraft {
        title: title.into(),
        columns: 4,
        cells,
        note: Some("buttons with a text of the program; below, the display attributes".into()),
    }
}

/// How a value of `mach stat` is shown, by its conversion (@STCNV). How many counts an inch has is set in the control's
/// parameters, so counts are shown as counts.
fn status_value(value: f64, conversion: f64) -> String {
    match (conversion as i64, value as i64) {
        (2, flag) => (if flag == 0 { "OFF" } else { "ON" }).into(),
        (10, flag) => (if flag == 0 { "metric" } else { "inch" }).into(),
        (1, value) => format!("{value:4}"),
        (28, value) => format!("{value:8}"),
        (7 | 24, counts) => format!("{counts} counts"),
        _ => number(value),
    }
}

fn machine_status(rows: u32) -> PanelDraft {
    let cells = (0..rows).flat_map(|row| {
        let element = |array: &str| format!("@{array}[{row}]");
        let text = Cell {
            label: format!("text {row}"),
            shown: Shown::Key(element("STTXT")),
            ..Cell::default()
        };
        let value = Cell {
            label: format!("value {row}"),
            shown: Shown::FormattedBy(element("STVAR"), element("STCNV"), status_value),
            ..Cell::default()
        };
        [text, value.editable(), Cell::light("not while a program runs", element("STSEM"))]
    });
    PanelDraft { title: "mach stat".into(), columns: 3, cells: cells.collect(), note: None }
}

fn mode(value: f64) -> String {
    match value as i64 {
        0 => "manual",
        1 => "single block",
        2 => "automatic",
        _ => return number(value),
    }
    .into()
}

fn production(axes: u32) -> PanelDraft {
    let percent = |label: &str, unused: &str| Cell {
        unused: Some(unused.into()),
        ..Cell::number(format!("{label} %"), label)
    };
    let mut cells = vec![
        Cell::formatted("mode", "@MODE", mode),
        Cell::light("cycle", "@CYCIP"),
        Cell::light("feedhold", "@FHOLD"),
        Cell::light("emergency stop", "@ESTOP"),
        percent("@FRO", "@NOFRO"),
        percent("@SSO", "@NOSSO"),
        Cell::number("speed", "@SCODE"),
        Cell::number("measured", "@SSRPM"),
        Cell::number("tool", "@TOOL"),
        Cell::number("next tool", "@NTOOL"),
        Cell::light("TOOL CHANGE", "@TCLIT"),
        Cell::gap(),
    ];
    for axis in 0..axes {
        cells.push(Cell::number(format!("position {axis}"), format!("@POSRG[{axis}]")));
        cells.push(Cell::number(format!("commanded {axis}"), format!("@CMDRG[{axis}]")));
        cells.push(Cell::light(format!("not homed {axis}"), format!("@NHOME[{axis}]")));
        cells.push(Cell::gap());
    }
    PanelDraft { title: "Production".into(), columns: 4, cells, note: None }
}
