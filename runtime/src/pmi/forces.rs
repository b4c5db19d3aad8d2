//! Forces: inputs whose latched value, and outputs whose physical lines, are held at a value that
//! somebody outside has chosen (`plcctl force`; PMI 5.3, I/O Display).
//!
//! A forced input has the value as the program sees it; its lines stay what they are. A forced output
//! has the value on its lines; the variable stays what the program assigns.

use plcc_abi::pmi::{Format, Lines, Role, Symbol};
use serde::{Deserialize, Serialize};

use super::port_lines;
use crate::force_list::{ForceList, ONE_BIT};

/// A force on one input or output.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct Force {
    lines: Lines,
    /// Where the input's variable is; `None` for an output.
    input: Option<u32>,
    value: i16,
}

/// The forces in effect.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Forces {
    /// By the indices of their symbols.
    list: ForceList<u32, Force>,
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
        let (lines, input) = match symbol.role {
            Role::Input(lines) => (lines, Some(symbol.offset)),
            Role::Output(lines) => (lines, None),
            _ => return Err("is neither an input nor an output, and can't be forced"),
        };
        if lines.format == Format::Bit && !matches!(value, 0 | 1) {
            return Err(ONE_BIT);
        }
        if !port_lines::fits(lines, value) {
            return Err("has lines that can't carry this value in BCD");
        }
        self.list.set(index, Force { lines, input, value: value as i16 })
    }

    /// Makes room for all forces there can be, as at power-up, so that forcing allocates nothing.
    /// `None` where there are more than that.
    pub(super) fn with_room(self) -> Option<Self> {
        Some(Self { list: self.list.with_room()? })
    }

    /// Ends the force on the symbol with this index.
    pub(super) fn remove(&mut self, index: u32) {
        self.list.remove(&index);
    }

    /// Whether the symbol with this index is an input that is forced.
    pub(super) fn holds(&self, index: u32) -> bool {
        self.list.get(&index).is_some_and(|force| force.input.is_some())
    }

    /// The indices of the forced symbols, with their values.
    pub(super) fn values(&self) -> impl Iterator<Item = (u32, i16)> + '_ {
        self.list.entries().map(|(&index, force)| (index, force.value))
    }

    /// Puts forced inputs' values in the place of those that were latched.
    pub(super) fn apply_to_inputs(&self, mut write: impl FnMut(Lines, u32, i16)) {
        for force in self.list.iter() {
            if let Some(offset) = force.input {
                write(force.lines, offset, force.value);
            }
        }
    }

    /// Puts forced outputs' values on their lines.
    pub(super) fn apply_to_outputs(&self, image: &mut [u8], ports: u32) {
        for force in self.list.iter().filter(|force| force.input.is_none()) {
            port_lines::drive(image, ports, force.lines, force.value);
        }
    }
}
