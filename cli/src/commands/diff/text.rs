//! Differences for people: side by side on a wide terminal, else one below the other.

use std::fmt::Write as _;
use std::io::{IsTerminal, stdout};

use plcc_abi::printable;

use super::{Place, Row};
use crate::report::{Report, count_of};

/// The narrowest terminal on which two columns are of use.
const WIDE: usize = 100;

/// The differences, and a summary.
pub(super) fn text(rows: &[Row], report: &Report) -> String {
    let mut out = String::new();
    let width = std::env::var("COLUMNS").ok().and_then(|width| width.parse().ok()).unwrap_or(WIDE);
    let side_by_side = stdout().is_terminal() && width >= WIDE;
    for row in rows {
        if side_by_side {
            columns(&mut out, row, width);
        } else {
            lines(&mut out, row, report);
        }
        for (affected, role) in row.effects() {
            let via = match affected.via.as_slice() {
                [] => String::new(),
                via => format!(" by way of {}", via.join(", ")),
            };
            let name = printable(&affected.name).to_string();
            let _ = match *role {
                "control" => {
                    writeln!(out, "    {name}, which the control reads, depends on it{via}")
                }
                role => writeln!(out, "    {role} {name} depends on it{via}"),
            };
        }
        if row.effects().next().is_none() {
            let _ = writeln!(
                out,
                "    no output, message or command depends on it, and nothing that the control reads"
            );
        }
    }
    let _ = writeln!(out, "{}", summary(rows));
    out
}

/// One sentence about all of it.
fn summary(rows: &[Row]) -> String {
    if rows.is_empty() {
        return "both versions mean the same".into();
    }
    let mut names: Vec<&str> =
        rows.iter().flat_map(Row::effects).map(|(it, _)| it.name.as_str()).collect();
    names.sort_by(|a, b| plcc_abi::natural_cmp(a, b));
    names.dedup();
    let count = count_of(rows.len(), "statement");
    let verb = if rows.len() == 1 { "differs" } else { "differ" };
    match names.as_slice() {
        [] => format!("{count} {verb}; the machine does not notice it"),
        names => format!("{count} {verb}; what depends on them: {}", printable(&names.join(", "))),
    }
}

/// A statement in its old and its new form, one below the other.
fn lines(out: &mut String, row: &Row, report: &Report) {
    let _ = writeln!(out, "{}", row.change);
    let mut line = |sign: char, style: &str, place: &Option<Place>| {
        let Some(Place { file, line, text }) = place else { return };
        let text = format!("{sign} {}:{line}: {}", printable(file), printable(text));
        let _ = writeln!(out, "  {}", report.paint_result(&text, style));
    };
    line('-', "31", &row.old);
    line('+', "32", &row.new);
}

/// The same in two columns.
fn columns(out: &mut String, row: &Row, width: usize) {
    let half = width.saturating_sub(16) / 2;
    let cell = |place: &Option<Place>| -> Vec<String> {
        let Some(Place { line, text, .. }) = place else { return vec![String::new()] };
        let text = format!("{line}: {}", printable(text));
        let chars: Vec<char> = text.chars().collect();
        chars.chunks(half.max(20)).map(|chunk| chunk.iter().collect()).collect()
    };
    let (left, right) = (cell(&row.old), cell(&row.new));
    for at in 0..left.len().max(right.len()) {
        let head = if at == 0 { row.change } else { "" };
        let part = |cells: &[String]| cells.get(at).cloned().unwrap_or_default();
        let _ = writeln!(out, "{head:9} {:half$} │ {}", part(&left), part(&right));
    }
}
