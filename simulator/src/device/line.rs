//! A line of a device, which a `!` before its name inverts.

use plcc_abi::machine::simulator::Located;

use super::Surroundings;
use crate::access::{Access, Handle, Use};

/// A line.
#[derive(Clone, Debug)]
pub(crate) struct Line {
    handle: Handle,
    inverted: bool,
    /// Whether it is a physical output, which has no power while the machine is off.
    is_output: bool,
}

impl Line {
    fn find(access: &mut dyn Access, name: &Located<String>, wanted: Use) -> Result<Self, String> {
        let text = name.value.trim();
        let (plain, inverted) = match text.strip_prefix('!') {
            Some(plain) => (plain.trim(), true),
            None => (text, false),
        };
        let found = access.find(plain, wanted);
        let handle = found.map_err(|why| format!("line {}: {why}", name.line))?;
        let is_output = wanted == Use::Lines && access.is_output_line(handle);
        Ok(Self { handle, inverted, is_output })
    }

    /// One that is read.
    pub(crate) fn output(access: &mut dyn Access, name: &Located<String>) -> Result<Self, String> {
        Self::find(access, name, Use::Lines)
    }

    /// One that is written.
    pub(crate) fn input(access: &mut dyn Access, name: &Located<String>) -> Result<Self, String> {
        Self::find(access, name, Use::Write)
    }

    pub(crate) fn handle(&self) -> Handle {
        self.handle
    }

    pub(crate) fn is_on(&self, around: &Surroundings<'_>, access: &dyn Access) -> bool {
        let live = around.outputs_live || !self.is_output;
        (live && access.read(self.handle) != 0) != self.inverted
    }

    pub(crate) fn write(&self, access: &mut dyn Access, on: bool) {
        access.write(self.handle, i64::from(on != self.inverted));
    }

    /// Writes a number, of which `!` inverts nothing.
    pub(crate) fn write_number(&self, access: &mut dyn Access, number: i64) {
        access.write(self.handle, number);
    }
}
