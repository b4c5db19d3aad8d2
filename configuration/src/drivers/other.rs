//! Another program that uses the image file itself, such as a component of LinuxCNC.

use std::sync::Arc;

pub use super::NoSettings as Settings;
use crate::{Address, Driver};

pub(super) const DRIVERS: &[&dyn Driver] = &[&Other];

/// Any such program. Its addresses may be anything.
#[derive(Debug)]
pub(super) struct Other;

impl Driver for Other {
    fn name(&self) -> &'static str {
        "other"
    }

    fn is_of_plcio(&self) -> bool {
        false
    }

    fn address(&self, _: &str) -> Result<Option<Arc<dyn Address>>, String> {
        Ok(None)
    }
}
