//! Forces: inputs whose latched value, and outputs whose physical lines, are held at a value that
//! somebody outside has chosen (`plcctl force`; PMI 5.3, I/O Display).
//!
//! A forced input has the value as the program sees it; its lines stay what they are. A forced output
//! has the value on its lines; the variable stays what the program assigns. A forced line of an input is latched with the
//! value, and one of an output has it.

use plcc_abi::pmi::{Format, Lines, PmiVariable, Role, Symbol};
use serde::{Deserialize, Serialize};

use super::port_lines;
use crate::force_list::{ForceList, ONE_BIT};

/// What a force acts on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
enum Side {
    /// The variable of an input, at this offset.
    Input(u32),
    /// A line as inputs latch it.
    InputLine,
    /// The lines of an output.
    Output,
}

/// A force on an input, an output or a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct Force {
    lines: Lines,
    side: Side,
    value: i16,
}

/// The forces in effect.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Forces {
    /// By the symbols and lines.
    list: ForceList<PmiVariable, Force>,
}

impl Forces {
    /// Forces the symbol with this index.
    ///
    /// # Errors
    /// When it is neither an input nor an output, can't have the value, or there are too many
    /// forces.
    pub(super) fn set(
        &mut self,
        index: u32,
        symbol: &Symbol,
        value: i64,
    ) -> Result<(), &'static str> {
        let (lines, side) = match symbol.role {
            Role::Input(lines) => (lines, Side::Input(symbol.offset)),
            Role::Output(lines) => (lines, Side::Output),
            _ => return Err("is neither an input nor an output, and can't be forced"),
        };
        if lines.format == Format::Bit && !matches!(value, 0 | 1) {
            return Err(ONE_BIT);
        }
        if !port_lines::fits(lines, value) {
            return Err("has lines that can't carry this value in BCD");
        }
        self.list.set(PmiVariable::Symbol(index), Force { lines, side, value: value as i16 })
    }

    /// Forces a line: as inputs latch it, or as an output has it.
    ///
    /// # Errors
    /// When it is to be neither 0 nor 1, or there are too many forces.
    pub(super) fn set_line(
        &mut self,
        (port, low): (u16, u8),
        is_input: bool,
        value: i64,
    ) -> Result<(), &'static str> {
        if !matches!(value, 0 | 1) {
            return Err(ONE_BIT);
        }
        let lines = Lines { port, low, count: 1, format: Format::Bit };
        let side = if is_input { Side::InputLine } else { Side::Output };
        self.list.set(PmiVariable::Line(port, low), Force { lines, side, value: value as i16 })
    }

    /// Makes room for all forces there can be, as at power-up, so that forcing allocates nothing.
    /// `None` where there are more than that.
    pub(super) fn with_room(self) -> Option<Self> {
        Some(Self { list: self.list.with_room()? })
    }

    /// Ends the force on a symbol or line.
    pub(super) fn remove(&mut self, variable: PmiVariable) {
        self.list.remove(&variable);
    }

    /// Whether a symbol is an input that is forced.
    pub(super) fn holds(&self, variable: PmiVariable) -> bool {
        self.list.get(&variable).is_some_and(|force| matches!(force.side, Side::Input(_)))
    }

    /// The forced symbols and lines, with their values.
    pub(super) fn values(&self) -> impl Iterator<Item = (PmiVariable, i16)> + '_ {
        self.list.entries().map(|(&variable, force)| (variable, force.value))
    }

    /// What inputs latch of a port: its byte, with the lines that are forced.
    pub(super) fn latched(&self, port: u16, byte: u8) -> u8 {
        let lines = self.list.iter().filter(|force| force.side == Side::InputLine);
        lines.filter(|force| force.lines.port == port).fold(byte, |byte, force| {
            let (mask, bits) = port_lines::bits(force.lines, force.value);
            byte & !mask | bits
        })
    }

    /// Puts forced inputs' values in the place of those that were latched.
    pub(super) fn apply_to_inputs(&self, mut write: impl FnMut(Lines, u32, i16)) {
        for force in self.list.iter() {
            if let Side::Input(offset) = force.side {
                write(force.lines, offset, force.value);
            }
        }
    }

    /// Puts forced outputs' values on their lines.
    pub(super) fn apply_to_outputs(&self, image: &mut [u8], ports: u32) {
        for force in self.list.iter().filter(|force| force.side == Side::Output) {
            port_lines::drive(image, ports, force.lines, force.value);
        }
    }
}
