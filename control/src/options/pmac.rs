//! The options that only a PMAC has, and its executive made from them.

use clap::Args;
use plcc_abi::Program;
use plcc_abi::pmac::motion::Plant;
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

    /// The motors that are simulated, as the machine file describes them; `None` without `--simulate`.
    #[arg(skip)]
    pub motors: Option<Vec<Plant>>,
}

/// The PMAC, as one of the controls.
pub(super) struct Pmac;

impl ControlOptions for Pmac {
    fn first_given(&self, args: &ControlArgs) -> Option<&'static str> {
        args.pmac.background_steps.is_some().then_some("--background-steps")
    }

    /// The motors that are simulated.
    fn takes_machine_file(&self) -> bool {
        true
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
        let mut executive = PmacExecutive::new(program, options).ok_or("it is not for a PMAC")?;
        if let Some(motors) = &choices.args.pmac.motors {
            executive.simulate(motors)?;
        }
        Ok(Box::new(executive))
    }
}
