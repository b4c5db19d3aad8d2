//! The simulator of a run (`--simulate`), and the check of its table where a run has one without it.

use std::sync::Arc;

use plcc_abi::Program;
use plcc_abi::machine::Machine;
use plcc_runtime::{Executive, Purpose};
use plcc_simulator::Strictness;

use super::{SessionError, with_motors};
use crate::args::RunArgs;
use crate::journal::Journal;
use crate::simulation::{Simulated, Simulation};

/// The options with what the simulator is made from, where something is simulated. Options that have it already are not read
/// again.
///
/// # Errors
/// When the part program can't be read.
pub fn with_simulation(
    program: &Program,
    args: &RunArgs,
    machine: Option<&Machine>,
) -> Result<RunArgs, SessionError> {
    let mut args = args.clone();
    args.control = with_motors(program, &args.control, args.simulate, machine);
    if args.simulate && args.simulation.is_none() {
        let machine = args.machine_path.as_deref().zip(machine);
        let read = Simulation::read(machine, args.part_program.as_deref());
        args.simulation = Some(Arc::new(read.map_err(SessionError)?));
    }
    Ok(args)
}

/// The executive of a run, with the simulator beside it where something is simulated. A table that nothing uses is checked all
/// the same.
///
/// # Errors
/// What is wrong with the options, the table or the part program.
pub(super) fn executive(
    program: &Program,
    args: &RunArgs,
    machine: Option<&Machine>,
    journal: &Journal,
) -> Result<Box<dyn Executive + Send>, SessionError> {
    let made = plcc_control::executive(program, &args.control, args.realtime, machine)?;
    if args.control.pmac.motors.is_some() {
        let left_out = plcc_runtime::pmac::not_simulated(program);
        left_out.into_iter().for_each(|what| journal.warn(what));
    }
    let strict = Strictness::Refuse;
    let failed = |errors: Vec<String>| SessionError(errors.join("\nerror: "));
    let Some(simulation) = &args.simulation else {
        if let Some(machine) = machine.filter(|machine| machine.simulator.is_some()) {
            let table = Simulation::table_alone(args.machine_path.as_deref(), machine);
            table.check_table(program, &args.control, Some(machine)).map_err(failed)?;
        }
        return Ok(made);
    };
    let made = simulation.beside(made, program, &args.control, machine, strict);
    let Simulated { executive, warnings, notes } = made.map_err(failed)?;
    warnings.into_iter().for_each(|warning| journal.warn(warning));
    notes.into_iter().for_each(|note| journal.note(note));
    // A simulated and a real machine never share an input.
    let names = executive.names();
    for (name, _) in &args.input_rules {
        if let Ok(key) = names.find(name, Purpose::Watch)
            && names.is_simulated(key)
        {
            let what = "is given by an entry [[io]], and the simulator writes it, too; remove one of the two";
            return Err(SessionError(format!("{name} {what}")));
        }
    }
    Ok(Box::new(executive))
}

/// The executive of a program in simulated time for those who run its ticks themselves, such as the debugger: with the simulator
/// beside it where `args` say so. Warnings and notes are not told.
///
/// # Errors
/// What is wrong with the options, the table or the part program.
pub fn simulated_executive(
    program: &Program,
    args: &RunArgs,
    machine: Option<&Machine>,
) -> Result<Box<dyn Executive + Send>, SessionError> {
    let args = with_simulation(program, args, machine)?;
    let made = plcc_control::executive(program, &args.control, false, machine)?;
    let Some(simulation) = &args.simulation else { return Ok(made) };
    let made = simulation.beside(made, program, &args.control, machine, Strictness::Refuse);
    let made = made.map_err(|errors| SessionError(errors.join("\nerror: ")))?;
    Ok(Box::new(made.executive))
}
