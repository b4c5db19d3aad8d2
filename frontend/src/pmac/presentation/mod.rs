//! What is shown of a PMAC program: the names of its variables, and their classes.

mod classes;

use plcc_abi::pmac::PmacName;

use super::{Program, access};
use crate::common::Accessed;
use crate::presentation::Presentation;

pub(super) use classes::{CLASSES, title};

impl Presentation for Program {
    fn name(&self, accessed: Accessed) -> Option<String> {
        access::name(accessed).map(|name| name.to_string())
    }

    /// Statements enable and disable PLCs, but no observer is told that as a write.
    fn accessed(&self, name: &str) -> Option<Accessed> {
        let name = PmacName::parse(name, &self.loaded.layout).ok()?;
        (!matches!(name, PmacName::Plc { .. })).then(|| access::accessed(name))
    }

    fn is_outside_image(&self, accessed: Accessed) -> bool {
        access::is_memory(accessed)
    }
}
