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
mod operand;
#[cfg(feature = "args")]
mod options;
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

#[cfg(feature = "args")]
use crate::control::Choices;
use crate::control::Control;

#[cfg(feature = "args")]
pub use options::NctArgs;
pub use tick::{NctExecutive, NctLoadError, NctOptions};
pub use transfer::NctTransfer;
pub(crate) use transfer::compare;

impl Control for plcc_abi::nct::NctTables {
    fn validate(&self, program: &plcc_abi::Program) -> Result<(), String> {
        validate::tables(self, program)
    }

    #[cfg(feature = "args")]
    fn executive(
        &self,
        program: &plcc_abi::Program,
        choices: &Choices<'_>,
    ) -> Result<Box<dyn crate::Executive + Send>, String> {
        options::executive(self, program, choices)
    }

    #[cfg(feature = "args")]
    fn takes_machine_file(&self) -> bool {
        true
    }
}
