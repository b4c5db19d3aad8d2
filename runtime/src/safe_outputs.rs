//! Safe outputs: what the physical outputs become when the program no longer drives them.
//!
//! A control stops its program after a trap, when the watchdog trips, after an error inside plcc, and
//! by the policy for overruns; a signal ends the run. In each case every physical output takes its
//! safe value: 0, unless the option `--safe NAME=VALUE` or the section `[safe]` of the configuration
//! says otherwise ([`SafeOutputs`]). The variables that the program sees keep their values, so that
//! people can find out afterwards what has happened.
//!
//! Physical outputs are bits of the process image in every language, and [`SafeLines`] is a list of the
//! bytes that hold them. With that list another process can drive the safe values too, when the control
//! itself is dead:
//!
//! ```
//! use plcc_runtime::safe_outputs::SafeLines;
//!
//! let mut lines = SafeLines::default();
//! lines.set(2, 0xFF, 0);          // all lines of the byte at offset 2 are off,
//! lines.set(2, 0x80, 0x80);       // but the highest one is on
//! lines.hold(2, 0x01);            // and the lowest one stays what it is.
//! let mut image = [0, 0, 0x33];
//! lines.drive(&mut image);
//! assert_eq!(image, [0, 0, 0x81]);
//! ```

use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::NameError;

/// What one physical output becomes.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum SafeValue {
    /// It is switched off: 0.
    Off,
    /// It stays what it is.
    Hold,
    /// It takes a value, written as in a stimulus.
    Value(String),
}

impl SafeValue {
    /// Reads `off`, `hold` or a value. Whether a value fits its output is found out when the
    /// executive takes it.
    pub fn parse(text: &str) -> Self {
        match text.trim() {
            text if text.eq_ignore_ascii_case("off") => Self::Off,
            text if text.eq_ignore_ascii_case("hold") => Self::Hold,
            text => Self::Value(text.into()),
        }
    }
}

/// A physical output by its name, and what it becomes.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SafeOutput {
    /// The output's name in the dialect's spelling, see [`Names::outputs`](crate::Names::outputs).
    pub name: String,
    /// What it becomes.
    pub value: SafeValue,
}

impl FromStr for SafeOutput {
    type Err = String;

    /// Reads `NAME=off`, `NAME=hold` or `NAME=VALUE`.
    fn from_str(text: &str) -> Result<Self, String> {
        let (name, value) = text
            .split_once('=')
            .filter(|(name, value)| !name.trim().is_empty() && !value.trim().is_empty())
            .ok_or("an output and what it becomes are expected, as in PUMP=off or LAMP=hold")?;
        Ok(Self { name: name.trim().into(), value: SafeValue::parse(value) })
    }
}

/// The outputs that are not simply switched off. Where two entries name the same line, the later one
/// counts.
pub type SafeOutputs = [SafeOutput];

/// A byte of the process image that holds physical outputs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SafeByte {
    /// Its offset in the image.
    pub offset: u32,
    /// The bits that stay what they are: those that are held, and those that are not outputs.
    pub keep: u8,
    /// The bits that become 1.
    pub set: u8,
}

/// The bytes of the process image that hold physical outputs, by rising offset.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SafeLines(Vec<SafeByte>);

impl SafeLines {
    /// The bits of `mask` in the byte at `offset` are outputs, which become as they are in `bits`.
    pub fn set(&mut self, offset: u32, mask: u8, bits: u8) {
        let byte = self.byte(offset);
        byte.keep &= !mask;
        byte.set = byte.set & !mask | bits & mask;
    }

    /// The bits of `mask` in the byte at `offset` stay what they are.
    pub fn hold(&mut self, offset: u32, mask: u8) {
        let byte = self.byte(offset);
        byte.keep |= mask;
        byte.set &= !mask;
    }

    /// Does what `value` says with the bits of `mask` in the byte at `offset`; `bits` are those of a
    /// [`SafeValue::Value`].
    pub(crate) fn apply(&mut self, value: &SafeValue, offset: u32, mask: u8, bits: u8) {
        match value {
            SafeValue::Off => self.set(offset, mask, 0),
            SafeValue::Hold => self.hold(offset, mask),
            SafeValue::Value(_) => self.set(offset, mask, bits),
        }
    }

