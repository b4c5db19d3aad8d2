//! The list of terminals: a row for each line, from the old terminal to the new point, to print and to tick off.

use std::collections::HashMap;
use std::fmt::Write as _;

use plcc_abi::printable;
use plcc_frontend::presentation::Exchange;
use plcc_host::configuration::Point;

use super::gather::Gathered;

/// The columns, as the head of the list has them.
const COLUMNS: [&str; 11] = [
    "side",
    "name",
    "alias",
    "line",
    "old place",
    "description",
    "device",
    "terminal",
    "drawing",
    "new point",
    "checked",
];

/// The cells of a row, without the last one.
pub(super) type Row = [String; COLUMNS.len() - 1];

/// The rows: those of wires in the order of ports and bits, then what the control gives and takes.
pub(super) fn rows(gathered: &Gathered, points: &HashMap<String, Point>) -> Vec<Row> {
    let mut rows = vec![];
    for wire in &gathered.wires {
        let side = if wire.is_input { "input" } else { "output" };
        let said = &wire.said;
        let text = if said.text.is_empty() { wire.meaning.clone() } else { None };
        let text = text.unwrap_or_else(|| said.text.clone());
        for line in &wire.lines {
            let point = super::point(points, line, &wire.name);
            rows.push([
                side.to_owned(),
                wire.name.clone(),
                said.alias.clone(),
                line.clone(),
                wire.place.clone(),
                text.clone(),
                said.device.clone(),
                said.at.clone(),
                said.drawing.clone(),
                point.map(Point::to_string).unwrap_or_default(),
            ]);
        }
    }
    for one in &gathered.exchanged {
        let side = match one.exchange {
            Exchange::Machine => "from the control",
            Exchange::Program => "to the control",
            Exchange::Both => "both",
        };
        let cells = [side, &one.name, &one.said.alias, "", "", &one.description()];
        let mut row = Row::default();
        row.iter_mut().zip(cells).for_each(|(to, cell)| cell.clone_into(to));
        rows.push(row);
    }
    rows
}

/// As CSV; the last column is empty, to be filled in.
pub(super) fn csv(rows: &[Row]) -> String {
    let mut text = format!("{}\n", COLUMNS.join(","));
    for row in rows {
        let cells = row.iter().map(|cell| {
            let cell = printable(cell);
            match cell.contains([',', '"', '\n']) {
                true => format!("\"{}\"", cell.replace('"', "\"\"")),
                false => cell.into_owned(),
            }
        });
        let _ = writeln!(text, "{},", cells.collect::<Vec<_>>().join(","));
    }
    text
}

/// Escapes what means something in HTML.
fn escaped(text: &str) -> String {
    let text = printable(text).replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
    text.replace('"', "&quot;")
}

/// As a page to print, with a box to tick in each row of a wire.
pub(super) fn html(title: &str, rows: &[Row]) -> String {
    let title = escaped(title);
    let mut text = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<title>Terminals of {title}</title>\n\
         <style>\nbody {{ font: 10pt sans-serif; }}\ntable {{ border-collapse: collapse; width: 100%; margin-bottom: 2em; }}\n\
         th, td {{ border: 1px solid #888; padding: 2px 5px; text-align: left; vertical-align: top; }}\n\
         thead {{ display: table-header-group; }}\ntr {{ break-inside: avoid; }}\n\
         @page {{ size: landscape; margin: 12mm; }}\n</style>\n</head>\n<body>\n<h1>Terminals of {title}</h1>\n"
    );
    let is_wire = |row: &&Row| row.first().is_some_and(|side| side == "input" || side == "output");
    let (wires, others): (Vec<&Row>, Vec<&Row>) = rows.iter().partition(is_wire);
    for (heading, rows, has_box) in
        [("Wires", wires, true), ("What the control gives and takes", others, false)]
    {
        if rows.is_empty() {
            continue;
        }
        let columns: &[usize] =
            if has_box { &[0, 1, 2, 3, 4, 5, 6, 7, 8, 9] } else { &[0, 1, 2, 5] };
        let head = columns.iter().filter_map(|&at| COLUMNS.get(at));
        let head: String = head.map(|title| format!("<th>{title}</th>")).collect();
        let tick = if has_box { "<th>checked</th>" } else { "" };
        let _ = write!(
            text,
            "<h2>{heading}</h2>\n<table>\n<thead><tr>{head}{tick}</tr></thead>\n<tbody>\n"
        );
        for row in rows {
            let cells = columns.iter().filter_map(|&at| row.get(at));
            let cells: String = cells.map(|cell| format!("<td>{}</td>", escaped(cell))).collect();
            let tick = if has_box { "<td>\u{2610}</td>" } else { "" };
            let _ = writeln!(text, "<tr>{cells}{tick}</tr>");
        }
        text.push_str("</tbody>\n</table>\n");
    }
    text.push_str("<p>Date and signature: ______________________________</p>\n</body>\n</html>\n");
    text
}
