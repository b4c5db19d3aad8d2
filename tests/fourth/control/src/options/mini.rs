//! The control of MINI, which has no options of its own.

use plcc_abi::Program;
use plcc_runtime::Executive;
use plcc_runtime::mini::MiniExecutive;

use super::{Choices, ControlArgs, ControlOptions};

/// The control, as one of the controls.
pub(super) struct Mini;

impl ControlOptions for Mini {
    fn first_given(&self, _: &ControlArgs) -> Option<&'static str> {
        None
    }

    fn takes_machine_file(&self) -> bool {
        false
    }

    fn executive(
        &self,
        program: &Program,
        _: &Choices<'_>,
    ) -> Result<Box<dyn Executive + Send>, String> {
        Ok(Box::new(MiniExecutive::new(program)?))
    }
}
