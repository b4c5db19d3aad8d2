//! What an executive offers the simulator: find a name, read, write.

use std::ops::Range;

/// A variable of the program that was found, by its number at the one who offers it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Handle(pub u32);

/// What a name is found for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Use {
    /// To read what the program or the operator has set.
    Read,
    /// To read the physical lines that the end of the last tick left, or any other bit.
    Lines,
    /// To read eight flags as one byte; the name is that of the lowest one.
    Byte,
    /// To write it.
    Write,
    /// To set it as a row of the stimulus does.
    Row,
}

/// The program's variables.
pub trait Access {
    /// Finds a name for a use. The same name may be found several times.
    ///
    /// # Errors
    /// A sentence that says why it can't be used.
    fn find(&mut self, name: &str, wanted: Use) -> Result<Handle, String>;

    /// Whether a variable that was found to be written can hold a number.
    fn holds(&self, variable: Handle, number: i64) -> bool;

    /// Whether two variables that were found share a bit.
    fn overlap(&self, a: Handle, b: Handle) -> bool;

    /// Whether a variable that was found is a physical output line.
    fn is_output_line(&self, variable: Handle) -> bool;

    /// Reads a variable as it is seen in this tick.
    fn read(&self, variable: Handle) -> i64;

    /// Writes a variable, unless a row has set it in this tick. It is true if the variable had this value already.
    fn write(&mut self, variable: Handle, value: i64) -> bool;

    /// Sets a variable as a row of the stimulus does, so that nothing else is written in this tick.
    fn row(&mut self, variable: Handle, value: i64);

    /// The range of the process image from the first to the last byte of some variables. `None` where one of them lies elsewhere.
    fn range(&self, variables: &[Handle]) -> Option<Range<usize>>;

    /// The process image as it is now.
    fn image(&self) -> &[u8];

    /// A number that grows whenever a write may have been refused, or anything but a write may have set a variable. While it
    /// stays, a flag outside of the image has the value that was written to it last.
    fn revision(&self) -> u64;
}

/// A variable of the control that the program need not have.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Variable(Option<Handle>);

impl Variable {
    /// Finds it, if it is there.
    pub(crate) fn find(access: &mut dyn Access, name: &str, wanted: Use) -> Self {
        Self(access.find(name, wanted).ok())
    }

    /// Its value; 0 where it is not there.
    pub(crate) fn read(self, access: &dyn Access) -> i64 {
        self.0.map_or(0, |handle| access.read(handle))
    }

    /// Whether it is not 0.
    pub(crate) fn is_on(self, access: &dyn Access) -> bool {
        self.read(access) != 0
    }

    /// Writes it, where it is there. It is true if there was nothing to write.
    pub(crate) fn write(self, access: &mut dyn Access, value: i64) -> bool {
        self.0.is_none_or(|handle| access.write(handle, value))
    }

    /// Its handle.
    pub(crate) fn handle(self) -> Option<Handle> {
        self.0
    }
}

/// The part of the process image in which some variables lie, with a copy of it. To compare both is quicker than to read all of the
/// variables.
#[derive(Clone, Debug, Default)]
pub(crate) struct ImagePart {
    /// `None` where the variables do not all lie in the image.
    range: Option<Range<usize>>,
    bytes: Vec<u8>,
    is_valid: bool,
}

impl ImagePart {
    /// The part in which these lie, not copied yet.
    pub(crate) fn of(variables: impl Iterator<Item = Variable>, access: &dyn Access) -> Self {
        let handles: Vec<Handle> = variables.filter_map(Variable::handle).collect();
        let range = access.range(&handles);
        let length = range.as_ref().map_or(0, Range::len);
        Self { range, bytes: vec![0; length], is_valid: false }
    }

    fn part<'a>(&self, access: &'a dyn Access) -> Option<&'a [u8]> {
        access.image().get(self.range.clone()?)
    }

    /// Whether the image is as it was when it was copied.
    pub(crate) fn is_same(&self, access: &dyn Access) -> bool {
        self.is_valid && self.part(access) == Some(&*self.bytes)
    }

    /// Copies it as it is now.
    pub(crate) fn copy(&mut self, access: &dyn Access) {
        let part = self.part(access).filter(|part| part.len() == self.bytes.len());
        self.is_valid = part.map(|part| self.bytes.copy_from_slice(part)).is_some();
    }

    /// Until it is copied again it is not the same.
    pub(crate) fn forget(&mut self) {
        self.is_valid = false;
    }
}
