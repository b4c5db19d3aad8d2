//! `plcc dev`: commands with the options of the optimiser, for those who work on plcc itself.

use super::{bench, build, run};
use crate::args::DevCommand;
use crate::failure::Failure;
use crate::report::Report;

pub(crate) fn dev(command: DevCommand, report: &Report) -> Result<u8, Failure> {
    match command {
        DevCommand::Build { time_passes, passes, args } => {
            if time_passes {
                build::time_passes(&args, &passes, report)?;
            }
            build::build(&args, &passes, report)
        }
        DevCommand::Run { passes, args } => run::run(&args, &passes, report),
        DevCommand::Bench { passes, args } => bench::bench(&args, &passes, report),
    }
}
