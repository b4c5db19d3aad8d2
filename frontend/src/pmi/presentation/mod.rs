//! What is shown of a PMI program: the names of its variables, and the classes of PMI 5.2.

mod announced;
mod classes;
mod io;
mod names;
mod panels;
mod parts;
mod text;
mod watch;

use plcc_abi::Tables;
use plcc_abi::pmi::{PmiName, PmiTables};
use plcc_diag::SourceMap;

use super::{Program, tables};
use crate::common::Accessed;
use crate::presentation::{
    Announced, Exchange, IoPoint, PanelDraft, Part, Presentation, Read, Row, StatementPlaces, Uses,
    WatchRow,
};
use names::Names;

pub(super) use classes::{CLASSES, titles};

/// What is made of a program when something of it is shown first.
#[derive(Clone, Debug)]
pub(super) struct Known {
    tables: PmiTables,
    names: Names,
}

impl Program {
    fn known(&self) -> &Known {
        self.known.get_or_init(|| {
            let program = tables::program(&self.checked, &self.layout, vec![], vec![]);
            // A program whose tables are broken is refused where it is lowered.
            let tables = match program.map(|program| program.tables) {
                Ok(Tables::Pmi(tables)) => tables,
                _ => PmiTables::default(),
            };
            Known { names: Names::new(&tables), tables }
        })
    }
}

impl Presentation for Program {
    fn name(&self, accessed: Accessed) -> Option<String> {
        self.known().names.name(accessed)
    }

    fn accessed(&self, name: &str) -> Option<Accessed> {
        self.known().names.accessed(name)
    }

    /// Of an array the name of all of it. Lines are told by no access.
    fn canonical(&self, name: &str) -> Option<String> {
        let own: PmiName = name.parse().ok()?;
        let is_known = matches!(own, PmiName::Line(..)) || self.accessed(name).is_some();
        is_known.then(|| own.to_string())
    }

    fn is_outside_image(&self, _: Accessed) -> bool {
        false
    }

    /// `TC#COUNT` is the counter of a timer; in an expression `#` would begin a comment.
    fn is_only_a_name(&self, text: &str) -> bool {
        text.contains('#')
    }

    fn text(&self, sources: &SourceMap, places: &StatementPlaces) -> Vec<Row> {
        let words = super::words::words(&self.checked, &self.text, sources);
        text::text(&self.known().tables, sources, &words, places)
    }

    /// An element of an array is written as the array.
    fn is_written_as(&self, accessed: &str, piece: &str) -> bool {
        let rest = accessed.strip_prefix(piece);
        rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('['))
    }

    fn watch_rows(&self, entry: &str) -> Result<Vec<WatchRow>, String> {
        watch::rows(&self.known().tables, entry)
    }

    fn is_in_source(&self, name: &str) -> bool {
        watch::is_in_source(&self.known().tables, name)
    }

    fn announces_by_image(&self) -> bool {
        true
    }

    fn announcements(&self) -> Vec<Announced> {
        announced::announcements(&self.known().tables)
    }

    fn announced(&self, image: &[u8]) -> Vec<Announced> {
        announced::announced(&self.known().tables, image)
    }

    fn io_points(&self, _: &[String], _: &[u8]) -> Vec<IoPoint> {
        io::points(&self.known().tables)
    }

    fn panels(&self, _: &[Announced], _: Read<'_>) -> Result<Vec<PanelDraft>, String> {
        Ok(panels::panels(&self.known().tables))
    }

    fn parts(&self, name: &str, image: &[u8]) -> Vec<Part> {
        parts::parts(&self.checked, &self.layout, name, image)
    }

    fn counts_time(&self, name: &str, _: &[u8]) -> bool {
        name.ends_with("#COUNT") || parts::is_delayed_contact(&self.checked, name)
    }

    /// Inputs and outputs, and the variables of the executive.
    /// `port 1 bits 0-3`.
    fn place_of_lines(&self, lines: &[String], _: Option<&str>) -> String {
        let line = |name: &String| match name.parse() {
            Ok(PmiName::Line(port, bit)) => Some((port, bit)),
            _ => None,
        };
        match (lines.first().and_then(line), lines.last().and_then(line)) {
            (Some((port, low)), Some((_, high))) if low == high => format!("port {port} bit {low}"),
            (Some((port, low)), Some((_, high))) => format!("port {port} bits {low}-{high}"),
            _ => String::new(),
        }
    }

    fn exchange(&self, name: &str, uses: Uses) -> Option<Exchange> {
        // The control itself sets @IPL in the first scan.
        let is_of_executive = name.starts_with('@') && name != "@IPL";
        uses.declared.or_else(|| is_of_executive.then(|| uses.exchange()))
    }
}