    /// The lines with all `outputs` added, each by `add`.
    ///
    /// # Errors
    /// Those of all outputs that could not be added.
    pub(crate) fn with(
        mut self,
        outputs: &SafeOutputs,
        mut add: impl FnMut(&mut Self, &SafeOutput) -> Result<(), NameError>,
    ) -> Result<Self, Vec<NameError>> {
        let added = outputs.iter().map(|output| add(&mut self, output));
        let errors: Vec<_> = added.filter_map(Result::err).collect();
        if errors.is_empty() { Ok(self) } else { Err(errors) }
    }

    /// The entry of a byte; a new one keeps all its bits.
    #[allow(clippy::indexing_slicing, reason = "the entry was found or inserted at this index")]
    fn byte(&mut self, offset: u32) -> &mut SafeByte {
        let at = self.0.partition_point(|byte| byte.offset < offset);
        if self.0.get(at).is_none_or(|byte| byte.offset != offset) {
            self.0.insert(at, SafeByte { offset, keep: 0xFF, set: 0 });
        }
        &mut self.0[at]
    }

    /// The bytes.
    pub fn bytes(&self) -> &[SafeByte] {
        &self.0
    }

    /// Whether [`drive`](Self::drive) sets any of the bits of `mask` in the byte at `offset`: those of
    /// physical outputs that are not held.
    pub fn drives(&self, offset: u32, mask: u8) -> bool {
        let found = self.0.binary_search_by_key(&offset, |byte| byte.offset);
        found.is_ok_and(|at| self.0.get(at).is_some_and(|byte| !byte.keep & mask != 0))
    }

    /// Gives the outputs in a process image their safe values. Bytes outside it are passed over.
    pub fn drive(&self, image: &mut [u8]) {
        for byte in &self.0 {
            if let Some(slot) = image.get_mut(byte.offset as usize) {
                *slot = *slot & byte.keep | byte.set;
            }
        }
    }
}

/// The error of an entry whose value the output's lines can't carry.
pub(crate) fn does_not_fit(name: &str, value: &str) -> NameError {
    let reason = format!(
        "can't be made `{value}`: `off`, `hold` or a value that its lines can carry is expected"
    );
    NameError::Unfit { name: name.into(), reason }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_entry_names_an_output_and_what_it_becomes() {
        let read = |text: &str| text.parse::<SafeOutput>().map(|entry| (entry.name, entry.value));
        assert_eq!(read("PUMP=off"), Ok(("PUMP".into(), SafeValue::Off)));
        assert_eq!(read(" O012 = HOLD "), Ok(("O012".into(), SafeValue::Hold)));
        assert_eq!(read("Y:$FFC2=$FF"), Ok(("Y:$FFC2".into(), SafeValue::Value("$FF".into()))));
        for text in ["", "PUMP", "=1", "PUMP=", "PUMP= "] {
            assert!(read(text).is_err(), "{text}");
        }
    }

    #[test]
    fn the_later_entry_counts_and_other_bits_stay() {
        let mut lines = SafeLines::default();
        lines.set(3, 0x0F, 0);
        lines.hold(3, 0x03);
        lines.set(3, 0x02, 0x02);
        lines.set(1, 0x80, 0x80);
        assert_eq!(lines.bytes().iter().map(|byte| byte.offset).collect::<Vec<_>>(), [1, 3]);
        let mut image = [0, 0, 0, 0xA5];
        lines.drive(&mut image);
        assert_eq!(image, [0, 0x80, 0, 0xA3]);
        assert!(lines.drives(3, 0x04) && !lines.drives(3, 0x01) && !lines.drives(2, 0xFF));
        lines.set(100, 0xFF, 0xFF);
        lines.drive(&mut image);
        assert_eq!(image, [0, 0x80, 0, 0xA3]);
    }
}
