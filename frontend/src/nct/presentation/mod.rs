//! What is shown of an NCT program: the names of its variables, and their classes.

mod classes;
mod io;
mod names;
mod panels;
mod text;

use plcc_abi::nct::NctName;
use plcc_diag::{FileId, SourceMap};

use super::{Program, access, tables};
use crate::common::Accessed;
use crate::presentation::{
    Announced, Exchange, IoPoint, PanelDraft, Part, Presentation, Read, Row, StatementPlaces, Uses,
};

pub(super) use classes::{CLASSES, title};

/// How many modules have a register OP.
const MODULES: u8 = 3;

impl Presentation for Program {
    fn name(&self, accessed: Accessed) -> Option<String> {
        let changes = || {
            access::changed_bit(accessed)?
                .to_string()
                .strip_prefix('I')
                .map(|bit| format!("V{bit}"))
        };
        access::name(accessed).map(|name| name.to_string()).or_else(changes)
    }

    fn accessed(&self, name: &str) -> Option<Accessed> {
        name.trim().parse().ok().map(access::accessed)
    }

    fn is_outside_image(&self, accessed: Accessed) -> bool {
        matches!(access::name(accessed), Some(NctName::Op(_)))
    }

    fn bit_names(&self, name: &str) -> Vec<String> {
        name.parse().map_or(vec![], names::bits)
    }

    fn further_names(&self) -> Vec<String> {
        (0..MODULES).map(|module| NctName::Op(module).to_string()).collect()
    }

    fn text(&self, sources: &SourceMap, places: &StatementPlaces) -> Vec<Row> {
        let file = self.checked.stmts.first().map_or(FileId(0), |first| first.span.file);
        let words = super::words::words(sources, file, &self.checked.stmts);
        text::text(sources, &words, places)
    }

    fn io_points(&self, _: &[String], _: &[u8]) -> Vec<IoPoint> {
        io::points(tables::named(&self.checked))
    }

    /// The texts of :198 belong to Y700 to Y707, those of :199 to Y710 and on (NCT 3.5, 3.6).
    fn announcements(&self) -> Vec<Announced> {
        let of = |texts: &[String], byte: usize| -> Vec<Announced> {
            let flags = texts.iter().enumerate().map(|(at, text)| Announced {
                is_fault: false,
                name: format!("Y{}{}", byte + at / 8, at % 8),
                text: text.trim().to_owned(),
            });
            flags.filter(|one| !one.text.is_empty()).collect()
        };
        [of(&self.checked.texts.indexed, 70), of(&self.checked.texts.messages, 71)].concat()
    }

    fn panels(&self, active: &[Announced], _: Read<'_>) -> Result<Vec<PanelDraft>, String> {
        let texts = &self.checked.texts;
        Ok(panels::panels(&self.settings, &texts.softkeys, &texts.info, active))
    }

    /// `V012` asks whether `I012` has changed.
    fn stands_for(&self, name: &str) -> String {
        name.strip_prefix('V').map_or_else(|| name.to_owned(), |rest| format!("I{rest}"))
    }

    /// `V012` comes of `I012`.
    fn parts(&self, name: &str, _: &[u8]) -> Vec<Part> {
        let of = name.strip_prefix('V').map(|bit| Part { name: format!("I{bit}"), holds: true });
        Vec::from_iter(of)
    }

    /// The timers T, H and M.
    fn counts_time(&self, name: &str, _: &[u8]) -> bool {
        matches!(name.parse(), Ok(NctName::T(_) | NctName::H(_) | NctName::M(_)))
    }

    fn is_handed_on(&self, accessed: Accessed) -> bool {
        access::is_handed_on(accessed)
    }

    /// Lines, flags to the NC, and the registers that the NC and the PLC exchange.
    fn place_of_lines(&self, lines: &[String], place: Option<&str>) -> String {
        let known = place.filter(|place| *place != "NC").map(str::to_owned);
        let line = lines.first().cloned().unwrap_or_default();
        let known = known.or_else(|| io::place_of_line(&line));
        known.map_or(line.clone(), |place| format!("{line}, {place}"))
    }

    fn exchange(&self, name: &str, uses: Uses) -> Option<Exchange> {
        uses.declared.or_else(|| match name.parse().ok()? {
            NctName::Y { .. } | NctName::O { .. } => Some(Exchange::Program),
            NctName::Rh(number) if number % 100 < 50 => Some(Exchange::Machine),
            NctName::Rh(_) => Some(Exchange::Program),
            _ => None,
        })
    }
}
