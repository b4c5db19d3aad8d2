//! The options of a run as a record holds them, and the executive that is made of them, for replaying.

use plcc_abi::Program;
use plcc_abi::machine::Machine;
use plcc_abi::nct::NctSettings;
use serde::{Deserialize, Serialize};

use super::SessionError;
use crate::args::RunArgs;
use crate::simulation::Simulation;
use plcc_control::{ControlArgs, executive};
use plcc_record::ReplaceableExecutive;
use plcc_record::RunHeader;
use plcc_runtime::Executive;
use plcc_runtime::safe_outputs::SafeOutput;
use plcc_simulator::Strictness;

/// The options on which depends what a tick does.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RunSettings {
    control: ControlArgs,
    realtime: bool,
    safe: Vec<SafeOutput>,
    /// What a machine file of the run said, where one was given.
    machine: Option<NctSettings>,
    /// What the simulator was made from, where there was one.
    simulation: Option<Simulation>,
}

impl RunSettings {
    /// The settings of a run.
    pub fn of(args: &RunArgs, machine: Option<&Machine>) -> Self {
        Self {
            control: args.control.clone(),
            realtime: args.realtime,
            safe: args.safe.clone(),
            machine: machine.map(|machine| machine.nct.clone()),
            simulation: args.simulation.as_deref().cloned(),
        }
    }

    /// As bytes for a record.
    pub fn to_bytes(&self) -> Vec<u8> {
        // Writing to memory does not fail.
        postcard::to_allocvec(self).unwrap_or_default()
    }
}

/// What the simulator of a recorded run was made from, where there was one.
pub fn recorded_simulation(header: &RunHeader) -> Option<Simulation> {
    postcard::from_bytes::<RunSettings>(&header.settings).ok()?.simulation
}

/// Makes the executive of a recorded program with the options of a recorded run, for a
/// [`Replayer`](plcc_record::Replayer).
///
/// # Errors
/// When the record was made by another version of plcc, or the program does not take the options.
pub fn recorded_executive(
    header: &RunHeader,
    program: &Program,
) -> Result<Box<dyn Executive + Send>, SessionError> {
    let settings: RunSettings = postcard::from_bytes(&header.settings).map_err(|_| {
        let text = "the options of the recorded run can't be read: another version of plcc has \
                    recorded it";
        SessionError(text.into())
    })?;
    let RunSettings { control, realtime, safe, machine, simulation } = settings;
    let machine = machine.map(|nct| Machine { nct, ..Machine::default() });
    let made = executive(program, &control, realtime, machine.as_ref())?;
    let made = match simulation {
        None => made,
        Some(simulation) => {
            let strictness = Strictness::SwitchOff;
            let made = simulation.beside(made, program, &control, machine.as_ref(), strictness);
            Box::new(made.map_err(|errors| SessionError(errors.join("; ")))?.executive)
        }
    };
    let mut executive = ReplaceableExecutive::new(made);
    let lines = executive.names().safe_lines(&safe).map_err(|errors| {
        let errors: Vec<String> = errors.iter().map(ToString::to_string).collect();
        SessionError(errors.join("; "))
    })?;
    executive.set_safe_lines(lines);
    Ok(Box::new(executive))
}
