//! The executive of PMI: the scan with its latched inputs, timers, flip-flops, faults and
//! messages, and what survives power-off (PMI 3.1; rulings, Scan).

mod announce;
mod lines;
mod load;
mod macros;
mod names;
#[cfg(feature = "args")]
mod options;
mod scan;
mod validate;

#[cfg(test)]
mod tests;

use crate::artifact::ArtifactError;
use crate::artifact::validate::Image;
#[cfg(feature = "args")]
use crate::control::Choices;
use crate::control::Control;

pub use load::PmiLoadError;
#[cfg(feature = "args")]
pub use options::PmiArgs;
pub use scan::{PmiExecutive, PmiOptions};

impl Control for plcc_abi::pmi::PmiTables {
    fn validate(&self, image_size: u32) -> Result<(), ArtifactError> {
        validate::tables(self, Image::new(image_size))
    }

    #[cfg(feature = "args")]
    fn executive(
        &self,
        program: &plcc_abi::Program,
        choices: &Choices<'_>,
    ) -> Result<Box<dyn crate::Executive>, String> {
        options::executive(program, choices)
    }
}
