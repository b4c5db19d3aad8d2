//! The executive of NCT: the 20 ms slice with its modules (NCT 1.2, 1.3), the registers and
//! timers, the messages, and the statements that call the runtime: HF, PF, MR, MW, ADD, SUB, MUL, DIV
//! and CMP.

mod arithmetic_area;
mod events;
mod flag_row;
mod forces;
mod host;
mod image;
mod latch;
mod memory;
mod modules;
mod names;
mod operand;
mod outputs;
mod search;
mod state;
mod tick;
mod time;
mod transfer;
mod validate;
mod variables;

#[cfg(test)]
mod tests;

use std::sync::Arc;

use plcc_abi::nct::layout::region;
use plcc_abi::{Program, Tables};

use crate::announced::Announced;
use crate::control::Control;
use crate::names::Names;
use crate::online_change::Comparison;

pub use tick::{NctExecutive, NctLoadError, NctOptions};

impl Control for plcc_abi::nct::NctTables {
    fn validate(&self, program: &Program) -> Result<(), String> {
        validate::tables(self, program)
    }

    fn names(&self, program: &Program) -> Arc<dyn Names> {
        let boards = tick::boards(&self.settings);
        Arc::new(names::NctNames::new(program, Arc::new(self.clone()), boards))
    }

    fn compare(&self, old: &Program, new: &Program) -> Option<Result<Comparison, String>> {
        let Tables::Nct(is) = &new.tables else { return None };
        Some(Ok(transfer::compare(old, self, new, is)))
    }

    fn announces(&self) -> bool {
        true
    }

    fn announced(&self, program: &Program, image: &[u8]) -> Vec<Announced> {
        let rh = program.region(region::RH).map_or(0, |region| region.offset);
        events::Messages::new(self, image.len()).on(image, rh)
    }
}
