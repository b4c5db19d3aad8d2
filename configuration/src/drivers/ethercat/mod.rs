//! Terminals of an EtherCAT segment, which `plcio` drives by a network interface.

mod expected;
mod point;

use std::sync::Arc;

use toml::de::DeValue;

pub use expected::ExpectedTerminal;
pub use point::{EthercatPoint, ProcessValue};

use crate::{About, Address, Driver, Keys, Mistake, Point, ReadSettings, value};

pub(super) const DRIVERS: &[&dyn Driver] = &[&Ethercat];

#[derive(Debug)]
struct Ethercat;

impl Driver for Ethercat {
    fn name(&self) -> &'static str {
        "ethercat"
    }

    fn feature(&self) -> Option<&'static str> {
        Some("ethercat")
    }

    fn address(&self, text: &str) -> Result<Option<Arc<dyn Address>>, String> {
        Ok(Some(Arc::new(EthercatPoint::parse(text)?)))
    }

    fn lists_addresses(&self) -> bool {
        true
    }

    fn mistakes(&self, points: &[Point]) -> Vec<Mistake> {
        point::mistakes(points)
    }
}

/// The settings of the segment.
#[derive(Clone, Debug)]
pub struct Settings {
    /// The terminals that are expected behind the network interface; none if it does not matter.
    pub terminals: Vec<ExpectedTerminal>,
}

fn terminals(value: &DeValue<'_>) -> value::Result<Vec<ExpectedTerminal>> {
    let one = |value: &toml::Spanned<DeValue<'_>>| {
        value.get_ref().as_str().and_then(ExpectedTerminal::parse)
    };
    let all = value.as_array().and_then(|list| list.iter().map(one).collect());
    all.ok_or_else(|| {
        "a list of names or of \"VENDOR:PRODUCT\" is expected, as in [\"EK1100\", \"EL1008\"]"
            .into()
    })
}

impl ReadSettings for Settings {
    fn read(keys: &mut Keys<'_>, _: &About<'_>) -> Self {
        Self { terminals: keys.read("ethercat-terminals", terminals).unwrap_or_default() }
    }
}
