//! What an executive offers the simulator: find a name, read, write.

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

    /// Writes a variable, unless a row has set it in this tick.
    fn write(&mut self, variable: Handle, value: i64);

    /// Sets a variable as a row of the stimulus does, so that nothing else is written in this tick.
    fn row(&mut self, variable: Handle, value: i64);

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

    /// Writes it, where it is there.
    pub(crate) fn write(self, access: &mut dyn Access, value: i64) {
        if let Some(handle) = self.0 {
            access.write(handle, value);
        }
    }

    /// Its handle.
    pub(crate) fn handle(self) -> Option<Handle> {
        self.0
    }
}
