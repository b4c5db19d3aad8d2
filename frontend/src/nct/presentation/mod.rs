//! What is shown of an NCT program: the names of its variables, and their classes.

mod classes;
mod names;
mod text;

use plcc_abi::nct::NctName;
use plcc_diag::SourceMap;

use super::{Program, access};
use crate::common::Accessed;
use crate::presentation::{Presentation, Row, StatementPlaces};

pub(super) use classes::{CLASSES, title};

/// How many modules have a register OP.
const MODULES: u8 = 3;

impl Presentation for Program {
    fn name(&self, accessed: Accessed) -> Option<String> {
        access::name(accessed).map(|name| name.to_string())
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
        text::text(sources, places)
    }
}
