//! The physical output lines of an NCT control, and what they become at a stop (rulings, NCT: the
//! physical outputs go to 0).

use plcc_abi::nct::{LINE_BYTES, NctName};

use crate::safe_outputs::{SafeLines, SafeOutput, SafeOutputs, SafeValue, does_not_fit};
use crate::{NameError, Purpose, Setting};

use super::names::{self, NctNames};

/// Without an option every line is off. `lines` is the offset of the first byte of lines.
pub(super) fn all_off(lines: u32) -> SafeLines {
    let mut safe = SafeLines::default();
    for byte in 0..LINE_BYTES as u32 {
        safe.set(lines + byte, 0xFF, 0);
    }
    safe
}

impl NctNames {
    /// What the lines become when `outputs` says so.
    pub(super) fn lines_at_stop(&self, outputs: &SafeOutputs) -> Result<SafeLines, Vec<NameError>> {
        all_off(self.lines_out()).with(outputs, |lines, output| self.add_safe_output(lines, output))
    }

    /// Adds an entry: a line `O012` or two bytes of lines `O02`, or the same as `Y012` and `Y02`, by
    /// the flags that drive them.
    fn add_safe_output(
        &self,
        safe: &mut SafeLines,
        SafeOutput { name, value }: &SafeOutput,
    ) -> Result<(), NameError> {
        let unfit = |reason: &str| NameError::Unfit { name: name.clone(), reason: reason.into() };
        let (byte, bit) = match self.variable(name, Purpose::Watch)? {
            NctName::O { byte, bit } | NctName::Y { byte, bit } => (byte, bit),
            _ => return Err(unfit("is not a physical output; those are O000 and on")),
        };
        if byte >= self.line_bytes() {
            return Err(unfit("drives no line of an interface board that the machine has"));
        }
        let number = match value {
            SafeValue::Value(text) => match names::parse(text) {
                Ok(Setting::Int(number)) => u16::try_from(number).ok(),
                _ => None,
            }
            .filter(|&number| bit.is_none() || number <= 1)
            .ok_or_else(|| does_not_fit(name, text))?,
            SafeValue::Off | SafeValue::Hold => 0,
        };
        let at = self.lines_out() + u32::from(byte);
        match bit {
            Some(bit) => safe.apply(value, at, 1 << bit, (number as u8) << bit),
            None => {
                let [low, high] = number.to_le_bytes();
                safe.apply(value, at, 0xFF, low);
                if usize::from(byte) + 1 < LINE_BYTES {
                    safe.apply(value, at + 1, 0xFF, high);
                }
            }
        }
        Ok(())
    }
}
