//! The names of a program and those of its simulator: `KEY.` and `SIM.`.

use std::sync::Arc;

use plcc_abi::{DialectVariable, SimulatorVariable, closest};
use plcc_simulator::{Equipment, Simulator};

use super::bits::Bits;
use crate::given_names::GivenNames;
use crate::names::{Class, Names, Press, Properties};
use crate::safe_outputs::{SafeLines, SafeOutputs};
use crate::variable::{NameError, Purpose, Setting, ValueError, VariableKey};

/// How many ticks a key is pressed by the value `press`.
const PRESS_TICKS: u64 = 5;
/// The same for a PMAC, whose ticks are short, in nanoseconds.
const PRESS_NS: u64 = 100_000_000;

/// All names of a run with a simulator.
#[derive(Debug)]
pub(super) struct SimulatedNames {
    program: Arc<dyn Names>,
    keys: Vec<String>,
    devices: Vec<String>,
    press_ticks: u64,
    /// What the simulator writes, with its bits where they are known.
    written: Vec<(VariableKey, Option<Bits>)>,
    equipment: Equipment,
}

/// The part of a name behind a prefix, in letters of any case.
fn behind<'n>(name: &'n str, prefix: &str) -> Option<&'n str> {
    let name = name.trim();
    let begins = name.get(..prefix.len()).is_some_and(|head| head.eq_ignore_ascii_case(prefix));
    name.get(prefix.len()..).filter(|_| begins)
}

fn key(variable: SimulatorVariable) -> VariableKey {
    VariableKey(DialectVariable::Simulator(variable))
}

fn own(key: VariableKey) -> Option<SimulatorVariable> {
    let DialectVariable::Simulator(variable) = key.0 else { return None };
    Some(variable)
}

impl SimulatedNames {
    pub(super) fn new(
        program: Arc<dyn Names>,
        keys: Vec<String>,
        devices: Vec<String>,
        simulator: &Simulator,
        written: Vec<(VariableKey, Option<Bits>)>,
        equipment: Equipment,
    ) -> Self {
        let press_ticks = match simulator.dialect() {
            plcc_abi::Dialect::Pmac => PRESS_NS.div_ceil(simulator.tick_ns().max(1)),
            _ => PRESS_TICKS,
        };
        // The motors of a PMAC are simulated by its executive, small machines and keys beside it.
        let Equipment { axes, programs, paths, .. } = program.equipment();
        let mut equipment = equipment;
        equipment.axes.extend(axes);
        equipment.programs.extend(programs);
        equipment.paths.extend(paths);
        Self { program, keys, devices, press_ticks, written, equipment }
    }

    fn find_in(name: &str, rest: &str, known: &[String], prefix: &str) -> Result<u32, NameError> {
        let wanted: Vec<&str> = rest.split_whitespace().collect();
        let wanted = wanted.join(" ").to_ascii_uppercase();
        let found = known.iter().position(|known| *known == wanted);
        found.map(|number| number as u32).ok_or_else(|| {
            let near = closest(&wanted, known.iter().map(String::as_str));
            let near = match near {
                Some(near) => format!("; did you mean {prefix}{near}?"),
                None => listed(&wanted, known),
            };
            let what = if prefix == "KEY." { "a key of this control" } else { "a device" };
            NameError::Unfit {
                name: name.into(),
                reason: format!("is not the name of {what}{near}"),
            }
        })
    }
}

/// What there is in the place of a name that is near nothing: some of the names, of small machines those that can be jammed.
fn listed(wanted: &str, known: &[String]) -> String {
    const MOST: usize = 12;
    const JAM: &str = "JAM ";
    let is_jam = wanted.starts_with(JAM);
    let fits = |name: &&String| name.starts_with(JAM) == is_jam;
    let names: Vec<&str> = known.iter().filter(fits).map(String::as_str).collect();
    let first = names.iter().take(MOST).copied().collect::<Vec<_>>().join(", ");
    match names.len().saturating_sub(MOST) {
        _ if names.is_empty() => "; the table [simulator] has no small machines".into(),
        0 => format!("; there are {first}"),
        more => format!("; there are {first} and {more} more"),
    }
}

