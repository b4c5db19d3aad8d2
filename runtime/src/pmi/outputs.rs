//! The physical outputs of a PMI control: the lines of the ports on which the program has declared
//! outputs, and what they become at a stop (PMI 2.2.7; rulings, PMI).

use plcc_abi::image::write_u8;
use plcc_abi::pmi::{Lines, PORTS, PmiVariable};

use crate::safe_outputs::{SafeLines, SafeOutput, SafeOutputs, SafeValue, does_not_fit};
use crate::{Executive, NameError, Purpose, Setting, Variable};

use super::port_lines;
use super::tick::PmiExecutive;

/// Without an option all lines of every port with an output are off, also those lines that no output
/// declares.
pub(super) fn all_off(outputs: &[(Lines, u32)], ports: u32) -> SafeLines {
    let mut lines = SafeLines::default();
    for (output, _) in outputs {
        lines.set(ports + u32::from(output.port), 0xFF, 0);
    }
    lines
}

impl PmiExecutive {
    /// The declared outputs by their names.
    pub(super) fn declared_outputs(&mut self) -> Vec<(String, Variable)> {
        let symbols = self.names.symbols.iter().zip(0..);
        let outputs = symbols.filter(|(symbol, _)| symbol.role.output().is_some());
        let named: Vec<(String, u32)> = outputs.map(|(s, index)| (s.name.clone(), index)).collect();
        let found = named.into_iter();
        found.map(|(name, index)| (name, self.names.remember(PmiVariable::Symbol(index)))).collect()
    }

    /// What the lines become when `outputs` says so.
    pub(super) fn safe_lines_of(
        &mut self,
        outputs: &SafeOutputs,
    ) -> Result<SafeLines, Vec<NameError>> {
        all_off(&self.outputs, self.ports)
            .with(outputs, |lines, output| self.add_safe_output(lines, output))
    }

    /// Adds an entry: a declared output, or a line of a port that has one.
    fn add_safe_output(
        &mut self,
        safe: &mut SafeLines,
        SafeOutput { name, value }: &SafeOutput,
    ) -> Result<(), NameError> {
        let variable = self.find(name, Purpose::Watch)?;
        let number = match value {
            SafeValue::Value(text) => match self.parse(variable, text) {
                Ok(Setting::Int(number)) => number,
                _ => return Err(does_not_fit(name, text)),
            },
            SafeValue::Off | SafeValue::Hold => 0,
        };
        let unfit = |reason: &str| NameError::Unfit { name: name.clone(), reason: reason.into() };
        let output = match self.names.get(variable) {
            Some(PmiVariable::Symbol(index)) => {
                self.names.symbol(index).and_then(|s| s.role.output())
            }
            _ => None,
        };
        let (port, mask, bits, fits) = match (self.names.get(variable), output) {
            (_, Some(lines)) => {
                let (mask, bits) = port_lines::bits(lines, number as i16);
                let carried = i64::from(port_lines::decode(lines, bits));
                (lines.port, mask, bits, carried == number)
            }
            (Some(PmiVariable::Line(port, bit)), None) if u32::from(port) < PORTS => {
                if !self.outputs.iter().any(|(lines, _)| lines.port == port) {
                    return Err(unfit("is a line of a port on which the program has no output"));
                }
                let on = u8::from(number != 0) << bit;
                (port, 1 << bit, on, matches!(number, 0 | 1))
            }
            _ => return Err(unfit("is no output of the program")),
        };
        if !fits && let SafeValue::Value(text) = value {
            return Err(does_not_fit(name, text));
        }
        safe.apply(value, self.ports + u32::from(port), mask, bits);
        Ok(())
    }

    /// E-stop: the program is stopped by an error. Variables keep their values.
    pub(super) fn emergency_stop(&mut self) {
        write_u8(&mut self.image, self.special.estop, 1);
        self.drive_safe_outputs();
    }
}
