//! The options that only a PMAC has, and its executive made from them.

use clap::Args;
use plcc_abi::Program;
use serde::{Deserialize, Serialize};

use super::{Choices, ControlArgs, ControlOptions};
use plcc_runtime::Executive;
use plcc_runtime::pmac::{PmacExecutive, PmacOptions};

/// The options of a PMAC.
#[derive(Args, Clone, Debug, Default, Serialize, Deserialize)]
pub struct PmacArgs {
    /// PMAC: background steps in each servo cycle [default: 1]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(..=100_000))]
    pub background_steps: Option<u32>,
}

/// The PMAC, as one of the controls.
pub(super) struct Pmac;

impl ControlOptions for Pmac {
    fn first_given(&self, args: &ControlArgs) -> Option<&'static str> {
        args.pmac.background_steps.is_some().then_some("--background-steps")
    }

    fn takes_machine_file(&self) -> bool {
        false
    }

    fn executive(
        &self,
        program: &Program,
        choices: &Choices<'_>,
    ) -> Result<Box<dyn Executive + Send>, String> {
        let standard = PmacOptions::default();
        let background_steps = choices.args.pmac.background_steps;
        let options = PmacOptions {
            background_steps: background_steps.unwrap_or(standard.background_steps),
            realtime: choices.realtime,
        };
        let executive = PmacExecutive::new(program, options);
        Ok(Box::new(executive.ok_or("it is not for a PMAC")?))
    }
}
