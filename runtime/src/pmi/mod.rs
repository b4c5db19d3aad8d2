//! The executive of PMI: the scan with its latched inputs, timers, flip-flops, faults and
//! messages, and what survives power-off (PMI 3.1; rulings, Scan).

mod events;
mod forces;
mod macros;
mod names;
mod outputs;
mod port_lines;
mod retained;
mod state;
mod stops;
mod tick;
mod transfer;
mod validate;

#[cfg(test)]
mod tests;

use std::sync::Arc;

use plcc_abi::{Program, Tables};

use crate::announced::Announced;
use crate::control::Control;
use crate::names::Names;
use crate::online_change::Comparison;

pub use tick::{PmiExecutive, PmiLoadError, PmiOptions};

impl Control for plcc_abi::pmi::PmiTables {
    fn validate(&self, program: &Program) -> Result<(), String> {
        validate::tables(self, program)
    }

    fn names(&self, _program: &Program) -> Arc<dyn Names> {
        Arc::new(names::PmiNames::new(self))
    }

    fn compare(&self, _old: &Program, new: &Program) -> Option<Result<Comparison, String>> {
        let Tables::Pmi(is) = &new.tables else { return None };
        Some(Ok(transfer::compare(self, is)))
    }

    fn announces(&self) -> bool {
        !(self.faults.is_empty() && self.messages.is_empty())
    }

    fn announced(&self, _program: &Program, image: &[u8]) -> Vec<Announced> {
        events::Announcements::new(&self.faults, &self.messages).on(image)
    }
}
