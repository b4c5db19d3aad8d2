//! The control for a program, set as the options say.

use plcc_abi::nct::NctSettings;
use plcc_abi::{Dialect, Program, Tables};

use crate::Executive;
use crate::args::ControlArgs;
use crate::nct::{NctExecutive, NctOptions};
use crate::pmac::{PmacExecutive, PmacOptions};
use crate::pmi::{PmiExecutive, PmiOptions};

use super::SessionError;

/// Makes the executive of a program's dialect.
///
/// # Errors
/// When an option is for another dialect, or the program's tables do not fit together.
pub fn executive(
    program: &Program,
    args: &ControlArgs,
    realtime: bool,
    machine: Option<&NctSettings>,
) -> Result<Box<dyn Executive>, SessionError> {
    check(args, program.dialect())?;
    let damaged = |error: String| SessionError(format!("the program can't be run: {error}"));
    match &program.tables {
        Tables::Pmi(_) => {
            let standard = PmiOptions::default();
            let period = args.period.map(|period| period.as_nanos() as u64);
            let options = PmiOptions { period_ns: period.unwrap_or(standard.period_ns) };
            let executive = PmiExecutive::new(program, options);
            Ok(Box::new(executive.map_err(|error| damaged(error.to_string()))?))
        }
        Tables::Nct(tables) => {
            let mut settings = machine.unwrap_or(&tables.settings).clone();
            settings.parameters.extend(&args.param);
            settings.constants.extend(&args.constants);
            settings.macros.extend(&args.macros);
            settings.control = args.control.unwrap_or(settings.control);
            let level0_safepoints = args.level0_safepoints;
            let options = NctOptions { settings, level0_safepoints, realtime };
            let executive = NctExecutive::new(program, options);
            Ok(Box::new(executive.map_err(|error| damaged(error.to_string()))?))
        }
        Tables::Pmac(_) => {
            let background_steps =
                args.background_steps.unwrap_or(PmacOptions::default().background_steps);
            let options = PmacOptions { background_steps, realtime };
            let executive = PmacExecutive::new(program, options);
            Ok(Box::new(executive.ok_or_else(|| damaged("it is for no PMAC".into()))?))
        }
    }
}

/// An option that means nothing to the dialect is a mistake, not a detail.
fn check(args: &ControlArgs, dialect: Dialect) -> Result<(), SessionError> {
    let ControlArgs {
        period,
        param,
        constants,
        macros,
        control,
        level0_safepoints,
        background_steps,
    } = args;
    let given = [
        ("--period", Dialect::Pmi, period.is_some()),
        ("--param", Dialect::Nct, !param.is_empty()),
        ("--const", Dialect::Nct, !constants.is_empty()),
        ("--macro", Dialect::Nct, !macros.is_empty()),
        ("--control", Dialect::Nct, control.is_some()),
        ("--level0-safepoints", Dialect::Nct, level0_safepoints.is_some()),
        ("--background-steps", Dialect::Pmac, background_steps.is_some()),
    ];
    let strange = given.iter().find(|(_, of, given)| *given && *of != dialect);
    strange.map_or(Ok(()), |(option, of, _)| {
        let (of, is) = (of.name(), dialect.name());
        Err(SessionError(format!("{option} is for {of} programs; this one is {is}")))
    })
}
