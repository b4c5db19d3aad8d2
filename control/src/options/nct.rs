//! The options that only an NCT control has, and its executive made from them.

use clap::Args;
use plcc_abi::nct::NctControl;
use plcc_abi::{Program, Tables};
use serde::{Deserialize, Serialize};

use super::{Choices, ControlArgs, ControlOptions};
use plcc_runtime::Executive;
use plcc_runtime::nct::{NctExecutive, NctOptions};

/// The options of an NCT control.
#[derive(Args, Clone, Debug, Default, Serialize, Deserialize)]
pub struct NctArgs {
    /// NCT: sets an NC parameter, as in --param 61=24; 61 is MAGAZINE, 62 PLC_TAB (repeatable)
    #[arg(long, value_name = "N=VALUE", value_parser = parameter)]
    pub param: Vec<(u16, i64)>,

    /// NCT: sets the PLC constant RP001 to RP040, as in --const 39=24 for RP039 (repeatable)
    #[arg(long = "const", value_name = "N=VALUE", value_parser = constant)]
    pub constants: Vec<(u16, u16)>,

    /// NCT: sets a macro variable, as in --macro 180=12.5 (repeatable)
    #[arg(long = "macro", value_name = "N=VALUE", value_parser = macro_variable)]
    pub macros: Vec<(u16, f64)>,

    /// NCT: the type of the control, on which depends how often :002 runs: nct98, nct99, nct2000,
    /// nct990, nct100, nct115, nct101, nct104 [default: nct104, every millisecond]
    #[arg(long = "control", value_name = "TYPE", value_parser = control)]
    pub control: Option<NctControl>,

    /// NCT: how many backward jumps and calls :000 may do in a slice before it waits for the next
    /// one, in simulated time [default: 10000]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub level0_safepoints: Option<u32>,
}

/// The NCT control, as one of the controls.
pub(super) struct Nct;

impl ControlOptions for Nct {
    fn first_given(&self, args: &ControlArgs) -> Option<&'static str> {
        let NctArgs { param, constants, macros, control, level0_safepoints } = &args.nct;
        let given = [
            ("--param", !param.is_empty()),
            ("--const", !constants.is_empty()),
            ("--macro", !macros.is_empty()),
            ("--control", control.is_some()),
            ("--level0-safepoints", level0_safepoints.is_some()),
        ];
        given.iter().find(|(_, given)| *given).map(|(option, _)| *option)
    }

    fn takes_machine_file(&self) -> bool {
        true
    }

    fn executive(
        &self,
        program: &Program,
        choices: &Choices<'_>,
    ) -> Result<Box<dyn Executive + Send>, String> {
        let Tables::Nct(tables) = &program.tables else {
            return Err("it is not for an NCT control".into());
        };
        // A machine file of the run stands in place of the settings that the program was compiled with; options add to
        // either.
        let args = &choices.args.nct;
        let mut settings = choices.machine.map_or(&tables.settings, |machine| &machine.nct).clone();
        settings.parameters.extend(&args.param);
        settings.constants.extend(&args.constants);
        settings.macros.extend(&args.macros);
        settings.control = args.control.unwrap_or(settings.control);
        let level0_safepoints = args.level0_safepoints;
        let options = NctOptions { settings, level0_safepoints, realtime: choices.realtime };
        let executive = NctExecutive::new(program, options);
        Ok(Box::new(executive.map_err(|error| error.to_string())?))
    }
}

/// The parts of `N=VALUE`.
fn assignment(text: &str, low: u16, high: u16) -> Result<(u16, &str), String> {
    let (number, value) = text.split_once('=').ok_or("N=VALUE is expected, as in 61=24")?;
    let number = number.trim();
    let digits = number.bytes().all(|byte| byte.is_ascii_digit());
    let parsed = number.parse().ok().filter(|n| digits && (low..=high).contains(n));
    let parsed =
        parsed.ok_or_else(|| format!("`{number}` is not a number from {low} to {high}"))?;
    Ok((parsed, value.trim()))
}

fn integer(text: &str) -> Result<i64, String> {
    text.parse().map_err(|_| format!("`{text}` is not an integer"))
}

fn parameter(text: &str) -> Result<(u16, i64), String> {
    let (number, value) = assignment(text, 0, 9999)?;
    Ok((number, integer(value)?))
}

fn constant(text: &str) -> Result<(u16, u16), String> {
    let (number, value) = assignment(text, 1, 40)?;
    let value = integer(value)?;
    if !(-0x8000..=0xFFFF).contains(&value) {
        return Err(format!("{value} does not fit 16 bits"));
    }
    Ok((number, value as u16))
}

fn macro_variable(text: &str) -> Result<(u16, f64), String> {
    let (number, value) = assignment(text, 1, 9999)?;
    let parsed = value.parse().ok().filter(|value: &f64| value.is_finite());
    Ok((number, parsed.ok_or_else(|| format!("`{value}` is not a number"))?))
}

fn control(text: &str) -> Result<NctControl, String> {
    NctControl::from_name(text).ok_or_else(|| {
        let known: Vec<&str> = NctControl::ALL.iter().map(|control| control.name()).collect();
        format!("the types are {}", known.join(", "))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_outside_their_range_are_refused() {
        assert_eq!(parameter("61=24"), Ok((61, 24)));
        assert_eq!(constant("1=-1"), Ok((1, 0xFFFF)));
        assert_eq!(macro_variable("180=12.5"), Ok((180, 12.5)));
        for text in ["0=1", "41=1", "1=65536", "1", "=1", "+1=1", "1=x"] {
            assert!(constant(text).is_err(), "{text}");
        }
        assert!(macro_variable("1=inf").is_err());
        assert_eq!(control("NCT98"), Ok(NctControl::Nct98));
        assert!(control("nct1").is_err());
    }
}
