//! The simulated motors of a PMAC (`--simulate`).

use plcc_abi::machine::Machine;
use plcc_abi::{Dialect, Program};

use plcc_control::ControlArgs;

/// The settings of a control whose motors are simulated, if `simulate` says so: those that the machine file
/// describes. Other controls than a PMAC have none.
pub fn with_motors(
    program: &Program,
    control: &ControlArgs,
    simulate: bool,
    machine: Option<&Machine>,
) -> ControlArgs {
    let mut control = control.clone();
    if simulate && program.dialect() == Dialect::Pmac {
        let motors = machine.map(|machine| machine.motors.clone()).unwrap_or_default();
        control.pmac.motors = Some(motors);
    }
    control
}
