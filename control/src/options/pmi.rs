//! The options that only a PMI control has, and its executive made from them.

use std::time::Duration;

use clap::Args;
use plcc_abi::Program;
use plcc_abi::time::period;
use serde::{Deserialize, Serialize};

use super::{Choices, ControlArgs, ControlOptions};
use plcc_runtime::Executive;
use plcc_runtime::pmi::{PmiExecutive, PmiOptions};

/// The options of a PMI control.
#[derive(Args, Clone, Debug, Default, Serialize, Deserialize)]
pub struct PmiArgs {
    /// PMI: time between two scans in milliseconds, or with its unit, as in 20ms [default: 20]
    #[arg(long, value_name = "MS", value_parser = period)]
    pub period: Option<Duration>,
}

/// The PMI control, as one of the controls.
pub(super) struct Pmi;

impl ControlOptions for Pmi {
    fn first_given(&self, args: &ControlArgs) -> Option<&'static str> {
        args.pmi.period.is_some().then_some("--period")
    }

    fn takes_machine_file(&self) -> bool {
        false
    }

    fn executive(
        &self,
        program: &Program,
        choices: &Choices<'_>,
    ) -> Result<Box<dyn Executive + Send>, String> {
        let standard = PmiOptions::default();
        let period = choices.args.pmi.period.map(|period| period.as_nanos() as u64);
        let options = PmiOptions { period_ns: period.unwrap_or(standard.period_ns) };
        let executive = PmiExecutive::new(program, options);
        Ok(Box::new(executive.map_err(|error| error.to_string())?))
    }
}
