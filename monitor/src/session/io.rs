//! Inputs and outputs with overrides (PMI 5.3).

use std::collections::BTreeMap;

use plcc_abi::place::Direction;
use plcc_frontend::presentation::IoPoint;
use plcc_protocol::Force;
use plcc_replay::forced_by;
use plcc_runtime::Purpose;
use plcc_runtime::value::number;

use super::Session;
use crate::view::{ForcedValue, IoRow, IoView, IoWindow};
use crate::{Refusal, Reply};

/// The warning that PMI 5.3 shows before the first override.
const WARNING: &str = "Overriding inputs and outputs can be dangerous for people and for the machine. \
Normally the program checks for dangerous conditions (limit switches, doors, interlocks). These checks \
are completely bypassed by an override. An override stays when the monitor ends, until it is cleared or \
the control is restarted.";

/// What is known of inputs and outputs.
#[derive(Debug, Default)]
pub(super) struct IoState {
    points: Option<Vec<IoPoint>>,
    confirmed: bool,
    last: BTreeMap<String, f64>,
}

impl IoState {
    /// Has the inputs and outputs be looked up again, since another version of the program is shown.
    pub(super) fn forget_points(&mut self) {
        self.points = None;
    }
}

impl Session<'_> {
    /// The forces in effect.
    pub(super) fn forces(&self) -> Vec<ForcedValue> {
        if let Some(status) = self.link.as_ref().and_then(|link| link.status()) {
            let named = |force: &Force| {
                let (by, since) = forced_by(status, &force.name).unzip();
                let (name, value) = (force.name.clone(), force.value.clone());
                ForcedValue { name, value, by, since }
            };
            return status.forces.iter().map(named).collect();
        }
        // Those in a program that is run here.
        let own = self.debugger.as_ref().map(|debugger| debugger.history().forces());
        let own = own.unwrap_or_default().into_iter();
        own.map(|(name, value)| {
            let value = value.to_string();
            ForcedValue { name, value, by: None, since: None }
        })
        .collect()
    }

    /// Whether the control (or the program that is run here) allows something.
    pub(super) fn allows(&self, what: &str) -> bool {
        match &self.link {
            Some(link) => {
                link.status().is_some_and(|status| status.allow.iter().any(|word| word == what))
            }
            None => self.debugger.as_ref().is_some_and(|debugger| debugger.may_change()),
        }
    }

    fn points(&mut self) -> Result<Vec<IoPoint>, Refusal> {
        if let Some(points) = &self.io.points {
            return Ok(points.clone());
        }
        let Some(debugger) = &mut self.debugger else {
            return Err(Refusal::new(
                "without the program its inputs and outputs are not known; name its source \
                 after the socket",
            ));
        };
        let program = debugger.program().shared();
        let executive = debugger.history_mut().executive();
        let names = executive.names();
        let declared: Vec<String> = names.declared().into_iter().map(|(name, _)| name).collect();
        let mut points = program.io_points(&declared, executive.image());
        for point in &mut points {
            let found = names.find(&point.name, Purpose::Watch);
            match found.map(|key| names.properties(key).direction) {
                Ok(Direction::Input) => point.output = false,
                Ok(Direction::Output) => point.output = true,
                // Flags to the NC, and what the program has moved into the memory of inputs and outputs.
                Ok(Direction::Internal) | Err(_) => {}
            }
        }
        self.io.points = Some(points.clone());
        Ok(points)
    }

    pub(super) fn io_view(&mut self) -> Result<IoView, Refusal> {
        let points = self.points()?;
        let mut names: Vec<String> = vec![];
        for point in &points {
            names.push(point.name.clone());
            names.extend(point.lines.iter().cloned());
        }
        let moment = self.read(&names)?;
        let forces = self.forces();
        let program = self.debugger.as_ref().map(|debugger| debugger.program());
        let said_line = |name: &str| {
            let said = program.and_then(|program| program.given().said_of(name));
            said.map(|said| said.line()).unwrap_or_default()
        };
        let row = |point: &IoPoint| {
            let value = moment.values.get(&point.name).copied();
            let last = self.io.last.get(&point.name).copied();
            let lines: Option<Vec<bool>> =
                point.lines.iter().map(|line| Some(moment.values.get(line)? != &0.0)).collect();
            let physical = lines.filter(|lines| !lines.is_empty()).map(|lines| {
                let digits = lines.iter().rev().map(|&on| if on { '1' } else { '0' });
                digits.collect::<String>()
            });
            IoRow {
                text: said_line(&point.name),
                said: self.said(&point.name),
                name: point.name.clone(),
                place: point.place.clone(),
                logical: value.map_or_else(|| "?".into(), number),
                physical,
                forced: forces
                    .iter()
                    .find(|force| force.name == point.name)
                    .map(|force| force.value.clone()),
                bit: point.bit,
                changed: last.is_some() && last != value,
            }
        };
        let window = |title: &str, outputs: bool| IoWindow {
            title: title.into(),
            outputs,
            rows: points.iter().filter(|point| point.output == outputs).map(row).collect(),
        };
        let windows = vec![window("Outputs", true), window("Inputs", false)];
        let text = moment.live.then_some(moment.text);
        self.io.last = moment.values;
        let warning = (!self.io.confirmed).then(|| WARNING.to_owned());
        Ok(IoView { windows, moment: text, warning })
    }

    pub(super) fn confirm_warning(&mut self) -> Result<Reply, Refusal> {
        match std::mem::take(&mut self.confirm.is_asked) {
            true => self.confirm.is_confirmed = true,
            false => self.io.confirmed = true,
        }
        Ok(Reply::default())
    }

    pub(super) fn force(&mut self, name: &str, value: &str) -> Result<Reply, Refusal> {
        if !self.allows("force") {
            let Some(link) = &mut self.link else {
                return Err(Refusal::new("nothing can be forced in a recording"));
            };
            // A control that does not answer may allow it.
            link.ask_status()?;
            if !self.allows("force") {
                return Err(Refusal::new("the control was started without --allow force"));
            }
        }
        if !self.io.confirmed {
            return Err(Refusal {
                message: "the warning must be confirmed first".into(),
                warning: Some(WARNING.into()),
            });
        }
        let name = self.defined_name(name).unwrap_or_else(|| name.trim().to_owned());
        self.ask_before(&name, Some(value), true)?;
        let tick = self.act(&name, Some(value), true)?;
        Ok(Reply::message(format!("{name} is forced to {value} from tick {tick} on")))
    }

    pub(super) fn release(&mut self, name: &str) -> Result<Reply, Refusal> {
        let name = self.defined_name(name).unwrap_or_else(|| name.trim().to_owned());
        if self.link.is_none() && !self.forces().iter().any(|force| force.name == name) {
            return Err(Refusal::new(format!("{name} is not forced")));
        }
        self.ask_before(&name, None, true)?;
        let tick = self.act(&name, None, true)?;
        Ok(Reply::message(format!("{name} is not forced from tick {tick} on")))
    }

    pub(super) fn release_all(&mut self) -> Result<Reply, Refusal> {
        if let Some(link) = &mut self.link {
            link.release(None)?;
            return Ok(Reply::message("nothing is forced any more"));
        }
        for force in self.forces() {
            self.act(&force.name, None, true)?;
        }
        Ok(Reply::message("nothing is forced any more"))
    }
}