impl Names for SimulatedNames {
    fn find(&self, name: &str, purpose: Purpose) -> Result<VariableKey, NameError> {
        if let Some(rest) = behind(name, "KEY.") {
            if purpose == Purpose::Watch {
                let reason = "is a key; watch the variable that it sets".into();
                return Err(NameError::Unfit { name: name.into(), reason });
            }
            let found = Self::find_in(name, rest, &self.keys, "KEY.")?;
            return Ok(key(SimulatorVariable::Key(found)));
        }
        if let Some(rest) = behind(name, "SIM.") {
            if purpose == Purpose::Stimulus {
                let reason = "shows the simulator, and can't be set".into();
                return Err(NameError::Unfit { name: name.into(), reason });
            }
            if rest.trim().eq_ignore_ascii_case("LINE") {
                return Ok(key(SimulatorVariable::Line));
            }
            let found = Self::find_in(name, rest, &self.devices, "SIM.")?;
            return Ok(key(SimulatorVariable::Device(found)));
        }
        self.program.find(name, purpose)
    }

    fn given(&self) -> &GivenNames {
        self.program.given()
    }

    fn canonical(&self, key: VariableKey) -> String {
        let named = |prefix: &str, list: &[String], number: u32| {
            list.get(number as usize).map_or_else(String::new, |name| format!("{prefix}{name}"))
        };
        match own(key) {
            None => self.program.canonical(key),
            Some(SimulatorVariable::Line) => "SIM.LINE".into(),
            Some(SimulatorVariable::Device(number)) => named("SIM.", &self.devices, number),
            Some(SimulatorVariable::Key(number)) => named("KEY.", &self.keys, number),
        }
    }

    fn properties(&self, key: VariableKey) -> Properties {
        match own(key) {
            None => self.program.properties(key),
            Some(_) => Properties::internal(Class::Integer, None),
        }
    }

    fn element(&self, key: VariableKey, index: u32) -> Option<VariableKey> {
        self.program.element(key, index)
    }

    fn parse(&self, key: VariableKey, text: &str) -> Result<Setting, ValueError> {
        if own(key).is_none() {
            return self.program.parse(key, text);
        }
        let number = text.trim().parse().ok().filter(|number| (0..=999).contains(number));
        number.map(Setting::Int).ok_or_else(|| ValueError {
            value: text.into(),
            reason: "is not 1, 0 or `press`".into(),
        })
    }

    fn declared(&self) -> Vec<(String, VariableKey)> {
        self.program.declared()
    }

    fn patterns(&self) -> Vec<(String, VariableKey)> {
        self.program.patterns()
    }

    fn equipment(&self) -> Equipment {
        self.equipment.clone()
    }

    fn outputs(&self) -> Vec<(String, VariableKey)> {
        self.program.outputs()
    }

    fn shown_in_image(&self) -> Vec<VariableKey> {
        self.program.shown_in_image()
    }

    fn safe_lines(&self, outputs: &SafeOutputs) -> Result<SafeLines, Vec<NameError>> {
        self.program.safe_lines(outputs)
    }

    fn share_forced_bits(&self, a: VariableKey, b: VariableKey) -> bool {
        self.program.share_forced_bits(a, b)
    }

    fn is_simulated(&self, key: VariableKey) -> bool {
        let bits = Bits::of(key, &*self.program);
        self.program.is_simulated(key)
            || self.written.iter().any(|(written, own)| {
                *written == key || own.zip(bits).is_some_and(|(own, bits)| own.overlap(bits))
            })
    }

    fn has_keys(&self) -> bool {
        true
    }

    fn press(&self, key: VariableKey) -> Option<Press> {
        match own(key) {
            Some(SimulatorVariable::Key(_)) => Some(Press { ticks: self.press_ticks }),
            _ => None,
        }
    }
}
