//! A switch that an axis presses.

use plcc_abi::Dialect;
use plcc_abi::machine::simulator::{Decimal, Located};

use super::{DeviceState, Line, Surroundings};
use crate::access::Access;
use crate::length::nanometres;
use crate::setup::Setup;

#[derive(Clone, Debug)]
pub(super) struct Switch {
    axis: usize,
    from: i128,
    to: i128,
    pub(super) input: Line,
}

impl Switch {
    pub(super) fn new(
        axis: &Located<String>,
        (from, to): (Decimal, Decimal),
        input: &Located<String>,
        setup: &Setup,
        access: &mut dyn Access,
    ) -> Result<Self, String> {
        let named = axis.value.trim().to_ascii_uppercase();
        let of_letter =
            |axis: &crate::setup::Axis| axis.name.is_some_and(|name| named.chars().eq([name]));
        let first = if setup.rules.dialect == Dialect::Nct { 1 } else { 0 };
        let by_number = named.parse::<usize>().ok().and_then(|number| number.checked_sub(first));
        let by_number = by_number.filter(|at| *at < setup.axes.len());
        let at = setup.axes.iter().position(of_letter).or(by_number);
        let is_pmac = setup.rules.dialect == Dialect::Pmac;
        let Some((at, unit)) =
            at.filter(|_| !is_pmac).and_then(|at| Some((at, setup.axes.get(at)?.unit)))
        else {
            let line = axis.line;
            let letters: Vec<String> =
                setup.axes.iter().filter_map(|axis| axis.name).map(String::from).collect();
            let (value, letters) = (&axis.value, letters.join(", "));
            return Err(format!(
                "line {line}: the simulator has no axis {value}; it has {letters}, and others by [[simulator.axis]]"
            ));
        };
        let (a, b) = (nanometres(from, unit), nanometres(to, unit));
        Ok(Self { axis: at, from: a.min(b), to: a.max(b), input: Line::input(access, input)? })
    }

    pub(super) fn step(
        &self,
        state: &mut DeviceState,
        around: &Surroundings<'_>,
        access: &mut dyn Access,
    ) {
        if !state.jammed {
            let at = around.positions.get(self.axis).copied().unwrap_or(0);
            state.at = (self.from..=self.to).contains(&at).into();
        }
        self.input.write(access, state.at != 0);
    }
}
