//! The executive of PMI: the scan with its latched inputs, timers, flip-flops, faults and
//! messages, and what survives power-off (PMI 3.1; rulings, Scan).

mod events;
mod forces;
mod macros;
#[cfg(feature = "args")]
mod options;
mod outputs;
mod port_lines;
mod retained;
mod state;
mod stops;
mod tick;
mod transfer;
mod validate;
mod variables;

#[cfg(test)]
mod tests;

#[cfg(feature = "args")]
use crate::control::Choices;
use crate::control::Control;

#[cfg(feature = "args")]
pub use options::PmiArgs;
pub use tick::{PmiExecutive, PmiLoadError, PmiOptions};
pub use transfer::PmiTransfer;
pub(crate) use transfer::compare;
pub(crate) use variables::PmiVariable;

impl Control for plcc_abi::pmi::PmiTables {
    fn validate(&self, program: &plcc_abi::Program) -> Result<(), String> {
        validate::tables(self, program)
    }

    #[cfg(feature = "args")]
    fn executive(
        &self,
        program: &plcc_abi::Program,
        choices: &Choices<'_>,
    ) -> Result<Box<dyn crate::Executive + Send>, String> {
        options::executive(program, choices)
    }
}
