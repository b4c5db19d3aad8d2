//! The physical outputs of a PMI control: the lines of the ports on which the program has declared
//! outputs, and what they become at a stop (PMI 2.2.7; rulings, PMI).

use plcc_abi::image::write_u8;
use plcc_abi::pmi::{Lines, PORTS, PmiVariable};

use crate::names::Names;
use crate::safe_outputs::{SafeLines, SafeOutput, SafeOutputs, SafeValue, does_not_fit};
use crate::{Executive, NameError, Purpose, Setting};

use super::names::{PmiNames, key};
use super::port_lines;
use super::tick::PmiExecutive;

impl PmiNames {
    /// The lines of the declared outputs.
    fn output_lines(&self) -> impl Iterator<Item = Lines> + '_ {
        self.symbols.iter().filter_map(|symbol| symbol.role.output())
    }

    /// Without an option all lines of every port with an output are off, also those lines that no output
    /// declares.
    pub(super) fn all_off(&self) -> SafeLines {
        let mut lines = SafeLines::default();
        for output in self.output_lines() {
            lines.set(self.ports + u32::from(output.port), 0xFF, 0);
        }
        lines
    }

    /// What the lines become when `outputs` says so.
    pub(super) fn lines_at_stop(&self, outputs: &SafeOutputs) -> Result<SafeLines, Vec<NameError>> {
        self.all_off().with(outputs, |lines, output| self.add_safe_output(lines, output))
    }

    /// Adds an entry: a declared output, or a line of a port that has one.
    fn add_safe_output(
        &self,
        safe: &mut SafeLines,
        SafeOutput { name, value }: &SafeOutput,
    ) -> Result<(), NameError> {
        let variable = self.variable(name, Purpose::Watch)?;
        let number = match value {
            SafeValue::Value(text) => match self.parse(key(variable), text) {
                Ok(Setting::Int(number)) => number,
                _ => return Err(does_not_fit(name, text)),
            },
            SafeValue::Off | SafeValue::Hold => 0,
        };
        let unfit = |reason: &str| NameError::Unfit { name: name.clone(), reason: reason.into() };
        let output = match variable {
            PmiVariable::Symbol(index) => self.symbol(index).and_then(|s| s.role.output()),
            _ => None,
        };
        let (port, mask, bits, fits) = match (variable, output) {
            (_, Some(lines)) => {
                let (mask, bits) = port_lines::bits(lines, number as i16);
                let carried = i64::from(port_lines::decode(lines, bits));
                (lines.port, mask, bits, carried == number)
            }
            (PmiVariable::Line(port, bit), None) if u32::from(port) < PORTS => {
                if !self.output_lines().any(|lines| lines.port == port) {
                    return Err(unfit("is a line of a port on which the program has no output"));
                }
                let on = u8::from(number != 0) << bit;
                (port, 1 << bit, on, matches!(number, 0 | 1))
            }
            _ => return Err(unfit("is not an output of the program")),
        };
        if !fits && let SafeValue::Value(text) = value {
            return Err(does_not_fit(name, text));
        }
        safe.apply(value, self.ports + u32::from(port), mask, bits);
        Ok(())
    }
}

impl PmiExecutive {
    /// E-stop: the program is stopped by an error. Variables keep their values.
    pub(super) fn emergency_stop(&mut self) {
        write_u8(&mut self.image, self.special.estop, 1);
        self.drive_safe_outputs();
    }
}
