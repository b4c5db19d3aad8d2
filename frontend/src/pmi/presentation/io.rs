//! Inputs and outputs, with the lines of their ports.

use plcc_abi::pmi::{Format, Lines, PmiTables};

use crate::presentation::IoPoint;

/// The inputs and outputs that the program declares.
pub(super) fn points(tables: &PmiTables) -> Vec<IoPoint> {
    let point = |name: &str, lines: Lines, output: bool| {
        let Lines { port, low, count, format } = lines;
        let bits = low..low.saturating_add(count);
        let place = match count {
            1 => format!("{port}/{low}"),
            _ => format!("{port}/{low}-{}", bits.end.saturating_sub(1)),
        };
        IoPoint {
            name: name.into(),
            place,
            output,
            bit: format == Format::Bit,
            lines: bits.map(|bit| format!("PORT{port}.{bit}")).collect(),
        }
    };
    let symbols = tables.symbols.iter();
    symbols
        .filter_map(|symbol| match (symbol.role.input(), symbol.role.output()) {
            (Some(lines), _) => Some(point(&symbol.name, lines, false)),
            (_, Some(lines)) => Some(point(&symbol.name, lines, true)),
            _ => None,
        })
        .collect()
}
